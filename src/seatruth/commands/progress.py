"""Progress of a run on standard error: one line that changes on a terminal, a line now and then in a log."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from rich.live import Live
from rich.text import Text

from seatruth.commands.common import error_console, note
from seatruth.progress import ProgressEvent
from seatruth.text import visible

if TYPE_CHECKING:
    from seatruth.study import Study

_LOG_EVERY_S = 5.0
"""Shortest time between two lines of a log, s (chosen here [S])."""


def load_study(path: Path, *, quiet: bool = False) -> Study:
    """The study of a command, with the progress of its logs' reading."""
    from seatruth import study

    with ProgressLine(quiet=quiet) as progress:
        return study.load_study(path, progress=progress)


class ProgressLine:
    """Shows the progress events of a run, on one line of a terminal or now and then as a line of a log.

    Args:
        quiet: show nothing.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._live: Live | None = None
        self._logged = time.monotonic()

    def __enter__(self) -> ProgressLine:
        if not self._quiet and sys.stderr.isatty():
            self._live = Live(console=error_console(), refresh_per_second=8, transient=True)
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, where: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    def __call__(self, event: ProgressEvent, /) -> None:
        self.show(str(event), now=False)

    def show(self, text: str, *, now: bool = True) -> None:
        """Shows a line. In a log it is written if it is `now` or if the last line is some seconds old."""
        if self._quiet:
            return
        if self._live is not None:
            self._live.update(Text(visible(text)))
            return
        if now or time.monotonic() - self._logged >= _LOG_EVERY_S:
            self._logged = time.monotonic()
            note(text)
