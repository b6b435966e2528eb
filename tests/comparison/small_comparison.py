"""Comparisons that take no time: a formula, and the known glide."""

from __future__ import annotations

import os
import time
from typing import Any

import known_glide
import numpy as np
import pandas as pd

from seatruth.comparison import Comparison, Noise, Problem
from seatruth.models import Parameter
from seatruth.optimizers import from_callable, make
from seatruth.study import Study, formula_study

TRUTH = {"a": 2.0, "b": -0.5}

DOZE_S = "SEATRUTH_TEST_DOZE_S"  # the variable that says how long `doze` sleeps, for a process to be killed meanwhile


def line() -> Study:
    table = pd.DataFrame({"x": np.linspace(0.0, 2.0, 40), "y": np.zeros(40)})
    parameters = [Parameter("a", 1.0, min=0.0, max=5.0, vary=True), Parameter("b", 0.0, min=-2.0, max=2.0, vary=True)]
    return formula_study("y = a * x + b * x**2", table, parameters, noise=0.1, name="line")


def glide(**changes: Any) -> Problem:
    return Problem("glide", known_glide.study(initial="fixed"), known_glide.TRUE, **changes)


def guess(problem: Any, rng: np.random.Generator) -> str:
    problem.values(problem.sample(rng, 50))
    return "fifty tried"


def stumble(problem: Any, rng: np.random.Generator) -> str:
    problem.values(problem.sample(rng, 5))
    raise RuntimeError("stumbled on purpose")


def solvers() -> dict[str, Any]:
    return {
        "local": make("least_squares"),
        "swarm": make("particle_swarm", particles=10),
        "guess": from_callable(guess),
    }


def small(**changes: Any) -> Comparison:
    fields: dict[str, Any] = {
        "problems": [Problem("line", line(), TRUTH)],
        "solvers": solvers(),
        "noise": [Noise("white", 0.0), Noise("white", 0.05)],
        "seeds": 3,
        "budgets": [100],
        "name": "small",
        **changes,
    }
    return Comparison(**fields)


def numbers(results: Any) -> pd.DataFrame:
    """Everything of the runs that must not depend on when and by whom they were made."""
    timeless = ["search_s", "scoring_s", "finished_utc", "source"]
    return results.runs.drop(columns=timeless).sort_values("key", ignore_index=True)


def doze(problem: Any, rng: np.random.Generator) -> str:
    problem.values(problem.sample(rng, 20))
    time.sleep(float(os.environ.get(DOZE_S, "0.05")))
    return "it dozed off"


def slow() -> Comparison:
    """Some seconds of runs, so that it can be killed in their midst."""
    return small(solvers={"doze": from_callable(doze), "swarm": make("particle_swarm", particles=10)}, seeds=8)
