"""`seatruth predict STUDY.toml`: figures of manoeuvres that an estimate predicts, with intervals."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, own_folder, result_folder, say, table
from seatruth.commands.progress import ProgressLine, load_study
from seatruth.errors import BadInput

if TYPE_CHECKING:
    from seatruth.manoeuvres import Manoeuvre
    from seatruth.manoeuvres.plans import By
    from seatruth.prediction import Predictions
    from seatruth.study import Study

REPORT = "report.html"
_MOST_FINDINGS = 6


def predict(
    study: StudyPath,
    result: Annotated[
        Path | None, typer.Option("--result", metavar="DIR", help="Folder of the identification [the study's].")
    ] = None,
    turn: Annotated[
        list[str] | None,
        typer.Option("--turn", metavar="DEG", help="Turning circle; negative to port; 20% by thrust. Repeatable."),
    ] = None,
    zigzag: Annotated[
        list[str] | None,
        typer.Option(
            "--zigzag",
            metavar="RUDDER/HEADING",
            help="Zigzag, deg; -10/10 begins to port; 20%/20 by thrust. Repeatable.",
        ),
    ] = None,
    stop: Annotated[
        list[str] | None,
        typer.Option("--stop", metavar="REV/S", help="Crash stop with these revolutions. Repeatable."),
    ] = None,
    spiral: Annotated[
        list[str] | None,
        typer.Option(
            "--spiral", metavar="MOST/STEP/HOLD", help="Direct spiral: deg, deg, s; 20%/5%/60 by thrust. Repeatable."
        ),
    ] = None,
    trials_only: Annotated[
        bool, typer.Option("--trials-only", help="No manoeuvres but those that the trials hold.")
    ] = False,
    speed: Annotated[
        float | None, typer.Option("--speed", help="Approach speed, m/s; negative astern [that of the trials].")
    ] = None,
    given: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="NAME=VALUE", help="An input that is not steered, in SI [n: self-propulsion]."),
    ] = None,
    rudder_rate: Annotated[
        float | None, typer.Option("--rudder-rate", help="Rate of the rudder, deg/s [that of the trials].")
    ] = None,
    scale: Annotated[
        float, typer.Option("--scale", help="Length of the ship over that of the model: figures at full scale.")
    ] = 1.0,
    form_error: Annotated[
        float | None,
        typer.Option("--form-error", help="Error of the model's form beyond the trials, % of each figure [3.5]."),
    ] = None,
    level: Annotated[float, typer.Option("--level", help="Probability of the intervals.")] = 0.95,
    draws: Annotated[int | None, typer.Option("--draws", help="Draws of the parameters [400].")] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Replaces the study's seed.")] = None,
    limit: Annotated[
        float | None, typer.Option("--limit", help="Time after which a manoeuvre ends, s [5 times the longest trial].")
    ] = None,
    keep_environment: Annotated[
        bool, typer.Option("--keep-environment", help="Keep the model's current, wind and so on.")
    ] = False,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder of the report and tables.")] = None,
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Predict advance, overshoots and so on, with intervals. Measured figures stand beside the predicted ones."""
    from seatruth import prediction
    from seatruth.estimate import Estimate

    plans = _plans(turn or [], zigzag or [], stop or [], spiral or [])
    inputs = _inputs(given or [])
    loaded = load_study(study, quiet=quiet)
    own = result_folder(result, loaded.output.folder or Path(f"{loaded.name}-result"), loaded.source)
    if not own.exists():
        raise BadInput(
            "there is no result to predict from",
            where=str(own),
            do=f"First: seatruth identify {study}. A result elsewhere: --result DIR.",
        )
    estimate = Estimate.load(own)
    folder = result_folder(out, study.parent / f"{study.stem}-prediction", study)
    with ProgressLine(quiet=quiet) as progress:
        found = prediction.predict(
            loaded,
            estimate,
            () if trials_only else plans or None,
            speed=speed,
            inputs=inputs,
            rudder_rate_limit=None if rudder_rate is None else math.radians(rudder_rate),
            level=level,
            draws=prediction.DRAWS if draws is None else draws,
            seed=seed,
            scale=scale,
            calm=not keep_environment,
            form_error=prediction.FORM_ERROR if form_error is None else 0.01 * form_error,
            limit=limit,
            threads=threads,
            progress=progress,
        )
        if found.figures.empty and found.measured.empty:
            raise _nothing_found(loaded, str(study))
        progress.show("Writing the report", now=False)
        with own_folder(folder):
            report = _write(found, folder)
    show(found)
    say(f"Report: {report}", whole=True)
    return Result({**summary(found), "folder": str(folder), "report": str(report)})


def _nothing_found(study: Study, where: str) -> BadInput:
    """Why there is nothing to compare: an empty report would hide it."""
    from seatruth.manoeuvres.in_a_model import not_recorded, not_understood

    kinds: set[str] = set()
    for trial in (*study.trials, *study.holdout):
        kinds |= {*not_recorded(trial, study.model), *not_understood(trial, study.model)}
    return BadInput(
        f"the trials hold no turning circle, zigzag or stop that is recognised. {' '.join(sorted(kinds))}".strip(),
        where=where,
        do="Leave out --trials-only, or ask for manoeuvres: --turn 35 --zigzag 20/20. `seatruth trials LOG --study` "
        "shows what is found in a log.",
    )


def _write(found: Predictions, folder: Path) -> Path:
    from seatruth.report.prediction import write_prediction_report
    from seatruth.storage.atomic import write_file

    for name, frame in (("figures", found.figures), ("measured", found.measured), ("tracks", found.tracks)):
        write_file(folder / f"{name}.csv", frame.to_csv(index=False, lineterminator="\n"))
    report = folder / REPORT
    write_prediction_report(found, report)
    return report


def summary(found: Predictions) -> dict[str, Any]:
    """The prediction as `--json` gives it."""
    names = (
        "study",
        "model",
        "synthetic",
        "level",
        "draws",
        "seed",
        "scale",
        "conditions",
        "lack_of_fit",
        "model_error",
        "form_error",
    )
    return {
        **{name: getattr(found, name) for name in names},
        "figures": found.figures,
        "measured": found.measured,
        "findings": [vars(finding) for finding in found.findings],
        "provenance": found.provenance,
    }


def show(found: Predictions) -> None:
    """Prints the figures, the measured ones beside the predicted ones, and what a user should know."""
    from seatruth.report.prediction import interval_text, unit_text, value_text

    if found.synthetic:
        say("SYNTHETIC: these trials were made by a simulator.", style="bold yellow")
    if found.scale != 1.0:
        say(f"At full scale, 1 : {found.scale:g} (Froude).", style="bold")
    for label, part in found.figures.groupby("manoeuvre", sort=False):
        say(f"\n{label}", style="bold")
        rows = [
            [
                str(row["title"]),
                value_text(row["value"], row["unit"]) or str(row["why"]),
                interval_text(row),
                unit_text(row["unit"]),
                str(row["held_by"]),
            ]
            for row in part.to_dict("records")
        ]
        columns = ["figure", "value", f"{100 * found.level:g} % interval", "unit", "held by"]
        console().print(table(columns, rows, numbers=("value",)))
    known = found.measured[found.measured.measured.notna()]
    if len(known):
        say("\nMeasured in the trials, and predicted:", style="bold")
        rows = [
            [
                str(row["trial"]) + (" (held out)" if row["role"] == "holdout" else ""),
                str(row["title"]).partition(" (")[0],
                value_text(row["measured"], row["unit"]),
                value_text(row["predicted"], row["unit"]) or str(row["why"]),
                interval_text(row) + ("" if row["inside"] else " !"),
                unit_text(row["unit"]),
            ]
            for row in known.to_dict("records")
        ]
        columns = ["trial", "figure", "measured", "predicted", "interval", "unit"]
        console().print(table(columns, rows, numbers=("measured", "predicted")))
        say("! the measured figure lies outside")
    say("")
    for finding in found.findings[:_MOST_FINDINGS]:
        say(str(finding), style="yellow" if finding.severity == "warning" else "")


def _plans(turns: list[str], zigzags: list[str], stops: list[str], spirals: list[str]) -> list[Manoeuvre]:
    from seatruth.manoeuvres import CrashStop, Spiral, TurningCircle, Zigzag

    plans: list[Manoeuvre] = []
    for word in turns:
        words, by = _steering("--turn", word, 1)
        (angle,) = _numbers("--turn", words, 1, "35")
        plans.append(TurningCircle(_level("--turn", angle, by), by=by))
    for word in zigzags:
        words, by = _steering("--zigzag", word, 1)
        rudder, heading = _numbers("--zigzag", words, 2, "20/20")
        size, change = abs(_level("--zigzag", rudder, by)), math.radians(abs(_angle("--zigzag", heading)))
        plans.append(Zigzag(size, change, "port" if rudder < 0 else "starboard", by=by))
    for word in stops:
        (revolutions,) = _numbers("--stop", word, 1, "-8")
        plans.append(CrashStop(revolutions))
    for word in spirals:
        words, by = _steering("--spiral", word, 2)
        most, step, hold = _numbers("--spiral", words, 3, "20/5/120")
        if not 0 < _level("--spiral", step, by) <= _level("--spiral", most, by):
            unit = "%" if by == "thrust" else "deg"
            raise BadInput(
                f"steps of {step:g} {unit} do not reach {most:g} {unit}", where="--spiral", do="As 20/5/120."
            )
        count = math.floor(most / step)
        down = [_level("--spiral", step, by) * k for k in range(count, -count - 1, -1)]
        plans.append(Spiral((*down, *down[-2::-1]), hold, by))
    return plans


def _steering(option: str, word: str, count: int) -> tuple[str, By]:
    """The word without its signs of per cent, and what steers: thrust where its first `count` numbers have them."""
    parts = [part.strip() for part in word.split("/")]
    marked = [part.endswith("%") for part in parts]
    if not any(marked):
        return word, "rudder"
    if marked != [k < count for k in range(len(parts))]:
        do = {"--turn": "20%", "--zigzag": "20%/20", "--spiral": "20%/5%/60"}[option]
        raise BadInput(f"{word!r} is not of the form {do}", where=option, do=f"Write {option} {do}.")
    return "/".join(part.removesuffix("%") for part in parts), "thrust"


def _level(option: str, number: float, by: By) -> float:
    """Degrees of rudder as rad, or per cent of full thrust as a share."""
    if by == "rudder":
        return math.radians(_angle(option, number))
    if not 0 < abs(number) <= 100:
        raise BadInput(f"{number:g} % is no such share of full thrust", where=option, do="Give up to 100 %, not zero.")
    return 0.01 * number


def _numbers(option: str, word: str, count: int, example: str) -> list[float]:
    parts = word.split("/")
    try:
        found = [float(part) for part in parts]
    except ValueError:
        found = []
    if len(found) != count or not all(map(math.isfinite, found)):
        raise BadInput(f"{word!r} is not of the form {example}", where=option, do=f"Write {option} {example}.")
    return found


def _angle(option: str, degrees: float) -> float:
    if not 0 < abs(degrees) <= 90:
        raise BadInput(f"{degrees:g} deg is no such angle", where=option, do="Give degrees up to 90, not zero.")
    return degrees


def _inputs(words: list[str]) -> dict[str, float]:
    found = {}
    for word in words:
        name, equals, value = word.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals or not math.isfinite(found[name.strip()]):
            raise BadInput(f"{word!r} is not of the form NAME=VALUE", where="--input", do="Write --input n=10.4.")
    return found
