"""Optimizers: the interface, the driver that runs them, and the registry that finds them.

from seatruth.optimizers import Budget, minimise
outcome = minimise(cost, ["differential_swarm", "least_squares"], budget=Budget(20_000), seed=1)
"""

from seatruth.optimizers.base import Optimizer, from_callable, option
from seatruth.optimizers.budget import Budget, Code, Outcome, Snapshot, Stop
from seatruth.optimizers.chain import Chain
from seatruth.optimizers.coordinates import Coordinates
from seatruth.optimizers.driver import minimise
from seatruth.optimizers.evaluator import Evaluator
from seatruth.optimizers.problem import Problem
from seatruth.optimizers.registry import OptimizerInfo, OptionInfo, as_optimizer, available, describe, make, names
from seatruth.optimizers.starts import starting_points
from seatruth.storage.checkpoint import StaleCheckpoint

__all__ = [
    "Budget",
    "Chain",
    "Code",
    "Coordinates",
    "Evaluator",
    "Optimizer",
    "OptimizerInfo",
    "OptionInfo",
    "Outcome",
    "Problem",
    "Snapshot",
    "StaleCheckpoint",
    "Stop",
    "as_optimizer",
    "available",
    "describe",
    "from_callable",
    "make",
    "minimise",
    "names",
    "option",
    "starting_points",
]
