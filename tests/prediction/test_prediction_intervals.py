"""Intervals of figures whose distribution is known."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.prediction.intervals import interval, model_error, widened
from seatruth.prediction.parameter_draws import ParameterDraws

RNG = np.random.default_rng(0)
TRIALS, PRIORS = np.diag([1.0, 0.0]), np.diag([0.0, 4.0])
X = RNG.standard_normal((4000, 2)) * [1.0, 2.0]
DRAWN = ParameterDraws(("a", "b"), np.zeros(2), TRIALS, PRIORS, TRIALS + PRIORS, 1e6, 1.0, (), X)


@settings(max_examples=25, deadline=None)
@given(a=st.floats(0.1, 3.0), b=st.floats(-2.0, 2.0), level=st.sampled_from([0.8, 0.95]))
def test_a_linear_figure_has_its_normal_interval_and_its_share(a: float, b: float, level: float) -> None:
    found = interval(10.0 + X @ [a, b], DRAWN, level)
    sd = math.hypot(a, 2 * b)
    half = {0.8: 1.2816, 0.95: 1.96}[level] * sd
    assert (found.lower, found.upper) == pytest.approx((10 - half, 10 + half), abs=0.12 * half)
    assert found.prior_share == pytest.approx(4 * b**2 / (a**2 + 4 * b**2), abs=1e-6)
    assert found.missing == 0.0


def test_words_for_what_holds_a_figure() -> None:
    assert interval(X[:, 0], DRAWN, 0.95).held_by == "trials"
    assert interval(X[:, 1], DRAWN, 0.95).held_by == "priors"
    assert interval(X @ [2.0, 1.0], DRAWN, 0.95).held_by == "both"


def test_a_constant_figure_has_an_interval_of_no_width() -> None:
    found = interval(np.full(len(X), 3.0), DRAWN, 0.95)
    assert (found.lower, found.upper) == (3.0, 3.0)
    assert math.isnan(found.prior_share)
    assert found.held_by == ""


def test_draws_without_the_figure_count_as_larger_than_all() -> None:
    values = np.where(np.arange(len(X)) < 100, np.nan, 5.0 + 0.1 * X[:, 0])
    few = interval(values, DRAWN, 0.95)
    assert few.missing == pytest.approx(0.025)
    assert 5.0 < few.upper < math.inf
    many = interval(np.where(np.arange(len(X)) < 400, np.nan, values), DRAWN, 0.95)
    assert many.upper == math.inf
    assert interval(np.where(np.arange(len(X)) < 400, np.nan, -values), DRAWN, 0.95).lower == -math.inf
    none = interval(np.full(len(X), np.nan), DRAWN, 0.95)
    assert math.isnan(none.lower)
    assert none.missing == 1.0


def test_misses_of_the_fitted_figures_are_the_models_own_error() -> None:
    sd, own, count = 0.02, 0.05, 4000
    misses = np.random.default_rng(3).standard_normal(count) * math.hypot(sd, own)
    half = 10.0 * 1.96 * sd
    rows = {"role": ["fit"] * count, "predicted": np.full(count, 10.0), "resolution": np.zeros(count)}
    measured = pd.DataFrame({**rows, "lower": 10.0 - half, "upper": 10.0 + half, "measured": 10.0 * (1 + misses)})
    assert model_error(measured, 0.95) == pytest.approx(own, rel=0.1)
    assert model_error(measured.assign(measured=10.01), 0.95) == 0.0
    assert model_error(measured.assign(resolution=3.0), 0.95) == 0.0
    assert model_error(measured.assign(role="holdout"), 0.95) == 0.0
    wide = widened(measured, "predicted", own, 0.95)
    inside = (wide.lower <= wide.measured) & (wide.measured <= wide.upper)
    assert float(inside.mean()) == pytest.approx(0.95, abs=0.015)
    known = widened(measured.assign(resolution=0.5), "predicted", 0.0, 0.95)
    assert known.upper.iloc[0] == pytest.approx(10.0 + half + 0.5)


def test_an_interval_beside_the_value_keeps_its_own_ends() -> None:
    beside = pd.DataFrame({"value": [10.0, 10.0], "lower": [11.0, -math.inf], "upper": [12.0, 10.5]})
    wide = widened(beside, "value", 0.0, 0.95)
    assert wide.lower.tolist() == [11.0, -math.inf]
    assert wide.upper.tolist() == [12.0, 10.5]
