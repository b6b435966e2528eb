"""The kinds of cost that a study can ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from seatruth.costs.study import Study
    from seatruth.costs.study_cost import StudyCost


@dataclass(frozen=True)
class CostKind:
    """One kind of cost: its name, what it is, and how it is made of a study (threads: None for one a processor)."""

    name: str
    title: str
    make: Callable[[Study, int | None], StudyCost]


def _trajectory(study: Study, threads: int | None) -> StudyCost:
    from seatruth.costs.trajectory import TrajectoryCost

    return TrajectoryCost(study, threads=threads)


def _regression(study: Study, threads: int | None) -> StudyCost:
    from seatruth.costs.regression import RegressionCost

    return RegressionCost(study, threads=threads)


def _formula(study: Study, threads: int | None) -> StudyCost:
    from seatruth.costs.formula import FormulaCost

    return FormulaCost(study)


KINDS: dict[str, CostKind] = {
    kind.name: kind
    for kind in (
        CostKind(
            "trajectory",
            "Open-loop output error: simulate each run from its first state and compare it with the record",
            _trajectory,
        ),
        CostKind(
            "regression",
            "Equation error: fit the accelerations equation by equation, without simulating",
            _regression,
        ),
        CostKind("formula", "A static formula fitted to a table", _formula),
    )
}
