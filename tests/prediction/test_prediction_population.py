"""A fleet sails exactly what one ship after the other sails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth import BlackBox, Channel
from seatruth.effects import load_effects
from seatruth.effects.extended import with_effects
from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    CrashStop,
    Manoeuvre,
    PitchZigzag,
    SpeedSteps,
    Straight,
    TurningCircle,
    Zigzag,
    run_manoeuvre,
    self_propulsion,
)
from seatruth.models import load_model
from seatruth.models.abkowitz import AbkowitzShip
from seatruth.models.with_servos import Order, WithServos
from seatruth.prediction.conditions import propulsion
from seatruth.prediction.population import Fleet, Sailing
from seatruth.trials import Trial

deg = math.radians
SHIP, BOAT = load_model("mmg"), load_model("twin_thruster")
HOW = Sailing(0.5, deg(10.0), 120.0)


def values(model: Any, spread: float = 0.03, ships: int = 4) -> np.ndarray:
    nominal = np.array([p.value for p in model.parameters])
    table = np.tile(nominal, (ships, 1))
    changed = [k for k, p in enumerate(model.parameters) if p.name in ("Y_v", "N_r", "R_0", "a_H")]
    table[:, changed] *= 1 + spread * np.random.default_rng(0).standard_normal((ships, len(changed)))
    return table


@pytest.mark.parametrize(
    "model",
    [
        SHIP,
        WithServos(SHIP, {"delta": Order(lag=1.0, rate_limit=0.2)}),
        with_effects(SHIP, load_effects(["current", "rudder_offset", "rudder_lag"])),
    ],
    ids=["plain", "servo", "effects"],
)
@pytest.mark.parametrize(
    "plan", [TurningCircle(deg(35), deg(200)), Zigzag(deg(20), deg(20)), CrashStop(-9.0)], ids=lambda plan: plan.label
)
def test_a_fleet_sails_what_each_ship_sails(model: Any, plan: Manoeuvre) -> None:
    table = values(model)
    runs = Fleet(model, table).sail(plan, HOW, first={"u": 1.1}, inputs={"n": np.full(4, 11.0)})
    for ship, run in enumerate(runs):
        assert isinstance(run, Trial)
        own = {p.name: float(v) for p, v in zip(model.parameters, table[ship])}
        one = run_manoeuvre(
            model, plan, own, dt=0.5, first_state={"u": 1.1}, inputs={"n": 11.0}, rudder_rate=deg(10), limit=120.0
        )
        count = min(len(one), len(run))
        assert abs(len(one) - len(run)) <= 1
        for name in ("x", "y", "psi", "u"):
            assert run.outputs[name][:count] == pytest.approx(one.outputs[name][:count], abs=1e-9), name


@pytest.mark.parametrize(
    "plan",
    [TurningCircle(-0.3, deg(200), by="thrust"), Zigzag(0.1, deg(20), by="thrust"), CrashStop(-8.0)],
    ids=lambda plan: plan.label,
)
@pytest.mark.parametrize("servo", [False, True], ids=["plain", "servo"])
def test_boats_that_thrusters_steer_each_with_revolutions_of_its_own(plan: Manoeuvre, servo: bool) -> None:
    lag = Order(lag=0.5)
    boat = WithServos(BOAT, {"n_port": lag, "n_starboard": lag}) if servo else BOAT
    table = np.tile([p.value for p in boat.parameters], (2, 1))
    column = [p.name for p in boat.parameters].index("X_u")
    table[1, column] *= 1.2
    own = [{p.name: float(v) for p, v in zip(boat.parameters, row, strict=True)} for row in table]
    drive = propulsion(boat, table, 1.2, {})
    assert drive["n_port"] == pytest.approx([self_propulsion(boat, 1.2, one) for one in own])
    how = Sailing(0.1, deg(10), 60.0)
    runs = Fleet(boat, table).sail(plan, how, first={"u": 1.2}, inputs=drive)
    for ship, run in enumerate(runs):
        ahead = {name: float(drive[name][ship]) for name in ("n_port", "n_starboard")}
        one = run_manoeuvre(boat, plan, own[ship], first_state={"u": 1.2}, inputs=ahead, limit=60.0)
        assert isinstance(run, Trial)
        assert abs(len(one) - len(run)) <= 1
        count = min(len(one), len(run))
        for name in ("x", "y", "psi", "u"):
            assert run.outputs[name][:count] == pytest.approx(one.outputs[name][:count], abs=1e-9), name
    with pytest.raises(BadInput, match="n_port and n_starboard"):
        propulsion(boat, table, -1.0, {})
    assert list(propulsion(boat, table, -1.0, {"n_port": -5.0, "n_starboard": -5.0})) == ["n_port", "n_starboard"]


def test_ships_that_are_alike_and_one_that_diverges() -> None:
    table = values(SHIP, 0.0)
    names = [p.name for p in SHIP.parameters]
    table[1, names.index("N_r")], table[1, names.index("N_rrr")] = 3.0, 5.0
    table[1, names.index("Y_v")], table[1, names.index("Y_vvv")] = 5.0, 9.0
    how = Sailing(0.5, deg(10), 600.0)
    runs = Fleet(SHIP, table).sail(Straight(600.0, 0.1), how, first={"u": 1.1}, inputs={"n": np.full(4, 11.0)})
    assert isinstance(runs[1], str)
    assert "diverges" in runs[1]
    assert isinstance(runs[0], Trial)
    assert isinstance(runs[2], Trial)
    assert np.array_equal(runs[0].outputs["x"], runs[2].outputs["x"])


def test_what_cannot_be_sailed_says_why() -> None:
    box = BlackBox(
        "box", lambda trial, p, first: {}, inputs=[Channel("delta", "rad")], outputs=[Channel("psi", "rad")],
        parameters=[],
    )  # fmt: skip
    with pytest.raises(BadInput, match="black box"):
        Fleet(box, np.zeros((2, 0)))
    with pytest.raises(BadInput, match="theta"):
        Fleet(SHIP, values(SHIP)).sail(PitchZigzag(deg(5), deg(5)), HOW, first={}, inputs={})
    with pytest.raises(BadInput, match="no input"):
        Fleet(AbkowitzShip(), values(AbkowitzShip())).sail(SpeedSteps((3.0,), 10.0), HOW, first={"u": 7.0}, inputs={})
    with pytest.raises(BadInput, match="Did you mean 'n'"):
        Fleet(SHIP, values(SHIP)).sail(Zigzag(0.1, 0.1), HOW, first={}, inputs={"nn": np.ones(4)})
    with pytest.raises(BadInput, match="positive"):
        Sailing(0.0, 1.0, 10.0)
