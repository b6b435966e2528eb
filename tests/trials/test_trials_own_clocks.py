"""Channels with clocks of their own: each output keeps its samples, inputs are interpolated as the study says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth.errors import BadInput
from seatruth.trials import ColumnSpec, Trial, check_trials, read_trial
from seatruth.trials.own_clocks import Series, joined

LOG = {
    "t": [0.0, 1.0, 2.0, 3.0, 4.0],
    "rudder": [0.0, 10.0, 10.0, 30.0, 30.0],
    "t_gyro": [0.5, 1.0, 1.5, 9.0, None],
    "gyro": [1.0, 2.0, 3.0, 4.0, None],
    "t_gps": [1.25, 3.5, None, None, None],
    "x": [7.0, 8.0, None, None, None],
}


def read(folder: Path, log: dict[str, Any], **options: Any) -> Trial:
    pd.DataFrame(log).to_csv(folder / "log.csv", index=False)
    outputs = {"r": ColumnSpec("gyro", time="t_gyro"), "x": ColumnSpec("x", time="t_gps")}
    return read_trial(folder / "log.csv", inputs={"delta": "rudder"}, outputs=outputs, **options)


@pytest.mark.parametrize(
    ("hold", "rudder"),
    [("foh", [0.0, 5.0, 10.0, 10.0, 10.0, 10.0, 30.0, 30.0, 30.0]), ("zoh", [0, 0, 10, 10, 10, 10, 30, 30, 30])],
)
def test_outputs_keep_their_samples_and_inputs_are_interpolated(hold: Any, rudder: list[float], tmp_path: Path) -> None:
    trial = read(tmp_path, LOG, hold=hold)
    assert trial.t == pytest.approx([0.0, 0.5, 1.0, 1.25, 1.5, 2.0, 3.0, 3.5, 4.0])
    assert trial.inputs["delta"] == pytest.approx(rudder)
    for name, samples in {"r": {0.5: 1.0, 1.0: 2.0, 1.5: 3.0}, "x": {1.25: 7.0, 3.5: 8.0}}.items():
        values = trial.outputs[name]
        assert dict(zip(trial.t[np.isfinite(values)], values[np.isfinite(values)])) == samples
    effect = trial.steps[0].effect
    assert "10 times of 3 channels with clocks of their own; 1 times left out" in effect
    assert f"inputs {'linear between' if hold == 'foh' else 'held after'} their samples" in effect


def slow_gps(folder: Path, kept: Any = slice(None), spike: float = 0.0) -> list[str]:
    """What the checks say of single outputs where a gyro gives ten values a second and satellites one."""
    fast, slow = np.arange(0.0, 60.0, 0.1), np.arange(0.05, 60.0, 1.0)[kept]
    log = {"t": fast, "rudder": np.sin(fast), "t_gyro": fast + 0.03, "gyro": np.cos(fast)}
    log |= {"t_gps": slow, "x": 2 * slow + spike * (slow == 30.05)}
    trial = read(folder, {name: pd.Series(values) for name, values in log.items()})
    return [f"{f.channel} {f.code}" for f in check_trials([trial]) if f.code.startswith(("output-", "outlier"))]


def test_the_times_of_other_clocks_are_no_missing_samples(tmp_path: Path) -> None:
    assert slow_gps(tmp_path) == []
    assert slow_gps(tmp_path, slice(8, None)) == ["x output-late"]
    assert slow_gps(tmp_path, np.r_[0:20, 35:60]) == ["x output-gap"]
    assert slow_gps(tmp_path, slice(0, 20)) == ["x output-missing"]
    assert slow_gps(tmp_path, slice(0, 2)) == ["x output-missing"]


def test_neighbours_of_a_sample_are_those_of_its_own_clock(tmp_path: Path) -> None:
    assert slow_gps(tmp_path, spike=100.0) == ["x outliers"]


def test_clocks_with_dates_share_their_origin(tmp_path: Path) -> None:
    minute = "2025-07-31T12:00:0"
    log: dict[str, Any] = {
        **LOG,
        "t": [f"{minute}{k}" for k in range(5)],
        "t_gyro": [None, *(f"{minute}{k}.5" for k in range(4))],
        "gyro": [None, 1.0, 2.0, 3.0, 4.0],
        "t_gps": [f"{minute}2", *[None] * 4],
        "x": [7.0, *[None] * 4],
    }
    trial = read(tmp_path, log)
    assert trial.conditions["start"].startswith("2025-07-31T12:00:00")
    assert trial.t == pytest.approx([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0])
    with pytest.raises(BadInput, match="some of its clocks have dates"):
        read(tmp_path, {**log, "t": LOG["t"]})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"t_gyro": [0.5, 1.0, None, 9.0, None]}, r"line 4, column 't_gyro'.*1 sample\(s\) of 'r' have no time"),
        ({"t_gyro": [0.5, 0.4, 1.5, 9.0, None]}, "the clock of 'r' does not increase after 0.5 s"),
        ({"t_gyro": [0.5, 0.5, 1.5, 9.0, None]}, "the clock of 'r' does not increase after 0.5 s"),
        ({"rudder": [None, None, None, 1.0, None]}, "not recorded at the same time"),
    ],
)
def test_wrong_clocks_are_refused(changes: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=said):
        read(tmp_path, {**LOG, **changes})


@pytest.mark.parametrize(("repeated", "kept"), [("first", 1.0), ("last", 2.0)])
def test_repeated_times_of_a_clock(repeated: Any, kept: float, tmp_path: Path) -> None:
    trial = read(tmp_path, {**LOG, "t_gyro": [0.5, 0.5, 1.5, 9.0, None]}, repeated_time=repeated)
    assert trial.outputs["r"][trial.t == 0.5] == kept


def test_no_input_is_no_limit() -> None:
    one = Series(np.array([1.0, 2.0]), np.array([3.0, 4.0]), np.array([0, 1], dtype=np.intp))
    found = joined({}, {"x": one}, {}, "log")
    assert found.t.tolist() == [1.0, 2.0]
    assert found.notes == ("2 times of 1 channels with clocks of their own",)
