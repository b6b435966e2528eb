"""Output error: simulate every run from its first state, in the open loop, and compare it with the record."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from seatruth.arrays import Array
from seatruth.costs.base import Ability, Regression
from seatruth.costs.initial import initial_states, joints
from seatruth.costs.noise import Noise
from seatruth.costs.open_loop import open_loop, outputs_by_trial
from seatruth.costs.options import TrajectoryOptions, of_kind
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.regression import RegressionCost
from seatruth.costs.segments import cut, state_at
from seatruth.costs.study_cost import ResidualBlock, StudyCost, prior_blocks
from seatruth.models.blackbox import BlackBox
from seatruth.simulate import Simulator
from seatruth.trials.trial import Trial, Trials

_AT_ONCE = 64 * 1024 * 1024
"""Bytes of outputs that a population is held in at a time, where sums of squares are not enough."""
_WARM_UP = 0.2
"""Part of a new trial from which its initial state is estimated before it is predicted."""
_FEWEST_WARM = 20


class TrajectoryCost(StudyCost):
    """Minus the log-likelihood of the recorded outputs given the simulated ones.

    The options are the study's: initial states from the data ("fixed": the first sample of an output that is a state
    is then no residual, as it is matched by construction) or "free"; `segments` start anew from the data every so many
    seconds; with `multiple_shooting` they must join (the first initial state of a trial is free only with
    initial = "free"). A free state with an `initial_sd` has a prior from the first sample, which then is no residual
    of that output, so that it counts once. A model whose initial state depends on parameters gets that of their start
    values. Candidates that diverge or break a constraint cost inf.
    """

    def __init__(self, problem: EstimationProblem, *, threads: int | None = None) -> None:
        self.problem, self.space = problem, problem.space
        self.options = problem.options(TrajectoryOptions)
        self.trials = tuple(problem.trials)
        self._threads = threads
        self._pieces = cut(self.trials, self.options.segments)
        self._simulator = self._simulate([piece.trial for piece in self._pieces])
        self._whole: Simulator | None = None
        self._K = len(self.space.free)
        values = self.space.nominal()
        base = self._simulator.first_states.copy()
        for number, piece in enumerate(self._pieces):
            if not piece.first:
                base[number] = state_at(problem.model, self.trials[piece.parent], piece.start, values)
        theta = self.space.varying_values(self.space.start[None])[0]
        self._initial = initial_states(problem, self.options, self._pieces, self._simulator, theta, base, self.trials)
        self._joints = joints(problem, self.options, self._pieces, self._initial, self.trials)
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
        self._first_joint = self._noise.size + len(self.space.priors) + len(self._initial.priors)
        self.residual_blocks = self._residual_blocks()

    def values(self, X: Array) -> Array:
        """Cost of each candidate: (P, K) -> (P,), in one simulation of the whole population."""
        X = np.asarray(X, dtype=np.float64)
        own = X[:, : self._K]
        theta, x0 = self.space.varying_values(own), self._initial.of(X[:, self._K :])
        with np.errstate(all="ignore"):
            if self._noise.correlated:
                found, end = self._by_errors(theta, x0)
            else:
                sums = self._simulator.sums(theta, x0, self._noise.weights)
                found, end = self._noise.cost_of_squares(sums.squares.sum(axis=1)), sums.end
            if self.space.priors:
                found = found + 0.5 * (self.space.prior_residuals(own) ** 2).sum(axis=1)
            if len(self._initial.priors):
                found = found + 0.5 * (self._initial_residuals(X[:, self._K :]) ** 2).sum(axis=1)
            if self._joints.size:
                gaps = self._gaps(end, x0)
                found = found + 0.5 * (gaps**2).sum(axis=1)
        if self.space.constraints:
            found = np.where(self.space.feasible(own), found, np.inf)
        return np.where(np.isfinite(found), found, np.inf)

    def residuals(self, x: Array) -> Array:
        """Errors over noise, then priors, then joints: (M,); all inf where x diverges or breaks a constraint."""
        x = np.asarray(x, dtype=np.float64)
        own, free = x[None, : self._K], x[None, self._K :]
        theta, x0 = self.space.varying_values(own), self._initial.of(free)
        outputs = self._simulator.outputs(theta, x0)
        if outputs.diverged.any() or not self.space.feasible(own)[0]:
            return np.full(self._first_joint + self._joints.size, np.inf)
        with np.errstate(all="ignore"):
            parts = [
                self._noise.residuals(self._simulator.measured - outputs.y[0]),
                self.space.prior_residuals(own)[0],
                self._initial_residuals(free)[0],
                self._gaps(outputs.end, x0)[0],
            ]
        return np.concatenate(parts)

    def jacobian(self, x: Array) -> Array:
        """Exact derivative of `residuals`, (M, K): through simulation, expressions, initial states and joints."""
        x = np.asarray(x, dtype=np.float64)
        own, initial = x[: self._K], self._initial
        theta = self.space.varying_values(own[None])[0]
        x0 = initial.of(x[None, self._K :])
        x0 = x0[0] if x0.ndim == 3 else x0
        found = self._simulator.jacobian(theta, x0, initial.names)
        chain = self.space.varying_jacobian(own) if self.space.has_ties else None
        dy = self._spread(found.dy, [(rows, k) for k, rows in enumerate(self._simulator.rows)], chain)
        ends = self._spread(found.dend, [(slice(k, k + 1), k) for k in range(len(self._pieces))], chain)
        result = np.zeros((self._first_joint + self._joints.size, len(x)))
        at = self._noise.size
        result[:at] = self._noise.derivatives(-dy)
        if self.space.priors:
            result[at : at + len(self.space.priors), : self._K] = self.space.prior_jacobian(own)
            at += len(self.space.priors)
        for k, sd in zip(initial.priors, initial.prior_sd):
            result[at, self._K + k] = 1.0 / sd
            at += 1
        if self._joints.size:
            joint = self._joints
            result[at:] = ends[joint.before, joint.states] / joint.sd[:, None]
            columns = self._K + initial.column_of[joint.after, joint.states]
            result[at + np.arange(joint.size), columns] -= 1.0 / joint.sd
        return result

    def regression(self) -> Regression:
        """The equations of motion as linear regressions on the measured states; initial states take no part.

        Raises BadInput where a state that they need is not measured, or a free parameter does not enter linearly.
        """
        problem = self.problem.replace(cost=of_kind(self.options, "regression"))
        return RegressionCost(problem, threads=self._threads).regression()

    def errors(self, x: Array) -> Array:
        """Measured less simulated (N, D), the pieces one after another; NaN where not measured or diverged."""
        theta, x0 = self.candidate(x)
        outputs = self._simulator.outputs(theta[None], x0)
        with np.errstate(all="ignore"):
            found = self._simulator.measured - outputs.y[0]
        for number in np.flatnonzero(outputs.diverged[0]):
            found[self._simulator.rows[number]] = np.nan
        return np.asarray(found)

    def predict(self, x: Array, trials: Sequence[Trial] | None = None) -> list[Array]:
        """Outputs (n, D) of whole trials simulated in the open loop from their initial state, NaN where it diverges.

        Trials of the cost (None) start where x says, also when the cost cuts them into segments. Others start from
        their first samples, or, with initial = "free", from the state that fits the first fifth of them best (20
        samples at least) with the parameters as they are: nothing later is looked at.
        """
        if trials is None:
            theta, x0 = self.candidate(x)
            return outputs_by_trial(self._whole_simulator(), theta, x0[[piece.first for piece in self._pieces]])
        if not len(trials):
            return []
        sim = self._simulate(trials)
        x0 = sim.first_states if self.options.initial == "fixed" else self._fitted_start(x, trials)
        theta = self.space.varying_values(np.asarray(x, dtype=np.float64)[None, : self._K])[0]
        return outputs_by_trial(sim, theta, x0)

    def discretisation(self, x: Array) -> dict[str, float]:
        """Root mean square change of each output of whole trials when every step is halved; NaN for a black box."""
        theta, x0 = self.candidate(x)
        x0 = x0[[piece.first for piece in self._pieces]]
        found = self._whole_simulator().discretisation_error(theta, x0)
        return {channel.name: float(error) for channel, error in zip(self.problem.model.outputs, found)}

    @property
    def steps(self) -> int:
        """Integration steps of one candidate."""
        return self._simulator.steps

    def _simulate(self, trials: Sequence[Trial]) -> Simulator:
        return open_loop(self.problem, trials, self.options.hold, self.options.max_step, self._threads)

    def _whole_simulator(self) -> Simulator:
        if len(self._pieces) == len(self.trials):
            return self._simulator
        if self._whole is None:
            self._whole = self._simulate(self.trials)
        return self._whole

    def candidate(self, x: Array) -> tuple[Array, Array]:
        """What the simulator takes for x (K,): parameters, initial states (T, S)."""
        x = np.asarray(x, dtype=np.float64)
        x0 = self._initial.of(x[None, self._K :])
        return self.space.varying_values(x[None, : self._K])[0], x0[0] if x0.ndim == 3 else x0

    def _by_errors(self, theta: Array, x0: Array) -> tuple[Array, Array]:
        """Cost (P,) and last states (P, T, S) of candidates through their errors, some at a time."""
        found = np.full(len(theta), np.inf)
        end = np.full((len(theta), *self._initial.base.shape), np.nan)
        measured = self._simulator.measured
        size = max(1, _AT_ONCE // max(1, measured.nbytes))
        for k in range(0, len(theta), size):
            part = slice(k, k + size)
            outputs = self._simulator.outputs(theta[part], x0[part] if x0.ndim == 3 else x0)
            cost = self._noise.cost_of_errors(measured - outputs.y)
            found[part] = np.where(outputs.diverged.any(axis=1), np.inf, cost)
            end[part] = outputs.end
        return found, end

    def _initial_residuals(self, free: Array) -> Array:
        """(P, priors of initial states)."""
        initial = self._initial
        if not len(initial.priors):
            return np.zeros((len(free), 0))
        return np.asarray((free[:, initial.priors] - initial.prior_mean) / initial.prior_sd)

    def _gaps(self, end: Array, x0: Array) -> Array:
        """What is missing between the end of a piece and the start of the next, over its sd: (P, joints)."""
        joint = self._joints
        if not joint.size:
            return np.zeros((len(end), 0))
        return np.asarray((end[:, joint.before, joint.states] - x0[..., joint.after, joint.states]) / joint.sd)

    def _spread(self, derivative: Array, parts: Sequence[tuple[slice, int]], chain: Array | None) -> Array:
        """Derivatives by engine parameters and each piece's own states -> by x: (R, D, k) -> (R, D, K)."""
        size = len(self.space.varying)
        found = np.zeros((*derivative.shape[:2], len(self.parameters)))
        own = derivative[:, :, :size]
        found[:, :, : self._K] = own if chain is None else own @ chain
        for rows, piece in parts:
            columns = self._initial.column_of[piece][self._initial.kept]
            free = np.flatnonzero(columns >= 0)
            found[rows, :, self._K + columns[free]] = derivative[rows, :, size + free]
        return found

    def _counted(self) -> NDArray[np.bool_]:
        """Samples (N, D) that count: every one once, and none that is matched by construction."""
        valid = np.isfinite(self._simulator.measured)
        states = {channel.name: k for k, channel in enumerate(self.problem.model.states)}
        prior = {
            (int(self._initial.pieces[k]), int(self._initial.states[k])) for k in self._initial.priors
        }  # the first sample stands in the prior
        for number, (piece, rows) in enumerate(zip(self._pieces, self._simulator.rows)):
            matched = []
            for column, output in enumerate(self.problem.model.outputs):
                state = states.get(output.name)
                fixed = state is not None and self._initial.column_of[number, state] < 0
                if fixed or (state is not None and (number, state) in prior):
                    matched.append(column)
            valid[rows.start, matched] = False
            if not piece.last:
                # The sample that two pieces share counts in the later one if its start is free there.
                after = [column for column in range(valid.shape[1]) if column not in self._matched(number + 1, states)]
                valid[rows.stop - 1, after] = False
        return valid

    def _matched(self, number: int, states: dict[str, int]) -> set[int]:
        """Outputs that the start of a piece matches by construction."""
        found = set()
        for column, output in enumerate(self.problem.model.outputs):
            state = states.get(output.name)
            if state is not None and self._initial.column_of[number, state] < 0:
                found.add(column)
        return found

    def _residual_blocks(self) -> tuple[ResidualBlock, ...]:
        total = len(self._simulator.measured)
        parent, sample = np.empty(total, dtype=np.intp), np.empty(total, dtype=np.intp)
        for piece, rows in zip(self._pieces, self._simulator.rows):
            parent[rows], sample[rows] = piece.parent, np.arange(piece.start, piece.stop)
        of, at = parent[self._noise.rows], sample[self._noise.rows]
        found: list[ResidualBlock] = []
        for number, trial in enumerate(self.trials):
            for column, channel in enumerate(self.problem.model.outputs):
                places = np.flatnonzero((of == number) & (self._noise.columns == column))
                if places.size:
                    places = places[np.argsort(at[places], kind="stable")]
                    found.append(
                        ResidualBlock("data", trial.name, channel.name, places, trial.t[at[places]], at[places])
                    )
        found += prior_blocks(self.space.priors, self._noise.size)
        names = [self.nuisances[k] for k in self._initial.priors]
        found += prior_blocks(names, self._noise.size + len(self.space.priors))
        return (*found, *self._joint_blocks())

    def _joint_blocks(self) -> list[ResidualBlock]:
        found = []
        joint = self._joints
        for number, trial in enumerate(self.trials):
            for state, channel in enumerate(self.problem.model.states):
                here = [
                    k
                    for k in range(joint.size)
                    if joint.states[k] == state and self._pieces[joint.after[k]].parent == number
                ]
                if here:
                    sample = np.array([self._pieces[joint.after[k]].start for k in here], dtype=np.intp)
                    rows = self._first_joint + np.array(here, dtype=np.intp)
                    found.append(ResidualBlock("continuity", trial.name, channel.name, rows, trial.t[sample], sample))
        return found

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
            start = least_squares(cost.residuals, start, cost.jacobian, x_scale="jac", max_nfev=50).x
        return cost.candidate(start)[1]


def _warm_up(trial: Trial, outputs: Sequence[str]) -> int:
    """Samples of a trial's beginning: a fifth, and enough to see every output that it recorded."""
    count = max(_FEWEST_WARM, round(_WARM_UP * len(trial)))
    for name in outputs:
        valid = np.flatnonzero(np.isfinite(trial.outputs[name])) if name in trial.outputs else np.zeros(0, dtype=int)
        if valid.size:
            count = max(count, int(valid[min(2, valid.size - 1)]) + 1)
    return min(count, len(trial))
