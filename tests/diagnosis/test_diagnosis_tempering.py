"""What evidence counts for, on numbers made by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatruth.arrays import Array
from seatruth.diagnosis.tempering import tempered, tempered_deviation

COUNTS = np.array([0, 1, 1, 2, 2, 3])


def counted(evidence: list[float], beside: float = 0.2, ahead: float = 0.0, most: float = math.inf) -> Array:
    return tempered(
        np.array(evidence), COUNTS, 0.0, temperature=2.0, model_form=0.02, beside=beside, ahead=ahead, most=most
    )


def test_rivals_of_one_size_share_what_the_form_of_the_best_one_leaves() -> None:
    found = counted([0.0, 100.0, 90.0, 0.0, 0.0, 0.0])
    assert found[1] - found[2] == pytest.approx(10.0 / (2.0 + 0.02 * 100.0))


def test_a_further_effect_is_not_asked_for_what_the_first_one_leaves() -> None:
    found = counted([0.0, 100.0, 90.0, 140.0, 120.0, 0.0])
    whole, further = 2.0 + 0.02 * 140.0, 2.0 + 0.02 * (0.2 * 100.0 + 40.0)
    assert found[3] == pytest.approx(100.0 / whole + 40.0 / further)
    assert found[3] - found[4] == pytest.approx(20.0 / further)
    plain = counted([0.0, 100.0, 90.0, 140.0, 120.0, 0.0], beside=1.0)
    assert plain == pytest.approx(np.array([0.0, 100.0, 90.0, 140.0, 120.0, 0.0]) / whole)


def test_two_effects_that_only_explain_what_one_does_count_as_it_does() -> None:
    found = counted([0.0, 100.0, 60.0, 100.0, 80.0, 100.0])
    assert found[1] == pytest.approx(found[3]) == pytest.approx(found[5])
    assert found[4] < found[3]


def test_what_the_leading_fit_did_not_reach_counts_as_explained() -> None:
    near, far = (counted([0.0, 100.0, 90.0, 0.0, 0.0, 0.0], ahead=ahead) for ahead in (0.0, 400.0))
    assert far[1] - far[2] == pytest.approx(10.0 / (2.0 + 0.02 * 500.0))
    assert far[1] - far[2] < near[1] - near[2]


def test_the_form_of_what_explains_the_trials_is_off_by_no_more_than_forces_would_have_shown() -> None:
    """A thruster that gave 30 % less explained 5200 nats, 331 more than forces did, and was called unknown."""
    found = counted([5200.0 - 331.0, 5200.0, 104.0, 0.0, 0.0, 0.0], most=12.5)
    assert found[1] - found[0] == pytest.approx(331.0 / (2.0 + 12.5))
    little = [0.0, 100.0, 90.0, 140.0, 120.0, 0.0]
    assert counted(little, most=12.5) == pytest.approx(counted(little))


@given(st.lists(st.floats(-50.0, 500.0), min_size=6, max_size=6), st.floats(0.0, 1.0))
def test_more_evidence_counts_for_more_among_sets_of_one_size(evidence: list[float], beside: float) -> None:
    found = counted(evidence, beside)
    assert np.isfinite(found).all()
    for number in (1, 2):
        a, b = np.flatnonzero(number == COUNTS)
        assert (found[a] - found[b]) * (evidence[a] - evidence[b]) >= 0.0


def test_sizes_are_as_unsure_as_the_evidence_and_no_surer_than_data_and_prior() -> None:
    """By hand: data of precision 3 about a prior of 1 have 4; divided by three they leave 2. What is fixed stays so."""
    found = tempered_deviation(np.array([0.5, 1.0, 0.0]), np.ones(3), 3.0)
    assert found == pytest.approx([2.0**-0.5, 1.0, 0.0])
    strong = tempered_deviation(np.array([1e-4]), np.array([1.0]), 1.79)
    assert strong == pytest.approx([1e-4 * math.sqrt(1.79)], rel=1e-6)
    assert tempered_deviation(np.array([0.5]), np.ones(1), 1.0) == pytest.approx([0.5])
