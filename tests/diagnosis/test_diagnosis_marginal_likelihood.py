"""The marginal likelihood against a multivariate normal density that is built entry by entry."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import boat_case as boat
import numpy as np
import pytest
import small_case as small
from dense_likelihood import CASES, EFFECTS, FEW, Dense, boat_problem, linearized, sizes_of
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Problem
from seatruth.diagnosis.sizes import Sizes
from seatruth.effects import available
from seatruth.effects.each_trial import EachTrial
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A boat with sway and yaw; three short trials."""
    return boat_problem()


@pytest.fixture(scope="module")
def at(problem: Problem) -> Linearization:
    """Away from the prior means in everything."""
    return linearized(problem)


def test_a_sum_of_squares_that_rounding_has_made_negative_is_refused(problem: Problem, at: Linearization) -> None:
    """Columns that hold more of the errors than there is of them, as after digits were lost."""
    likelihood, sizes = Likelihood(problem, at), sizes_of(problem)
    assert math.isfinite(likelihood.log_likelihood(sizes, ()))
    reduced = likelihood._reduce(sizes)
    reduced.grams[:, 0, 1:] *= 1e4
    reduced.grams[:, 1:, 0] *= 1e4
    with pytest.raises(np.linalg.LinAlgError, match="rounding decides"):
        likelihood.least(sizes, ())
    assert likelihood.log_likelihood(sizes, ()) == -math.inf


def test_evidence_that_rounding_decides_is_refused(
    problem: Problem, at: Linearization, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Derivatives of runs about to diverge: 1e21 in all, of which the elimination left 1e5, all of it rounding."""
    likelihood, sizes = Likelihood(problem, at), sizes_of(problem)
    assert math.isfinite(likelihood.evidence(sizes, ("gyro_bias",)))
    whole, _, pull, sd = likelihood._left_over(sizes, ("gyro_bias",), None)
    whole = np.diag([whole[0, 0], 1e21])
    monkeypatch.setattr(Likelihood, "_left_over", lambda *_: (whole, np.array([[1e5]]), np.full_like(pull, 1e6), sd))
    assert likelihood.evidence(sizes, ("gyro_bias",)) == -math.inf
    negative = np.array([[-1e5]])
    monkeypatch.setattr(Likelihood, "_left_over", lambda *_: (np.eye(2), negative, np.full_like(pull, 1e6), sd))
    assert likelihood.evidence(sizes, ("gyro_bias",)) == -math.inf
    # The same, where what is left is what there was: nothing was lost.
    monkeypatch.setattr(Likelihood, "_left_over", lambda *_: (whole, np.array([[1e21]]), np.full_like(pull, 1e6), sd))
    assert math.isfinite(likelihood.evidence(sizes, ("gyro_bias",)))


@pytest.mark.parametrize(("terms", "forces"), CASES)
@pytest.mark.parametrize("effects", [(), ("gyro_bias",), EFFECTS])
def test_it_is_the_density_of_the_errors(
    problem: Problem, at: Linearization, effects: tuple[str, ...], terms: bool, forces: bool
) -> None:
    sizes = sizes_of(problem, terms=terms, forces=forces)
    value = Likelihood(problem, at).log_likelihood(sizes, effects)
    assert value == pytest.approx(Dense(problem, at, sizes, effects).log_density(), rel=1e-7, abs=1e-4)


def test_a_part_of_the_trials_and_of_the_errors(problem: Problem, at: Linearization) -> None:
    sizes = sizes_of(problem, terms=True, forces=True)
    dense, likelihood = Dense(problem, at, sizes, EFFECTS), Likelihood(problem, at)
    for trials in ([0], [1, 2]):
        value = likelihood.log_likelihood(sizes, EFFECTS, trials)
        assert value == pytest.approx(dense.log_density(np.isin(problem.trial_of, trials)), rel=1e-7, abs=1e-4)
    keep = problem.time_of < 9.0
    assert Likelihood(problem, at, keep=keep).log_likelihood(sizes, EFFECTS) == pytest.approx(
        dense.log_density(keep), rel=1e-7, abs=1e-4
    )


def test_a_trial_left_out_is_predicted_by_the_difference(problem: Problem, at: Linearization) -> None:
    """log p(all) - log p(others) is the conditional normal density of the trial, computed directly."""
    sizes = sizes_of(problem, terms=True)
    likelihood, dense = Likelihood(problem, at), Dense(problem, at, sizes, EFFECTS)
    whole = likelihood.log_likelihood(sizes, EFFECTS)
    for left in range(3):
        others = problem.trial_of != left
        step, covariance = dense.posterior(others)
        J = dense.J[~others]
        direct = multivariate_normal(
            -J @ step, dense.noise[np.ix_(~others, ~others)] + J @ covariance @ J.T, allow_singular=True
        ).logpdf(dense.errors[~others])
        rest = likelihood.log_likelihood(sizes, EFFECTS, [k for k in range(3) if k != left])
        assert whole - rest == pytest.approx(direct, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize(("terms", "forces"), CASES)
@pytest.mark.parametrize("trials", [None, [0, 2]])
def test_the_solution_is_the_posterior_mean(
    problem: Problem, at: Linearization, terms: bool, forces: bool, trials: list[int] | None
) -> None:
    sizes = sizes_of(problem, terms=terms, forces=forces)
    keep = None if trials is None else np.isin(problem.trial_of, trials)
    step, covariance = Dense(problem, at, sizes, EFFECTS).posterior(keep)
    found = Likelihood(problem, at).solve(sizes, EFFECTS, trials)
    S, L = len(problem.unknowns), at.local.shape[1]
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    np.testing.assert_allclose(found.shared, step[:S], atol=1e-4 * sd[:S].max(), rtol=1e-4)
    for trial in range(3) if trials is None else trials:
        np.testing.assert_allclose(found.local[trial], step[S + trial * L : S + (trial + 1) * L], atol=1e-5, rtol=1e-4)
    expected = covariance[np.ix_(found.free, found.free)]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected))) + 1e-300
    np.testing.assert_allclose(found.covariance / scale, expected / scale, atol=1e-5)


@pytest.mark.parametrize("damping", [1.0, 1e3])
def test_a_damped_step_charges_for_the_way_from_the_point(problem: Problem, at: Linearization, damping: float) -> None:
    """(J' R^-1 J + (1 + damping) P^-1) step = P^-1 (prior mean - point) - J' R^-1 errors, with every matrix written."""
    sizes = sizes_of(problem, terms=True, forces=True)
    dense = Dense(problem, at, sizes, EFFECTS)
    free = np.flatnonzero(np.diag(dense.P) > 0.0)
    J, precision = dense.J[:, free], np.linalg.inv(dense.P[np.ix_(free, free)])
    weighted = J.T @ np.linalg.inv(dense.noise)
    right = precision @ dense.offset[free] - weighted @ dense.errors
    step = np.zeros(len(dense.P))
    step[free] = np.linalg.solve(weighted @ J + (1.0 + damping) * precision, right)
    found = Likelihood(problem, at).damped(damping).solve(sizes, EFFECTS)
    S, L = dense.S, at.local.shape[1]
    scale = np.abs(step[:S]).max()
    np.testing.assert_allclose(found.shared, step[:S], atol=1e-4 * scale, rtol=1e-3)
    for trial in range(3):
        np.testing.assert_allclose(found.local[trial], step[S + trial * L : S + (trial + 1) * L], atol=1e-6, rtol=1e-3)


def test_what_is_held_stays_and_pays_its_prior(problem: Problem, at: Linearization) -> None:
    """As if it had no prior variance and the point were its prior mean, less what its value is off its own prior."""
    sizes, held = sizes_of(problem, terms=True, forces=True), int(problem.coefficients[1])
    dense = Dense(problem, at, sizes, EFFECTS)
    charge = 0.5 * dense.offset[held] ** 2 / dense.P[held, held]
    assert charge > 0.0
    dense.P[held, :] = dense.P[:, held] = dense.offset[held] = 0.0
    likelihood = Likelihood(problem, at, held=(held,))
    value = likelihood.log_likelihood(sizes, EFFECTS)
    assert value == pytest.approx(dense.log_density() - charge, rel=1e-7, abs=1e-4)
    step, _ = dense.posterior()
    found = likelihood.solve(sizes, EFFECTS)
    assert found.shared[held] == 0.0
    np.testing.assert_allclose(found.shared, step[: dense.S], atol=1e-4 * np.abs(step).max(), rtol=1e-3)
    free = Likelihood(problem, at)
    assert free.holding((held,)).log_likelihood(sizes, EFFECTS) == value
    assert likelihood.holding(()).log_likelihood(sizes, EFFECTS) == free.log_likelihood(sizes, EFFECTS) != value


def test_a_step_ends_at_its_bounds_and_the_others_allow_for_it(
    problem: Problem, at: Linearization, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes, free = sizes_of(problem), Likelihood(problem, at)
    whole = free.solve(sizes, EFFECTS).shared
    first, second = (int(k) for k in problem.coefficients[:2])
    ends = {first: 0.5 * whole[first], second: -0.1 * whole[second]}
    low, high = problem.low.copy(), problem.high.copy()
    for k, end in ends.items():
        (high if whole[k] > end else low)[k] = at.point.shared[k] + end
    monkeypatch.setattr(problem, "low", low)
    monkeypatch.setattr(problem, "high", high)
    step = free.bounded(sizes, EFFECTS).solve(sizes, EFFECTS).shared
    dense = Dense(problem, at, sizes, EFFECTS)
    for k, end in ends.items():
        assert step[k] == pytest.approx(end, rel=1e-9)
        # Fixed at that value: no prior variance, and a prior mean there.
        dense.P[k, :] = dense.P[:, k] = 0.0
        dense.offset[k] = end
    expected = dense.posterior()[0][: dense.S]
    np.testing.assert_allclose(step, expected, atol=1e-4 * np.abs(expected).max(), rtol=1e-3)
    others = [int(k) for k in problem.coefficients if int(k) not in ends]
    assert (np.abs(step - whole)[others] > 1e-3 * np.abs(whole)[others]).any()


def test_what_stands_at_a_bound_is_held_only_where_the_trials_ask_for_more(
    problem: Problem, at: Linearization, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes, likelihood = sizes_of(problem), Likelihood(problem, at)
    step, k = likelihood.solve(sizes, EFFECTS).shared, int(problem.coefficients[0])
    assert likelihood.held_at_bounds(sizes, EFFECTS) == ()
    beyond, inward = (problem.high, problem.low) if step[k] > 0.0 else (problem.low, problem.high)
    for bound, held in ((beyond, (k,)), (inward, ())):
        with monkeypatch.context() as patch:
            moved = bound.copy()
            moved[k] = at.point.shared[k]
            patch.setattr(problem, "high" if bound is problem.high else "low", moved)
            assert likelihood.held_at_bounds(sizes, EFFECTS) == held


def test_information_is_what_the_likelihood_curves_by(problem: Problem, at: Linearization) -> None:
    """Everything but these effects integrated out: J' (noise + J P J')^-1 J, and its product with the best distance."""
    sizes = sizes_of(problem, terms=True, forces=True)
    dense = Dense(problem, at, sizes, ())
    own = np.concatenate([problem.columns[name] for name in EFFECTS])
    J = dense.J[:, own]
    inverse = np.linalg.inv(dense.noise + dense.J @ dense.P @ dense.J.T)
    information, pull, sd = Likelihood(problem, at).information(sizes, EFFECTS)
    np.testing.assert_allclose(information, J.T @ inverse @ J, rtol=1e-5)
    np.testing.assert_allclose(pull, -J.T @ inverse @ (dense.errors + dense.J @ dense.offset), rtol=1e-5)
    np.testing.assert_array_equal(sd, problem.sd[own])


@pytest.mark.parametrize("effects", [("gyro_bias",), EFFECTS])
def test_evidence_averages_over_the_order_of_magnitude(
    problem: Problem, at: Linearization, effects: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no bound cuts the prior; what bounds do is tested with `scale_gain`."""
    monkeypatch.setattr(problem, "low", np.full_like(problem.low, -math.inf))
    monkeypatch.setattr(problem, "high", np.full_like(problem.high, math.inf))
    sizes = sizes_of(problem)
    values = []
    for scales in itertools.product(problem.settings.scales, repeat=len(effects)):
        dense = Dense(problem, at, sizes, effects)
        for name, scale in zip(effects, scales):
            for column in problem.columns[name]:
                dense.P[column, column] *= scale**2
        values.append(dense.log_density())
    expected = float(logsumexp(values)) - math.log(len(values))
    assert Likelihood(problem, at).evidence(sizes, effects) == pytest.approx(expected, rel=1e-7, abs=1e-3)


def test_evidence_of_values_for_each_trial_that_are_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Correlated between trials in the prior, at each order of magnitude; where no bound cuts it."""
    own = available()["trial_current"].of_trials(["run_0", "run_1", "run_2"])
    inputs = [{"delta": boat.zigzag(14, 0.2, 5.0)}, {"delta": boat.zigzag(18, 0.1, 4.0)}, {"delta": np.full(12, 0.1)}]
    runs = boat.trials(boat.Boat(), inputs, headings=(0.0, 1.0, 2.0))
    problem = Problem(boat.study(boat.Boat(), runs), [own], FEW, threads=1)
    monkeypatch.setattr(problem, "low", np.full_like(problem.low, -math.inf))
    monkeypatch.setattr(problem, "high", np.full_like(problem.high, math.inf))
    key, columns, sizes = (own.name,), problem.columns[own.name], sizes_of(problem)
    problem.sd[columns] = 0.01  # the dense matrices would be left with few correct digits
    shared = problem.start.shared.copy()
    shared[columns] = np.linspace(-0.01, 0.02, len(columns))
    at = problem.linearize(replace(problem.start, shared=shared), key)
    likelihood, values = Likelihood(problem, at), []
    for scale in (1.0, *problem.settings.scales):
        dense = Dense(problem, at, sizes, key)
        dense.P[np.ix_(columns, columns)] = scale**2 * np.outer(problem.sd[columns], problem.sd[columns])
        # North and east of one trial stand side by side: each leans on its own kind alone.
        alike = np.where(np.arange(6)[:, None] % 2 == np.arange(6) % 2, EachTrial.alike, 0.0)
        dense.P[np.ix_(columns, columns)] *= np.where(np.eye(6) > 0.0, 1.0, alike)
        values.append(dense.log_density())
    first, *scaled = values
    assert likelihood.log_likelihood(sizes, key) == pytest.approx(first, rel=1e-7, abs=1e-3)
    expected = float(logsumexp(scaled)) - math.log(len(scaled))
    assert likelihood.evidence(sizes, key) == pytest.approx(expected, rel=1e-7, abs=1e-3)


def test_no_effect_has_no_order_of_magnitude(problem: Problem, at: Linearization) -> None:
    likelihood, sizes = Likelihood(problem, at), sizes_of(problem)
    assert likelihood.evidence(sizes, ()) == likelihood.log_likelihood(sizes, ())


def test_the_quadratic_form_leaves_initial_states_out(problem: Problem, at: Linearization) -> None:
    """Gram matrix of [errors, columns] under noise and initial states, with errors at the point itself."""
    sizes = sizes_of(problem)
    dense, likelihood = Dense(problem, at, sizes, ()), Likelihood(problem, at)
    before = likelihood.log_likelihood(sizes, EFFECTS)
    S = dense.S
    J, P = dense.J[:, S:], dense.P[S:, S:]
    inverse = np.linalg.inv(dense.noise + J @ P @ J.T)
    columns = np.column_stack([at.errors, at.shared[:, likelihood.columns]])
    gram = likelihood.quadratic(sizes)
    expected = columns.T @ inverse @ columns
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(gram / scale, expected / scale, atol=1e-6)
    assert likelihood.log_likelihood(sizes, EFFECTS) == before


def test_local_covariance(problem: Problem, at: Linearization) -> None:
    sizes = sizes_of(problem, forces=True)
    dense = Dense(problem, at, sizes, ())
    S, L = dense.S, at.local.shape[1]
    for trial in range(3):
        here = problem.trial_of == trial
        J = at.local[here]
        P = dense.P[S + trial * L : S + (trial + 1) * L, S + trial * L : S + (trial + 1) * L]
        gain = P @ J.T @ np.linalg.inv(dense.noise[np.ix_(here, here)] + J @ P @ J.T)
        expected = P - gain @ J @ P
        found = Likelihood(problem, at).local_covariance(sizes, trial)
        np.testing.assert_allclose(np.diag(found), np.diag(expected), rtol=1e-4, atol=1e-10)


def test_impossible_correlations_have_no_likelihood(problem: Problem, at: Linearization) -> None:
    sizes = replace(sizes_of(problem, forces=True), coupling=np.array([1.5]))
    assert Likelihood(problem, at).log_likelihood(sizes, ()) == -math.inf


def test_it_does_not_depend_on_what_was_asked_before(ship_folder: Path, offset_runs: list[Trial]) -> None:
    problem = small.problem(ship_folder, small.shortened(offset_runs, 40), settings=FEW)
    at = problem.linearize(problem.start, small.EFFECTS)
    a = Sizes(np.log([1e-3, 4e-3]), (0, 3), np.full(1, -2.0), np.full(1, -3.0), np.zeros(0))
    b = Sizes(np.log([1e-3, 4e-3]), (5, 3), np.full(1, -2.0), np.full(1, -1.0), np.zeros(0))
    used, fresh = Likelihood(problem, at), Likelihood(problem, at)
    first = used.log_likelihood(a, ("gyro_bias",))
    used.evidence(b, small.EFFECTS)
    used.solve(b, ())
    assert used.log_likelihood(a, ("gyro_bias",)) == first == fresh.log_likelihood(a, ("gyro_bias",))


def test_elsewhere_it_is_that_of_other_errors_with_the_derivatives_at_hand(problem: Problem, at: Linearization) -> None:
    near, sizes = Likelihood(problem, at), sizes_of(problem)
    point = problem.moved(at.point, 1e-5 * problem.sd, np.full((len(problem.trials), at.local.shape[1]), 1e-4))
    errors = problem.errors(point)
    anew = Likelihood(problem, replace(at, point=point, errors=errors)).log_likelihood(sizes, at.effects)
    assert near.elsewhere(point, errors).log_likelihood(sizes, at.effects) == pytest.approx(anew, rel=1e-9)
    assert math.isfinite(anew)
    assert abs(near.log_likelihood(sizes, at.effects) - anew) > 1e-6 * abs(anew)
