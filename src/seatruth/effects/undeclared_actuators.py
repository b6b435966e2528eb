"""The inputs that steer and drive a model, and what they hold, above all where it does not name its actuators.

An input with a usual name is taken for what the name says. Where there is none, an angle among the inputs that turns
the model steers it, whatever it is called, or else a command without a unit that turns it under way alone. A speed of
revolution, a force or any other command without a unit drives it: so the steering gear and the engine of a user's own
model can be at fault as those of any other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

from seatruth.effects.commands import FULL, FULL_RUDDER, NOT_COMPUTED, SteeringCommand, steering_commands
from seatruth.models.actuators import COMMANDS, Rudder, at_full_power, radian_in
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.rates import rates_at
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.standard_channels import STANDARD_CHANNELS

USUAL: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"rudder": ("delta", "delta_r"), "plane": ("delta_s", "delta_e"), "thruster": ()}
)
"""Standard names of inputs by the kind of actuator that they are, where a model names none."""
_TURNING = MappingProxyType({"rudder": ("r", "psi"), "plane": ("q", "theta")})
_DRIVES = ("rev/s", "N", *COMMANDS)
"""Units of what drives a vehicle."""
_OUTSIDE = ("wind", "wave", "current", "sea", "flow", "tide")
"""Words in the names of inputs that are no actuator, but the weather."""
_TRIED = 0.1
"""rad: the change of an angle that is tried. [S]"""
_RESTING = 1e-9
"""Part of the acceleration under other commands below which a model at rest stays there."""


def bare(model: Model) -> Model:
    """The equations inside a model with servos, sensors or effects around it."""
    while isinstance(model, ModelWrapper):
        model = model.base
    return model


def steering_inputs(model: Model, kind: str) -> tuple[str, ...]:
    """Inputs of a model that act as "rudder" or as "plane": those that it names; else usual names; else what turns it.

    Example:
        >>> from seatruth import Channel, Model, load_model
        >>> class Boat(Model):
        ...     name = "boat"
        ...     states = outputs = (Channel("r", "rad/s"),)
        ...     inputs = (Channel("helm", "rad"),)
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p):
        ...         return (0.3 * i.helm - s.r,)
        >>> steering_inputs(Boat(), "rudder"), steering_inputs(load_model("torpedo"), "plane")
        (('helm',), ('delta_s',))
    """
    named = tuple(one.input for one in model.actuators if isinstance(one, Rudder) and one.kind == kind)
    if named:
        return named
    by_name = {model.standard_of(channel.name)[0]: channel.name for channel in model.inputs}
    usual = tuple(by_name[name] for name in USUAL[kind] if name in by_name)
    if usual:
        return usual[:1]
    angles = tuple(name for name in _free_angles(model) if _turned_by(model, name) == kind)
    return angles if angles or kind != "rudder" else tuple(unnamed_steering(model))


def unnamed_steering(model: Model) -> dict[str, SteeringCommand]:
    """The inputs without a unit that steer a model which names no rudder and has no input of an angle."""
    if isinstance(model, BlackBox) or any(isinstance(one, Rudder) for one in model.actuators):
        return {}
    model = bare(model)
    usual = {model.standard_of(channel.name)[0] for channel in model.inputs} & {*USUAL["rudder"]}
    if usual or _free_angles(model):
        return {}
    free = _unnamed(model)
    return steering_commands(model, [c.name for c in model.inputs if c.name in free and c.unit in COMMANDS])


def named_steering(model: Model, rudder: Rudder) -> SteeringCommand:
    """Where the input of a rudder that a model names rests, and how much of it counts as 1 rad.

    Example:
        >>> from seatruth import load_model
        >>> from seatruth.models import Rudder
        >>> model = load_model("diving_plane")
        >>> named_steering(model, Rudder("stern_plane", "delta_s", turns="pitch"))
        SteeringCommand(neutral=0.0, radian=1.0)
    """
    unit = next(channel.unit for channel in model.inputs if channel.name == rudder.input)
    radian = radian_in(unit)
    if radian is not None:
        return SteeringCommand(0.0, radian)
    inner, told = bare(model), {}
    if unit in COMMANDS and not isinstance(inner, BlackBox):
        told = steering_commands(inner, [rudder.input])
    rest, radian = told.get(rudder.input, SteeringCommand(0.0, FULL[0.0] / FULL_RUDDER))
    return SteeringCommand(rest, radian if rudder.full is None else at_full_power(rudder.full, rest) / FULL_RUDDER)


def drive_inputs(model: Model) -> tuple[str, ...]:
    """Inputs that drive a model which names no thruster: its revolutions, forces and commands without a unit.

    Example:
        >>> from seatruth import load_model
        >>> drive_inputs(load_model("mmg")), drive_inputs(load_model("twin_thruster"))
        (('n',), ())
    """
    if any(one.kind == "thruster" for one in model.actuators):
        return ()
    free = _unnamed(model) - {*unnamed_steering(model)}
    return tuple(channel.name for channel in model.inputs if channel.name in free and channel.unit in _DRIVES)


def neutral(model: Model) -> float | None:
    """The input at which the drives of a model rest, by the equations at rest; None where they do not tell it.

    Revolutions and forces rest at zero, and most commands; a model in pulses of its speed controllers at 1500 us.

    Example:
        >>> from seatruth import Channel, Model
        >>> class Raft(Model):
        ...     name = "raft"
        ...     states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))
        ...     inputs = (Channel("port", "1"), Channel("starboard", "1"))
        ...
        ...     @staticmethod
        ...     def rhs(s, i, p):
        ...         port, starboard = (i.port - 1500.0) / 400.0, (i.starboard - 1500.0) / 400.0
        ...         return port + starboard - s.u, port - starboard - s.r
        >>> neutral(Raft())
        1500.0
    """
    model = bare(model)
    if isinstance(model, BlackBox):
        return None
    commands = drive_commands(model)
    if not commands:
        return 0.0 if drive_inputs(model) else None
    sizes = {value: _acceleration(model, dict.fromkeys(commands, value)) for value in FULL}
    largest = max((size for size in sizes.values() if math.isfinite(size)), default=0.0)
    return next((value for value, size in sizes.items() if size < _RESTING * largest), None)


def drive_commands(model: Model) -> tuple[str, ...]:
    """The inputs without a unit, or in pulses, that drive a model, named thrusters or not.

    Example:
        >>> from seatruth import load_model
        >>> drive_commands(load_model("bluerov2"))[:2], drive_commands(load_model("mmg"))
        (('c_1', 'c_2'), ())
    """
    drives = {one.input for one in model.actuators if one.kind == "thruster"} | {*drive_inputs(model)}
    return tuple(channel.name for channel in model.inputs if channel.name in drives and channel.unit in COMMANDS)


def resting_inputs(model: Model) -> dict[str, float] | None:
    """The inputs under which a model rests: zero, or the middle of its commands; None where it does not tell them.

    Example:
        >>> from seatruth import load_model
        >>> resting_inputs(load_model("mmg"))
        {'delta': 0.0, 'n': 0.0}
    """
    model = bare(model)
    found = _resting(model)
    return None if found is None else dict(found)


@lru_cache(maxsize=64)  # each effect asks, of each of its forms
def _resting(model: Model) -> Mapping[str, float] | None:
    rest = None if isinstance(model, BlackBox) else 0.0
    if drive_commands(model):
        rest = neutral(model)
    if rest is None:
        return None
    steering = {name: command.neutral for name, command in unnamed_steering(model).items()}
    zero = dict.fromkeys((channel.name for channel in model.inputs), 0.0)
    return zero | dict.fromkeys(drive_commands(model), rest) | steering


def _acceleration(model: Model, inputs: Mapping[str, float]) -> float:
    """Largest rate of surge, sway or yaw at rest under these inputs, all others zero; NaN where it is not computed.

    Others do not rest: a weight pulls, and a list turns back.
    """
    try:
        rates = rates_at(model, inputs=inputs)
        return max(abs(float(rate)) for rate, c in zip(rates, model.states) if model.standard_of(c.name)[0] in "uvr")
    except NOT_COMPUTED:
        return math.nan


def _unnamed(model: Model) -> set[str]:
    """Inputs that are no named actuator, no motion that a log gives, and no weather."""
    named = {actuator.input for actuator in model.actuators}
    known = {*STANDARD_CHANNELS, *USUAL["rudder"], *USUAL["plane"]} - {"n"}
    return {
        channel.name
        for channel in model.inputs
        if channel.name not in named
        and model.standard_of(channel.name)[0] not in known
        and not any(word in channel.name.lower() for word in _OUTSIDE)
    }


def _free_angles(model: Model) -> list[str]:
    free = _unnamed(model)
    return [channel.name for channel in model.inputs if channel.name in free and channel.unit == "rad"]


def _turned_by(model: Model, name: str) -> str:
    """The kind of actuator that an angle is: "rudder" where it turns the model in yaw, "plane" in pitch; else ''."""
    shown = model.innermost.outputs if isinstance(model, BlackBox) else model.states
    motions = {model.standard_of(channel.name)[0] for channel in shown}
    kinds = [kind for kind, rates in _TURNING.items() if motions & {*rates}]
    if len(kinds) < 2 or isinstance(model, BlackBox):
        return kinds[0] if len(kinds) == 1 else ""
    change = {kind: _change(model, name, _TURNING[kind][0]) for kind in kinds}
    strongest = max(kinds, key=lambda kind: change[kind])
    return strongest if change[strongest] > 0.0 else ""


def _change(model: Model, name: str, rate: str) -> float:
    """How much an angle changes the rate of a state, under way with every drive on; 0 where that cannot be computed."""
    names = [model.standard_of(state.name)[0] for state in model.states]
    if rate not in names:
        return 0.0
    ahead = {state.name: 1.0 for state, standard in zip(model.states, names) if standard == "u"}
    running = {channel.name: 1.0 for channel in model.inputs if channel.unit in _DRIVES}
    try:
        before, after = (rates_at(model, ahead, {**running, name: angle})[names.index(rate)] for angle in (0.0, _TRIED))
    except NOT_COMPUTED:
        return 0.0
    return abs(after - before) if math.isfinite(after - before) else 0.0
