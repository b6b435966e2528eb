"""The forecast counts what is missing, and scales a short search to the whole budget."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from small_comparison import guess, small, stumble

from seatruth.comparison import Noise, compare, forecast, time_forecast
from seatruth.comparison.worker import Job, jobs_of, trial_search
from seatruth.optimizers import from_callable, make


def test_it_counts_missing_searches_and_scales_their_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def short(job: Job, evaluations: int) -> tuple[int, float, bool]:
        """2 s for a search that goes on, 0.5 s for one that ends."""
        return (evaluations, 2.0, False) if job.run.solver == "endless" else (20, 0.5, True)

    monkeypatch.setattr(time_forecast, "trial_search", short)
    changes: dict[str, Any] = {"noise": [Noise("white", 0.05)], "seeds": 3, "budgets": [100, 20_000]}
    made = small(solvers={"endless": from_callable(stumble), "guess": from_callable(guess)}, **changes)
    table = forecast(made, tmp_path).set_index("solver")
    assert dict(table["searches"]) == {"endless": 3, "guess": 3}  # one serves both budgets
    assert dict(table["seconds_each"]) == {"endless": 40.0, "guess": 0.5}  # 20 times 1000 evaluations, or to the end
    assert dict(table["seconds"]) == {"endless": 120.0, "guess": 1.5}
    compare(small(solvers={"guess": from_callable(guess)}, **changes), tmp_path)
    assert dict(forecast(made, tmp_path).set_index("solver")["searches"]) == {"endless": 3}


def test_a_short_search_ends_at_its_budget() -> None:
    made = small(solvers={"swarm": make("particle_swarm", particles=10), "guess": from_callable(guess)}, budgets=[100])
    jobs = {job.run.solver: job for job in jobs_of(made, [run for run in made.runs if run.solver])}
    assert trial_search(jobs["swarm"], 50)[0] <= 50
    assert not trial_search(jobs["swarm"], 50)[2]
    assert trial_search(jobs["guess"], 50)[2]


def test_nothing_is_left_to_forecast(tmp_path: Path) -> None:
    made = small(solvers={"swarm": make("particle_swarm", particles=10)})
    compare(made, tmp_path)
    assert not len(forecast(made, tmp_path))
