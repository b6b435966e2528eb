"""What is kept of a likelihood answers as the whole one does, for the sizes that it was kept with."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from dense_likelihood import EFFECTS, Dense, case, sizes_of

from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.shared_likelihood import KeptLikelihood


@pytest.mark.parametrize("trials", [None, [0, 2], [1]])
@pytest.mark.parametrize("forces", [False, True])
def test_it_answers_as_the_whole_one(forces: bool, trials: list[int] | None) -> None:
    problem, at = case()
    sizes = sizes_of(problem, forces=forces)
    whole = Likelihood(problem, at)
    kept = KeptLikelihood(whole, sizes)
    assert kept.log_likelihood(sizes, EFFECTS, trials) == whole.log_likelihood(sizes, EFFECTS, trials)
    assert kept.evidence(sizes, EFFECTS, trials) == whole.evidence(sizes, EFFECTS, trials)
    few, all_of_them = kept.shared_step(sizes, EFFECTS, trials), whole.solve(sizes, EFFECTS, trials)
    for part in ("shared", "free", "covariance"):
        np.testing.assert_array_equal(getattr(few, part), getattr(all_of_them, part))
    assert kept.energy(sizes, EFFECTS, at.point) == whole.energy(sizes, EFFECTS, at.point)


def test_it_is_the_density_of_what_was_recorded() -> None:
    """Against a normal density that is built entry by entry."""
    problem, at = case()
    sizes = sizes_of(problem, forces=True)
    kept = KeptLikelihood(Likelihood(problem, at), sizes)
    dense = Dense(problem, at, sizes, EFFECTS).log_density()
    assert kept.log_likelihood(sizes, EFFECTS) == pytest.approx(dense, rel=1e-6)


def test_what_is_held_stays_held() -> None:
    problem, at = case()
    sizes, held = sizes_of(problem), (int(problem.coefficients[0]),)
    whole = Likelihood(problem, at, held=held)
    kept = KeptLikelihood(whole, sizes)
    assert kept.held == held
    assert kept.log_likelihood(sizes, ()) == whole.log_likelihood(sizes, ())
    assert kept.log_likelihood(sizes, ()) != Likelihood(problem, at).log_likelihood(sizes, ())
    assert kept.shared_step(sizes, ()).shared[held[0]] == 0.0


def test_it_takes_other_sizes_of_terms_and_refuses_other_noise() -> None:
    """Terms are shared unknowns, whose priors are not yet in it."""
    problem, at = case()
    sizes = sizes_of(problem, forces=True)
    whole = Likelihood(problem, at)
    kept = KeptLikelihood(whole, sizes)
    fewer = replace(sizes, terms=sizes.terms - 1.0)
    assert kept.log_likelihood(fewer, ()) == whole.log_likelihood(fewer, ())
    assert math.isfinite(kept.log_likelihood(fewer, ()))
    for other in (replace(sizes, white=sizes.white + 1.0), replace(sizes, forces=sizes.forces - 1.0)):
        with pytest.raises(ValueError, match="for its own sizes alone"):
            kept.log_likelihood(other, ())


def test_it_holds_no_more_than_the_shared_columns() -> None:
    problem, at = case()
    kept = KeptLikelihood(Likelihood(problem, at), sizes_of(problem, forces=True))
    arrays = [value for value in vars(kept).values() if isinstance(value, np.ndarray)]
    shared, trials = 1 + len(kept.columns), len(problem.trials)
    assert sum(one.size for one in arrays) <= trials * shared**2 + trials + 2 * shared
