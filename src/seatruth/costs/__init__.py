"""Costs: one interface between every problem and every optimizer, and the three kinds of cost.

    from seatruth.costs import cost_of
    cost = cost_of(study)
    cost.values(X), cost.residuals(x), cost.jacobian(x)

`seatruth.costs.base` is the interface alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from seatruth.costs.base import Ability, Block, Cost, Regression

if TYPE_CHECKING:
    from seatruth.costs.formula import FormulaCost
    from seatruth.costs.options import CostOptions, FormulaOptions, RegressionOptions, TrajectoryOptions
    from seatruth.costs.parameter_space import ParameterSpace
    from seatruth.costs.problem import EstimationProblem
    from seatruth.costs.registry import KINDS, CostKind, cost_of
    from seatruth.costs.regression import RegressionCost
    from seatruth.costs.study_cost import ResidualBlock, StudyCost
    from seatruth.costs.trajectory import TrajectoryCost

# Loaded when first used: optimizers need the interface only, and the engine behind the others takes time to import.
_MODULES = {
    "formula": ("FormulaCost",),
    "options": ("CostOptions", "FormulaOptions", "RegressionOptions", "TrajectoryOptions"),
    "parameter_space": ("ParameterSpace",),
    "problem": ("EstimationProblem",),
    "registry": ("KINDS", "CostKind", "cost_of"),
    "regression": ("RegressionCost",),
    "study_cost": ("ResidualBlock", "StudyCost"),
    "trajectory": ("TrajectoryCost",),
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names}

__all__ = [
    "KINDS",
    "Ability",
    "Block",
    "Cost",
    "CostKind",
    "CostOptions",
    "EstimationProblem",
    "FormulaCost",
    "FormulaOptions",
    "ParameterSpace",
    "Regression",
    "RegressionCost",
    "RegressionOptions",
    "ResidualBlock",
    "StudyCost",
    "TrajectoryCost",
    "TrajectoryOptions",
    "cost_of",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
