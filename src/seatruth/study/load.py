"""From a study file to a study: `load_study("study.toml")` gives what `identify` takes.

    plan = read_plan("study.toml")
    estimate = identify(plan.study, plan.optimizer, budget=plan.budget, seed=plan.seed)

Reading a study file never runs anything but the model file that it names. Everything wrong with it is said in one
message, each problem with its line.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from seatruth.errors import BadInput
from seatruth.optimizers import Budget, Optimizer
from seatruth.study import build, solver
from seatruth.study.schema import StudyFile
from seatruth.study.toml_positions import Lines
from seatruth.study.validation import Problems, add_schema_errors

if TYPE_CHECKING:
    from seatruth.identification import Study

_LARGEST = 4_000_000
"""Bytes; a study file is written by hand, so anything larger is another kind of file."""


@dataclass(frozen=True)
class Plan:
    """Everything that a study file says: the study, and how to run it."""

    study: Study
    optimizer: Optimizer
    budget: Budget
    seed: int
    folder: Path
    """Folder of the result."""
    report: bool = True
    cross_validate: bool = False
    profile: tuple[str, ...] = ()
    """Names of the free parameters whose likelihood is profiled."""
    source: Path | None = None

    def but(
        self,
        *,
        folder: Path | None = None,
        seed: int | None = None,
        evaluations: int | None = None,
        profile: list[str] | None = None,
    ) -> Plan:
        """A copy in which what is not None replaces what the file says; `profile` takes names and patterns."""
        profiled = self.profile
        if profile:
            problems = Problems("--profile")
            profiled = build.profiled(profile, self.study.parameters, (), problems)
            problems.stop()
        return replace(
            self,
            folder=self.folder if folder is None else folder,
            seed=self.seed if seed is None else seed,
            budget=solver.but(self.budget, evaluations),
            profile=profiled,
        )


def load_study(path: str | Path) -> Study:
    """The study that a file describes: model, prepared trials, parameters and how they are compared."""
    return read_plan(path).study


def read_plan(path: str | Path) -> Plan:
    """A study file with everything it says. Raises BadInput that lists all problems with their lines."""
    source = Path(path)
    file, problems = parse(read_text(source), str(source))
    name = file.study.name or source.stem
    optimizer = solver.optimizer(file.optimizer, problems)
    budget = solver.budget(file.budget, problems)
    study = build.study(file, source, name, problems)
    profile = build.profiled(file.output.profile, study.parameters if study else (), ("output", "profile"), problems)
    problems.stop()
    assert study is not None  # otherwise there was a problem
    assert optimizer is not None
    folder = source.parent / (file.output.folder or f"{source.stem}-result")
    return Plan(
        study=study,
        optimizer=optimizer,
        budget=budget,
        seed=file.study.seed,
        folder=folder,
        report=file.output.report,
        cross_validate=file.output.cross_validate,
        profile=profile,
        source=source,
    )


def parse(text: str, source: str = "the study file") -> tuple[StudyFile, Problems]:
    """A study file's text checked against the schema, and the collector for what is found later.

    Raises BadInput that lists every problem with its line.
    """
    data, problems = parsed(text, source)
    try:
        file = StudyFile.model_validate(data)
    except ValidationError as error:
        add_schema_errors(problems, error)
        problems.stop()
        raise BadInput("it does not fit the schema", where=source) from None
    return file, problems


def parsed(text: str, source: str) -> tuple[dict[str, Any], Problems]:
    """A TOML text as tables, and the collector of problems that knows its lines. Raises BadInput where it is none."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise _toml_problem(problem, text, source) from None
    except RecursionError:
        raise BadInput("it is nested too deeply", where=source, do="Write it flatter.") from None
    return data, Problems(source, Lines(text))


def _toml_problem(problem: tomllib.TOMLDecodeError, text: str, source: str) -> BadInput:
    """The TOML reader's message with the line and column where a message of ours has them."""
    what, _, place = str(problem).removesuffix(")").rpartition(" (at ")
    if not what:
        what, place = str(problem), ""
    if place == "end of document":
        place = f"line {len(text.rstrip().splitlines())}, at its end"
    return BadInput(
        f"it is not valid TOML: {what[:1].lower()}{what[1:]}",
        where=f"{source}, {place}" if place else source,
        do="Texts need quotes; a table is [name].",
    )


def read_text(path: str | Path) -> str:
    """The text of a study file; BadInput where there is none."""
    file = Path(path)
    try:
        if file.is_dir():
            raise BadInput("it is a folder", where=str(file), do="Name the study file in it.")
        data = file.read_bytes()
    except FileNotFoundError:
        raise BadInput("no such study file", where=str(file), do=_siblings(file)) from None
    except (OSError, ValueError) as problem:
        raise BadInput(f"it cannot be read ({problem})", where=str(file), do="Check the path.") from None
    if not data.strip():
        raise BadInput("the study file is empty", where=str(file), do="`seatruth init LOG.csv` writes one.")
    if len(data) > _LARGEST:
        raise BadInput(f"it has {len(data)} bytes, too many for a study file", where=str(file), do="Check the path.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise BadInput("it is not UTF-8 text", where=f"{file}, line {line}", do="Save it as UTF-8.") from None


def _siblings(file: Path) -> str:
    try:
        beside = sorted(entry.name for entry in file.parent.glob("*.toml"))[:10]
    except OSError:
        beside = []
    return f"Study files there: {', '.join(beside)}." if beside else "`seatruth init LOG.csv` writes one."
