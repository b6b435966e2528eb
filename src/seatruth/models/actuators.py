"""What drives and steers a vehicle: the actuators that a model names, and where they act.

A model lists them in `actuators`; effects on actuators then act on it, whatever its inputs are called. Where it has
thrusters, its function `thrusts(s, i, p, e)` gives the force of each, N, in the order of that list. A simulator that
cannot be opened may show these forces as outputs instead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from seatruth.errors import BadInput
from seatruth.units import PULSES, Conversion, to_si

Entry = float | str
"""A number, or the name of a parameter of the model, with a minus in front for its negative: "-y_T"."""
Triple = tuple[Entry, Entry, Entry]
COMMANDS = ("1", *PULSES)
"""Units of commands: none, or that of pulses."""


@dataclass(frozen=True)
class Rudder:
    """A rudder, a plane, a steering nozzle, a weight that is moved: what it is turned or moved by steers.

    Args:
        name: an identifier.
        input: the model's input that holds the angle, the place or the order.
        turns: "yaw" for what works as a rudder, "pitch" for a stern or bow plane, or a battery that is moved.
        full: of an input that is no angle, what it holds hard over, in its unit: 0.02 m, 1, 1900 us. Effects count it
            as 35 deg. A command without a unit needs it only where full command is not 1, 100 % or 2000 us.

    Example:
        >>> from seatruth.models import Rudder
        >>> Rudder("nozzle", input="helm").turns
        'yaw'
    """

    name: str
    input: str
    turns: Literal["yaw", "pitch"] = "yaw"
    full: float | None = None

    @property
    def kind(self) -> str:
        """The kind of actuator that an effect asks for: "rudder" or "plane"."""
        return "rudder" if self.turns == "yaw" else "plane"


@dataclass(frozen=True)
class Thruster:
    """A propeller, a jet or a tunnel thruster.

    Args:
        name: an identifier.
        input: the model's input that drives it: revolutions, a command, a force.
        at: its place from the model's origin, m: forward, to starboard, down.
        towards: the direction of its force where the thrust is positive, a unit vector in the same axes.
        full: the input at full power ahead, in its unit: 20 rev/s, 1, 1900 us. The equations tell where it rests.
        diameter: m, of the propeller or the jet; only effects of the inflow ask for it.
        force: the output of a simulator that shows its force (N), positive along `towards`. A model of equations has
            `thrusts` instead.
        turned_by: the input (rad) by which a pod turns it from `towards` about the axis down, clockwise seen from
            above; "-azimuth" where the input counts the other way.

    Example:
        >>> from seatruth.models import Thruster
        >>> Thruster("port", input="n_port", at=(-0.5, "-beam", 0.0), towards=(1.0, 0.0, 0.0), full=20.0).kind
        'thruster'
    """

    name: str
    input: str
    at: Triple
    towards: Triple
    full: float
    diameter: float | None = None
    force: str | None = None
    turned_by: str | None = None

    @property
    def kind(self) -> str:
        """The kind of actuator that an effect asks for."""
        return "thruster"


def at_full_power(full: float, rest: float) -> float:
    """What an input adds at full power to that at which its thruster rests.

    Example:
        >>> at_full_power(1900.0, rest=1500.0), at_full_power(20.0, rest=0.0)
        (400.0, 20.0)
    """
    return full - rest if full > rest else full


@dataclass(frozen=True)
class ShownThrusts:
    """The function `thrusts(s, i, p, e)` of a simulator that shows the force of each thruster among its outputs."""

    outputs: tuple[str, ...]

    def __call__(self, s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return tuple(getattr(s, name) for name in self.outputs)


class Thrust(NamedTuple):
    """A thruster as effects see it: its force (N), place (m) and direction.

    `drive` is its input over that at full power. `area` m2 is the disc of the propeller, zero where it is not declared.
    """

    force: Any = 0.0
    x: Any = 0.0
    y: Any = 0.0
    z: Any = 0.0
    a: Any = 1.0
    b: Any = 0.0
    c: Any = 0.0
    drive: Any = 0.0
    area: Any = 0.0


def entry(value: Entry, p: Any) -> Any:
    """An entry of a place or a direction, from the model's parameters."""
    if not isinstance(value, str):
        return value
    return -getattr(p, value[1:]) if value.startswith("-") else getattr(p, value)


def push(thruster: Thruster, p: Any) -> tuple[float, float, float, float, float, float]:
    """Force and moment about the model's origin of a thrust of 1 N: X, Y, Z (1) and K, M, N (m), from its parameters.

    Example:
        >>> from seatruth.models.actuators import Thruster, push
        >>> push(Thruster("bow", "n", at=(2.0, 0.0, 0.1), towards=(0.0, 1.0, 0.0), full=20.0), None)
        (0.0, 1.0, 0.0, -0.1, 0.0, 2.0)
    """
    x, y, z = (float(entry(value, p)) for value in thruster.at)
    a, b, c = (float(entry(value, p)) for value in thruster.towards)
    return a, b, c, y * c - z * b, z * a - x * c, x * b - y * a


def turned(a: Any, b: Any, angle: Any) -> tuple[Any, Any]:
    """A direction ahead and to starboard, turned clockwise seen from above by an angle (rad).

    Example:
        >>> ahead, aside = turned(1.0, 0.0, math.radians(30.0))
        >>> round(ahead, 3), round(aside, 3)
        (0.866, 0.5)
    """
    c, s = math.cos(angle), math.sin(angle)
    return a * c - b * s, a * s + b * c


def shown_thrusts(actuators: Sequence[Rudder | Thruster]) -> ShownThrusts | None:
    """The function that takes the forces of all thrusters from a simulator's outputs; None where one names no output.

    Example:
        >>> from collections import namedtuple
        >>> from seatruth.models.actuators import Thruster, shown_thrusts
        >>> jet = Thruster("jet", "n", at=(-2.0, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=30.0, force="T_jet")
        >>> shown_thrusts([jet])(namedtuple("Outputs", "u T_jet")(1.0, 250.0), None, None, None)
        (250.0,)
    """
    names = [one.force for one in actuators if isinstance(one, Thruster)]
    known = tuple(name for name in names if name is not None)
    return ShownThrusts(known) if known and len(known) == len(names) else None


def problem_with(
    actuators: tuple[Rudder | Thruster, ...],
    inputs: Mapping[str, str],
    parameters: set[str],
    has_thrusts: bool,
    outputs: Mapping[str, str] | None = None,
) -> str:
    """What is wrong with a model's declaration of actuators; empty where nothing is.

    `inputs` are names and units; `outputs` those of what a simulator shows, None for a model of equations.
    """
    wrong = _problem_with_forces([one for one in actuators if isinstance(one, Thruster)], outputs)
    if wrong:
        return wrong
    names = [actuator.name for actuator in actuators]
    for actuator in actuators:
        if not actuator.name.isidentifier():
            return f"actuator {actuator.name!r} is not a usable name"
        if names.count(actuator.name) > 1:
            return f"two actuators are called {actuator.name!r}"
        if actuator.input not in inputs:
            return f"actuator {actuator.name!r} has the input {actuator.input!r}, which the model does not have"
        if isinstance(actuator, Rudder) and (wrong := _problem_with_full(actuator, inputs[actuator.input])):
            return wrong
        if isinstance(actuator, Thruster):
            unknown = [
                value
                for value in (*actuator.at, *actuator.towards)
                if isinstance(value, str) and value.removeprefix("-") not in parameters
            ]
            if unknown:
                return f"thruster {actuator.name!r} names {unknown[0]!r}, which is no parameter"
            turned = (actuator.turned_by or "").removeprefix("-")
            if turned and (turned not in inputs or radian_in(inputs[turned]) != 1.0):
                return f"thruster {actuator.name!r} is turned by {turned!r}, which is no input in rad"
            if not actuator.full > 0.0 or (actuator.diameter is not None and not actuator.diameter > 0.0):
                return f"thruster {actuator.name!r} needs a positive input at full power, and a positive diameter"
    if has_thrusts and not any(isinstance(actuator, Thruster) for actuator in actuators):
        return "it has thrusts(s, i, p, e) but names no Thruster among its actuators"
    return ""


def radian_in(unit: str) -> float | None:
    """What of a unit 1 rad is; None for what is no angle.

    Example:
        >>> radian_in("rad"), radian_in("m"), radian_in("1")
        (1.0, None, None)
    """
    if unit in (*COMMANDS, "%"):
        return None
    try:
        return 1.0 / to_si(unit, "rad").factor
    except BadInput:
        return None


def _problem_with_full(rudder: Rudder, unit: str) -> str:
    """What is wrong with what a rudder holds hard over; empty where nothing is."""
    if rudder.full is not None and radian_in(unit) is not None:
        return f"the input of {rudder.name!r} is an angle, which needs no `full`"
    if rudder.full is not None and not rudder.full > 0.0:
        return f"{rudder.name!r} needs a positive input hard over"
    if rudder.full is None and radian_in(unit) is None and unit not in COMMANDS:
        return f"the input of {rudder.name!r} is in {unit}, no angle: state `full`, the input hard over, in {unit}"
    return ""


def _is_force(unit: str) -> bool:
    """Whether a unit is the newton; what reads an FMU's units may call it kg*m/s**2."""
    try:
        return to_si(unit, "N") == Conversion(1.0, 0.0)
    except BadInput:
        return False


def _problem_with_forces(thrusters: Sequence[Thruster], outputs: Mapping[str, str] | None) -> str:
    stated = {one.name: one.force for one in thrusters if one.force is not None}
    for name, force in stated.items():
        if outputs is None:
            return f"thruster {name!r} names an output as its force; a model of equations has thrusts(s, i, p, e)"
        if force not in outputs:
            return f"thruster {name!r} has the force {force!r}, which is no output"
        if not _is_force(outputs[force]):
            return f"the force {force!r} of thruster {name!r} is in {outputs[force]!r}, not in N"
    silent = [one.name for one in thrusters if one.force is None]
    if stated and silent:
        return f"thruster {next(iter(stated))!r} shows its force and {silent[0]!r} does not"
    return ""
