"""What the settings must agree on among themselves."""

from __future__ import annotations

import math

import pytest
from scipy.stats import norm

from seatruth.diagnosis.settings import Settings


def test_prior_probabilities_sum_to_one() -> None:
    settings = Settings()
    assert settings.prior_none + settings.prior_unknown + sum(settings.prior_sets) == pytest.approx(1.0)
    assert len(settings.prior_sets) >= settings.most_effects


def test_derived_numbers_are_what_their_origin_says() -> None:
    settings = Settings()
    assert norm.cdf(-math.sqrt(settings.apart) / 2.0) == pytest.approx(0.05, abs=0.002)
    assert settings.power == pytest.approx(norm.ppf(0.975) + norm.ppf(0.8), abs=0.01)
    assert settings.scales[0] == 1.0
    assert all(a > b for a, b in zip(settings.scales, settings.scales[1:]))
