"""How many runs of a black box have been asked for, and how many may be."""

from __future__ import annotations

import threading


class OutOfRuns(Exception):
    """The runs that were allowed are used up."""


class Meter:
    """Counts runs (one candidate through one trial each) and ends at a limit.

    What is asked for counts, whether it is simulated or was kept from before: so a search that is made again ends at
    the same place.

    Example:
        >>> from seatruth.simulate import Meter, OutOfRuns
        >>> meter = Meter(limit=3)
        >>> meter.spend(2)
        >>> try:
        ...     meter.spend(2)
        ... except OutOfRuns:
        ...     print(meter.spent)
        2
    """

    def __init__(self, limit: int | None = None) -> None:
        self.limit, self.spent = limit, 0
        self._lock = threading.Lock()

    def spend(self, runs: int) -> None:
        """Counts runs that are about to be made. Raises OutOfRuns where they are more than are left."""
        with self._lock:
            if self.limit is not None and self.spent + runs > self.limit:
                raise OutOfRuns(f"the budget of {self.limit} runs is used up")
            self.spent += runs
