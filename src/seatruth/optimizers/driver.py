"""The one driver: it owns evaluation counts, budgets, stopping, failures, progress and checkpoints."""

from __future__ import annotations

import contextlib
import math
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from seatruth.arrays import Array
from seatruth.costs.base import Cost
from seatruth.errors import BadInput, SeatruthError
from seatruth.optimizers.base import Optimizer
from seatruth.optimizers.budget import Budget, Code, Outcome, Stop
from seatruth.optimizers.chain import Chain
from seatruth.optimizers.coordinates import Coordinates
from seatruth.optimizers.evaluator import INTERRUPTED, Evaluator
from seatruth.optimizers.journal import Journal, identity_of
from seatruth.optimizers.problem import Problem, solve
from seatruth.optimizers.registry import as_optimizer, fitting
from seatruth.progress import Progress
from seatruth.storage.checkpoint import StaleCheckpoint


def minimise(
    cost: Cost,
    optimizer: str | Optimizer | Sequence[str | Optimizer] = "least_squares",
    *,
    budget: Budget | None = None,
    seed: int = 0,
    start: Array | None = None,
    checkpoint: str | Path | None = None,
    progress: Progress | None = None,
    snapshots: Sequence[int] = (),
) -> Outcome:
    """Minimises a cost and says how that ended.

    Args:
        cost: what is minimised. One that estimates its noise is left with the noise at the answer.
        optimizer: name, `Optimizer`, or a list of them for a hybrid (global then local) on one budget.
        budget: limits of the search; None takes the default `Budget()`.
        seed: fixes every random draw: the same seed gives the same bytes.
        start: (K,), where the search starts, in the parameters' units; None takes the parameters' values.
        checkpoint: file in which every population evaluation is kept. The same call on an existing file goes on where
            that run stopped and ends with the outcome that it would have had (wall-clock times apart).
        progress: called about ten times a second with a `ProgressEvent`, and once at the end, when its message is the
            code.
        snapshots: numbers of evaluations at which the best so far is kept in the outcome, in rising order: what a
            solver that does not look at its budget would have found with budgets as small.

    Returns:
        The outcome: x (K,), its cost, the history, and why it ended. Whatever happens in the solver, the best candidate
        so far is kept: an interrupt ends with code "interrupted", a solver or a cost that raises with "failed".

    Raises:
        BadInput: nothing could be started: no parameters, an optimizer that needs what the cost does not give, a
            checkpoint of another run.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Budget, minimise
        >>> from seatruth.costs import cost_of
        >>> outcome = minimise(cost_of(seatruth.sample.load()), "cma_es", budget=Budget(evaluations=50), seed=1)
        >>> outcome.code, outcome.evaluations
        ('budget', 50)
    """
    solver, budget = as_optimizer(optimizer), budget or Budget()
    _check(cost, solver, seed, start)
    begun = time.perf_counter()
    journal = None
    if checkpoint is not None:
        journal = Journal(Path(checkpoint), identity_of(cost, solver.describe(), seed, start))
    try:
        evaluator = Evaluator(
            cost, Coordinates(cost.parameters, start), budget, journal=journal, progress=progress, snapshots=snapshots
        )
        # One thread of linear algebra: its sums then do not depend on the machine, and on matrices as small as these
        # its threads only stand in the way of those that simulate.
        with threadpool_limits(1, "blas"):
            code, reason, notes = _run(solver, evaluator, np.random.default_rng(seed))
    finally:
        if journal is not None:
            journal.close()
    x, value = evaluator.coordinates.x_of(evaluator.best_z), evaluator.best_value
    if evaluator.answer is not None:
        x, value = evaluator.answer, evaluator.answer_value
    if not math.isfinite(value) and code not in ("interrupted", "failed") and not math.isfinite(evaluator.best_value):
        if evaluator.evaluations:
            reason = (
                f"none of the {evaluator.evaluations} candidates tried could be evaluated: all diverged or broke a "
                "constraint. Check the units and signs of the data, the start values and the bounds."
            )
        else:
            more = " Give it a larger budget." if code in ("budget", "deadline") else ""
            reason = f"no candidate was tried ({reason}).{more}"
        code = "failed"
    if not cost.noise_known and math.isfinite(value):
        with contextlib.suppress(Exception):  # an answer is there; a cost that fails now cannot take it away
            cost.reweight(x)
    if journal is not None and journal.write_error:
        notes.append(journal.write_error)
    evaluator.take_last_snapshots()
    evaluator.report(code)
    return Outcome(
        x=x,
        value=value,
        evaluations=evaluator.evaluations,
        code=code,
        reason=reason,
        history=evaluator.history.table(),
        diverged=evaluator.diverged,
        clipped=evaluator.clipped,
        seed=int(seed),
        optimizer=solver.describe(),
        wall_s=time.perf_counter() - begun,
        notes=tuple(notes),
        snapshots=tuple(evaluator.snapshots),
    )


def _check(cost: Cost, solver: Optimizer, seed: int, start: Array | None) -> None:
    if not cost.parameters:
        raise BadInput("no parameter varies", where="study", do="Set `vary = true` for at least one parameter.")
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise BadInput(f"{seed!r} is not a seed", where="seed", do="Give a whole number, 0 or more.")
    if start is not None and (np.shape(start) != (len(cost.parameters),) or not np.isfinite(start).all()):
        raise BadInput(
            f"a start is {len(cost.parameters)} finite numbers", where="start", do="Give one for each free parameter."
        )
    missing = sorted(solver.needs - cost.gives)
    if missing:
        others = ", ".join(fitting(cost.gives))
        raise BadInput(
            f"it needs {' and '.join(missing)}, which this cost ({type(cost).__name__}) does not give",
            where=f"optimizer {solver.name!r}",
            do=f"Optimizers that fit it: {others}." if others else "",
        )


def _run(solver: Optimizer, evaluator: Evaluator, rng: np.random.Generator) -> tuple[Code, str, list[str]]:
    """Runs the solver to its end: (code, reason, notes)."""
    try:
        # A chain does the same for each of its stages.
        reason = solver.run(Problem(evaluator), rng) if isinstance(solver, Chain) else solve(solver, evaluator, rng)
    except Stop as stop:
        return stop.code, stop.reason, []
    except KeyboardInterrupt:
        return "interrupted", INTERRUPTED, []
    except StaleCheckpoint:
        raise
    except SeatruthError as problem:
        if not evaluator.evaluations:
            raise  # nothing was tried yet: it is the input that is wrong, not the run
        return "failed", problem.message, []
    except Exception as problem:
        if evaluator.stopped is not None:  # the solver answered the stop with an error of its own
            return evaluator.stopped.code, evaluator.stopped.reason, []
        frame = traceback.extract_tb(problem.__traceback__)[-1]
        place = f"It raised in {Path(frame.filename).name}, line {frame.lineno}, in {frame.name}."
        return "failed", f"the optimizer {solver.name!r} raised {type(problem).__name__}: {problem}", [place]
    if evaluator.stopped is not None:  # the solver swallowed the stop and returned
        return evaluator.stopped.code, evaluator.stopped.reason, []
    return "converged", str(reason or "it stopped by its own rule"), []
