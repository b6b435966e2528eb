"""The terms in which a missing force is looked for: products of the motion and the inputs, equation by equation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from seatruth.effects import ExtendedModel
from seatruth.models.base import Model
from seatruth.models.with_servos import WithServos

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


@dataclass(frozen=True)
class Term:
    """One term of an equation: the acceleration `name` (its parameter) times a dimensionless function of the motion."""

    label: str
    state: str
    name: str
    text: str
    """The function in words, with the scales that make it dimensionless left out: "v r"."""
    factors: tuple[tuple[str, str], ...]
    """("state" | "input" | "absolute", channel) whose product it is."""


def equations(model: Model) -> dict[str, str]:
    """Words for the model's equations of motion, by state.

    A model whose states have other names than `EQUATIONS` knows has the equations of all states that are not kinematic.
    """
    base = _vehicle(model)
    names = [channel.name for channel in base.states]
    motions = {name: EQUATIONS[name] for name in names if name in EQUATIONS}
    return motions or {name: name for name in names if name not in KINEMATIC}


def _vehicle(model: Model) -> Model:
    """The model without its effects and servos."""
    while isinstance(model, (ExtendedModel, WithServos)):
        model = model.base
    return model


def terms_of(model: Model) -> list[Term]:
    """Products of two motions, of motions with inputs, and depth.

    None depends on the course over the earth: what does is not the model's structure but its environment.
    """
    base = _vehicle(model)
    moving = list(equations(model))
    ahead = next((name for name in moving if EQUATIONS.get(name) == "surge"), moving[0] if moving else "")
    few = len(moving) <= 3
    shapes: list[tuple[str, tuple[tuple[str, str], ...]]] = [("1", ())]
    for k, a in enumerate(moving):
        shapes += [(a, (("state", a),)), (f"{a}|{a}|", (("state", a), ("absolute", a)))]
        for b in moving[k + 1 :]:
            if few or ahead in (a, b):
                shapes.append((f"{a} {b}", (("state", a), ("state", b))))
    for depth in (channel.name for channel in base.states if channel.name in DEPTHS):
        shapes.append((depth, (("state", depth),)))
    for channel in base.inputs:
        i = channel.name
        shapes += [
            (f"{ahead}^2 {i}", (("state", ahead), ("state", ahead), ("input", i))),
            (f"{i}|{i}|", (("input", i), ("absolute", i))),
        ]
        if few:
            shapes.append((i, (("input", i),)))
    return [
        Term(label, state, f"term_{state}_{k}", text, factors)
        for state, label in equations(model).items()
        for k, (text, factors) in enumerate(shapes)
    ]


def acceleration_unit(model: Model, state: str) -> str:
    """Of an acceleration."""
    unit = next((c.unit for c in model.states if c.name == state), "1")
    return {"m/s": "m/s2", "rad/s": "rad/s2"}.get(unit, f"{unit}/s")
