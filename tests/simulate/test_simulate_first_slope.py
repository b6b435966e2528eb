"""The slope with which a record begins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.simulate.first_slope import first_slope
from seatruth.trials.trial import Trial

_T = np.arange(0.0, 20.0, 0.1)


def _run(values: Array) -> Trial:
    return Trial("run", _T, {}, {"u": values}, synthetic=True)


def test_a_straight_start_has_its_slope_whatever_comes_after() -> None:
    values = np.where(_T < 1.0, 2.0 - 0.5 * _T, 1.5 + np.sin(_T - 1.0))
    assert first_slope(_run(values), "u", 0.5) == pytest.approx(-0.5)


def test_five_samples_are_the_fewest() -> None:
    values = np.full_like(_T, math.nan)
    values[[0, 7, 30, 60]] = [1.0, 2.0, 3.0, 4.0]
    assert first_slope(_run(values), "u", 1.0) == 0.0
    values[100] = 11.0  # five samples in 10 s, where one second holds two
    line = np.polyfit(_T[np.isfinite(values)], values[np.isfinite(values)], 1)[0]
    assert 0.5 * line < first_slope(_run(values), "u", 1.0) < line


def test_noise_of_a_steady_start_shows_less_than_its_standard_error() -> None:
    """Of 400 starts of 10 samples with noise of 0.02: the slope's standard error is 0.022 per second."""
    rng = np.random.default_rng(3)
    found = np.array([first_slope(_run(1.0 + 0.02 * rng.standard_normal(_T.size)), "u", 1.0) for _ in range(400)])
    plain = 0.02 * math.sqrt(12.0 / (10.0 * 99.0)) / 0.1
    assert np.mean(found == 0.0) > 0.5
    assert np.sqrt(np.mean(found**2)) < 0.8 * plain
    assert abs(found.mean()) < 4.0 * plain / math.sqrt(found.size)


def test_what_was_not_recorded_has_none() -> None:
    assert first_slope(_run(np.full_like(_T, math.nan)), "u", 1.0) == 0.0
    assert first_slope(_run(_T), "v", 1.0) == 0.0
    assert first_slope(_run(np.ones_like(_T)), "u", 1.0) == pytest.approx(0.0, abs=1e-12)
    assert first_slope(_run(1e-200 * _T), "u", 1.0) == 0.0  # its square is no number above zero
