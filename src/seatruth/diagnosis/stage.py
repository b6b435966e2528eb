"""The progress of one stage of a diagnosis, with the time to go."""

from __future__ import annotations

import time
from collections.abc import Callable

from seatruth.progress import Progress, ProgressEvent, remaining

_ENOUGH = 5
"""Sets that are done before the time to go is told: the first ones compile kernels, and take longest. [S]"""
Say = Callable[[str, int, int], None]
"""Told what is done next, how many sets are done, and how many are expected."""
AGAIN = 0.5
"""Time in which the leading sets are fitted again, over that of all sets before. [S] Of an AUV 0.47."""


class Stage:
    """Passes what is done next, how much is done and how much is expected on as progress.

    After all that is expected comes work that nobody can count, which takes `again` times as long as what was before.
    """

    def __init__(self, stage: str, show: Progress, began: float, again: float = 0.0) -> None:
        self._stage, self._show, self._began, self._again = stage, show, began, again
        self._from = time.perf_counter()
        self._counted: float | None = None

    def __call__(self, message: str, done: int, total: int) -> None:
        now = time.perf_counter()
        self._show(
            ProgressEvent(
                self._stage,
                done=done,
                total=max(total, done),
                elapsed_s=now - self._began,
                remaining_s=self._left(done, max(total, done), now - self._from) if done >= _ENOUGH else None,
                message=message,
            )
        )

    def _left(self, done: int, total: int, spent: float) -> float | None:
        """Time to go, s; None where what is left has taken longer than was to be expected."""
        left = remaining(done, total, spent) or 0.0
        if done < total:
            self._counted = None
            return left + self._again * (spent + left)
        self._counted = spent if self._counted is None else self._counted
        left = (1.0 + self._again) * self._counted - spent
        return left if left > 0.0 else None


class Rising:
    """Says the same, with a number of sets that are done which never falls.

    Where a search begins `again`, with forces or wider priors, what it takes is still to come.

    Example:
        >>> say = Rising(print)
        >>> say("wind", 3, 10)
        wind 3 10
        >>> say.again()
        >>> say("wind", 1, 10)
        wind 4 13
    """

    def __init__(self, say: Say) -> None:
        self._say, self._most, self._before = say, 0, 0

    def __call__(self, message: str, done: int, total: int) -> None:
        self._most = max(self._most, self._before + done)
        self._say(message, self._most, max(self._before + total, self._most))

    def again(self) -> None:
        """What is done from now on comes on top of what was done before."""
        self._before = self._most
