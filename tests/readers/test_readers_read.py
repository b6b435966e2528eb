"""How a file finds its reader, and how fields and clocks are found in what it gives."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth.errors import BadInput, PluginError
from seatruth.progress import ProgressEvent
from seatruth.readers import Content, Log, Table, Topic, available, read_log, registry
from seatruth.readers.base import Reader
from seatruth.readers.csv_file import CSV
from seatruth.readers.hdf5 import HDF5
from seatruth.readers.listing import listing
from seatruth.readers.rows import Rows


def log_of(*tables: Table) -> Log:
    return Log("run.log", {table.name: table for table in tables})


def topic(name: str, time: str | None = None, units: dict[str, str] | None = None, **columns: Any) -> Table:
    return Table("run.log", {n: pd.Series(v) for n, v in columns.items()}, units or {}, None, ".", name, time)


def test_a_package_that_is_not_installed_is_named_with_its_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "h5py" else there(name))
    (tmp_path / "run.mat").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    with pytest.raises(BadInput, match=r'needs h5py, which is not installed. Run: pip install "seatruth\[hdf5\]"'):
        read_log(tmp_path / "run.mat")
    assert available()["hdf5"].missing == ("h5py",)


@pytest.mark.parametrize("kind", [HDF5])
def test_every_extra_is_one_of_the_package(kind: type) -> None:
    from importlib.metadata import metadata

    extras = metadata("seatruth").get_all("Provides-Extra") or []
    for info in available().values():
        if info.extra:
            assert info.extra.removeprefix("seatruth[").removesuffix("]") in extras


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x1f\x8b rest", "gzip"),
        (b"PK\x03\x04 rest", "zip archive"),
        (b"%PDF-1.7", "PDF"),
        (b"\0\1\2", "a binary file that no installed reader knows"),
    ],
)
def test_foreign_files_are_called_by_their_names(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(BadInput, match=says) as caught:
        read_log(tmp_path / "a")
    assert "Parquet" in caught.value.do


def test_options_go_to_the_reader_that_has_them(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t;u\n0;1\n1;2\n")
    assert read_log(tmp_path / "a.csv", separator=";", variable="run", encoding=None).table().numbers("u").tolist() == [
        1,
        2,
    ]
    with pytest.raises(BadInput, match=r"no installed reader has an option 'seperator'. Did you mean 'separator'"):
        read_log(tmp_path / "a.csv", seperator=";")
    with pytest.raises(BadInput, match=r"no reader 'cvs' is installed. Did you mean 'csv'"):
        read_log(tmp_path / "a.csv", reader="cvs")


def test_progress_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,u\n0,1\n1,2\n")
    events: list[ProgressEvent] = []
    read_log(tmp_path / "a.csv", progress=events.append)
    assert events[-1].done == events[-1].total == 100
    assert "a.csv" in str(events[-1])


@pytest.mark.parametrize(
    ("topics", "says"),
    [
        ([Topic("", {"a": np.zeros(2), "b": np.zeros(3)})], "shapes"),
        ([Topic("", {"a": np.zeros(2)}, time="t")], "no column"),
        ([Topic("x", {"a": np.zeros(2)}), Topic("x", {"a": np.zeros(2)})], "two topics"),
    ],
)
def test_a_reader_that_breaks_its_contract_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, topics: list[Topic], says: str
) -> None:
    (tmp_path / "a.csv").write_text("t,u\n0,1\n")
    monkeypatch.setattr(CSV, "read", lambda self, path, progress: Content(topics))
    with pytest.raises(PluginError, match=says):
        read_log(tmp_path / "a.csv")


@pytest.mark.parametrize("problem", [RuntimeError("odd"), MemoryError(), OSError(5, "Input/output error")])
def test_whatever_a_reader_raises_is_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, problem: Exception
) -> None:
    def broken(self: CSV, path: Path, progress: object) -> Content:
        raise problem

    (tmp_path / "a.csv").write_text("t,u\n0,1\n")
    monkeypatch.setattr(CSV, "read", broken)
    with pytest.raises(BadInput, match=r"a\.csv"):
        read_log(tmp_path / "a.csv")


def test_plug_ins_that_cannot_be_used_are_listed_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def point(load: Any) -> list[Any]:
        return [SimpleNamespace(name="odd", value="odd:Odd", dist=None, load=load)]

    def fails() -> None:
        raise ImportError("no such thing")

    for load, says in ((fails, "cannot be loaded"), (lambda: int, "not a Reader"), (lambda: Reader, "lacks")):
        monkeypatch.setattr(registry, "points_by_name", lambda load=load: {"odd": point(load)})
        assert says in available()["odd"].error
    monkeypatch.setattr(registry, "points_by_name", lambda: {"odd": [*point(fails), *point(fails)]})
    assert "several packages" in available()["odd"].error


def test_fields_are_found_with_their_topic_or_alone() -> None:
    gps, imu = topic("/gps", lat=[1.0], speed=[2.0]), topic("/gps.imu", speed=[3.0], q=[4.0])
    log = log_of(gps, imu)
    assert log.find("lat") == (gps, "lat")
    assert log.find("/gps.speed") == (gps, "speed")
    assert log.find("/gps.imu.speed") == (imu, "speed")
    with pytest.raises(BadInput, match=r"'speed' is in 2 topics: /gps and /gps.imu. .* \"/gps.speed\""):
        log.find("speed")
    with pytest.raises(BadInput, match=r"no column '/gps.lot'. Did you mean '/gps.lat'"):
        log.find("/gps.lot")
    with pytest.raises(BadInput, match="2 tables"):
        log.table()


def test_clocks_have_one_origin_and_lose_nothing() -> None:
    start = 1_753_963_200_000_000_000
    a = topic("a", "t", {"t": "ns"}, t=np.array([start + 1, start + 500_000_000]))
    b = topic("b", "t", {"t": "us"}, t=np.array([start // 1000, start // 1000 + 250_000], dtype=np.uint64))
    c = topic("c", "t", t=pd.to_datetime(["2025-07-31T12:00:01", "2025-07-31T12:00:02"], utc=True))
    log = log_of(a, b, c)
    clocks = [log.clock(table) for table in (a, b, c)]
    assert [None if clock is None else clock.tolist() for clock in clocks] == [[1e-9, 0.5], [0.0, 0.25], [1.0, 2.0]]
    assert log.start() == "2025-07-31T12:00:00+00:00"
    assert log.clock(topic("d", u=[1.0])) is None


def test_clocks_in_seconds_and_other_columns() -> None:
    a = topic("a", "t", {"stamp": "ms"}, t=[10.0, 11.0], stamp=[5000.0, 5100.0])
    b = topic("b", "t", t=[9.0, 12.0])
    log = log_of(a, b)
    assert log.clock(a).tolist() == [1.0, 2.0]
    assert log.clock(a, "stamp").tolist() == pytest.approx([0.0, 0.1])  # since the first of all, 5 s
    assert log.start() is None
    assert (
        Log("run.log", log.tables, known_start=(8.0, "2025-07-31T12:00:00+00:00")).start()
        == "2025-07-31T12:00:01+00:00"
    )


def test_a_clock_without_a_unit_of_time_is_refused() -> None:
    a = topic("a", "t", {"t": "m"}, t=[1.0, 2.0])
    with pytest.raises(BadInput, match="time"):
        log_of(a).clock(a)
    b = topic("b", "t", t=pd.to_datetime(["2025-07-31", None]))
    with pytest.raises(BadInput, match="no time"):
        log_of(b).clock(b)


def test_the_list_of_fields() -> None:
    a = topic("a", "t", {"u": "m/s"}, t=[0.0, 0.5, 1.0], u=[1.0, np.nan, -2.0], note=["x", "", "y"])
    fields = {field.name: field for field in listing(log_of(a, topic("b", v=[1.0])))}
    assert list(fields) == ["a.t", "a.u", "a.note", "b.v"]
    u = fields["a.u"]
    assert (u.unit, u.samples, u.rate, u.low, u.high, u.kind) == ("m/s", 2, 2.0, -2.0, 1.0, "numbers")
    assert (fields["a.note"].samples, fields["a.note"].kind) == (2, "text")
    assert np.isnan(fields["b.v"].rate)


def test_rows_become_columns_block_by_block(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatruth.readers.rows._BLOCK", 2)
    rows = Rows(["a", "b", "c"])
    for row in ((1, 1.5, "x"), (2, None, b"y"), (3, 2, None), (4, 3, "z" * 100), (5, 4, 7)):
        rows.add(row)
    columns = rows.columns()
    assert columns["a"].tolist() == [1, 2, 3, 4, 5]
    np.testing.assert_array_equal(columns["b"], [1.5, np.nan, 2, 3, 4])
    assert columns["c"].tolist() == ["x", "y", "", "z" * 64, "7"]
    assert Rows(["a"]).columns()["a"].size == 0
