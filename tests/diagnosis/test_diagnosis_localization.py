"""Where and how far: false alarms under noise, and closure against hand-made folds."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import small_case as small
from seatruth.diagnosis.cross_validation.gap_explained import Fold, _closure, how_far

from seatruth.diagnosis.hypotheses import Search, floor_of, search
from seatruth.diagnosis.localization import by_channel, in_region, in_time, shares
from seatruth.diagnosis.problem import GapProblem
from seatruth.effects import load_effects


def quiet(text: str) -> None:
    """No progress."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.folder_with_model(tmp_path_factory.mktemp("where"))


@pytest.fixture(scope="module")
def problem(folder: Path) -> GapProblem:
    runs = small.trials(folder, {"rudder_offset_angle": 0.02}, specs=["rudder_offset"])
    return GapProblem(small.study(folder, runs), load_effects(small.EFFECTS), threads=1)


@pytest.fixture(scope="module")
def found(problem: GapProblem) -> Search:
    floor, full, plain = floor_of(problem, quiet)
    return search(problem, floor, full.x, plain.x, quiet)


def noise(problem: GapProblem, rng: np.random.Generator) -> Any:
    """A fit that left nothing but white noise."""
    return SimpleNamespace(x=problem.start, linear=SimpleNamespace(errors=rng.normal(size=problem.rows)))


def test_under_noise_alone_hardly_anything_stands_out_in_time(problem: GapProblem) -> None:
    rng = np.random.default_rng(1)
    alarms = [any(row["stands_out"] for row in in_time(problem, noise(problem, rng))) for _ in range(300)]
    assert np.mean(alarms) < 0.09  # 5 % and what 300 draws leave open


@pytest.mark.slow
def test_under_noise_alone_hardly_anything_stands_out_in_the_region(problem: GapProblem) -> None:
    rng = np.random.default_rng(2)
    alarms = [any(r["stands_out"] for r in in_region(problem, noise(problem, rng), k)) for k in range(60)]
    assert np.mean(alarms) < 0.15


def test_a_gap_at_one_time_and_in_one_region_is_found_there(problem: GapProblem) -> None:
    at = noise(problem, np.random.default_rng(3))
    late = (problem.trial_of == 1) & (problem.time_of > 100.0)
    at.linear.errors[late] *= 2.5
    cells = [row for row in in_time(problem, at) if row["stands_out"]]
    assert {row["trial"] for row in cells} == {"run_1"}
    assert min(row["from_s"] for row in cells) > 85.0
    at = noise(problem, np.random.default_rng(4))
    deltas = np.concatenate([np.asarray(t.inputs["delta"]) for t in problem.trials])
    first = np.cumsum([0, *(len(t) for t in problem.trials)])
    starboard = deltas[first[problem.trial_of] + problem.sample_of] > math.radians(5.0)
    at.linear.errors[starboard] *= 3.0
    cells = [row for row in in_region(problem, at) if row["stands_out"]]
    assert "delta" in {row["variable"] for row in cells}


def test_the_same_seed_gives_the_same_cells(problem: GapProblem) -> None:
    at = noise(problem, np.random.default_rng(5))
    assert in_region(problem, at, 7) == in_region(problem, at, 7)


def test_the_parts_of_the_misfit_add_up(problem: GapProblem, found: Search) -> None:
    best = found.fits[("rudder_offset",)]
    split = shares(found.base.misfit, found.base.misfit, best.misfit, problem.rows)
    assert sum(split[key] for key in ("noise", "parameters", "effects", "left")) == pytest.approx(1.0)
    assert split["parameters"] == pytest.approx(0.0)
    assert split["effects"] > 0.9
    rows = by_channel(problem, found.floor, {"refit": found.base, "effect": best})
    assert all(row["multiple_effect"] < 1.4 for row in rows)
    assert max(row["multiple_refit"] for row in rows) > 5.0


def folds(refit: list[float], effect: list[float]) -> list[Fold]:
    return [
        Fold(f"run {k}", "turn" if k % 2 else "zigzag", ("a",), 9.0, r, e, 1.0)
        for k, (r, e) in enumerate(zip(refit, effect))
    ]


def test_closure_is_the_part_of_the_gap_above_noise_that_is_gone() -> None:
    got = _closure(folds([5.0, 3.0], [2.0, 2.0]))
    assert got["closure"]["value"] == pytest.approx((4.0 - 2.0) / (4.0 - 1.0))
    assert got["errors"]["refit"] == pytest.approx(4.0)
    assert {row["manoeuvre"]: row["effect"] for row in got["by_manoeuvre"]} == {"turn": 2.0, "zigzag": 2.0}
    assert _closure(folds([5.0, 3.0], [1.0, 1.0]))["closure"]["value"] == pytest.approx(1.0)
    assert _closure(folds([5.0, 3.0], [5.0, 3.0]))["closure"]["value"] == pytest.approx(0.0)
    assert _closure(folds([5.0, 3.0], [9.0, 3.0]))["closure"]["value"] < 0.0


def test_closure_s_interval_holds_it_and_is_wider_for_trials_that_differ() -> None:
    same = _closure(folds([5.0] * 6, [2.0] * 6))["closure"]
    assert same["lower"] == pytest.approx(same["value"]) == pytest.approx(same["upper"])
    mixed = _closure(folds([5.0] * 6, [1.0, 4.0] * 3))["closure"]
    assert mixed["lower"] < mixed["value"] < mixed["upper"]
    assert mixed["upper"] - mixed["lower"] > 0.2


def test_the_interval_of_five_trials_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    held, many = 0, 400
    for _ in range(many):
        gaps = rng.lognormal(0.5, 0.5, 5)
        left = gaps * rng.uniform(0.1, 0.5, 5)
        got = _closure(folds((1.0 + gaps).tolist(), (1.0 + left).tolist()))["closure"]
        held += got["lower"] <= 0.7 <= got["upper"]
    assert 0.90 <= held / many <= 0.98


def test_where_refitting_leaves_only_noise_there_is_no_closure() -> None:
    got = _closure(folds([1.0, 1.02], [1.0, 1.0]))["closure"]
    assert got is None or math.isnan(got["value"])


def test_trials_left_out_are_predicted_by_the_effect_that_the_others_choose(found: Search) -> None:
    got = how_far(found, found, None, [("rudder_offset",), ("gyro_bias",)], quiet)
    assert [fold["chosen"] for fold in got["folds"]] == [["rudder_offset"]] * 4
    assert got["closure"]["value"] > 0.95
    assert got["errors"]["effect"] < 1.5
    assert math.isnan(got["errors"]["flexible"])
