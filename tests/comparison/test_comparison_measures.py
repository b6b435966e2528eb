"""What is measured: against numbers that are known without the code."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from small_comparison import TRUTH, glide, line, small

from seatruth.comparison import Noise, Problem, compare, optimisation, ranks, text
from seatruth.comparison.noise import realise
from seatruth.optimizers import make
from seatruth.trials import Trial


def runs(*rows: dict[str, Any]) -> pd.DataFrame:
    usual = {"problem": "p", "cost": "trajectory", "noise": "white", "level": 0.01, "budget": 100, "status": "done"}
    usual |= {"best": 0.0, "dimension": 2, "held_out": None, "excess": 0.0}
    return pd.DataFrame([usual | {"key": str(k), "instance": f"i{row['seed']}"} | row for k, row in enumerate(rows)])


def test_expected_running_time_counts_what_failures_cost() -> None:
    frame = runs(
        {"solver": "s", "seed": 0, "evaluations": 60},
        {"solver": "s", "seed": 1, "evaluations": 100},
        {"solver": "s", "seed": 2, "evaluations": None, "status": "failed"},
    )
    histories = {
        "0": (np.array([10.0, 40.0, 60.0]), np.array([9.0, 0.4, 0.0]), np.array([1.0, 2.0, 3.0])),
        "1": (np.array([10.0, 100.0]), np.array([9.0, 3.0]), np.array([1.0, 5.0])),
        "2": (np.array([]), np.array([]), np.array([])),
    }
    table = optimisation.success(frame, histories, (1.0, 100.0)).set_index("target")
    # an excess of 2 x 0.4 counts as reached; a run that failed costs its budget
    assert table.loc[1.0, "success_rate"] == pytest.approx(1 / 3)
    assert table.loc[1.0, "ert"] == 40 + 100 + 100
    assert table.loc[100.0, "ert"] == (10 + 10 + 100) / 2
    ecdf = optimisation.ecdf(frame, histories, (1.0, 100.0))
    assert list(ecdf["evaluations"]) == [5.0, 20.0]
    assert list(ecdf["share"]) == pytest.approx([2 / 6, 3 / 6])


def test_performance_profiles() -> None:
    frame = runs(
        {"solver": "a", "seed": 0, "evaluations": 10},
        {"solver": "b", "seed": 0, "evaluations": 30},
        {"solver": "a", "seed": 1, "evaluations": 10},
        {"solver": "b", "seed": 1, "evaluations": 10},
    )
    done = (np.array([10.0]), np.array([0.0]), np.array([1.0]))
    late = (np.array([30.0]), np.array([0.0]), np.array([1.0]))
    never = (np.array([10.0]), np.array([50.0]), np.array([1.0]))
    table = optimisation.profiles(frame, {"0": done, "1": late, "2": never, "3": done}, 1.0)
    a, b = (table[table["solver"] == name] for name in "ab")
    assert list(zip(a["factor"], a["share"])) == [(1.0, 0.5)]
    assert list(zip(b["factor"], b["share"])) == [(1.0, 0.5), (3.0, 1.0)]


def scored(values: np.ndarray) -> pd.DataFrame:
    rows = [
        {"problem": "p", "cost": "c", "noise": "white", "level": 0.01, "seed": seed, "solver": f"s{k}", "fit": value}
        for seed, row in enumerate(values)
        for k, value in enumerate(row)
    ]
    return pd.DataFrame(rows)


def test_a_clear_winner_is_told_and_equals_are_not() -> None:
    rng = np.random.default_rng(0)
    base = rng.standard_normal((20, 1))
    values = base + np.array([0.0, 0.5, 0.5]) + 0.05 * rng.standard_normal((20, 3))
    made = ranks.rank_solvers(scored(values), "fit", {}, ["s0", "s1", "s2"])
    assert made is not None
    assert made.order[0] == "s0"
    assert made.p_friedman < 1e-4
    assert made.differ("s0", "s1")
    assert made.differ("s2", "s0")
    assert not made.differ("s1", "s2")
    assert made.groups == (tuple(made.order[1:]),)
    assert made.pair("s0", "s1")["ratio"] == pytest.approx(10**-0.5, rel=0.2)
    assert made.pair("s1", "s0")["effect"] == pytest.approx(1.0)


@pytest.mark.slow
def test_false_alarms_stay_below_five_per_cent() -> None:
    rng = np.random.default_rng(1)
    alarms = 0
    for _ in range(200):
        made = ranks.rank_solvers(scored(rng.standard_normal((12, 4))), "fit", {}, ["s0", "s1", "s2", "s3"])
        assert made is not None
        alarms += bool((made.pairs["p_holm"] < 0.05).any())
    assert alarms <= 18  # 200 x 5 %, and three standard errors


def test_solvers_that_are_the_same_tie() -> None:
    made = ranks.rank_solvers(scored(np.zeros((10, 3))), "fit", {}, ["s0", "s1", "s2"])
    assert made is not None
    assert made.p_friedman == 1.0
    assert list(made.pairs["ties"]) == [10, 10, 10]
    assert made.groups == (("s0", "s1", "s2"),)


T = Trial("t", np.arange(20_000) * 0.1, {"u": np.zeros(20_000)}, {"y": np.zeros(20_000)})


def draw(kind: str, **options: float) -> Trial:
    return realise(Noise(kind, 0.1, options), T, {"y": 2.0}, {"u": 0.5}, np.random.default_rng(0), first=True)


def test_kinds_of_noise_have_their_size_and_colour() -> None:
    white, coloured = draw("white").outputs["y"], draw("coloured", samples=10).outputs["y"]
    assert np.std(white) == pytest.approx(2.0, rel=0.03)
    assert np.std(coloured) == pytest.approx(2.0, rel=0.1)
    assert np.corrcoef(white[1:], white[:-1])[0, 1] == pytest.approx(0.0, abs=0.03)
    assert np.corrcoef(coloured[1:], coloured[:-1])[0, 1] == pytest.approx(math.exp(-0.1), abs=0.01)
    wild = draw("outliers", share=0.05, size=10).outputs["y"]
    assert np.mean(np.abs(wild) > 8.0) == pytest.approx(0.05 * 0.69, abs=0.01)
    lost = np.isnan(draw("dropouts", share=0.3, length=8).outputs["y"])
    assert lost.mean() == pytest.approx(0.3, abs=0.03)
    assert lost.sum() / np.count_nonzero(lost[1:] & ~lost[:-1]) == pytest.approx(8, rel=0.15)
    noisy = draw("input")
    assert np.std(noisy.inputs["u"]) == pytest.approx(0.5, rel=0.03)
    assert not np.isnan(noisy.inputs["u"]).any()


@pytest.mark.slow
def test_an_efficient_fit_has_rmse_on_the_bound_and_honest_intervals(tmp_path: Path) -> None:
    comparison = small(
        problems=[Problem("line", line(), TRUTH), glide()],
        solvers=[make("least_squares")],
        noise=[Noise("white", 0.03)],
        seeds=60,
        budgets=[300],
    )
    results = compare(comparison, tmp_path)
    table = results.overall.set_index("problem")
    for name in ("line", "glide"):
        assert table.loc[name, "efficiency"] == pytest.approx(1.0, abs=0.25)
        assert table.loc[name, "coverage"] == pytest.approx(0.95, abs=0.06)
        parts = results.accuracy[results.accuracy["problem"] == name]
        assert (parts["bias"].abs() < 4 * parts["bias_se"]).all()
    held = results.runs.query("problem == 'glide'")["held_out"].astype(float)
    assert (held < 0.05).all()
    assert results.runs.query("problem == 'line'")["held_out"].isna().all()


def test_without_a_truth_errors_are_left_empty(tmp_path: Path) -> None:
    problem = Problem("glide", glide().study)
    results = compare(small(problems=[problem], noise=[Noise("white", 0.02)], budgets=[150]), tmp_path)
    assert results.overall["error_percent"].isna().all()
    assert results.overall["coverage"].isna().all()
    assert (results.overall["held_out"] > 0).all()
    assert any("are not known" in str(said) for said in results.conclusions)
    made = results.ranking("accuracy")
    assert made is not None
    assert made.order[-1] == "guess"


def test_a_solver_that_fits_some_problems_only_leaves_the_ranking_to_the_others() -> None:
    rng = np.random.default_rng(2)
    both = pd.concat(
        [scored(rng.standard_normal((12, 3))), scored(rng.standard_normal((12, 2))).assign(problem="q")],
        ignore_index=True,
    )
    made = ranks.rank_solvers(both, "fit", {}, ["s0", "s1", "s2"])
    assert made is not None
    assert made.incomplete == ("s2",)
    assert (made.blocks, made.block_kind) == (24, "realisation")
    here = ranks.rank_solvers(both, "fit", {"problem": "p"}, ["s0", "s1", "s2"])
    assert here is not None
    assert sorted(here.order) == ["s0", "s1", "s2"]


def test_many_conditions_are_blocks_of_their_own() -> None:
    rng = np.random.default_rng(3)
    parts = [scored(rng.standard_normal((5, 3))).assign(problem=f"p{k}") for k in range(12)]
    made = ranks.rank_solvers(pd.concat(parts, ignore_index=True), "fit", {}, ["s0", "s1", "s2"])
    assert made is not None
    assert (made.blocks, made.block_kind) == (12, "condition")


def test_solvers_that_tie_share_the_best_rank() -> None:
    """All but the last always reach the same fit: none of them alone is the best."""
    order = [*"abc", "d"]
    table = pd.DataFrame({"solver": order, "mean_rank": [2.4, 2.4, 2.4, 2.8]})
    pairs = pd.DataFrame([{"first": a, "second": b, "p_holm": 0.5} for a, b in itertools.combinations(order, 2)])
    pairs = pairs.assign(wins=0, losses=0, ratio=1.0, effect=0.0, p_better=0.0, p_alike=1.0, p_worse=0.0)
    results: Any = None
    tied = ranks.Ranking("fit", 45, "realisation", 0.004, table, pairs, ())
    (said,) = text._ranking_sentences(results, tied, "formula")
    assert "a, b and c share the best mean rank (2.4 of 4), but the data distinguish them from no single" in said
    table.loc[1:2, "mean_rank"] = 2.5
    (said,) = text._ranking_sentences(results, tied, "formula")
    assert "a has the best mean rank (2.4 of 4), but the data distinguish it from" in said
