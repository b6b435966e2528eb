"""The evaluator: every evaluation of a run passes through it."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.errors import PluginError, SeatruthError, SeatruthWarning
from seatruth.optimizers.budget import Budget, Code, Snapshot, Stop
from seatruth.optimizers.coordinates import Coordinates
from seatruth.optimizers.journal import Journal
from seatruth.progress import Progress, ProgressEvent, remaining

MAX_ROWS = 2000
"""Rows of the history that are kept: enough for a smooth curve in a figure, small in a file. Chosen here [S]."""
INTERRUPTED = "stopped by the user"
_PROGRESS_S = 0.1
"""s between two calls of the progress callback: often enough to look alive. Chosen here [S]."""


class StageOver(Stop):
    """One stage of a chain has used its share; the next stage follows."""


class History:
    """(evaluations, best, seconds), thinned by doubling its interval whenever it grows beyond `MAX_ROWS` rows."""

    def __init__(self) -> None:
        self._rows: list[tuple[int, float, float]] = []
        self._last = (0, math.inf, 0.0)
        self._interval, self._next = 1, 0

    def add(self, evaluations: int, best: float, seconds: float) -> None:
        self._last = (evaluations, best, seconds)
        if evaluations < self._next:
            return
        self._rows.append(self._last)
        if len(self._rows) > MAX_ROWS:
            self._rows = self._rows[::2]
            self._interval *= 2
        self._next = (evaluations // self._interval + 1) * self._interval

    def table(self) -> pd.DataFrame:
        rows = self._rows if self._rows and self._rows[-1] == self._last else [*self._rows, self._last]
        table = pd.DataFrame(rows, columns=["evaluations", "best", "seconds"])
        return table.astype({"evaluations": "int64", "best": "float64", "seconds": "float64"})


class Evaluator:
    """Evaluates candidates, counts them, keeps the best, writes the journal, and raises `Stop` at a limit.

    Candidates outside the bounds are moved to the nearest point inside and counted (`clipped`); candidates that are
    not numbers cost inf, as do those that diverge (`diverged`). An evaluation that the budget does not cover is not
    made: of a population that is larger than what is left, the first candidates are evaluated, then the run stops.
    """

    def __init__(
        self,
        cost: Cost,
        coordinates: Coordinates,
        budget: Budget,
        *,
        journal: Journal | None = None,
        progress: Progress | None = None,
        snapshots: Sequence[int] = (),
    ) -> None:
        self.cost, self.coordinates, self.budget = cost, coordinates, budget
        self.evaluations = self.diverged = self.clipped = 0
        self.best_value, self.best_z = math.inf, coordinates.start.copy()
        self.answer: Array | None = None
        self.answer_value = math.inf
        self.stopped: Stop | None = None
        self.history = History()
        self.snapshots: list[Snapshot] = []
        self._to_take = sorted(snapshots, reverse=True)
        self._journal, self._progress = journal, progress
        self._started, self._seconds_before, self._reported = time.perf_counter(), 0.0, -math.inf
        self._last_seconds = 0.0  # at the last evaluation; unlike the clock, it is replayed from a journal
        self._stall_value, self._stall_evaluations = math.inf, 0
        self._stage_evaluations, self._stage_seconds, self.last_stage = math.inf, math.inf, True

    @property
    def seconds(self) -> float:
        """Wall time of the run, without the time between an interruption and its resumption."""
        return self._seconds_before + time.perf_counter() - self._started

    @property
    def limit(self) -> float:
        """Evaluations at which the present stage ends."""
        whole = math.inf if self.budget.evaluations is None else self.budget.evaluations
        return min(whole, self._stage_evaluations)

    def begin_stage(self, evaluations: float, seconds: float, last: bool) -> None:
        """Opens a stage of a chain: it may spend only its share, and a stall ends the stage, not the run."""
        self._stage_evaluations = self.evaluations + evaluations
        self._stage_seconds = self._last_seconds + seconds
        self.last_stage = last
        self.answer, self.answer_value = None, math.inf
        self._stall_value, self._stall_evaluations = self.best_value, self.evaluations

    def values(self, Z: Array) -> Array:
        """Cost of each candidate: (P, K) in search coordinates -> (P,)."""
        self._raise_if_stopped()
        Z = self._clipped(Z)
        self._check_budget(1)
        result = np.full(len(Z), np.inf)
        done, seconds = 0, self._last_seconds
        # There is a second round only where an earlier run ended within this population: its part is in the journal.
        while done < len(Z) and (rows := min(len(Z) - done, self._check_budget(0) - done)) > 0:
            record = self._journal.replay_next(Z[done:]) if self._journal is not None else None
            if record is not None:
                part, seconds = record.values[:rows], record.seconds
                self._seconds_before, self._started = seconds, time.perf_counter()
            else:
                part = self._evaluate(Z[done : done + rows])
                seconds = self.seconds
                if self._journal is not None:
                    self._journal.append(Z[done : done + rows], part, seconds)
            result[done : done + len(part)] = part
            done += len(part)
        self._record(Z[:done], result[:done], done, seconds)
        if done < len(Z):
            self._check_budget(len(Z) - done)  # raises: the rest of the population is not covered
        return result

    def residuals(self, z: Array) -> Array:
        """Weighted residuals at z (K,): (M,), all inf where the candidate diverges. Counts 1."""
        self._raise_if_stopped()
        self._check_budget(1)
        inside = self._clipped(z[None])
        r = np.full(1, np.inf)
        if np.isfinite(inside).all():
            r = np.array(self._call(self.cost.residuals, self.coordinates.x_of(inside[0])), dtype=float)
            if r.ndim != 1:
                raise PluginError(
                    f"residuals must be one-dimensional, not of shape {r.shape}",
                    where=_name_of(self.cost),
                    do="Let `residuals` return an array (residuals,).",
                )
            if not np.isfinite(r).all():
                r = np.full(len(r), np.inf)
        with np.errstate(over="ignore", invalid="ignore"):
            # Not half the sum of squares: the weights change during a run where the noise is estimated.
            value = np.array([self.cost.value_of(r) if np.isfinite(r).all() else np.inf])
        if not np.isfinite(value[0]):
            r = np.full(len(r), np.inf)  # its square overflows: it diverged as well
        self._record(inside, value, 1, self.seconds)
        return r

    def residuals_of(self, Z: Array) -> Array:
        """Weighted residuals of each candidate, Z (P, K) -> (P, M), all inf where one diverges. Counts P."""
        self._raise_if_stopped()
        self._check_budget(len(Z))
        inside = self._clipped(Z)
        R = np.asarray(self._call(self.cost.residuals_of, self.coordinates.x_of(inside)), dtype=float)
        if R.ndim != 2 or len(R) != len(Z):
            raise PluginError(
                f"residuals of {len(Z)} candidates have shape {R.shape}",
                where=_name_of(self.cost),
                do="Let `residuals_of` return one row for each candidate.",
            )
        with np.errstate(over="ignore", invalid="ignore"):
            values = np.array([self.cost.value_of(r) if np.isfinite(r).all() else np.inf for r in R])
        values[~np.isfinite(values)] = np.inf
        self._record(inside, values, len(Z), self.seconds)
        return np.where(np.isfinite(values)[:, None], R, np.inf)

    def jacobian(self, z: Array) -> Array:
        """Derivative of the residuals by the search coordinates at z (K,): (M, K). Counts K."""
        self._raise_if_stopped()
        self._check_budget(self.coordinates.dimension)
        inside = self._clipped(z[None])[0]
        derivative = np.asarray(self._call(self.cost.jacobian, self.coordinates.x_of(inside)), dtype=float)
        if derivative.ndim != 2 or derivative.shape[1] != len(inside):
            shape = f"(residuals, {len(inside)}), not {derivative.shape}"
            do = "Let `jacobian` return one row for each residual and one column for each parameter."
            raise PluginError(f"the Jacobian must have shape {shape}", where=_name_of(self.cost), do=do)
        self._count(self.coordinates.dimension, self.seconds)
        if not np.isfinite(derivative).all():
            self.end("failed", "the derivatives of the cost are not finite where the search stands")
        return derivative * self.coordinates.slope(inside)

    def reweight(self, z: Array) -> bool:
        """Lets the cost re-estimate its weights at z; counts 2 if they change, as the best is then evaluated anew."""
        self._raise_if_stopped()
        z = self._clipped(z[None])[0]
        changed = bool(self._call(self.cost.reweight, self.coordinates.x_of(z)))
        if changed:
            self._check_budget(2)
            value = self._evaluate(self.best_z[None])
            self.best_value = float(value[0])
            self._stall_value, self._stall_evaluations = self.best_value, self.evaluations
            self._count(2, self.seconds)
        return changed

    def propose(self, x: Array) -> float:
        """Makes x (K,) the answer, whatever its cost; evaluates the cost and returns it."""
        x = np.array(x, dtype=float)
        if x.shape != (self.coordinates.dimension,) or not np.isfinite(x).all():
            raise PluginError(
                f"an answer of {self.coordinates.dimension} finite numbers is needed, not {x}",
                do="Let the optimizer give one for each parameter.",
            )
        z = self.coordinates.z_of(x)
        value = float(self.values(z[None])[0])
        self.answer, self.answer_value = self.coordinates.x_of(z), value
        return value

    def end(self, code: Code, reason: str) -> NoReturn:
        """Ends the run."""
        self.stopped = Stop(code, reason)
        raise self.stopped

    def report(self, code: str = "") -> None:
        """Reports the progress; a display that raises is switched off. `code` says how the search ended."""
        if self._progress is None:
            return
        seconds, total = self.seconds, self.budget.evaluations
        limits = [remaining(self.evaluations, total, seconds)]
        if self.budget.seconds is not None:
            limits.append(max(self.budget.seconds - seconds, 0.0))
        event = ProgressEvent(
            "Search",
            done=self.evaluations,
            total=total,
            unit="evaluations",
            best=self.best_value,
            elapsed_s=seconds,
            remaining_s=min((limit for limit in limits if limit is not None), default=None),
            may_end_early=True,
            message=code,
        )
        try:
            self._progress(event)
        except Exception as problem:
            self._progress = None
            warnings.warn(f"The progress display failed and is off: {problem}", SeatruthWarning, stacklevel=2)

    def _call(self, function: Callable[[Array], Any], x: Array) -> Any:
        """One call of the cost. An error in it is reported as the cost's; an interrupt ends the run."""
        try:
            return function(x)
        except KeyboardInterrupt:
            self.end("interrupted", INTERRUPTED)
        except SeatruthError:
            raise
        except Exception as problem:
            raise PluginError(
                f"it raised {type(problem).__name__}: {problem}",
                where=_name_of(self.cost),
                do="Correct the cost; from Python, the traceback shows the place.",
            ) from problem

    def _raise_if_stopped(self) -> None:
        """Raises the stop again for a solver that caught it and went on."""
        if self.stopped is not None:
            raise self.stopped

    def _clipped(self, Z: Array) -> Array:
        Z = np.array(Z, dtype=float, order="C")
        if Z.ndim != 2 or Z.shape[1] != self.coordinates.dimension or not len(Z):
            raise PluginError(
                f"the optimizer proposed candidates of shape {Z.shape}; (candidates, {self.coordinates.dimension}) "
                "was expected",
                do="Let it propose one row for each candidate, one at least.",
            )
        inside = self.coordinates.clip(Z)
        moved = inside != Z
        if moved.any():
            self.clipped += int(np.count_nonzero((moved & ~np.isnan(Z)).any(axis=1)))
        return inside

    def _evaluate(self, Z: Array) -> Array:
        """Values of candidates inside the bounds, inf where they are not numbers or diverge."""
        finite = np.isfinite(Z)
        if not finite.all():
            good = finite.all(axis=1)
            values = np.full(len(Z), np.inf)
            if good.any():
                values[good] = self._evaluate(Z[good])
            return values
        values = np.array(self._call(self.cost.values, self.coordinates.x_of(Z)), dtype=float)
        if values.shape != (len(Z),):
            raise PluginError(
                f"the cost returned values of shape {values.shape} for {len(Z)} candidates",
                where=_name_of(self.cost),
                do="Let `values` return one number for each candidate.",
            )
        values[~np.isfinite(values)] = np.inf
        return values

    def _check_budget(self, needed: int) -> int:
        """The number of evaluations that are left; ends the run or the stage if fewer than `needed` are."""
        if self.evaluations + needed > self.limit:
            whole = math.inf if self.budget.evaluations is None else self.budget.evaluations
            if self.evaluations + needed > whole:
                self.end("budget", f"the budget of {self.budget.evaluations} evaluations is used up")
            raise StageOver("budget", "its share of the evaluations is used up")
        return int(min(self.limit - self.evaluations, 2**62))

    def _record(self, Z: Array, values: Array, count: int, seconds: float) -> None:
        """Keeps the best of these candidates and counts them."""
        self._take_snapshots(count, seconds, Z, values)
        at = int(values.argmin())
        if values[at] < self.best_value:
            self.best_value, self.best_z = float(values[at]), Z[at].copy()
        self.diverged += int(np.count_nonzero(np.isinf(values)))
        self._count(count, seconds)

    def take_last_snapshots(self) -> None:
        """Takes those that the run did not reach: it stood there as at its end."""
        self._take_snapshots(math.inf, self._last_seconds)

    def _take_snapshots(
        self, count: float, seconds: float, Z: Array | None = None, values: Array | None = None
    ) -> None:
        """Takes the snapshots that the next `count` evaluations pass, `values` (count,) of candidates Z among them.

        A population that passes a snapshot counts up to it, as under a budget of as many evaluations.
        """
        while self._to_take and self._to_take[-1] < self.evaluations + count:
            at = self._to_take.pop()
            z, value = self.best_z, self.best_value
            if Z is not None and values is not None and (first := at - self.evaluations):
                best = int(values[:first].argmin())
                if values[best] < value:
                    z, value = Z[best], float(values[best])
            x = self.coordinates.x_of(z)
            if self.answer is not None:
                x, value = self.answer, self.answer_value
            spent = self.evaluations if math.isinf(count) else at
            self.snapshots.append(Snapshot(spent, np.array(x), value, seconds))

    def _count(self, count: int, seconds: float) -> None:
        self._take_snapshots(count, seconds)
        self.evaluations += count
        self._last_seconds = seconds
        self.history.add(self.evaluations, self.best_value, seconds)
        if self._progress is not None and time.monotonic() - self._reported > _PROGRESS_S:
            self._reported = time.monotonic()
            self.report()
        budget = self.budget
        if budget.target is not None and self.best_value <= budget.target:
            self.end("target", f"the cost reached the target of {budget.target:g}")
        if budget.stall is not None:
            if self.best_value < self._stall_value - budget.tolerance * abs(self._stall_value) or (
                math.isinf(self._stall_value) and math.isfinite(self.best_value)
            ):
                self._stall_value, self._stall_evaluations = self.best_value, self.evaluations
            if self.evaluations - self._stall_evaluations >= budget.stall:
                reason = f"no improvement by more than {budget.tolerance:g} of the cost in {budget.stall} evaluations"
                if not self.last_stage:
                    raise StageOver("stall", reason)
                self.end("stall", reason)
        if budget.seconds is not None and seconds >= budget.seconds:
            self.end("deadline", f"the time limit of {budget.seconds:g} s is reached")
        if seconds >= self._stage_seconds:
            raise StageOver("deadline", "its share of the time is over")


def _name_of(cost: Cost) -> str:
    return f"cost {type(cost).__name__}"
