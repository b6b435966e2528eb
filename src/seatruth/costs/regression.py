"""Equation error: compare the equations of motion with accelerations from the record, without simulating."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.base import Regression
from seatruth.costs.finite_differences import recorded
from seatruth.costs.linear import Linear, blocks_of
from seatruth.costs.noise import Noise
from seatruth.costs.open_loop import open_loop, outputs_by_trial
from seatruth.costs.options import RegressionOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.study_cost import ResidualBlock, StudyCost, prior_blocks
from seatruth.errors import BadInput
from seatruth.models.black_box import BlackBox
from seatruth.simulate import Simulator, evaluate_rhs, evaluate_rhs_jacobian
from seatruth.trials.trial import Trial

_MAX_BYTES = 64 * 1024 * 1024
"""Largest size of the rates of a population in memory at a time, bytes (chosen here [S])."""


class RegressionCost(StudyCost):
    """Minus the log-likelihood of accelerations given the measured states, equation by equation.

    A residual is the recorded (or differenced) acceleration minus the one that the equations give for the measured
    states and inputs, over the standard deviation of that equation's errors. This deviation is always estimated: it
    contains the noise of all states and is no sensor's. A channel is named after its state, with "_dot". The cost is
    fast, and linear wherever the parameters are, but noise in the states biases it; a trajectory cost has no such bias.

    Fitted are the equations of the states in `equations`, or all that contain free parameters. Raises BadInput with the
    name of a state that an equation needs and no trial measured.
    """

    gives = frozenset({"values", "residuals", "derivatives", "regression"})

    def __init__(self, problem: EstimationProblem, *, threads: int | None = None) -> None:
        where = f"study {problem.name!r}"
        self._options = problem.options(RegressionOptions)
        if isinstance(problem.model, BlackBox):
            raise BadInput(
                f"model {problem.model.name!r} is a black box and has no equations to compare with accelerations",
                where=where,
                do='Use cost kind = "trajectory".',
            )
        self.problem, self.space = problem, problem.space
        self.trials = tuple(problem.trials)
        self.parameters = self.space.free
        self._threads = threads
        self._data = recorded(problem.model, self.trials, self._options.form)
        self._nominal = self.space.nominal()
        start = self.space.start
        sensitivity = self._derivatives(start)
        self._equations = self._chosen(sensitivity, where)
        self._targets = np.ascontiguousarray(self._data.targets[:, self._equations])
        predicted = self._predicted(start[None])[0]
        valid = np.isfinite(self._targets) & np.isfinite(predicted)
        self._refuse_unmeasured(valid, where)
        names = [f"{problem.model.states[k].name}_dot" for k in self._equations]
        self._noise = Noise(names, self._targets, valid, {}, where=where)
        self._valid = valid
        self.residual_blocks = self._residual_blocks()

    @property
    def equations(self) -> tuple[str, ...]:
        """States whose equations are used."""
        return tuple(self.problem.model.states[k].name for k in self._equations)

    @cached_property
    def linear(self) -> Linear | None:
        """The equations as linear functions of x, or None where a free parameter enters another way."""
        return Linear.of(self._weighted_errors, self._weighted_derivatives, self.space)

    def values(self, X: Array) -> Array:
        """Cost of each candidate: (P, K) -> (P,)."""
        X = np.asarray(X, dtype=np.float64)
        with np.errstate(all="ignore"):
            linear = self.linear
            squares = linear.squares(X) if linear is not None else self._squares(X)
            found = self._noise.cost_of_squares(squares)
        return self._with_priors(found, X)

    def jacobian(self, x: Array) -> Array:
        """Exact derivative of `residuals`: (M, K)."""
        x = np.asarray(x, dtype=np.float64)
        data = self._noise.derivatives(-self._derivatives(x)[:, self._equations])
        return np.concatenate([data, self.space.prior_jacobian(x)])

    def regression(self) -> Regression:
        """One linear regression per equation, weighted against each other as in their joint solution.

        Raises BadInput naming a parameter that does not enter linearly.
        """
        if self.linear is None:
            self._refuse_nonlinear()
        names = [f"equation of {name}" for name in self.equations]
        return Regression(blocks_of(names, self._weighted_errors, self._weighted_derivatives, self.space, self._noise))

    def errors(self, x: Array) -> Array:
        """Recorded minus computed accelerations (N, equations)."""
        return np.asarray(self._targets - self._predicted(np.asarray(x, dtype=np.float64)[None])[0])

    def predict(self, x: Array, trials: Sequence[Trial] | None = None) -> list[Array]:
        """Outputs (n, D) of each trial, simulated in the open loop from its first samples."""
        engine = self._whole if trials is None else self._simulate(trials)
        theta = self.space.varying_values(np.asarray(x, dtype=np.float64)[None])[0]
        return outputs_by_trial(engine, theta, engine.initial_states)

    def discretisation(self, x: Array) -> dict[str, float]:
        """Root mean square change of each simulated output when every integration step is halved."""
        theta = self.space.varying_values(np.asarray(x, dtype=np.float64)[None])[0]
        found = self._whole.discretisation_error(theta, self._whole.initial_states)
        return {channel.name: float(error) for channel, error in zip(self.problem.model.outputs, found)}

    @cached_property
    def _whole(self) -> Simulator:
        """The simulator of the cost's own trials."""
        return self._simulate(self.trials)

    def _simulate(self, trials: Sequence[Trial]) -> Simulator:
        return open_loop(self.problem, trials, self._options.hold, self._options.max_step, self._threads)

    def _predicted(self, X: Array) -> Array:
        """Accelerations of candidates (P, K) to compare with the targets: (P, N, equations)."""
        data = self._data
        rates = evaluate_rhs(
            self.problem.model,
            self.space.varying_values(X),
            self.space.varying,
            self._nominal,
            data.states,
            data.inputs,
            data.t,
            self._threads,
            trial=data.trial,
        )
        return np.ascontiguousarray(data.compared(rates)[:, :, self._equations])

    def _derivatives(self, x: Array) -> Array:
        """Derivatives (N, S, K) of the accelerations to compare with the targets, for all states."""
        data = self._data
        found = evaluate_rhs_jacobian(
            self.problem.model,
            self.space.varying_values(x[None])[0],
            self.space.varying,
            self._nominal,
            data.states,
            data.inputs,
            data.t,
            self._threads,
            trial=data.trial,
        )
        if self.space.has_ties:
            found = found @ self.space.varying_jacobian(x)
        return np.moveaxis(data.compared(np.moveaxis(found, 2, 0)), 0, 2)

    def _weighted_errors(self, x: Array) -> Array:
        """Errors (N, equations) times the noise's own weights, 0 where a sample does not count."""
        return np.where(self._valid, self.errors(x) * self._noise.weights, 0.0)

    def _weighted_derivatives(self, x: Array) -> Array:
        """Derivatives (N, equations, K) of the weighted errors."""
        weights = np.where(self._valid, self._noise.weights, 0.0)[:, :, None]
        found = np.where(self._valid[:, :, None], -self._derivatives(x)[:, self._equations], 0.0)
        return np.asarray(found * weights)

    def _squares(self, X: Array) -> Array:
        """Weighted sums of squares (P, equations), some candidates at a time."""
        found = np.empty((len(X), len(self._equations)))
        size = max(1, _MAX_BYTES // max(1, self._data.states.nbytes))
        for k in range(0, len(X), size):
            errors = np.where(self._valid, (self._targets - self._predicted(X[k : k + size])) * self._noise.weights, 0)
            found[k : k + size] = np.einsum("pne,pne->pe", errors, errors)
        return found

    def _chosen(self, sensitivity: Array, where: str) -> NDArray[np.intp]:
        """Indices of the states whose equations are fitted. An equation with gaps alone stays."""
        states = [channel.name for channel in self.problem.model.states]
        # NaN counts: it comes from a state that was not measured, times the parameter.
        holds = ((sensitivity != 0) | np.isnan(sensitivity)).any(axis=(0, 2))
        if self._options.equations is None:
            kept = [k for k in range(len(states)) if holds[k]]
            if not kept and len(self.parameters):
                raise BadInput("no equation of motion holds a free parameter", where=where, do="Free others.")
            return np.array(kept or range(len(states)), dtype=np.intp)
        for name in self._options.equations:
            if len(self.parameters) and not holds[states.index(name)]:
                raise BadInput(f"the equation of {name!r} holds no free parameter", where=where, do="Leave it out.")
        return np.array([states.index(name) for name in self._options.equations], dtype=np.intp)

    def _refuse_unmeasured(self, valid: NDArray[np.bool_], where: str) -> None:
        for column, number in enumerate(self._equations):
            if valid[:, column].any():
                continue
            states = self.problem.model.states
            name = states[number].name
            unmeasured = [
                state.name
                for k, state in enumerate(states)
                if not np.isfinite(self._data.states[:, k]).any() and (k == number or self._needs(number, k))
            ]
            what = f"state {unmeasured[0]!r}, which no trial measured" if unmeasured else "states at the same time"
            raise BadInput(
                f"the equation of {name!r} needs {what}",
                where=where,
                do='Leave it out with equations = [...], or use cost kind = "trajectory".',
            )

    def _needs(self, equation: int, state: int) -> bool:
        """Whether an equation contains a state: its rate is NaN where the state is NaN."""
        probe = np.ones((2, len(self.problem.model.states)))
        probe[:, state] = np.nan
        inputs = np.ones((2, self._data.inputs.shape[1]))
        theta = self.space.varying_values(self.space.start[None])[0]
        rates = evaluate_rhs(self.problem.model, theta, self.space.varying, self._nominal, probe, inputs)
        return bool(np.isnan(rates[:, equation]).any())

    def _refuse_nonlinear(self) -> None:
        culprits = Linear.culprits(self._weighted_derivatives, self.space)
        which = ", ".join(repr(name) for name in culprits[:5]) or "the parameters together"
        raise BadInput(
            f"{which} do{'es' if len(culprits) == 1 else ''} not enter the equations of motion linearly",
            where=f"study {self.problem.name!r}",
            do="Fix those, or use an optimizer that takes residuals (least_squares).",
        )

    def _residual_blocks(self) -> tuple[ResidualBlock, ...]:
        found: list[ResidualBlock] = []
        for trial, rows in zip(self.trials, self._data.rows):
            for column, name in enumerate(self._noise.channels):
                inside = (self._noise.rows >= rows.start) & (self._noise.rows < rows.stop)
                places = np.flatnonzero(inside & (self._noise.columns == column))
                if places.size:
                    sample = self._noise.rows[places] - rows.start
                    found.append(ResidualBlock("data", trial.name, name, places, np.asarray(trial.t)[sample], sample))
        return (*found, *prior_blocks(self.space.priors, self._noise.size))
