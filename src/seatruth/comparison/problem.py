"""One problem of a comparison, one run on it, and what identifies both."""

from __future__ import annotations

import hashlib
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from seatruth.comparison.noise import Noise
from seatruth.errors import BadInput, nearest
from seatruth.study import Study

COSTS = ("trajectory", "regression", "formula")
"""Kinds of cost."""
MOST_EVALUATIONS = 10**12
"""Evaluations of a run. Chosen here [S]: a thousand times what a processor does in a day."""
MOST_BUDGETS = 1000
"""Budgets of a problem. Chosen here [S]: the history of a search tells what lies between them."""
Start = Literal["random", "study"]


@dataclass(frozen=True, eq=False)
class Problem:
    """A study that is fitted again and again under noise.

    Attributes:
        name: Its name in the results.
        study: The study.
        truth: True values of its free parameters. The trials are then simulated with them (of the recorded outputs only
            the times and the gaps are used), so that errors are known. None adds noise to the trials as they are.
        start: Where searches start: "random" (drawn from the start regions or bounds anew for each seed, the same for
            all solvers) or "study" (the study's values).
        costs: Kinds of cost, instead of the comparison's.
        budgets: Evaluations, instead of the comparison's.

    Raises:
        BadInput: Nothing varies, or the truth, a cost or a budget does not fit the study.
    """

    name: str
    study: Study
    truth: Mapping[str, float] | None = None
    start: Start = "random"
    costs: tuple[str, ...] = ()
    budgets: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        where = f"problem {self.name!r}"
        free = {parameter.name: parameter for parameter in self.study.free}
        if not free:
            raise BadInput("no parameter varies", where=where, do="Set `vary = true` for one or more.")
        if self.start not in ("random", "study"):
            raise BadInput(f"start is {self.start!r}", where=where, do=nearest(str(self.start), ("random", "study")))
        object.__setattr__(self, "costs", tuple(self.costs))
        object.__setattr__(self, "budgets", checked_budgets(self.budgets, where))
        for cost in self.costs:
            if cost not in COSTS:
                raise BadInput(f"there is no cost {cost!r}", where=where, do=nearest(cost, COSTS))
            if (cost == "formula") != (self.study.cost.kind == "formula"):
                raise BadInput(f"a {self.study.cost.kind} study has no {cost} cost", where=where)
        if self.truth is None:
            return
        for name in self.truth:
            if name not in free:
                raise BadInput(
                    f"the truth of {name!r}, which is no free parameter", where=where, do=nearest(name, free)
                )
        missing = [name for name in free if name not in self.truth]
        if missing:
            raise BadInput(f"the truth of {missing[0]!r} is missing", where=where, do="Give all free parameters.")
        for name, value in self.truth.items():
            if not math.isfinite(value) or not free[name].min <= value <= free[name].max:
                raise BadInput(
                    f"the truth of {name!r}, {value:g}, is outside its bounds {free[name].min:g} to {free[name].max:g}",
                    where=where,
                    do="Widen the bounds or correct the truth.",
                )
        object.__setattr__(self, "truth", {name: float(self.truth[name]) for name in free})

    @property
    def synthetic(self) -> bool:
        """Whether its trials come from a simulator."""
        return self.truth is not None or self.study.synthetic


@dataclass(frozen=True)
class Run:
    """One search: a solver on one cost of one realisation, with one budget.

    Attributes:
        key: Hash of everything that decides the run.
        instance: Hash of what all solvers share.
        solver: Label of the solver; "" for the reference fit that all are measured against.
        of: Evaluations of the search that it belongs to: more than `budget` where it is how a search with a larger
            budget stood after `budget` evaluations.
    """

    key: str
    instance: str
    problem: str
    cost: str
    solver: str
    noise: Noise
    seed: int
    budget: int
    of: int


def random_stream(*parts: Any) -> np.random.SeedSequence:
    """A stream of random numbers that depends on these parts alone; different parts give independent streams."""
    words = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).digest()
    return np.random.SeedSequence([int(word) for word in np.frombuffer(words, dtype="<u4")])


def digest(content: Any) -> str:
    """Hash of any JSON content; numbers count with all their digits."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:32]


def checked_budgets(budgets: Sequence[int], where: str) -> tuple[int, ...]:
    """Budgets in rising order; BadInput for a value that is no budget, or a repeated one."""
    for budget in budgets:
        if isinstance(budget, bool) or not isinstance(budget, int | np.integer) or not 1 <= budget <= MOST_EVALUATIONS:
            raise BadInput(
                f"a budget of {budget!r} evaluations is not possible",
                where=where,
                do=f"Give whole numbers, 1 to {MOST_EVALUATIONS:,}.",
            )
    if len(budgets) > MOST_BUDGETS:
        raise BadInput(f"{len(budgets)} budgets are too many", where=where, do=f"Give at most {MOST_BUDGETS}.")
    check_distinct("budgets", [str(budget) for budget in budgets], where)
    return tuple(sorted(int(budget) for budget in budgets))


def check_distinct(what: str, names: Sequence[str], where: str) -> None:
    """Raises BadInput if a name is repeated."""
    repeated = sorted(name for name, times in Counter(names).items() if times > 1)
    if repeated:
        raise BadInput(f"{repeated[0]!r} is repeated among its {what}", where=where, do="Name each once.")
