"""The forecast counts what is missing, and scales a short search to the whole budget."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from small_comparison import guess, small

from seatruth.comparison import Noise, compare, forecast
from seatruth.optimizers import from_callable, make


def endless(problem: Any, rng: np.random.Generator) -> str:
    while True:
        problem.values(problem.sample(rng, 50))


def test_it_counts_missing_searches_and_scales_their_time(tmp_path: Path) -> None:
    changes: dict[str, Any] = {"noise": [Noise("white", 0.05)], "seeds": 3, "budgets": [100, 20_000]}
    made = small(solvers={"endless": from_callable(endless), "guess": from_callable(guess)}, **changes)
    table = forecast(made, tmp_path).set_index("solver")
    assert dict(table["searches"]) == {"endless": 3, "guess": 3}  # one serves both budgets
    assert (table["seconds"] >= table["seconds_each"]).all()
    # twenty times the short search for the one that goes on, the short search itself for the one that ends
    assert table.loc["endless", "seconds_each"] > 5 * table.loc["guess", "seconds_each"]
    compare(small(solvers={"guess": from_callable(guess)}, **changes), tmp_path)
    assert dict(forecast(made, tmp_path).set_index("solver")["searches"]) == {"endless": 3}


def test_nothing_is_left_to_forecast(tmp_path: Path) -> None:
    made = small(solvers={"swarm": make("particle_swarm", particles=10)})
    compare(made, tmp_path)
    assert not len(forecast(made, tmp_path))
