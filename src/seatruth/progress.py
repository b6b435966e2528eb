"""The one progress protocol: `identify`, `compare`, `diagnose` and `minimise` report through it.

def show(event: ProgressEvent) -> None:
    print(event)

identify(study, progress=show)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class ProgressEvent:
    """How far a run has come.

    Args:
        stage: what is being done ("Search", "Profile", "Comparison").
        done: how many units of this stage are done.
        total: how many units this stage has, or None where that is not known.
        unit: what is counted, in the plural ("evaluations", "runs"); "" where nothing is counted.
        best: best cost so far; NaN where no cost applies yet.
        elapsed_s: time since the run began, s.
        remaining_s: time to the end of this stage at the present pace, s; None where that is not known.
        may_end_early: `remaining_s` is the time until the budget is spent; a search that converges ends before.
        message: further text; the last event of a search holds the code with which it ended.

    Example:
        >>> from seatruth import ProgressEvent
        >>> print(ProgressEvent("Profile", done=3, total=9, unit="points", elapsed_s=4.0, remaining_s=8.0))
        Profile: 3 of 9 points, 4.0 s, about 8 s to go
    """

    stage: str
    done: int = 0
    total: int | None = None
    unit: str = ""
    best: float = math.nan
    elapsed_s: float = 0.0
    remaining_s: float | None = None
    may_end_early: bool = False
    message: str = ""

    @property
    def left(self) -> int | None:
        """Units that are not done yet; None where the total is not known."""
        return None if self.total is None else self.total - self.done

    def __str__(self) -> str:
        parts = []
        if self.unit:
            parts.append(f"{self.done}{f' of {self.total}' if self.total is not None else ''} {self.unit}")
        if not math.isnan(self.best):
            parts.append(f"best cost {self.best:.6g}" if math.isfinite(self.best) else "best cost none yet")
        if self.message:
            parts.append(self.message)
        parts.append(f"{self.elapsed_s:.1f} s")
        if self.remaining_s is not None and self.remaining_s > 0:
            parts.append(f"{'at most' if self.may_end_early else 'about'} {duration(self.remaining_s)} to go")
        return f"{self.stage}: {', '.join(parts)}"


class Progress(Protocol):
    """Anything that can be called with a `ProgressEvent`.

    It is called from the thread that runs the work, up to ten times per second, so it must return soon.
    """

    def __call__(self, event: ProgressEvent, /) -> None: ...


def silent(event: ProgressEvent, /) -> None:
    """Shows nothing: what runs use where no progress is asked for."""


def remaining(done: int, total: int | None, elapsed_s: float) -> float | None:
    """Time to go in s if every unit takes as long as those done; None before the first one."""
    if total is None or done <= 0:
        return None
    return elapsed_s / done * max(total - done, 0)


def duration(seconds: float) -> str:
    """A time in words.

    Example:
        >>> duration(125.0)
        '2 min 5 s'
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
