"""Clocks of two sensors against each other, in one trial and in all of them together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_motion import zigzag

from seatruth.trials import Trial, check_trials
from seatruth.trials.check.clocks import clock_lag, common_lag

GOOD = zigzag(amplitude=0.5, period=80)


@pytest.mark.parametrize("offset", [0.5, -3.0, 12.0])
def test_the_offset_of_two_clocks_is_measured(offset: float) -> None:
    late = np.interp(GOOD.t - offset, GOOD.t, GOOD.outputs["psi"])
    lag = clock_lag(GOOD.t, late, GOOD.outputs["r"])
    assert lag is not None
    assert lag.seconds == pytest.approx(offset, abs=4 * lag.error)
    assert lag.error < 0.03
    assert clock_lag(GOOD.t, GOOD.outputs["psi"], GOOD.outputs["r"]) is None


def test_a_lag_in_half_of_the_record_is_no_clock() -> None:
    half = np.where(GOOD.t > 150, np.interp(GOOD.t - 1.0, GOOD.t, GOOD.outputs["psi"]), GOOD.outputs["psi"])
    assert clock_lag(GOOD.t, half, GOOD.outputs["r"]) is None


def slow_gyro(lag: float, number: int) -> Trial:
    """A short zigzag of its own period whose rate comes late, with so much slow noise that it alone proves nothing."""
    run = zigzag(amplitude=0.3, period=40.0 + 5.0 * number)
    run = run.section(0, len(run) // 4, f"run_{number}")
    rng = np.random.default_rng(number)
    slow = np.convolve(rng.standard_normal(len(run) + 40), np.ones(40) / 40.0, "valid")[: len(run)]
    rate = np.interp(run.t - lag, run.t, run.outputs["r"])
    return replace(run, outputs={**run.outputs, "r": rate + 0.6 * np.std(rate) * slow})


def lags_said(trials: list[Trial]) -> list[tuple[str, str]]:
    return [(one.where, one.channel) for one in check_trials(trials) if one.code == "clock-offset"]


def test_an_offset_that_no_trial_shows_alone_is_named_where_all_have_it() -> None:
    trials = [slow_gyro(1.0, number) for number in range(5)]
    records = [(one.t, one.outputs["psi"], one.outputs["r"]) for one in trials]
    found = common_lag(records)
    assert found is not None
    error = float(np.std(found.seconds, ddof=1)) / np.sqrt(5)
    assert found.mean == pytest.approx(-1.0, abs=4.0 * error)
    assert error < 0.1
    assert found.after < 0.8 * found.before
    assert sum(clock_lag(*record) is not None for record in records) < 3
    assert lags_said(trials) == [("all trials", "r")]
    assert common_lag(records[:2]) is None


def test_offsets_that_differ_from_trial_to_trial_are_no_common_one() -> None:
    apart = [slow_gyro(lag, number) for number, lag in enumerate((1.0, -1.0, 0.4, 2.5, -0.3))]
    assert common_lag([(one.t, one.outputs["psi"], one.outputs["r"]) for one in apart]) is None
    together = [slow_gyro(0.0, number) for number in range(5)]
    assert common_lag([(one.t, one.outputs["psi"], one.outputs["r"]) for one in together]) is None
    assert lags_said(together) == []
