"""The trials, the model and everything that could be meant, as one least-squares problem with priors.

x holds the model's free coefficients, the parameters of every effect that can act on the model, and the initial state
of each trial. A hypothesis says which of them may differ from what the model believes; the others stay at their value.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.costs.options import TrajectoryOptions, as_trajectory
from seatruth.costs.trajectory import TrajectoryCost
from seatruth.diagnosis.noise import NoiseFloor, Series
from seatruth.effects import Effect, with_effects
from seatruth.errors import BadInput
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.trials.prepare.decimate import decimate
from seatruth.trials.trial import Trial, Trials

COEFFICIENT_SD = 0.2
"""Standard deviation of a free coefficient that states no prior, as a part of its value."""
WIDER = 2.5
"""An effect's typical magnitude times this is its prior deviation: typical is no limit, and the tails of what happens
at sea are long."""
_PAUSE = 3.5
"""Sampling steps from which two samples are no neighbours any more."""
_WIDE = 10.0
"""Prior deviation of an initial state, in multiples of how far it is searched: as good as none."""


@dataclass(frozen=True)
class Linear:
    """Residuals (rows,) at x and their derivatives (rows, n) by n active columns, whitened."""

    x: Array
    errors: Array
    slopes: Array


@dataclass(frozen=True)
class _Part:
    """A cost with some of the effects, and where its parameters stand in x."""

    cost: TrajectoryCost
    columns: Indices


class Lead(Protocol):
    """Changes what is simulated."""

    def model(self, model: Model) -> Model: ...
    def trial(self, trial: Trial) -> Trial: ...


class GapProblem:
    """See the module. `effects` by name are those that may act; `names` are the entries of x.

    `lead` changes the model with its effects, and each trial, into what is simulated instead (`led.py`).
    """

    def __init__(
        self, study: Study, effects: Sequence[Effect], *, threads: int | None = None, lead: Lead | None = None
    ) -> None:
        self.study, self.threads, self.lead = study, threads, lead
        stated = as_trajectory(study.cost)
        self.options = TrajectoryOptions(hold=stated.hold, max_step=stated.max_step, initial="free")
        self.effects = {effect.name: effect for effect in effects}
        self.model = self._with(list(effects))
        own = set(study.model.nominal())
        told = {parameter.name: parameter for parameter in study.parameters}
        bounds: dict[str, Parameter] = {}
        parameters = []
        for parameter in self.model.parameters:
            given = told.get(parameter.name, parameter)
            if parameter.name in own:
                parameters.append(_with_prior(given))
            else:
                parameters.append(parameter.replace(vary=True, prior=None, scale="linear", start=None))
            bounds[parameter.name] = given
        for effect in effects:
            for name, prior in effect.priors(study.model).items():
                place = next(k for k, p in enumerate(parameters) if p.name == effect.named(name))
                parameters[place] = parameters[place].replace(prior=prior)
        self.parameters = tuple(parameters)
        outputs = [channel.name for channel in self.model.outputs]
        trials = list(study.trials) if lead is None else [lead.trial(trial) for trial in study.trials]
        self.trials = Trials([_from_zero(trial) for trial in decimate(trials, outputs)])
        self.cost = self._cost(self.model, self.parameters)
        cost = self.cost
        self.names = cost.names
        self._whole = _Part(cost, np.arange(len(cost.names), dtype=np.intp))
        self._parts: dict[tuple[str, ...], _Part] = {tuple(self.effects): self._whole}
        self.start = cost.start
        self.size = len(self.names)
        self.low, self.high = cost.bounds
        free = len(cost.space.free)
        self.low[free:], self.high[free:] = -math.inf, math.inf
        self.groups = [group for group in cost.residual_blocks if group.kind == "data" and len(group.rows)]
        self.rows = max(int(group.rows.max()) for group in self.groups) + 1
        self.series = _series(cost, self.groups)
        self.trial_of = np.zeros(self.rows, dtype=np.intp)
        self.channel_of = np.zeros(self.rows, dtype=np.intp)
        self.sample_of = np.zeros(self.rows, dtype=np.intp)
        self.time_of = np.zeros(self.rows)
        self.outputs = [channel.name for channel in self.model.outputs]
        for group in self.groups:
            self.trial_of[group.rows] = self.trials.names.index(group.trial)
            self.channel_of[group.rows] = self.outputs.index(group.channel)
            self.sample_of[group.rows] = group.sample
            self.time_of[group.rows] = group.t
        self.columns = {
            name: np.array([self.names.index(effect.named(q.name)) for q in effect.parameters], dtype=np.intp)
            for name, effect in self.effects.items()
        }
        effects_at = {int(k) for columns in self.columns.values() for k in columns}
        self.nuisance = np.array([k for k in range(self.size) if k not in effects_at], dtype=np.intp)
        self.coefficients = np.array([k for k in self.nuisance if k < free], dtype=np.intp)
        self.initial = np.arange(free, self.size, dtype=np.intp)
        self.mean, self.sd = self._priors(free)
        for columns in self.columns.values():
            self.sd[columns] *= WIDER

    def _with(self, effects: Sequence[Effect]) -> Model:
        model = with_effects(self.study.model, effects)
        return model if self.lead is None else self.lead.model(model)

    def active(self, effects: Sequence[str]) -> Indices:
        """Columns of x that a hypothesis frees: the nuisances and the parameters of these effects."""
        return np.sort(np.concatenate([self.nuisance, *(self.columns[name] for name in effects)]))

    def part(self, active: Indices) -> _Part:
        """The problem with the effects that these columns touch, and no others: the same errors, sooner."""
        touched = set(active.tolist())
        names = tuple(name for name, columns in self.columns.items() if touched & set(columns.tolist()))
        if names not in self._parts:
            if names == tuple(self.effects):
                cost = self.cost
            else:
                model = self._with([self.effects[name] for name in names])
                known = {p.name: p for p in self.parameters}
                cost = self._cost(model, [known[p.name] for p in model.parameters])
            place = {name: k for k, name in enumerate(self.names)}
            self._parts[names] = _Part(cost, np.array([place[name] for name in cost.names], dtype=np.intp))
        return self._parts[names]

    def errors(self, x: Array, active: Indices | None = None) -> Array:
        """Measured less simulated (rows,); inf where x diverges. `active` says which columns may be off their null."""
        part = self._whole if active is None else self.part(active)
        return np.asarray(part.cost.residuals(x[part.columns])[: self.rows])

    def derivatives(self, x: Array, active: Indices) -> Array:
        """Of `errors` by these columns, (rows, len(active)); the others stand at their null."""
        part = self.part(active)
        place = {int(column): k for k, column in enumerate(part.columns)}
        found = part.cost.jacobian(x[part.columns])[: self.rows]
        return np.asarray(found[:, [place[int(column)] for column in active]])

    def states(self, x: Array) -> list[Array]:
        """States (n, S) of the model with all effects along each trial, simulated from x."""
        sim = simulator(
            self.model, self.trials, free=self.cost.space.varying, values=self.cost.space.nominal(),
            hold=self.options.hold, max_step=self.options.max_step, threads=self.threads,
        )  # fmt: skip
        theta, x0 = self.cost.candidate(x)
        found = sim.states(theta, x0)
        return [found[rows] for rows in sim.rows]

    def whitened(self, x: Array, floor: NoiseFloor, active: Indices, without: int | None = None) -> Array:
        """Whitened errors (rows,); those of the trial left out are zero."""
        return self._masked(floor.whiten(self.errors(x, active)), without)

    def linear(self, x: Array, floor: NoiseFloor, active: Indices, without: int | None = None) -> Linear:
        """Whitened errors at x and their derivatives by these columns."""
        slopes = self._masked(floor.whiten(self.derivatives(x, active)), without)
        return Linear(x, self.whitened(x, floor, active, without), slopes)

    def whole(self, x: Array, floor: NoiseFloor) -> Array:
        """Whitened derivatives by every entry of x, (rows, K)."""
        return floor.whiten(self.derivatives(x, np.arange(self.size, dtype=np.intp)))

    def _masked(self, rows: Array, without: int | None) -> Array:
        if without is not None:
            rows[self.trial_of == without] = 0.0
        return rows

    def cost_of(
        self, model: Model, extra: Sequence[Parameter], values: Mapping[str, float], trials: Trials | None = None
    ) -> TrajectoryCost:
        """The same question put to another form of the model (with probes), from other values, or of other trials."""
        own = tuple(p.replace(value=_within(values.get(p.name, p.value), p)) for p in self.parameters)
        return self._cost(model, (*own, *extra), trials)

    def _cost(self, model: Model, parameters: Sequence[Parameter], trials: Trials | None = None) -> TrajectoryCost:
        study = self.study.replace(
            model=model,
            parameters=tuple(parameters),
            trials=self.trials if trials is None else trials,
            holdout=Trials([]),
            cost=self.options,
            noise={channel.name: 1.0 for channel in model.outputs},
            constraints=(),
        )
        return TrajectoryCost(study, threads=self.threads)

    def _priors(self, free: int) -> tuple[Array, Array]:
        mean, sd = self.start.copy(), np.empty(self.size)
        for k, parameter in enumerate(self.cost.parameters):
            if parameter.prior is not None:
                mean[k], sd[k] = parameter.prior.mean, parameter.prior.sd
            else:
                reach = parameter.max - parameter.min
                sd[k] = _WIDE * reach if k >= free and math.isfinite(reach) else 1e3 * max(1.0, abs(parameter.value))
        return mean, sd


def whole_trials(study: Study) -> None:
    """Refuses what the diagnosis cannot work on, in one message."""
    where = f"study {study.name!r}"
    if study.cost.kind == "formula":
        raise BadInput("a formula has no motion to diagnose", where=where, do="Give it a model and trials in time.")
    short = [trial.name for trial in study.trials if len(trial) < 10]
    if short:
        raise BadInput(f"trial {short[0]!r} has under 10 samples", where=where, do="Leave it out.")


def _with_prior(parameter: Parameter) -> Parameter:
    """A free coefficient needs to be held by what was believed of it, or it takes up any effect."""
    if not parameter.vary or parameter.prior is not None:
        return parameter
    reach = parameter.max - parameter.min
    wide = reach / 4.0 if math.isfinite(reach) else 1.0
    sd = COEFFICIENT_SD * abs(parameter.value) if parameter.value != 0.0 else wide
    return parameter.replace(prior=Prior(parameter.value, sd))


def _within(value: float, parameter: Parameter) -> float:
    return min(max(value, parameter.min), parameter.max)


def _from_zero(trial: Trial) -> Trial:
    return dataclasses.replace(trial, t=trial.t - trial.t[0]) if trial.t[0] != 0.0 else trial


def _series(cost: TrajectoryCost, groups: Sequence[object]) -> list[Series]:
    found = []
    for group in cost.residual_blocks:
        if group.kind != "data" or not len(group.rows):
            continue
        steps = np.diff(group.t)
        step = float(np.median(steps)) if steps.size else 1.0
        cuts = np.flatnonzero(steps > _PAUSE * step) + 1
        for part, t in zip(np.split(group.rows, cuts), np.split(group.t, cuts)):
            found.append(Series(group.trial, group.channel, part, t, step))
    return found
