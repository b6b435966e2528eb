"""Progress of a run on standard error: one line that changes on a terminal, a line a minute in a log."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.live import Live
from rich.text import Text

from seatruth.commands.common import error_console, note
from seatruth.progress import ProgressEvent, duration
from seatruth.text import visible

if TYPE_CHECKING:
    from seatruth.study import Study

_LOG_EVERY_S = 60.0
"""Time between two lines of a log, s (chosen here [S]): a night's run leaves some hundred lines."""
_LOG_FIRST_S = 5.0
"""Time to the first line, s (chosen here [S]): what ends sooner needs none."""


def load_study(path: Path, *, quiet: bool = False) -> Study:
    """The study of a command, with the progress of its logs' reading."""
    from seatruth import study

    with ProgressLine(quiet=quiet) as progress:
        return study.load_study(path, progress=progress)


class ProgressLine:
    """Shows the progress events of a run, on one line of a terminal or as a line a minute of a log.

    Args:
        quiet: show nothing.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._live: Live | None = None
        self._due = time.monotonic() + _LOG_FIRST_S
        self._last, self._since = "", time.monotonic()
        self._ended = threading.Event()

    def __enter__(self) -> ProgressLine:
        if self._quiet:
            return self
        if sys.stderr.isatty():
            self._live = Live(console=error_console(), refresh_per_second=8, transient=True)
            self._live.start()
        else:
            self._ended.clear()
            threading.Thread(target=self._keep_alive, args=(error_console(),), daemon=True).start()
        return self

    def _keep_alive(self, console: Console) -> None:
        """Writes a line where a step takes long and nothing is reported: a log that stands still looks like a hang."""
        while not self._ended.wait(_LOG_EVERY_S):
            if time.monotonic() >= self._due and self._last:
                self._due = time.monotonic() + _LOG_EVERY_S
                waited = duration(time.monotonic() - self._since)
                console.print(Text(visible(f"Still at: {self._last}; nothing is reported for {waited}")))

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, where: TracebackType | None
    ) -> None:
        self._ended.set()
        if self._live is not None:
            self._live.stop()
            self._live = None

    def __call__(self, event: ProgressEvent, /) -> None:
        self.show(str(event), now=False)

    def show(self, text: str, *, now: bool = True) -> None:
        """Shows a line. In a log it is written if it is `now` or if the last line is a minute old."""
        if self._quiet:
            return
        if self._live is not None:
            self._live.update(Text(visible(text)))
            return
        self._last, self._since = text, time.monotonic()
        if now or time.monotonic() >= self._due:
            self._due = time.monotonic() + _LOG_EVERY_S
            note(text)
