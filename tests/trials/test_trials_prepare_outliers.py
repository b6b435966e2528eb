"""Outliers of channels that move, that are sparse, and that come in pairs."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.trials import Trial, prepare
from seatruth.trials.prepare.outliers import hampel_outliers, typical_bend

T = 0.2 * np.arange(400)
RADIUS, SPEED = 25.0, 3.0


def circle(noise: float, seed: int) -> tuple[Array, Array]:
    """Fixes of a boat that turns, m."""
    rng = np.random.default_rng(seed)
    angle = SPEED / RADIUS * T
    return (
        RADIUS * np.sin(angle) + noise * rng.standard_normal(T.size),
        RADIUS * (1.0 - np.cos(angle)) + noise * rng.standard_normal(T.size),
    )


def removed(trial: Trial, found: Trial, name: str) -> list[int]:
    return np.flatnonzero(np.isnan(found.outputs[name]) & np.isfinite(trial.outputs[name])).tolist()


@pytest.mark.parametrize("seed", range(4))
def test_jumps_of_a_boat_under_way_are_found_and_both_coordinates_of_a_fix_go(seed: int) -> None:
    """A jump of 0.6 m, and one of 3 m that lasts two fixes, of a boat that goes 0.6 m from fix to fix."""
    x, y = circle(0.03, seed)
    x[100] += 0.6
    y[[250, 251]] -= 3.0
    trial = Trial("turn", T, {}, {"x": x, "y": y})
    found = prepare.hampel(trial, sigmas=6.0)
    assert removed(trial, found, "x") == [100, 250, 251]
    assert removed(trial, found, "y") == [100, 250, 251]
    assert "3 of x" in found.steps[0].effect
    line = prepare.hampel(trial, sigmas=6.0, replace="median").outputs
    assert line["y"][250] == pytest.approx(circle(0.0, 0)[1][250], abs=0.15)
    assert removed(trial, prepare.hampel(trial, channels=["x"], sigmas=6.0), "y") == [], "y was not asked for"


def test_a_sparse_channel_is_compared_with_its_own_samples() -> None:
    """A position each 1.6 s among rows at 5 Hz; fixes 2 m off, one of them after a pause."""
    x = 10.0 * np.sin(0.05 * T) + 0.1 * np.random.default_rng(0).standard_normal(T.size)
    sparse = np.where(np.arange(T.size) % 8 == 0, x, np.nan)
    sparse[160:200] = np.nan
    sparse[[80, 200]] += 2.0
    bad, _ = hampel_outliers(sparse, sigmas=5.0, t=T)
    assert np.flatnonzero(bad).tolist() == [80, 200]
    few = np.where(np.arange(T.size) < 2, x, np.nan)
    assert not hampel_outliers(few)[0].any(), "two samples tell nothing of each other"


def test_what_is_quantised_or_ramps_or_steps_has_no_outliers() -> None:
    for values in (3.0 * T, np.where(T > 40, 1.0, 0.0), np.round(np.sin(0.3 * T) * 50) / 50, np.full(T.size, 7.0)):
        assert not hampel_outliers(values, t=T)[0].any()


def test_a_window_of_many_samples_and_a_long_record_are_as_those_of_few() -> None:
    """Beyond a block, and beyond the window of which all pairs are compared."""
    rng = np.random.default_rng(0)
    values = np.cumsum(0.01 * rng.standard_normal(60_000)) + 0.001 * np.arange(60_000.0)
    rows = np.array([3, 20_000, 36_363, 36_364, 59_990])
    values[rows] += 5.0
    for window in (11, 51):
        assert np.flatnonzero(hampel_outliers(values, window, 8.0)[0]).tolist() == rows.tolist(), window


def test_the_typical_bend_is_that_of_what_bends() -> None:
    assert typical_bend(np.array([1.0, np.nan])) == 0.0
    assert typical_bend(np.full(5, 7.0)) == 0.0
    assert typical_bend(np.array([0.0, 2.0, 5.0, 6.0, 8.0])) == 1.0
    assert typical_bend(3.0 * np.arange(9.0)) == 3.0, "a line has none; what it moves by from sample to sample counts"
