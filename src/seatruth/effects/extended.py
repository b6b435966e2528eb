"""Models extended by effects: the effects' equations around those of the model, compiled together."""

from __future__ import annotations

import inspect
from collections import namedtuple
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.black_box import ExtendedBlackBox
from seatruth.effects.channel_aliases import Names, View
from seatruth.errors import BadInput
from seatruth.models.base import Model, record, takes_surroundings
from seatruth.models.blackbox import BlackBox
from seatruth.models.geometry import Body
from seatruth.models.parameter import Parameter


class ExtendedModel(Model):
    """A model with effects; made by `with_effects`. Its effects' parameters stand at their null values."""

    def __init__(self, base: Model, effects: Sequence[Effect]) -> None:
        self.base, self.effects = base, tuple(effects)
        self.name, self.kind, self.source = base.name, base.kind, base.source
        self.title = f"{base.title}, with {', '.join(effect.title for effect in effects)}"
        self.states = (*base.states, *own_states(effects))
        self.longest_step = min(base.longest_step, *(effect.longest_step for effect in effects))
        self.hidden = (*base.hidden, *(channel.name for channel in own_states(effects)))
        self.follows = {**base.follows, **_follows(base, effects)}
        self.inputs, self.outputs = base.inputs, base.outputs
        self.parameters = (*base.parameters, *own_parameters(effects))
        path = _Path(base, self.effects)
        self.rhs, self.output, self.initial_state = path.rhs(), path.output(), path.initial_state()
        self.dimensions, self.thrust, self.drag = base.dimensions, base.thrust, base.drag
        self.standard = base.standard
        super().__init__()


def with_effects(model: Model, effects: Sequence[Effect]) -> Model:
    """The model with effects, in the order in which they act; BadInput where one cannot act on it.

    Currents act before the forces that depend on them, whatever the order. A black box takes the effects that act
    from outside.
    """
    if not effects:
        return model
    names = [effect.name for effect in effects]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise BadInput(f"the effect {twice[0]!r} is named twice")
    for effect in effects:
        reason = effect.missing(model)
        if reason:
            raise BadInput(f"the effect {effect.name!r} cannot act on model {model.name!r}: {reason}")
    if isinstance(model, BlackBox):
        return ExtendedBlackBox(model, effects)
    return ExtendedModel(model, effects)


def own_parameters(effects: Sequence[Effect]) -> list[Parameter]:
    """The effects' parameters under their names in an extended model, at null."""
    return [
        parameter.replace(name=effect.named(parameter.name), value=float(effect.null[parameter.name]), vary=False)
        for effect in effects
        for parameter in effect.parameters
    ]


def own_states(effects: Sequence[Effect]) -> list[Any]:
    """The effects' states under their names in an extended model."""
    return [
        type(channel)(effect.named(channel.name), channel.unit, channel.description, channel.angle)
        for effect in effects
        for channel in effect.states
    ]


def _follows(base: Model, effects: Sequence[Effect]) -> dict[str, tuple[str, float]]:
    """The effects' states that start with a state of the model, under their names in the extended model."""
    states = {channel.name for channel in base.states}
    found = {}
    for effect in effects:
        names = Names(effect.aliases, effect.needs_inputs, base)
        for own, state in effect.follows.items():
            if names.own(state) in states:
                found[effect.named(own)] = (names.own(state), float(names.sign(names.own(state))))
    return found


class _Path:
    """From the extended model's records through the effects to the base model's, and back."""

    def __init__(self, base: Model, effects: Sequence[Effect]) -> None:
        self.base, self.effects = base, effects
        self.size, self.count = len(base.states), len(base.parameters)
        self.state_edges = list(accumulate((len(effect.states) for effect in effects), initial=self.size))
        self.edges = list(accumulate((len(effect.parameters) for effect in effects), initial=self.count))
        self.own = [namedtuple("Effect", [q.name for q in effect.parameters]) for effect in effects]
        names = [Names(effect.aliases, effect.needs_inputs, base) for effect in effects]
        self.see_s = [View(name, base.states, effect.states) for name, effect in zip(names, effects)]
        self.see_i = [View(name, base.inputs) for name in names]
        self.see_y = [View(name, base.outputs) for name in names]

    def split(self) -> Any:
        """Takes the parameters apart: the base model's, and those of each effect."""
        base, count, kinds, edges = record("Parameters", self.base.parameters), self.count, self.own, self.edges

        def split(p: Any) -> tuple[Any, tuple[Any, ...]]:
            values = tuple(p)
            return base(*values[:count]), tuple(kind(*values[a:b]) for kind, (a, b) in zip(kinds, pairwise(edges)))

        return split

    def states(self) -> Any:
        """Takes the states apart: the base model's, and those that each effect sees."""
        plain, size, views = record("States", self.base.states), self.size, list(self.see_s)
        edges = list(self.state_edges)

        def states(s: Any) -> tuple[Any, list[Any]]:
            values = tuple(s)
            bare = plain(*values[:size])
            return bare, [view.of(bare, values[a:b]) for view, (a, b) in zip(views, pairwise(edges))]

        return states

    def body(self) -> Any:
        """The vehicle's size, thrust and drag."""
        model = self.base
        dimensions, thrust, drag = model.dimensions, model.thrust, model.drag
        rest = record("States", model.states)(*(0.0 for _ in model.states))

        def body(s: Any, i: Any, p: Any, e: Any) -> Any:
            found = Body() if dimensions is None else Body(*dimensions(p))
            if thrust is not None:
                found = found._replace(
                    thrust=thrust(s, i, p, e), thrust_0=thrust(rest, i, p, e._replace(u_c=0.0, v_c=0.0, w_c=0.0))
                )
            if drag is not None:
                found = found._replace(drag=drag(s, i, p, e))
            return found

        return body

    def acting(self) -> Any:
        """(s, i, p, e) to (base states, what each sees of them, i, p, e as they act, own parameters, i as it reached
        each effect).
        """
        split, states, body = self.split(), self.states(), self.body()
        on_parameters = tuple(effect.parameters_acting for effect in self.effects)
        on_inputs = tuple(effect.inputs for effect in self.effects)
        plain = tuple(_without(effect.surroundings, 6) for effect in self.effects)
        forces = tuple(_without(effect.surroundings, 5) for effect in self.effects)
        views, kind = list(self.see_i), record("Inputs", self.base.inputs)

        def acting(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            p, own = split(p)
            bare, seen = states(s)
            for change, q in zip(on_parameters, own):
                p = p if change is None else change(p, q)
            for change, q, state, view in zip(plain, own, seen, views):
                e = e if change is None else change(e, state, view.of(i), p, q)
            d = body(bare, i, p, e)
            for change, q, state, view in zip(forces, own, seen, views):
                e = e if change is None else change(e, state, view.of(i), p, q, d)
            reached = []
            for change, q, state, view in zip(on_inputs, own, seen, views):
                reached.append(view.of(i))
                i = i if change is None else view.back(change(view.of(i), state, q, e), kind)
            return bare, seen, i, p, e, own, reached

        return acting

    def recorded(self) -> Any:
        """Outputs as each effect gets them, and as they are recorded."""
        base, views = self.base.output, list(self.see_y)
        kind = record("Outputs", self.base.outputs)
        names = [channel.name for channel in self.base.outputs]
        on_outputs = tuple(effect.outputs_recorded for effect in self.effects)
        full = base is not None and takes_surroundings(base)

        def recorded(bare: Any, seen: Any, i: Any, p: Any, e: Any, own: Any, reached: Any) -> tuple[Any, list[Any]]:
            if base is None:
                y = kind(*(getattr(bare, name) for name in names))
            else:
                y = kind(*(base(bare, i, p, e) if full else base(bare, i, p)))
            came = []
            for change, q, state, view, inputs in zip(on_outputs, own, seen, views, reached):
                came.append(view.of(y))
                y = y if change is None else view.back(change(view.of(y), state, inputs, q, e), kind)
            return y, came

        return recorded

    def rhs(self) -> Any:
        acting, recorded, base = self.acting(), self.recorded(), self.base.rhs
        rates = tuple(effect.rates for effect in self.effects)
        followed = tuple(effect.rates_recorded for effect in self.effects)
        full, follows = takes_surroundings(base), any(hook is not None for hook in followed)

        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            bare, seen, i, p, e, own, reached = acting(s, i, p, e)
            found = list(base(bare, i, p, e) if full else base(bare, i, p))
            came = recorded(bare, seen, i, p, e, own, reached)[1] if follows else seen
            for rate, follow, q, state, inputs, y in zip(rates, followed, own, seen, reached, came):
                if rate is not None:
                    found.extend(rate(state, inputs, p, q, e))
                if follow is not None:
                    found.extend(follow(y, state, inputs, q, e))
            return tuple(found)

        return rhs

    def output(self) -> Any:
        acting, recorded = self.acting(), self.recorded()

        def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            bare, seen, i, p, e, own, reached = acting(s, i, p, e)
            return tuple(recorded(bare, seen, i, p, e, own, reached)[0])

        return output

    def initial_state(self) -> Any:
        split, base = self.split(), self.base.initial_state
        names = [channel.name for channel in self.base.states]
        effects, see_y, see_i = self.effects, self.see_y, self.see_i

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            bare, own = split(p)
            found = [getattr(y, name) for name in names] if base is None else list(base(y, i, bare))
            for effect, q, outputs, inputs in zip(effects, own, see_y, see_i):
                if effect.initial is None:
                    found.extend(0.0 for _ in effect.states)
                else:
                    found.extend(effect.initial(outputs.of(y), inputs.of(i), bare, q))
            return tuple(found)

        return initial_state


def _without(hook: Any, size: int) -> Any:
    """A hook, or None if it takes this many arguments."""
    return None if hook is None or len(inspect.signature(hook).parameters) == size else hook
