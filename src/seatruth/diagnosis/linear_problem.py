"""The trials, the model, every effect and every missing force as one problem, simulated and differentiated together.

The unknowns are a vector x of shared ones (coefficients, parameters of effects, coefficients of discrepancy terms),
the initial states of each trial, and the values of each trial's own missing forces at its knots (`Point`).
`Linearization` holds the errors at a point and their derivatives by all of these.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array, Flags, Indices
from seatruth.costs.study import Study
from seatruth.costs.trajectory import TrajectoryCost
from seatruth.diagnosis.discrepancy.model import DiscrepancyModel, can_carry, scales_of, with_forces
from seatruth.effects import Effect, with_effects
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior
from seatruth.trials.prepare.decimate import thinned
from seatruth.trials.trial import Trial, Trials

COEFFICIENT_SD = 0.2
KNOTS = 12
WIDE = 10.0
LARGEST = 1e9


@dataclass(frozen=True)
class Point:
    """Values of all unknowns: `x` (K,) in the order of the problem's names, `forces` (T, E, knots)."""

    x: Array
    forces: Array


@dataclass(frozen=True)
class Series:
    """One channel of one trial: its rows among all errors, their times (s)."""

    trial: int
    channel: int
    rows: Indices
    t: Array


@dataclass(frozen=True)
class Linearization:
    """Errors (rows,), measured less simulated, at a point, and their derivatives.

    `shared` (rows, S) by the shared unknowns, `local` (rows, L) by the unknowns of each row's own trial: its free
    initial states and the knots of its forces, equation by equation.
    """

    point: Point
    errors: Array
    shared: Array
    local: Array


class Problem:
    """See the module. Shapes: T trials, C outputs, S shared unknowns, L local ones of each trial, E equations."""

    def __init__(self, study: Study, effects: Sequence[Effect], *, threads: int | None = None) -> None:
        self.study, self.threads = study, threads
        self.effects = {effect.name: effect for effect in effects}
        self.outputs = [channel.name for channel in study.model.outputs]
        trials = [_from_zero(trial) for trial in thinned(list(study.trials), self.outputs)]
        extended = with_effects(study.model, effects)
        self.discrepancy = None
        model: Model = extended
        if can_carry(study.model):
            duration = max(trial.duration for trial in trials)
            scales = scales_of(extended, trials)
            model = self.discrepancy = DiscrepancyModel(extended, KNOTS, duration, scales)
            trials = [with_forces(trial, self.discrepancy) for trial in trials]
        self.model, self.trials = model, Trials(trials)
        self.equations = list(self.discrepancy.equations) if self.discrepancy else []
        self.parameters = self._parameters()
        self.cost = self._cost()
        self.names = self.cost.names
        self.free = len(self.cost.space.free)
        self._layout()
        self._series()
        self._priors()
        self.start = Point(self.cost.start.copy(), np.zeros((len(self.trials), len(self.equations), KNOTS)))

    # --- set-up

    def _parameters(self) -> tuple[Parameter, ...]:
        own = set(self.study.model.nominal())
        declared = {parameter.name: parameter for parameter in self.study.parameters}
        found = []
        for parameter in self.model.parameters:
            if parameter.name in own:
                found.append(_with_prior(declared.get(parameter.name, parameter)))
            else:
                found.append(parameter.but(vary=True, prior=None, scale="linear", start=None))
        at = {parameter.name: k for k, parameter in enumerate(found)}
        for effect in self.effects.values():
            for name, prior in effect.priors(self.study.model).items():
                k = at[effect.named(name)]
                found[k] = found[k].but(prior=prior)
        return tuple(found)

    def _cost(self) -> TrajectoryCost:
        study = self.study.but(
            model=self.model,
            parameters=self.parameters,
            trials=self.trials,
            holdout=Trials([]),
            cost="trajectory",
            noise={channel.name: 1.0 for channel in self.model.outputs},
            initial="free",
            initial_sd={},
            constraints=(),
            segments=None,
            multiple_shooting=False,
            criterion="weighted",
        )
        return TrajectoryCost(study, threads=self.threads)

    def _layout(self) -> None:
        """Which columns are what: indices into x, and into the shared and local columns of a linearization."""
        place = {name: k for k, name in enumerate(self.names)}
        knots = [n for names in (self.discrepancy.knot_names.values() if self.discrepancy else ()) for n in names]
        terms = [term.name for term in self.discrepancy.terms] if self.discrepancy else []
        self.knot_columns = np.array([place[name] for name in knots], dtype=np.intp)
        self.shared = np.array([k for k in range(self.free) if k not in set(self.knot_columns.tolist())], dtype=np.intp)
        at = {self.names[k]: j for j, k in enumerate(self.shared)}
        self.columns = {
            name: np.array([at[effect.named(q.name)] for q in effect.parameters], dtype=np.intp)
            for name, effect in self.effects.items()
        }
        taken = {int(j) for columns in self.columns.values() for j in columns} | {at[name] for name in terms}
        self.coefficients = np.array([j for j in range(len(self.shared)) if j not in taken], dtype=np.intp)
        self.terms = np.array([at[name] for name in terms], dtype=np.intp)
        states = self.equations
        self.term_equation = np.array([states.index(t.state) for t in self.discrepancy.terms], dtype=np.intp) if terms else np.zeros(0, np.intp)
        initial = self.cost._initial  # noqa
        free_states = list(initial.kept)
        self.initial_states = [self.model.states[k].name for k in free_states]
        self.initial_columns = np.full((len(self.trials), len(free_states)), -1, dtype=np.intp)
        for k, (piece, state) in enumerate(zip(initial.pieces, initial.states)):
            self.initial_columns[piece, free_states.index(int(state))] = self.free + k
        self.local_size = len(free_states) + len(self.equations) * KNOTS
        self.low, self.high = self.cost.bounds
        self.low[self.free :], self.high[self.free :] = -math.inf, math.inf

    def _series(self) -> None:
        groups = [group for group in self.cost.groups if group.kind == "data" and len(group.rows)]
        self.rows = max(int(group.rows.max()) for group in groups) + 1
        self.series = [
            Series(self.trials.names.index(g.trial), self.outputs.index(g.channel), g.rows, np.asarray(g.t)) for g in groups
        ]
        self.trial_of = np.zeros(self.rows, dtype=np.intp)
        self.channel_of = np.zeros(self.rows, dtype=np.intp)
        for one in self.series:
            self.trial_of[one.rows], self.channel_of[one.rows] = one.trial, one.channel

    def _priors(self) -> None:
        self.mean, self.sd = self.cost.start.copy(), np.ones(len(self.names))
        for k, parameter in enumerate(self.cost.parameters):
            if parameter.prior is not None:
                self.mean[k], self.sd[k] = parameter.prior.mean, parameter.prior.sd
            else:
                reach = parameter.max - parameter.min
                self.sd[k] = WIDE * reach if k >= self.free and math.isfinite(reach) else 1e3 * max(1.0, abs(parameter.value))
        rates = _usual_rates(self)
        self.usual = np.array([rates[state] for state in self.equations])

    # --- simulation

    def _at(self, forces: Array) -> None:
        if self.discrepancy is not None:
            self.cost.change_inputs([with_forces(t, self.discrepancy, f) for t, f in zip(self.trials, forces)])

    def errors(self, point: Point) -> Array:
        """Measured less simulated (rows,); inf where a run diverges."""
        self._at(point.forces)
        return np.asarray(self.cost.residuals(point.x)[: self.rows])

    def linearize(self, point: Point) -> Linearization:
        """Errors and derivatives at a point; derivatives that overflow when squared count as zero."""
        errors = self.errors(point)
        found = self.cost.jacobian(point.x)[: self.rows]
        found[~(np.abs(found) < LARGEST * (1.0 + np.abs(errors).max()))] = 0.0
        local = np.zeros((self.rows, self.local_size))
        count = self.initial_columns.shape[1]
        for number in range(len(self.trials)):
            here = self.trial_of == number
            for j, column in enumerate(self.initial_columns[number]):
                if column >= 0:
                    local[here, j] = found[here, column]
        local[:, count:] = found[:, self.knot_columns]
        return Linearization(point, errors, found[:, self.shared], local)

    def moved(self, point: Point, shared: Array, local: Array, part: float = 1.0) -> Point:
        """The point after a step: `shared` (S,), `local` (T, L)."""
        x = point.x.copy()
        x[self.shared] = np.clip(x[self.shared] + part * shared, self.low[self.shared], self.high[self.shared])
        count = self.initial_columns.shape[1]
        for number in range(len(self.trials)):
            columns = self.initial_columns[number]
            x[columns[columns >= 0]] += part * local[number, :count][columns >= 0]
        forces = point.forces + part * local[:, count:].reshape(point.forces.shape)
        return Point(x, forces)

    def local_mean(self, point: Point) -> Array:
        """Prior means of the local unknowns less their values (T, L)."""
        found = np.zeros((len(self.trials), self.local_size))
        count = self.initial_columns.shape[1]
        for number in range(len(self.trials)):
            for j, column in enumerate(self.initial_columns[number]):
                if column >= 0:
                    found[number, j] = self.mean[column] - point.x[column]
        found[:, count:] = -point.forces.reshape(len(self.trials), -1)
        return found

    def initial_sd(self) -> Array:
        """Prior deviations of the initial states (T, count)."""
        return np.where(self.initial_columns >= 0, self.sd[np.maximum(self.initial_columns, 0)], 1.0)


def _usual_rates(problem: Problem) -> dict[str, float]:
    """Usual size of each equation's acceleration: root mean square of the smoothed record's rate, where recorded."""
    found = {}
    for state in problem.equations:
        parts = []
        for trial in problem.trials:
            if state in trial.outputs:
                y = np.asarray(trial.outputs[state])
                valid = np.isfinite(y)
                if valid.sum() > 10:
                    grid = np.linspace(trial.t[0], trial.t[-1], 4 * KNOTS + 1)
                    centre = 0.5 * (grid[1:] + grid[:-1])
                    which = np.digitize(trial.t[valid], grid) - 1
                    means = np.array([y[valid][which == k].mean() if (which == k).any() else np.nan for k in range(4 * KNOTS)])
                    ok = np.isfinite(means)
                    if ok.sum() > 3:
                        parts.append(np.gradient(means[ok], centre[ok]))
        scale = problem.discrepancy.scales[state] if problem.discrepancy else 1.0
        slowest = min(trial.duration for trial in problem.trials)
        size = float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else 0.0
        found[state] = max(size, 1e-3 * scale / slowest * 10.0)
    return found


def _with_prior(parameter: Parameter) -> Parameter:
    if not parameter.vary or parameter.prior is not None:
        return parameter
    reach = parameter.max - parameter.min
    wide = reach / 4.0 if math.isfinite(reach) else 1.0
    sd = COEFFICIENT_SD * abs(parameter.value) if parameter.value != 0.0 else wide
    return parameter.but(prior=Prior(parameter.value, sd))


def _from_zero(trial: Trial) -> Trial:
    return dataclasses.replace(trial, t=trial.t - trial.t[0]) if trial.t[0] != 0.0 else trial
