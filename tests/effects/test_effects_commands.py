"""Commands without a unit that steer: in shares, in per cent, in pulses; and those that do not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth import Channel, Model
from seatruth.effects import available, load_effects, with_effects
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.effects.commands import FULL, FULL_RUDDER, steering_commands
from seatruth.effects.undeclared_actuators import drive_inputs, neutral, resting_inputs, steering_inputs
from seatruth.effects.vehicle import straight_thrust
from seatruth.models import load_model
from seatruth.models.base import Environment, record
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial


class Jet(Model):
    """A boat that is steered by its nozzle, both commands about a middle."""

    name = "jet"
    middle = 0.0
    states = outputs = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad"))
    inputs = (Channel("wheel", "1"), Channel("lever", "1"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        angle, thrust = 0.4 * i.wheel, 3.0 * i.lever * abs(i.lever)
        return (
            thrust * math.cos(angle) - s.u * abs(s.u) + e.X,
            -thrust * math.sin(angle) - s.v + e.Y,
            2.0 * thrust * math.sin(angle) - s.r + e.N,
            s.r,
        )


class Pulses(Jet):
    """The same in pulses of a servo and a speed controller."""

    middle = 1500.0

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return Jet.rhs(s, i._replace(wheel=(i.wheel - 1500.0) / 500.0, lever=(i.lever - 1500.0) / 500.0), p, e)


class Tunnel(Jet):
    """The wheel turns a tunnel on, which turns the boat at rest as well."""

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return i.lever - s.u + e.X, i.wheel - s.v + e.Y, i.wheel - s.r + e.N, s.r


class Twins(Jet):
    """A thruster on each side."""

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return i.wheel + i.lever - s.u + e.X, -s.v + e.Y, i.wheel - i.lever - s.r + e.N, s.r


@pytest.mark.parametrize("model", [Jet(), Pulses()], ids=["shares", "pulses"])
def test_what_turns_a_model_under_way_alone_steers_it(model: Jet) -> None:
    found = steering_commands(model, ["wheel", "lever"])
    assert found == {"wheel": (model.middle, FULL[model.middle] / FULL_RUDDER)}
    assert steering_inputs(model, "rudder") == ("wheel",)
    assert drive_inputs(model) == ("lever",)
    assert neutral(model) == model.middle
    assert resting_inputs(model) == {"wheel": model.middle, "lever": model.middle}
    usable = {name for name, effect in available().items() if not effect.missing(model)}
    assert {"rudder_offset", "rudder_lag", "rudder_dead_band", "thrust_gain", "thruster_lag"} <= usable


@pytest.mark.parametrize("model", [Tunnel(), Twins()], ids=["tunnel", "twins"])
def test_what_turns_it_at_rest_or_drives_it_does_not_steer(model: Model) -> None:
    assert steering_commands(model, ["wheel", "lever"]) == {}
    assert drive_inputs(model) == ("wheel", "lever")


def test_a_model_without_surge_or_with_a_rudder_has_none() -> None:
    assert steering_commands(load_model("torpedo_lateral"), []) == {}
    assert steering_inputs(load_model("mmg"), "rudder") == ("delta",)


def test_effects_on_a_command_act_in_rad_from_its_middle() -> None:
    """An offset of 2 deg moves it by 2/35 of full command, and a gain leaves the middle where it is."""
    t = np.linspace(0.0, 8.0, 41)
    for model in (Jet(), Pulses()):
        full = FULL[model.middle]
        wheel, lever = model.middle + 0.3 * full * np.sin(t), np.full(41, model.middle + 0.8 * full)

        def run(model: Model, wheel: Any, lever: Any = lever, **values: float) -> Any:
            trial = Trial("run", t, {"wheel": wheel, "lever": lever}, {}, synthetic=True)
            sim = simulator(model, [trial], values={**model.nominal(), **values})
            return sim.outputs(np.zeros((1, 0)), np.array([[1.0, 0.0, 0.0, 0.0]])).y[0]

        changed = with_effects(model, load_effects(["rudder_offset", "rudder_gain"], model=model))
        offset = run(changed, wheel, rudder_offset_angle=math.radians(2.0))
        assert offset == pytest.approx(run(model, wheel + 2.0 / 35.0 * full), rel=1e-9, abs=1e-12)
        gained = run(changed, wheel, rudder_gain_k=0.8)
        assert gained == pytest.approx(run(model, model.middle + 0.8 * (wheel - model.middle)), rel=1e-9, abs=1e-12)


def test_the_thrust_of_a_lever_in_pulses_counts_from_its_middle() -> None:
    for model in (Jet(), Pulses()):
        thrust = straight_thrust(model)
        assert thrust is not None
        i = record("Inputs", model.inputs)(model.middle, model.middle + 0.5 * FULL[model.middle])
        s = record("States", model.states)(1.0, 0.0, 0.0, 0.0)
        assert thrust(s, i, record("Parameters", ())(), Environment()) == pytest.approx(0.75)


class Lever(Jet):
    """Its thrust is a broken power of a lever that goes from 0 to 1."""

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        thrust = 3.0 * i.lever**1.8
        return thrust - s.u + e.X, -s.v + e.Y, 2.0 * thrust * i.wheel - s.r + e.N, s.r


class Levers(Jet):
    """Two of them."""

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        port, starboard = i.wheel**1.5, i.lever**1.5
        return port + starboard - s.u + e.X, -s.v + e.Y, port - starboard - s.r + e.N, s.r


class Planing(Jet):
    """A drag to a broken power, which has no value astern."""

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return i.lever - s.u**1.5 + e.X, -s.v + e.Y, i.wheel * s.u - s.r + e.N, s.r


def test_a_lever_to_a_broken_power_that_has_no_other_side_breaks_nothing() -> None:
    assert steering_inputs(Lever(), "rudder") == ("wheel",)
    assert drive_inputs(Lever()) == ("lever",)
    assert drive_inputs(Levers()) == ("wheel", "lever")
    assert kinds_of_drives(Levers()) == []
    for model in (Lever(), Levers(), Planing()):
        for effect in available().values():
            assert isinstance(effect.missing(model), str)
