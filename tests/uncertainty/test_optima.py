"""Optima of a multi-start: which ends are one, which exclude each other, and what that does to the verdicts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatruth import Estimate, identify
from seatruth.costs import cost_of
from seatruth.models import Parameter
from seatruth.optimizers import Budget, minimise
from seatruth.study import formula_study
from seatruth.uncertainty.optima import indistinguishable, optima

CODES = ("exclusive-optima", "optimum-found-once", "better-optimum")


def fitted(text: str, y: Any, parameters: list[Parameter], **arguments: Any) -> Estimate:
    rng = np.random.default_rng(1)
    u = np.linspace(-2.0, 2.0, 60)
    data = {"u": u, "y": y(u) + 0.05 * rng.standard_normal(60)}
    study = formula_study(text, data, parameters, noise=0.05)
    return identify(study, threads=1, **arguments)


def codes(estimate: Estimate) -> list[str]:
    return [finding.code for finding in estimate.findings if finding.code in CODES]


def squared(**arguments: Any) -> Estimate:
    """y = a^2 u + b: two values of a exclude each other, and nothing in the data chooses."""
    parameters = [
        Parameter("a", 0.5, min=-3.0, max=3.5, vary=True),
        Parameter("b", 0.0, min=-2.0, max=2.0, vary=True),
    ]
    return fitted("y = a**2 * u + b", lambda u: 1.5**2 * u + 0.7, parameters, **arguments)


def test_two_exclusive_optima_leave_what_differs_between_them_in_doubt() -> None:
    alone = squared()
    assert list(alone.parameters["verdict"]) == ["identified", "identified"]
    assert alone.starts is None
    found = squared(starts=8)
    assert codes(found) == ["exclusive-optima"]
    assert list(found.parameters["verdict"]) == ["doubtful", "identified"]
    assert found.starts is not None
    assert set(found.starts["optimum"]) == {1, 2}
    ends = found.starts.groupby("optimum")["end a"].mean()
    assert abs(ends[1]) == pytest.approx(1.5, abs=0.02)
    assert ends[1] == pytest.approx(-ends[2], abs=1e-4)
    message = next(finding.message for finding in found.findings if finding.code == "exclusive-optima")
    assert "differ in a (a = " in message


def wave(start: float, **arguments: Any) -> Estimate:
    """y = sin(w u): most values of w end at a wrong number of waves."""
    parameters = [Parameter("w", start, min=0.5, max=15.0, vary=True)]
    return fitted("y = sin(w * u)", lambda u: np.sin(6.0 * u), parameters, **arguments)


def test_a_better_optimum_from_another_start_is_taken_and_said() -> None:
    assert wave(2.0).values["w"] != pytest.approx(6.0, abs=0.5)
    found = wave(2.0, starts=24)
    assert found.values["w"] == pytest.approx(6.0, abs=0.05)
    assert "better-optimum" in codes(found)
    assert found.starts is not None
    assert found.outcome["evaluations"] == found.starts["evaluations"].sum()
    assert found.starts["cost"].min() == found.outcome["value"]


def test_an_optimum_that_one_of_three_starts_found_is_doubted() -> None:
    found = wave(6.2, starts=3, seed=0)
    assert found.starts is not None
    assert (found.starts["optimum"] == 1).sum() == 1
    assert "optimum-found-once" in codes(found)
    assert list(found.parameters["verdict"]) == ["doubtful"]


def test_ends_that_stopped_short_and_ends_along_a_flat_valley_are_one_optimum() -> None:
    """a and b alone do nothing but by their product; a budget of few evaluations ends on the slope."""
    parameters = [Parameter(name, 1.0, min=0.1, max=4.0, vary=True) for name in ("a", "b")]
    found = fitted("y = a * b * u", lambda u: 2.0 * u, parameters, starts=6, budget=Budget(evaluations=7))
    assert found.starts is not None
    assert set(found.starts["code"]) == {"budget"}
    assert found.starts["end a"].std() > 0.1
    assert set(found.starts["optimum"]) == {1}
    assert set(found.parameters["verdict"]) == {"not identifiable"}


def test_a_start_without_finite_cost_belongs_to_no_optimum() -> None:
    parameters = [Parameter("a", 1.0, min=0.0, max=4.0, vary=True)]
    u = np.linspace(0.0, 1.0, 9)
    cost = cost_of(formula_study("y = a * u", {"u": u, "y": 2.0 * u}, parameters, noise=0.1))
    good = minimise(cost)
    lost = replace(good, value=np.inf, code="failed")
    found = optima(cost, np.array([[1.0], [2.0]]), [good, lost], np.array([0.1]), 1.0)
    assert list(found.table["optimum"]) == [1, 0]
    assert (found.count, found.rivals, found.gain) == (1, (), 0.0)


def test_what_can_be_told_apart_grows_with_the_residuals() -> None:
    assert indistinguishable(1.0) == pytest.approx(1.92, abs=0.01)
    assert indistinguishable(3.0) == pytest.approx(9 * 1.92, abs=0.1)
    assert indistinguishable(0.2) == indistinguishable(1.0)
