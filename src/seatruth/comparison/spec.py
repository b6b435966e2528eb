"""What a comparison is: problems x costs x solvers x noise x seeds x budgets, and the runs that follow from it."""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import joblib
import numpy as np

from seatruth.comparison.noise import Noise
from seatruth.costs.options import of_kind
from seatruth.errors import BadInput, SeatruthError, nearest
from seatruth.models.blackbox import BlackBox
from seatruth.optimizers import Optimizer, as_optimizer
from seatruth.optimizers.base import FromCallable
from seatruth.optimizers.chain import Chain
from seatruth.study import Study

FORMAT = 1
"""Changes when the way a run is made changes, so that runs made the old way are made again."""
TARGETS = (100.0, 10.0, 1.0, 0.1, 0.01)
COSTS = ("trajectory", "regression", "formula")
Start = Literal["random", "study"]


@dataclass(frozen=True, eq=False)
class Problem:
    """A study to be fitted again and again under noise.

    `truth` gives true values of its free parameters: the trials are then simulated with them (their recorded outputs
    are not used, only when and what was recorded), so that errors can be told. Without, noise is added to the trials
    as they are. `start`: where searches start, "random" (drawn from the start regions or bounds, for every seed anew,
    the same for all solvers) or "study" (the study's values). `costs` and `budgets` replace the comparison's.
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

    `key` is the hash of everything that decides it; `instance` that of what all solvers share. `solver` is "" for the
    fit that all are measured against.
    """

    key: str
    instance: str
    problem: str
    cost: str
    solver: str
    noise: Noise
    seed: int
    budget: int


@dataclass(frozen=True, eq=False)
class Comparison:
    """Solvers compared on problems under noise.

    Args:
        problems: the problems.
        solvers: label -> a name, an Optimizer or a list of them for a hybrid (a plain function through
            `seatruth.optimizers.from_callable`); or a list of these.
        noise: kinds of noise with their levels.
        seeds: realisations of each noise.
        budgets: evaluations that a run may spend, finite differences counted.
        costs: kinds of cost; each problem's own where empty.
        name, description: for results and reports.
        seed: fixes all random draws.
        targets: excesses over the best known fit, in units of chi-square (twice the cost).
        success: the target at which a run counts as a success.
        made_of: what the store notes about the comparison.

    Raises:
        BadInput: the parts cannot be compared.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Comparison
        >>> from seatruth.comparison import Noise, Problem
        >>> problems = [Problem("sample", seatruth.sample.load())]
        >>> comparison = Comparison(problems, ["least_squares", "cma_es"], [Noise("white", 0.01)], seeds=15)
        >>> len(comparison.runs)
        30
    """

    problems: Sequence[Problem]
    solvers: Mapping[str, Any] | Sequence[Any]
    noise: Sequence[Noise] = (Noise(),)
    seeds: int = 20
    budgets: Sequence[int] = (2000,)
    costs: Sequence[str] = ()
    name: str = "comparison"
    description: str = ""
    seed: int = 0
    targets: Sequence[float] = TARGETS
    success: float = 1.0
    made_of: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"comparison {self.name!r}"
        for key in ("problems", "noise", "costs"):
            object.__setattr__(self, key, tuple(getattr(self, key)))
        object.__setattr__(self, "budgets", checked_budgets(self.budgets, where))
        for key in ("problems", "solvers", "noise", "budgets"):
            if not len(getattr(self, key)):
                raise BadInput(f"it has no {key}, so there is nothing to run", where=where, do="Name one or more.")
        if isinstance(self.seeds, bool) or not isinstance(self.seeds, int) or self.seeds < 1:
            raise BadInput(f"{self.seeds!r} seeds are not possible", where=where, do="Give 1 or more; 20 are good.")
        _distinct("problems", [problem.name for problem in self.problems], where)
        _distinct("noise", [f"{noise.label} {noise.level:g}" for noise in self.noise], where)
        for cost in self.costs:
            if cost not in COSTS[:2]:
                raise BadInput(f"there is no cost {cost!r} for all", where=where, do=nearest(cost, COSTS[:2]))
        _distinct("costs", list(self.costs), where)
        targets = tuple(sorted({float(target) for target in (*self.targets, self.success)}, reverse=True))
        if not all(math.isfinite(target) and target > 0 for target in targets):
            raise BadInput("targets must be above 0", where=where, do="An excess of 1 is one standard error.")
        object.__setattr__(self, "targets", targets)
        if not self.fitting:
            raise BadInput("no solver fits any of its costs", where=where, do="See `seatruth list optimizers --long`.")

    @property
    def base_level(self) -> float:
        """What noiseless records are weighted with: the smallest level above 0, or 1 %."""
        return min((noise.level for noise in self.noise if noise.level > 0), default=0.01)

    @cached_property
    def solver(self) -> dict[str, Optimizer]:
        """The solvers by label."""
        return _solvers(self.solvers, f"comparison {self.name!r}")

    def problem(self, name: str) -> Problem:
        return next(problem for problem in self.problems if problem.name == name)

    def costs_of(self, problem: Problem) -> tuple[str, ...]:
        """The costs that a problem is fitted by."""
        if problem.costs:
            return problem.costs
        if problem.study.cost.kind == "formula":
            return ("formula",)
        return tuple(self.costs) or (problem.study.cost.kind,)

    def budgets_of(self, problem: Problem) -> tuple[int, ...]:
        return problem.budgets or tuple(self.budgets)

    @cached_property
    def fitting(self) -> dict[tuple[str, str], tuple[str, ...]]:
        """Solvers by problem and cost that find in the cost what they need."""
        found = {}
        needed: frozenset[str] = frozenset().union(*(solver.needs for solver in self.solver.values()))
        for problem in self.problems:
            for cost in self.costs_of(problem):
                gives = abilities(problem, cost, needed)
                own = tuple(label for label, solver in self.solver.items() if solver.needs <= gives)
                if own:
                    found[problem.name, cost] = own
        return found

    @cached_property
    def references(self) -> tuple[Run, ...]:
        """The fits that runs are measured against, one an instance."""
        return tuple(self._references())

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """All runs, seed by seed, so that a part of them is a smaller comparison of the same kind."""
        solvers = {label: digest(definition(solver)) for label, solver in self.solver.items()}
        found = []
        for reference in self.references:
            for budget in self.budgets_of(self.problem(reference.problem)):
                for label in self.fitting[reference.problem, reference.cost]:
                    key = digest({"instance": reference.instance, "solver": solvers[label], "budget": budget})
                    place = (reference.problem, reference.cost, label, reference.noise, reference.seed, budget)
                    found.append(Run(key, reference.instance, *place))
        return tuple(found)

    def _references(self) -> Iterator[Run]:
        hashes = {
            (problem.name, cost): problem.study.replace(cost=of_kind(problem.study.cost, cost)).content_hash
            for problem in self.problems
            for cost in self.costs_of(problem)
        }
        for seed in range(self.seeds):
            for noise in self.noise:
                for problem in self.problems:
                    for cost in self.costs_of(problem):
                        if (problem.name, cost) not in self.fitting:
                            continue
                        content = {
                            "format": FORMAT,
                            "problem": problem.name,
                            "study": hashes[problem.name, cost],
                            "truth": problem.truth,
                            "start": problem.start,
                            "noise": noise.describe(),
                            "weights": self.base_level if noise.level == 0 else None,
                            "seed": [self.seed, seed],
                        }
                        key = digest(content)
                        yield Run(digest([key, "reference"]), key, problem.name, cost, "", noise, seed, 0)


def abilities(problem: Problem, cost: str, wanted: Iterable[str] = ()) -> frozenset[str]:
    """What this kind of cost of a problem gives.

    A regression where one is `wanted` is tried: only that shows whether all free parameters enter it linearly and all
    that it needs was recorded.
    """
    from seatruth.comparison.realisation import Bench, Setting
    from seatruth.costs.registry import cost_of

    if isinstance(problem.study.model, BlackBox) and cost == "regression":
        return frozenset()
    found = frozenset({"values", "residuals", "derivatives", "regression"})
    if "regression" in wanted:
        try:
            cost_of(Bench(problem, Setting(0, 0.01)).realised(cost, Noise("white", 0.01), 0), threads=1).regression()
            return found
        except (SeatruthError, NotImplementedError):
            pass
    return found - {"regression"}


def definition(solver: Optimizer) -> dict[str, Any]:
    """A solver's options; of a plain function its text too, since that is what defines it."""
    found = dict(solver.describe())
    stages = solver.stages if isinstance(solver, Chain) else (solver,)
    texts = [_text(stage.function) for stage in stages if isinstance(stage, FromCallable)]
    return found | ({"functions": texts} if texts else {})


def stream(*parts: Any) -> np.random.SeedSequence:
    """A stream of random numbers of its own for everything that is called differently."""
    words = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).digest()
    return np.random.SeedSequence([int(word) for word in np.frombuffer(words, dtype="<u4")])


def digest(content: Any) -> str:
    """Hash of anything that is JSON; numbers count with all their digits."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:32]


def checked_budgets(budgets: Sequence[int], where: str) -> tuple[int, ...]:
    """Budgets in rising order; BadInput for what is none, or stands twice."""
    for budget in budgets:
        if isinstance(budget, bool) or not isinstance(budget, int | np.integer) or budget < 1:
            raise BadInput(
                f"a budget of {budget!r} evaluations is not possible", where=where, do="Give whole numbers, 1 or more."
            )
    _distinct("budgets", [str(budget) for budget in budgets], where)
    return tuple(sorted(int(budget) for budget in budgets))


def _solvers(given: Mapping[str, Any] | Sequence[Any], where: str) -> dict[str, Optimizer]:
    if isinstance(given, Mapping):
        return {str(label): as_optimizer(solver) for label, solver in given.items()}
    if isinstance(given, str):
        raise BadInput("solvers is a text", where=where, do="Give a list of them.")
    found: dict[str, Optimizer] = {}
    for entry in given:
        solver = as_optimizer(entry)
        label = " + ".join(stage.name for stage in solver.stages) if isinstance(solver, Chain) else solver.name
        if label in found:
            raise BadInput(f"two solvers are called {label!r}", where=where, do="Give them as {label: solver}.")
        found[label] = solver
    return found


def _distinct(what: str, names: Sequence[str], where: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise BadInput(f"{twice[0]!r} stands twice among its {what}", where=where, do="Name each once.")


def _text(function: Any) -> list[Any]:
    """What defines a plain function: its text, and the values that it was made with (defaults, closure, fields)."""
    if isinstance(function, functools.partial):
        return [_text(function.func), [_value(given) for given in (function.args, function.keywords)]]
    target = function if inspect.isroutine(function) else type(function)
    try:
        text = inspect.getsource(target)
    except (OSError, TypeError):
        text = str(getattr(target, "__qualname__", target))
    held: list[Any] = [getattr(function, "__defaults__", None), getattr(function, "__kwdefaults__", None)]
    for cell in getattr(function, "__closure__", None) or ():
        with suppress(ValueError):  # not filled yet
            held.append(cell.cell_contents)
    if target is not function:
        held.append(vars(function) if hasattr(function, "__dict__") else None)
    return [text, [_value(given) for given in held]]


def _value(given: Any) -> Any:
    if inspect.isroutine(given) or isinstance(given, functools.partial):
        return _text(given)
    try:
        return joblib.hash(given)
    except Exception:  # something that cannot be pickled: what it shows of itself must do
        return repr(given)
