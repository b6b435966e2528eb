"""Pieces of long work that are kept as they are done, so that an interrupted run goes on where it stopped."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from joblib import Parallel, delayed

from seatruth.costs.base import Cost
from seatruth.optimizers import Budget, Outcome, minimise

T = TypeVar("T")


class Pieces:
    """Finished pieces by name in a file of JSON lines; only in memory where there is no file.

    The first line names the work that they belong to: pieces of other work are left aside. A line torn by a kill is
    done again. A full disk costs the pieces' survival, not the run.
    """

    def __init__(self, path: Path | None, work: str) -> None:
        self._path, self._work = path, work
        self._done: dict[str, Any] = {}
        self._torn = False
        if path is not None and path.exists():
            self._read(path)

    def __contains__(self, name: str) -> bool:
        return name in self._done

    def __getitem__(self, name: str) -> Any:
        return self._done[name]

    def add(self, name: str, value: Any) -> None:
        """Keeps a finished piece."""
        fresh = not self._done and (self._path is None or not self._path.exists())
        self._done[name] = value
        if self._path is None:
            return
        with suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as stream:
                if self._torn:
                    stream.write("\n")
                    self._torn = False
                if fresh:
                    stream.write(json.dumps({"work": self._work}) + "\n")
                stream.write(json.dumps({"name": name, "value": value}) + "\n")
                stream.flush()
                os.fsync(stream.fileno())

    def _read(self, path: Path) -> None:
        try:
            text = path.read_text(encoding="utf-8")
            self._torn, lines = not text.endswith("\n"), text.splitlines()
            whose = json.loads(lines[0]).get("work") if lines else None
        except (OSError, ValueError, AttributeError):
            whose = None
        if whose != self._work:
            with suppress(OSError):
                path.unlink(missing_ok=True)
            self._torn = False
            return
        for line in lines[1:]:
            try:
                entry = json.loads(line)
                self._done[str(entry["name"])] = entry["value"]
            except (ValueError, KeyError, TypeError):
                continue


def in_order(work: Callable[..., T], jobs: Iterable[tuple[Any, ...]], workers: int) -> Iterator[T]:
    """work(*job) of each job, in the jobs' order, `workers` of them at once.

    In threads: the simulations leave the interpreter, and a user's model need not be one that can be sent to a process.
    """
    with warnings.catch_warnings():
        # An interrupt leaves jobs undone; that is said elsewhere.
        warnings.filterwarnings("ignore", message=".*tasks which were still being processed", category=UserWarning)
        yield from Parallel(n_jobs=workers, prefer="threads", return_as="generator")(
            delayed(work)(*job) for job in jobs
        )


def refit(cost: Cost, budget: Budget) -> Outcome:
    """A local fit that is one piece. An interrupt goes through: the driver's best so far is no finished piece."""
    found = minimise(cost, "least_squares", budget=budget)
    if found.code == "interrupted":
        raise KeyboardInterrupt
    return found


def pieces_beside(checkpoint: str | Path) -> Path:
    """The file of the pieces that belong to a search's checkpoint."""
    return Path(f"{checkpoint}.pieces")
