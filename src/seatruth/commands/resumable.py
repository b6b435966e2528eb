"""Runs that go on where an interrupted one stopped: `identify` and `diagnose`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from seatruth.commands.common import note, own_folder
from seatruth.commands.progress import ProgressLine


@contextmanager
def resumable(folder: Path, kept: Sequence[Path], *, fresh: bool, quiet: bool) -> Iterator[ProgressLine]:
    """Keeps the folder to this run, says if it goes on with an interrupted one, and gives its line of progress.

    Args:
        folder: folder of the result.
        kept: files in which a run keeps what it has done; the first is there if one was interrupted.
        fresh: delete them first.
        quiet: say nothing.

    Raises:
        BadInput: see `own_folder`.
        StaleCheckpoint: they belong to another run; the message says which options help.
    """
    from seatruth.storage.checkpoint import StaleCheckpoint

    with own_folder(folder):
        for path in kept if fresh else ():
            path.unlink(missing_ok=True)
        if kept[0].exists() and not quiet:
            note(f"Going on with the interrupted run in {folder} (--fresh starts again).")
        with ProgressLine(quiet=quiet) as progress:
            try:
                yield progress
            except StaleCheckpoint as problem:
                do = "--fresh drops it and starts again; --out DIR keeps it and writes elsewhere."
                raise StaleCheckpoint(problem.what, where=problem.where, do=do) from None
