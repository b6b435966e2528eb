"""What keeps effects from acting on a model, and lies in what the model declares."""

from __future__ import annotations

from typing import Any

from seatruth import BlackBox, Channel, Model, Parameter, load_model
from seatruth.effects.lacking import lacking


class Bare(Model):
    """A ship that tells neither its size nor its added masses."""

    name = "bare"
    kind = "ship"
    states = outputs = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad"))
    inputs = (Channel("delta", "rad"),)
    parameters = (Parameter("m", 50.0, "kg"), Parameter("a_x", 5.0, "kg"), Parameter("Y_v", 30.0, "kg/s"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        mass = p.m + p.a_x
        sway = (e.Y - p.Y_v * (s.v - e.v_c)) / mass + e.dv_c
        return (e.X - s.u + e.u_c) / mass + e.du_c, sway, (e.N + i.delta) / mass - s.r, s.r


def test_names_and_sizes_that_a_model_does_not_tell() -> None:
    found = lacking(Bare())
    reasons = {name: reason for reason, names in found.items() for name in names}
    assert "wind" in found["the model does not declare its dimensions"]
    assert reasons["added_mass"].startswith("the model has none of the parameters m_x, m_y, J_z")
    assert "shallow_water" not in reasons  # it knows Y_v
    assert not {"plane_gain", "trim", "depth_bias"} & {*reasons}  # no ship has these


def test_a_model_that_takes_no_force() -> None:
    found = lacking(load_model("torpedo_roll"))
    assert "tether" in found["the model's rhs takes no environment e"]


def test_a_model_that_tells_all_lacks_nothing() -> None:
    assert lacking(load_model("mmg")) == {}


def test_what_a_black_box_has_no_port_for() -> None:
    """A user read that 17 effects can be tried, and of the wind only after the run."""
    names = [Channel(name, unit) for name, unit in (("u", "m/s"), ("v", "m/s"), ("r", "rad/s"), ("psi", "rad"))]
    box = BlackBox("box", lambda *_: {}, inputs=[Channel("n", "rev/s")], outputs=names, parameters=[], kind="ship")
    found = lacking(box)
    assert "tether" in found["it is a force, and the model is a black box without a port for forces"]
