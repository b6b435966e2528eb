"""`seatruth init LOG`: lists what a log holds, guesses its channels and writes a commented study file."""

from __future__ import annotations

import contextlib
import glob
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from itertools import takewhile
from pathlib import Path
from typing import Annotated

import typer

from seatruth.commands.common import JsonFile, Result, console, relative, say, table
from seatruth.commands.progress import ProgressLine
from seatruth.errors import BadInput
from seatruth.models import load_model
from seatruth.progress import Progress
from seatruth.readers import Log, read_log
from seatruth.readers.listing import FieldInfo, listing
from seatruth.simulate.faults import fault_of
from seatruth.storage.atomic import write_file
from seatruth.study.template import template
from seatruth.study.usual_model import Usual, usual_model

_MOST_NAMED = 20
"""Logs without a common name that a study lists one by one (chosen here [S])."""
_MOST_ROWS = 60
"""Fields that are listed one by one without being asked for: about a screen or two (chosen here [S])."""


def init(
    logs: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG...",
            help="Recorded runs, in a format of `seatruth list readers`; the first one's columns are those of all.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="STUDY.toml", help="Study file to write [beside the first LOG, as its name.toml]."
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model", help='Model: a name of `seatruth list models`, "file.py:ClassName" or "file.fmu" [by the log].'
        ),
    ] = None,
    reader: Annotated[str | None, typer.Option("--reader", help="Reader of the log; default: recognised.")] = None,
    fields: Annotated[bool, typer.Option("--fields", help="List every field, however many there are.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing study file.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """List what a log holds, guess its channels and write a commented study file."""
    log = logs[0]
    named = log if log.name else log.resolve()  # "" and "." are this folder, which has a name
    if not named.name:
        raise BadInput("it is no log", where=str(log), do="Name a file.")
    target = output or named.with_suffix(".toml")
    if target.exists() and not force:
        raise BadInput("it exists already", where=str(target), do="Choose another name with -o, or add --force.")
    lost = next((str(other) for other in logs[1:] if not other.exists()), None)
    if lost is not None:
        raise BadInput("no such file", where=lost, do="Check its name.")
    if target.exists() and any(one.exists() and target.samefile(one) for one in logs):
        raise BadInput("the study file would replace the log", where=str(target), do="Choose another name with -o.")
    with ProgressLine() as progress:
        content = read_log(log, reader=reader, progress=progress)
    folder = target.parent
    paths = [relative(one, folder) for one in logs]
    pattern = _pattern(logs, folder)
    name = None if len(logs) == 1 else log.resolve().parent.name or None
    usual = Usual(model, "") if model else usual_model(content)
    use = usual.name
    loaded = load_model(use, Path.cwd())
    fault = fault_of(loaded)
    if fault is not None:
        raise fault
    written = _model_use(use, folder)
    with ProgressLine() as progress:
        others = _readable(logs[1:], reader, progress)
        text, notes = template(paths[0], content, loaded, written, paths[1:], name=name, pattern=pattern, others=others)
    found = listing(content)
    _show(content, found, every=fields)
    write_file(target, text)
    if model is None:
        say(
            f"No --model is named: the study takes {use}, {loaded.title}. {usual.why}{usual.why and ' '}"
            "`seatruth list models` lists others.",
            whole=True,
        )
    beside = ", beside the log" if output is None and folder.resolve() != Path.cwd() else ""
    say(f"Wrote {target}{beside}. Check its guesses, then run: seatruth check {target}", whole=True)
    for note in notes:
        say(f"To do: {note}", style="yellow")
    return Result(
        {
            "study": str(target),
            "log": str(log),
            "reader": content.reader,
            "columns": [field.name for field in found],
            "fields": [asdict(field) for field in found],
            "to_do": notes,
        }
    )


def _readable(logs: Sequence[Path], reader: str | None, progress: Progress) -> Iterator[Log]:
    """The contents of logs, each read when it is asked for; what cannot be read is for `check` to say."""
    for log in logs:
        with contextlib.suppress(BadInput):
            yield read_log(log, reader=reader, progress=progress)


def _pattern(logs: Sequence[Path], folder: Path) -> str | None:
    """A pattern, as a study in `folder` names it, that takes several logs and nothing else; None where none does.

    It holds what their names have in common. Where that is nothing, the logs are named one by one, unless there are
    very many: a pattern of all files would take whatever is put beside them later.
    """
    parents, endings = {one.parent for one in logs}, {one.suffix for one in logs}
    if len(logs) == 1 or len(parents) > 1 or len(endings) > 1 or "" in endings:
        return None
    parent, ending = parents.pop(), endings.pop()
    alike = takewhile(lambda letters: len({*letters}) == 1, zip(*(one.stem for one in logs)))
    common = "".join(letters[0] for letters in alike).rstrip("0123456789")
    if not common and len(logs) <= _MOST_NAMED:
        return None
    pattern = relative(parent / f"{common}*{ending}", folder)
    taken = {one for one in parent.iterdir() if one.match(f"{glob.escape(common)}*{ending}") and one.is_file()}
    return pattern if taken == {*logs} and not set("[]?") & set(pattern) and pattern.count("*") == 1 else None


def _show(log: Log, found: Sequence[FieldInfo], *, every: bool) -> None:
    """Prints the fields of a log, or its topics alone where there are many fields."""
    if every or len(found) <= _MOST_ROWS:
        rows = [[f.name, f.unit, str(f.samples), _cell(f.rate), _cell(f.low), _cell(f.high)] for f in found]
        numbers = ["samples", "rate [Hz]", "from", "to"]
        console().print(table(["field", "unit", *numbers], rows, numbers=numbers))
        return
    first = {field.topic: field for field in reversed(found)}
    rows = [
        [name, str(len(content.columns)), str(len(content)), _cell(first[name].rate)]
        for name, content in log.tables.items()
    ]
    numbers = ["fields", "samples", "rate [Hz]"]
    console().print(table(["topic", *numbers], rows, numbers=numbers))
    say(f"{len(found)} fields; --fields lists them all.")


def _cell(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.4g}"


def _model_use(use: str, folder: Path) -> str:
    if use.endswith(".fmu"):
        return relative(Path(use), folder)
    if ".py:" not in use:
        return use
    path, _, name = use.rpartition(":")
    return f"{relative(Path(path), folder)}:{name}"
