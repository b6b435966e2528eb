"""Costs: one interface between every problem and every optimizer, and the kinds that are made from a study.

    from seatruth.costs import Study, cost_of
    cost = cost_of(Study("zigzags", model, trials, noise={"r": 0.001}))
    cost.values(X), cost.residuals(x), cost.jacobian(x)

`seatruth.costs.base` is the interface alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from seatruth.costs.base import Ability, Block, Cost, Regression

if TYPE_CHECKING:
    from seatruth.costs.formula import FormulaCost, formula_study
    from seatruth.costs.parameter_space import ParameterSpace
    from seatruth.costs.registry import KINDS, CostKind
    from seatruth.costs.regression import RegressionCost
    from seatruth.costs.study import Study, cost_of
    from seatruth.costs.study_cost import Group, StudyCost
    from seatruth.costs.trajectory import TrajectoryCost

# Loaded when first used: optimizers need the interface only, and the engine behind the others takes time to import.
_PLACES = {
    "Group": "fitted",
    "StudyCost": "fitted",
    "FormulaCost": "formula",
    "formula_study": "formula",
    "RegressionCost": "regression",
    "KINDS": "registry",
    "CostKind": "registry",
    "ParameterSpace": "space",
    "Study": "study",
    "cost_of": "study",
    "TrajectoryCost": "trajectory",
}

__all__ = [
    "KINDS",
    "Ability",
    "Block",
    "Cost",
    "CostKind",
    "FormulaCost",
    "Group",
    "ParameterSpace",
    "Regression",
    "RegressionCost",
    "Study",
    "StudyCost",
    "TrajectoryCost",
    "cost_of",
    "formula_study",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
