"""Which inputs of a model an effect on actuators acts on.

A model names its actuators (`Model.actuators`); where it names none of the kind, `undeclared_actuators` says which
inputs steer and drive it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any, NamedTuple, Protocol

from seatruth.effects.channel_aliases import ChannelAliases
from seatruth.effects.undeclared_actuators import (
    USUAL,
    drive_inputs,
    named_steering,
    resting_inputs,
    steering_inputs,
    unnamed_steering,
)
from seatruth.models.actuators import Thruster, at_full_power
from seatruth.models.base import Model
from seatruth.trials.standard_channels import STANDARD_CHANNELS


class ActsOnInputs(Protocol):
    """What an effect says of the inputs on which it acts; see `seatruth.effects.Effect`."""

    actuator: str
    input_name: str
    which: tuple[str, ...]
    pairs: bool
    any_drive: bool
    true_inputs: Callable[..., Any] | None
    servo: Callable[..., Any] | None

    @property
    def needs_inputs(self) -> tuple[str, ...]:
        """Inputs that the model must have, by the names in the hooks."""

    @property
    def needs_outputs(self) -> tuple[str, ...]:
        """Outputs that the model must have, by the names in the hooks."""

    @property
    def aliases(self) -> Mapping[str, tuple[str, ...]]:
        """The channels for which a name in the hooks may stand."""


class Target(NamedTuple):
    """An actuator on which an effect acts: its name, its input, the input at full power or at 1 rad, and for thrusters
    their places among the model's thrusters; -1 for others.
    """

    name: str
    input: str
    full: float = 1.0
    thruster: int = -1
    other: int = -1
    inferred: bool = False
    """Whether the model neither names it nor calls its input by a usual name."""
    neutral: float = 0.0
    """The input at which it rests, as far as that is known."""


def targets(effect: ActsOnInputs, model: Model) -> tuple[Target, ...]:
    """The actuators of a model on which an effect acts; one target holds both of a pair that is exchanged."""
    named = [actuator for actuator in model.actuators if actuator.kind == effect.actuator]
    thrusters = [actuator.name for actuator in model.actuators if isinstance(actuator, Thruster)]
    resting = (resting_inputs(model) or {}) if effect.actuator == "thruster" else {}
    found = []
    for actuator in named:
        if isinstance(actuator, Thruster):
            rest = resting.get(actuator.input, 0.0)
            found.append(_thruster(actuator, thrusters.index(actuator.name), rest))
        else:
            rest, radian = named_steering(model, actuator)
            found.append(Target(actuator.name, actuator.input, radian, neutral=rest))
    if not named:
        steer = effect.actuator != "thruster"
        names = steering_inputs(model, effect.actuator) if steer else drive_inputs(model) if effect.any_drive else ()
        declared = {actuator.input for actuator in model.actuators if steer}  # delta_s may be the starboard rudder
        usual = {*STANDARD_CHANNELS, *USUAL["rudder"], *USUAL["plane"]}
        commands = unnamed_steering(model) if steer else {}
        for name in [one for one in names if one not in declared]:
            rest, full = commands.get(name, (resting.get(name, 0.0), 1.0))
            inferred = model.standard_of(name)[0] not in usual
            found.append(Target(name, name, full, inferred=inferred, neutral=rest))
    if effect.true_inputs is not None or effect.servo is not None:
        # What is done to an order is done once, however many thrusters it drives.
        found = list({target.input: target for target in reversed(found)}.values())[::-1]
    if effect.pairs:
        both = [(first, second) for first, second in combinations(found, 2) if first.input != second.input]
        pairs = [first._replace(other=second.thruster) for first, second in both]
        wanted = [thrusters.index(name) for name in effect.which]
        return tuple(pair for pair in pairs if not wanted or [pair.thruster, pair.other] == wanted)
    return tuple(target for target in found if not effect.which or target.name in effect.which)


def _thruster(one: Thruster, place: int, rest: float) -> Target:
    return Target(one.name, one.input, at_full_power(one.full, rest), place, neutral=rest)


def aliases_of(effect: ActsOnInputs, model: Model, target: Target | None = None) -> ChannelAliases:
    """The names under which an effect sees the channels of a model; `drive` or `delta` is the input of its target."""
    names = dict(effect.aliases)
    if effect.actuator:
        standard = "" if target is None else model.standard_of(target.input)[0]
        names[effect.input_name] = (standard,)
    return ChannelAliases(names, effect.needs_inputs, model, effect.needs_outputs)
