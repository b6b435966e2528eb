"""The gallery of optimizers: each on two test functions with known minima."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from codes_pages import literal
from matplotlib.figure import Figure

from seatruth import Budget, minimise
from seatruth.optimizers import available
from seatruth.report.figures.style import CYCLE, DASHES, styled
from seatruth.testing.problems import Known, LinearRegression, ellipsoid, linear_regression, parameters, rosenbrock

_HEAD = """# Optimizers on two test functions

Each solver with its default options, one seed, at most 4000 evaluations: the curved valley of Rosenbrock in two
dimensions, and an ellipsoid in five whose axes differ by a factor of 1000. The figure shows the best cost over
evaluations. One run of one seed shows how a solver moves, not which one is best: [compare](../compare.md) says how to
find that out.

"""
_REGRESSIONS = {"ls_svm"}
"""Solvers that no test function suits."""


def write(folder: Path) -> None:
    """Writes optimizers.md and its pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    problems = {"Rosenbrock": rosenbrock(), "ellipsoid": ellipsoid("ellipsoid", 5, 1e3)}
    text = _HEAD
    for title, problem in problems.items():
        runs, rows = {}, []
        for name, info in available().items():
            if info.error or not info.needs <= problem.cost.gives:
                continue
            found = minimise(problem.cost, name, budget=Budget(4000), seed=1)
            runs[name] = found
            rows.append(f"| `{name}` | {found.evaluations} | {found.value:.3g} | {found.code} |")
        missing = {name for name, info in available().items() if not info.error} - {*runs} - _REGRESSIONS
        if missing:  # each solver of the gallery has its two functions
            raise ValueError(f"these solvers are on no page of the gallery: {sorted(missing)}")
        figure = _figure(runs)
        file = f"optimizers_{title.lower()}.svg"
        figure.savefig(folder / file)
        text += f"## {title}\n\n![Best cost over evaluations]({file})\n\n"
        text += "| solver | evaluations | best cost | end |\n|---|---|---|---|\n" + "\n".join(rows) + "\n\n"
    text += (
        "## Two regressions\n\n`ls_svm` solves regressions only: four coefficients of three regressors and a constant "
        "from 40 noisy samples. In the second the regressors nearly repeat each other (correlation 0.999).\n\n"
        "| regression | solver | cost | least cost | largest error of a coefficient |\n|---|---|---|---|---|\n"
    )
    for title, known in {"independent regressors": linear_regression(), "collinear regressors": collinear()}.items():
        for name in (*sorted(_REGRESSIONS), "least_squares"):
            found = minimise(known.cost, name, budget=Budget(4000), seed=1)
            off = float(np.max(np.abs(found.x - known.x) / np.abs(known.x)))
            text += f"| {title} | `{name}` | {found.value:.4g} | {known.value:.4g} | {100 * off:.2g} % |\n"
    text += "\n"
    text += "## What each one is\n\n"
    text += "".join(f"- `{name}`: {literal(info.title)}\n" for name, info in available().items())
    (folder / "optimizers.md").write_text(text, encoding="utf-8")


def collinear(seed: int = 5) -> Known:
    """Forty noisy samples of a line in three regressors of which two nearly repeat the first, with a constant."""
    rng = np.random.default_rng(seed)
    one = rng.normal(size=40)
    A = np.column_stack([one, one + 0.04 * rng.normal(size=40), -one + 0.04 * rng.normal(size=40)])
    y = A @ np.array([1.5, -0.5, 0.8]) + 0.7 + 0.05 * rng.normal(size=40)
    box = parameters([1.0, -0.2, 0.5, 0.2], [-5.0] * 4, [5.0] * 4)
    cost = LinearRegression(box, A, y, intercept=True, sigma=0.05)
    x = np.linalg.lstsq(np.column_stack([A, np.ones(40)]), y, rcond=None)[0]
    return Known("collinear_regression", cost, x, float(cost.values(x[None])[0]))


@styled
def _figure(runs: dict[str, Any]) -> Figure:
    figure = Figure(figsize=(7.5, 3.4))
    axes = figure.add_axes((0.1, 0.14, 0.6, 0.8))
    for k, (name, found) in enumerate(runs.items()):
        done, best = found.history["evaluations"].to_numpy(), found.history["best"].to_numpy()
        style = {"color": CYCLE[k % 6], "linestyle": DASHES[k // 6]}
        axes.step(np.maximum(done, 1), np.maximum(best, 1e-16), where="post", label=name, **style)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("evaluations")
    axes.set_ylabel("best cost")
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0))
    return figure
