"""The checks stay quiet where the data are right, and take whatever the data are without falling over."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_motion import Array, scattered, zigzag
from right_logs import right_log

from seatruth.trials import Finding, Trial, check_trials
from seatruth.trials.check import check_trial, limits
from seatruth.trials.check.sensors import chance_of_repeats


def codes(findings: list[Finding]) -> set[str]:
    return {finding.code for finding in findings}


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    noise=st.floats(0.0, 2.0),
    amplitude=st.floats(0.1, 0.6),
    period=st.floats(20, 100),
    course=st.floats(-3, 3),
    speed=st.floats(0.5, 3),
)
def test_no_false_alarm_on_any_good_zigzag(
    seed: int, noise: float, amplitude: float, period: float, course: float, speed: float
) -> None:
    trial = zigzag(
        seed, seconds=200, rate=5, noise=noise, amplitude=amplitude, period=period, course=course, speed=speed
    )
    for log in (trial, scattered(trial)):
        assert [f for f in check_trial(log) if f.severity != "note"] == []


def test_no_false_alarm_on_many_trials_together() -> None:
    trials = [zigzag(k, seconds=150, period=40, name=f"run{k}") for k in range(6)]
    assert codes(check_trials(trials)) <= {"heading-coverage", "speed-range"}  # both true: 44 deg, 11 %


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 60))
def test_no_data_break_the_checks(seed: int, n: int) -> None:
    """Absurd values end in findings, not in exceptions or warnings of NumPy."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.choice([1e-3, 0.1, 0.1, 0.1, 50.0], n))

    def column() -> Array:
        values = rng.standard_normal(n) * 10.0 ** rng.integers(-8, 12)
        values = np.round(values) if rng.random() < 0.3 else values
        values = values * 0 + 1 if rng.random() < 0.2 else values
        return np.where(rng.random(n) < rng.choice([0, 0.3, 1.0], p=[0.6, 0.3, 0.1]), np.nan, values)

    names = ("x", "y", "z", "psi", "theta", "phi", "u", "v", "w", "p", "q", "r")
    trial = Trial("any", t, {"delta": column(), "n": column()}, {k: column() for k in names})
    with np.errstate(all="raise"):
        assert isinstance(check_trials([trial]), list)


TRUE = {"input-constant", "input-jumps", "heading-coverage", "speed-range"}
"""What is so in a right log: a run on one course, at one speed, with rudders that are sampled coarsely."""


def false_alarms(seeds: Iterable[int]) -> list[str]:
    found = []
    for seed in seeds:
        trial, model = right_log(seed)
        found += [f"{trial.name}: {f}" for f in check_trials([trial], model) if f.code not in TRUE]
    return found


def test_right_logs_of_all_vehicles_raise_no_false_alarm() -> None:
    assert false_alarms(range(9)) == []


def test_noise_that_is_rounded_is_no_held_sensor() -> None:
    """Depth in whole centimetres with 2.5 cm of noise repeats a value now and then, on the way as well."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        t = 0.2 * np.arange(1000.0)
        z = np.round(5.0 + 4.0 * np.sin(0.05 * t) + 0.025 * rng.standard_normal(t.size), 2)
        found = check_trials([Trial("dive", t, {"n": 10.0 + rng.standard_normal(t.size)}, {"z": z})])
        assert "held" not in {finding.code for finding in found}, seed


@pytest.mark.parametrize(("repeats", "others", "held"), [(11, 5, False), (60, 55, True), (14, 2, True), (8, 0, True)])
def test_a_few_repeats_more_than_steps_of_one_resolution_are_chance(repeats: int, others: int, held: bool) -> None:
    """A rate of turn in tenths of a degree a minute had 11 and 5, and nothing was held."""
    total = repeats + others
    exactly = sum(math.comb(total, k) * 2 ** (total - k) for k in range(repeats, total + 1)) / 3**total
    assert 0.999 * exactly < chance_of_repeats(repeats, others) < 2.0 * exactly + 1e-12
    assert (chance_of_repeats(repeats, others) < limits.HELD_CHANCE) == held


def test_blanks_of_a_slower_sensor_are_not_missing() -> None:
    """A receiver of 1 Hz in a table of 5 Hz has a value in every fifth row, and loses one now and then."""
    whole = zigzag(rate=5.0)
    rng = np.random.default_rng(1)
    blank = np.ones(len(whole), dtype=np.bool_)
    blank[::5] = rng.random(len(whole))[::5] < 0.03
    slower = {name: np.where(blank, np.nan, values) for name, values in whole.outputs.items() if name in ("x", "y")}
    assert codes(check_trials([replace(whole, outputs={**whole.outputs, **slower})])) == codes(check_trials([whole]))


def test_a_vehicle_that_does_not_turn_shows_no_lever_arm() -> None:
    """Steps of speed on a straight course, without noise: the integral's own small errors are no arm."""
    assert false_alarms([11, 147]) == []


@pytest.mark.slow
def test_two_hundred_right_logs_raise_no_false_alarm() -> None:
    assert false_alarms(range(9, 216)) == []


def hovering(seed: int, *, speed: float, noise: float, other: bool = False) -> Trial:
    """An inspection vehicle that goes to and fro under an acoustic position of 1 Hz; `other`: u is another run's."""
    rng = np.random.default_rng(seed)
    t = 0.1 * np.arange(900.0)
    psi, u = 0.5 * np.sin(0.05 * t), speed * np.sin(0.2 * t)
    velocity = u * np.exp(1j * psi)
    place = np.concatenate([[0.0], np.cumsum(0.05 * (velocity[1:] + velocity[:-1]))])
    fixes = np.where(np.arange(t.size) % 10 == 0, place, np.nan)
    fixes = fixes + noise * (rng.standard_normal(t.size) + 1j * rng.standard_normal(t.size))
    shown = speed * np.sin(0.31 * t + 2.0) if other else u
    outputs = {"x": fixes.real, "y": fixes.imag, "psi": psi, "u": shown + 0.01 * rng.standard_normal(t.size)}
    return Trial("hover", t, {"n": u}, outputs)


def test_positions_whose_noise_hides_the_way_say_nothing_of_the_speed() -> None:
    for seed in range(20):
        assert "position-disagree" not in codes(check_trial(hovering(seed, speed=0.1, noise=0.4))), seed


def test_positions_with_noise_still_show_a_speed_that_is_another_runs() -> None:
    for seed in range(5):
        assert "position-disagree" in codes(check_trial(hovering(seed, speed=0.8, noise=0.2, other=True))), seed


def test_fixes_that_make_positions_disagree_are_named_where_they_are_few() -> None:
    """Lost for a while and wrong once: no neighbours show an outlier."""
    run = hovering(1, speed=0.4, noise=0.02)
    x = np.array(run.outputs["x"])
    x[[200, 210, 220, 240, 250, 260]] = np.nan
    x[230] += 60.0
    found = next(f for f in check_trial(replace(run, outputs={**run.outputs, "x": x})) if f.code == "position-disagree")
    assert "t = 23 to 27 s" in found.where
    assert "at this place" in found.do
    spread = next(
        f for f in check_trial(hovering(1, speed=0.8, noise=0.2, other=True)) if f.code == "position-disagree"
    )
    assert "t =" not in spread.where
    assert "at this place" not in spread.do


def late_zigzag(period: float, amplitude: float, late: float) -> Trial:
    """A quick zigzag at 2.2 m/s with u, v and psi, and positions once a second that are late (s)."""
    rng, rate = np.random.default_rng(0), 2.0 * np.pi / period
    t, fine = np.arange(0.0, 90.0, 0.2), np.arange(-5.0, 90.0, 0.01)
    heading = 3.5 + amplitude * np.sin(rate * fine)
    sway = -0.3 * amplitude * rate * np.cos(rate * fine)
    way = np.cumsum((2.2 + 1j * sway) * np.exp(1j * heading)) * 0.01
    fixes = np.where(np.arange(t.size) % 5, np.nan, 1.0)
    outputs = {
        "u": 2.2 + rng.normal(0.0, 0.01, t.size),
        "v": np.interp(t, fine, sway) + rng.normal(0.0, 0.01, t.size),
        "psi": np.interp(t, fine, heading),
        "x": fixes * (np.interp(t - late, fine, way.real) + rng.normal(0.0, 0.2, t.size)),
        "y": fixes * (np.interp(t - late, fine, way.imag) + rng.normal(0.0, 0.2, t.size)),
    }
    return Trial("zigzag", t, {}, outputs)


@pytest.mark.parametrize(("period", "amplitude"), [(6.0, 0.4), (8.0, 0.7), (8.0, 1.0), (12.0, 0.7)])
def test_late_positions_of_a_quick_zigzag_are_no_wrong_unit(period: float, amplitude: float) -> None:
    found = check_trials([late_zigzag(period, amplitude, late=1.2)])
    assert not codes(found) & {"unit", "speed-scale", "drift"}
    (said,) = (f.message for f in found if f.code == "lever-arm")
    assert "s late beside u, v and psi" in said


def test_speeds_in_knots_are_told_where_positions_are_late() -> None:
    trial = late_zigzag(30.0, 0.7, late=0.4)
    knots = replace(trial, outputs={**trial.outputs, **{name: trial.outputs[name] / 0.5144 for name in "uv"}})
    assert [f.channel for f in check_trials([knots]) if f.code == "unit"] == ["u"]


def test_rounding_that_noise_hides_is_not_told() -> None:
    """Of a boat that held her course the heading, rounded to 0.1 deg, ranged over its noise of 0.5 deg."""
    rng = np.random.default_rng(3)
    for noise, told in ((0.5, False), (0.02, True)):
        run = hovering(1, speed=0.8, noise=0.2)
        psi = np.radians(np.round(rng.normal(0.0, noise, len(run)) + 0.6 * np.sin(run.t / 40.0), 1))
        found = codes(check_trial(replace(run, outputs={**run.outputs, "psi": psi})))
        assert ("quantised" in found) == told
