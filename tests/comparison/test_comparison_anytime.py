"""One search that serves all budgets, and searches that end at the hardest target."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_comparison import TRUTH, guess, line, small, stumble

from seatruth import BadInput
from seatruth.comparison import Noise, Problem, compare
from seatruth.optimizers import from_callable, make, minimise
from seatruth.testing.problems import rosenbrock

BUDGETS = [7, 60, 100]


def swarms(**changes: Any) -> Any:
    solvers = {"swarm": make("particle_swarm", particles=10), "cma": "cma_es", "simplex": "nelder_mead"}
    return small(solvers=solvers, budgets=BUDGETS, noise=[Noise("white", 0.05)], **changes)


def test_a_search_stands_as_a_search_with_a_smaller_budget_would(tmp_path: Path) -> None:
    one = compare(swarms(), tmp_path / "one")
    each = compare(swarms(anytime=False), tmp_path / "each")
    assert len(one.runs) == len(each.runs) == 3 * 3 * 3
    columns = ["solver", "seed", "budget", "value", "evaluations", "held_out", "excess"]
    one_runs, each_runs = (found.runs[columns].sort_values(columns[:3]).reset_index(drop=True) for found in (one, each))
    assert one_runs.equals(each_runs)
    columns = ["solver", "seed", "budget", "parameter", "value", "stderr"]
    one_runs, each_runs = (
        found.estimates[columns].sort_values(columns[:4]).reset_index(drop=True) for found in (one, each)
    )
    assert one_runs.equals(each_runs)


def test_a_smaller_budget_never_fits_better(tmp_path: Path) -> None:
    found = compare(swarms(), tmp_path)
    values = found.runs.pivot(index=["solver", "seed"], columns="budget", values="value")
    assert (values[7] >= values[60]).all()
    assert (values[60] >= values[100]).all()
    assert (values[7] > values[100]).any()
    # every history ends at its own budget
    for run in found.runs.itertuples():
        assert found.histories[str(run.key)][0].max() <= run.budget


def test_each_search_is_made_once(tmp_path: Path) -> None:
    calls = []

    def counted(problem: Any, rng: np.random.Generator) -> str:
        calls.append(1)
        return guess(problem, rng)

    made = small(solvers={"counted": from_callable(counted)}, budgets=[5, 20, 100], noise=[Noise("white", 0.05)])
    found = compare(made, tmp_path)
    assert len(calls) == 3  # one a seed; joblib runs a single worker in this process
    assert len(found.runs) == 9
    compare(made, tmp_path)
    assert len(calls) == 3


def test_a_search_that_fails_fails_at_the_budgets_that_it_did_not_outlive(tmp_path: Path) -> None:
    made = small(solvers={"stumble": from_callable(stumble)}, budgets=[3, 100], noise=[Noise("white", 0.05)])
    found = compare(made, tmp_path)
    assert dict(zip(found.runs["budget"], found.runs["status"])) == {3: "done", 100: "failed"}


def test_a_search_ends_at_the_hardest_target(tmp_path: Path) -> None:
    changes: dict[str, Any] = {"budgets": [3000], "solvers": {"cma": "cma_es"}, "targets": [10.0, 0.1]}
    whole = compare(small(**changes), tmp_path / "whole")
    short = compare(small(stop="targets", **changes), tmp_path / "short")
    assert set(short.runs["code"]) == {"target"}
    assert (short.runs["evaluations"] < whole.runs["evaluations"]).all()
    # it is near enough for every target, measured against the same best fit
    assert (short.runs["excess"] <= 0.1).all()
    for target in (10.0, 0.1):
        first, second = (
            found.success[found.success["target"] == target]["ert"].to_numpy(dtype=float) for found in (whole, short)
        )
        assert first == pytest.approx(second, rel=0.02)


def test_snapshots_of_a_search_are_its_best_so_far() -> None:
    known = rosenbrock()
    outcome = minimise(known.cost, "cma_es", seed=3, snapshots=[1, 50, 10**6])
    assert [stand.evaluations for stand in outcome.snapshots] == [1, 50, outcome.evaluations]
    assert outcome.snapshots[0].value > outcome.snapshots[1].value > outcome.snapshots[2].value == outcome.value
    for stand in outcome.snapshots:
        assert float(known.cost.values(stand.x[None])[0]) == pytest.approx(stand.value, rel=1e-12)


def test_what_cannot_stop_a_search_is_refused() -> None:
    with pytest.raises(BadInput, match="cannot stop at 'dusk'"):
        small(stop="dusk")
    assert len(small(problems=[Problem("line", line(), TRUTH)], budgets=[10, 20]).runs) == 2 * 3 * 2 * 3
