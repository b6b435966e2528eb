"""Whatever bytes a file holds, reading it gives a Trial or BadInput, never anything else."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.readers import read_log
from seatruth.trials import ColumnSpec, Trial, read_trial

FUZZ = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
CSV = b"t [s],delta [deg],psi [deg],ok\n0.0,1.5,2.5,1\n0.1,1.5,2.25,0\n0.2,-1.5,,1\n0.3,1.5,2.125,1\n"


def attempt(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    arguments: dict[str, Any] = {
        "inputs": {"delta": ColumnSpec("delta")},
        "outputs": {"psi": ColumnSpec("psi", invalid_where="ok == 0")},
    }
    try:
        trial = read_trial(file, **arguments)
    except BadInput:
        return
    assert isinstance(trial, Trial)
    assert (np.diff(trial.t) > 0).all()
    assert all(np.isfinite(values).all() for values in trial.inputs.values())


@FUZZ
@given(content=st.binary(max_size=400))
def test_any_bytes(tmp_path: Path, content: bytes) -> None:
    for name in ("a.csv", "a.parquet"):
        attempt(tmp_path / name, content)


@FUZZ
@given(content=st.text(alphabet='t,;\t .0123456789-+eE"#%\n\rapsideltNf[]()/', max_size=300))
def test_any_text_of_numbers(tmp_path: Path, content: str) -> None:
    attempt(tmp_path / "a.csv", content.encode())
    with contextlib.suppress(BadInput):
        read_log(tmp_path / "a.csv")


def mangled(content: bytes, edits: list[tuple[str, int, bytes]]) -> bytes:
    for kind, place, extra in edits:
        at = place % (len(content) + 1)
        if kind == "insert":
            content = content[:at] + extra + content[at:]
        elif kind == "delete":
            content = content[:at] + content[at + 1 + len(extra) :]
        else:
            content = content[:at] + extra + content[at + len(extra) :]
    return content


EDITS = st.lists(
    st.tuples(st.sampled_from(["insert", "delete", "replace"]), st.integers(0, 10**6), st.binary(max_size=6)),
    min_size=1,
    max_size=4,
)


@FUZZ
@given(edits=EDITS)
def test_mangled_csv(tmp_path: Path, edits: list[tuple[str, int, bytes]]) -> None:
    attempt(tmp_path / "a.csv", mangled(CSV, edits))


def _mat() -> bytes:
    stream = io.BytesIO()
    t = np.arange(6.0)
    scipy.io.savemat(cast(Any, stream), {"run": {"t": t, "delta": t * 0, "psi": t, "ok": t > 2}})
    return stream.getvalue()


def _parquet() -> bytes:
    stream = io.BytesIO()
    t = np.arange(6.0)
    pd.DataFrame({"t": t, "delta": t * 0, "psi": t, "ok": t > 2}).to_parquet(stream)
    return stream.getvalue()


@pytest.mark.parametrize("make", [_mat, _parquet])
def test_the_binary_files_are_good_before_they_are_mangled(tmp_path: Path, make: Any) -> None:
    file = tmp_path / ("a.mat" if make is _mat else "a.parquet")
    file.write_bytes(make())
    assert len(read_trial(file, inputs={"delta": ColumnSpec("delta")}, outputs={"psi": ColumnSpec("psi")})) == 6


@settings(FUZZ, max_examples=8)
@given(edits=EDITS)
def test_mangled_parquet(tmp_path: Path, edits: list[tuple[str, int, bytes]]) -> None:
    attempt(tmp_path / "a.parquet", mangled(_parquet(), edits))


@settings(FUZZ, max_examples=8)
@given(edits=EDITS)
def test_mangled_matlab(tmp_path: Path, edits: list[tuple[str, int, bytes]]) -> None:
    attempt(tmp_path / "a.mat", mangled(_mat(), edits))


def test_a_file_that_crashes_scipy_is_refused(tmp_path: Path) -> None:
    """Four zero bytes at 264 make scipy 1.17's reader end its process; the user gets a message all the same."""
    content = bytearray(_mat())
    content[264:268] = bytes(4)
    (tmp_path / "a.mat").write_bytes(bytes(content))
    with pytest.raises(BadInput, match="damaged"):
        read_log(tmp_path / "a.mat")
