"""Measures of optimisation: how often and how soon a solver comes near the best known fit.

Nearness is the excess over the best known fit in units of chi-square: twice the difference of the costs. An excess of 1
is one standard error away from the best fit in some direction; an absolute cost means nothing under noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array

Histories = Mapping[str, tuple[Any, Any, Any]]
CONDITION = ["problem", "cost", "noise", "level"]
"""Columns of a condition: runs of one condition and one seed are paired."""
NEGLIGIBLE_EXCESS = 0.01
"""Excesses below it count as equal: a tenth of a standard error. Chosen here [S]."""


def records(frame: pd.DataFrame) -> Iterator[Any]:
    """Rows with their columns as attributes."""
    yield from frame.itertuples(index=False)


def evaluations_to(run: Any, histories: Histories, target: float) -> float:
    """Evaluations until the excess is at most the target; inf where it never is."""
    return _first_at(run, histories, target, 0)


def seconds_to(run: Any, histories: Histories, target: float) -> float:
    """Seconds of search until the excess is at most the target; inf where it never is."""
    return _first_at(run, histories, target, 2)


def _first_at(run: Any, histories: Histories, target: float, column: int) -> float:
    history = histories[run.key]
    if run.status != "done" or not len(history[1]):
        return math.inf
    reached = np.flatnonzero(2.0 * (history[1] - run.best) <= target)
    return float(history[column][reached[0]]) if reached.size else math.inf


def success(
    runs: pd.DataFrame, histories: Histories, targets: Sequence[float], by: Sequence[str] = tuple(CONDITION)
) -> pd.DataFrame:
    """By condition (or the columns of `by`), solver, budget and target: runs, success_rate, and expected running time.

    That in evaluations is ert, that in seconds ert_s.

    The expected running time is the evaluations of all runs (of the successful ones up to the target) over the number
    of successes (Hansen and others 2010): the mean cost if the solver is started again until it succeeds. A failed run
    costs its whole budget. Infinite without any success.
    """
    if not len(runs):
        return pd.DataFrame()
    every = list(records(runs))
    last = [histories[run.key][2] for run in every]
    used = np.array([float(run.evaluations) if run.status == "done" else float(run.budget) for run in every])
    whole = np.array([float(seconds[-1]) if len(seconds) else 0.0 for seconds in last])
    parts = []
    for target in targets:
        when = np.array([evaluations_to(run, histories, target) for run in every], dtype=float)
        clock = np.array([seconds_to(run, histories, target) for run in every], dtype=float)
        reached = np.isfinite(when)
        columns = {"reached": reached, "spent": np.where(reached, when, used)}
        columns["seconds"] = np.where(reached, clock, whole)
        parts.append(runs[[*by, "solver", "budget"]].assign(target=target, **columns))
    groups = pd.concat(parts).groupby([*by, "solver", "budget", "target"], sort=False)
    table = groups.agg(
        runs=("reached", "size"), reached=("reached", "sum"), spent=("spent", "sum"), seconds=("seconds", "sum")
    ).reset_index()
    successes = table["reached"].where(table["reached"] > 0)
    table["success_rate"] = table["reached"] / table["runs"]
    table["ert"] = (table["spent"] / successes).fillna(math.inf)
    table["ert_s"] = (table["seconds"] / successes).fillna(math.inf)
    return table.drop(columns=["reached", "spent", "seconds"])


def ecdf(runs: pd.DataFrame, histories: Histories, targets: Sequence[float]) -> pd.DataFrame:
    """Share of all (realisation, target) pairs that each solver has reached, at evaluations per dimension."""
    rows = []
    for (cost, solver), group in runs.groupby(["cost", "solver"], sort=False):
        when = np.array(
            [evaluations_to(run, histories, target) / run.dimension for run in records(group) for target in targets],
            dtype=float,
        )
        reached = np.sort(when[np.isfinite(when)])
        points, counts = np.unique(reached, return_counts=True)
        share = np.cumsum(counts) / when.size
        rows += [{"cost": cost, "solver": solver, "evaluations": x, "share": y} for x, y in zip(points, share)]
    return pd.DataFrame(rows, columns=["cost", "solver", "evaluations", "share"])


def profiles(runs: pd.DataFrame, histories: Histories, target: float) -> pd.DataFrame:
    """Performance profiles (Dolan and More 2002): share of realisations solved within a factor of the fastest solver.

    Realisations that no solver solves count in the share's denominator.
    """
    when = [evaluations_to(run, histories, target) for run in records(runs)]
    table = runs[["cost", "instance", "solver"]].assign(when=when)
    table["fastest"] = table.groupby("instance")["when"].transform("min")
    rows = []
    for (cost, solver), group in table.groupby(["cost", "solver"], sort=False):
        with np.errstate(invalid="ignore"):
            ratio = (group["when"] / group["fastest"]).to_numpy(dtype=float)
        factors = np.sort(ratio[np.isfinite(ratio)])
        points, counts = np.unique(factors, return_counts=True)
        share = np.cumsum(counts) / len(ratio)
        rows += [{"cost": cost, "solver": solver, "factor": x, "share": y} for x, y in zip(points, share)]
    return pd.DataFrame(rows, columns=["cost", "solver", "factor", "share"])


def against_time(runs: pd.DataFrame, histories: Histories, points: int = 40) -> pd.DataFrame:
    """Median excess of the best so far against search time (scoring not counted), by problem, cost and solver.

    Infinite excesses (nothing found yet, a failed run) count as such in the median.
    """
    rows = []
    for (problem, cost), group in runs.groupby(["problem", "cost"], sort=False):
        ends = [histories[key][2] for key in group["key"] if len(histories[key][2])]
        if not ends:
            continue
        low = max(1e-5, min(float(end[0]) for end in ends))
        high = max(max(float(end[-1]) for end in ends), 2.0 * low)
        grid = np.geomspace(low, high, points)
        for solver, runs_of_solver in group.groupby("solver", sort=False):
            curves = np.array([_at(run, histories, grid) for run in records(runs_of_solver)])
            with np.errstate(invalid="ignore"):
                middle = np.median(curves, axis=0)
            last_times = [histories[key][2] for key in runs_of_solver["key"]]
            last = float(np.median([times[-1] if len(times) else low for times in last_times]))
            rows += [
                {"problem": problem, "cost": cost, "solver": solver, "seconds": x, "excess": max(y, NEGLIGIBLE_EXCESS)}
                for x, y in zip(grid, middle)
                if math.isfinite(y) and x <= last * 1.05
            ]
    return pd.DataFrame(rows, columns=["problem", "cost", "solver", "seconds", "excess"])


def _at(run: Any, histories: Histories, grid: Array) -> Array:
    """Excess of the best so far at these times; inf before the first."""
    _, best, seconds = histories[run.key]
    if run.status != "done" or not len(best):
        return np.full(grid.size, math.inf)
    place = np.searchsorted(seconds, grid, side="right") - 1
    excess = 2.0 * (best[np.maximum(place, 0)] - run.best)
    return np.where(place >= 0, excess, math.inf)
