"""What a model may have left out: the Effect interface, and models extended by effects.

An effect is one small class of plain equations. Each hook is optional:

    inputs(i, s, q, e)             inputs as they really act: the actuator's path
    parameters_acting(p, q)        the model's parameters as they really are: loading, hydrodynamics
    surroundings(e, s, i, p, q)    current and outside forces
    rates(s, i, p, q, e)           d/dt of the effect's own `states`
    outputs_recorded(y, s, i, q, e)    outputs as they were recorded: the sensor's path

s, i, y, p are the named tuples of the model (s with the effect's own states too), q the effect's own parameters, e the
surroundings; a hook gives a changed copy (`i._replace(delta=i.delta + q.offset)`). At its null values an effect
vanishes exactly, so one model can carry many.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

from seatruth.errors import BadInput, PluginError, nearest
from seatruth.models.base import Model, record, takes_surroundings
from seatruth.models.blackbox import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel

Hook = Callable[..., Any]


class Effect:
    """Base of every effect. Subclasses set the class attributes and define the hooks that they need.

    `parameters` are the effect's own, at a typical magnitude; `null` gives the value of each at which the effect
    vanishes. `needs_states`, `needs_inputs`, `needs_outputs` name channels that the model must have; `kinds` the kinds
    of vehicle that it can act on, all where empty.
    """

    name: str = ""
    title: str = ""
    family: str = ""
    """"environment", "actuator", "sensor", "hydrodynamics", "loading"."""
    number: int | None = None
    """In the catalogue of effects, where it is there."""
    source: str = ""
    kinds: tuple[str, ...] = ()
    needs_states: tuple[str, ...] = ()
    needs_inputs: tuple[str, ...] = ()
    needs_outputs: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    null: ClassVar[Mapping[str, float]] = {}
    states: tuple[Channel, ...] = ()

    inputs: Hook | None = None
    parameters_acting: Hook | None = None
    surroundings: Hook | None = None
    rates: Hook | None = None
    outputs_recorded: Hook | None = None

    def __init__(self) -> None:
        where = f"effect {self.name or type(self).__name__!r}"
        if not self.name.isidentifier():
            raise PluginError(f"{self.name!r} is not a usable name", where=where, do="Use an identifier.")
        known = [parameter.name for parameter in self.parameters]
        if sorted(known) != sorted(self.null):
            raise PluginError("null must give a value for each of its parameters", where=where)
        if bool(self.states) != (self.rates is not None):
            raise PluginError("its states and rates must come together", where=where)

    def missing(self, model: Model) -> str:
        """Why it cannot act on a model; empty where it can."""
        if self.kinds and model.kind and model.kind not in self.kinds:
            return f"it acts on {' and '.join(self.kinds)}, the model is of kind {model.kind!r}"
        if self.surroundings is not None and not takes_surroundings(model.rhs):
            return "the model's rhs takes no surroundings e"
        for kind, needed in (("state", "needs_states"), ("input", "needs_inputs"), ("output", "needs_outputs")):
            names = [channel.name for channel in getattr(model, f"{kind}s")]
            lacking = [name for name in getattr(self, needed) if name not in names]
            if lacking:
                return f"the model has no {kind} {lacking[0]!r}"
        return ""

    def named(self, parameter: str) -> str:
        """Name of one of its parameters in an extended model: "current_V_c"."""
        return f"{self.name}_{parameter}"


class ExtendedModel(Model):
    """A model with effects; made by `with_effects`. Its effects' parameters stand at their null values."""

    def __init__(self, base: Model, effects: Sequence[Effect]) -> None:
        self.base, self.effects = base, tuple(effects)
        self.name, self.kind, self.source = base.name, base.kind, base.source
        self.title = f"{base.title}, with {', '.join(effect.title for effect in effects)}"
        own_states = [channel for effect in effects for channel in effect.states]
        self.states = (*base.states, *own_states)
        self.inputs, self.outputs = base.inputs, base.outputs
        self.parameters = (*base.parameters, *(q for effect in effects for q in _parameters(effect)))
        self.rhs = _rhs(self)
        self.output = _output(self)
        self.initial_state = _initial_state(self)
        super().__init__()


def with_effects(model: Model, effects: Sequence[Effect]) -> Model:
    """The model with effects, in the order in which they act; BadInput where one cannot act on it."""
    if not effects:
        return model
    if isinstance(model, BlackBox):
        raise BadInput(f"model {model.name!r} is a black box; effects act on models given by equations")
    names = [effect.name for effect in effects]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise BadInput(f"the effect {twice[0]!r} is named twice")
    for effect in effects:
        reason = effect.missing(model)
        if reason:
            raise BadInput(f"the effect {effect.name!r} cannot act on model {model.name!r}: {reason}")
    return ExtendedModel(model, effects)


def _parameters(effect: Effect) -> list[Parameter]:
    return [
        parameter.but(name=effect.named(parameter.name), value=float(effect.null[parameter.name]), vary=False)
        for parameter in effect.parameters
    ]


def _split(model: ExtendedModel) -> Callable[[Any], tuple[Any, tuple[Any, ...]]]:
    """Takes the extended model's parameters apart: the base model's, and those of each effect."""
    base = record("Parameters", model.base.parameters)
    size = len(model.base.parameters)
    kinds = [namedtuple("Effect", [q.name for q in effect.parameters]) for effect in model.effects]
    edges = [size]
    for effect in model.effects:
        edges.append(edges[-1] + len(effect.parameters))

    def split(p: Any) -> tuple[Any, tuple[Any, ...]]:
        values = tuple(p)
        own = tuple(kind(*values[a:b]) for kind, a, b in zip(kinds, edges[:-1], edges[1:]))
        return base(*values[:size]), own

    return split


def _acting(model: ExtendedModel) -> Hook:
    """(s, i, p, e) of the extended model to (i, p, e, own parameters) as they act on the base model."""
    split = _split(model)
    on_inputs = tuple(effect.inputs for effect in model.effects)
    on_parameters = tuple(effect.parameters_acting for effect in model.effects)
    on_surroundings = tuple(effect.surroundings for effect in model.effects)

    def acting(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, Any, Any, tuple[Any, ...]]:
        p, own = split(p)
        for change, q in zip(on_parameters, own):
            p = p if change is None else change(p, q)
        for change, q in zip(on_surroundings, own):
            e = e if change is None else change(e, s, i, p, q)
        for change, q in zip(on_inputs, own):
            i = i if change is None else change(i, s, q, e)
        return i, p, e, own

    return acting


def _rhs(model: ExtendedModel) -> Hook:
    acting, base, size = _acting(model), model.base.rhs, len(model.base.states)
    plain = record("States", model.base.states)
    on_rates = tuple(effect.rates for effect in model.effects)
    full = takes_surroundings(base)

    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        i, p, e, own = acting(s, i, p, e)
        bare = plain(*tuple(s)[:size])
        found = list(base(bare, i, p, e) if full else base(bare, i, p))
        for rates, q in zip(on_rates, own):
            if rates is not None:
                found.extend(rates(s, i, p, q, e))
        return tuple(found)

    return rhs


def _output(model: ExtendedModel) -> Hook:
    acting, base, size = _acting(model), model.base.output, len(model.base.states)
    plain = record("States", model.base.states)
    kind = record("Outputs", model.base.outputs)
    names = [channel.name for channel in model.base.outputs]
    on_outputs = tuple(effect.outputs_recorded for effect in model.effects)
    full = base is not None and takes_surroundings(base)

    def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        i, p, e, own = acting(s, i, p, e)
        bare = plain(*tuple(s)[:size])
        if base is None:
            y = kind(*(getattr(bare, name) for name in names))
        else:
            y = kind(*(base(bare, i, p, e) if full else base(bare, i, p)))
        for change, q in zip(on_outputs, own):
            y = y if change is None else change(y, s, i, q, e)
        return tuple(y)

    return output


def _initial_state(model: ExtendedModel) -> Hook:
    split, base = _split(model), model.base.initial_state
    names = [channel.name for channel in model.base.states]
    more = len(model.states) - len(names)

    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        found = tuple(getattr(y, name) for name in names) if base is None else tuple(base(y, i, split(p)[0]))
        return (*found, *([0.0] * more))

    return initial_state


def effects_by_name(names: Sequence[str], known: Mapping[str, Effect]) -> list[Effect]:
    """Effects by name; BadInput names the nearest known one."""
    for name in names:
        if name not in known:
            raise BadInput(f"there is no effect {name!r}", do=nearest(name, known))
    return [known[name] for name in names]
