"""Where the gap lies: by trial and channel, in time, and over the operating region.

The size of the misfit is that of whitened errors: 1 where nothing but noise is left. Cells of time and region are
tested by moving the errors' blocks about within each trial (so that their memory stays), and the false discovery rate
over all cells is held at 5 % (Benjamini and Hochberg 1995).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from seatruth.arrays import Array, Indices
from seatruth.diagnosis.parts import Shares
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.models.base import whole_name
from seatruth.statistics.ranks import benjamini_hochberg_adjusted
from seatruth.statistics.state_space_noise import whiten

BLOCKS = 12
"""Parts of each trial that are looked at in time and moved about in tests."""
CELLS = 4
"""Parts of what a variable was, each with as many rows. [S]"""
SECTORS = 8
"""Sectors of the heading, by the points of the compass."""
DRAWS = 400
"""Orders of the blocks in a permutation test, so that p is 1/401 or more. [S]"""
_RATE = 0.05
"""False discovery rate over all cells. Convention."""
_FEWEST = 20
"""Rows of a cell below which it is left out: the mean of fewer squares is chance. [S]"""
_MOST = 0.9
"""Part of all rows from which a cell is left out: hardly anything is left to compare it with. [S]"""


def by_channel(problem: Problem, deviation: Array, points: Mapping[str, Point]) -> pd.DataFrame:
    """Root mean square errors of each channel of each trial at several points, beside the noise `deviation` (C,)."""
    errors = {name: problem.errors(point) for name, point in points.items()}
    rows = []
    for one in problem.series:
        channel = problem.study.model.outputs[one.channel]
        noise = float(deviation[one.channel])
        row: dict[str, Any] = {"trial": problem.trials[one.trial].name, "channel": channel.name, "unit": channel.unit}
        row |= {"n": len(one.rows)}
        row |= {f"rmse_{name}": _rms(values[one.rows]) for name, values in errors.items()}
        row["noise"] = noise
        row |= {f"multiple_{name}": row[f"rmse_{name}"] / noise for name in errors}
        rows.append(row)
    return pd.DataFrame(rows)


def shares(before: float, refit: float, effects: float, rows: int) -> Shares:
    """The misfit of the model as it was declared, split: noise, parameters, named effects, what is left.

    The arguments are sums of squared errors over the noise variance before and after the refit and with the effects.
    """
    total = max(before, 1e-300)
    noise = min(float(rows), effects, total)
    left = max(0.0, min(effects, total) - noise)
    by_effects = max(0.0, min(refit, total) - min(effects, total))
    parameters = max(0.0, total - noise - left - by_effects)
    return Shares(
        noise / total, parameters / total, by_effects / total, left / total, before / rows, refit / rows, effects / rows
    )


def whitened(problem: Problem, errors: Array, sizes: Sizes) -> Array:
    """Errors (N,) whitened by the noise alone: standard normal where nothing but noise is left.

    A channel that diverges in a trial is infinite there from the first sample on.
    """
    shapes, found = noise_shapes(problem.settings), np.full_like(errors, math.inf)
    for one in problem.series:
        own = errors[one.rows]
        if np.isfinite(own).all():
            white, _ = whiten(own, one.t, shapes[sizes.shape[one.channel]])
            found[one.rows] = white * math.exp(-float(sizes.white[one.channel]))
    return found


def in_time(problem: Problem, errors: Array) -> pd.DataFrame:
    """Misfit of each trial in equal parts of its time, with the probability of more under noise alone.

    Parts of sections stand where they are in the whole trial.
    """
    rows: list[dict[str, Any]] = []
    squares = errors**2
    blocks = max(1, BLOCKS // problem.settings.sections)
    for number, trial in enumerate(problem.trials):
        edges = np.linspace(float(trial.t[0]), float(trial.t[-1]), blocks + 1)
        part = np.clip(np.searchsorted(edges, problem.time_of, side="right") - 1, 0, blocks - 1)
        for k in range(blocks):
            here = (problem.trial_of == number) & (part == k)
            n = int(here.sum())
            if n:
                total = float(squares[here].sum())
                rows.append(
                    {
                        "trial": whole_name(trial.name),
                        "from_s": float(edges[k]),
                        "to_s": float(edges[k + 1]),
                        "n": n,
                        "misfit": total / n,
                        "p": float(chdtrc(n, total)),
                    }
                )
    return _tested(rows)


def in_region(problem: Problem, errors: Array, point: Point, seed: int = 0) -> pd.DataFrame:
    """Misfit over cells of each variable of the motion and each input, against the other cells."""
    variables = _variables(problem, point)
    blocks = _blocks(problem)
    squares = errors**2
    generator = np.random.default_rng(seed)
    moved = [_moved(squares, blocks, generator) for _ in range(DRAWS)]
    rows: list[dict[str, Any]] = []
    for name, (unit, values) in variables.items():
        for label, low, high, here in _cells(name, values):
            n = int(here.sum())
            if n < _FEWEST or n > _MOST * len(squares):
                continue
            size = float(squares[here].mean())
            more = sum(float(other[here].mean()) >= size for other in moved)
            rows.append(
                {
                    "variable": name,
                    "unit": unit,
                    "cell": label,
                    "from": low,
                    "to": high,
                    "n": n,
                    "misfit": size,
                    "p": (1 + more) / (1 + DRAWS),
                }
            )
    return _tested(rows)


def _tested(rows: list[dict[str, Any]]) -> pd.DataFrame:
    if rows:
        adjusted = benjamini_hochberg_adjusted(np.array([row["p"] for row in rows]))
        for row, p in zip(rows, adjusted):
            row["p_adjusted"] = float(p)
            row["significant"] = bool(p < _RATE)
    return pd.DataFrame(rows)


def _variables(problem: Problem, point: Point) -> dict[str, tuple[str, Array]]:
    """What the motion was at each residual: unit and values (rows,)."""
    states = problem.states(point)
    names = [channel.name for channel in problem.model.states]
    found: dict[str, tuple[str, Array]] = {}

    def spread(of: Sequence[Array]) -> Array:
        values = np.empty(problem.count)
        for number, series in enumerate(of):
            here = problem.trial_of == number
            values[here] = series[problem.sample_of[here]]
        return values

    if "u" in names and "v" in names:
        u, v = names.index("u"), names.index("v")
        found["speed"] = ("m/s", spread([np.hypot(s[:, u], s[:, v]) for s in states]))
        found["drift angle"] = ("rad", spread([np.arctan2(-s[:, v], np.maximum(s[:, u], 1e-9)) for s in states]))
    for name, title in (("r", "yaw rate"), ("q", "pitch rate"), ("psi", "heading"), ("z", "depth")):
        if name in names:
            k = names.index(name)
            unit = problem.model.states[k].unit
            found[title] = (unit, spread([s[:, k] for s in states]))
    for channel in problem.study.model.inputs:
        series = [np.asarray(trial.inputs[channel.name]) for trial in problem.trials]
        found[channel.name] = (channel.unit, spread(series))
    return found


_ROUNDING = 1e-9
"""End of a cell over the range of all, below which it is zero. Chosen here [S]."""


def _cells(name: str, values: Array) -> list[tuple[str, float, float, Any]]:
    """Words, ends and rows of each cell of a variable; what is NaN, as where a run diverges, is in none."""
    if name == "heading":
        width = 2.0 * math.pi / SECTORS
        sector = np.floor((values + width / 2.0) / width) % SECTORS
        points = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")
        return [(points[k], (k - 0.5) * width, (k + 0.5) * width, sector == k) for k in range(SECTORS)]
    known = values[np.isfinite(values)]
    edges = np.quantile(known, np.linspace(0.0, 1.0, CELLS + 1)) if known.size else known
    # Zero but for rounding is zero: it ends a cell as one number, not as 1.5e-22.
    edges = np.unique(np.where(np.abs(edges) < _ROUNDING * np.ptp(edges), 0.0, edges)) if known.size else known
    found = []
    for low, high in itertools.pairwise(edges):
        last = high == edges[-1]
        here = (values >= low) & ((values <= high) if last else (values < high))
        found.append((f"{low:.3g} to {high:.3g}", float(low), float(high), here))
    return found


def _blocks(problem: Problem) -> list[list[Indices]]:
    """Rows of each trial's channels in blocks of time: for each trial and channel a list of equal blocks."""
    found = []
    for group in problem.series:
        size = max(1, len(group.rows) // BLOCKS)
        count = len(group.rows) // size
        found.append([group.rows[k * size : (k + 1) * size] for k in range(count)])
    return found


def _moved(squares: Array, blocks: Sequence[Sequence[Indices]], generator: np.random.Generator) -> Array:
    """The squares with the blocks of each trial in another order, the same for all its channels of equal length."""
    found = squares.copy()
    orders: dict[int, Indices] = {}
    for parts in blocks:
        order = orders.setdefault(len(parts), generator.permutation(len(parts)))
        for k, other in enumerate(order):
            found[parts[k]] = squares[parts[int(other)]]
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan
