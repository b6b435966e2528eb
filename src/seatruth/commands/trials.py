"""`seatruth trials LOG`: one file, many runs: splits a log, shows it on a map, and writes the `[[trials]]`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from seatruth.commands.common import JsonFile, Result, console, relative, say, table
from seatruth.commands.progress import ProgressLine
from seatruth.errors import BadInput
from seatruth.manoeuvres.in_a_model import not_recorded, not_understood
from seatruth.manoeuvres.recognise import SHORTEST, recognise
from seatruth.manoeuvres.steady import steady
from seatruth.models import Model
from seatruth.storage.atomic import write_file
from seatruth.storage.regular import read_regular
from seatruth.study.load import read_text
from seatruth.study.log import read_log, row_times, vehicle_of
from seatruth.study.trial_tables import trial_tables, with_trials
from seatruth.trials import Trial
from seatruth.trials.stretches import Stretch, by_column, by_events, by_pauses


class By(StrEnum):
    """How a log is split."""

    manoeuvres = "manoeuvres"
    steady = "steady"
    column = "column"
    events = "events"
    pauses = "pauses"


def trials(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A long recording that holds several runs.")],
    by: Annotated[By, typer.Option("--by", help="What tells the runs.")] = By.manoeuvres,
    column: Annotated[
        str | None, typer.Option("--column", help="Column that numbers or names the runs (with --by column).")
    ] = None,
    events: Annotated[
        str | None,
        typer.Option("--events", metavar="T1,T2,...|FILE", help="Times at which runs begin, s (with --by events)."),
    ] = None,
    shortest: Annotated[
        float, typer.Option("--shortest", min=0.0, help="Shortest straight or steady stretch, s.")
    ] = SHORTEST,
    pick: Annotated[
        str | None, typer.Option("--pick", metavar="1,3-5", help="Take these numbers of the list only [all].")
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option("--study", metavar="STUDY.toml", help="Read the log as this study says [names are guessed]."),
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the trials into the study, in place of those of this log.")
    ] = False,
    map_file: Annotated[
        Path | None, typer.Option("--map", metavar="FILE.html", help="Also draw the log with its stretches.")
    ] = None,
    json_file: JsonFile = None,
) -> Result:
    """Split a log into trials and draw a map of it."""
    _consistent(by, column, events, study, write)
    if map_file is not None and log.exists() and map_file.exists() and map_file.samefile(log):
        raise BadInput("the map would replace the log", where=str(map_file), do="Choose another name.")
    recording = _recording(log, study, by, needed=by is not By.column or map_file is not None)
    found = _found(log, recording, by, column, events, shortest, study)
    taken = [found[k - 1] for k in _numbers(pick, len(found))] if found else []
    _show(found, taken, by)
    model = _model(study) if by is By.manoeuvres else None
    lacking = not_recorded(recording, model) if by is By.manoeuvres and recording is not None else []
    for what in lacking:
        where = "no column of the log was recognised for one" if study is None else "the study names no column for one"
        do = "Name its column in the [channels] of a study, and give that with --study." if study is None else ""
        say(f"{what} {where[0].upper()}{where[1:]}. {do}".strip(), style="yellow")
    for what in not_understood(recording, model) if recording is not None else []:
        say(what, style="yellow")
    if map_file is not None and recording is not None:
        # Imported where it is drawn: matplotlib takes half a second.
        from seatruth.report.log_map import log_map

        write_file(map_file, log_map(recording, found, [stretch.name for stretch in taken], by.value))
        say(f"Wrote {map_file}.", whole=True)
    file = relative(log, study.parent if study is not None else Path.cwd())
    text = trial_tables(taken, file)
    if taken and write:
        assert study is not None  # _consistent has seen to it
        write_file(study, with_trials(read_text(study), text, file, str(study)))
        say(f"Wrote {len(taken)} trial{'s' * (len(taken) > 1)} into {study}. Then: seatruth check {study}", whole=True)
    elif taken:
        say("")
        say(text.rstrip(), whole=True)
    data = {
        "log": str(log),
        "by": by.value,
        "lacking": lacking,
        "stretches": [{**vars(stretch), "taken": stretch in taken} for stretch in found],
        "toml": text,
    }
    return Result(data)


def _consistent(by: By, column: str | None, events: str | None, study: Path | None, write: bool) -> None:
    """Options that belong together."""
    for option, given in ((By.column, column), (By.events, events)):
        if by is option and given is None:
            raise BadInput(f"--by {option.value} needs --{option.value}", do=f"Add --{option.value} ...")
        if by is not option and given is not None:
            raise BadInput(f"--{option.value} is of no use with --by {by.value}", do=f"Add --by {option.value}.")
    if write and study is None:
        raise BadInput("--write needs a study to write into", do="Add --study STUDY.toml.")


def _recording(log: Path, study: Path | None, by: By, *, needed: bool) -> Trial | None:
    """The log as one recording; None if that is not needed and cannot be, as time starts anew with each run."""
    try:
        with ProgressLine() as progress:
            return read_log(log, study, progress)
    except BadInput as problem:
        if not needed:
            return None
        if "time runs back" in problem.what:
            hint = "If a column tells the runs, use --by column --column NAME, without --map."
            raise BadInput(problem.what, where=problem.where, do=f"{problem.do} {hint}") from None
        raise


def _found(
    log: Path,
    recording: Trial | None,
    by: By,
    column: str | None,
    events: str | None,
    shortest: float,
    study: Path | None,
) -> list[Stretch]:
    if by is By.column:
        with ProgressLine() as progress:
            content, times = row_times(log, column or "", study, progress)
        if recording is not None and len(recording) == len(content):
            times = recording.t
        return by_column(content, column or "", times)
    assert recording is not None
    if by is By.events:
        return by_events(recording.t, _times(events or ""))
    if by is By.pauses:
        return by_pauses(recording.t)
    if by is not By.manoeuvres:
        return steady(recording, shortest=shortest, model=_model(study))
    return recognise(recording, shortest=shortest, model=_model(study))


def _model(study: Path | None) -> Model | None:
    return None if study is None else vehicle_of(study)


def _times(events: str) -> list[float]:
    """Times from a list on the command line, or from the first number of each line of a file."""
    where = "--events"
    try:
        from_file = Path(events).is_file()
    except OSError:  # a long list is no name of a file
        from_file = False
    if from_file:
        where = events
        try:
            text = read_regular(events).decode("utf-8-sig")
        except UnicodeDecodeError:
            raise BadInput("it is not UTF-8 text", where=events, do="Write one time a line.") from None
        lines = [line.partition("#")[0].strip() for line in text.splitlines()]
        words = [re.split(r"[\s,;]+", line)[0] for line in lines if line]
    else:
        words = [word for word in re.split(r"[\s,;]+", events) if word]
    times = []
    for word in words:
        try:
            times.append(float(word))
        except ValueError:
            raise BadInput(f"{word!r} is not a time in seconds", where=where, do="Write 120,340.5,610.") from None
    if not times or not np.isfinite(times).all():
        raise BadInput("it names no times", where=where, do="Write 120,340.5,610, or one time a line in a file.")
    return times


def _numbers(pick: str | None, most: int) -> list[int]:
    """Numbers from "1,3-5"; all without it."""
    if pick is None:
        return list(range(1, most + 1))
    chosen: list[int] = []
    for part in re.split(r"[\s,]+", pick.strip()):
        match = re.fullmatch(r"(\d{1,6})(?:-(\d{1,6}))?", part)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
        if not 1 <= first <= last <= most:
            raise BadInput(f"{part!r} is none of the numbers 1 to {most}", where="--pick", do="Write 1,3-5.")
        chosen += range(first, last + 1)
    return sorted(set(chosen))


def _show(found: Sequence[Stretch], taken: Sequence[Stretch], by: By) -> None:
    if not found:
        say(f"Nothing was found (by {by.value}).")
        return
    rows = [
        [
            str(k),
            stretch.name,
            f"{stretch.start:.1f}",
            f"{stretch.end:.1f}",
            "yes" if stretch in taken else "",
            stretch.facts,
        ]
        for k, stretch in enumerate(found, 1)
    ]
    columns = ["", "trial", "start", "end", "taken", "what it holds"]
    console().print(table(columns, rows, numbers=("", "start", "end")))
