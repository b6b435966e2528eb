"""The kinds of cost, and the cost that a problem's options ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from seatruth.costs.formula import FormulaCost
from seatruth.costs.options import Kind
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.regression import RegressionCost
from seatruth.costs.study_cost import StudyCost
from seatruth.costs.trajectory import TrajectoryCost
from seatruth.trials.trial import Trials


@dataclass(frozen=True)
class CostKind:
    """One kind of cost: its name, a title, and how it is made of a problem (threads: None for all processors)."""

    name: Kind
    title: str
    make: Callable[[EstimationProblem, int | None], StudyCost]


KINDS: dict[str, CostKind] = {
    kind.name: kind
    for kind in (
        CostKind(
            "trajectory",
            "Output error: simulate each trial in the open loop from its initial state and compare it with the record",
            lambda problem, threads: TrajectoryCost(problem, threads=threads),
        ),
        CostKind(
            "regression",
            "Equation error: fit the accelerations equation by equation, without simulating",
            lambda problem, threads: RegressionCost(problem, threads=threads),
        ),
        CostKind("formula", "A static formula fitted to a table", lambda problem, threads: FormulaCost(problem)),
    )
}


def cost_of(problem: EstimationProblem, *, trials: Trials | None = None, threads: int | None = None) -> StudyCost:
    """The cost that a study or another estimation problem asks for.

    Args:
        problem: what is fitted; a `Study` is one.
        trials: fit these trials instead of the problem's (for cross-validation).
        threads: threads of the simulation; None takes one per processor.

    Returns:
        The cost. Its `description` holds the hash of everything that decides its values.
    """
    used = problem if trials is None else problem.with_trials(trials)
    return KINDS[used.cost.kind].make(used, threads)
