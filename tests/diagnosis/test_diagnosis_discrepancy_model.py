"""A model with missing forces: it is the plain one at zero, and adds what it says."""

from __future__ import annotations

import dataclasses
import math

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis.discrepancy.model import (
    DiscrepancyModel,
    can_carry,
    force_input,
    hat_input,
    hats,
    scales_of,
    with_forces,
)
from seatruth.effects import load_effects, with_effects
from seatruth.manoeuvres import Stepper
from seatruth.models import Observation, load_model, observed
from seatruth.models.base import Environment, record
from seatruth.models.black_box import BlackBox
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

KNOTS, DURATION = 5, 40.0
SCALES = {"u": 2.0, "v": 0.2, "r": 0.05, "psi": 1.0, "x": 10.0, "y": 10.0, "delta": 0.2}


@pytest.fixture(scope="module")
def model() -> DiscrepancyModel:
    return DiscrepancyModel(boat.Boat(), KNOTS, DURATION, SCALES)


def rates(model: DiscrepancyModel, t: float, forces: dict[str, float] | None = None, **parameters: float) -> np.ndarray:
    """Rates of the states at one motion."""
    from collections import namedtuple

    s = namedtuple("s", [c.name for c in model.states])(1.8, 0.1, 0.04, 0.3, 5.0, 6.0)
    basis = hats(np.array([t]), model.spacing, model.knots)[0]
    shapes = {hat_input(k): float(value) for k, value in enumerate(basis)}
    inputs = {c.name: 0.0 for c in model.inputs} | {"delta": 0.15} | shapes | (forces or {})
    i = namedtuple("i", inputs)(**inputs)
    values = {**model.nominal(), **parameters}
    p = namedtuple("p", values)(**values)
    return np.array(model.rhs(s, i, p, Environment(t=t)))


def test_with_nothing_missing_it_is_the_model_itself(model: DiscrepancyModel) -> None:
    plain = boat.Boat()
    from collections import namedtuple

    s = namedtuple("s", [c.name for c in plain.states])(1.8, 0.1, 0.04, 0.3, 5.0, 6.0)
    i = namedtuple("i", ["delta"])(0.15)
    p = namedtuple("p", plain.nominal())(**plain.nominal())
    np.testing.assert_array_equal(rates(model, 7.0), np.array(plain.rhs(s, i, p, Environment(t=7.0))))


def test_a_knot_adds_a_straight_line_between_its_neighbours(model: DiscrepancyModel) -> None:
    base = rates(model, 12.0)
    for t, share in ((0.0, 0.0), (10.0, 1.0), (15.0, 0.5), (20.0, 0.0), (30.0, 0.0)):
        added = rates(model, t, knot_r_1=0.01) - base
        np.testing.assert_allclose(added, [0, 0, 0.01 * share, 0, 0, 0], atol=1e-15)


def test_an_input_of_force_adds_itself(model: DiscrepancyModel) -> None:
    added = rates(model, 3.0, {force_input("v"): 0.02}) - rates(model, 3.0)
    np.testing.assert_allclose(added, [0, 0.02, 0, 0, 0, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("state", "text", "size"),
    [
        ("u", "1", 1.0),
        ("u", "v^2", (0.1 / 0.2) ** 2),
        ("v", "v", 0.1 / 0.2),
        ("v", "r|r|", (0.04 / 0.05) ** 2),
        ("v", "u v", 1.8 / 2.0 * 0.1 / 0.2),
        ("v", "u^2 delta", (1.8 / 2.0) ** 2 * 0.15 / 0.2),
    ],
)
def test_a_term_adds_its_product_over_the_scales(model: DiscrepancyModel, state: str, text: str, size: float) -> None:
    term = next(term for term in model.terms if term.text == text and term.state == state)
    added = rates(model, 3.0, **{term.name: 0.01}) - rates(model, 3.0)
    expected = np.zeros(6)
    expected[("u", "v").index(state)] = 0.01 * size
    np.testing.assert_allclose(added, expected, rtol=1e-6, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("(n_port - n_starboard)", 0.5 - -0.25),
        ("(n_port|n_port| - n_starboard|n_starboard|)", 0.5**2 + 0.25**2),
        ("u^2 (n_port - n_starboard)", 0.9**2 * (0.5 - -0.25)),
    ],
)
def test_a_term_of_thrusters_adds_up_what_each_gives(text: str, size: float) -> None:
    twin = load_model("twin_thruster")
    scales = {c.name: 1.0 for c in twin.states} | {"u": 2.0, "n_port": 20.0, "n_starboard": 20.0}
    model = DiscrepancyModel(twin, KNOTS, DURATION, scales)
    row = [c.name for c in twin.states].index("r")
    term = next(term for term in model.terms if term.text == text and term.state == "r")
    s = dict.fromkeys((c.name for c in twin.states), 0.0) | {"u": 1.8}
    i = dict.fromkeys((c.name for c in model.inputs), 0.0) | {"n_port": 10.0, "n_starboard": -5.0}

    def rate(p: dict[str, float]) -> float:
        of = [
            record(name, tuple(Channel(key, "1") for key in values))(**values) for name, values in zip("sip", (s, i, p))
        ]
        return float(model.rhs(*of, Environment())[row])

    assert rate({**model.nominal(), term.name: 0.01}) - rate(model.nominal()) == pytest.approx(0.01 * size)


def test_terms_feel_the_input_that_acts() -> None:
    """A rudder that turns 20 % further does so in what the structure lacks too; it is no other force."""
    model = DiscrepancyModel(with_effects(boat.Boat(), load_effects(["rudder_gain"])), KNOTS, DURATION, SCALES)
    term = next(term for term in model.terms if term.text == "u^2 delta" and term.state == "v")
    added = {
        k: rates(model, 3.0, rudder_gain_k=k, **{term.name: 0.01}) - rates(model, 3.0, rudder_gain_k=k)
        for k in (1.0, 1.2)
    }
    np.testing.assert_allclose(added[1.2], 1.2 * added[1.0], rtol=1e-9, atol=1e-15)
    assert added[1.0][1] != 0.0


def test_terms_feel_the_motion_through_the_water() -> None:
    model = DiscrepancyModel(with_effects(boat.Boat(), load_effects(["current"])), KNOTS, DURATION, SCALES)
    term = next(term for term in model.terms if term.text == "u v" and term.state == "v")
    north, east, psi = 0.3, -0.2, 0.3
    current = {"current_north": north, "current_east": east}
    added = rates(model, 3.0, **current, **{term.name: 0.01}) - rates(model, 3.0, **current)
    u = 1.8 - (north * math.cos(psi) + east * math.sin(psi))
    v = 0.1 - (-north * math.sin(psi) + east * math.cos(psi))
    np.testing.assert_allclose(added, [0, 0.01 * u / 2.0 * v / 0.2, 0, 0, 0, 0], rtol=1e-9, atol=1e-15)


def test_hats_sum_to_one() -> None:
    basis = hats(np.linspace(0.0, DURATION, 33), DURATION / (KNOTS - 1), KNOTS)
    np.testing.assert_allclose(basis.sum(axis=1), 1.0)
    np.testing.assert_allclose(hats(10.0 * np.arange(5), 10.0, 5), np.eye(5), atol=1e-15)


def test_forces_of_a_trial_become_inputs(model: DiscrepancyModel) -> None:
    trial = Trial("run", np.array([0.0, 5.0, 10.0]), {"delta": np.zeros(3)}, {})
    forces = np.zeros((3, KNOTS))
    forces[2, 1] = 0.4
    carried = with_forces(trial, model, forces)
    np.testing.assert_allclose(carried.inputs[force_input("r")], [0.0, 0.2, 0.4])
    assert not np.any(carried.inputs[force_input("u")])
    assert not np.any(with_forces(trial, model).inputs[force_input("r")])
    np.testing.assert_allclose(carried.inputs[hat_input(1)], [0.0, 0.5, 1.0])
    later = with_forces(dataclasses.replace(trial, t=trial.t + 7.0), model)
    np.testing.assert_array_equal(later.inputs[hat_input(1)], carried.inputs[hat_input(1)], "a section's own time")


def test_a_black_box_and_a_model_without_motion_carry_none() -> None:
    state = (Channel("r", "rad/s"),)
    box = BlackBox("box", lambda trial, p, first: {}, states=state, inputs=(), outputs=state, parameters=())
    assert not can_carry(box)
    assert can_carry(boat.Boat())


def test_scales_are_those_of_the_record() -> None:
    trial = Trial(
        "run",
        np.arange(4.0),
        {"delta": np.full(4, -0.2)},
        {"u": np.array([3.0, math.nan, -3.0, 3.0]), "r": np.zeros(4)},
    )
    scales = scales_of(boat.Boat(), [trial])
    assert scales["u"] == pytest.approx(3.0)
    assert scales["delta"] == pytest.approx(0.2)
    assert scales["r"] == scales["v"] == 1.0


def test_thrusters_of_one_kind_have_one_scale() -> None:
    trial = Trial("run", np.arange(4.0), {"n_port": np.full(4, -3.0), "n_starboard": np.full(4, 7.0)}, {})
    scales = scales_of(load_model("twin_thruster"), [trial])
    assert scales["n_port"] == scales["n_starboard"] == 7.0


def test_an_accelerometer_feels_the_missing_forces() -> None:
    """Its output moves by what the equations are given; outputs of positions and speeds do not."""
    plain = observed(boat.Boat(), [Observation("f_y"), Observation("fore", "f_x", at=(0.0, 2.0, 0.0))])
    model = DiscrepancyModel(plain, KNOTS, DURATION, SCALES)
    names = [channel.name for channel in model.outputs]
    stepper = Stepper(model)
    state = stepper.first({"u": 1.8, "v": 0.1, "r": 0.04})
    still = {channel.name: 0.0 for channel in model.inputs}
    before = stepper.outputs(state, still)
    after = stepper.outputs(state, still | {force_input("v"): 0.02, force_input("r"): 0.01})
    changed = {name: after[name] - before[name] for name in names if after[name] != before[name]}
    assert changed == pytest.approx({"f_y": 0.02, "fore": -2.0 * 0.01})
    terms = Stepper(model, {"term_u_0": 0.03})
    assert terms.outputs(state, still)["fore"] - before["fore"] == pytest.approx(0.03)
