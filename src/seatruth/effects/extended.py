"""Models extended by effects: the equations of the effects around those of the model, compiled together."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.black_box import ExtendedBlackBox
from seatruth.effects.channel_aliases import ChannelAliases, View
from seatruth.errors import BadInput
from seatruth.models.base import Equations, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.geometry import Vehicle
from seatruth.models.wrapper import ModelWrapper


class ExtendedModel(ModelWrapper):
    """A model with effects; made by `with_effects`. The effects' parameters stand at their null values.

    The parameters and states of the effects come after those of the model, under the names that `Effect.named` gives.
    """

    def __init__(self, base: Model, effects: Sequence[Effect]) -> None:
        self.effects = tuple(effects)
        states = [
            type(channel)(effect.named(channel.name), channel.unit, channel.description, channel.angle)
            for effect in effects
            for channel in effect.states
        ]
        super().__init__(
            base,
            states=states,
            parameters=[parameter for effect in effects for parameter in effect.null_parameters()],
            hidden=[channel.name for channel in states],
            follows=_follows(base, effects),
            longest_step=min(effect.longest_step for effect in effects),
            title=f"{base.title}, with {', '.join(effect.title for effect in effects)}",
        )

    def make_rhs(self) -> Equations:
        return _Equations(self.base, self.effects).rhs()

    def make_output(self) -> Equations:
        return _Equations(self.base, self.effects).output()

    def make_initial_state(self) -> Equations:
        return _Equations(self.base, self.effects).initial_state()


def with_effects(model: Model, effects: Sequence[Effect]) -> Model:
    """The model with effects, which act in the order given; all currents act before all forces, which depend on them.

    Without effects it is the model itself. A black box takes only effects on inputs and outputs. BadInput where an
    effect is named twice or cannot act on the model.

    Example:
        with_effects(load_model("mmg"), load_effects(["current", "rudder_lag"]))
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


def _follows(base: Model, effects: Sequence[Effect]) -> dict[str, tuple[str, float]]:
    """`Model.follows` of the effects' states: the state of the model with which each starts, and its sign."""
    states = {channel.name for channel in base.states}
    follows = {}
    for effect in effects:
        aliases = ChannelAliases(effect.aliases, effect.needs_inputs, base, effect.needs_outputs)
        for name, standard in effect.follows.items():
            # A sensor that shows no state (a log's speed through the water) moves with the state that it stands for.
            state = next((name for name in (aliases.in_model(standard), standard) if name in states), "")
            if state:
                follows[effect.named(name)] = (state, float(aliases.sign(state)))
    return follows


class _Equations:
    """The equations of a model with effects.

    Each method returns a function that holds all it needs in local variables, as the engine requires. In them `own`
    are the parameters of each effect, `seen` the states as each effect sees them.
    """

    def __init__(self, base: Model, effects: Sequence[Effect]) -> None:
        self.base, self.effects = base, effects
        self.state_edges = list(accumulate((len(effect.states) for effect in effects), initial=len(base.states)))
        self.edges = list(accumulate((len(effect.parameters) for effect in effects), initial=len(base.parameters)))
        self.records = [namedtuple("Effect", [q.name for q in effect.parameters]) for effect in effects]
        aliases = [
            ChannelAliases(effect.aliases, effect.needs_inputs, base, effect.needs_outputs) for effect in effects
        ]
        self.view_s = [View(alias, base.states, effect.states) for alias, effect in zip(aliases, effects)]
        self.view_i = [View(alias, base.inputs) for alias in aliases]
        self.view_y = [View(alias, base.outputs) for alias in aliases]

    def rhs(self) -> Equations:
        acting, measured, base = self._acting(), self._measured(), self.base.rhs
        rates = tuple(effect.rates for effect in self.effects)
        output_rates = tuple(effect.rates_from_outputs for effect in self.effects)
        needs_outputs = any(hook is not None for hook in output_rates)

        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            s, seen, i, p, e, own, reached = acting(s, i, p, e)
            result = list(base(s, i, p, e))
            outputs = measured(s, seen, i, p, e, own, reached)[1] if needs_outputs else seen
            for rate, output_rate, q, state, inputs, y in zip(rates, output_rates, own, seen, reached, outputs):
                if rate is not None:
                    result.extend(rate(state, inputs, p, q, e))
                if output_rate is not None:
                    result.extend(output_rate(y, state, inputs, q, e))
            return tuple(result)

        return rhs

    def output(self) -> Equations:
        acting, measured = self._acting(), self._measured()

        def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            s, seen, i, p, e, own, reached = acting(s, i, p, e)
            return tuple(measured(s, seen, i, p, e, own, reached)[0])

        return output

    def initial_state(self) -> Equations:
        split, base = self._split_parameters(), self.base.initial_state
        names = [channel.name for channel in self.base.states]
        effects, view_y, view_i = self.effects, self.view_y, self.view_i

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            p, own = split(p)
            result = [getattr(y, name) for name in names] if base is None else list(base(y, i, p))
            for effect, q, outputs, inputs in zip(effects, own, view_y, view_i):
                if effect.initial_state is None:
                    result.extend(0.0 for _ in effect.states)
                else:
                    result.extend(effect.initial_state(outputs.of(y), inputs.of(i), p, q))
            return tuple(result)

        return initial_state

    def _split_parameters(self) -> Any:
        """p to (parameters of the model, parameters of each effect)."""
        base, count = record("Parameters", self.base.parameters), len(self.base.parameters)
        kinds, edges = self.records, self.edges

        def split(p: Any) -> tuple[Any, tuple[Any, ...]]:
            values = tuple(p)
            return base(*values[:count]), tuple(kind(*values[a:b]) for kind, (a, b) in zip(kinds, pairwise(edges)))

        return split

    def _split_states(self) -> Any:
        """s to (states of the model, what each effect sees: these and its own states)."""
        base, count = record("States", self.base.states), len(self.base.states)
        views, edges = list(self.view_s), self.state_edges

        def split(s: Any) -> tuple[Any, list[Any]]:
            values = tuple(s)
            bare = base(*values[:count])
            return bare, [view.of(bare, values[a:b]) for view, (a, b) in zip(views, pairwise(edges))]

        return split

    def _vehicle(self) -> Any:
        """(s, i, p, e) to the vehicle's size, thrust and drag."""
        model = self.base
        dimensions, thrust, drag = model.dimensions, model.thrust, model.drag
        at_rest = record("States", model.states)(*(0.0 for _ in model.states))

        def vehicle(s: Any, i: Any, p: Any, e: Any) -> Any:
            result = Vehicle() if dimensions is None else Vehicle(*dimensions(p))
            if thrust is not None:
                still = e._replace(u_c=0.0, v_c=0.0, w_c=0.0)
                result = result._replace(thrust=thrust(s, i, p, e), thrust_0=thrust(at_rest, i, p, still))
            if drag is not None:
                result = result._replace(drag=drag(s, i, p, e))
            return result

        return vehicle

    def _acting(self) -> Any:
        """(s, i, p, e) to (states of the model, seen, i, p, e as they act, own, inputs as they reached each effect)."""
        split, states, vehicle = self._split_parameters(), self._split_states(), self._vehicle()
        true_parameters = tuple(effect.true_parameters for effect in self.effects)
        currents = tuple(effect.current for effect in self.effects)
        forces = tuple(effect.force for effect in self.effects)
        true_inputs = tuple(effect.true_inputs for effect in self.effects)
        views, kind = list(self.view_i), record("Inputs", self.base.inputs)

        def acting(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            p, own = split(p)
            s, seen = states(s)
            for change, q in zip(true_parameters, own):
                p = p if change is None else change(p, q)
            for change, q, state, view in zip(currents, own, seen, views):
                e = e if change is None else change(e, state, view.of(i), p, q)
            d = vehicle(s, i, p, e)
            for change, q, state, view in zip(forces, own, seen, views):
                e = e if change is None else change(e, state, view.of(i), p, q, d)
            reached = []
            for change, q, state, view in zip(true_inputs, own, seen, views):
                reached.append(view.of(i))
                i = i if change is None else view.back(change(view.of(i), state, q, e), kind)
            return s, seen, i, p, e, own, reached

        return acting

    def _measured(self) -> Any:
        """From what `_acting` gives to (outputs as measured, outputs as they reached each effect)."""
        base, views = self.base.output, list(self.view_y)
        kind = record("Outputs", self.base.outputs)
        names = [channel.name for channel in self.base.outputs]
        measured_outputs = tuple(effect.measured_outputs for effect in self.effects)

        def measured(s: Any, seen: Any, i: Any, p: Any, e: Any, own: Any, reached: Any) -> tuple[Any, list[Any]]:
            y = kind(*((getattr(s, name) for name in names) if base is None else base(s, i, p, e)))
            outputs = []
            for change, q, state, view, inputs in zip(measured_outputs, own, seen, views, reached):
                outputs.append(view.of(y))
                y = y if change is None else view.back(change(view.of(y), state, inputs, q, e), kind)
            return y, outputs

        return measured
