"""The comparison file: which studies, solvers, noise and budgets, as TOML.

Every table and key is a field here with its description; docs/compare.md is made from them.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, PositiveInt, ValidationError

from seatruth.comparison.export import read_targets
from seatruth.comparison.noise import KINDS, Noise
from seatruth.comparison.problem import Problem
from seatruth.comparison.spec import BUDGETS, TARGETS, Comparison, solver_definition
from seatruth.comparison.sweep import swept
from seatruth.optimizers import Optimizer
from seatruth.progress import Progress, silent
from seatruth.study import Study, load_study, parsed, read_text
from seatruth.study import solver as solvers
from seatruth.study.reference import rows
from seatruth.study.schema import OptimizerTable
from seatruth.study.schema_base import OpenTable, Table
from seatruth.study.validation import Problems, add_schema_errors


def _entries(value: Any) -> Any:
    """Names of solvers stand for tables."""
    return (
        [{"use": entry} if isinstance(entry, str) else entry for entry in value] if isinstance(value, list) else value
    )


class ComparisonTable(Table):
    """Name of the comparison, number of repetitions, budgets."""

    name: str | None = Field(default=None, description="Name in results and reports; default: the file's name.")
    description: str = Field(default="", description="What the comparison is for; shown in the report.")
    seed: Annotated[int, Field(ge=0)] = Field(default=0, description="Seed of all random numbers.")
    seeds: PositiveInt = Field(
        default=20,
        description="Realisations of each noise, at least 15; every solver sees the same ones.",
    )
    budgets: list[PositiveInt] = Field(
        default=list(BUDGETS),
        description="Evaluations that a run may spend, finite differences counted; one or several.",
    )
    anytime: bool = Field(
        default=True,
        description="One search with the largest budget serves the smaller ones: a run with a smaller budget is how it "
        "stood then. `false` gives every budget a search of its own.",
    )
    stop: Literal["budget", "targets"] = Field(
        default="budget",
        description='"targets" ends a search once it is near enough to the reference fit for all targets.',
    )
    costs: list[Literal["trajectory", "regression"]] = Field(
        default=[], description="Kinds of cost; default: that of each study. A formula study keeps its cost."
    )
    targets: list[FiniteFloat] | str = Field(
        default=list(TARGETS),
        description="Excesses over the best known fit, in units of chi-square; the report says when each is reached. "
        "Or a text file with a list of them, as COCO has them.",
    )
    success: Annotated[FiniteFloat, Field(gt=0)] = Field(
        default=1.0, description="The excess below which a run counts as a success: 1 is one standard error."
    )
    rope: Annotated[FiniteFloat, Field(ge=1)] = Field(
        default=1.1, description="Scores whose ratio is within this factor are alike in practice."
    )


class ProblemTable(Table):
    """A study that is fitted many times. `[[problems]]`, one or more."""

    study: str = Field(description="Study file, relative to this file.")
    name: str | None = Field(default=None, description="Name in results; default: the study's.")
    truth: Literal["study"] | dict[str, FiniteFloat] | None = Field(
        default=None,
        description='True parameters: "study" (the values that the study starts from) or a table. The trials are then '
        "simulated with them. Default: noise is added to the trials as they are; errors of parameters are unknown.",
    )
    start: Literal["random", "study"] = Field(
        default="random",
        description='Start of the searches: "random" (within the start regions or bounds, new for every seed, the same '
        'for all solvers) or "study" (the values of the study).',
    )
    costs: list[Literal["trajectory", "regression", "formula"]] = Field(
        default=[], description="Costs of this problem, instead of the comparison's."
    )
    budgets: list[PositiveInt] = Field(default=[], description="Budgets of this problem, instead of the comparison's.")


class SolverTable(OpenTable):
    """A solver; the further keys are its options (`seatruth list optimizers --long`). `[[solvers]]`, one or more.
    If no solver has options, a list of names suffices."""

    use: str | None = Field(default=None, description="A solver of `seatruth list optimizers`.")
    name: str | None = Field(default=None, description="Name in results; default: the solver's.")
    sweep: dict[str, list[Any]] = Field(
        default={}, description="By option a list of values: every combination is a solver of its own."
    )
    stages: list[OptimizerTable] = Field(
        default=[], description="Instead of `use`: a hybrid. Each stage is a table like `[optimizer]` of a study file."
    )


class NoiseTable(OpenTable):
    """One kind of noise at several levels; the further keys are options of the kind. `[[noise]]`, one or more."""

    kind: str = Field(default="white", description="white, coloured, outliers, dropouts or input.")
    levels: list[Annotated[FiniteFloat, Field(ge=0)]] = Field(
        description="Standard deviations as parts of each channel's range, as [0, 0.01, 0.03, 0.1]."
    )


class OutputTable(Table):
    """Files that are written."""

    folder: str | None = Field(
        default=None,
        description="Folder of store, report and tables, in the folder of this file; default: NAME-result there.",
    )


class ComparisonFile(Table):
    """A whole comparison file."""

    comparison: ComparisonTable = ComparisonTable()
    problems: list[ProblemTable] = Field(default=[])
    solvers: Annotated[list[SolverTable], BeforeValidator(_entries)] = Field(default=[])
    noise: list[NoiseTable] = Field(default=[])
    output: OutputTable = OutputTable()


def read_comparison(path: str | Path, *, progress: Progress = silent) -> tuple[Comparison, Path]:
    """The comparison that a file describes, and the folder of its results. BadInput lists all problems with lines.

    `progress` is told how far the reading of the studies' logs has come.
    """
    source = Path(path)
    data, problems = parsed(read_text(source), str(source))
    try:
        file = ComparisonFile.model_validate(data)
    except ValidationError as error:
        add_schema_errors(problems, error, table=ComparisonFile)
        problems.stop()
        raise
    problem_list = _problems(file, source, problems, progress)
    optimizers = _solvers(file, problems)
    noise = _noise(file, problems)
    for key, entries in (("problems", file.problems), ("solvers", file.solvers)):
        if not entries:
            problems.add((key,), f"it names no {key}", f"Add [[{key}]].")
    table = file.comparison
    if not table.budgets:
        problems.add(("comparison", "budgets"), "the list of budgets is empty", "Give one or more.")
    targets: Sequence[float] = ()
    with problems.at("comparison", "targets"):
        given = table.targets
        targets = read_targets(source.parent / given) if isinstance(given, str) else given
    problems.stop()
    name = table.name or source.stem
    comparison: Comparison | None = None
    with problems.at():
        comparison = Comparison(
            problems=problem_list,
            solvers=optimizers,
            noise=noise,
            seeds=table.seeds,
            budgets=table.budgets,
            anytime=table.anytime,
            stop=table.stop,
            costs=table.costs,
            name=name,
            description=table.description,
            seed=table.seed,
            targets=targets,
            success=table.success,
            rope=table.rope,
            made_of={**file.model_dump(mode="json"), "studies": {p.name: p.study.content_hash for p in problem_list}},
        )
        _check_used(comparison, problems)
    problems.stop()
    assert comparison is not None  # otherwise there was a problem
    return comparison, source.parent / (file.output.folder or f"{source.stem}-result")


def reference() -> str:
    """The tables of docs/compare.md, written from the schema so that they cannot drift from it."""
    parts = ["## Reference", ""]
    for title, table in (
        ("[comparison]", ComparisonTable),
        ("[[problems]]", ProblemTable),
        ("[[solvers]]", SolverTable),
        ("[[noise]]", NoiseTable),
        ("[output]", OutputTable),
    ):
        about = inspect.cleandoc(table.__doc__ or "").replace("\n", " ")
        parts += [f"### `{title}`", "", about, "", "| key | is | means |", "|---|---|---|", *rows(table), ""]
    parts += ["Kinds of noise and their options:", "", "| kind | is | options |", "|---|---|---|"]
    for kind in KINDS.values():
        options = [f"`{name}` = `{entry.default:g}`: {entry.doc}" for name, entry in kind.options.items()]
        parts.append(f"| `{kind.name}` | {kind.title} | {'; '.join(options)} |")
    return "\n".join(parts) + "\n"


def _problems(file: ComparisonFile, source: Path, problems: Problems, progress: Progress) -> list[Problem]:
    problem_list = []
    for k, entry in enumerate(file.problems):
        study: Study | None = None
        with problems.at("problems", k, "study"):
            study = load_study(source.parent / entry.study, progress=progress)
        if study is None:
            continue
        values = {parameter.name: parameter.value for parameter in study.free}
        truth = values if entry.truth == "study" else entry.truth
        with problems.at("problems", k):
            name = entry.name or study.name
            problem_list.append(Problem(name, study, truth, entry.start, tuple(entry.costs), tuple(entry.budgets)))
    names = [problem.name for problem in problem_list]
    for k, name in enumerate(names):
        if name in names[:k]:
            problems.add(("problems", k), f"a second problem is called {name!r}", "Give it a `name` of its own.")
    return problem_list


def _solvers(file: ComparisonFile, problems: Problems) -> dict[str, Optimizer]:
    solvers_by_label: dict[str, Optimizer] = {}
    for k, entry in enumerate(file.solvers):
        if (entry.use is None) == (not entry.stages):
            problems.add(("solvers", k), "a solver needs either `use` or `stages`", "Give one of the two.")
            continue
        if entry.stages and entry.options:
            problems.add(("solvers", k), f"unknown key {next(iter(entry.options))!r}", "Options belong to the stages.")
            continue
        if entry.stages and entry.sweep:
            problems.add(("solvers", k, "sweep"), "a hybrid has no options to sweep", "Sweep a single solver.")
            continue
        choices: list[tuple[str, list[OptimizerTable]]] = []
        with problems.at("solvers", k):
            choices = list(_choices(entry))
        for label, tables in choices:
            below = Problems(problems.source)
            made = solvers.optimizer(tables, below)
            with problems.at("solvers", k):
                below.stop()
            if made is None:
                break  # the other values of a sweep would say the same
            if label in solvers_by_label:
                problems.add(("solvers", k), f"a second solver is called {label!r}", "Give it a `name` of its own.")
            elif any(solver_definition(made) == solver_definition(other) for other in solvers_by_label.values()):
                problems.add(
                    ("solvers", k), f"{label!r} is the same as a solver above", "Remove it or change an option."
                )
            solvers_by_label[label] = made
    return solvers_by_label


def _choices(entry: SolverTable) -> Iterator[tuple[str, list[OptimizerTable]]]:
    """Labels and tables of an entry's solver, or of all in its sweep."""
    tables = entry.stages or [OptimizerTable(use=str(entry.use), **entry.options)]
    name = entry.name or " + ".join(table.use for table in tables)
    if not entry.sweep:
        yield name, tables
        return
    for label, options in swept(entry.sweep):
        yield f"{name}, {label}", [OptimizerTable(use=str(entry.use), **{**entry.options, **options})]


def _noise(file: ComparisonFile, problems: Problems) -> list[Noise]:
    noise: list[Noise] = []
    for k, entry in enumerate(file.noise):
        if not entry.levels:
            problems.add(("noise", k, "levels"), "the list of levels is empty", "Give one or more, as [0, 0.01].")
        for level in entry.levels:
            with problems.at("noise", k):
                noise.append(Noise(entry.kind, level, entry.options))
    return noise or [Noise()]


def _check_used(comparison: Comparison, problems: Problems) -> None:
    """Every solver must fit something."""
    used = {label for labels in comparison.fitting.values() for label in labels}
    for k, (label, solver) in enumerate(comparison.solver.items()):
        if label in used:
            continue
        needs = ", ".join(sorted(solver.needs))
        problems.add(("solvers", k), f"{label!r} fits no cost of any problem: it needs {needs}", "Remove it.")
