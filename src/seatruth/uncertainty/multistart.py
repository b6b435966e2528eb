"""Multi-start: the search from further starts, each with the whole budget, several at once if wanted."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.errors import SeatruthError
from seatruth.optimizers import Budget, Optimizer, Outcome, minimise
from seatruth.progress import Progress, ProgressEvent, remaining
from seatruth.storage.checkpoint import Checkpoint
from seatruth.uncertainty.refits import run_in_order

_STORED = ("value", "evaluations", "code", "reason", "diverged", "clipped", "wall_s")


def search_from(
    study: EstimationProblem,
    points: Array,
    optimizer: Optimizer,
    budget: Budget,
    seed: int,
    *,
    checkpoint: Checkpoint,
    progress: Progress,
    threads: int | None,
    workers: int,
) -> list[Outcome]:
    """The outcomes of the searches from all starts but the first, in their order.

    Args:
        study: The study.
        points: (N, K), the starts; the first has been searched from.
        optimizer: What searches.
        budget: Limits of each search.
        seed: Seed of the first search; the k-th of the others has seed + k.
        checkpoint: Finished searches are read from it and stored in it.
        progress: Called with a `ProgressEvent` after each search.
        threads: Threads of a simulation; None for all processors.
        workers: Searches that run at once; the result does not depend on it.

    Returns:
        The outcomes up to the first that was interrupted. A search that cannot begin has failed.
    """
    missing = [(k, points[k]) for k in range(1, len(points)) if _key(k) not in checkpoint]

    def search(number: int, start: Array) -> tuple[int, Outcome]:
        # Each search has a cost of its own: a cost that estimates its noise depends on where it was last evaluated.
        cost = cost_of(study, threads=threads)
        try:
            outcome = minimise(cost, optimizer, budget=budget, seed=seed + number, start=start)
        except SeatruthError as problem:
            outcome = _failed(start, problem.message, seed + number, optimizer)
        if outcome.code == "interrupted":
            raise KeyboardInterrupt
        return number, outcome

    began = time.perf_counter()
    try:
        for done, (number, outcome) in enumerate(run_in_order(search, missing, workers), 1):
            checkpoint.put(_key(number), _stored(outcome))
            left = remaining(done, len(missing), time.perf_counter() - began)
            progress(ProgressEvent("Starts", done, len(missing), "starts", best=outcome.value, remaining_s=left))
    except KeyboardInterrupt:
        pass  # the caller sees that searches are missing
    found = []
    for k in range(1, len(points)):
        if _key(k) not in checkpoint:
            break
        found.append(_restored(checkpoint.get(_key(k)), seed + k, optimizer))
    return found


def best_of(outcomes: Sequence[Outcome]) -> Outcome:
    """The outcome of the lowest cost, with the evaluations and the time of all; the first of equals."""
    if len(outcomes) == 1:
        return outcomes[0]
    number = min(range(len(outcomes)), key=lambda k: outcomes[k].value)
    best = outcomes[number]
    which = f" (start {number + 1}, the best of {len(outcomes)})" if math.isfinite(best.value) else ""
    return dataclasses.replace(
        best,
        reason=f"{best.reason}{which}",
        evaluations=sum(outcome.evaluations for outcome in outcomes),
        diverged=sum(outcome.diverged for outcome in outcomes),
        clipped=sum(outcome.clipped for outcome in outcomes),
        wall_s=sum(outcome.wall_s for outcome in outcomes),
        seed=outcomes[0].seed,
    )


def _key(number: int) -> str:
    return f"start {number}"


def _stored(outcome: Outcome) -> dict[str, Any]:
    history = {str(name): outcome.history[name].to_numpy() for name in outcome.history}
    rest = {name: getattr(outcome, name) for name in _STORED}
    return {**rest, "x": outcome.x, "history": history, "notes": list(outcome.notes)}


def _restored(kept: dict[str, Any], seed: int, optimizer: Optimizer) -> Outcome:
    return Outcome(
        **{name: kept[name] for name in _STORED},
        x=np.asarray(kept["x"], dtype=float),
        history=pd.DataFrame(kept["history"]),
        notes=tuple(kept["notes"]),
        seed=seed,
        optimizer=optimizer.describe(),
    )


def _failed(start: Array, reason: str, seed: int, optimizer: Optimizer) -> Outcome:
    history = pd.DataFrame({"evaluations": [0], "best": [np.inf], "seconds": [0.0]})
    return Outcome(start, np.inf, 0, "failed", reason, history, 0, 0, seed, optimizer.describe(), 0.0)
