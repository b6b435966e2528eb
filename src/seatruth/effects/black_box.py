"""Effects around a black box: its inputs and outputs pass through them, sample by sample.

Forces and currents act inside, through the ports of the simulator (`through_ports`); a current carries one without a
port along (`carried_black_box`)."""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.effects.base import Effect
from seatruth.effects.carried_black_box import CarriedByWater, Current
from seatruth.effects.channel_aliases import View
from seatruth.effects.targets import Target, aliases_of, targets
from seatruth.effects.through_ports import OutsideEffects
from seatruth.errors import BadInput
from seatruth.models.base import Environment, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.black_box_wrapper import BlackBoxWrapper
from seatruth.models.ports import Outside
from seatruth.models.servo import Servo, servo_state
from seatruth.models.servo_black_box import behind_servos
from seatruth.trials.trial import Trial

Row = tuple[float, ...]


class ExtendedBlackBox(BlackBoxWrapper):
    """A black box with effects on its inputs and outputs, and through its ports; made by `with_effects`.

    An effect whose parameters stand at their null leaves everything as it is. Servos act first, those that a study
    states made slower by the effects; the other effects act on what they give. The states of effects start at their
    `initial_state`; inputs and outputs are linear between samples.
    """

    def __init__(self, base: BlackBox, effects: Sequence[Effect]) -> None:
        self.effects = tuple(effects)
        self._targets = [targets(effect, base) if effect.actuator else (None,) for effect in effects]
        super().__init__(
            base,
            self._around,
            parameters=[parameter for effect in effects for parameter in effect.null_parameters()],
            title=f"{base.title}, with {', '.join(effect.title for effect in effects)}",
        )
        self.trials = trials_of(base, effects)
        present = {servo.input: servo.settings for servo in base.servos}
        slowed = {
            target.input: None
            for effect, chosen in zip(self.effects, self._targets)
            for target in chosen
            if effect.servo is not None and target is not None
        }
        self.servos = tuple(
            Servo(name, servo_state(name), partial(self._settings, name, present.get(name)))
            for name in (*present, *(name for name in slowed if name not in present))
        )

    def _around(
        self,
        trial: Trial,
        parameters: dict[str, float],
        first_state: dict[str, float] | None,
        outside: Outside | None = None,
    ) -> Mapping[str, Array]:
        number, acting, p = self.number_of(trial.name), self._acting(parameters), self._plain(parameters)
        trial = behind_servos(self, trial, parameters)
        inputs = self._acting_inputs(trial, acting, p)
        plain = {name: float(value) for name, value in p._asdict().items()}
        columns = {channel.name: inputs[:, k] for k, channel in enumerate(self.inputs)}
        carrying = [] if self.base.innermost.ports.current else [one for one in acting if one[0].current is not None]
        inside = [one for one in acting if (one[0].current or one[0].force) is not None and one not in carrying]
        if inside:
            outside = OutsideEffects(self.base, inside, plain, trial.t, inputs, number, outside)
        trial = replace(trial, inputs={**trial.inputs, **columns})
        if carrying:
            water = CarriedByWater(self.base, [self._current(effect, q, p) for effect, _, q in carrying], number)
            started, first_state = water.start(trial, first_state)
            outputs = water.over_ground(trial, self.base.run(started, plain, first_state, outside))
        else:
            outputs = self.base.run(trial, plain, first_state, outside)
        for effect, target, q in acting:
            if effect.measured_outputs is not None:
                aliases = aliases_of(effect, self.base, target)
                views = View(aliases, self.outputs), View(aliases, self.inputs)
                outputs = _through_outputs(effect, *views, trial.t, number, outputs, inputs, p, q)
        return {channel.name: outputs[:, k] for k, channel in enumerate(self.outputs)}

    def _current(self, effect: Effect, q: Any, p: Any) -> Current:
        """The current of an effect, as a function of the environment and of what the black box shows."""
        aliases, hook = aliases_of(effect, self.base, None), effect.current
        assert hook is not None
        view = View(aliases, self.base.outputs)
        return lambda e, s: hook(e, view.of(s), None, p, q)

    def acting_inputs(self, trial: Trial, parameters: Mapping[str, float]) -> Trial:
        """See `BlackBox.acting_inputs`."""
        trial, p = behind_servos(self, trial, parameters), self._plain(parameters)
        inputs = self._acting_inputs(trial, self._acting(parameters), p)
        columns = {channel.name: inputs[:, k] for k, channel in enumerate(self.inputs)}
        return self.base.acting_inputs(replace(trial, inputs={**trial.inputs, **columns}), p._asdict())

    def _acting(self, parameters: Mapping[str, float]) -> list[tuple[Effect, Target | None, Any]]:
        """The effects that are not at their null, each on every actuator on which it acts, with its parameters."""
        return [
            (effect, target, namedtuple("Effect", list(values))(**values))
            for effect, chosen in zip(self.effects, self._targets)
            for values in [{q.name: parameters[effect.named(q.name)] for q in effect.parameters}]
            if any(values[name] != effect.null[name] for name in effect.magnitudes)
            for target in chosen
        ]

    def _plain(self, parameters: Mapping[str, float]) -> Any:
        """The simulator's own parameters, as the effects change them."""
        p = record("Parameters", self.base.parameters)(**{q.name: parameters[q.name] for q in self.base.parameters})
        for effect, _, q in self._acting(parameters):
            if effect.true_parameters is not None:
                p = effect.true_parameters(p, q)
        return p

    def _acting_inputs(self, trial: Trial, acting: Sequence[tuple[Effect, Target | None, Any]], p: Any) -> Array:
        """Inputs (n, I) as they reach the simulator, from those behind the servos."""
        inputs = (
            np.stack([trial.inputs[c.name] for c in self.inputs], axis=1) if self.inputs else np.zeros((len(trial), 0))
        )
        for effect, target, q in acting:
            if effect.true_inputs is not None:
                units = {} if target is None else {target.input: target.full}
                view = View(aliases_of(effect, self.base, target), self.inputs, (), units)
                inputs = _through_inputs(effect, view, trial.t, self.number_of(trial.name), inputs, p, q)
        return inputs

    def _settings(self, name: str, stated: Callable[[Any], tuple[Any, Any]] | None, p: Any) -> tuple[Any, Any]:
        """The settings of the servo of an input, with the effects that make it slower; `stated` are those below."""
        parameters = p._asdict()
        lag, slowness = (0.0, 0.0) if stated is None else stated(self._plain(parameters))
        for effect, target, q in self._acting(parameters):
            if effect.servo is not None and target is not None and target.input == name:
                lag, slowness = effect.servo(lag, slowness, q, target.full)
        return lag, slowness


def trials_of(base: Model, effects: Sequence[Effect]) -> tuple[str, ...]:
    """The trials that a model with effects tells apart. BadInput where two of its effects name different ones."""
    named = [trials for trials in (base.trials, *(effect.trials for effect in effects)) if trials]
    if any(trials != named[0] for trials in named):
        names = ", ".join(effect.name for effect in effects if effect.trials)
        raise BadInput(f"{names} have values for different trials", do="Make them for the same trials.")
    return named[0] if named else ()


def _through_inputs(effect: Effect, view: View, t: Array, number: float, inputs: Array, p: Any, q: Any) -> Array:
    """Inputs (n, I) as they act through an effect."""
    kind = record("Own", effect.states)
    rows = [tuple(row) for row in inputs.tolist()]
    own = [kind(*(0.0 for _ in effect.states))] * len(rows)
    if effect.rates is not None and rows:
        rates = effect.rates
        first = () if effect.initial_state is None else effect.initial_state(None, view.of(rows[0]), p, q)
        own = [
            kind(*state)
            for state in _integrated(
                first or own[0], rows, t, effect.longest_step, lambda s, i, e: rates(kind(*s), view.of(i), p, q, e)
            )
        ]
    assert effect.true_inputs is not None
    result = [
        view.back(effect.true_inputs(view.of(row), state, q, Environment(t=time, trial=number)), _plain)
        for row, state, time in zip(rows, own, t.tolist())
    ]
    return np.array(result).reshape(inputs.shape)


def _through_outputs(
    effect: Effect, view: View, see_i: View, t: Array, number: float, outputs: Array, inputs: Array, p: Any, q: Any
) -> Array:
    """Outputs (n, D) as measured through an effect; NaN where a simulated one is not finite."""
    if not np.isfinite(outputs).all():
        return np.full_like(outputs, math.nan)
    kind = record("Own", effect.states)
    rows = [tuple(row) for row in outputs.tolist()]
    before = [tuple(row) for row in inputs.tolist()]
    own = [kind(*(0.0 for _ in effect.states))] * len(rows)
    if effect.rates_from_outputs is not None and rows:
        rates, size = effect.rates_from_outputs, outputs.shape[1]
        first = _begun(effect, view, t, rows, see_i.of(before[0]), p, q)
        both = [(*y, *i) for y, i in zip(rows, before)]
        own = [
            kind(*state)
            for state in _integrated(
                first,
                both,
                t,
                effect.longest_step,
                lambda s, x, e: rates(view.of(x[:size]), kind(*s), see_i.of(x[size:]), q, e),
            )
        ]
    assert effect.measured_outputs is not None
    result = [
        view.back(effect.measured_outputs(view.of(row), state, see_i.of(i), q, e), _plain)
        for row, state, i, time in zip(rows, own, before, t.tolist())
        for e in [Environment(t=time, trial=number)]
    ]
    return np.array(result).reshape(outputs.shape)


def _plain(*values: float) -> Row:
    return values


def _begun(effect: Effect, view: View, t: Array, rows: Sequence[Row], inputs: Any, p: Any, q: Any) -> tuple[float, ...]:
    """The effect's own states at the start of a run, along the slopes of its first step."""
    seen = view.of(rows[0])
    first = (
        [0.0] * len(effect.states) if effect.initial_state is None else list(effect.initial_state(seen, inputs, p, q))
    )
    if len(rows) > 1:
        after, step = view.of(rows[1]), float(t[1] - t[0])
        for k, state in enumerate(effect.states):
            if state.name in effect.slopes:
                slope = effect.slopes[state.name]
                first[k] += slope.factor * (getattr(after, slope.output) - getattr(seen, slope.output)) / step
    return tuple(first)


def _integrated(
    first: Any, rows: Sequence[Row], t: Array, longest: float, rates: Callable[[Row, Row, Environment], Any]
) -> list[Row]:
    """States at every sample by Runge-Kutta steps of at most `longest` s; `rows` are linear between samples."""
    state: Row = tuple(float(x) for x in first)
    result = [state]
    times = t.tolist()
    for k in range(len(rows) - 1):
        parts = max(1, math.ceil((times[k + 1] - times[k]) / longest - 1e-6))
        h = (times[k + 1] - times[k]) / parts
        for part in range(parts):
            time = times[k] + part * h
            start, middle, end = (_between(rows[k], rows[k + 1], (part + at) / parts) for at in (0.0, 0.5, 1.0))
            k1 = rates(state, start, Environment(t=time))
            k2 = rates(_ahead(state, k1, h / 2), middle, Environment(t=time + h / 2))
            k3 = rates(_ahead(state, k2, h / 2), middle, Environment(t=time + h / 2))
            k4 = rates(_ahead(state, k3, h), end, Environment(t=time + h))
            state = tuple(x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(state, k1, k2, k3, k4))
        result.append(state)
    return result


def _between(a: Row, b: Row, share: float) -> Row:
    return tuple(x + share * (y - x) for x, y in zip(a, b))


def _ahead(state: Row, rate: Any, h: float) -> Row:
    return tuple(x + h * d for x, d in zip(state, rate))
