"""`seatruth check STUDY.toml`: what is wrong with the study and its data, and what the log can move, before any fit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer
from threadpoolctl import threadpool_limits

from seatruth.commands.common import JsonFile, Result, StudyPath, console, say, table
from seatruth.commands.cost_notice import say_cost
from seatruth.commands.progress import load_study
from seatruth.commands.simulate import missed_angle, misses
from seatruth.errors import BadInput
from seatruth.study import Study
from seatruth.text import listed
from seatruth.trials.finding import Finding, gravest_first

if TYPE_CHECKING:
    import pandas as pd

_STYLES = {"error": "bold red", "warning": "yellow", "note": ""}
_CLEAN = "No fault of times, units, signs or columns is found. Biases of sensors are left to `seatruth diagnose`."
_CLEAN_BUT_SIGNS = (
    "No fault of times, units or columns is found. Signs of the drives are checked without --no-preview alone; biases "
    "of sensors are left to `seatruth diagnose`."
)
_CLEAN_TABLE = "No fault of the table is found."


def check(
    study: StudyPath,
    preview: Annotated[
        bool,
        typer.Option("--preview/--no-preview", help="Also say what the trials can move, and what can be diagnosed."),
    ] = True,
    effects: Annotated[bool, typer.Option("--effects", help="Also list the effects that a diagnosis can try.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """List the faults of a study and its data."""
    from seatruth.analysis import check_study
    from seatruth.uncertainty.reversed_inputs import reversed_inputs

    loaded = load_study(study)
    trials = [*loaded.trials, *loaded.holdout]
    if loaded.cost.kind == "formula":
        console().print(table(["table", "rows"], [[t.name, str(len(t))] for t in trials], numbers=("rows",)))
    else:
        rows = [[trial.name, str(len(trial)), f"{trial.duration:.1f}", _steps(trial.steps)] for trial in trials]
        console().print(table(["trial", "samples", "seconds", "steps"], rows, numbers=("samples", "seconds")))
    # The matrices are small: more threads of the linear algebra would only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        findings = check_study(loaded)
        if preview and not any(finding.severity == "error" for finding in findings):
            findings = gravest_first([*findings, *reversed_inputs(loaded)])
        clean = _CLEAN if preview else _CLEAN_BUT_SIGNS
        _show(findings, _CLEAN_TABLE if loaded.cost.kind == "formula" else clean)
        errors = sum(finding.severity == "error" for finding in findings)
        moved, usable, lacks = None, None, None
        if preview and not errors:
            moved = _preview(loaded)
            usable, lacks = _effects(loaded, in_full=effects)
        elif preview:
            say("\nThe preview of what the trials can move is left out until the errors are put right.")
        cost = [] if errors else say_cost(loaded, None)
    data = {
        "trials": [
            {"name": t.name, "samples": len(t), "duration_s": t.duration, "source": t.source, "steps": _steps(t.steps)}
            for t in trials
        ],
        "findings": [vars(finding) for finding in findings],
        "errors": errors,
        "preview": moved,
        "effects": usable,
        "effects_lacking": lacks,
        "cost": cost,
        "reasons": [] if moved is None else moved.attrs["reasons"],
    }
    return Result(data, 1 if errors else 0)


def _effects(study: Study, *, in_full: bool) -> tuple[list[str], dict[str, list[str]]]:
    """Effects that a diagnosis can try, and those that it cannot for want of something in the model, by that reason."""
    from seatruth.diagnosis.preconditions import usable_effects
    from seatruth.effects.lacking import lacking

    if study.cost.kind == "formula":
        return [], {}
    try:
        usable, _ = usable_effects(study, None)
    except BadInput:  # what keeps all of them is said below
        usable = []
    found = lacking(study.model)
    say(f"\nA diagnosis of this study can try {len(usable)} effects{':' if in_full else '; --effects lists them.'}")
    if in_full:
        console().print(table(["effect", "title"], [[effect.name, effect.title] for effect in usable]))
        if any(effect.which for effect in usable):
            say("Other faults of a single actuator join the search where one of its faults leads.")
    if found:
        say("Effects that it cannot try, and why:")
    for reason, names in found.items():
        say(f"- {listed(names, len(names))}: {reason}")
    return [effect.name for effect in usable], found


def _steps(steps: Sequence[Any]) -> str:
    return ", ".join(step.name for step in steps)


def _show(findings: Sequence[Finding], clean: str) -> None:
    if not findings:
        say(f"\n{clean}")
        return
    counts = {kind: sum(finding.severity == kind for finding in findings) for kind in _STYLES}
    say("\n" + ", ".join(f"{count} {kind}{'s' if count > 1 else ''}" for kind, count in counts.items() if count))
    for first, *others in _alike(findings):
        places = list(dict.fromkeys(repr(other.trial) for other in others if other.trial != first.trial))
        also = f" Also in {listed(places)}." if places else ""
        say(f"{_of_channels(first, others)}{also}", style=_STYLES[first.severity])


def _of_channels(first: Finding, others: Sequence[Finding]) -> str:
    """A finding in words, with all channels of its trial of which the same is said."""
    names = [first.channel, *(other.channel for other in others if other.trial == first.trial)]
    if len(names) == 1:
        return str(first)
    return str(first).replace(f"channel {first.channel!r}", f"channels {listed([repr(name) for name in names])}", 1)


def _alike(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Findings of one kind about one channel, a trial each, together: all logs of a logger have the same faults."""
    groups: dict[tuple[object, ...], list[Finding]] = {}
    before = Counter[tuple[object, ...]]()
    for number, finding in enumerate(findings):
        key: tuple[object, ...] = (finding.severity, finding.code, finding.channel) if finding.trial else (number,)
        # The first of each trial together, then the second ones: what one logger does twice it does twice in all.
        groups.setdefault((*key, before[*key, finding.trial]), []).append(finding)
        before[*key, finding.trial] += 1
    # One drop-out of a receiver is missing in all that it gives.
    together: dict[tuple[object, ...], list[Finding]] = {}
    for number, same in enumerate(groups.values()):
        first = same[0]
        said = (first.code, first.message, *(one.trial for one in same)) if first.channel else (number,)
        together.setdefault(said, []).extend(same)
    return list(together.values())


def _preview(study: Study) -> pd.DataFrame:
    """Which parameters the trials can move, from the model's sensitivities at the start values."""
    from seatruth.costs.growth import too_far
    from seatruth.uncertainty import prior_identifiability
    from seatruth.uncertainty.identifiability import verdicts_in_words

    frame = prior_identifiability(study)
    stated = [study.noise.get(channel.name, "estimate") != "estimate" for channel in study.model.outputs]
    noise = "the stated noise" if all(stated) else "the noise that their misfit shows"
    if any(stated) and not all(stated):
        noise = f"the stated noise, else {noise}"
    priors = sum(parameter.prior is not None for parameter in study.free)
    known = f", with the priors of {priors} of {len(study.free)} parameters" if priors else ""
    say(f"\nWhat the trials can move, at the start values and {noise}{known}:")
    if frame.attrs["fault"]:
        say(f"nothing. {frame.attrs['fault']}")
        return frame
    rows = [
        [str(name), f"{row['value']:.4g}", f"{row['crlb']:.2g}", str(row["verdict"])] for name, row in frame.iterrows()
    ]
    console().print(table(["parameter", "value", "best std. error", "verdict"], rows, numbers=("value",)))
    if missed := missed_angle(misses(study, study.simulate())):
        # Of an ROV that misses its heading by three turns a pull of 235 N was "identified" to 0.03 N.
        grown = too_far(study)
        say(
            f"At the start values {missed}: the standard errors above hold there, and not where a fit ends. "
            + (
                f"No values may follow whole trials: {grown}, as of a vehicle that a pilot or an autopilot holds. For "
                f"`seatruth identify` set `segments = {grown.seconds:.2g}` in [cost]; `seatruth diagnose` cuts trials "
                "by itself."
                if grown
                else "Check again with values that follow the trials."
            )
        )
    else:
        say(verdicts_in_words(dict(frame["verdict"])))
        say(
            "A best std. error is a bound, for a model that is right in all else and noise that is white. Where a "
            "small error adds up over a run, as a moment does in a heading, a real error can be a hundred times larger."
        )
    if frame.attrs["reasons"]:
        say("\nWhat these trials do not tell apart:")
        for reason in frame.attrs["reasons"]:
            say(f"- {reason}")
    return frame
