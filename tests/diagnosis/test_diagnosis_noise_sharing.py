"""Hypotheses stand on equal terms only if the noise that one of them found is open to all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.fit import fit_at
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import fit_null, fit_once
from seatruth.diagnosis.noise_sharing import share_noise
from seatruth.diagnosis.sizes import noise_prior
from seatruth.trials.trial import Trial


@pytest.fixture
def searched(ship_folder: Path, offset_runs: list[Trial]) -> Search:
    """The model alone, and the effect that acts, each with its own noise."""
    problem = small.problem(ship_folder, offset_runs)
    found = Search(problem, noise_prior(problem))
    fit_null(found)
    null = found.fits[(), False]
    assert fit_once(found, ("rudder_offset",), False, null.point, null.sizes) is not None
    return found


def test_a_fit_takes_the_better_noise_of_another(searched: Search) -> None:
    key = (("rudder_offset",), False)
    good = searched.fits[key]
    worse = replace(good.sizes, white=good.sizes.white + 0.5)
    bad = fit_at(searched.problem, key[0], good.point, worse, searched.known, discrepancy=False, settled=True)
    assert bad.evidence < good.evidence - 50.0
    searched.fits[key] = bad
    searched.fits[("gyro_bias",), False] = good  # a rival whose noise is right
    share_noise(searched, 1)
    assert searched.fits[key].evidence == pytest.approx(good.evidence, abs=0.5)


def test_fits_whose_noise_is_the_best_stay_as_they_are(searched: Search) -> None:
    before = {key: fit.evidence for key, fit in searched.fits.items()}
    share_noise(searched, 1)
    share_noise(searched, 2)
    after = {key: fit.evidence for key, fit in searched.fits.items()}
    assert all(after[key] >= before[key] for key in before)
    leader = max(before, key=lambda key: before[key])
    assert after[leader] == before[leader]
    assert np.isfinite(list(after.values())).all()
