"""What all commands share: the session, output that reads well piped or not, and results as JSON."""

from __future__ import annotations

import errno
import importlib.metadata
import json
import math
import os
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from seatruth.errors import DEBUG, BadInput, PluginError, SeatruthError
from seatruth.storage.atomic import FULL, CannotWrite, cannot_write, write_file
from seatruth.storage.lock import locked_folder
from seatruth.text import listed, visible


@dataclass
class Session:
    """One call of the command line: which command, where its JSON goes."""

    command: str = ""
    json_file: Path | None = None
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Result:
    """What a command found. `data` goes to `--json`; `exit_code` is 0 unless the command says that something failed."""

    data: Mapping[str, Any]
    exit_code: int = 0


def _remember(context: typer.Context, value: Path | None) -> Path | None:
    if isinstance(context.obj, Session):
        context.obj.json_file = value
    return value


JsonFile = Annotated[
    Path | None,
    typer.Option(
        "--json",
        metavar="FILE",
        help="Also write the result, or the error, as JSON.",
        is_eager=True,
        callback=_remember,
    ),
]
StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]


def version() -> str:
    """Version of the installed package."""
    return importlib.metadata.version("seatruth")


_WIDEST = 10_000
"""Columns that a table takes at most where no terminal sets a limit."""


class _Console(Console):
    """A console that lets a broken pipe through, where rich would end the program with exit code 1."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError

    def print(self, *objects: Any, **options: Any) -> None:
        """As rich prints; a table that goes into a pipe or a file is as wide as its rows, so that nothing is cut."""
        usual = self.width
        if not self.is_terminal and "COLUMNS" not in os.environ:
            wide = self.options.update(width=_WIDEST)
            tables = [one for one in objects if isinstance(one, Table)]
            self.width = max([usual, *(one.__rich_measure__(self, wide).maximum for one in tables)])
        try:
            super().print(*objects, **options)
        finally:
            self.width = usual


def console() -> Console:
    """Standard output: colours on a terminal only, 80 columns or what the terminal has; tables in a pipe in full."""
    return _Console(highlight=False)


def error_console() -> Console:
    """Standard error, for progress and messages."""
    return Console(stderr=True, highlight=False)


def say(text: str, style: str = "", *, whole: bool = False) -> None:
    """Prints a line of plain text: brackets in it are not markup.

    It is broken into lines as wide as the console; `whole` leaves it in one piece, as for a path that someone copies.
    """
    console().print(Text(visible(text), style=style), soft_wrap=whole)


def note(text: str, style: str = "", *, whole: bool = False) -> None:
    """Prints a line of plain text on standard error; see `say`."""
    error_console().print(Text(visible(text), style=style), soft_wrap=whole)


def table(
    columns: Sequence[str], rows: Sequence[Sequence[str]], *, numbers: Sequence[str] = (), whole: Sequence[str] = ()
) -> Table:
    """A table without boxes; `numbers` names the columns that are aligned to the right, `whole` those with cells that
    are not broken into lines, such as names that someone copies."""
    built = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for column in columns:
        built.add_column(
            column, justify="right" if column in numbers else "left", overflow="fold", no_wrap=column in whole
        )
    for row in rows:
        built.add_row(*(Text(visible(cell)) for cell in row))
    return built


def relative(path: Path, folder: Path) -> str:
    """The path as the study file names it: relative to its folder, with forward slashes."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return path.resolve().as_posix()


def plain(value: Any) -> Any:
    """A value as JSON knows it: frames as lists of rows, arrays as lists, not-a-number as null, paths as text."""
    import numpy as np
    import pandas as pd

    if isinstance(value, pd.DataFrame):
        frame = value.reset_index() if value.index.name or value.index.nlevels > 1 else value
        return [plain(dict(zip(frame.columns, row))) for row in frame.itertuples(index=False, name=None)]
    if isinstance(value, pd.Series):
        return plain(value.to_dict())
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, (bool, int, str)):
        return value
    return str(value)


def result_folder(asked: Path | None, own: Path, source: Path | None) -> Path:
    """The folder of the results: the one that the command line names, else the file's own.

    Args:
        asked: what `--out` says; it may lie anywhere.
        own: what the study or comparison says, or its default.
        source: the study or comparison file; None for a study made in Python.

    Raises:
        BadInput: `own` leads out of the folder of the file that names it, or something in it does. Such a file may
            come from someone else.
    """
    if asked is not None or source is None:
        return own if asked is None else asked
    do = "If you want that, say so on the command line: --out DIR."
    try:
        inside = own.resolve().is_relative_to(source.parent.resolve())
        links = [entry.name for entry in os.scandir(own) if entry.is_symlink()] if own.is_dir() else []
    except (OSError, RuntimeError, ValueError) as problem:
        raise BadInput(f"the folder of its results cannot be used ({problem})", where=str(source), do=do) from None
    if not inside:
        raise BadInput(f"the folder of its results, {str(own)!r}, lies outside of its own", where=str(source), do=do)
    if links:
        raise BadInput(f"the folder of its results holds links ({listed(sorted(links))})", where=str(own), do=do)
    return own


@contextmanager
def own_folder(folder: Path) -> Iterator[None]:
    """Makes the folder of the results, and keeps it to this run.

    Raises:
        BadInput: it cannot be made, or another run is writing into it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        if problem.errno in (errno.EEXIST, errno.ENOTDIR):
            what = "a file stands where the results' folder should be"
            raise BadInput(what, where=str(folder), do="Name another folder with --out, or move the file.") from None
        raise cannot_write(problem, folder) from None
    with locked_folder(folder):
        yield


def write_json(
    session: Session, exit_code: int, data: Mapping[str, Any] | None, error: Mapping[str, str] | None
) -> None:
    """Writes the file of `--json`: command, ok, exit_code, and result or error."""
    if session.json_file is None:
        return
    content = {
        "seatruth": version(),
        "command": session.command,
        "ok": exit_code == 0,
        "exit_code": exit_code,
        "result": plain(data) if data is not None else None,
        "error": dict(error) if error is not None else None,
    }
    write_file(session.json_file, json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def explain(problem: BaseException) -> tuple[int, dict[str, str]]:
    """Exit code and message of anything that ended a command."""
    if isinstance(problem, SeatruthError):
        kind = type(problem).__name__
        parts = {"what": problem.what, "where": problem.where, "do": problem.do, "code": problem.code}
        return problem.exit_code, {"kind": kind, "message": problem.message, **parts}
    if isinstance(problem, (KeyboardInterrupt, typer.Abort)):
        return 130, _message("Interrupted", "interrupted", "Run the same command again to go on.")
    usage = getattr(problem, "format_message", None)
    if callable(usage):
        said = " ".join(str(usage()).split()).replace("Value error, ", "")  # one line, without what a library adds
        return 2, _message("Usage", said, _help_hint(problem))
    if isinstance(problem, OSError):
        return _os_problem(problem)
    if isinstance(problem, MemoryError):
        return 1, _message("MemoryError", "the machine has too little memory for this", "Use fewer or shorter trials.")
    # Imported where it is needed: --help loads no numerical library, and models do.
    from seatruth.models.user_file import name_missing, place_in_user_file

    own = place_in_user_file(problem)
    if own:
        what = f"it raised {type(problem).__name__}: {' '.join(str(problem).split())[:300]}"
        do = name_missing(problem) if isinstance(problem, NameError) else "Correct the model file."
        return explain(PluginError(what, where=own, do=do, code="plug-in"))
    frames = traceback.extract_tb(problem.__traceback__)
    at = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return 1, _message(
        "Unexpected",
        f"unexpected {type(problem).__name__}{at}: {' '.join(str(problem).split())[:300]}",
        f"This is a fault in seatruth. Please report it with the output of {DEBUG}=1.",
    )


def _os_problem(problem: OSError) -> tuple[int, dict[str, str]]:
    name = f" {problem.filename}" if problem.filename else ""
    if problem.errno in FULL:
        return 1, _message(
            "DiskFull", f"no space left on the disk{name and ' for' + name}", "Free some space and run it again."
        )
    return 1, _message(
        type(problem).__name__, f"{problem.strerror or problem}{name and ':' + name}", "Check the path and its rights."
    )


def _message(kind: str, what: str, do: str) -> dict[str, str]:
    end = "" if what.endswith((".", "!", "?")) else "."
    return {"kind": kind, "message": f"{what}{end} {do}".strip(), "what": what, "where": "", "do": do, "code": ""}


def _help_hint(problem: BaseException) -> str:
    context = getattr(problem, "ctx", None)
    path = getattr(context, "command_path", "seatruth")
    return f"See {path} --help."


def fail(session: Session, problem: BaseException) -> int:
    """Prints one message, writes it to `--json`, and gives the exit code."""
    exit_code, error = explain(problem)
    if os.environ.get(DEBUG):
        traceback.print_exception(problem)
    code = f" [{error['code']}]" if error["code"] else ""
    note(f"seatruth: {error['message']}{code}", whole=not sys.stderr.isatty())
    try:
        write_json(session, exit_code, None, error)
    except CannotWrite as second:
        note(f"seatruth: the JSON file could not be written: {second.what}")
    return exit_code
