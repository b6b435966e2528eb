"""What a comparison is: problems x costs x solvers x noise x seeds x budgets, and the runs that follow from it."""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import joblib

from seatruth.comparison.noise import Noise
from seatruth.comparison.problem import COSTS, Problem, Run, check_distinct, checked_budgets, digest
from seatruth.comparison.realisation import NoisyProblem, RealisationSettings
from seatruth.costs.options import of_kind
from seatruth.costs.registry import cost_of
from seatruth.errors import BadInput, SeatruthError, nearest
from seatruth.models.black_box import BlackBox
from seatruth.optimizers import Optimizer, as_optimizer
from seatruth.optimizers.base import FromCallable
from seatruth.optimizers.chain import Chain

FORMAT = 1
"""Changes when the way a run is made changes, so that runs made the old way are made again."""
BUDGETS = (100, 1000, 10_000, 100_000)
"""Evaluations, by decades, up to a number at which population methods have done their work. Chosen here [S]."""
TARGETS = (100.0, 10.0, 1.0, 0.1, 0.01)
"""Excesses in units of chi-square: ten standard errors of the best fit down to a tenth, by decades."""


DENSE_TARGETS = tuple(10.0 ** (exponent / 5.0) for exponent in range(20, -11, -1))
"""31 excesses from 10,000 to 0.01: five a decade, as COCO spaces its 51 targets (Hansen and others 2021)."""
MOST_RUNS = 200_000
"""Runs of a comparison. Chosen here [S]: naming them takes some ten seconds, and 0.1 s each make six hours."""
STOPS = ("budget", "targets")
"""What ends a search besides its own rule."""


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
        anytime: whether one search with the largest budget serves the smaller ones too: a run with a smaller budget is
            how that search stood then. Otherwise every budget has a search of its own, which matters only for solvers
            that look at their budget, such as hybrids.
        stop: "budget" lets every search use its budget; "targets" ends it once it is near enough to the reference fit
            for all targets.
        costs: kinds of cost; each problem's own where empty.
        name, description: for results and reports.
        seed: fixes all random draws.
        targets: excesses over the best known fit, in units of chi-square (twice the cost).
        success: the target at which a run counts as a success.
        rope: scores whose ratio is within this factor are alike in practice (region of practical equivalence).
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
        120
    """

    problems: Sequence[Problem]
    solvers: Mapping[str, Any] | Sequence[Any]
    noise: Sequence[Noise] = (Noise(),)
    seeds: int = 20
    budgets: Sequence[int] = BUDGETS
    anytime: bool = True
    stop: Literal["budget", "targets"] = "budget"
    costs: Sequence[str] = ()
    name: str = "comparison"
    description: str = ""
    seed: int = 0
    targets: Sequence[float] = TARGETS
    success: float = 1.0
    rope: float = 1.1
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
        check_distinct("problems", [problem.name for problem in self.problems], where)
        check_distinct("noise", [f"{noise.label} {noise.level:g}" for noise in self.noise], where)
        for cost in self.costs:
            if cost not in COSTS[:2]:
                raise BadInput(f"there is no cost {cost!r} for all", where=where, do=nearest(cost, COSTS[:2]))
        check_distinct("costs", list(self.costs), where)
        targets = tuple(sorted({float(target) for target in (*self.targets, self.success)}, reverse=True))
        if not all(math.isfinite(target) and target > 0 for target in targets):
            raise BadInput("targets must be above 0", where=where, do="An excess of 1 is one standard error.")
        object.__setattr__(self, "targets", targets)
        if not (math.isfinite(self.rope) and self.rope >= 1):
            raise BadInput(f"rope is {self.rope!r}", where=where, do="Give a factor of 1 or more, as 1.1.")
        if self.stop not in STOPS:
            raise BadInput(f"a search cannot stop at {self.stop!r}", where=where, do=nearest(str(self.stop), STOPS))
        if not self.fitting:
            raise BadInput("no solver fits any of its costs", where=where, do="See `seatruth list optimizers --long`.")
        count = (
            self.seeds
            * len(self.noise)
            * sum(1 + len(self.budgets_of(self.problem(name))) * len(able) for (name, _), able in self.fitting.items())
        )
        if count > MOST_RUNS:
            raise BadInput(
                f"it has {count:,} runs, and {MOST_RUNS:,} are possible",
                where=where,
                do="Compare fewer seeds, budgets, levels or solvers, or split it into several comparisons.",
            )

    @property
    def base_level(self) -> float:
        """What noiseless records are weighted with: the smallest level above 0, or 1 %."""
        return min((noise.level for noise in self.noise if noise.level > 0), default=0.01)

    @cached_property
    def solver(self) -> dict[str, Optimizer]:
        """The solvers by label."""
        return _labelled_solvers(self.solvers, f"comparison {self.name!r}")

    @property
    def dense_targets(self) -> tuple[float, ...]:
        """Targets of the distribution over evaluations: those given, or five a decade in place of the usual ones."""
        usual = set(self.targets) <= {*TARGETS, self.success}
        return DENSE_TARGETS if usual else tuple(self.targets)

    def problem(self, name: str) -> Problem:
        """The problem of this name."""
        return next(problem for problem in self.problems if problem.name == name)

    def costs_of(self, problem: Problem) -> tuple[str, ...]:
        """The kinds of cost by which a problem is fitted."""
        if problem.costs:
            return problem.costs
        if problem.study.cost.kind == "formula":
            return ("formula",)
        return tuple(self.costs) or (problem.study.cost.kind,)

    def budgets_of(self, problem: Problem) -> tuple[int, ...]:
        """The budgets of a problem's runs."""
        return problem.budgets or tuple(self.budgets)

    @cached_property
    def fitting(self) -> dict[tuple[str, str], tuple[str, ...]]:
        """By problem and cost, the solvers whose needs the cost meets."""
        fitting = {}
        needed: frozenset[str] = frozenset().union(*(solver.needs for solver in self.solver.values()))
        for problem in self.problems:
            for cost in self.costs_of(problem):
                gives = abilities(problem, cost, needed)
                able = tuple(label for label, solver in self.solver.items() if solver.needs <= gives)
                if able:
                    fitting[problem.name, cost] = able
        return fitting

    @cached_property
    def references(self) -> tuple[Run, ...]:
        """The fits that runs are measured against, one an instance."""
        return tuple(self._references())

    @cached_property
    def runs(self) -> tuple[Run, ...]:
        """All runs, seed by seed, so that a part of them is a smaller comparison of the same kind."""
        solvers = {label: digest(solver_definition(solver)) for label, solver in self.solver.items()}
        runs = []
        for reference in self.references:
            budgets = self.budgets_of(self.problem(reference.problem))
            for budget in budgets:
                of = budgets[-1] if self.anytime else budget
                for label in self.fitting[reference.problem, reference.cost]:
                    content = {"instance": reference.instance, "solver": solvers[label], "budget": budget}
                    content |= {"of": of} if of > budget else {}
                    content |= {"stop": min(self.targets)} if self.stop == "targets" else {}
                    place = (reference.problem, reference.cost, label, reference.noise, reference.seed, budget, of)
                    runs.append(Run(digest(content), reference.instance, *place))
        return tuple(runs)

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
                        yield Run(digest([key, "reference"]), key, problem.name, cost, "", noise, seed, 0, 0)


def abilities(problem: Problem, cost: str, wanted: Iterable[str] = ()) -> frozenset[str]:
    """What this kind of cost of a problem gives a solver.

    Where a regression is `wanted`, it is tried: only that shows whether all free parameters enter it linearly, and
    whether everything that it needs was recorded.
    """
    if isinstance(problem.study.model, BlackBox) and cost == "regression":
        return frozenset()
    gives = frozenset({"values", "residuals", "derivatives", "regression"})
    if "regression" in wanted:
        with suppress(SeatruthError):
            noisy = NoisyProblem(problem, RealisationSettings(seed=0, base_level=0.01))
            cost_of(noisy.realise(cost, Noise("white", 0.01), 0), threads=1).regression()
            return gives
    return gives - {"regression"}


def solver_definition(solver: Optimizer) -> dict[str, Any]:
    """A solver's options; for a plain function also its source text, which defines it."""
    definition = dict(solver.describe())
    stages = solver.stages if isinstance(solver, Chain) else (solver,)
    texts = [_function_definition(stage.function) for stage in stages if isinstance(stage, FromCallable)]
    return definition | ({"functions": texts} if texts else {})


def _labelled_solvers(solvers: Mapping[str, Any] | Sequence[Any], where: str) -> dict[str, Optimizer]:
    if isinstance(solvers, Mapping):
        return {str(label): as_optimizer(solver) for label, solver in solvers.items()}
    if isinstance(solvers, str):
        raise BadInput("solvers is a text", where=where, do="Give a list of them.")
    by_label: dict[str, Optimizer] = {}
    for entry in solvers:
        solver = as_optimizer(entry)
        label = " + ".join(stage.name for stage in solver.stages) if isinstance(solver, Chain) else solver.name
        if label in by_label:
            raise BadInput(f"two solvers are called {label!r}", where=where, do="Give them as {label: solver}.")
        by_label[label] = solver
    return by_label


def _function_definition(function: Any) -> list[Any]:
    """The source text of a plain function, and the values that it was made with (defaults, closure, fields)."""
    if isinstance(function, functools.partial):
        return [
            _function_definition(function.func),
            [_value_definition(value) for value in (function.args, function.keywords)],
        ]
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
    return [text, [_value_definition(value) for value in held]]


def _value_definition(value: Any) -> Any:
    if inspect.isroutine(value) or isinstance(value, functools.partial):
        return _function_definition(value)
    try:
        return joblib.hash(value)
    except Exception:  # something that cannot be pickled: its printed form must do
        return repr(value)
