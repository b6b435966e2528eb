"""Progress of a run on standard error: one line that changes on a terminal, a line now and then in a log."""

from __future__ import annotations

import math
import sys
import time
from types import TracebackType

from rich.live import Live
from rich.text import Text

from seatruth.commands.common import error_console

_LOG_EVERY_S = 5.0


class ProgressLine:
    """Called by the driver with (evaluations, best cost, seconds, code); shows what it is told.

    `limit` is the budget in evaluations, if there is one. With `quiet` nothing is shown.
    """

    def __init__(self, limit: int | None = None, *, quiet: bool = False) -> None:
        self._limit = limit
        self._quiet = quiet
        self._live: Live | None = None
        self._logged = time.monotonic()
        self.stage = ""

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

    def __call__(self, evaluations: int, best: float, seconds: float, code: str) -> None:
        self.show(self._text(evaluations, best, seconds), now=False)

    def show(self, text: str, *, now: bool = True) -> None:
        """Shows a line; in a log only if it is `now` or some seconds after the last one."""
        if self._quiet:
            return
        if self._live is not None:
            self._live.update(Text(text))
            return
        if now or time.monotonic() - self._logged >= _LOG_EVERY_S:
            self._logged = time.monotonic()
            error_console().print(Text(text))

    def _text(self, evaluations: int, best: float, seconds: float) -> str:
        of = f" of {self._limit}" if self._limit else ""
        cost = f"{best:.6g}" if math.isfinite(best) else "none yet"
        head = f"{self.stage}: " if self.stage else ""
        return f"{head}{evaluations}{of} evaluations, best cost {cost}, {seconds:.1f} s"
