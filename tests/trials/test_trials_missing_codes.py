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


def test_a_doppler_log_without_its_bottom_track_is_found_in_a_log_in_metres() -> None:
    assert missing_codes(np.array([1.612, 1.609, -32.768, 1.61]))[1] == [-32.768]


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


def test_angles_from_several_columns_have_gaps_where_one_holds_a_code(tmp_path: Path) -> None:
    psi = np.linspace(-1.0, 1.0, 60)
    half = {"w": np.cos(psi / 2), "k": 0 * psi, "m": 0 * psi, "z": np.sin(psi / 2)}
    columns = {"t": np.arange(60.0), "c": np.cos(psi), "s": np.sin(psi), **half}
    columns["c"][[20, 21]] = columns["s"][[21, 22]] = columns["z"][30] = -9999.0
    file = tmp_path / "run.csv"
    np.savetxt(file, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    vector, turn = ColumnSpec("", vector=("c", "s")), ColumnSpec("", quaternion=("w", "k", "m", "z"))
    for spec, gaps in ((vector, [20, 21, 22]), (turn, [30])):
        trial = read_trial(file, inputs={}, outputs={"psi": spec})
        assert np.flatnonzero(np.isnan(trial.outputs["psi"])).tolist() == gaps
        ok = np.isfinite(trial.outputs["psi"])
        np.testing.assert_allclose(trial.outputs["psi"][ok], psi[ok], atol=1e-12)
        assert f"{len(gaps)} of 60 samples missing, written as -9999" in trial.steps[0].effect
        assert [f.channel for f in check_trials([trial]) if f.code == "missing-code"] == ["psi"]


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


def test_codes_that_the_study_takes_out_already_are_no_finding(tmp_path: Path) -> None:
    rows = [f"{k / 10},1,{-32768 if k in (20, 21, 40) else k % 7},{int(k not in (20, 21))}" for k in range(60)]
    (tmp_path / "run.csv").write_text("\n".join(["t,delta,u [mm/s],status", *rows]) + "\n")
    for said, condition in ((["missing-code"], "status == 0"), ([], "u < -1000")):
        spec = ColumnSpec("u", invalid_where=condition)
        trial = read_trial(tmp_path / "run.csv", inputs={"delta": ColumnSpec("delta")}, outputs={"u": spec})
        assert np.flatnonzero(np.isnan(trial.outputs["u"])).tolist() == [20, 21, 40]
        assert [f.code for f in check_trials([trial]) if f.code == "missing-code"] == said
