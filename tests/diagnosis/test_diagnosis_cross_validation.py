"""What named effects are worth on trials that took no part."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from seatruth.diagnosis.cross_validation import (
    averaged_over_givens,
    lower_bound,
    predictive_gains,
    summary,
    surely_positive,
    validate,
)
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.parts import Fold
from seatruth.diagnosis.search import search
from seatruth.diagnosis.sentences import ends_in_words, no_share_in_words, shrinks_surely
from seatruth.statistics.ratios import ratio_interval
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def found(ship_folder: Path, offset_runs: list[Trial]) -> Search:
    return search(small.problem(ship_folder, offset_runs), small.silent)


def test_the_bound_is_that_of_all_bootstrap_samples() -> None:
    gains = np.array([1.0, 4.0, -0.5])
    sums = [sum(draw) for draw in itertools.product(gains, repeat=3)]
    assert lower_bound(gains, 0.05) == pytest.approx(np.quantile(sums, 0.05))


def test_the_bound_of_many_trials_is_near_the_normal_one_and_the_same_again() -> None:
    gains = np.random.default_rng(0).normal(1.0, 1.0, size=40)
    expected = gains.sum() - 1.645 * math.sqrt(40) * gains.std()
    assert lower_bound(gains, 0.05) == pytest.approx(expected, abs=2.0)
    assert lower_bound(gains, 0.05) == lower_bound(gains, 0.05)


def test_one_trial_against_the_others_refuses() -> None:
    """A gain that comes from one trial alone is not sure."""
    assert lower_bound(np.array([20.0, -0.5, -0.4, -0.6]), 0.05) < 0.0
    assert lower_bound(np.array([5.0, 6.0, 4.0, 7.0]), 0.05) > 0.0


def test_without_trials_there_is_no_bound() -> None:
    assert math.isnan(lower_bound(np.zeros(0), 0.05))


def test_few_trials_that_show_an_effect_suffice_where_the_model_meets_its_noise() -> None:
    """Two zigzags gain 17 nats, and five other trials nothing."""
    gains = np.array([7.9, -1.0, -1.8, 9.5, 2.1, 1.3, -1.1])
    assert lower_bound(gains, 0.05) < 0.0
    assert surely_positive(gains, 0.05, meets_noise=True)
    assert not surely_positive(gains, 0.05, meets_noise=False)
    one = np.array([20.0, -1.0, 1.0, 1.5, -0.5])
    assert not surely_positive(one, 0.05, meets_noise=True)
    assert surely_positive(np.array([5.0, 6.0, 4.0, 7.0]), 0.05, meets_noise=False)
    assert not surely_positive(np.zeros(0), 0.05, meets_noise=True)


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.3, 3.0))
def test_odds_are_rarely_on_the_side_of_what_does_not_act(seed: int, size: float) -> None:
    """A mean that is zero, predicted from others with a prior of this size for it: 150 records of eight trials."""
    rng, count = np.random.default_rng(seed), 8
    y = rng.normal(size=(150, count))
    said = 0
    for record in y:
        gains = np.zeros(count)
        for k in range(count):
            others = np.delete(record, k)
            tightness = 1.0 / size**2 + len(others)
            mean, spread = others.sum() / tightness, 1.0 + 1.0 / tightness
            gains[k] = 0.5 * record[k] ** 2 - 0.5 * (record[k] - mean) ** 2 / spread - 0.5 * math.log(spread)
        said += surely_positive(gains, 0.05, meets_noise=True) and not lower_bound(gains, 0.05) > 0.0
    assert said <= 0.05 * len(y)


MANY = 10**18
"""Samples that tell the noise exactly."""


def folds(refit: list[float], effects: list[float]) -> list[Fold]:
    return [Fold(f"run {k}", (), a, b, a, b, 1.0, 0.0, 0.0) for k, (a, b) in enumerate(zip(refit, effects))]


def test_the_gap_explained_with_its_interval() -> None:
    """By hand: errors 3 -> 1 of a gap of 2 is all; a mean of 2 of a mean gap of 8/3 is three quarters."""
    same = summary(folds([3.0] * 3, [1.0] * 3), MANY)
    assert same.gap_explained == pytest.approx(1.0)
    assert (same.lower, same.upper) == (pytest.approx(1.0), pytest.approx(1.0))
    assert same.control == pytest.approx(0.0)
    found = summary(folds([3.0, 3.0, 5.0], [1.0, 2.0, 2.0]), MANY)
    assert found.gap_explained == pytest.approx(0.75)
    low, high = ratio_interval(np.array([2.0, 1.0, 3.0]), np.array([2.0, 2.0, 4.0]))
    assert (found.lower, found.upper) == (pytest.approx(low), pytest.approx(high))
    assert found.lower < 0.75 < found.upper


def test_noise_of_few_samples_widens_the_interval_and_not_beyond_nothing() -> None:
    """A gap of a tenth of the noise, whose level 200 samples tell to 5 %: what is explained is known to a factor."""
    found = summary(folds([1.1] * 3, [1.02] * 3), 200)
    assert found.gap_explained == pytest.approx(0.8)
    assert found.lower == pytest.approx(0.8 * math.exp(-1.96 * 0.05 / 0.1), rel=1e-3)
    assert found.upper == pytest.approx(0.8 * math.exp(1.96 * 0.05 / 0.1), rel=1e-3)
    worse = summary(folds([1.1] * 3, [1.18] * 3), 200)
    assert worse.lower == pytest.approx(-found.upper)
    assert worse.upper == pytest.approx(-found.lower)
    hardly = summary(folds([1.01] * 3, [1.0] * 3), 10)
    assert 0.0 < hardly.lower < hardly.gap_explained < hardly.upper < math.inf


def test_trials_that_hardly_show_the_gap_do_not_bound_what_is_explained() -> None:
    found = summary(folds([1.0, 1.0, 1.6], [1.0, 1.0, 1.1]), MANY)
    assert (found.lower, found.upper) == (-math.inf, math.inf)
    assert ends_in_words(found) == "with no useful bound; the error falls in 1 of 3 trials"
    assert not shrinks_surely(found)


@pytest.mark.parametrize(("count", "surely"), [(7, True), (5, False)])
def test_an_error_that_falls_in_each_of_enough_trials_falls_surely(count: int, surely: bool) -> None:
    """Without its offset rudder a ship under an autopilot is missed by far in one trial, which leaves no bound."""
    errors = [1200.0, 30.0, 40.0, 40.0, 110.0, 50.0, 30.0][:count]
    found = replace(summary(folds(errors, [1.5] * count), MANY), lower=-0.4, upper=2.4)
    assert shrinks_surely(found) == surely
    rises = replace(found, folds=(*found.folds[1:], *folds([1.2], [1.5])))
    assert not shrinks_surely(rises)


def test_an_interval_that_says_nothing_is_not_printed() -> None:
    found = summary(folds([9.0, 2.0], [2.0, 2.1]), MANY)
    assert found.upper - found.lower > 2.0
    assert ends_in_words(found) == "with no useful bound; the error falls in 1 of 2 trials"


def test_where_there_is_no_gap_none_is_explained() -> None:
    assert math.isnan(summary(folds([1.0, 1.0], [0.9, 0.9]), MANY).gap_explained)


def test_a_trial_that_diverges_explains_nothing() -> None:
    found = summary(folds([3.0, 3.0], [1.0, math.inf]), MANY)
    assert math.isnan(found.gap_explained)
    assert no_share_in_words(found) == "Left out, run 1 could not be predicted: the motion diverges."
    assert "no gap" in no_share_in_words(summary(folds([1.0, 1.0], [0.9, 0.9]), MANY))


def test_the_gains_of_all_trials_are_what_was_seen_less_what_one_shows_by_itself(found: Search) -> None:
    gains = predictive_gains(found, "rudder_offset", ("rudder_offset",))
    assert gains.shape == (4,)
    assert lower_bound(gains, 0.05) > 0.0
    with_it, without = found.fits[("rudder_offset",), False], found.fits[(), False]
    expected = 0.0
    for at, sign in ((with_it, 1.0), (without, -1.0)):
        value = at.likelihood.log_likelihood
        alone = np.mean([value(at.sizes, at.effects, [k]) for k in range(4)])
        expected += sign * (value(at.sizes, at.effects) - alone)
    assert gains.sum() == pytest.approx(expected)


def normal_density(columns: np.ndarray, values: np.ndarray, given: Sequence[int]) -> float:
    """Log density of some values, whose means are columns times unknowns of unit variance."""
    rows = columns[list(given)]
    covariance = np.eye(len(rows)) + rows @ rows.T
    return float(multivariate_normal.logpdf(values[list(given)], np.zeros(len(rows)), covariance))


def test_predictions_are_averaged_over_which_and_how_many_others_are_given() -> None:
    """Against every order in which five numbers may come, and sampled orders of nine near the sum over all."""
    rng = np.random.default_rng(3)
    columns, values = rng.normal(size=(9, 3)), rng.normal(size=9)
    found = averaged_over_givens(5, lambda given: normal_density(columns, values, given))
    expected = np.zeros(5)
    for order in itertools.permutations(range(5)):
        for place in range(1, 5):
            now, before = order[: place + 1], order[:place]
            expected[order[place]] += normal_density(columns, values, now) - normal_density(columns, values, before)
    assert found == pytest.approx(expected / math.factorial(5))
    many = averaged_over_givens(9, lambda given: normal_density(columns, values, given))
    alone = np.mean([normal_density(columns, values, [k]) for k in range(9)])
    assert many.sum() == pytest.approx(normal_density(columns, values, range(9)) - alone, abs=0.3)
    again = averaged_over_givens(9, lambda given: normal_density(columns, values, given))
    assert again.tolist() == many.tolist()


def test_an_effect_that_does_not_act_does_not_predict(found: Search) -> None:
    for name in ("gyro_bias", "rudder_gain"):
        gains = predictive_gains(found, name, (name,))
        right = predictive_gains(found, "rudder_offset", ("rudder_offset",))
        assert gains.sum() < 0.5 * right.sum()


def test_what_was_not_fitted_has_no_gain(found: Search) -> None:
    assert predictive_gains(found, "gyro_bias", ("gyro_bias", "heading_bias", "rudder_gain")).size == 0


def test_trials_are_predicted_to_their_noise_by_the_effect_that_acts(found: Search) -> None:
    checked = validate(found, ("rudder_offset",), small.silent)
    assert checked is not None
    assert [fold.trial for fold in checked.folds] == [trial.name for trial in found.problem.trials]
    for fold in checked.folds:
        assert fold.effects == ("rudder_offset",)
        assert fold.error_effects < 1.5
        assert fold.error_refit > fold.error_effects
    assert 0.8 < checked.gap_explained < 1.2
    assert checked.lower < checked.gap_explained < checked.upper
    assert checked.gap_explained > checked.control


def test_one_trial_is_left_out_in_blocks(ship_folder: Path, offset_runs: list[Trial]) -> None:
    alone = search(small.problem(ship_folder, offset_runs[:1]), small.silent)
    gains = predictive_gains(alone, "rudder_offset", ("rudder_offset",))
    assert gains.shape == (4,)
    assert gains.sum() > 0.0
    assert validate(alone, ("rudder_offset",), small.silent) is None


def test_a_fold_whose_algebra_fails_bounds_nothing(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError

    monkeypatch.setattr("seatruth.diagnosis.cross_validation.PredictionErrors", fails)
    checked = validate(found, ("rudder_offset",), small.silent)
    assert checked is not None
    assert math.isnan(checked.gap_explained)
    assert "could not be predicted" in no_share_in_words(checked)
