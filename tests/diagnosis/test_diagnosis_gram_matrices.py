"""Gram matrices of whitened columns against those under a covariance that is built entry by entry."""

from __future__ import annotations

import numpy as np
import pytest
from dense_likelihood import Dense, case, sizes_of
from scipy.stats import multivariate_normal

from seatruth.arrays import Array, Flags
from seatruth.diagnosis import gram_matrices
from seatruth.diagnosis.gram_matrices import GramMatrices
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Problem
from seatruth.diagnosis.size_search import with_shape
from seatruth.diagnosis.steps import linear_errors


def by_hand(problem: Problem, at: Linearization, keep: Flags, trial: int) -> tuple[Array, float]:
    """Gram matrix of one trial's columns, and the log-density of as many zeros as it has errors."""
    rows = keep & (problem.trial_of == trial)
    noise = Dense(problem, at, sizes_of(problem), ()).noise[np.ix_(rows, rows)]
    columns = np.concatenate([at.errors[:, None], at.shared, at.local], axis=1)[rows]
    return columns.T @ np.linalg.solve(noise, columns), float(
        multivariate_normal(cov=noise).logpdf(np.zeros(len(noise)))
    )


@pytest.mark.parametrize("every", [1, 3])
def test_they_weigh_by_the_inverse_of_the_noise(every: int) -> None:
    problem, at = case()
    keep = np.arange(problem.count) % every == 0
    grams = GramMatrices(problem, at.errors, at.shared, at.local, None if every == 1 else keep)
    total, base = grams.weighted(sizes_of(problem))
    assert grams.counts.sum() == keep.sum()
    assert total.shape == (len(problem.trials), grams.size, grams.size)
    for trial in range(len(problem.trials)):
        gram, log_density = by_hand(problem, at, keep, trial)
        scale = np.sqrt(np.outer(np.diag(gram), np.diag(gram)))
        np.testing.assert_allclose(total[trial], gram, rtol=1e-7, atol=1e-9 * float(scale.max()))
        assert base[trial] == pytest.approx(log_density, rel=1e-9)


def test_errors_that_do_not_count_have_no_part() -> None:
    problem, at = case()
    keep = problem.channel_of != 0
    huge = np.where(keep, at.errors, 1e9)
    sizes = sizes_of(problem)
    total, base = GramMatrices(problem, huge, at.shared, at.local, keep).weighted(sizes)
    same, same_base = GramMatrices(problem, at.errors, at.shared, at.local, keep).weighted(sizes)
    np.testing.assert_array_equal(total, same)
    np.testing.assert_array_equal(base, same_base)


@pytest.mark.parametrize("every", [1, 3])
def test_other_errors_beside_the_same_derivatives_give_what_they_give_anew(every: int) -> None:
    problem, at = case()
    keep = None if every == 1 else np.arange(problem.count) % every == 0
    sizes, rng = sizes_of(problem), np.random.default_rng(0)
    grams = GramMatrices(problem, at.errors, at.shared, at.local, keep)
    first, second = rng.standard_normal((2, problem.count))
    for found in (grams.with_errors(first), grams.with_errors(first).with_errors(second)):
        errors = first if found._others is not None and found._others[1] is first else second
        total, base = found.weighted(sizes)
        anew, own = GramMatrices(problem, errors, at.shared, at.local, keep).weighted(sizes)
        np.testing.assert_allclose(total, anew, rtol=1e-12, atol=1e-12 * float(np.abs(anew).max()))
        np.testing.assert_array_equal(base, own)
    unchanged, _ = GramMatrices(problem, at.errors, at.shared, at.local, keep).weighted(sizes)
    np.testing.assert_array_equal(grams.weighted(sizes)[0], unchanged)


def test_the_noise_of_one_channel_changed_gives_what_it_gives_anew() -> None:
    """Whatever was asked before: of one channel twice, of another one, and of two at once."""
    problem, at = case()
    grams = GramMatrices(problem, at.errors, at.shared, at.local, None)
    sizes = sizes_of(problem)
    for c, shape, more in ((0, 1, 0.0), (0, 2, 0.5), (1, 1, -0.3), (1, 0, 0.2), (0, 0, 0.0)):
        for one in (with_shape(sizes, c, shape, sizes.white[c] + more), sizes):
            total, base = grams.weighted(one)
            anew, its_base = GramMatrices(problem, at.errors, at.shared, at.local, None).weighted(one)
            np.testing.assert_allclose(total, anew, rtol=1e-12, atol=1e-12 * float(np.abs(anew).max()))
            np.testing.assert_allclose(base, its_base, rtol=1e-12)
            total[:] = np.nan  # what is returned is the caller's
        sizes = with_shape(sizes, c, shape, sizes.white[c] + more)


def test_few_of_the_shapes_that_were_tried_are_kept() -> None:
    """And those asked for again are the same."""
    problem, at = case()
    grams = GramMatrices(problem, at.errors, at.shared, at.local, None)
    first = grams.of(0, 0)
    for shape in range(1, 8):
        grams.of(0, shape)
        assert grams.of(0, 0)[0] is first[0]  # used all the time
        grams.of(1, shape)
    assert len(grams._found) == 2 * gram_matrices._KEPT
    again = grams.of(0, 1)
    anew = GramMatrices(problem, at.errors, at.shared, at.local, None).of(0, 1)
    np.testing.assert_array_equal(again[0], anew[0])
    np.testing.assert_array_equal(again[1], anew[1])


def test_residuals_are_what_a_step_of_all_unknowns_leaves() -> None:
    problem, at = case()
    likelihood, sizes = Likelihood(problem, at), sizes_of(problem)
    step = likelihood.solve(sizes, at.effects)
    left = linear_errors(problem, at, step.shared, step.local)
    place = likelihood.posterior(sizes, at.effects).place
    other = likelihood.grams.with_errors(at.errors + 1.0)
    for channel in range(len(problem.outputs)):
        rows = [one.rows for one in problem.series if one.channel == channel]
        for grams, away in ((likelihood.grams, 0.0), (other, 1.0)):
            found = grams.residuals(channel, place)
            assert [len(t) for _, t in found] == [len(own) for own in rows]
            for (values, _), own in zip(found, rows, strict=True):
                np.testing.assert_allclose(values, left[own] + away, rtol=1e-9, atol=1e-12)
