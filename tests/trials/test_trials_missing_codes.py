"""Numbers that stand for a missing value: found where they are, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.trials import ColumnSpec, check_trials, read_trial
from seatruth.trials.missing_codes import missing_codes


@pytest.mark.parametrize(
    "code", [-9999.0, -999.0, 999.0, 9999.0, 65535.0, 32767.0, -32768.0, 1e10, 1e30, 3.402823e38, 9.96921e36, 655.35]
)
@pytest.mark.parametrize("scale", [0.01, 1.0, 60.0])
def test_codes_are_found(code: float, scale: float) -> None:
    values = scale * np.sin(np.arange(50.0))
    values[[0, 7, 8, 30]] = code
    rows, codes = missing_codes(values)
    assert np.flatnonzero(rows).tolist() == [0, 7, 8, 30]
    assert codes == [code]


def test_several_codes_and_empty_columns() -> None:
    rows, codes = missing_codes(np.array([1.0, -9999.0, 2.0, 65535.0, np.nan]))
    assert rows.tolist() == [False, True, False, True, False]
    assert sorted(codes) == [-9999.0, 65535.0]
    assert missing_codes(np.full(5, -9999.0))[0].all()
    assert missing_codes(np.append(np.arange(360.0), 999.0))[1] == [999.0]


@pytest.mark.parametrize(
    "values",
    [
        np.arange(1000.0),  # revolutions up to 999
        np.arange(65536.0),  # counts of 16 bits
        np.full(9, 999.0),
        np.repeat([0.0, 1e6], 10),  # a force that is switched on
        10.0 ** np.arange(5, 16),
        np.full(3, np.nan),
        np.zeros(0),
    ],
    ids=["revolutions", "counts", "999 throughout", "switched", "logarithmic", "missing", "none"],
)
def test_measurements_are_no_codes(values: np.ndarray) -> None:
    assert missing_codes(values)[1] == []


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3, 6))
def test_noise_of_any_size_is_no_code(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    assert missing_codes(np.round(10.0**size * rng.standard_normal(40), 3))[1] == []


def test_a_file_with_codes_has_gaps_and_a_word(tmp_path: Path) -> None:
    rows = [
        f"{k / 10},{10 * np.sin(k / 5):.2f},{-9999 if k in (20, 21) else 20 * np.sin(k / 5):.3f}" for k in range(60)
    ]
    file = tmp_path / "run.csv"
    file.write_text("\n".join(["t,rudder [deg],psi [deg]", *rows]) + "\n")
    trial = read_trial(file, inputs={"delta": ColumnSpec("rudder")}, outputs={"psi": ColumnSpec("psi")})
    assert np.flatnonzero(np.isnan(trial.outputs["psi"])).tolist() == [20, 21]
    assert "2 of 60 samples missing, written as -9999" in trial.steps[0].effect
    found = [f for f in check_trials([trial]) if f.code == "missing-code"]
    assert [(f.channel, f.severity) for f in found] == [("psi", "note")]
    assert "-9999" in found[0].message
