"""Where the gap lies: by channel, in time and over the operating region."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis import localization as module
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.localization import BLOCKS, by_channel, in_region, in_time, shares, whitened
from seatruth.diagnosis.prediction_errors import noise_deviation
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def found(ship_folder: Path, plain_runs: list[Trial]) -> Search:
    return search(small.problem(ship_folder, plain_runs), small.silent)


def test_errors_by_channel(found: Search) -> None:
    problem = found.problem
    deviation = noise_deviation(problem, found.null.sizes)
    table = by_channel(problem, deviation, {"before": problem.start, "refit": found.null.point})
    assert len(table) == 8
    assert set(table["unit"]) == {"rad", "rad/s"}
    errors = problem.errors(problem.start)
    here = (problem.trial_of == 1) & (problem.channel_of == 0)
    row = table[(table["trial"] == "run_1") & (table["channel"] == "r")].iloc[0]
    assert row["n"] == here.sum()
    assert row["rmse_before"] == pytest.approx(math.sqrt(np.mean(errors[here] ** 2)))
    assert row["multiple_before"] == pytest.approx(row["rmse_before"] / row["noise"])
    assert (table["multiple_refit"] < 1.3).all()


def test_where_nothing_but_noise_is_left_whitened_errors_are_standard_normal(found: Search) -> None:
    white = whitened(found.problem, found.problem.errors(found.null.point), found.null.sizes)
    assert white.var() == pytest.approx(1.0, abs=0.15)
    assert abs(white.mean()) < 0.15


def test_shares_sum_to_one() -> None:
    for sums in [(1000.0, 500.0, 110.0), (1000.0, 100.0, 90.0), (90.0, 100.0, 120.0), (500.0, math.inf, 200.0)]:
        split = shares(*sums, rows=100)
        assert split.noise + split.parameters + split.effects + split.left == pytest.approx(1.0)
        assert min(split.noise, split.parameters, split.effects, split.left) >= 0.0
    split = shares(1000.0, 500.0, 150.0, rows=100)
    assert (split.noise, split.parameters, split.effects, split.left) == pytest.approx((0.1, 0.5, 0.35, 0.05))
    assert (split.misfit_before, split.misfit_refit, split.misfit_effects) == pytest.approx((10.0, 5.0, 1.5))


def test_a_time_with_a_gap_is_seen_and_the_others_are_not(found: Search) -> None:
    problem = found.problem
    errors = np.random.default_rng(0).normal(size=problem.count)
    errors[(problem.trial_of == 2) & (problem.time_of > 60.0) & (problem.time_of < 69.0)] += 3.0
    table = in_time(problem, errors)
    assert len(table) == 4 * BLOCKS
    assert table["n"].sum() == problem.count
    seen = table[table["significant"]]
    assert set(seen["trial"]) == {"run_2"}
    assert seen["from_s"].between(45.0, 70.0).all()


def test_noise_alone_is_seldom_called_a_gap(found: Search) -> None:
    """The false discovery rate bounds the probability of any false alarm by 5 %."""
    alarms = 0
    for seed in range(60):
        errors = np.random.default_rng(seed).normal(size=found.problem.count)
        alarms += bool(in_time(found.problem, errors)["significant"].any())
    assert alarms <= 8


def region_errors(problem: Problem, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=problem.count)


def test_a_gap_at_large_rudder_angles_is_seen_there(found: Search) -> None:
    problem = found.problem
    errors = region_errors(problem, 1)
    delta = np.concatenate([np.asarray(t.inputs["delta"]) for t in problem.trials])
    at = np.array([int(120 * trial + sample) for trial, sample in zip(problem.trial_of, problem.sample_of)])
    errors[delta[at] > math.radians(17.0)] *= 3.0
    table = in_region(problem, errors, found.null.point)
    assert {"yaw rate", "heading", "delta"} <= set(table["variable"])
    rudder = table[table["variable"] == "delta"].sort_values("misfit").iloc[-1]
    assert rudder["to"] > math.radians(17.0)
    assert rudder["p"] < 0.05


def test_the_region_is_the_same_for_the_same_seed(found: Search) -> None:
    errors = region_errors(found.problem, 2)
    one, other = (in_region(found.problem, errors, found.null.point, seed=4) for _ in range(2))
    assert one.equals(other)


def test_a_channel_that_no_trial_recorded(ship_folder: Path, plain_runs: list[Trial]) -> None:
    bare = [dataclasses.replace(t, outputs={"r": t.outputs["r"]}) for t in plain_runs[:2]]
    problem = small.problem(ship_folder, bare)
    table = by_channel(problem, np.array([0.001, math.nan]), {"before": problem.start})
    assert set(table["channel"]) == {"r"}


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_run_that_diverges_is_as_far_off_as_can_be_and_in_no_cell(found: Search) -> None:
    """A rudder gain of 1e300: states overflow, or would when they are squared."""
    problem = found.problem
    shared = found.null.point.shared.copy()
    shared[[q.name for q in problem.unknowns].index("K")] = 1e300
    point = dataclasses.replace(found.null.point, shared=shared)
    errors = problem.errors(point)
    assert np.isinf(errors).any()
    assert all(np.isfinite(values).all() or np.isnan(values).any() for values in problem.states(point))
    white = whitened(problem, errors, found.null.sizes)
    assert not np.isnan(white).any()
    table = by_channel(problem, noise_deviation(problem, found.null.sizes), {"refit": point})
    assert np.isinf(table["rmse_refit"]).any()
    times = in_time(problem, white)
    assert np.isinf(times["misfit"]).any()
    assert times.loc[np.isinf(times["misfit"]), "significant"].all()
    assert not in_region(problem, white, point)["p"].isna().any()


def test_an_end_that_is_zero_but_for_rounding_is_zero() -> None:
    values = np.concatenate([np.linspace(-8.0, 0.0, 50), np.full(200, 1.5e-22), np.linspace(0.1, 7.0, 50)])
    ends = {end for _, low, high, _ in module._cells("r", values) for end in (low, high)}
    assert 0.0 in ends
    assert all(end == 0.0 or abs(end) > 1e-6 for end in ends)
