"""From a study file to a study: what the file says is what runs.

    study = load_study("study.toml")
    estimate = identify(study)

Reading a study file never runs anything but the model file that it names. Everything wrong with it is said in one
message, each problem with its line.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from seatruth.errors import BadInput
from seatruth.progress import Progress, silent
from seatruth.storage.regular import read_regular
from seatruth.study import build, solver
from seatruth.study.schema import StudyFile
from seatruth.study.study import OutputSettings, Study
from seatruth.study.toml_positions import Lines
from seatruth.study.validation import Problems, add_schema_errors

_LARGEST = 4_000_000
"""Bytes; a study file is written by hand, so anything larger is another kind of file."""
_LONG_KEY = re.compile(r"""(?<![\w"'.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){32}""")
"""A dotted key of more parts than any table has: the TOML reader takes memory with the square of their number."""


def load_study(path: str | Path, *, progress: Progress = silent) -> Study:
    """Reads a study file.

    Args:
        path: the TOML file; the files that it names are relative to its folder.
        progress: is told how far the reading of the logs has come.

    Returns:
        The study: model, prepared trials, parameters, noise and cost, and the optimizer, budget, seed and output
        settings with which `identify` runs it.

    Raises:
        BadInput: the file or anything that it names is wrong; the message lists all problems with their lines.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import load_study
        >>> study = load_study(seatruth.sample.FOLDER / "study.toml")
        >>> study.optimizer.name, study.budget.evaluations, study.seed
        ('least_squares', 20000, 1)
    """
    source = Path(path)
    return study_from(read_text(source), source, progress)


def study_from(text: str, source: Path, progress: Progress = silent) -> Study:
    """The study that a study file's text describes; `source` is its path, to which files in it are relative.

    Raises:
        BadInput: see `load_study`.
    """
    file, problems = parse(text, str(source))
    name = file.study.name or source.stem
    optimizer = solver.optimizer(file.optimizer, problems)
    starts = solver.starts(file.optimizer, problems)
    budget = solver.budget(file.budget, problems)
    study = build.study(file, source, name, problems, progress)
    profile = build.profiled(file.output.profile, study.parameters if study else (), ("output", "profile"), problems)
    problems.stop()
    assert study is not None  # otherwise there was a problem
    assert optimizer is not None
    output = OutputSettings(
        folder=source.parent / (file.output.folder or f"{source.stem}-result"),
        report=file.output.report,
        cross_validate=file.output.cross_validate,
        profile=profile,
        posterior=file.output.posterior,
        posterior_steps=file.output.posterior_steps,
    )
    return study.replace(
        optimizer=optimizer,
        starts=starts,
        budget=budget,
        diagnosis_budget=file.budget.diagnosis,
        seed=file.study.seed,
        output=output,
        source=source,
    )


def profile_names(patterns: list[str], study: Study) -> tuple[str, ...]:
    """The free parameters that names and patterns (`*`, `?`) match. Raises BadInput for one that matches none."""
    problems = Problems("--profile")
    names = build.profiled(patterns, study.parameters, (), problems)
    problems.stop()
    return names


def parse(text: str, source: str = "the study file") -> tuple[StudyFile, Problems]:
    """A study file's text checked against the schema, and the collector of later problems.

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
    long = _LONG_KEY.search(text)
    if long:
        line = text.count("\n", 0, long.start()) + 1
        raise BadInput(
            "a key has too many parts", where=f"{source}, line {line}", do="A key has at most three or four."
        )
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise _toml_problem(problem, text, source) from None
    except RecursionError:
        raise BadInput("it is nested too deeply", where=source, do="Write it flatter.") from None
    except ValueError:  # Python reads no whole number of more than some thousand digits
        raise BadInput("it holds a number of too many digits", where=source, do="Write it with fewer.") from None
    return data, Problems(source, Lines(text))


def _toml_problem(problem: tomllib.TOMLDecodeError, text: str, source: str) -> BadInput:
    """The TOML reader's message with the line and column where a message of ours has them."""
    what, _, place = str(problem).removesuffix(")").rpartition(" (at ")
    if not what:
        what, place = str(problem), ""
    if place == "end of document":
        place = f"line {len(text.rstrip().splitlines())}, at its end"
    number = re.match(r"line (\d+)", place)
    if number and what.startswith(_TWICE):
        return _twice(text.splitlines()[: int(number[1])], f"{source}, {place}")
    return BadInput(
        f"it is not valid TOML: {what[:1].lower()}{what[1:]}",
        where=f"{source}, {place}" if place else source,
        do="Texts need quotes; a table is [name].",
    )


_TWICE = ("Cannot overwrite a value", "Cannot declare", "Cannot redefine namespace")
"""How the TOML reader begins what it says of a key or a table that stands twice."""
_KEY = re.compile(r"""\s*([\w.-]+|"[^"]*"|'[^']*')\s*=""")


def _twice(lines: list[str], where: str) -> BadInput:
    """A key or a table that stands twice; the last one of the lines holds the second."""
    last, others = lines[-1].strip(), list(enumerate(lines[:-1], 1))
    key = _KEY.match(last)
    if key is None:
        same = [number for number, line in others if last.startswith("[") and line.partition("#")[0].strip() == last]
        first = f" (line {same[-1]} begins it)" if same else ""
        return BadInput(f"a table stands twice{first}", where=where, do="Put what it holds under one [name].")
    begun = max((number for number, line in others if line.lstrip().startswith("[")), default=0)
    same = [n for n, line in others if n > begun and (found := _KEY.match(line)) and found[1] == key[1]]
    table = lines[begun - 1].partition("#")[0].strip() if begun else ""
    first = f" (line {same[-1]} is the other)" if same else ""
    return BadInput(
        f"the key {key[1].strip(chr(34))!r} stands twice{f' in {table}' if table else ''}{first}",
        where=where,
        do="Remove one; or, if it belongs to another table, write that [name] above it, without a # before it.",
    )


def read_text(path: str | Path) -> str:
    """The text of a study file; BadInput where there is none."""
    file = Path(path)
    try:
        data = read_regular(file, _LARGEST)
    except IsADirectoryError:
        raise BadInput("it is a folder", where=str(file), do="Name the study file in it.") from None
    except FileNotFoundError:
        raise BadInput("no such study file", where=str(file), do=_siblings(file)) from None
    except OSError as problem:
        raise BadInput(f"it cannot be read ({problem.strerror})", where=str(file), do="Check the path.") from None
    if not data.strip():
        raise BadInput("the study file is empty", where=str(file), do="`seatruth init LOG.csv` writes one.")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        line = data.count(b"\n", 0, problem.start) + 1
        raise BadInput("it is not UTF-8 text", where=f"{file}, line {line}", do="Save it as UTF-8.") from None


def _siblings(file: Path) -> str:
    try:
        siblings = sorted(entry.name for entry in file.parent.glob("*.toml"))[:10]
    except OSError:
        siblings = []
    return f"Study files there: {', '.join(siblings)}." if siblings else "`seatruth init LOG.csv` writes one."
