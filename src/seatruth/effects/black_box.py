"""Effects around a black box: its inputs and outputs pass through them, sample by sample."""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.effects.base import Effect
from seatruth.effects.channel_aliases import ChannelAliases, View
from seatruth.models.base import Environment, record
from seatruth.models.black_box import BlackBox
from seatruth.models.wrapper import copy_attributes
from seatruth.trials.trial import Trial

Row = tuple[float, ...]


class ExtendedBlackBox(BlackBox):
    """A black box with effects on its inputs and outputs; made by `with_effects`.

    An effect whose parameters stand at their null leaves everything as it is. The states of effects start at their
    `initial_state`; inputs and outputs are linear between samples.
    """

    def __init__(self, base: BlackBox, effects: Sequence[Effect]) -> None:
        self.base, self.effects = base, tuple(effects)
        copy_attributes(base, self)
        self._aliases = [
            ChannelAliases(effect.aliases, effect.needs_inputs, base, effect.needs_outputs) for effect in effects
        ]
        super().__init__(
            base.name,
            self._around,
            inputs=base.inputs,
            outputs=base.outputs,
            parameters=(*base.parameters, *(parameter for effect in effects for parameter in effect.null_parameters())),
            states=base.states,
            kind=base.kind,
            title=f"{base.title}, with {', '.join(effect.title for effect in effects)}",
            source=base.source,
        )

    def complete(self, outputs: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
        """See `Model.complete`; what the black box itself says."""
        return self.base.complete(outputs, inputs)

    def _around(
        self, trial: Trial, parameters: dict[str, float], first_state: dict[str, float] | None
    ) -> Mapping[str, Array]:
        plain = {q.name: parameters[q.name] for q in self.base.parameters}
        p = record("Parameters", self.base.parameters)(**plain)
        acting = [
            (effect, aliases, namedtuple("Effect", list(values))(**values))
            for effect, aliases in zip(self.effects, self._aliases)
            for values in [{q.name: parameters[effect.named(q.name)] for q in effect.parameters}]
            if any(values[name] != effect.null[name] for name in effect.magnitudes)
        ]
        inputs = (
            np.stack([trial.inputs[c.name] for c in self.inputs], axis=1) if self.inputs else np.zeros((len(trial), 0))
        )
        for effect, aliases, q in acting:
            if effect.true_inputs is not None:
                inputs = _through_inputs(effect, View(aliases, self.inputs), trial.t, inputs, p, q)
        columns = {channel.name: inputs[:, k] for k, channel in enumerate(self.inputs)}
        outputs = self.base.run(replace(trial, inputs={**trial.inputs, **columns}), plain, first_state)
        for effect, aliases, q in acting:
            if effect.measured_outputs is not None:
                views = View(aliases, self.outputs), View(aliases, self.inputs)
                outputs = _through_outputs(effect, *views, trial.t, outputs, inputs, p, q)
        return {channel.name: outputs[:, k] for k, channel in enumerate(self.outputs)}


def _through_inputs(effect: Effect, view: View, t: Array, inputs: Array, p: Any, q: Any) -> Array:
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
        view.back(effect.true_inputs(view.of(row), state, q, Environment(t=time)), _plain)
        for row, state, time in zip(rows, own, t.tolist())
    ]
    return np.array(result).reshape(inputs.shape)


def _through_outputs(
    effect: Effect, view: View, see_i: View, t: Array, outputs: Array, inputs: Array, p: Any, q: Any
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
        first = (
            () if effect.initial_state is None else effect.initial_state(view.of(rows[0]), see_i.of(before[0]), p, q)
        )
        both = [(*y, *i) for y, i in zip(rows, before)]
        own = [
            kind(*state)
            for state in _integrated(
                first or own[0],
                both,
                t,
                effect.longest_step,
                lambda s, x, e: rates(view.of(x[:size]), kind(*s), see_i.of(x[size:]), q, e),
            )
        ]
    assert effect.measured_outputs is not None
    result = [
        view.back(effect.measured_outputs(view.of(row), state, see_i.of(i), q, Environment(t=time)), _plain)
        for row, state, i, time in zip(rows, own, before, t.tolist())
    ]
    return np.array(result).reshape(outputs.shape)


def _plain(*values: float) -> Row:
    return values


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
