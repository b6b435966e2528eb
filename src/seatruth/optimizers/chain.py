"""Hybrids: one solver after another on one budget, each from the best of the one before."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from seatruth.costs.base import Ability
from seatruth.errors import BadInput
from seatruth.optimizers.base import Optimizer
from seatruth.optimizers.evaluator import StageOver
from seatruth.optimizers.problem import Problem, solve


@dataclass(frozen=True)
class Chain(Optimizer):
    """Runs `stages` in turn, usually a global search and then a local one.

    `shares` gives, for every stage but the last, the part of the whole budget (evaluations, seconds) that it may use;
    what it leaves goes to those after it. Without shares the stages before the last divide three quarters evenly. A
    stall ends a stage, and only in the last one the run.
    """

    name: ClassVar[str] = "chain"
    title: ClassVar[str] = "One optimizer after another"
    stages: tuple[Optimizer, ...]
    shares: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.stages:
            raise BadInput("a chain needs at least one optimizer", where="optimizer")
        if any(isinstance(stage, Chain) for stage in self.stages):
            raise BadInput("a chain cannot hold another chain", where="optimizer", do="List all stages in one.")
        shares = self.shares or (0.75 / max(len(self.stages) - 1, 1),) * (len(self.stages) - 1)
        if len(shares) != len(self.stages) - 1 or any(not 0 < share < 1 for share in shares) or sum(shares) >= 1:
            raise BadInput(
                f"the shares {list(shares)} do not fit {len(self.stages)} stages",
                where="optimizer",
                do="Give one between 0 and 1 for each stage but the last, together less than 1.",
            )
        object.__setattr__(self, "shares", tuple(float(share) for share in shares))
        needs: frozenset[Ability] = frozenset().union(*(stage.needs for stage in self.stages))
        object.__setattr__(self, "needs", needs)

    def run(self, problem: Problem, rng: np.random.Generator) -> str | None:
        """Runs the stages. Each has a stream of random numbers of its own, so that it does not depend on the others."""
        evaluator = problem._evaluator
        reasons = []
        streams = rng.spawn(len(self.stages))
        for place, (stage, share) in enumerate(zip(self.stages, (*self.shares, math.inf)), 1):
            whole = math.inf if evaluator.budget.evaluations is None else evaluator.budget.evaluations
            time = math.inf if evaluator.budget.seconds is None else evaluator.budget.seconds
            last = place == len(self.stages)
            evaluator.begin_stage(
                math.inf if last else max(1.0, math.floor(share * whole)) if math.isfinite(whole) else math.inf,
                math.inf if last else share * time,
                last,
            )
            try:
                reason = solve(stage, evaluator, streams[place - 1], problem.best)
            except StageOver as over:
                reason = over.reason
            reasons.append(f"{stage.name}: {reason or 'it stopped by its own rule'}")
        return "; ".join(reasons)

    def describe(self) -> dict[str, Any]:
        stages: Sequence[dict[str, Any]] = [stage.describe() for stage in self.stages]
        return {"name": self.name, "stages": list(stages), "shares": list(self.shares), "options": {}}
