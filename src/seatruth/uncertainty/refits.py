"""Many small local fits after the search: how one is made, and how several run at once."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

from seatruth.costs.base import Cost
from seatruth.optimizers import Budget, Outcome, minimise

T = TypeVar("T")


def refit(cost: Cost, budget: Budget) -> Outcome:
    """A local fit (least squares) from the cost's start. Raises KeyboardInterrupt if the user stops it.

    The driver answers an interrupt with the best point so far. Here that is not a finished fit, and must not be stored.
    """
    outcome = minimise(cost, "least_squares", budget=budget)
    if outcome.code == "interrupted":
        raise KeyboardInterrupt
    return outcome


def run_in_order(work: Callable[..., T], jobs: Iterable[tuple[Any, ...]], workers: int) -> Iterator[T]:
    """Yields work(*job) for each job in the jobs' order, with `workers` of them running at once.

    It uses threads: the compiled simulations release the interpreter's lock, and a user's model need not be picklable.
    """
    from joblib import Parallel, delayed  # takes 0.2 s to load, and not every fit is followed by refits

    with warnings.catch_warnings():
        # An interrupt leaves jobs unfinished. The caller reports that.
        warnings.filterwarnings("ignore", message=".*tasks which were still being processed", category=UserWarning)
        yield from Parallel(n_jobs=workers, prefer="threads", return_as="generator")(
            delayed(work)(*job) for job in jobs
        )
