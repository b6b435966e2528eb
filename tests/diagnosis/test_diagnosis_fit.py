"""Fits on synthetic trials: what is recovered, how sure, and what slow sensor errors must not become."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import boat_case as boat
import numpy as np
import pytest
import small_case as small
from small_case import fitted

from seatruth.diagnosis.fit import Fit, Stopped, fit, fit_at, without_discrepancy
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import first_sizes, noise_prior, noise_shapes
from seatruth.diagnosis.steps import objective
from seatruth.effects import available, load_effects
from seatruth.models.parameter import Parameter, Prior
from seatruth.trials.trial import Trial


def zs(problem: Problem, at: Fit, true: dict[str, float]) -> np.ndarray:
    """Errors of the fit in its own standard errors, of the parameters in `true`."""
    stderr, names = at.stderr(problem), [q.name for q in problem.unknowns]
    return np.array([(at.point.shared[names.index(n)] - v) / stderr[names.index(n)] for n, v in true.items()])


TRUE = {**small.TRUE, "rudder_offset_angle": small.OFFSET}


@pytest.fixture(scope="module")
def problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    return small.problem(ship_folder, offset_runs)


def test_known_parameters_are_recovered(problem: Problem) -> None:
    found = fitted(problem, ("rudder_offset",))
    assert found.settled
    assert np.abs(zs(problem, found, TRUE)).max() < 3.0
    for channel, name in enumerate(problem.outputs):
        assert math.exp(found.sizes.white[channel]) == pytest.approx(small.NOISE[name], rel=0.1)
    assert found.sizes.shape == (0, 0)


def test_with_discrepancy_they_are_recovered_with_less_certainty(problem: Problem) -> None:
    plain = fitted(problem, ("rudder_offset",))
    loose = fitted(problem, ("rudder_offset",), discrepancy=True)
    assert loose.sizes.discrepancy
    assert np.abs(zs(problem, loose, TRUE)).max() < 3.0
    free = plain.solution.free
    assert (loose.stderr(problem)[free] >= 0.99 * plain.stderr(problem)[free]).all()
    assert loose.price > 0.0
    # Nothing is missing: what discrepancy finds in the noise pays at most for its price.
    assert loose.evidence < plain.evidence + 0.5


def test_the_optimum_is_one(problem: Problem) -> None:
    """No small change of the shared unknowns or of the initial states lowers the objective."""
    found = fitted(problem, ("rudder_offset",))

    def value(point: Point) -> float:
        return objective(problem, point, problem.errors(point), found.sizes, found.effects, found.likelihood)

    least = value(found.point)
    rng = np.random.default_rng(0)
    stderr = found.stderr(problem)
    own = found.linearized(problem).local.shape[1]
    for _ in range(20):
        local = np.zeros((len(problem.trials), own))
        local[:, : len(problem.initial_names)] = 0.002 * rng.normal(size=(len(problem.trials), 2))
        moved = problem.moved(found.point, stderr * rng.normal(size=stderr.shape), local)
        assert value(moved) > least - 2.0 * problem.settings.settled


def test_nothing_lies_ahead_of_an_optimum(problem: Problem) -> None:
    """At the optimum a straight line promises nothing more; beside it, what the objective falls by on the way there."""
    found = fitted(problem, ("rudder_offset",))
    assert abs(found.ahead) < 0.1
    shared = found.point.shared.copy()
    column = problem.columns["rudder_offset"][0]
    shared[column] += 5.0 * found.stderr(problem)[column]
    beside = fit_at(
        problem, found.effects, replace(found.point, shared=shared), found.sizes, noise_prior(problem),
        discrepancy=False, settled=True,
    )  # fmt: skip
    risen = [
        objective(problem, at.point, problem.errors(at.point), at.sizes, at.effects, at.likelihood)
        for at in (beside, found)
    ]
    assert beside.ahead == pytest.approx(risen[0] - risen[1], rel=0.05)
    assert not beside.settled


def test_the_step_at_the_optimum_is_small(problem: Problem) -> None:
    found = fitted(problem, ("rudder_offset",))
    free = found.solution.free
    assert (np.abs(found.solution.shared[free]) < 0.3 * found.stderr(problem)[free]).all()


def test_a_delay_that_would_have_to_be_negative_is_none(ship_folder: Path) -> None:
    """The rudder acts a second ahead of its record: a delay is at its bound, and gains nothing over the model alone."""
    runs = [replace(run, inputs={"delta": np.roll(run.inputs["delta"], 1)}) for run in small.trials(ship_folder)]
    early = small.problem(ship_folder, runs, ("rudder_delay",))
    alone, delayed = fitted(early, ()), fitted(early, ("rudder_delay",))
    assert delayed.point.shared[early.columns["rudder_delay"]] == 0.0
    assert delayed.stderr(early)[early.columns["rudder_delay"]] > 0.0
    assert alone.evidence - 10.0 < delayed.evidence < alone.evidence


def test_a_coefficient_that_would_leave_its_bounds_stays_there(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """The others end where they would if it were known to be there."""
    study = small.study(ship_folder, offset_runs)

    def ended(parameters: Sequence[Parameter]) -> tuple[Problem, Fit]:
        bounded = Problem(
            study.replace(parameters=tuple(parameters)), load_effects(small.EFFECTS), Settings(), threads=1
        )
        return bounded, fitted(bounded, ("rudder_offset",))

    free, end = ended(study.parameters)
    names = [q.name for q in free.unknowns]
    gain, time = (names.index(name) for name in ("K", "T"))
    bound = end.point.shared[gain] - 5.0 * end.stderr(free)[gain]
    at_bound, found = ended(
        [q.replace(max=bound, value=min(q.value, bound)) if q.name == "K" else q for q in study.parameters]
    )
    assert found.settled
    assert found.point.shared[gain] == bound
    assert abs(found.ahead) < 0.1
    assert found.stderr(at_bound)[gain] > 0.0
    known, there = ended(
        [q.replace(value=bound, prior=Prior(bound, 1e-6 * bound)) if q.name == "K" else q for q in study.parameters]
    )
    assert found.point.shared[time] == pytest.approx(there.point.shared[time], abs=0.1 * there.stderr(known)[time])
    assert abs(found.point.shared[time] - end.point.shared[time]) > end.stderr(free)[time]


def test_a_fit_stops_where_it_is_known_to_end(problem: Problem) -> None:
    good = fitted(problem, ("rudder_offset",))
    away = replace(good.point, shared=good.point.shared + 0.1 * np.abs(good.point.shared))
    columns, tried = problem.columns["rudder_offset"], list[float]()

    def there(at: Point) -> bool:
        tried.append(float(at.shared[columns][0]))
        return True

    with pytest.raises(Stopped):
        fit(problem, good.effects, away, good.sizes, noise_prior(problem), discrepancy=False, stop=there)
    assert len(tried) == 1


def test_what_has_the_noise_of_a_point_far_away_is_not_hopeless(problem: Problem) -> None:
    """Begun where it ends, with slow noise that nothing shows: beside a rival as good, the noise is proposed anew."""
    known, best = noise_prior(problem), fitted(problem, ("rudder_offset",))
    slow = replace(best.sizes, shape=(len(noise_shapes(problem.settings)) - 1, *best.sizes.shape[1:]))
    there = fit_at(problem, best.effects, best.point, slow, known, discrepancy=False, settled=True)
    assert there.evidence < best.evidence - problem.settings.hopeless
    found = fit(problem, best.effects, best.point, slow, known, discrepancy=False, rival=best.evidence)
    assert found.evidence == pytest.approx(best.evidence, abs=0.1)
    assert found.sizes.shape == best.sizes.shape


def test_what_is_not_free_stays(problem: Problem) -> None:
    found = fitted(problem, ("gyro_bias",))
    stderr = found.stderr(problem)
    for name in ("rudder_offset", "rudder_gain", "heading_bias"):
        columns = problem.columns[name]
        np.testing.assert_array_equal(found.point.shared[columns], problem.mean[columns])
        assert not stderr[columns].any()
    assert not found.point.shared[problem.terms].any()
    assert not found.point.forces.any()


def test_it_does_not_depend_on_the_start(problem: Problem) -> None:
    known = noise_prior(problem)
    start = problem.start.shared.copy()
    start[problem.coefficients] *= 1.3
    start[problem.columns["rudder_offset"]] = -0.05
    other = fit(
        problem,
        ("rudder_offset",),
        replace(problem.start, shared=start),
        first_sizes(problem, known),
        known,
        discrepancy=False,
    )
    assert other.evidence == pytest.approx(fitted(problem, ("rudder_offset",)).evidence, abs=0.1)


def test_the_effect_that_acts_has_the_evidence(problem: Problem) -> None:
    right, none = fitted(problem, ("rudder_offset",)).evidence, fitted(problem, ()).evidence
    assert right > none + 20.0
    assert right > max(fitted(problem, (name,)).evidence for name in small.EFFECTS[1:]) + 20.0


def test_a_fit_is_the_same_when_it_is_made_again_from_its_optimum(problem: Problem) -> None:
    found = fitted(problem, ("rudder_offset",), discrepancy=True)
    again = fit_at(
        problem, found.effects, found.point, found.sizes, noise_prior(problem), discrepancy=True, settled=True
    )
    assert again.evidence == found.evidence
    np.testing.assert_array_equal(again.stderr(problem), found.stderr(problem))


def test_a_divergent_start_raises(problem: Problem) -> None:
    known = noise_prior(problem)
    shared = problem.start.shared.copy()
    shared[problem.columns["rudder_gain"]] = 1e307
    with pytest.raises(np.linalg.LinAlgError, match="diverges"):
        fit(
            problem,
            (),
            replace(problem.start, shared=shared),
            first_sizes(problem, known),
            known,
            discrepancy=False,
        )


def test_without_discrepancy_nothing_is_missing(problem: Problem) -> None:
    point = replace(problem.start, forces=problem.start.forces + 1.0, shared=problem.start.shared + 0.1)
    bare = without_discrepancy(problem, point)
    assert not bare.forces.any()
    assert not bare.shared[problem.terms].any()
    np.testing.assert_array_equal(bare.shared[problem.coefficients], point.shared[problem.coefficients])


def test_a_long_run_that_leaves_its_record_is_drawn_near() -> None:
    """From coefficients two prior deviations off, whose track ends a hundred noise deviations from the record."""
    model = boat.Boat()
    inputs = [{"delta": boat.zigzag(200, 0.2, 17.0)}, {"delta": np.full(200, 0.15)}]
    runs = boat.trials(model, inputs, headings=(0.0, 2.0), effects={"K": 0.18, "T": 7.5, "U": 2.15})
    problem = Problem(boat.study(model, runs), load_effects(("gyro_bias",)), Settings(), threads=1)
    errors = problem.errors(problem.start)
    assert np.abs(errors).max() > 100.0 * boat.NOISE["x"]
    found = fitted(problem, ())
    assert found.settled
    assert np.abs(zs(problem, found, {"K": 0.18, "T": 7.5, "U": 2.15})).max() < 3.5


def slow_errors(runs: Sequence[Trial], channels: Sequence[str], tau: float, seed: int) -> list[Trial]:
    """The trials with slow sensor errors as large as the white ones."""
    rng = np.random.default_rng(seed)
    found = []
    for trial in runs:
        outputs = dict(trial.outputs)
        for name in channels:
            fade, slow = math.exp(-1.0 / tau), np.zeros(len(trial))
            slow[0] = rng.normal()
            for k in range(1, len(trial)):
                slow[k] = fade * slow[k - 1] + math.sqrt(1.0 - fade**2) * rng.normal()
            outputs[name] = outputs[name] + boat.NOISE[name] * slow
        found.append(replace(trial, outputs=outputs))
    return found


class Declared(boat.Boat):
    """A user's model whose sway gain is a few per cent off and not free."""

    name = "declared"
    parameters = (*boat.Boat.parameters[:3], Parameter("S", 0.29, "m/s", min=-3.0, max=3.0))


INPUTS = [
    {"delta": boat.zigzag(120, 0.2, 12.0)},
    {"delta": np.full(120, 0.15)},
    {"delta": boat.zigzag(120, 0.1, 20.0)},
    {"delta": np.full(120, -0.1)},
]


def test_slow_noise_is_told_from_white_noise() -> None:
    runs = slow_errors(boat.trials(boat.Boat(), INPUTS, headings=(0.0, 1.0, 2.5, 4.0)), ("x", "y"), 10.0, seed=5)
    problem = Problem(boat.study(boat.Boat(), runs, boat.NOISE), load_effects(("gyro_bias",)), Settings(), threads=1)
    found = fitted(problem, ())
    shapes = noise_shapes(problem.settings)
    for name in ("x", "y"):
        k = problem.outputs.index(name)
        total = math.exp(found.sizes.white[k]) * math.sqrt(shapes[found.sizes.shape[k]].correlation(0.0))
        assert shapes[found.sizes.shape[k]].ratio >= 0.6
        assert total == pytest.approx(boat.NOISE[name] * math.sqrt(2.0), rel=0.25)
    assert shapes[found.sizes.shape[problem.outputs.index("r")]].ratio == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_sensor_errors_beside_declared_white_noise_are_no_effect(seed: int) -> None:
    """Positions with slow errors as large as the declared white ones, and a model with a gain 3 % off."""
    runs = boat.trials(boat.Boat(), INPUTS, headings=(0.0, 1.0, 2.5, 4.0), seed=seed)
    runs = slow_errors(runs, ("x", "y"), 10.0, seed=seed)
    found = diagnose(boat.study(Declared(), runs, boat.NOISE), threads=1, validate=False, suggest=False)
    assert found.verdict.kind in ("no_gap", "underpowered"), str(found)


@pytest.mark.slow
def test_intervals_of_95_per_cent_hold_in_95_per_cent(ship_folder: Path) -> None:
    """Sixty intervals: 57 are expected to hold, and fewer than 53 with a probability of 3 %."""
    held = []
    for seed in range(20):
        runs = small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=["rudder_offset"], seed=seed)
        problem = small.problem(ship_folder, runs)
        held += (np.abs(zs(problem, fitted(problem, ("rudder_offset",)), TRUE)) < 1.96).tolist()
    assert sum(held) >= 53


def test_priors_enter(ship_folder: Path, offset_runs: list[Trial]) -> None:
    study = small.study(ship_folder, offset_runs[:1])
    tight = study.replace(parameters=tuple(p.replace(prior=Prior(p.value, 1e-6 * p.value)) for p in study.parameters))
    problem = Problem(tight, load_effects(("rudder_offset",)), Settings(), threads=1)
    found = fitted(problem, ("rudder_offset",))
    np.testing.assert_allclose(found.point.shared[problem.coefficients], problem.mean[problem.coefficients], rtol=1e-4)


@pytest.mark.parametrize("same", [True, False])
def test_the_evidence_pays_for_a_current_of_each_trial(same: bool) -> None:
    """One current in all trials is explained by one; where they differ, each trial needs its own."""
    model = boat.Boat()
    angles = [{"delta": boat.zigzag(40, 0.3, 8.0)} for _ in range(3)]
    own = available()["trial_current"].of_trials(["run_0", "run_1", "run_2"])
    north, east = ((0.2, 0.2, 0.2), (0.1, 0.1, 0.1)) if same else ((0.2, -0.1, 0.0), (0.0, 0.1, -0.2))
    truth = {f"trial_current_north_run_{k}": v for k, v in enumerate(north)}
    truth |= {f"trial_current_east_run_{k}": v for k, v in enumerate(east)}
    runs = boat.trials(model, angles, headings=(0.0, 2.0, 4.0), effects=truth, specs=(own,))
    problem = Problem(boat.study(model, runs), [available()["current"], own], Settings(), threads=1)
    found = {key: fitted(problem, key) for key in ((), ("current",), ("trial_current",))}
    assert np.abs(zs(problem, found["trial_current",], truth)).max() < 4.0
    ahead = found["trial_current",].evidence - found["current",].evidence
    assert found["current",].evidence > found[()].evidence + 3.0
    if same:
        assert ahead < -3.0
    else:
        assert ahead > 20.0


def test_currents_that_differ_a_little_are_told_from_one_current() -> None:
    """What trials have in common is paid for once: differences of a fifth are worth values of their own."""
    model, truth = boat.Boat(), {}
    own = available()["trial_current"].of_trials([f"run_{k}" for k in range(4)])
    for k, (north, east) in enumerate([(0.20, 0.10), (0.24, 0.08), (0.17, 0.12), (0.21, 0.06)]):
        truth |= {f"trial_current_north_run_{k}": north, f"trial_current_east_run_{k}": east}
    angles = [{"delta": boat.zigzag(40, 0.3, 8.0)} for _ in range(4)]
    runs = boat.trials(model, angles, headings=(0.0, 2.0, 4.0, 5.0), effects=truth, specs=(own,))
    problem = Problem(boat.study(model, runs), [available()["current"], own], Settings(), threads=1)
    found = {key: fitted(problem, key).evidence for key in (("current",), ("trial_current",))}
    problem.prior_correlation = {}
    alone = fitted(problem, ("trial_current",)).evidence
    assert found["trial_current",] > max(found["current",], alone) + 2.0
