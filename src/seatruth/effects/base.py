"""What a model may have left out: the Effect interface.

An effect is one small class of plain equations. Each hook is optional:

    parameters_acting(p, q)               the model's parameters as they really are: loading, hydrodynamics
    surroundings(e, s, i, p, q[, d])      current and outside forces
    inputs(i, s, q, e)                    inputs as they really act: the actuator's path
    rates(s, i, p, q, e)                  d/dt of the effect's own `states`
    rates_recorded(y, s, i, q, e)         the same, where they follow the outputs
    outputs_recorded(y, s, i, q, e)       outputs as they were recorded: the sensor's path
    initial(y, i, p, q)                   own states at the start of a trial; zero where there is none

s, i, y, p are the named tuples of the model, s with the effect's own states too, under the standard names of channels;
q are the effect's own parameters, e the surroundings, d the vehicle's size, thrust and drag (`models.vehicle.Body`). A
hook gives a changed copy (`i._replace(delta=i.delta + q.offset)`). At its null values an effect vanishes exactly, so
one model can carry many.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

from seatruth.effects.causes import CAUSES, ROOT, children, is_cause
from seatruth.effects.channel_aliases import Names
from seatruth.errors import BadInput, PluginError, nearest
from seatruth.models.base import Model, record
from seatruth.models.blackbox import BlackBox
from seatruth.models.geometry import Dimensions
from seatruth.models.parameter import Parameter, Prior
from seatruth.trials.channel import Channel

Hook = Callable[..., Any]

EQUATIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw", "kinematics")
"""Words of `acts_on` beside "actuator:<input>" and "sensor:<output>"."""


_FULL_SIZE = 100.0
"""m: length of a ship from which typical magnitudes are full ones."""


class Effect:
    """Base of every effect. Subclasses set the class attributes and define the hooks that they need.

    `parameters` are the effect's own, at a typical magnitude; `null` gives the value of each at which the effect
    vanishes. `needs_states`, `needs_inputs`, `needs_outputs` name channels that the model must have, `needs_vehicle`
    which of "dimensions", "thrust", "drag" it must declare; `kinds` the kinds of vehicle that it can act on, all where
    empty.
    """

    name: str = ""
    title: str = ""
    cause: str = ""
    """Its place in the tree of causes (`seatruth.effects.causes`), "environment.force_fixed_to_earth.wind"."""
    number: int | None = None
    """In the catalogue of effects, where it is there."""
    equation: str = ""
    """As text, for lists and reports."""
    source: str = ""
    kinds: tuple[str, ...] = ()
    needs_states: tuple[str, ...] = ()
    needs_inputs: tuple[str, ...] = ()
    needs_outputs: tuple[str, ...] = ()
    needs_vehicle: tuple[str, ...] = ()
    needs_parameters: tuple[str, ...] = ()
    """At least one of these must be a parameter of the model, where not empty."""
    aliases: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """The channels for which a name in the hooks may stand; the model's first one is taken."""
    parameters: tuple[Parameter, ...] = ()
    null: ClassVar[Mapping[str, float]] = {}
    states: tuple[Channel, ...] = ()
    follows: ClassVar[Mapping[str, str]] = {}
    """Which of its states start where a state of the model starts, and move with it where that is free."""

    longest_step: float = math.inf
    """s: the longest integration step that its own states allow."""

    acts_on: tuple[str, ...] = ()
    """Where it acts: words of `EQUATIONS`, "actuator:<input>", "sensor:<output>"."""
    equivalent: tuple[str, ...] = ()
    """Effects, or parameters of models (patterns: "N_d*"), from which motion data can never tell it."""
    confused_with: tuple[str, ...] = ()
    """Effects from which only some trials can tell it."""
    told_apart: str = ""
    """What tells it from those."""
    magnitudes: ClassVar[Mapping[str, Mapping[str, float]]] = {}
    """Typical distance from null by kind of vehicle, where it is not that of `parameters`."""
    froude: ClassVar[Mapping[str, float]] = {}
    """Power of the length with which those of ships shorter than 100 m go (1/2 for times and speeds)."""
    starts: tuple[Mapping[str, float], ...] = ()
    """Finite values to start a fit from, where the null is no regular point."""
    stochastic: bool = False
    """It has a random part, which no trial repeats: the noise of a fit must hold that."""
    dynamic: bool = True
    """It can be a term of the equations; False for what is noise only."""

    parameters_acting: Hook | None = None
    surroundings: Hook | None = None
    inputs: Hook | None = None
    rates: Hook | None = None
    rates_recorded: Hook | None = None
    outputs_recorded: Hook | None = None
    initial: Hook | None = None

    def __init__(self) -> None:
        where = f"effect {self.name or type(self).__name__!r}"
        if not self.name.isidentifier():
            raise PluginError(f"{self.name!r} is not a usable name", where=where, do="Use an identifier.")
        known = [parameter.name for parameter in self.parameters]
        if sorted(known) != sorted(self.null):
            raise PluginError("null must give a value for each of its parameters", where=where)
        if bool(self.states) != (self.rates is not None or self.rates_recorded is not None):
            raise PluginError("its states and rates must come together", where=where)
        if self.rates is not None and self.rates_recorded is not None:
            raise PluginError("its states follow either rates or rates_recorded", where=where)
        for start in self.starts:
            if sorted(start) != sorted(known):
                raise PluginError("each of its starts must give a value for each of its parameters", where=where)
        if not is_cause(self.cause):
            what = f"{self.cause!r} is no place in the tree of causes" if self.cause else "it states no cause"
            known_causes = ", ".join(children(ROOT))
            do = nearest(self.cause, [path for path in CAUSES if path]) if self.cause else ""
            raise PluginError(what, where=where, do=do or f"State one of {known_causes}, or a node below one of them.")

    @property
    def family(self) -> str:
        """The family of causes that it belongs to, "environment": the first part of `cause`."""
        return self.cause.partition(".")[0]

    @property
    def outside(self) -> bool:
        """Whether it acts on inputs and outputs alone, so that a black box can have it."""
        inside = self.surroundings is not None or self.parameters_acting is not None or self.needs_states
        return self.dynamic and not inside

    def priors(self, model: Model) -> dict[str, Prior]:
        """What is known of its magnitude on a model before the data speak: parameter name to Prior about the null.

        The standard deviation is the typical distance from null, that of the model's kind where `magnitudes` has it;
        on a ship that is smaller than 100 m (most such are models) reduced by Froude's rule, as `froude` says.
        """
        kind = self.magnitudes.get(model.kind, {})
        size = dimensions_of(model) if self.froude and model.kind == "ship" else None
        ratio = 1.0 if size is None else min(1.0, size.length / _FULL_SIZE)
        found = {}
        for q in self.parameters:
            null = self.null[q.name]
            sd = kind.get(q.name, abs(q.value - null)) * ratio ** self.froude.get(q.name, 0.0)
            found[q.name] = Prior(null, sd)
        return found

    def typical(self, model: Model) -> dict[str, float]:
        """Values of its parameters at a typical magnitude on a model: one standard deviation of its priors."""
        found = {}
        for q in self.parameters:
            prior = self.priors(model)[q.name]
            side = -1.0 if q.value < prior.mean else 1.0
            found[q.name] = min(q.max, max(q.min, prior.mean + side * prior.sd))
        return found

    def places(self, model: Model) -> tuple[str, ...]:
        """`acts_on` with the model's own names of inputs and outputs."""
        names = Names(self.aliases, self.needs_inputs, model)
        return tuple(f"{a}:{names.own(b)}" if b else a for a, _, b in (place.partition(":") for place in self.acts_on))

    def missing(self, model: Model) -> str:
        """Why it cannot act on a model; empty where it can."""
        if not self.dynamic:
            return "it is noise, no term of the equations"
        if self.kinds and model.kind and model.kind not in self.kinds:
            return f"it acts on {' and '.join(self.kinds)}, the model is of kind {model.kind!r}"
        if isinstance(model, BlackBox) and not self.outside:
            return "the model is a black box, and the effect acts on its equations"
        if self.surroundings is not None and not model.takes_environment:
            return "the model's rhs takes no surroundings e"
        names = Names(self.aliases, self.needs_inputs, model)
        for kind, needed in (("state", "needs_states"), ("input", "needs_inputs"), ("output", "needs_outputs")):
            have = [names.seen(channel.name) for channel in getattr(model, f"{kind}s")]
            lacking = [name for name in getattr(self, needed) if name not in have]
            if lacking:
                return f"the model has no {kind} {self.aliases.get(lacking[0], lacking)[0]!r}"
        for role in self.needs_vehicle:
            if getattr(model, role) is None:
                return f"the model does not declare its {role}"
        if self.needs_parameters and not {q.name for q in model.parameters} & {*self.needs_parameters}:
            return f"the model has none of the parameters {', '.join(self.needs_parameters)}"
        return ""

    def named(self, parameter: str) -> str:
        """Name of one of its parameters or states in an extended model: "current_V_c"."""
        return f"{self.name}_{parameter}"


def dimensions_of(model: Model) -> Dimensions | None:
    """A model's size at its nominal parameters, as numbers; None where it declares none."""
    if model.dimensions is None:
        return None
    p = record("Parameters", model.parameters)(**model.nominal())
    return Dimensions(*(float(x) for x in model.dimensions(p)))


def effects_by_name(names: Sequence[str], known: Mapping[str, Effect]) -> list[Effect]:
    """Effects by name; BadInput names the nearest known one."""
    for name in names:
        if name not in known:
            raise BadInput(f"there is no effect {name!r}", do=nearest(name, known))
    return [known[name] for name in names]
