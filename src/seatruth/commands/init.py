"""`seatruth init LOG.csv`: guesses the columns of a log and writes a commented study file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from seatruth.commands.common import JsonFile, Result, relative, say
from seatruth.errors import BadInput
from seatruth.models import load_model
from seatruth.storage.atomic import write_file
from seatruth.study.template import template
from seatruth.trials import read_columns


def init(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A recorded run: CSV, Parquet or MATLAB file.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="STUDY.toml", help="Study file to write [LOG's name.toml].")
    ] = None,
    model: Annotated[str, typer.Option("--model", help='Model: a name of the list, or "file.py:ClassName".')] = "mmg",
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing study file.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Guess the columns of a log and write a commented study file."""
    target = output or log.with_suffix(".toml")
    if target.exists() and not force:
        raise BadInput("it exists already", where=str(target), do="Choose another name with -o, or add --force.")
    if target.exists() and log.exists() and target.samefile(log):
        raise BadInput("the study file would replace the log", where=str(target), do="Choose another name with -o.")
    frame = read_columns(log)
    folder = target.parent
    text, notes = template(relative(log, folder), frame, load_model(model, Path.cwd()), _model_use(model, folder))
    write_file(target, text)
    say(f"Wrote {target}. Check its guesses, then run: seatruth check {target}", whole=True)
    for note in notes:
        say(f"To do: {note}", style="yellow")
    return Result({"study": str(target), "log": str(log), "columns": list(map(str, frame.columns)), "to_do": notes})


def _model_use(use: str, folder: Path) -> str:
    if ".py:" not in use:
        return use
    path, _, name = use.rpartition(":")
    return f"{relative(Path(path), folder)}:{name}"
