"""Manoeuvres: what is ordered, what is recorded, and the figures of trials whose figures are known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    CoastDown,
    PitchZigzag,
    SpeedSteps,
    Spiral,
    Stepper,
    Straight,
    TurningCircle,
    Zigzag,
    add_noise,
    run_manoeuvre,
    self_propulsion,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.models.abkowitz import AbkowitzShip
from seatruth.models.diving_plane import DivingPlane
from seatruth.models.mmg import MMGShip
from seatruth.trials import Trial

deg = math.radians
SHIP = MMGShip()
DATA = Path(__file__).parents[3] / "shared" / "data"


def sail(plan: object, **options: object) -> Trial:
    given = {"dt": 0.1, "first_state": {"u": 1.179}, "inputs": {"n": 11.85}, "rudder_rate": deg(15.8)}
    return run_manoeuvre(SHIP, plan, **{**given, **options})


def circle(radius: float = 20.0, speed: float = 1.0, drift: float = 0.2, turns: float = 2.0, side: int = 1) -> Trial:
    """A ship that turns on a perfect circle from the moment that its rudder is over, at t = 10 s."""
    t = np.arange(0.0, 10.0 + turns * 2 * math.pi * radius / speed, 0.1)
    turned = np.maximum(t - 10.0, 0.0) * speed / radius
    x = np.minimum(t, 10.0) * speed + radius * np.sin(turned)
    y = side * radius * (1 - np.cos(turned))
    course = side * turned
    beta = np.where(turned > 0, side * drift, 0.0)
    outputs = {"x": x, "y": y, "psi": course, "u": speed * np.cos(beta), "v": -speed * np.sin(beta)}
    return Trial("circle", t, {"delta": np.where(t > 10.05, side * 0.5, 0.0)}, outputs, synthetic=True)


@pytest.mark.parametrize("side", [1, -1])
def test_figures_of_a_perfect_circle(side: int) -> None:
    figures = turning_circle_figures(circle(side=side))
    assert not figures.why
    assert figures.execute == pytest.approx(10.0, abs=0.1)
    for found, true in (
        (figures.advance, 20.0),
        (figures.transfer, 20.0),
        (figures.tactical_diameter, 40.0),
        (figures.steady_diameter, 40.0),
    ):
        assert found == pytest.approx(true, abs=0.1)
    assert figures.drift_angle == pytest.approx(0.2 * side)
    assert figures.speed_ratio == pytest.approx(1.0)
    assert figures.rate == pytest.approx(side / 20.0)


@pytest.mark.parametrize(
    ("turns", "missing"),
    [
        (0.2, {"advance", "transfer", "tactical_diameter", "steady_diameter"}),
        (0.4, {"tactical_diameter", "steady_diameter"}),
        (0.6, {"steady_diameter"}),
    ],
)
def test_a_short_turn_says_what_it_does_not_hold(turns: float, missing: set[str]) -> None:
    figures = turning_circle_figures(circle(turns=turns))
    assert missing <= set(figures.why)
    assert all(math.isnan(getattr(figures, name)) for name in figures.why)
    assert "deg" in figures.why["steady_diameter"]


def test_figures_do_not_depend_on_heading_or_place() -> None:
    plain = sail(TurningCircle(deg(20), deg(400)))
    turned = sail(TurningCircle(deg(20), deg(400)), first_state={"u": 1.179, "psi": 2.0, "x": -50.0, "y": 30.0})
    one, other = turning_circle_figures(plain), turning_circle_figures(turned)
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter", "speed_ratio"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-6)


def test_figures_bear_noise_gaps_and_a_compass() -> None:
    clean = sail(TurningCircle(deg(35), deg(720), approach=10.0))
    noise = {"x": 0.05, "y": 0.05, "psi": deg(0.2), "u": 0.01, "v": 0.01}
    noisy = add_noise(clean, noise, np.random.default_rng(1))
    psi = np.mod(np.array(noisy.outputs["psi"]), 2 * math.pi)
    x = np.array(noisy.outputs["x"])
    x[100:103] = np.nan
    noisy = Trial("noisy", noisy.t, noisy.inputs, {**noisy.outputs, "psi": psi, "x": x})
    one, other = turning_circle_figures(clean), turning_circle_figures(noisy)
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), abs=0.3), name


def test_zigzag_figures_bear_noise() -> None:
    clean = sail(Zigzag(deg(20), deg(20)))
    noisy = add_noise(clean, {"psi": deg(0.1)}, np.random.default_rng(1))
    delta = clean.inputs["delta"] + 0.2 * deg(1) * np.random.default_rng(2).standard_normal(len(clean))
    noisy = Trial("noisy", noisy.t, {**noisy.inputs, "delta": delta}, noisy.outputs)
    one, other = zigzag_figures(clean), zigzag_figures(noisy)
    assert np.degrees(other.overshoots) == pytest.approx(np.degrees(one.overshoots), abs=0.6)
    assert other.executes == pytest.approx(one.executes, abs=0.15)
    assert other.period == pytest.approx(one.period, abs=0.5)


@settings(max_examples=15, deadline=None)
@given(rudder=st.sampled_from([5, 10, 20, 30]), heading=st.sampled_from([5, 10, 20]), first=st.booleans())
def test_zigzag_is_sailed_as_planned(rudder: float, heading: float, first: bool) -> None:
    side = "starboard" if first else "port"
    trial = sail(Zigzag(deg(rudder), deg(heading), side, approach=3.0), limit=300)
    figures = zigzag_figures(trial)
    assert figures.first == side
    assert figures.rudder == pytest.approx(deg(rudder))
    assert figures.executes[0] == pytest.approx(3.0, abs=1e-6)
    # The rudder is reversed at the first step past the heading.
    assert np.all(np.array(figures.switch_angles) >= deg(heading) - 1e-6)
    assert np.all(np.array(figures.switch_angles) < deg(heading + 0.8))
    assert np.abs(trial.inputs["delta"]).max() <= deg(rudder) + 1e-12
    assert np.abs(np.diff(trial.inputs["delta"])).max() <= deg(15.8) * 0.1 + 1e-12


def test_what_is_not_a_zigzag_or_circle_says_why() -> None:
    straight = sail(Straight(30.0))
    with pytest.raises(BadInput, match="both sides"):
        zigzag_figures(straight)
    with pytest.raises(BadInput, match="not used"):
        turning_circle_figures(straight)
    with pytest.raises(BadInput, match="both sides"):
        turning_circle_figures(sail(Zigzag(deg(20), deg(20))))
    with pytest.raises(BadInput, match="'psi'"):
        turning_circle_figures(Trial("bare", straight.t, straight.inputs, {"x": straight.t, "y": straight.t}))


def test_inputs_replay_the_motion_open_loop() -> None:
    """What is recorded is what acted: the same steps with the recorded inputs give the same motion."""
    trial = sail(Zigzag(deg(20), deg(20)), limit=60)
    stepper = Stepper(SHIP)
    state = stepper.first({"u": 1.179})
    rows = [{name: float(values[k]) for name, values in trial.inputs.items()} for k in range(len(trial))]
    for k in range(len(trial) - 1):
        state = stepper.step(0.0, state, rows[k], rows[k + 1], 0.1)
    assert state == pytest.approx(tuple(trial.outputs[c.name][-1] for c in SHIP.states), abs=1e-10)


def test_the_step_is_small_enough() -> None:
    plan = Straight(60.0, rudder=deg(20))
    coarse, fine = (sail(plan, dt=dt, rudder_rate=deg(10)) for dt in (0.2, 0.1))
    for name in ("x", "y", "psi"):
        assert coarse.outputs[name][-1] == pytest.approx(fine.outputs[name][-1], abs=1e-4)


def test_speed_steps_and_coast_down_order_the_propeller() -> None:
    trial = sail(SpeedSteps((8.0, 12.0), hold=10.0))
    assert trial.duration == pytest.approx(20.0)
    assert trial.inputs["n"][50] == 8.0
    assert trial.inputs["n"][150] == 12.0
    trial = sail(CoastDown(20.0, approach=5.0))
    assert trial.inputs["n"][40] == 11.85
    assert trial.inputs["n"][60:].max() == 0.0
    assert trial.outputs["u"][-1] < 1.179


def test_spiral_holds_each_rudder() -> None:
    trial = sail(Spiral((deg(10), 0.0, deg(-10)), hold=20.0))
    assert np.degrees(trial.inputs["delta"][[100, 300, 500]]) == pytest.approx([10.0, 0.0, -10.0], abs=1e-9)


def test_turning_circle_ends_after_its_turn() -> None:
    trial = sail(TurningCircle(deg(-35), deg(200)))
    assert math.degrees(abs(trial.outputs["psi"][-1])) == pytest.approx(200, abs=1.0)
    assert trial.outputs["psi"][-1] < 0


def test_manoeuvre_needs_its_inputs_and_outputs() -> None:
    with pytest.raises(BadInput, match="no output"):
        run_manoeuvre(DivingPlane(), Zigzag(deg(10), deg(10)), first_state={"u": 1.4})
    with pytest.raises(BadInput, match="no output"):
        sail(PitchZigzag(deg(5), deg(5)))
    with pytest.raises(BadInput, match="no input"):
        run_manoeuvre(AbkowitzShip(), SpeedSteps((1.0,), 10.0), first_state={"u": 7.7})
    with pytest.raises(BadInput, match="Did you mean 'n'"):
        sail(Straight(1.0), inputs={"nn": 3.0})
    with pytest.raises(BadInput, match="parameter 'Yv'"):
        sail(Straight(1.0), values={"Yv": 3.0})
    with pytest.raises(BadInput, match="positive"):
        Zigzag(0.0, deg(10))


def test_divergence_is_one_message() -> None:
    with pytest.raises(BadInput, match="diverges"):
        sail(Straight(600.0, rudder=0.1), values={"N_r": 3.0, "N_rrr": 5.0, "Y_v": 5.0, "Y_vvv": 9.0})


def test_noise_has_the_size_and_memory_that_are_asked_for() -> None:
    trial = sail(Straight(2000.0), dt=0.5)
    noisy = add_noise(trial, {"u": 0.01, "psi": 0.02}, np.random.default_rng(3), correlation={"psi": 5.0})
    white, slow = (noisy.outputs[name] - trial.outputs[name] for name in ("u", "psi"))
    assert white.std() == pytest.approx(0.01, rel=0.05)
    assert slow.std() == pytest.approx(0.02, rel=0.2)
    assert abs(np.corrcoef(white[1:], white[:-1])[0, 1]) < 0.05
    assert np.corrcoef(slow[1:], slow[:-1])[0, 1] == pytest.approx(math.exp(-0.5 / 5.0), abs=0.03)
    assert noisy.outputs["x"] is not None
    assert np.array_equal(noisy.outputs["x"], trial.outputs["x"])
    again = add_noise(trial, {"u": 0.01, "psi": 0.02}, np.random.default_rng(3), correlation={"psi": 5.0})
    assert np.array_equal(again.outputs["psi"], noisy.outputs["psi"])


def test_self_propulsion_needs_a_propeller_and_thrust() -> None:
    with pytest.raises(BadInput, match="no propeller speed"):
        self_propulsion(AbkowitzShip(), 5.0)
    with pytest.raises(BadInput, match="keeps"):
        self_propulsion(SHIP, 1.0, {"k_0": -0.1})


def real(folder: str, name: str) -> Trial:
    file = DATA / folder / f"{name}.csv"
    if not file.exists():
        pytest.skip("the real trials are not on this machine")
    table = pd.read_csv(file)
    outputs = {c: table[c].to_numpy() for c in ("x", "y", "psi", "u", "v", "r")}
    return Trial(name, table["t"].to_numpy(), {c: table[c].to_numpy() for c in ("delta", "n")}, outputs)


@pytest.mark.data
@pytest.mark.parametrize(
    ("folder", "name", "rudder", "first"),
    [
        ("kvlcc2_hsva", "Z_10_05", 10, ""),
        ("kvlcc2_hsva", "Z_20_10_S", 20, "starboard"),
        ("kvlcc2_hsva", "Z_10_10_P", 10, "port"),
        ("kvlcc2_marin", "zz_10", 10, ""),
        ("kvlcc2_marin", "zz_-20", 20, ""),
    ],
)
def test_figures_of_measured_zigzags(folder: str, name: str, rudder: float, first: str) -> None:
    figures = zigzag_figures(real(folder, name))
    assert math.degrees(figures.rudder) == pytest.approx(rudder, abs=1.5)
    assert first in ("", figures.first)
    assert len(figures.executes) >= 3
    assert all(0.5 < math.degrees(overshoot) < 40 for overshoot in figures.overshoots)
    assert figures.executes == tuple(sorted(figures.executes))


@pytest.mark.parametrize("side", [1, -1])
def test_a_perfect_circle_astern_has_the_same_lengths(side: int) -> None:
    """The same path run backwards in heading: the ship points the other way, and its rudder lies the other way."""
    ahead = circle(side=side, drift=0.0)
    outputs = {**ahead.outputs, "psi": ahead.outputs["psi"] + math.pi, "u": -ahead.outputs["u"]}
    astern = Trial("astern", ahead.t, {"delta": -ahead.inputs["delta"]}, outputs)
    one, other = turning_circle_figures(ahead), turning_circle_figures(astern)
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter", "time_90", "time_180"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), abs=1e-9), name


def test_a_record_may_begin_at_the_execute_but_not_within_the_turn() -> None:
    sailed = sail(TurningCircle(deg(35), deg(720)))
    late = sailed.section(int(np.searchsorted(sailed.t, 60.0)), len(sailed))
    with pytest.raises(BadInput, match="within the turn"):
        turning_circle_figures(late)
    at_order = sailed.section(int(np.searchsorted(sailed.t, 10.0)), len(sailed))
    assert turning_circle_figures(at_order).advance == pytest.approx(turning_circle_figures(sailed).advance, rel=0.02)


def test_any_steering_input_tells_the_execute() -> None:
    whole = circle()
    throttles = Trial("thrusters", whole.t, {"n_difference": 40.0 * whole.inputs["delta"]}, whole.outputs)
    one, other = turning_circle_figures(whole), turning_circle_figures(throttles, steering="n_difference")
    assert other.advance == pytest.approx(one.advance, abs=0.1)
    assert other.rudder == pytest.approx(20.0, rel=0.01)


def test_initial_turning_distance_is_the_way_until_the_second_execute() -> None:
    trial = sail(Zigzag(deg(10), deg(10)))
    found = zigzag_figures(trial)
    assert found.initial_turning_distance == pytest.approx(1.179 * found.initial_turning_time, rel=0.03)
