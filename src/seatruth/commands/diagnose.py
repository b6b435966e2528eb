"""`seatruth diagnose STUDY.toml`: where model and trials disagree, which effect causes it, how far the gap shrinks."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, result_folder, say, table
from seatruth.commands.cost_notice import say_cost
from seatruth.commands.identify import names
from seatruth.commands.progress import load_study
from seatruth.commands.resumable import resumable
from seatruth.errors import BadInput, nearest
from seatruth.study import Study

if TYPE_CHECKING:
    from rich.table import Table

    from seatruth.diagnosis import Diagnosis
    from seatruth.effects import Effect
    from seatruth.models.base import Model

AUGMENTED = "augmented.toml"
CHECKPOINT = "checkpoint.jobs"
REPORT = "report.html"
_MOST_ANSWERS = 6
_LEAST_PROBABILITY = 0.005
"""Answers that are less probable are not shown in the terminal. Chosen here [S]."""
_MOST_FINDINGS = 6


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
    evaluations: Annotated[
        int | None,
        typer.Option("--evaluations", min=1, help="Simulations that a black box may take, instead of the study's."),
    ] = None,
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Effects that are fitted at once.")] = 1,
    no_validation: Annotated[
        bool, typer.Option("--no-validation", help="Leave no trials out, unless the decision must.")
    ] = False,
    no_next_trial: Annotated[bool, typer.Option("--no-next-trial", help="Do not look for the next trial.")] = False,
    fresh: Annotated[bool, typer.Option("--fresh", help="Do not go on with an interrupted run.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Find the effect that a model lacks. Says where, which, how far the gap shrinks, and what to try next."""
    folder = result_folder(out, study.parent / f"{study.stem}-diagnosis", study)
    return run(
        load_study(study, quiet=quiet),
        folder,
        names(effects),
        seed=seed,
        evaluations=evaluations,
        threads=threads,
        workers=workers,
        validate=not no_validation,
        suggest=not no_next_trial,
        fresh=fresh,
        quiet=quiet,
    )


def _say_errors(study: Study, threads: int | None) -> None:
    """Says what makes any diagnosis meaningless before it takes its minutes."""
    from seatruth.diagnosis.preconditions import turned_round
    from seatruth.models.black_box import BlackBox
    from seatruth.trials.check import check_trials

    findings = check_trials(study.trials, study.model)
    if not isinstance(study.model, BlackBox):  # its runs may take minutes, and the diagnosis asks for them itself
        findings += turned_round(study, threads)
    errors = [finding for finding in findings if finding.severity == "error"]
    for number, finding in enumerate(errors):
        if finding.code not in {other.code for other in errors[:number]}:
            say(str(finding), style="bold red")
    if errors:
        say("Correct this first: a diagnosis means nothing beside it.\n")


def run(
    study: Study,
    folder: Path,
    effects: list[str] | None = None,
    *,
    seed: int | None = None,
    evaluations: int | None = None,
    threads: int | None = None,
    workers: int = 1,
    validate: bool = True,
    suggest: bool = True,
    fresh: bool = False,
    quiet: bool = False,
    before_shown: Callable[[], object] = lambda: None,
) -> Result:
    """Diagnoses, saves, reports and shows a study; goes on with an interrupted run of the same study.

    `effects` are names, patterns and files; all installed ones if empty. `before_shown` is called before the result is
    shown: what runs beside the diagnosis may show its own there.
    """
    from seatruth.diagnosis import diagnose as diagnose_study
    from seatruth.report import write_report
    from seatruth.storage.atomic import CannotWrite

    checkpoint = folder / CHECKPOINT
    place = study.source.parent if study.source is not None else Path.cwd()
    chosen, specs = select_effects(effects or [], place, study.model)
    if not quiet:
        say_cost(study, chosen, "diagnose", evaluations=evaluations, threads=threads)
        _say_errors(study, threads)
    with resumable(folder, [checkpoint], fresh=fresh, quiet=quiet) as progress:
        diagnosis = diagnose_study(
            study,
            chosen,
            seed=seed,
            evaluations=evaluations,
            threads=threads,
            workers=workers,
            progress=progress,
            checkpoint=checkpoint,
            validate=validate,
            suggest=suggest,
        )
        progress.show("Writing the result", now=False)
        try:
            diagnosis.save(folder)
            report = folder / REPORT
            write_report(diagnosis, report)
            written = write_augmented(diagnosis, study, folder, specs)
        except CannotWrite:
            # The result is on the screen at least; the same command makes the files from the checkpoint.
            progress.__exit__(None, None, None)
            before_shown()
            show(diagnosis)
            raise
        interrupted = diagnosis.outcome["code"] == "interrupted"
        if not interrupted:
            checkpoint.unlink(missing_ok=True)
    before_shown()
    show(diagnosis)
    lines = [f"Result: {folder}", f"Report: {report}"]
    if written is not None and diagnosis.augmented["effects"]:
        lines.append(f"The study with the named effects, to identify with: {written}")
    for line in lines:
        say(line, whole=True)
    if interrupted:
        say("Interrupted: this is the result so far. Run the same command again to go on.", style="yellow")
    data = {**diagnosis.content(), "folder": folder, "report": report, "augmented_study": written}
    return Result(data, 130 if interrupted else 0)


def select_effects(wanted: list[str], folder: Path, model: Model) -> tuple[list[Effect] | None, dict[str, str]]:
    """The effects that take part (None for all), and by name how a study file calls those from a file.

    A pattern means effects on all actuators of a kind; those on one alone where no other fits.
    """
    from seatruth.effects import available, available_on, load_effects
    from seatruth.models.user_file import is_file

    if not wanted:
        return None, {}
    installed, forms = available(), available_on(model)
    chosen: dict[str, Effect] = {}
    specs: dict[str, str] = {}
    for spec in wanted:
        if is_file(spec):
            effect = load_effects([spec], folder)[0]
            chosen[effect.name], specs[effect.name] = effect, spec
            continue
        matching = fnmatch.filter(installed, spec) or fnmatch.filter(forms, spec)
        if not matching:
            raise BadInput(f"there is no effect {spec!r}", where="--effects", do=nearest(spec, forms))
        for name in matching:
            chosen.setdefault(name, forms[name])
    return list(chosen.values()), specs


def write_augmented(diagnosis: Diagnosis, study: Study, folder: Path, specs: Mapping[str, str]) -> Path | None:
    """Writes the study file with the named effects at their reported values; None where the study has no file."""
    from seatruth.models.parameter import Prior
    from seatruth.storage.atomic import write_file
    from seatruth.study.augment import augmented

    if study.source is None:
        return None
    effects = [str(name) for name in diagnosis.augmented["effects"]]
    # A fit of the augmented study starts from the reported values and believes what the diagnosis believed.
    priors = {
        f"{name}_{q.name}": Prior(q.null, q.prior_sd) for name in effects for q in diagnosis.effect(name).parameters
    }
    called = {name: specs.get(name, name) for name in effects}
    values = diagnosis.augmented["parameters"]
    text = augmented(study.source, folder, f"{diagnosis.study} augmented", called, values, priors)
    path = folder / AUGMENTED
    write_file(path, text)
    return path


def show(diagnosis: Diagnosis) -> None:
    """The diagnosis in the terminal: verdict, gap, causes, answers, where, how far, next trial, findings."""
    from seatruth.report.text import diagnosis as text
    from seatruth.report.text import gap

    if diagnosis.synthetic:
        say("SYNTHETIC: these trials were made by a simulator.", style="bold yellow")
    first = text.data_first(diagnosis)
    if first:
        say(f"! {first}", style="bold red")
    say(f"{text.headline(diagnosis)}. {text.verdict_in_words(diagnosis)}", style="bold")
    outcome = diagnosis.outcome
    runs = f", {outcome['evaluations']} evaluations" if outcome.get("evaluations") else ""
    say(f"{len(diagnosis.effects)} effects took part, {outcome['fits']} fits{runs}, {outcome['wall_s']:.0f} s\n")
    console().print(_gap(diagnosis))
    say(f"{gap.gap_in_words(diagnosis)}\n")
    if diagnosis.verdict.causes:
        console().print(_causes(diagnosis))
        say("")
    console().print(_answers(diagnosis))
    beside = text.beside_answers_in_words(diagnosis)
    for sentence in (beside, text.unnamed_in_words(diagnosis)):
        if sentence:
            say(sentence)
    for warning in (text.undetectable_in_words(diagnosis), text.undeclared_in_words(diagnosis)):
        if warning:
            say(f"! {warning}", style="yellow")
    say("")
    for title, sentence in (
        ("Where", gap.where_in_words(diagnosis)),
        ("How far", text.validation_in_words(diagnosis)),
        ("Next trial", text.next_in_words(diagnosis)),
    ):
        say(f"{title}: {sentence}")
    if diagnosis.verdict.kind == "unknown" or diagnosis.verdict.discrepancy:
        for formula in text.formula_in_words(diagnosis):
            say(f"What is missing, as a formula: {formula}")
    grave = [f for severity in ("error", "warning") for f in diagnosis.findings if f.severity == severity]
    for finding in grave[:_MOST_FINDINGS]:
        say(str(finding), style="yellow")
    if len(grave) > _MOST_FINDINGS:
        say(f"and {len(grave) - _MOST_FINDINGS} more findings: see the report.")
    say("")


def _gap(diagnosis: Diagnosis) -> Table:
    from seatruth.report.text.gap import channels, fits

    compared = fits(diagnosis)
    rows = []
    for row in channels(diagnosis):
        sizes = [_number(size * row.channel.factor) for size in (row.noise, *(row.rmse[fit] for fit in compared))]
        multiples = [_number(row.multiple[fit], 2) for fit in compared]
        rows.append([row.channel.name, row.channel.unit, *sizes, *multiples])
    heads = ["before", "refitted", "effects"][: len(compared)]
    columns = ["channel", "unit", "noise", *heads, *(f"× {head}" for head in heads)]  # multiples of the noise
    return table(columns, rows, numbers=columns[2:])


def _causes(diagnosis: Diagnosis) -> Table:
    from seatruth.diagnosis.sentences import chance
    from seatruth.report.numbers import percent
    from seatruth.report.text.diagnosis import cause_size, remark, titles

    known = titles(diagnosis)
    rows = [
        [
            cause.title,
            " or ".join(known.get(name, name) for name in cause.effects),
            cause_size(diagnosis, cause),
            percent(cause.share),
            chance(cause.probability),
            remark(cause),
        ]
        for cause in sorted(diagnosis.verdict.causes, key=lambda cause: cause.small)
    ]
    columns = ["cause", "effect", "size", "share", "probability", "remark"]
    return table(columns, rows, numbers=("share", "probability"))


def _answers(diagnosis: Diagnosis) -> Table:
    from seatruth.diagnosis.sentences import chance
    from seatruth.report.text.diagnosis import in_titles

    rows: list[list[str]] = []
    for effects, probability in diagnosis.answers()[:_MOST_ANSWERS]:
        if rows and probability < _LEAST_PROBABILITY:
            break
        rows.append([chance(probability), in_titles(diagnosis, effects)])
    return table(["probability", "answer"], rows, numbers=("probability",))


def _number(value: float, digits: int = 3) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else ""
