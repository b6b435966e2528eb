"""The Bayesian signed-rank test: symmetry, its three answers, and a case that can be counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.statistics.bayesian import signed_rank_posterior


def test_two_methods_that_swap_swap_their_probabilities() -> None:
    rng = np.random.default_rng(1)
    differences = rng.normal(-0.1, 0.3, 30)
    one, other = signed_rank_posterior(differences, 0.05), signed_rank_posterior(-differences, 0.05)
    assert (one.lower, one.alike, one.higher) == pytest.approx((other.higher, other.alike, other.lower))
    assert sum(one) == pytest.approx(1.0)


def test_more_blocks_make_it_surer_and_it_can_say_alike() -> None:
    rng = np.random.default_rng(2)
    small = [signed_rank_posterior(rng.normal(-0.3, 0.5, n), 0.01).lower for n in (5, 200)]
    assert 0.5 < small[0] < small[1]
    assert small[1] > 0.999
    # no p-value can say this: the difference is there, and it does not matter
    assert signed_rank_posterior(rng.normal(-0.01, 0.01, 100), 0.1).alike > 0.999


def test_one_block_leaves_the_weight_of_the_prior() -> None:
    # One difference far below against a prior observation of none: with weights w and 1 - w, both pairs of the first
    # (w^2) and the mixed ones (2 w (1 - w)) lie below -rope, so it is lower where 1 - (1 - w)^2 > 1/2.
    # w is Beta(1, 1/2): P(w > 1 - sqrt(1/2)) = sqrt(sqrt(1/2)).
    assert signed_rank_posterior(np.array([-10.0]), 0.1, samples=200_000).lower == pytest.approx(0.5**0.25, abs=0.005)


def test_the_same_seed_gives_the_same() -> None:
    differences = np.array([-1.0, 0.3, -0.2, 0.0, -99.0])
    assert signed_rank_posterior(differences, 0.1) == signed_rank_posterior(differences, 0.1)
    assert signed_rank_posterior(differences, 0.1) != signed_rank_posterior(differences, 0.1, seed=1)
