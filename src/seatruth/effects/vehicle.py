"""The vehicle as effects see it at one moment: its size, thrust, drag and thrusters, as the model declares them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from seatruth.effects.commands import NOT_COMPUTED
from seatruth.effects.undeclared_actuators import drive_inputs, resting_inputs
from seatruth.models.actuators import Thrust, Thruster, at_full_power, entry, turned
from seatruth.models.base import Environment, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.geometry import Dimensions, Vehicle
from seatruth.trials.channel import Channel

Role = Callable[..., Any]


def motion_channels(model: Model) -> tuple[Channel, ...]:
    """The channels of s in the equations of effects: the states, or what a black box shows, its outputs.

    Example:
        >>> from seatruth import load_model
        >>> from seatruth.effects.vehicle import motion_channels
        >>> [channel.name for channel in motion_channels(load_model("twin_thruster"))]
        ['u', 'v', 'r', 'x', 'y', 'psi']
    """
    return model.innermost.outputs if isinstance(model, BlackBox) else model.states


def role_of(model: Model, role: str) -> Any:
    """What a model declares as `dimensions`, `thrust`, `drag` or `thrusts`, or what follows for thrust and drag."""
    declared = getattr(model, role)
    if declared is None and role == "drag":
        return straight_drag(model)
    if declared is None and role == "thrust":
        return _force_of_propeller(model) or straight_thrust(model)
    return declared


def _force_of_propeller(model: Model) -> Role | None:
    """The force (N) of a model's only thruster where that is a propeller: fixed, on the centreline, it pushes ahead.

    Example:
        >>> from seatruth import load_model
        >>> _force_of_propeller(load_model("twin_thruster")) is None
        True
    """
    named = [one for one in model.actuators if isinstance(one, Thruster)]
    thrusts = model.thrusts
    if thrusts is None or len(named) != 1 or named[0].turned_by is not None:
        return None
    p = record("Parameters", model.parameters)(**model.nominal())
    forward, side, _ = (float(entry(one, p)) for one in named[0].at)
    ahead = float(entry(named[0].towards[0], p))
    if side != 0.0 or forward > 0.0 or ahead != 1.0:
        return None

    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return thrusts(s, i, p, e)[0]

    return thrust


def dimensions_of(model: Model) -> Dimensions | None:
    """A model's size at its nominal parameters, as numbers; None where it declares none."""
    if model.dimensions is None:
        return None
    p = record("Parameters", model.parameters)(**model.nominal())
    return Dimensions(*(None if x is None else float(x) for x in model.dimensions(p)))


def unseen(model: Model, role: str) -> str:
    """What the model's `thrust`, `drag` or `thrusts` asks for and a black box does not show; empty where nothing.

    Models of equations show all that they have. A black box shows its outputs alone, so the function is tried on them.
    """
    function = getattr(model, role)
    if not isinstance(model, BlackBox) or function is None:
        return ""
    box = model.innermost
    s = record("States", box.outputs)(*(0.0 for _ in box.outputs))
    i = record("Inputs", box.inputs)(*(0.0 for _ in box.inputs))
    p = record("Parameters", box.parameters)(**box.nominal())
    try:
        getattr(box, role)(s, i, p, Environment())
    except AttributeError as problem:
        return str(problem.name or problem)
    except ArithmeticError:
        pass  # it cannot be computed at rest, and asks for nothing that is not there
    return ""


def straight_drag(model: Model) -> Role | None:
    """The drag (N) of a model that declares none: what slows it in straight motion, upright and undriven.

    In these equations an outside force of 1 N tells the inertia: the drag is the deceleration over what it adds. Every
    other state is zero, and every input at rest. A thrust that no input changes drives at rest as well, and is taken
    off. None where there is no speed ahead, no outside force acts, or it cannot be computed so.

    Example:
        >>> from seatruth import Channel, Model, Parameter
        >>> class Sled(Model):
        ...     name = "sled"
        ...     states = outputs = (Channel("u", "m/s"),)
        ...     inputs = (Channel("T", "N"),)
        ...     parameters = (Parameter("m", 50.0, "kg"), Parameter("X_uu", 3.0, "kg/m"))
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p, e):
        ...         return ((i.T - p.X_uu * s.u * abs(s.u) + e.X) / p.m,)
        >>> sled = Sled()
        >>> drag, thrust = straight_drag(sled), straight_thrust(sled)
        >>> p, s = record("Parameters", sled.parameters)(50.0, 3.0), record("States", sled.states)(2.0)
        >>> round(drag(s, None, p, Environment()), 9)
        12.0
        >>> round(thrust(s, record("Inputs", sled.inputs)(7.0), p, Environment()), 9)
        7.0
    """
    force = _straight_force(model)
    if force is None:
        return None
    undriven = _undriven(model)
    s, p, sign, name = _at_rest(model)

    def drag(s: Any, i: Any, p: Any, e: Any) -> Any:
        slowed = -force(s, undriven, p, e)
        if driven:
            # Only what needs it pays for it: the engine writes out the equations once more.
            slowed = slowed + force(s._replace(**{name: sign * e.u_c}), undriven, p, e)
        return slowed

    try:
        driven = force(s, undriven, p, Environment()) != 0.0
        tried = [sign * speed * drag(s._replace(**{name: speed}), None, p, Environment()) for speed in (-1.0, 1.0)]
        return drag if all(math.isfinite(power) and power > 0.0 for power in tried) else None
    except NOT_COMPUTED:
        return None


def straight_thrust(model: Model) -> Role | None:
    """The thrust (N) of a model that declares none and has one drive: what that adds in straight motion, upright.

    As `straight_drag`: the difference that the drive makes to the acceleration, with every other input at rest, over
    what an outside force of 1 N adds. None where there are several drives, or it cannot be computed so.
    """
    force, drives = _straight_force(model), drive_inputs(model)
    if force is None or len(drives) != 1:
        return None
    (drive,) = drives
    undriven = _undriven(model)

    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return force(s, undriven._replace(**{drive: getattr(i, drive)}), p, e) - force(s, undriven, p, e)

    s, p, _, _ = _at_rest(model)
    try:
        pushed = thrust(s, undriven._replace(**{drive: getattr(undriven, drive) + 1.0}), p, Environment())
        return thrust if math.isfinite(pushed) and pushed != 0.0 else None
    except NOT_COMPUTED:
        return None


def _undriven(model: Model) -> Any:
    """The inputs of a model at rest; zero where it does not tell them."""
    resting = resting_inputs(model) or {}
    return record("Inputs", model.inputs)(*(resting.get(channel.name, 0.0) for channel in model.inputs))


def _at_rest(model: Model) -> tuple[Any, Any, int, str]:
    """A model's states at zero, its nominal parameters, and the sign and the name of its speed ahead."""
    name = next(state.name for state in model.states if model.standard_of(state.name)[0] == "u")
    s = record("States", model.states)(*(0.0 for _ in model.states))
    p = record("Parameters", model.parameters)(**model.nominal())
    return s, p, model.standard_of(name)[1], name


def _straight_force(model: Model) -> Role | None:
    """The force ahead (N) in straight motion as a function of (s, i, p, e); None where the equations do not tell it."""
    ahead = any(model.standard_of(state.name)[0] == "u" for state in model.states)
    if isinstance(model, BlackBox) or not model.takes_environment or not ahead:
        return None
    at_rest, _, sign, name = _at_rest(model)
    column = [state.name for state in model.states].index(name)
    rhs, calm, pushed = model.rhs, Environment(), Environment(X=1.0)

    def force(s: Any, i: Any, p: Any, e: Any) -> Any:
        straight = at_rest._replace(**{name: getattr(s, name) - sign * e.u_c})
        faster = rhs(straight, i, p, calm)[column]
        return faster / (rhs(straight, i, p, pushed)[column] - faster)

    return force


@dataclass(frozen=True)
class DeclaredVehicle:
    """What a model declares of its vehicle, as values that can be sent to other processes.

    `motions` and `inputs` are the channels of s and i; `dimensions`, `thrust`, `drag` and `thrusts` the
    model's functions, None where it has none. `thrusters` is empty where no effect asks for them.
    """

    motions: tuple[Channel, ...]
    inputs: tuple[Channel, ...]
    thrusters: tuple[Thruster, ...]
    dimensions: Role | None
    thrust: Role | None
    drag: Role | None
    thrusts: Role | None
    resting: tuple[float, ...]
    """Inputs at which the thrusters rest."""

    @classmethod
    def of(cls, model: Model, *, with_thrusters: bool) -> DeclaredVehicle:
        """What a model declares; of a black box, what the innermost one does."""
        source = model.innermost if isinstance(model, BlackBox) else model
        thrust, drag, thrusts = (
            None if unseen(model, role) else role_of(source, role) for role in ("thrust", "drag", "thrusts")
        )
        thrusters = tuple(one for one in source.actuators if isinstance(one, Thruster)) if with_thrusters else ()
        resting = resting_inputs(source) or {}
        rests = tuple(resting.get(one.input, 0.0) for one in thrusters)
        channels = motion_channels(model), source.inputs
        return cls(*channels, thrusters, source.dimensions, thrust, drag, thrusts, rests)

    def function(self) -> Role:
        """(s, i, p, e) to the `Vehicle`, and its thrusters as a list of `Thrust`.

        All that it needs is in local variables, as the engine requires.
        """
        dimensions, thrust, drag = self.dimensions, self.thrust, self.drag
        forces, declared = self.thrusts, self.thrusters
        at_rest = record("States", self.motions)(*(0.0 for _ in self.motions))
        columns = [[channel.name for channel in self.inputs].index(one.input) for one in declared]
        names = [channel.name for channel in self.inputs]
        turns = [(one.turned_by or "").removeprefix("-") for one in declared]
        angles = [names.index(name) if name else -1 for name in turns]
        signs = [-1.0 if (one.turned_by or "").startswith("-") else 1.0 for one in declared]
        spans = [at_full_power(one.full, rest) for one, rest in zip(declared, self.resting)]
        resting = self.resting

        def vehicle(s: Any, i: Any, p: Any, e: Any) -> Any:
            result = Vehicle() if dimensions is None else Vehicle(*dimensions(p))
            if thrust is not None:
                still = e._replace(u_c=0.0, v_c=0.0, w_c=0.0)
                result = result._replace(thrust=thrust(s, i, p, e), thrust_0=thrust(at_rest, i, p, still))
            if drag is not None:
                result = result._replace(drag=drag(s, i, p, e))
            if not declared:
                return result, ()
            pushes = (0.0,) * len(declared) if forces is None else tuple(forces(s, i, p, e))
            thrusters = []
            for push, one, column, rest, span, angle, sign in zip(
                pushes, declared, columns, resting, spans, angles, signs
            ):
                x, y, z = (entry(value, p) for value in one.at)
                a, b, c = (entry(value, p) for value in one.towards)
                if angle >= 0:
                    a, b = turned(a, b, sign * i[angle])
                area = 0.0 if one.diameter is None else 0.25 * math.pi * one.diameter * one.diameter
                over = i[column] - rest if rest else i[column]
                thrusters.append(Thrust(push, x, y, z, a, b, c, abs(over) / span, area))
            load = 0.0
            for thruster in thrusters:
                load = load + thruster.drive / len(thrusters)
            return result._replace(load=load), thrusters

        return vehicle
