"""What a black box declares of its vehicle acts through its ports as it does in equations, or is refused."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from seatruth import load_model, simulator
from seatruth.effects import available, with_effects
from seatruth.effects.base import Effect
from seatruth.effects.black_box import ExtendedBlackBox
from seatruth.effects.through_ports import OutsideEffects
from seatruth.errors import BadInput
from seatruth.models import BlackBox, Environment, Model, Thruster
from seatruth.models.base import record
from seatruth.models.twin_thruster import FULL, TwinThruster
from seatruth.trials import Trial
from seatruth.workers import by_value

BOAT = load_model("twin_thruster")
T = np.arange(4.0)
TRIAL = Trial("run", T, {"n_port": np.full(4, 9.0), "n_starboard": np.full(4, -6.0)}, {})
MOTION = {"x": 3.0, "y": -2.0, "psi": 0.4, "u": 1.1, "v": -0.2, "r": 0.15}


class TwinBox(BlackBox):
    """The boat with two thrusters behind ports, with all that the equations declare; it notes what acts on it."""

    actuators = TwinThruster.actuators
    thrusts, thrust, drag = (
        staticmethod(role) for role in (TwinThruster.thrusts, TwinThruster.thrust, TwinThruster.drag)
    )
    dimensions = staticmethod(TwinThruster.dimensions)

    def __init__(self, force: tuple[str, ...] = ("X", "Y", "N"), outputs: tuple[str, ...] = tuple(MOTION)) -> None:
        self.felt: dict[str, float] = {}
        shown = [channel for channel in BOAT.outputs if channel.name in outputs]
        super().__init__(
            "twin",
            self.still,
            inputs=BOAT.inputs,
            outputs=shown,
            parameters=BOAT.parameters,
            kind="ship",
            ports={"force": force, "current": ["u_c", "v_c"]},
        )

    def still(self, trial: Trial, p: dict[str, float], first: Any, outside: Any) -> Mapping[str, Any]:
        self.felt = outside(1.0, MOTION)
        return {channel.name: np.full(len(trial), MOTION[channel.name]) for channel in self.outputs}


def accelerations(effect: Effect | None, values: Mapping[str, float]) -> np.ndarray:
    """Of the equations at `MOTION`, by an effect."""
    model = BOAT if effect is None else with_effects(BOAT, [effect])
    s = record("S", model.states)(**{c.name: MOTION[c.name] for c in model.states})
    i = record("I", model.inputs)(9.0, -6.0)
    p = record("P", model.parameters)(**{**model.nominal(), **values})
    return np.array(model.rhs(s, i, p, Environment(t=1.0)))


@pytest.mark.parametrize(
    "effect",
    [
        available()["thruster_gain"],
        available()["thruster_gain"].only("starboard"),
        available()["thruster_oblique_loss"],
        available()["thruster_hull_interaction"],
        available()["thruster_direction"].only("port"),
        available()["thrusters_exchanged"].only("port", "starboard"),
        available()["voltage_sag"],
        available()["battery_discharge"],
        available()["drag_increase"],
        available()["thrust_gain"],
        available()["wind"],
    ],
    ids=lambda effect: str(effect.name),
)
def test_an_effect_pushes_a_black_box_as_it_pushes_the_equations(effect: Effect) -> None:
    box = TwinBox()
    assert not effect.missing(box)
    values = {effect.named(key): value for key, value in effect.typical(BOAT).items()}
    model = with_effects(box, [effect])
    assert isinstance(model, ExtendedBlackBox)
    model.run(TRIAL, {**model.nominal(), **values}, None)
    s = record("S", BOAT.states)(**{c.name: MOTION[c.name] for c in BOAT.states})
    i, p = record("I", BOAT.inputs)(9.0, -6.0), record("P", BOAT.parameters)(**BOAT.nominal())
    ours = np.array(BOAT.rhs(s, i, p, Environment(t=1.0, **box.felt)))
    assert ours == pytest.approx(accelerations(effect, values), rel=1e-12, abs=1e-15)
    assert np.abs(ours - accelerations(None, {})).max() > 1e-6


@pytest.mark.parametrize(
    ("box", "effect", "message"),
    [
        (TwinBox(force=("X",)), "thruster_gain", "acts in yaw, and the black box has no port for N"),
        (TwinBox(force=("X", "N")), "thruster_direction", "acts in sway, and the black box has no port for Y"),
        (TwinBox(outputs=("psi", "r", "v")), "drag_increase", "drag of the black box needs 'u'"),
    ],
)
def test_what_a_black_box_cannot_give_is_refused(box: TwinBox, effect: str, message: str) -> None:
    found = available()[effect]
    assert message in found.missing(box)
    with pytest.raises(BadInput, match="cannot act"):
        with_effects(box, [found])


def test_what_cannot_be_computed_does_not_hinder_other_effects() -> None:
    box = TwinBox(outputs=("psi", "r", "v"))
    effect = available()["thruster_gain"]
    model = with_effects(box, [effect])
    assert isinstance(model, ExtendedBlackBox)
    model.run(TRIAL, {**model.nominal(), "thruster_gain_k": -0.3}, None)
    assert box.felt["X"] != 0.0
    assert box.felt["N"] != 0.0


def test_thrusters_can_be_sent_and_described() -> None:
    box = TwinBox()
    model = with_effects(box, [available()["thruster_gain"].only("port")])
    assert isinstance(model, ExtendedBlackBox)
    acting = model._acting({**model.nominal(), "thruster_gain_port_k": -0.5})
    law = OutsideEffects(box, acting, box.nominal(), T, np.array([[9.0, -6.0]] * 4), -1.0, None)
    there = pickle.loads(by_value(law))
    assert there(1.0, MOTION) == law(1.0, MOTION)
    assert there.describe() == law.describe()
    assert law(1.0, MOTION)["X"] == pytest.approx(-0.5 * box.nominal()["k_ahead"] * 81.0)


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [("thruster_dead_band", "band", 0.05), ("thruster_lag", "tau", 0.5), ("thruster_rate_limit", "slowness", 8.0)],
)
def test_named_thrusters_have_effects_on_their_orders(name: str, parameter: str, value: float) -> None:
    """A black box that names its thrusters and has no port: all alike, and one alone."""
    t = np.arange(0.0, 20.0, 0.1)
    inputs = {"n_port": 6.0 + 5.0 * np.sin(t), "n_starboard": 6.0 - 5.0 * np.sin(0.7 * t)}
    trial = Trial("run", t, inputs, {channel.name: np.zeros(t.size) for channel in BOAT.outputs})

    def sail(trial: Trial, p: Mapping[str, float], first: Mapping[str, float]) -> dict[str, Any]:
        start = np.array([[first[channel.name] for channel in BOAT.states]])
        y = simulator(BOAT, [trial], threads=1).outputs(np.zeros((1, 0)), start).y[0]
        return {channel.name: y[:, k] for k, channel in enumerate(BOAT.outputs)}

    thrusters = [
        Thruster(name, f"n_{name}", at=(-0.9, y, 0.2), towards=(1.0, 0.0, 0.0), full=FULL)
        for name, y in (("port", -0.395), ("starboard", 0.395))
    ]
    fields: dict[str, Any] = {"inputs": BOAT.inputs, "outputs": BOAT.outputs, "parameters": [], "states": BOAT.states}
    box = BlackBox("boat", sail, **fields, actuators=thrusters)
    assert "does not declare its thrusts" in available()["thruster_gain"].missing(
        BlackBox("boat", sail, **fields, actuators=thrusters, ports={"force": ["X", "Y", "N"]})
    )
    assert "names no thruster" in available()[name].missing(BlackBox("boat", sail, **fields))

    def run(model: Model, values: Mapping[str, float]) -> np.ndarray:
        sim = simulator(model, [trial], values={**model.nominal(), **values}, threads=1)
        return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])

    plain = run(BOAT, {})
    for effect in available()[name].variants(BOAT):
        values = {effect.named(parameter): value}
        ours, theirs = (run(with_effects(model, [effect]), values) for model in (BOAT, box))
        moved = np.abs(ours - plain).max(axis=0)
        assert (np.abs(ours - theirs).max(axis=0) < 0.006 * moved).all(), effect.name
        assert (moved > 1e-4).all()
