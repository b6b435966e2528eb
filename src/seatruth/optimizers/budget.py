"""When a run ends, and how it ended."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from typing import Any, Literal

import pandas as pd

from seatruth.arrays import Array
from seatruth.errors import BadInput

Code = Literal["converged", "budget", "stall", "deadline", "interrupted", "failed", "target"]


@dataclass(frozen=True)
class Budget:
    """What a run may spend, and what is good enough. None is no limit.

    Args:
        evaluations: cost evaluations. A population of P counts P, one residual vector 1 and one Jacobian K (its number
            of columns), so that all kinds of solver pay the same price for the same information.
        seconds: wall time, s, without the time between an interruption and its resumption.
        stall: evaluations after which the run stops if the best cost has not fallen by more than `tolerance`.
        tolerance: relative fall of the cost that counts as progress.
        target: cost that is good enough.

    Raises:
        BadInput: a limit is not positive, or nothing limits the run.

    Example:
        >>> from seatruth import Budget
        >>> Budget(evaluations=5000, seconds=60.0).evaluations
        5000
    """

    evaluations: int | None = 20_000
    seconds: float | None = None
    stall: int | None = None
    tolerance: float = 1e-9
    target: float | None = None

    def __post_init__(self) -> None:
        for name in ("evaluations", "seconds", "stall"):
            value = getattr(self, name)
            if value is not None and (isinstance(value, bool) or not value > 0 or not math.isfinite(value)):
                raise BadInput(f"{name} = {value!r} is no limit", where="budget", do="Give a positive number.")
        for name in ("evaluations", "stall"):
            value = getattr(self, name)
            if value is not None and int(value) != value:
                raise BadInput(f"{name} = {value!r} is not a whole number", where="budget")
        if not self.tolerance >= 0 or not math.isfinite(self.tolerance):
            raise BadInput(f"tolerance = {self.tolerance!r} is not a fraction", where="budget", do="Give 0 or more.")
        if self.target is not None and math.isnan(self.target):
            raise BadInput("target is not a number", where="budget")
        if self.evaluations is None and self.seconds is None and self.stall is None:
            raise BadInput("nothing limits the run", where="budget", do="Give evaluations, seconds or stall.")


class Stop(BaseException):
    """Raised out of a problem's methods to end a solver. Not an `Exception`, so that solvers let it through."""

    def __init__(self, code: Code, reason: str) -> None:
        super().__init__(reason)
        self.code, self.reason = code, reason


@dataclass(frozen=True)
class Snapshot:
    """How a run stood after some evaluations: what it would have found with a budget of as many.

    `evaluations` that were spent (the budget of the snapshot, or fewer where the run had ended), x (K,) in the
    parameters' units, its cost `value` (inf before any candidate could be evaluated), and the search time in s.
    """

    evaluations: int
    x: Array
    value: float
    seconds: float


@dataclass(frozen=True)
class Outcome:
    """How a run ended: the best parameters found and why it stopped there.

    x (K,) in the parameters' units; `value` its cost (inf if no candidate could be evaluated: x is then the start);
    `history` has columns evaluations, best, seconds (thinned to about 2000 rows); `diverged` counts candidates of
    infinite cost, `clipped` those that had to be moved inside the bounds; `notes` are sentences a user should read;
    `snapshots` hold how it stood after the numbers of evaluations that were asked for.
    """

    x: Array
    value: float
    evaluations: int
    code: Code
    reason: str
    history: pd.DataFrame
    diverged: int
    clipped: int
    seed: int
    optimizer: dict[str, Any]
    wall_s: float
    notes: tuple[str, ...] = field(default=())
    snapshots: tuple[Snapshot, ...] = field(default=())

    def __str__(self) -> str:
        return (
            f"{self.optimizer.get('name', 'optimizer')}: cost {self.value:.6g} after {self.evaluations} evaluations "
            f"in {self.wall_s:.2f} s; {self.code}: {self.reason}"
        )

    def same_as(self, other: Outcome) -> bool:
        """Whether two runs gave the same bytes in everything but wall-clock times."""
        return (
            self.x.tobytes() == other.x.tobytes()
            and (self.value, self.evaluations, self.code, self.reason, self.diverged, self.clipped, self.seed)
            == (other.value, other.evaluations, other.code, other.reason, other.diverged, other.clipped, other.seed)
            and json.dumps(self.optimizer, sort_keys=True, default=repr)
            == json.dumps(other.optimizer, sort_keys=True, default=repr)
            and self.history[["evaluations", "best"]].equals(other.history[["evaluations", "best"]])
        )
