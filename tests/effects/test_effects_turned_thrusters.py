"""Pods: thrusters that an input turns."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatruth import BadInput, Channel, Model, Parameter
from seatruth.effects import available, load_effects, with_effects
from seatruth.effects.turned_thrusters import check_turned_thrusters
from seatruth.models import Dimensions, Rudder, Thruster
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial

POD = Thruster("pod", "n", at=(-1.5, "offset", 0.0), towards=(1.0, 0.0, 0.0), full=10.0, turned_by="azimuth")


class Tug(Model):
    """One pod off the centre line; its angle counts clockwise from ahead."""

    name = "tug"
    states = outputs = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"))
    inputs = (Channel("azimuth", "rad"), Channel("n", "rev/s"))
    parameters = (Parameter("offset", 0.4, "m", 0.0, 1.0, source="[S] test"), Parameter("k", 2.0, "1"))
    actuators = (Rudder("pod_angle", "azimuth"), POD)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(4.0, 1.5, 0.4, 1000.0, 1000.0)

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (p.k * i.n * abs(i.n),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        (force,) = Tug.thrusts(s, i, p, e)
        ahead, aside = force * math.cos(i.azimuth), force * math.sin(i.azimuth)
        return (
            (ahead - 80.0 * s.u + e.X) / 1000.0,
            (aside - 300.0 * s.v + e.Y) / 1500.0,
            (-1.5 * aside - p.offset * ahead - 900.0 * s.r + e.N) / 1800.0,
        )


def run(model: Model, values: dict[str, float]) -> Any:
    t = np.linspace(0.0, 40.0, 201)
    trial = Trial("run", t, {"azimuth": 2.5 * np.sin(0.2 * t), "n": 6.0 + 0.0 * t}, {}, synthetic=True)
    sim = simulator(model, [trial], values={**model.nominal(), **values})
    return sim.outputs(np.zeros((1, 0)), np.array([[0.2, 0.0, 0.0]])).y[0]


def test_effects_on_a_pod_act_where_it_points() -> None:
    """A pod that gives 30 % less is a model of 30 % less thrust, all round the compass; a fixed thruster is not."""
    (gain,) = load_effects(["thruster_gain"], model=Tug())
    weak = {"thruster_gain_k": -0.3}
    right = run(Tug(), {"k": 1.4})
    assert run(with_effects(Tug(), [gain]), weak) == pytest.approx(right, rel=1e-6, abs=1e-9)

    class Fixed(Tug):
        actuators = (Tug.actuators[0], replace(POD, turned_by=None))

    assert np.abs(run(with_effects(Fixed(), [gain]), weak) - right).max() > 0.05


def test_a_mounting_of_a_pod_that_is_off_is_an_angle_that_is_off() -> None:
    (direction,) = load_effects(["thruster_direction"], model=Tug())
    (offset,) = load_effects(["rudder_offset"], model=Tug())
    turned = run(with_effects(Tug(), [direction]), {"thruster_direction_azimuth": 0.1})
    off = run(with_effects(Tug(), [offset]), {"rudder_offset_angle": 0.1})
    assert turned == pytest.approx(off, rel=1e-6, abs=1e-9)
    # So a diagnosis tries one of the two; that of a thruster that no rudder turns stays.
    known = available()
    assert known["thruster_direction"].candidates(Tug()) == ()
    assert known["rudder_offset"].candidates(Tug()) != ()

    class WithBowThruster(Tug):
        inputs = (*Tug.inputs, Channel("n_bow", "rev/s"))
        actuators = (*Tug.actuators, Thruster("bow", "n_bow", at=(1.5, 0.0, 0.0), towards=(0.0, 1.0, 0.0), full=10.0))

        @staticmethod
        def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return (*Tug.thrusts(s, i, p, e), p.k * i.n_bow * abs(i.n_bow))

    tried = [form.name for form in known["thruster_direction"].candidates(WithBowThruster())]
    assert tried == ["thruster_direction", "thruster_direction_bow"]


@pytest.mark.parametrize(("sign", "said"), [(1.0, '"azimuth"'), (-1.0, '"-azimuth"')])
def test_a_pod_that_is_declared_to_push_one_way_is_refused(sign: float, said: str) -> None:
    class Fixed(Tug):
        actuators = (Tug.actuators[0], replace(POD, turned_by=None))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return Tug.rhs(s, i._replace(azimuth=sign * i.azimuth), p, e)

    way = "clockwise" if sign > 0 else "anticlockwise"
    fixed = f"turns the thruster 'pod' {way}, seen from above, which is declared to push in one direction"
    with pytest.raises(BadInput, match=fixed) as told:
        check_turned_thrusters(Fixed())
    assert f"turned_by={said}" in told.value.do
    check_turned_thrusters(Tug())


def test_a_pod_that_is_declared_to_turn_the_other_way_is_refused() -> None:
    """Of an outboard whose angle counts to starboard the thrust points to port: effects would act mirrored."""

    class Mirrored(Tug):
        actuators = (Tug.actuators[0], replace(POD, turned_by="-azimuth"))

    with pytest.raises(BadInput, match='clockwise, seen from above, which is declared turned_by="-azimuth"') as told:
        check_turned_thrusters(Mirrored())
    assert 'turned_by="azimuth"' in told.value.do


def test_a_rudder_in_the_wash_turns_no_thruster() -> None:
    class Ship(Tug):
        actuators = (Tug.actuators[0], replace(POD, turned_by=None))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            (force,) = Tug.thrusts(s, i, p, e)
            side = 0.4 * force * math.sin(i.azimuth)
            return (
                (force - side * math.sin(i.azimuth) + e.X) / 1000.0,
                (side + e.Y) / 1500.0,
                (-1.5 * side - p.offset * force + e.N) / 1800.0,
            )

    check_turned_thrusters(Ship())


def test_what_turns_a_thruster_is_an_input_in_radians() -> None:
    for name in ("helm", "n"):

        class Wrong(Tug):
            actuators = (Tug.actuators[0], replace(POD, turned_by=name))

        with pytest.raises(BadInput, match=f"'pod' is turned by '{name}', which is no input in rad"):
            with_effects(Wrong(), [])
