"""Output error: simulate every trial in the open loop from its initial state and compare it with the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Regression
from seatruth.costs.initial import continuity, initial_states
from seatruth.costs.noise import Noise
from seatruth.costs.open_loop import open_loop, outputs_by_trial
from seatruth.costs.options import TrajectoryOptions, of_kind
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.regression import RegressionCost
from seatruth.costs.segments import cut, state_at
from seatruth.costs.study_cost import ResidualBlock, StudyCost, prior_blocks
from seatruth.models.black_box import BlackBox
from seatruth.models.servo_black_box import acting
from seatruth.simulate import Simulator
from seatruth.trials.trial import Trial, Trials

_MAX_BYTES = 64 * 1024 * 1024
"""Largest size of the outputs of a population in memory at a time, bytes (chosen here [S])."""
_WARM_UP = 0.2
"""Part of a new trial from which its initial state is estimated before it is predicted (chosen here [S])."""
_MIN_WARM_UP = 20
"""Samples of such a beginning at least (chosen here [S]: enough for the noise of a sample to average out)."""


class TrajectoryCost(StudyCost):
    """Minus the log-likelihood of the recorded outputs given the simulated ones.

    The options are those of the problem (`TrajectoryOptions`). With initial = "fixed" the initial state comes from the
    first samples; the first sample of an output that is a state is then matched by construction and is no residual.
    With "free" it is estimated. `segments` start again from the data every so many seconds. With `multiple_shooting`
    the segments must join; the initial state of a trial is then free only with initial = "free". A free state with an
    `initial_sd` has a prior from the first sample, which is then no residual, so that it counts once. A model whose
    initial state depends on parameters uses their start values. Candidates that diverge or break a constraint cost inf.
    """

    def __init__(self, problem: EstimationProblem, *, threads: int | None = None) -> None:
        self.problem, self.space = problem, problem.space
        self.options = problem.options(TrajectoryOptions)
        self.trials = tuple(problem.trials)
        self._threads = threads
        self._segments = cut(self.trials, self.options.segments)
        self._simulator = self._simulate([segment.trial for segment in self._segments])
        self._whole: Simulator | None = None
        self._K = len(self.space.free)
        values = self.space.nominal()
        base = self._simulator.initial_states.copy()
        under_way = [(number, segment) for number, segment in enumerate(self._segments) if not segment.first]
        moved = {k: acting(problem.model, self.trials[k], values) for k in {segment.parent for _, segment in under_way}}
        for number, segment in under_way:
            whole = self.trials[segment.parent]
            base[number] = state_at(problem.model, whole, segment.start, values, moved[segment.parent])
        theta = self.space.varying_values(self.space.start[None])[0]
        self._initial = initial_states(problem, self.options, self._segments, self._simulator, theta, base, self.trials)
        self._continuity = continuity(problem, self.options, self._segments, self._initial, self.trials)
        self.parameters = (*self.space.free, *self._initial.parameters)
        self.nuisances = tuple(parameter.name for parameter in self._initial.parameters)
        abilities: set[Ability] = {"values", "residuals", "derivatives"}
        if not isinstance(problem.model, BlackBox):
            abilities.add("regression")
        self.gives = frozenset(abilities)
        known = {name: float(value) for name, value in problem.noise.items() if value != "estimate"}
        self._noise = Noise(
            [channel.name for channel in problem.model.outputs],
            self._simulator.measured,
            self._counted(),
            known,
            correlated=self.options.criterion == "likelihood",
            where=f"study {problem.name!r}",
        )
        self._first_defect = self._noise.size + len(self.space.priors) + len(self._initial.priors)
        self.residual_blocks = self._residual_blocks()

    def values(self, X: Array) -> Array:
        """Cost of each candidate: (P, K) -> (P,), in one simulation of the whole population."""
        X = np.asarray(X, dtype=np.float64)
        model_x = X[:, : self._K]
        theta, x0 = self.space.varying_values(model_x), self._initial.of(X[:, self._K :])
        with np.errstate(all="ignore"):
            if self._noise.correlated:
                cost, end = self._by_errors(theta, x0)
            else:
                errors = self._simulator.squared_errors(theta, x0, self._noise.weights)
                cost, end = self._noise.cost_of_squares(errors.sums.sum(axis=1)), errors.x_end
            if self.space.priors:
                cost = cost + 0.5 * (self.space.prior_residuals(model_x) ** 2).sum(axis=1)
            if len(self._initial.priors):
                cost = cost + 0.5 * (self._initial_residuals(X[:, self._K :]) ** 2).sum(axis=1)
            if self._continuity.size:
                defects = self._defects(end, x0)
                cost = cost + 0.5 * (defects**2).sum(axis=1)
        if self.space.constraints:
            cost = np.where(self.space.feasible(model_x), cost, np.inf)
        return np.where(np.isfinite(cost), cost, np.inf)

    def residuals(self, x: Array) -> Array:
        """Errors over noise, then priors, then defects: (M,); all inf where x diverges or breaks a constraint."""
        return np.asarray(self.residuals_of(np.asarray(x, dtype=np.float64)[None])[0])

    def residuals_of(self, X: Array) -> Array:
        """`residuals` of each candidate, (P, K) -> (P, M), in one simulation of the whole population."""
        X = np.asarray(X, dtype=np.float64)
        theta, x0 = self.space.varying_values(X[:, : self._K]), self._initial.of(X[:, self._K :])
        found = np.full((len(X), self._first_defect + self._continuity.size), np.inf)
        size = max(1, _MAX_BYTES // max(1, self._simulator.measured.nbytes))
        good = self.space.feasible(X[:, : self._K]) if self.space.constraints else np.ones(len(X), dtype=np.bool_)
        for k in range(0, len(X), size):
            part = slice(k, k + size)
            starts = x0[part] if x0.ndim == 3 else x0
            outputs = self._simulator.outputs(theta[part], starts)
            with np.errstate(all="ignore"):
                errors = [self._noise.residuals(self._simulator.measured - y) for y in outputs.y]
                rest = [self.space.prior_residuals(X[part, : self._K]), self._initial_residuals(X[part, self._K :])]
                found[part] = np.hstack([np.array(errors), *rest, self._defects(outputs.x_end, starts)])
            good[part] &= ~outputs.diverged.any(axis=1)
        found[~good | ~np.isfinite(found).all(axis=1)] = np.inf
        return found

    def jacobian(self, x: Array) -> Array:
        """Exact derivative of `residuals`, (M, K): through simulation, expressions, initial states and defects."""
        x = np.asarray(x, dtype=np.float64)
        model_x, initial = x[: self._K], self._initial
        theta = self.space.varying_values(model_x[None])[0]
        x0 = initial.of(x[None, self._K :])
        x0 = x0[0] if x0.ndim == 3 else x0
        derivative = self._simulator.jacobian(theta, x0, initial.names)
        chain = self.space.varying_jacobian(model_x) if self.space.has_ties else None
        dy = self._spread(derivative.dy, [(rows, k) for k, rows in enumerate(self._simulator.rows)], chain)
        ends = self._spread(derivative.dx_end, [(slice(k, k + 1), k) for k in range(len(self._segments))], chain)
        result = np.zeros((self._first_defect + self._continuity.size, len(x)))
        row = self._noise.size
        result[:row] = self._noise.derivatives(-dy)
        if self.space.priors:
            result[row : row + len(self.space.priors), : self._K] = self.space.prior_jacobian(model_x)
            row += len(self.space.priors)
        for k, sd in zip(initial.priors, initial.prior_sd):
            result[row, self._K + k] = 1.0 / sd
            row += 1
        if self._continuity.size:
            pairs = self._continuity
            result[row:] = ends[pairs.before, pairs.states] / pairs.sd[:, None]
            columns = self._K + initial.column_of[pairs.after, pairs.states]
            result[row + np.arange(pairs.size), columns] -= 1.0 / pairs.sd
        return result

    def regression(self) -> Regression:
        """The equations of motion as linear regressions on the measured states; initial states take no part.

        Raises BadInput where a state that they need is not measured, or a free parameter does not enter linearly.
        """
        problem = self.problem.replace(cost=of_kind(self.options, "regression"))
        return RegressionCost(problem, threads=self._threads).regression()

    def errors(self, x: Array) -> Array:
        """Measured minus simulated (N, D), segment after segment; NaN where not measured or diverged."""
        theta, x0 = self.candidate(x)
        outputs = self._simulator.outputs(theta[None], x0)
        with np.errstate(all="ignore"):
            errors = self._simulator.measured - outputs.y[0]
        for number in np.flatnonzero(outputs.diverged[0]):
            errors[self._simulator.rows[number]] = np.nan
        return np.asarray(errors)

    def predict(self, x: Array, trials: Sequence[Trial] | None = None) -> list[Array]:
        """Outputs (n, D) of whole trials simulated in the open loop from their initial state, NaN where it diverges.

        Trials of the cost (None) start from the initial state in x, also when the cost cuts them into segments. Other
        trials start from their first samples; with initial = "free", from the state that fits their first fifth best
        (20 samples at least) with the parameters of x. Later samples are not used.
        """
        if trials is None:
            theta, x0 = self.candidate(x)
            return outputs_by_trial(self._whole_simulator(), theta, x0[[segment.first for segment in self._segments]])
        if not len(trials):
            return []
        engine = self._simulate(trials)
        x0 = engine.initial_states if self.options.initial == "fixed" else self._fitted_start(x, trials)
        theta = self.space.varying_values(np.asarray(x, dtype=np.float64)[None, : self._K])[0]
        return outputs_by_trial(engine, theta, x0)

    def discretisation(self, x: Array) -> dict[str, float]:
        """Root mean square change of each output of whole trials when every step is halved; NaN for a black box."""
        theta, x0 = self.candidate(x)
        x0 = x0[[segment.first for segment in self._segments]]
        changes = self._whole_simulator().discretisation_error(theta, x0)
        return {channel.name: float(error) for channel, error in zip(self.problem.model.outputs, changes)}

    def _simulate(self, trials: Sequence[Trial]) -> Simulator:
        return open_loop(self.problem, trials, self.options.hold, self.options.max_step, self._threads)

    def _whole_simulator(self) -> Simulator:
        if len(self._segments) == len(self.trials):
            return self._simulator
        if self._whole is None:
            self._whole = self._simulate(self.trials)
        return self._whole

    def candidate(self, x: Array) -> tuple[Array, Array]:
        """Arguments of the simulator for x (K,): parameters, initial states (T, S)."""
        x = np.asarray(x, dtype=np.float64)
        x0 = self._initial.of(x[None, self._K :])
        return self.space.varying_values(x[None, : self._K])[0], x0[0] if x0.ndim == 3 else x0

    def _by_errors(self, theta: Array, x0: Array) -> tuple[Array, Array]:
        """Cost (P,) and last states (P, T, S) of candidates from their errors, in parts that fit into memory."""
        costs = np.full(len(theta), np.inf)
        end = np.full((len(theta), *self._initial.base.shape), np.nan)
        measured = self._simulator.measured
        size = max(1, _MAX_BYTES // max(1, measured.nbytes))
        for k in range(0, len(theta), size):
            part = slice(k, k + size)
            outputs = self._simulator.outputs(theta[part], x0[part] if x0.ndim == 3 else x0)
            cost = self._noise.cost_of_errors(measured - outputs.y)
            costs[part] = np.where(outputs.diverged.any(axis=1), np.inf, cost)
            end[part] = outputs.x_end
        return costs, end

    def _initial_residuals(self, free: Array) -> Array:
        """Residuals of the priors of initial states: free states (P, F) -> (P, priors)."""
        initial = self._initial
        if not len(initial.priors):
            return np.zeros((len(free), 0))
        return np.asarray((free[:, initial.priors] - initial.prior_mean) / initial.prior_sd)

    def _defects(self, end: Array, x0: Array) -> Array:
        """Defects over their sd, (P, J): end of a segment minus start of the next, for every constraint."""
        pairs = self._continuity
        if not pairs.size:
            return np.zeros((len(end), 0))
        return np.asarray((end[:, pairs.before, pairs.states] - x0[..., pairs.after, pairs.states]) / pairs.sd)

    def _spread(self, derivative: Array, parts: Sequence[tuple[slice, int]], chain: Array | None) -> Array:
        """Derivatives by the simulator's parameters and initial states -> by x: (R, D, k) -> (R, D, K)."""
        size = len(self.space.varying)
        spread = np.zeros((*derivative.shape[:2], len(self.parameters)))
        by_parameters = derivative[:, :, :size]
        spread[:, :, : self._K] = by_parameters if chain is None else by_parameters @ chain
        for rows, segment in parts:
            columns = self._initial.column_of[segment][self._initial.kept]
            free = np.flatnonzero(columns >= 0)
            spread[rows, :, self._K + columns[free]] = derivative[rows, :, size + free]
        return spread

    def _counted(self) -> NDArray[np.bool_]:
        """Samples (N, D) that are residuals: each once, and none that is matched by construction."""
        valid = np.isfinite(self._simulator.measured)
        states = {channel.name: k for k, channel in enumerate(self.problem.model.states)}
        prior = {
            (int(self._initial.segments[k]), int(self._initial.states[k])) for k in self._initial.priors
        }  # the first sample stands in the prior
        for number, (segment, rows) in enumerate(zip(self._segments, self._simulator.rows)):
            matched = []
            for column, output in enumerate(self.problem.model.outputs):
                state = states.get(output.name)
                fixed = state is not None and self._initial.column_of[number, state] < 0
                if fixed or (state is not None and (number, state) in prior):
                    matched.append(column)
            valid[rows.start, matched] = False
            if not segment.last:
                # The sample that two segments share counts in the later one if its start is free there.
                after = [column for column in range(valid.shape[1]) if column not in self._matched(number + 1, states)]
                valid[rows.stop - 1, after] = False
        return valid

    def _matched(self, number: int, states: dict[str, int]) -> set[int]:
        """Outputs that the start of a segment matches by construction."""
        matched = set()
        for column, output in enumerate(self.problem.model.outputs):
            state = states.get(output.name)
            if state is not None and self._initial.column_of[number, state] < 0:
                matched.add(column)
        return matched

    def _residual_blocks(self) -> tuple[ResidualBlock, ...]:
        total = len(self._simulator.measured)
        parent, sample = np.empty(total, dtype=np.intp), np.empty(total, dtype=np.intp)
        for segment, rows in zip(self._segments, self._simulator.rows):
            parent[rows], sample[rows] = segment.parent, np.arange(segment.start, segment.stop)
        of, at = parent[self._noise.rows], sample[self._noise.rows]
        blocks: list[ResidualBlock] = []
        for number, trial in enumerate(self.trials):
            for column, channel in enumerate(self.problem.model.outputs):
                places = np.flatnonzero((of == number) & (self._noise.columns == column))
                if places.size:
                    places = places[np.argsort(at[places], kind="stable")]
                    blocks.append(
                        ResidualBlock("data", trial.name, channel.name, places, trial.t[at[places]], at[places])
                    )
        blocks += prior_blocks(self.space.priors, self._noise.size)
        names = [self.nuisances[k] for k in self._initial.priors]
        blocks += prior_blocks(names, self._noise.size + len(self.space.priors))
        return (*blocks, *self._defect_blocks())

    def _defect_blocks(self) -> list[ResidualBlock]:
        blocks = []
        pairs = self._continuity
        for number, trial in enumerate(self.trials):
            for state, channel in enumerate(self.problem.model.states):
                here = [
                    k
                    for k in range(pairs.size)
                    if pairs.states[k] == state and self._segments[pairs.after[k]].parent == number
                ]
                if here:
                    sample = np.array([self._segments[pairs.after[k]].start for k in here], dtype=np.intp)
                    rows = self._first_defect + np.array(here, dtype=np.intp)
                    blocks.append(ResidualBlock("continuity", trial.name, channel.name, rows, trial.t[sample], sample))
        return blocks

    def _fitted_start(self, x: Array, trials: Sequence[Trial]) -> Array:
        """Initial states (T, S) that fit the beginning of other trials best, at the parameters of x."""
        values = self.space.by_name(np.asarray(x, dtype=np.float64)[: self._K])
        fixed = tuple(
            parameter.replace(value=values[parameter.name], vary=False, expr=None, prior=None)
            for parameter in self.problem.parameters
        )
        outputs = [channel.name for channel in self.problem.model.outputs]
        beginnings = Trials([trial.section(0, _warm_up(trial, outputs)) for trial in trials])
        noise = {**{name: sd for name, sd in self.problem.noise.items() if sd != "estimate"}, **self.sigma}
        short = self.problem.with_trials(beginnings).replace(
            parameters=fixed,
            constraints=(),
            noise=noise,
            cost=self.options.replace(segments=None, multiple_shooting=False, criterion="weighted"),
        )
        cost = TrajectoryCost(short, threads=self._threads)
        start = cost.start
        if len(start) and np.isfinite(cost.residuals(start)).all():
            # Without bounds: a sensor with a large error lets the true state begin far from what it shows.
            start = scipy.optimize.least_squares(cost.residuals, start, cost.jacobian, x_scale="jac", max_nfev=50).x
        return cost.candidate(start)[1]


def _warm_up(trial: Trial, outputs: Sequence[str]) -> int:
    """Samples of a trial's beginning: a fifth, and enough to see every output that it recorded."""
    count = max(_MIN_WARM_UP, round(_WARM_UP * len(trial)))
    for name in outputs:
        valid = np.flatnonzero(np.isfinite(trial.outputs[name])) if name in trial.outputs else np.zeros(0, dtype=int)
        if valid.size:
            count = max(count, int(valid[min(2, valid.size - 1)]) + 1)
    return min(count, len(trial))
