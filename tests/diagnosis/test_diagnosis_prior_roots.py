"""Square roots of prior covariances, against the covariances themselves."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis.prior_roots import PriorRoots
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import Sizes, first_sizes, noise_prior
from seatruth.effects import load_effects

EFFECTS = ("current",)
COUPLING = 0.6


@pytest.fixture(scope="module")
def problem() -> Problem:
    rudders = [{"delta": boat.zigzag(120, angle, 15.0)} for angle in (0.2, -0.2)]
    runs = boat.trials(boat.Boat(), rudders, headings=[0.0, 1.0])
    return Problem(boat.study(boat.Boat(), runs), load_effects(EFFECTS), Settings(knots=5))


@pytest.fixture(scope="module")
def sizes(problem: Problem) -> Sizes:
    first = first_sizes(problem, noise_prior(problem))
    return replace(first, forces=first.forces + np.log(2.0), coupling=np.full_like(first.coupling, COUPLING))


def test_forces_of_a_trial_forget_over_a_few_knots_and_lean_on_each_other(problem: Problem, sizes: Sizes) -> None:
    roots, settings = PriorRoots(problem), problem.settings
    local = roots.local(sizes, forces=True)
    # A root of all own unknowns, forces back in their values at the knots.
    whole = roots.over_knots(local.times(np.eye(local.size)[None])[0].T, roots.time.T).T
    covariance = whole @ whole.T
    count, knots = len(problem.initial_names), settings.knots
    assert np.diag(covariance)[:count] == pytest.approx(problem.initial_sd**2)
    forces = covariance[count:, count:].reshape(len(problem.equations), knots, len(problem.equations), knots)
    deviation = np.exp(sizes.forces) * problem.usual
    knot = np.arange(knots)
    memory = np.exp(-np.abs(knot[:, None] - knot) / settings.force_memory)
    for a, first in enumerate(deviation):
        for b, second in enumerate(deviation):
            coupled = 1.0 if a == b else COUPLING if (a, b) in roots.pairs or (b, a) in roots.pairs else 0.0
            assert forces[a, :, b] == pytest.approx(coupled * first * second * memory, rel=1e-6, abs=1e-12)
    assert roots.pairs, "sway and yaw"
    bare = roots.local(sizes.without_discrepancy(), forces=True)
    assert bare.size == roots.local(sizes, forces=False).size == count


def test_what_each_knot_adds_gives_the_values_back(problem: Problem) -> None:
    roots = PriorRoots(problem)
    own = np.random.default_rng(1).normal(
        size=(3, len(problem.initial_names) + len(problem.equations) * problem.settings.knots)
    )
    assert roots.over_knots(roots.added(own), roots.time.T) == pytest.approx(own)


def test_terms_of_a_group_lean_on_each_other_and_what_is_held_is_left_out(problem: Problem, sizes: Sizes) -> None:
    roots, held = PriorRoots(problem), [int(problem.coefficients[0])]
    free, root = roots.shared(sizes, EFFECTS, held)
    assert held[0] not in free
    assert set(problem.columns["current"]) <= set(free)
    covariance = root @ root.T
    for (equations, members), rows in zip(problem.term_groups, roots.term_rows(sizes, held), strict=True):
        assert (free[rows] == problem.terms[members]).all()
        deviation = (np.exp(sizes.terms) * problem.usual)[equations]
        assert np.diagonal(covariance)[rows] == pytest.approx(np.tile(deviation**2, (len(rows), 1)), rel=1e-6)
    coefficients = np.isin(free, problem.coefficients)
    assert np.diagonal(covariance)[coefficients] == pytest.approx(problem.sd[free[coefficients]] ** 2)
    assert not roots.term_rows(sizes.without_discrepancy(), held)


def test_the_energy_is_the_squared_distance_from_the_prior_means(problem: Problem, sizes: Sizes) -> None:
    roots, rng = PriorRoots(problem), np.random.default_rng(2)
    free, root = roots.shared(sizes, EFFECTS, ())
    shared = problem.mean.copy()
    shared[free] += root @ rng.normal(size=len(free))
    forces = rng.normal(0.0, 1e-3, problem.start.forces.shape)
    point = Point(shared, problem.start.initial + 0.1, forces)
    local = roots.local(sizes, forces=True)
    own = np.concatenate([point.initial - problem.initial_mean, forces.reshape(len(forces), -1)], axis=1)
    whole = roots.over_knots(local.times(np.eye(local.size)[None])[0].T, roots.time.T).T
    distances = [shared[free] - problem.mean[free], *own]
    expected = sum(
        float(np.square(np.linalg.solve(matrix, distance)).sum())
        for matrix, distance in zip([root, *[whole] * len(own)], distances, strict=True)
    )
    assert roots.energy(sizes, EFFECTS, point, ()) == pytest.approx(expected, rel=1e-6)


def test_the_energy_does_not_depend_on_the_units_of_a_coefficient(problem: Problem, sizes: Sizes) -> None:
    """Coefficients of a ship, in newton metres, are 1e12 times the deviation of a term: none of the others is lost."""
    roots, rng = PriorRoots(problem), np.random.default_rng(3)
    free, root = roots.shared(sizes, EFFECTS, ())
    shared = problem.mean.copy()
    shared[free] += root @ rng.normal(size=len(free))
    at = Point(shared, np.broadcast_to(problem.initial_mean, problem.start.initial.shape), 0.0 * problem.start.forces)
    before = roots.energy(sizes, EFFECTS, at, ())

    coefficient, sd = int(problem.coefficients[0]), problem.sd.copy()
    sd[coefficient] *= 1e12
    large = shared.copy()
    large[coefficient] = problem.mean[coefficient] + 1e12 * (shared - problem.mean)[coefficient]
    heavy = copy(problem)
    heavy.sd = sd
    assert PriorRoots(heavy).energy(sizes, EFFECTS, replace(at, shared=large), ()) == pytest.approx(before, rel=1e-9)
