"""What would let an effect on actuators act on a model is said."""

from __future__ import annotations

from typing import Any

import pytest

from seatruth.effects import available, with_effects
from seatruth.errors import BadInput
from seatruth.models import BlackBox, Channel, Model, Rudder, load_model

KNOWN = available()


class Glider(Model):
    """A user's glider, whose inputs are no usual ones."""

    name = "glider_vp"
    states = outputs = (Channel("q", "rad/s"), Channel("theta", "rad"))
    inputs = (Channel("x_b", "m", "battery position"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return i.x_b - s.q, s.q


def refused(model: Model, effect: str) -> str:
    with pytest.raises(BadInput) as caught:
        with_effects(model, [KNOWN[effect]])
    return caught.value.do


def test_a_plane_a_rudder_and_a_thruster_can_be_named() -> None:
    start = "Leave it out, or take a model that it can act on. If 'x_b' is a "
    assert refused(Glider(), "plane_offset") == (
        f"{start}plane, let the model say so: actuators = (Rudder('plane', 'x_b', turns='pitch', "
        "full=1.0),), `full` what it holds hard over, in m."
    )
    assert refused(Glider(), "rudder_offset").endswith(
        "actuators = (Rudder('rudder', 'x_b', full=1.0),), `full` what it holds hard over, in m."
    )
    assert "actuators = (Thruster('x_b', 'x_b', at=(" in refused(Glider(), "thruster_gain")


def test_what_is_said_is_enough() -> None:
    class Named(Glider):
        actuators = (Rudder("plane", "x_b", turns="pitch", full=0.02),)

    assert "plane_offset_angle" in with_effects(Named(), [KNOWN["plane_offset"]]).nominal()


def test_a_simulator_has_a_table_for_it() -> None:
    box = BlackBox(
        "box", lambda *_: {}, inputs=(Channel("trim", "m"),), outputs=(Channel("theta", "rad"),), parameters=()
    )
    assert '[model.actuators.plane] with input = "trim", turns = "pitch"' in refused(box, "plane_offset")


def test_inputs_that_are_something_else_are_not_proposed() -> None:
    assert refused(load_model("diving_plane"), "rudder_offset") == "Leave it out, or take a model that it can act on."
