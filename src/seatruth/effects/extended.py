"""Models extended by effects: the equations of the effects around those of the model, compiled together."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.black_box import ExtendedBlackBox, trials_of
from seatruth.effects.channel_aliases import ChannelAliases, View, at_start
from seatruth.effects.declaring import how_to_name
from seatruth.effects.targets import Target, aliases_of, targets
from seatruth.effects.vehicle import DeclaredVehicle
from seatruth.errors import BadInput
from seatruth.models.base import Equations, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.first_slope import FirstSlope
from seatruth.models.servo import Servo
from seatruth.models.with_servos import with_servos_at
from seatruth.models.wrapper import ModelWrapper


class ExtendedModel(ModelWrapper):
    """A model with effects; made by `with_effects`. The effects' parameters stand at their null values.

    The parameters and states of the effects come after those of the model, under the names that `Effect.named` gives.
    """

    def __init__(self, base: Model, effects: Sequence[Effect]) -> None:
        self.effects = tuple(effects)
        self._applications = applications(base, effects)
        states = [
            type(channel)(application.named(channel.name), channel.unit, channel.description, channel.angle)
            for application in self._applications
            for channel in application.effect.states
        ]
        super().__init__(
            base,
            states=states,
            parameters=[parameter for effect in effects for parameter in effect.null_parameters()],
            hidden=[channel.name for channel in states],
            follows=_follows(base, self._applications),
            slopes=_slopes(self._applications),
            longest_step=min(effect.longest_step for effect in effects),
            title=f"{base.title}, with {', '.join(effect.title for effect in effects)}",
        )
        self.trials = trials_of(base, effects)

    def make_rhs(self) -> Equations:
        return _Equations(self.base, self._applications).rhs()

    def make_output(self) -> Equations:
        return _Equations(self.base, self._applications).output()

    def make_surroundings(self) -> Equations:
        """The function of (s, i, p, e) that gives the inputs that act on the wrapped model, and e with all currents."""
        return _Equations(self.base, self._applications).surroundings()

    def make_initial_state(self) -> Equations:
        return _Equations(self.base, self._applications).initial_state()

    def make_servos(self) -> tuple[Servo, ...]:
        return _Equations(self.base, self._applications).servos()


def with_effects(model: Model, effects: Sequence[Effect]) -> Model:
    """The model with effects, which act in the order given: all currents, then all inputs, then all forces.

    Without effects it is the model itself. A black box takes effects on inputs and outputs, and forces and currents
    where it has ports for them. BadInput where an effect is named twice or cannot act on the model.

    Example:
        with_effects(load_model("mmg"), load_effects(["current", "rudder_lag"]))
    """
    if not effects:
        return model
    names = [effect.name for effect in effects]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise BadInput(f"the effect {twice[0]!r} is named twice", do="Name it once.")
    for effect in effects:
        reason = effect.missing(model)
        if reason:
            raise BadInput(
                f"the effect {effect.name!r} cannot act on model {model.name!r}: {reason}",
                do=f"Leave it out, or take a model that it can act on.{how_to_name(effect, model)}",
            )
    effects = [effect.on(model) for effect in effects]
    if isinstance(model, BlackBox):
        return ExtendedBlackBox(model, effects)
    slowed = [target.input for effect in effects if effect.servo is not None for target in targets(effect, model)]
    return ExtendedModel(with_servos_at(model, slowed), effects)


@dataclass(frozen=True)
class Application:
    """An effect on one actuator, or on a model as a whole.

    `number` is the effect's place among those of the model; `first` is True for its first application, `alone` where it
    has no other.
    """

    effect: Effect
    number: int
    aliases: ChannelAliases
    target: Target | None
    first: bool
    alone: bool

    def named(self, state: str) -> str:
        """Name of one of its own states in the extended model."""
        suffix = "" if self.alone or self.target is None else f"_{self.target.name}"
        return self.effect.named(state) + suffix


def _units(target: Target | None) -> tuple[dict[str, float], dict[str, float]]:
    """How an effect measures an input: that of a thruster by full power, a steering command in rad from its middle."""
    return ({}, {}) if target is None else ({target.input: target.full}, {target.input: target.neutral})


def applications(base: Model, effects: Sequence[Effect]) -> tuple[Application, ...]:
    """Each effect once, or once for each actuator on which it acts."""
    found = []
    for number, effect in enumerate(effects):
        chosen: tuple[Target | None, ...] = targets(effect, base) if effect.actuator else (None,)
        for place, target in enumerate(chosen):
            aliases = aliases_of(effect, base, target)
            found.append(Application(effect, number, aliases, target, place == 0, len(chosen) == 1))
    return tuple(found)


def _follows(base: Model, applied: Sequence[Application]) -> dict[str, tuple[str, float]]:
    """`Model.follows` of the effects' states: the state of the model with which each starts, and its sign."""
    states = {channel.name for channel in base.states}
    follows = {}
    for application in applied:
        aliases = application.aliases
        for name, standard in application.effect.follows.items():
            # A sensor that shows no state (a log's speed through the water) moves with the state that it stands for.
            state = next((name for name in (aliases.in_model(standard), standard) if name in states), "")
            if state:
                follows[application.named(name)] = (state, float(aliases.sign(state)))
    return follows


def _slopes(applied: Sequence[Application]) -> dict[str, FirstSlope]:
    """`Model.slopes` of the effects' states, by the model's names of states and outputs."""
    found = {}
    for application in applied:
        aliases = application.aliases
        for name, slope in application.effect.slopes.items():
            output = aliases.in_model(slope.output)
            found[application.named(name)] = slope._replace(output=output, factor=aliases.sign(output) * slope.factor)
    return found


class _Equations:
    """The equations of a model with effects.

    Each method returns a function that holds all it needs in local variables, as the engine requires. There is one
    entry for each application of an effect: `own` are its parameters, `seen` the states as it sees them.
    """

    def __init__(self, base: Model, applied: Sequence[Application]) -> None:
        self.base, self.applied = base, tuple(applied)
        self.effects = tuple(application.effect for application in applied)
        distinct = [application.effect for application in applied if application.first]
        self.numbers = tuple(application.number for application in applied)
        self.state_edges = list(accumulate((len(effect.states) for effect in self.effects), initial=len(base.states)))
        self.edges = list(accumulate((len(effect.parameters) for effect in distinct), initial=len(base.parameters)))
        self.records = [namedtuple("Effect", [q.name for q in effect.parameters]) for effect in distinct]
        aliases = [application.aliases for application in applied]
        self.view_s = [View(alias, base.states, effect.states) for alias, effect in zip(aliases, self.effects)]
        self.view_i = [
            View(application.aliases, base.inputs, (), *_units(application.target)) for application in applied
        ]
        self.view_y = [View(alias, base.outputs) for alias in aliases]

    def servos(self) -> tuple[Servo, ...]:
        return tuple(replace(servo, settings=self._settings(servo)) for servo in self.base.servos)

    def _settings(self, servo: Servo) -> Any:
        """The settings of a servo of the model, with the effects that make it slower."""
        split, settings, changes = self._split_parameters(), servo.settings, self._once("true_parameters")
        slower = tuple(
            (k, a.effect.servo, a.target.full)
            for k, a in enumerate(self.applied)
            if a.effect.servo is not None and a.target is not None and a.target.input == servo.input
        )

        def with_effects(p: Any) -> tuple[Any, Any]:
            p, own = split(p)
            for change, q in zip(changes, own):
                p = p if change is None else change(p, q)
            lag, slowness = settings(p)
            for place, change, full in slower:
                lag, slowness = change(lag, slowness, own[place], full)
            return lag, slowness

        return with_effects

    def _once(self, role: str) -> tuple[Any, ...]:
        """A hook that acts on the model as a whole, in the first application of each effect."""
        return tuple(getattr(a.effect, role) if a.first else None for a in self.applied)

    def rhs(self) -> Equations:
        acting, measured, driven = self._acting(), self._measured(), self._driven()
        rates = tuple(effect.rates for effect in self.effects)
        output_rates = tuple(effect.rates_from_outputs for effect in self.effects)
        needs_outputs = any(hook is not None for hook in output_rates)

        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            s, seen, i, p, e, own, reached = acting(s, i, p, e)
            result = driven(s, i, p, e, own)
            outputs = measured(s, seen, i, p, e, own, reached)[1] if needs_outputs else seen
            for rate, output_rate, q, state, inputs, y in zip(rates, output_rates, own, seen, reached, outputs):
                if rate is not None:
                    result.extend(rate(state, inputs, p, q, e))
                if output_rate is not None:
                    result.extend(output_rate(y, state, inputs, q, e))
            return tuple(result)

        return rhs

    def _driven(self) -> Any:
        """(s, i, p, e, parameters of each application) to the rates of the model, with what drives do changed."""
        base = self.base.rhs
        changes = tuple(
            (k, a.effect.thrust_change, a.target.input, a.target.neutral)
            for k, a in enumerate(self.applied)
            if a.effect.thrust_change is not None and a.target is not None
        )

        def driven(s: Any, i: Any, p: Any, e: Any, own: Any) -> list[Any]:
            whole = list(base(s, i, p, e))
            result = whole
            for place, change, name, resting in changes:
                share, without = change(own[place]), base(s, i._replace(**{name: resting}), p, e)
                result = [rate + share * (one - other) for rate, one, other in zip(result, whole, without)]
            return result

        return driven

    def output(self) -> Equations:
        acting, measured = self._acting(), self._measured()

        def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            s, seen, i, p, e, own, reached = acting(s, i, p, e)
            return tuple(measured(s, seen, i, p, e, own, reached)[0])

        return output

    def initial_state(self) -> Equations:
        split, base = self._split_parameters(), self.base.initial_state
        names = [channel.name for channel in self.base.states]
        effects, view_i = self.effects, self.view_i
        seen = [at_start(application.aliases, self.base) for application in self.applied]

        def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
            p, own = split(p)
            result = [getattr(y, name) for name in names] if base is None else list(base(y, i, p))
            first = tuple(result)
            for effect, q, (view, further), inputs in zip(effects, own, seen, view_i):
                if effect.initial_state is None:
                    result.extend(0.0 for _ in effect.states)
                else:
                    outputs = view.of((*y, *(first[k] for k in further)))
                    result.extend(effect.initial_state(outputs, inputs.of(i), p, q))
            return tuple(result)

        return initial_state

    def _split_parameters(self) -> Any:
        """p to (parameters of the model, parameters of the effect of each application)."""
        base, count = record("Parameters", self.base.parameters), len(self.base.parameters)
        kinds, edges, numbers = self.records, self.edges, self.numbers

        def split(p: Any) -> tuple[Any, tuple[Any, ...]]:
            values = tuple(p)
            own = [kind(*values[a:b]) for kind, (a, b) in zip(kinds, pairwise(edges))]
            return base(*values[:count]), tuple(own[number] for number in numbers)

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
        """(s, i, p, e) to the vehicle's size, thrust and drag, and its thrusters where an effect acts on them."""
        wanted = any(a.target is not None and a.target.thruster >= 0 for a in self.applied)
        return DeclaredVehicle.of(self.base, with_thrusters=wanted).function()

    def surroundings(self) -> Equations:
        reaching = self._reaching()

        def surroundings(s: Any, i: Any, p: Any, e: Any) -> Any:
            _, _, i, _, e, _, _ = reaching(s, i, p, e)
            return i, e

        return surroundings

    def _acting(self) -> Any:
        """As `_reaching`, with the forces of the effects in e."""
        reaching, vehicle = self._reaching(), self._vehicle()
        forces = tuple(effect.force for effect in self.effects)
        views = list(self.view_i)
        places = [(-1, -1) if a.target is None else (a.target.thruster, a.target.other) for a in self.applied]

        def acting(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            s, seen, i, p, e, own, reached = reaching(s, i, p, e)
            d, thrusters = vehicle(s, i, p, e)
            for change, q, state, view, (one, other) in zip(forces, own, seen, views, places):
                if change is not None:
                    here = d if one < 0 else d._replace(thruster=thrusters[one])
                    here = here if other < 0 else here._replace(other=thrusters[other])
                    e = change(e, state, view.of(i), p, q, here)
            return s, seen, i, p, e, own, reached

        return acting

    def _reaching(self) -> Any:
        """(s, i, p, e) to (states of the model, seen, i, p, e as they act, own, inputs as they reached each effect)."""
        split, states = self._split_parameters(), self._split_states()
        true_parameters, currents = self._once("true_parameters"), self._once("current")
        true_inputs = tuple(effect.true_inputs for effect in self.effects)
        views, kind = list(self.view_i), record("Inputs", self.base.inputs)

        def reaching(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            p, own = split(p)
            s, seen = states(s)
            for change, q in zip(true_parameters, own):
                p = p if change is None else change(p, q)
            for change, q, state, view in zip(currents, own, seen, views):
                e = e if change is None else change(e, state, view.of(i), p, q)
            reached = []
            for change, q, state, view in zip(true_inputs, own, seen, views):
                reached.append(view.of(i))
                i = i if change is None else view.back(change(view.of(i), state, q, e), kind)
            return s, seen, i, p, e, own, reached

        return reaching

    def _measured(self) -> Any:
        """From what `_acting` gives to (outputs as measured, outputs as they reached each effect)."""
        base, views = self.base.output, list(self.view_y)
        kind = record("Outputs", self.base.outputs)
        names = [channel.name for channel in self.base.outputs]
        measured_outputs = self._once("measured_outputs")

        def measured(s: Any, seen: Any, i: Any, p: Any, e: Any, own: Any, reached: Any) -> tuple[Any, list[Any]]:
            y = kind(*((getattr(s, name) for name in names) if base is None else base(s, i, p, e)))
            outputs = []
            for change, q, state, view, inputs in zip(measured_outputs, own, seen, views, reached):
                outputs.append(view.of(y))
                y = y if change is None else view.back(change(view.of(y), state, inputs, q, e), kind)
            return y, outputs

        return measured
