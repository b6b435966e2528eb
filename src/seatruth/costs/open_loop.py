"""Open-loop simulation of trials for the parameters of a problem."""

from __future__ import annotations

from collections.abc import Sequence

from seatruth.arrays import Array
from seatruth.costs.problem import EstimationProblem
from seatruth.simulate import Simulator, simulator
from seatruth.trials.channel import Hold
from seatruth.trials.trial import Trial


def open_loop(
    problem: EstimationProblem, trials: Sequence[Trial], hold: Hold, max_step: float | None, threads: int | None
) -> Simulator:
    """A simulator of these trials whose candidates set the parameters that vary with x."""
    return simulator(
        problem.model,
        trials,
        free=problem.space.varying,
        values=problem.space.nominal(),
        hold=hold,
        max_step=max_step,
        threads=threads,
    )


def outputs_by_trial(engine: Simulator, theta: Array, x0: Array) -> list[Array]:
    """Outputs (n, D) of each trial for one candidate: theta (K,), initial states x0 (T, S)."""
    y = engine.outputs(theta[None], x0).y[0]
    return [y[rows] for rows in engine.rows]
