"""The conformance suite of readers. A third party's tests are

    from seatruth.testing.readers import ReaderConformance, Sample

    class TestMine(ReaderConformance):
        reader = "mine"

        @pytest.fixture
        def sample(self, tmp_path):
            ...  # write a file of the format with its own library
            return Sample(file, {"u": [1.0, 1.2], "GPS.lat": [54.1, 54.2]})

and inherit every check below. The reader must be installed: its entry point is what seatruth finds it by.
"""

from __future__ import annotations

import hashlib
import random
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.readers import Log, Reader, available, read_log
from seatruth.readers.registry import chosen

FOREIGN = (
    b"t,u\n0,1\n1,2\n",
    b"\x00\x01\x02\x03" * 20,
    b"PK\x03\x04" + bytes(60),
    b"%PDF-1.4\n",
    b"\x89PNG\r\n\x1a\n",
    b"#!/bin/sh\n",
)
"""Beginnings of files of other formats."""


@dataclass(frozen=True)
class Sample:
    """A sound file and what is in it.

    Args:
        path: the file.
        fields: name of a field, as a study gives it -> its values.
        rtol: relative error that the format's own rounding allows.
    """

    path: Path
    fields: Mapping[str, Any]
    rtol: float = 1e-12


class ReaderConformance:
    """Checks that every reader must pass; see the module for how to inherit them.

    `reader` is the reader's name; `foreign` beginnings of files that it must not take for its own, by default those of
    common other formats; `damages` how many damaged copies of the sample are tried in each way.
    """

    reader: ClassVar[str]
    foreign: ClassVar[tuple[bytes, ...]] = FOREIGN
    damages: ClassVar[int] = 1

    @pytest.fixture
    def sample(self, tmp_path: Path) -> Sample:
        """A sound file; every inheriting class writes its own."""
        pytest.fail(f"{type(self).__name__} needs a fixture `sample`", pytrace=False)

    def test_reads_what_was_written(self, sample: Sample) -> None:
        before = _digest(sample.path)
        log = read_log(sample.path)
        assert log.reader == self.reader, f"{log.reader} took the file"
        for name, values in sample.fields.items():
            table, column = log.find(name)
            np.testing.assert_allclose(table.numbers(column), values, rtol=sample.rtol, atol=sample.rtol, err_msg=name)
        for table in log.tables.values():
            assert {len(values) for values in table.columns.values()} == {len(table)}
            assert set(table.units) <= set(table.columns)
            clock = log.clock(table)
            if clock is not None:
                assert clock.shape == (len(table),)
                assert np.isfinite(clock).all()
                assert (np.diff(clock) >= 0).all(), f"the clock of {table.name!r} runs back"
        assert _same(read_log(sample.path), log), "a second reading differs"
        assert _digest(sample.path) == before, "reading changed the file"

    def test_knows_its_own_files_alone(self, sample: Sample, tmp_path: Path) -> None:
        kind = self._kind()
        head = b"" if sample.path.is_dir() else sample.path.read_bytes()[:65536]
        assert kind.recognises(head, sample.path)
        for number, content in enumerate(self.foreign):
            assert not kind.recognises(content, tmp_path / f"foreign{number}"), content

    def test_refuses_damaged_files(self, sample: Sample, tmp_path: Path) -> None:
        """Cut and flipped copies give a log or BadInput that names the file, and nothing else."""
        rng = random.Random(1)
        for number in range(self.damages):
            for damage in (_cut, _flipped):
                copy = tmp_path / f"damaged{number}" / sample.path.name
                shutil.rmtree(copy.parent, ignore_errors=True)
                copy.parent.mkdir()
                _copy_damaged(sample.path, copy, damage, rng)
                refused: BadInput | None = None
                try:
                    assert read_log(copy, reader=self.reader).tables
                except BadInput as problem:
                    refused = problem
                assert refused is None or (str(copy) in str(refused) and refused.do), refused

    def test_describes_itself(self) -> None:
        info = available()[self.reader]
        assert not info.error
        assert info.title
        assert info.doc
        assert all(suffix.startswith(".") and suffix == suffix.lower() for suffix in info.suffixes)
        if info.missing:
            pytest.fail(f"{', '.join(info.missing)} is not installed, so that nothing was tested")
        kind = self._kind()
        assert is_dataclass(kind)
        undocumented = [field.name for field in fields(kind) if not field.metadata.get("doc")]
        assert not undocumented, f"options without a word on what they do: {undocumented}"

    def _kind(self) -> type[Reader]:
        return chosen(self.reader)[0]


def _same(first: Log, second: Log) -> bool:
    if list(first.tables) != list(second.tables) or first.notes != second.notes:
        return False
    return all(
        list(table.columns) == list(other.columns)
        and all(table.columns[name].equals(other.columns[name]) for name in table.columns)
        for table, other in zip(first.tables.values(), second.tables.values(), strict=True)
    )


def _digest(path: Path) -> str:
    parts = sorted(path.rglob("*")) if path.is_dir() else [path]
    return hashlib.sha256(b"".join(part.read_bytes() for part in parts)).hexdigest()


def _copy_damaged(source: Path, target: Path, damage: Any, rng: random.Random) -> None:
    """A copy whose largest file is damaged."""
    if source.is_dir():
        shutil.copytree(source, target)
        largest = max(target.rglob("*"), key=lambda part: part.stat().st_size)
    else:
        shutil.copy(source, target)
        largest = target
    largest.write_bytes(damage(largest.read_bytes(), rng))


def _cut(content: bytes, rng: random.Random) -> bytes:
    return content[: rng.randrange(len(content) // 4, len(content))]


def _flipped(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    for _ in range(max(1, len(content) // 2000)):
        changed[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    return bytes(changed)
