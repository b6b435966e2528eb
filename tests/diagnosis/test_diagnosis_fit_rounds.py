"""Rounds of a fit: steps and sizes take turns, and what is only promised is not credited."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small
from small_case import fitted

from seatruth.diagnosis import fit as fit_module
from seatruth.diagnosis.fit import fit
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import Sizes, noise_prior
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    return small.problem(ship_folder, offset_runs)


def where_it_is(*given: object) -> tuple[object, ...]:
    """No steps under the final sizes: the point, the value and what is ahead of it as they were."""
    _, _, point, _, _, _, value, left = given
    return point, value, left


def test_steps_under_the_final_sizes_take_what_these_leave_ahead(problem: Problem) -> None:
    good = fitted(problem, ("rudder_offset",))
    away = replace(good.point, shared=good.point.shared + 3.0 * good.stderr(problem))
    point, value, ahead = fit_module._under_them(
        problem, good.effects, away, good.sizes, noise_prior(problem), False, good.evidence, 40.0
    )
    assert ahead < 0.1
    free = good.solution.free
    assert (np.abs(point.shared - good.point.shared)[free] < 0.3 * good.stderr(problem)[free]).all()
    assert value > good.evidence - 10.0


def test_a_point_with_nothing_ahead_of_it_stays(problem: Problem) -> None:
    good = fitted(problem, ("rudder_offset",))
    point, value, left = fit_module._under_them(
        problem, good.effects, good.point, good.sizes, noise_prior(problem), False, 1e9, 0.0
    )
    assert point is good.point
    assert (value, left) == (1e9, 0.0)


@pytest.mark.parametrize(("ahead", "rounds"), [((5.0, 0.0), 2), ((5.0,) * 9, 2), ((0.0,), 1)])
def test_a_point_is_sought_again_where_new_sizes_leave_much_ahead(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, ahead: tuple[float, ...], rounds: int
) -> None:
    """A fit of a towed model had 35 nats ahead, which one step took; where steps cannot take them, it ends."""
    good, left = fitted(problem, ("rudder_offset",)), iter(ahead)
    ends: list[Point] = []

    def final(
        problem: Problem, effects: Sequence[str], point: Point, sizes: Sizes, *rest: object
    ) -> tuple[object, ...]:
        ends.append(point)
        return sizes, good.evidence, 0.0, next(left)

    monkeypatch.setattr(fit_module, "_final_sizes", final)
    monkeypatch.setattr(fit_module, "_under_them", where_it_is)
    fit(problem, good.effects, good.point, good.sizes, noise_prior(problem), discrepancy=False)
    assert len(ends) == rounds


def test_promises_that_grow_with_the_sizes_end_a_fit(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a ferry whose rudder stood off, fits of other effects went on for six rounds, each promising more than before
    and reaching less; the best point stands."""
    good = fitted(problem, ("rudder_offset",))
    rounds = iter([(100.0, 50.0), (180.0, 160.0), (400.0, 0.0)])
    ends: list[Point] = []

    def final(
        problem: Problem, effects: Sequence[str], point: Point, sizes: Sizes, *rest: object
    ) -> tuple[object, ...]:
        ends.append(point)
        value, left = next(rounds)
        return sizes, value, 10.0, left

    monkeypatch.setattr(fit_module, "_final_sizes", final)
    monkeypatch.setattr(fit_module, "_under_them", where_it_is)
    away = replace(good.point, shared=good.point.shared + 0.1 * np.abs(good.point.shared))
    found = fit(problem, good.effects, away, good.sizes, noise_prior(problem), discrepancy=False)
    assert len(ends) == 2
    assert found.point is ends[0]
