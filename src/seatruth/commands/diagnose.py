"""`seatruth diagnose STUDY.toml`: where model and trials disagree, which effect causes it, how far the gap shrinks."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, say, table
from seatruth.commands.identify import names
from seatruth.commands.progress import ProgressLine
from seatruth.errors import BadInput, nearest
from seatruth.storage.atomic import CannotWrite, write_file
from seatruth.study import Study, load_study

if TYPE_CHECKING:
    from seatruth.diagnosis import Diagnosis
    from seatruth.effects import Effect

AUGMENTED = "augmented.toml"
REPORT = "report.html"
_ANSWERS = 6
_LEAST = 0.005
"""Probability below which an answer is not shown in the terminal."""
_FINDINGS = 6


def diagnose(
    study: StudyPath,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder of the result.")] = None,
    effects: Annotated[
        str | None,
        typer.Option(
            "--effects",
            metavar="NAMES",
            help='Effects that take part, comma-separated; * is a wildcard, your own is "file.py:Class" [all].',
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Replaces the study's seed.")] = None,
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    no_left_out: Annotated[
        bool, typer.Option("--no-left-out", help="Do not predict each trial from the others.")
    ] = False,
    no_next_trial: Annotated[bool, typer.Option("--no-next-trial", help="Do not look for the next trial.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Find the effect that a model lacks. Says where, which, how far the gap shrinks, and what to try next."""
    folder = out if out is not None else study.parent / f"{study.stem}-diagnosis"
    return run(
        load_study(study),
        folder,
        names(effects),
        seed=seed,
        threads=threads,
        left_out=not no_left_out,
        suggest=not no_next_trial,
        quiet=quiet,
    )


def run(
    study: Study,
    folder: Path,
    effects: list[str] | None = None,
    *,
    seed: int | None = None,
    threads: int | None = None,
    left_out: bool = True,
    suggest: bool = True,
    quiet: bool = False,
) -> Result:
    """Diagnoses, saves, reports and shows a study. `effects` are names, patterns and files; all installed if empty."""
    from seatruth.diagnosis import diagnose as diagnose_study
    from seatruth.report import write_report

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        what = "a file stands where the results' folder should be"
        do = "Name another folder with --out, or move the file."
        raise BadInput(what, where=str(folder), do=do) from None
    place = study.source.parent if study.source is not None else Path.cwd()
    chosen, specs = _effects(effects or [], place)
    with ProgressLine(quiet=quiet) as progress:
        diagnosis = diagnose_study(
            study,
            chosen,
            seed=seed,
            threads=threads,
            progress=progress,
            left_out=left_out,
            suggest=suggest,
        )
        progress.show("Writing the result", now=False)
        try:
            diagnosis.save(folder)
            report = folder / REPORT
            write_report(diagnosis, report)
            written = _augmented(diagnosis, study, folder, specs)
        except CannotWrite:
            # What was found is on the screen at least.
            progress.__exit__(None, None, None)
            show(diagnosis)
            raise
    show(diagnosis)
    lines = [f"Result: {folder}", f"Report: {report}"]
    if written is not None:
        lines.append(f"The model with what was found, to simulate and identify with: {written}")
    for line in lines:
        say(line, whole=True)
    code = str(diagnosis.outcome["code"])
    if code == "interrupted":
        say("Interrupted: this is what was found so far.", style="yellow")
    data = {**diagnosis.content(), "folder": folder, "report": report, "augmented_study": written}
    return Result(data, 130 if code == "interrupted" else 0)


def _effects(wanted: list[str], folder: Path) -> tuple[list[Effect] | None, dict[str, str]]:
    """The effects that are asked for (None for all), and how a study file calls each."""
    from seatruth.effects import available, load_effects
    from seatruth.models.user_file import is_file

    if not wanted:
        return None, {}
    known = available()
    found: dict[str, Effect] = {}
    specs: dict[str, str] = {}
    for spec in wanted:
        if is_file(spec):
            effect = load_effects([spec], folder)[0]
            found[effect.name], specs[effect.name] = effect, spec
            continue
        taken = [name for name in known if fnmatch.fnmatchcase(name, spec)]
        if not taken:
            raise BadInput(f"there is no effect {spec!r}", where="--effects", do=nearest(spec, known))
        for name in taken:
            found.setdefault(name, known[name])
    return list(found.values()), specs


def _augmented(diagnosis: Diagnosis, study: Study, folder: Path, specs: Mapping[str, str]) -> Path | None:
    """Writes the study file with the named effects and the identified values; None where the study has no file."""
    from seatruth.study.augment import augmented

    if study.source is None:
        return None
    free = {p.name for p in study.parameters if p.vary}
    priors = diagnosis.priors
    values = {
        name: value for name, value in diagnosis.augmented["parameters"].items() if name in free or name in priors
    }
    called = {name: specs.get(name, name) for name in diagnosis.augmented["effects"]}
    text = augmented(study.source, folder, f"{diagnosis.study} augmented", called, values, priors)
    path = folder / AUGMENTED
    write_file(path, text)
    return path


def show(diagnosis: Diagnosis) -> None:
    """The diagnosis in the terminal: the verdict, the gap, which, where, how far, the next trial, the findings."""
    from seatruth.report.diagnosis import words

    if diagnosis.synthetic:
        say("SYNTHETIC: these trials were made by a simulator.", style="bold yellow")
    first = words.data_first(diagnosis)
    if first:
        say(f"! {first}", style="bold red")
    say(words.verdict_in_words(diagnosis), style="bold")
    outcome = diagnosis.outcome
    say(f"{len(diagnosis.effects)} effects took part, {outcome['fits']} fits, {outcome['wall_s']:.0f} s\n")
    console().print(_gap(diagnosis))
    say(f"{words.gap_in_words(diagnosis)}\n")
    console().print(_which(diagnosis))
    weak = words.weak_in_words(diagnosis)
    if weak:
        say(f"! {weak}", style="yellow")
    say("")
    for title, text in (
        ("Where", words.where_in_words(diagnosis)),
        ("How far", words.how_far_in_words(diagnosis)),
        ("Next trial", words.next_in_words(diagnosis)),
    ):
        say(f"{title}: {text}")
    unnamed = diagnosis.unnamed
    wanted = diagnosis.verdict["kind"] == "unknown" or diagnosis.verdict["beside"]
    if wanted and unnamed is not None and unnamed["formula"]:
        say(f"What is missing, as a formula: {words.formula_in_words(unnamed)}")
    grave = [f for wanted in ("error", "warning") for f in diagnosis.findings if f.severity == wanted]
    for finding in grave[:_FINDINGS]:
        say(str(finding), style="yellow")
    if len(grave) > _FINDINGS:
        say(f"and {len(grave) - _FINDINGS} more findings: see the report.")
    say("")


def _gap(diagnosis: Diagnosis) -> Any:
    from seatruth.report.diagnosis.words import channels

    fits = ("before", "refit", "effect") if diagnosis.augmented["effects"] else ("before", "refit")
    rows = []
    for row in channels(diagnosis):
        scale = row["shown"]
        sizes = [_number(row[key] * scale.factor) for key in ("noise", *(f"rmse_{f}" for f in fits))]
        multiples = [_number(row[f"multiple_{fit}"], 2) for fit in fits]
        rows.append([row["channel"], scale.unit, *sizes, *multiples])
    heads = ["before", "refitted", "with effects"][: len(fits)]
    # A blank sets the second group of names apart from the first: each column has one of its own.
    columns = ["channel", "unit", "noise", *heads, "× noise", *(f"{head} " for head in heads[1:])]
    return table(columns, rows, numbers=columns[2:])


def _which(diagnosis: Diagnosis) -> Any:
    from seatruth.report.diagnosis.words import in_titles, parameters_in_words

    by_name = {row["name"]: row for row in diagnosis.which}
    rows: list[list[str]] = []
    for candidate in diagnosis.candidates[:_ANSWERS]:
        if rows and candidate["probability"] < _LEAST:
            break
        effects = candidate["effects"]
        sizes = parameters_in_words(by_name[effects[0]]) if len(effects) == 1 and effects[0] in by_name else ""
        rows.append([f"{candidate['probability']:.1%}", in_titles(diagnosis, effects), sizes])
    return table(["probability", "answer", "magnitude"], rows, numbers=("probability",))


def _number(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else ""
