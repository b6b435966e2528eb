"""The terms in which a missing force is looked for: products of the motion and the inputs, equation by equation.

Source of the mirror: M. A. Abkowitz, Lectures on ship hydrodynamics, Hydro- and Aerodynamics Laboratory, Lyngby,
report Hy-5, 1964: for a hull that is the same to port and to starboard, X is even in v, r, delta, and Y, N are odd.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from seatruth.diagnosis.discrepancy.equations import DEPTHS, EQUATIONS, equations, motions, rests, vehicle
from seatruth.effects.alike_drives import AXES, Kind, kinds_of_drives
from seatruth.effects.undeclared_actuators import USUAL, steering_inputs
from seatruth.models.actuators import Entry, Rudder, Thruster, Triple
from seatruth.models.base import Model


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
    thrusters: tuple[tuple[str, float], ...] = ()
    """Inputs of drives of one kind, each with its lever over the longest: by their sum it is multiplied as well."""
    squared: bool = False
    """Whether that is the sum of i|i| of each input i, in place of i."""
    hump: Hump | None = None
    """A function of the speed ahead by which it is multiplied as well."""

    def written(self, scales: Mapping[str, float]) -> tuple[str, float]:
        """The function of motions and inputs in their own units, and the number by which it is to be multiplied.

        `scales` are those that make the term dimensionless.

        Example:
            >>> Term("yaw", "r", "term_r_3", "u r", (("state", "u"), ("state", "r"))).written({"u": 2.0, "r": 0.1})
            ('u r', 5.0)
        """
        if self.hump is not None:
            scale = scales[self.hump.speed]
            middle, width = f"{self.hump.middle * scale:.3g}", f"{self.hump.width * scale:.3g}"
            return f"exp(-(({self.hump.speed} - {middle}) / {width})^2)".replace("- -", "+ "), 1.0
        size = math.prod(scales[name] for _, name in self.factors)
        if self.thrusters:
            size *= scales[self.thrusters[0][0]] ** (2 if self.squared else 1)
        return self.text, 1.0 / size


@dataclass(frozen=True)
class Hump:
    """exp(-((x - middle) / width)^2) of a speed x over its usual size."""

    speed: str
    middle: float
    width: float


_WIDTH = 0.25
"""Distance of two humps, and width of each, over the usual speed. [S] The resistance of a planing boat rises and falls
over half of the speed at its hump; two fifths of a width were no better."""
_MOST_HUMPS = 8
"""Humps at most, between the least and the largest speed. [S]"""
_FEWEST_HUMPS = 3
"""Humps from which they say more than the terms in the speed and its square do. [S]"""


def humps_between(speed: str, low: float, high: float) -> list[Hump]:
    """Humps that cover the speeds between these, over the usual one; none where the speed hardly changes.

    Example:
        >>> [hump.middle for hump in humps_between("u", 0.4, 1.3)]
        [0.5, 0.75, 1.0, 1.25]
    """
    width = max(_WIDTH, (high - low) / (_MOST_HUMPS - 1))
    first, last = math.ceil(low / width - 0.5), math.floor(high / width + 0.5)
    middles = [round(k * width, 6) for k in range(first, last + 1)]
    return [Hump(speed, middle, width) for middle in middles] if len(middles) >= _FEWEST_HUMPS else []


def ahead_of(model: Model) -> str:
    """The state whose rate the surge equation gives, else the first of the equations; empty where nothing moves."""
    labels = equations(model)
    return next((name for name in labels if EQUATIONS.get(name) == "surge"), next(iter(labels), ""))


def terms_of(model: Model, humps: Sequence[Hump] = ()) -> list[Term]:
    """Products of two motions, of motions with inputs, depth, and humps of the resistance.

    None depends on the course over the earth: what does is not the model's structure but its environment. And none is
    missing from one side only. A hull, its damping and its wake are mirror images about the vertical plane ahead, so
    that sway, roll and yaw have odd terms in what changes sign in the mirror, and surge, heave and pitch even ones
    (Abkowitz 1964). A submerged hull with stern planes, and a glider, is its own image in the mirror between above and
    below as well. What pushes to one side is a cause: the library has the known ones, and forces of each trial's own
    stand for others. Where nobody can say what a mirror does to an input, its terms stand in all equations.

    Drives of one kind have one term for all, in which each has its lever: a wake or a thrust curve of another form is
    that of every one, and what one of them gives less than the others is a cause. Inputs count from where drives rest.

    No low power of the speed follows the resistance of a hull through its hump: the surge equation also has `humps`,
    functions of the speed ahead that make it any curve.
    """
    base = vehicle(model)
    labels = equations(model)
    moving = list(labels)
    mirrors = _mirrors_of(base)
    odd = {name for mirror in mirrors for name, changes in mirror.signs.items() if changes}
    ahead = ahead_of(base)
    few = len(moving) <= 3
    state, size = "state", "absolute"
    shapes: list[tuple[str, tuple[tuple[str, str], ...]]] = [("1", ())]
    for k, a in enumerate(moving):
        shapes += [(a, ((state, a),)), (f"{a}|{a}|", ((state, a), (size, a)))]
        if a in odd:
            shapes.append((f"{a}^2", ((state, a), (state, a))))
        for b in moving[k + 1 :]:
            if few or ahead in (a, b):
                shapes.append((f"{a} {b}", ((state, a), (state, b))))
    for depth in (channel.name for channel in motions(base) if channel.name in DEPTHS):
        shapes.append((depth, ((state, depth),)))
    kinds = kinds_of_drives(base) if set(labels.values()) <= set(AXES) else []
    together, resting = {name for kind in kinds for name in kind}, rests(base)
    for i in (channel.name for channel in base.inputs if channel.name not in together):
        x = _over_rest(i, resting)
        shapes += [
            (f"{ahead}^2 {x}", ((state, ahead), (state, ahead), ("input", i))),
            (f"{x}|{x}|", (("input", i), (size, i))),
        ]
        if i in odd:
            shapes.append((f"{x}^2", (("input", i), ("input", i))))
        if few:
            shapes.append((x, (("input", i),)))
    found = [
        Term(label, name, f"term_{name}_{k}", text, factors)
        for name, label in labels.items()
        for k, (text, factors) in enumerate(shapes)
        if all(mirror.keeps(factors, label) for mirror in mirrors)
    ]
    found += [
        Term("surge", name, f"term_{name}_hump_{k}", f"hump of {hump.speed} at {hump.middle:g}", (), hump=hump)
        for name, label in labels.items()
        if label == "surge"
        for k, hump in enumerate(humps)
    ]
    square = ((state, ahead), (state, ahead))
    for name, label in labels.items():
        for k, levers in enumerate(_levers(kind, label) for kind in kinds):
            if levers:
                known = f"term_{name}_thrusters_{k}"
                found += [
                    Term(label, name, f"{known}_in_flow", f"{ahead}^2 ({_sum(levers, resting)})", square, levers),
                    Term(
                        label, name, f"{known}_squared", f"({_sum(levers, resting, '|{0}|')})", (), levers, squared=True
                    ),
                ]
                if few:
                    found.append(Term(label, name, known, f"({_sum(levers, resting)})", (), levers))
    return found


def _levers(kind: Kind, label: str) -> tuple[tuple[str, float], ...]:
    """Inputs of drives, each with what its thrust does in an equation over the most that one of them does there.

    Positive ones come first: the sign of the whole is that of the term's coefficient.
    """
    own = {name: pushed[label] for name, pushed in kind.items()}
    most = max(own.values(), key=abs)
    if abs(most) < _NO_LEVER:
        return ()
    levers = [(name, round(value / abs(most), 6)) for name, value in own.items() if abs(value / most) > _NO_LEVER]
    if all(lever < 0.0 for _, lever in levers):
        levers = [(name, -lever) for name, lever in levers]
    return tuple(sorted(levers, key=lambda pair: pair[1] < 0.0))


def _over_rest(name: str, resting: Mapping[str, float]) -> str:
    """An input in words, less that at which its drive rests."""
    return f"({name} - {resting[name]:g})" if name in resting else name


def _sum(levers: Sequence[tuple[str, float]], resting: Mapping[str, float], times: str = "") -> str:
    """The sum in words: "n_port - 0.8 n_starboard", each input times what it is written beside it."""
    words = ""
    for name, lever in levers:
        sign = ("-" if lever < 0.0 else "") if not words else (" - " if lever < 0.0 else " + ")
        share = "" if abs(lever) == 1.0 else f"{abs(lever):.2g} "
        x = _over_rest(name, resting)
        words += f"{sign}{share}{x}{times.format(x)}"
    return words


_NO_LEVER = 1e-6
"""m (of a force: 1), and part of the longest lever, below which a lever is rounding."""

_SIDEWAYS: Mapping[str, bool] = {
    **dict.fromkeys(("surge", "heave", "pitch"), False),
    **dict.fromkeys(("sway", "roll", "yaw"), True),
}
"""Whether a motion, or a force in its direction, changes sign in a mirror between port and starboard."""
_UPWARDS: Mapping[str, bool] = {
    **dict.fromkeys(("surge", "sway", "yaw"), False),
    **dict.fromkeys(("heave", "roll", "pitch"), True),
}
"""The same in a mirror between above and below."""

_TO_ONE_SIDE = (*USUAL["rudder"], "delta_d")
"""Standard names of inputs whose sign the first changes: rudders, and fins set against each other, which roll."""
_UP_OR_DOWN = (*USUAL["plane"], "delta_d")
"""The same of the second."""
_KNOWN = (*USUAL["rudder"], *USUAL["plane"], "delta_d", "n")
"""Standard names of inputs of which both mirrors are known; the one propeller stays as it is."""


@dataclass(frozen=True)
class _Mirror:
    """What changes sign in a mirror: a force by its direction, and a motion or an input as far as that is known."""

    forces: Mapping[str, bool]
    signs: Mapping[str, bool]

    def keeps(self, factors: tuple[tuple[str, str], ...], label: str) -> bool:
        """Whether a product does in the mirror what its equation does; True where nobody can say."""
        if label not in self.forces or any(name not in self.signs for _, name in factors):
            return True
        return (sum(self.signs[name] for what, name in factors if what != "absolute") % 2 == 1) == self.forces[label]


def _mirrors_of(base: Model) -> list[_Mirror]:
    """The mirrors in which a hull is its own image.

    One that moves at the surface, or a frame without stern planes, is not the same above and below.
    """
    found = [_Mirror(_SIDEWAYS, _changes_sign(base, _SIDEWAYS, 1, "yaw", _TO_ONE_SIDE))]
    if base.kind == "glider" or (base.kind == "auv" and steering_inputs(base, "plane")):
        found.append(_Mirror(_UPWARDS, _changes_sign(base, _UPWARDS, 2, "pitch", _UP_OR_DOWN)))
    return found


def _is_its_image(thrusters: Sequence[Thruster], axis: int) -> bool:
    """Whether each of some thrusters has its image among them in the mirror that turns this axis (y is 1, z is 2)."""

    def turned(triple: Triple) -> Triple:
        entry = triple[axis]
        if not isinstance(entry, str):
            other: Entry = -entry
        else:
            other = entry[1:] if entry.startswith("-") else f"-{entry}"
        return (triple[0], other, triple[2]) if axis == 1 else (triple[0], triple[1], other)

    return all(any(o.at == turned(one.at) and o.towards == turned(one.towards) for o in thrusters) for one in thrusters)


def _changes_sign(
    base: Model, forces: Mapping[str, bool], axis: int, turns: str, across: Sequence[str]
) -> dict[str, bool]:
    """Whether a mirror changes the sign of a motion or an input, as far as this is known.

    It turns this `axis`. It changes the sign of a fin that `turns` so, and of inputs with the standard names `across`.
    """
    found = {name: forces[label] for name, label in EQUATIONS.items() if label in forces}
    found |= dict.fromkeys(DEPTHS, forces["heave"])
    named, thrusters = {actuator.input for actuator in base.actuators}, dict[str, list[Thruster]]()
    for actuator in base.actuators:
        if isinstance(actuator, Rudder):
            found[actuator.input] = actuator.turns == turns
        else:
            thrusters.setdefault(actuator.input, []).append(actuator)
    # One on the middle line, or two jets under one order, are their own image.
    found |= {name: False for name, one in thrusters.items() if _is_its_image(one, axis)}
    for kind, turned in (("rudder", "yaw"), ("plane", "pitch")):
        steering = steering_inputs(base, kind)
        # The mirror exchanges two rudders that stand side by side.
        if len(steering) == 1:
            found.setdefault(steering[0], turned == turns)
    others = []
    for channel in base.inputs:
        standard = base.standard.get(channel.name, (channel.name, 1))[0]
        if channel.name in named or channel.name in found:
            continue
        if standard in _KNOWN:
            found[channel.name] = standard in across
        else:
            others.append(channel.name)
    # What is left beside the steering, if it is one, drives the vehicle ahead.
    if len(others) == 1 and any(found.get(channel.name, False) for channel in base.inputs):
        found[others[0]] = False
    return found
