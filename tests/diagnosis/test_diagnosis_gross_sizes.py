"""Sizes far beyond what is believed, which priors would hold back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.gross_sizes import held_back, with_gross_sizes
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial

GROSS = math.radians(8.0)
"""rad/s, of a gyro that nobody calibrated: sixty deviations of what is believed."""


@pytest.fixture(scope="module")
def runs(ship_folder: Path) -> list[Trial]:
    return small.trials(ship_folder, {"gyro_bias_b": GROSS}, specs=["gyro_bias"])


def test_a_gross_error_is_as_large_as_the_trials_say_and_still_beyond_belief(
    ship_folder: Path, runs: list[Trial]
) -> None:
    found = small.diagnosed(ship_folder, runs)
    (named,) = found.verdict.causes
    assert named.effects == ("gyro_bias",)
    (bias,) = next(effect for effect in found.effects if effect.name == "gyro_bias").parameters
    assert abs(bias.value - GROSS) < 3.0 * bias.stderr < 0.01 * GROSS
    assert named.implausible
    assert bias.prior_sd == pytest.approx(0.0025), "what is believed stays"
    assert "beyond what is believed" in found.verdict.sentence


def test_a_prior_that_moves_a_size_within_its_error_stays(ship_folder: Path, offset_runs: list[Trial]) -> None:
    problem = small.problem(ship_folder, offset_runs)
    found = search(problem, small.silent)
    assert found.leader.effects == ("rudder_offset",)
    assert held_back(found) == {}
    assert found.problem is problem
    # Forty times as sure of the usual size, that prior holds the same offset back.
    columns = problem.columns["rudder_offset"]
    size, error = found.leader.point.shared[columns[0]], found.leader.stderr(problem)[columns[0]]
    problem.sd[columns] = problem.believed_sd[columns] = 1.05 * error
    (factor,) = held_back(found).values()
    alone = size / (1.0 - 1.0 / 1.05**2)
    assert factor == pytest.approx(min(64.0, alone / (1.05 * error) / 2.0))


class _Found:
    """A search with what its priors hold back, by hand."""

    interrupted = False

    def __init__(self, problem: Problem) -> None:
        self.problem = problem


@pytest.mark.parametrize("end", ["interrupt", "algebra"])
def test_what_was_reached_stands_where_the_search_with_wider_priors_ends_early(
    ship_folder: Path, runs: list[Trial], end: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = small.problem(ship_folder, runs)
    first = cast(Search, _Found(problem))
    asked = list[Sequence[tuple[str, float]]]()
    monkeypatch.setattr("seatruth.diagnosis.gross_sizes.held_back", lambda found: {"gyro_bias": 7.0})

    def again(wider: Problem) -> Any:
        asked.append(wider.settings.wider)
        if end == "algebra":
            raise np.linalg.LinAlgError("no")
        stopped = _Found(wider)
        stopped.interrupted = True
        return stopped

    assert with_gross_sizes(first, problem, again) is first
    assert asked == [(("gyro_bias", 7.0),)]
    assert first.interrupted == (end == "interrupt")


def test_priors_get_wider_a_few_times_at_most(
    ship_folder: Path, runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = small.problem(ship_folder, runs)
    monkeypatch.setattr("seatruth.diagnosis.gross_sizes.held_back", lambda found: {"gyro_bias": 2.0})
    last = with_gross_sizes(cast(Search, _Found(problem)), problem, lambda wider: cast(Search, _Found(wider)))
    assert last.problem.settings.wider == (("gyro_bias", 8.0),)
