"""The equations of motion of a model, in which forces may be missing."""

from __future__ import annotations

from collections.abc import Mapping

from seatruth.effects import ExtendedModel
from seatruth.effects.undeclared_actuators import resting_inputs
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.ports import FORCES
from seatruth.models.with_holds import WithHolds
from seatruth.models.with_servos import WithServos
from seatruth.trials.channel import Channel

EQUATIONS: Mapping[str, str] = {
    **{"u": "surge", "v": "sway", "w": "heave", "p": "roll", "q": "pitch", "r": "yaw"},
    # the torpedo convention: y up, z to starboard
    **{"v_x": "surge", "v_z": "sway", "v_y": "heave", "omega_x": "roll", "omega_y": "yaw", "omega_z": "pitch"},
}
"""Equation of motion by the state whose rate it gives."""
KINEMATIC = frozenset(
    ("x", "y", "z", "phi", "theta", "psi", "depth", "xi", "zeta", "x_0", "y_0", "z_0", "x0", "y0", "z0", "varphi")
)
"""States whose rates follow from the other states alone."""

DEPTHS = frozenset(("z", "depth", "zeta"))
"""States on which a hull's forces may depend though it does not move: it is compressed with depth."""


def equations(model: Model) -> dict[str, str]:
    """Words for the model's equations of motion, by state.

    A model whose states have other names than `EQUATIONS` knows has the equations of all states that are not kinematic.
    Those of a black box are the ones into which it takes outside forces and whose motion it shows.
    """
    base = vehicle(model)
    names = [channel.name for channel in motions(base)]
    if isinstance(base, BlackBox):
        driven = [FORCES[component][0] for component in base.ports.force]
        return {name: EQUATIONS[name] for name in driven if name in names}
    known = {name: EQUATIONS[name] for name in names if name in EQUATIONS}
    return known or {name: name for name in names if name not in KINEMATIC}


def motions(model: Model) -> tuple[Channel, ...]:
    """The channels of a model's motion: its states, or what a black box shows of them."""
    return model.innermost.outputs if isinstance(model, BlackBox) else model.states


def vehicle(model: Model) -> Model:
    """The model without its effects, servos and holds."""
    if isinstance(model, BlackBox):
        return model.innermost
    while isinstance(model, (ExtendedModel, WithServos, WithHolds)):
        model = model.base
    return model


def rests(model: Model) -> dict[str, float]:
    """The inputs under which a vehicle rests, by name, where they are not zero."""
    return {name: rest for name, rest in (resting_inputs(model) or {}).items() if rest != 0.0}


def acceleration_unit(model: Model, state: str) -> str:
    """Of an acceleration."""
    unit = next((c.unit for c in motions(model) if c.name == state), "1")
    return {"m/s": "m/s2", "rad/s": "rad/s2"}.get(unit, f"{unit}/s")
