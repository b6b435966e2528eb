"""Questions put to the trials without naming a cause: what if something acted here?

A probed model is a model with extra terms that vanish at zero:

* in each equation of motion and on each input a function of time, straight lines between knots (`Place`);
* in each equation of motion a sum of simple terms in the states and inputs (`Term`): what a missing force would look
  like if it depends on the motion.

In an equation the terms are accelerations (m/s2, rad/s2) added to the rate of its state, so that any model can be
probed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from seatruth.effects import ExtendedModel
from seatruth.models.base import Equations, Model
from seatruth.models.parameter import Parameter
from seatruth.models.wrapper import ModelWrapper

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


@dataclass(frozen=True)
class Place:
    """Somewhere that an unknown may act, as a function of time on knots: parameters `names`, one a knot."""

    label: str
    """ "surge" ... "yaw", or "actuator:delta"."""
    state: str
    """The state whose rate it adds to; empty for an input."""
    channel: str
    """The input that it adds to; empty for an equation."""
    names: tuple[str, ...]
    unit: str


@dataclass(frozen=True)
class Term:
    """One term of an equation: the acceleration `name` (its parameter) times a dimensionless function of the motion."""

    label: str
    state: str
    name: str
    text: str
    """The function in words, with the scales that make it dimensionless left out: "v r"."""
    factors: tuple[tuple[str, str], ...]
    """("state" | "input" | "absolute" | "cosine" | "sine", channel) whose product it is."""


def equations(model: Model) -> dict[str, str]:
    """Words for the model's equations of motion, by state; a state that is no motion has its own name's equation."""
    base = model.base if isinstance(model, ExtendedModel) else model
    return {
        channel.name: EQUATIONS.get(channel.name, channel.name)
        for channel in base.states
        if channel.name not in KINEMATIC
    }


def terms_of(model: Model) -> list[Term]:
    """The terms that a missing force is looked for in: products of two motions, motions with inputs, a fixed course."""
    base = model.base if isinstance(model, ExtendedModel) else model
    moving = list(equations(model))
    ahead = next((name for name in moving if EQUATIONS.get(name) == "surge"), moving[0] if moving else "")
    heading = next((c.name for c in base.states if c.name == "psi"), "")
    few = len(moving) <= 3
    shapes: list[tuple[str, tuple[tuple[str, str], ...]]] = [("1", ())]
    for k, a in enumerate(moving):
        shapes += [(a, (("state", a),)), (f"{a}|{a}|", (("state", a), ("absolute", a)))]
        for b in moving[k + 1 :]:
            if few or ahead in (a, b):
                shapes.append((f"{a} {b}", (("state", a), ("state", b))))
    for channel in base.inputs:
        i = channel.name
        shapes += [
            (f"{ahead}^2 {i}", (("state", ahead), ("state", ahead), ("input", i))),
            (f"{i}|{i}|", (("input", i), ("absolute", i))),
        ]
        if few:
            shapes.append((i, (("input", i),)))
    if heading:
        shapes += [(f"cos {heading}", (("cosine", heading),)), (f"sin {heading}", (("sine", heading),))]
    return [
        Term(label, state, f"term_{state}_{k}", text, factors)
        for state, label in equations(model).items()
        for k, (text, factors) in enumerate(shapes)
    ]


class ProbedModel(ModelWrapper):
    """A model with places and terms: `knots` over `duration` s of each trial, `scales` of states and inputs."""

    def __init__(
        self, base: Model, knots: int, duration: float, terms: Sequence[Term], scales: Mapping[str, float]
    ) -> None:
        self.terms, self.scales = tuple(terms), dict(scales)
        self.knots, self.spacing = knots, duration / (knots - 1)
        self.places = tuple(_places(base, knots))
        own = [Parameter(name, 0.0, place.unit) for place in self.places for name in place.names]
        own += [Parameter(term.name, 0.0, _unit(base, term.state)) for term in self.terms]
        super().__init__(base, parameters=own)

    def make_rhs(self) -> Equations:
        return _rhs(self, self.scales)

    def make_output(self) -> Equations | None:
        return _output(self)

    def size(self, term: Term) -> float:
        """What makes a term dimensionless: the product of the scales of the motions and inputs in it."""
        return math.prod(self.scales[name] for kind, name in term.factors if kind not in ("cosine", "sine"))


def _unit(model: Model, state: str) -> str:
    """Of an acceleration."""
    unit = next((c.unit for c in model.states if c.name == state), "1")
    return {"m/s": "m/s2", "rad/s": "rad/s2"}.get(unit, f"{unit}/s")


def _places(base: Model, knots: int) -> list[Place]:
    found = []
    for state, label in equations(base).items():
        names = tuple(f"place_{state}_{k}" for k in range(knots))
        found.append(Place(label, state, "", names, _unit(base, state)))
    for channel in base.inputs:
        names = tuple(f"place_{channel.name}_{k}" for k in range(knots))
        found.append(Place(f"actuator:{channel.name}", "", channel.name, names, channel.unit))
    return found


def _along(t: Any, values: Sequence[Any], spacing: float) -> Any:
    """Straight lines between values at the knots."""
    total: Any = 0.0
    for k, value in enumerate(values):
        total = total + value * max(0.0, 1.0 - abs(t / spacing - float(k)))
    return total


def _taken_apart(model: ProbedModel) -> Callable[[Any], tuple[Any, list[list[Any]], list[Any]]]:
    """Parameters of the probed model to those of its base, those of each place, those of the terms."""
    split_base, knots, places = model.split_parameters(), model.knots, len(model.places)

    def split(p: Any) -> tuple[Any, list[list[Any]], list[Any]]:
        base, values = split_base(p)
        own = [list(values[knots * k : knots * (k + 1)]) for k in range(places)]
        return base, own, list(values[knots * places :])

    return split


def _inputs(model: ProbedModel, i: Any, t: Any, own: Sequence[Sequence[Any]]) -> Any:
    for place, values in zip(model.places, own):
        if place.channel:
            i = i._replace(**{place.channel: getattr(i, place.channel) + _along(t, values, model.spacing)})
    return i


def _rhs(model: ProbedModel, scales: Mapping[str, float]) -> Callable[..., tuple[Any, ...]]:
    split, base = _taken_apart(model), model.base.rhs
    order = [channel.name for channel in model.states]

    def value(factor: tuple[str, str], s: Any, i: Any) -> Any:
        kind, name = factor
        if kind == "cosine":
            return math.cos(getattr(s, name))
        if kind == "sine":
            return math.sin(getattr(s, name))
        x = getattr(i if kind == "input" or not hasattr(s, name) else s, name) / scales[name]
        return math.sqrt(x * x + 1e-12) if kind == "absolute" else x

    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        p, own, coefficients = split(p)
        acting = _inputs(model, i, e.t, own)
        rates = list(base(s, acting, p, e))
        for place, values in zip(model.places, own):
            if place.state:
                k = order.index(place.state)
                rates[k] = rates[k] + _along(e.t, values, model.spacing)
        for term, coefficient in zip(model.terms, coefficients):
            product = coefficient
            for factor in term.factors:
                product = product * value(factor, s, i)
            k = order.index(term.state)
            rates[k] = rates[k] + product
        return tuple(rates)

    return rhs


def _output(model: ProbedModel) -> Callable[..., tuple[Any, ...]] | None:
    base = model.base.output
    if base is None:
        return None
    split = _taken_apart(model)

    def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        p, own, _ = split(p)
        acting = _inputs(model, i, e.t, own)
        return tuple(base(s, acting, p, e))

    return output
