"""What the settings must agree on among themselves."""

from __future__ import annotations

import json
import math
from pathlib import Path

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
    assert 1.0 in settings.scales
    assert all(a > b for a, b in zip(settings.scales, settings.scales[1:]))


def test_calibrated_numbers_are_those_that_the_script_gave() -> None:
    """To the digits that are written; the priors are rounded so that they sum to one."""
    experiments = Path(__file__).resolve().parents[2] / "experiments"
    stored = json.loads((experiments / "withheld" / "calibration.json").read_text(encoding="utf-8"))["settings"]
    settings = Settings()
    for name, value in stored.items():
        own = getattr(settings, name)
        assert own == pytest.approx(tuple(value) if isinstance(value, list) else value, abs=0.005, rel=0.03), name
