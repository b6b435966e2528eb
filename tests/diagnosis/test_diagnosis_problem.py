"""The problem that all hypotheses share: its derivatives, its null, its shapes."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.costs.options import TrajectoryOptions
from seatruth.diagnosis.preconditions import usable_effects
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.models import load_model
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import simulator
from seatruth.study import Study
from seatruth.testing.effects import EffectConformance
from seatruth.trials import Trials
from seatruth.trials.trial import Trial

FEW = Settings(knots=4)


@pytest.fixture(scope="module")
def problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    return small.problem(ship_folder, small.shortened(offset_runs[:2], 40), settings=FEW)


def somewhere(problem: Problem, seed: int = 0) -> Point:
    """A point with something of everything."""
    rng = np.random.default_rng(seed)
    start = problem.start
    shared = start.shared + 0.02 * rng.normal(size=start.shared.shape) * np.maximum(np.abs(start.shared), 0.05)
    shared[problem.terms] = 1e-4 * rng.normal(size=len(problem.terms))
    return Point(
        np.clip(shared, problem.low, problem.high),
        start.initial + 0.01 * rng.normal(size=start.initial.shape),
        1e-3 * rng.normal(size=start.forces.shape),
    )


def differences(problem: Problem, point: Point, step_shared: np.ndarray, step_local: np.ndarray) -> np.ndarray:
    """Central difference (N,) of the errors along one direction."""
    h = 1e-6
    ahead = problem.errors(problem.moved(point, step_shared, step_local, h))
    behind = problem.errors(problem.moved(point, step_shared, step_local, -h))
    return np.asarray((ahead - behind) / (2.0 * h))


@pytest.mark.parametrize("kind", ["coefficients", "effects", "terms"])
def test_derivatives_by_shared_unknowns(problem: Problem, kind: str) -> None:
    point = somewhere(problem)
    at = problem.linearize(point, small.EFFECTS)
    columns = {
        "coefficients": problem.coefficients,
        "terms": problem.terms,
        "effects": np.concatenate([problem.columns[name] for name in small.EFFECTS]),
    }[kind]
    none = np.zeros((2, at.local.shape[1]))
    for column in columns:
        step = np.zeros(len(problem.unknowns))
        step[column] = 1.0
        expected = differences(problem, point, step, none)
        scale = np.abs(expected).max() + 1e-6
        np.testing.assert_allclose(at.shared[:, column] / scale, expected / scale, atol=2e-5)


@pytest.fixture(scope="module")
def held_problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    """The same with inputs that are held between samples."""
    study = small.study(ship_folder, small.shortened(offset_runs[:2], 40)).replace(cost=TrajectoryOptions(hold="zoh"))
    return Problem(study, load_effects(small.EFFECTS, ship_folder), FEW, threads=1)


@pytest.fixture(scope="module")
def uneven_problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    """The same with rows lost, so that knots lie between samples."""
    few = []
    for trial in small.shortened(offset_runs[:2], 43):
        kept = np.arange(43) % 5 != 3
        series = ({name: values[kept] for name, values in each.items()} for each in (trial.inputs, trial.outputs))
        few.append(replace(trial, t=trial.t[kept], **dict(zip(("inputs", "outputs"), series))))
    problem = Problem(small.study(ship_folder, few), load_effects(small.EFFECTS, ship_folder), FEW, threads=1)
    assert problem.discrepancy is not None
    knots = problem.discrepancy.spacing * np.arange(FEW.knots)
    assert not np.isin(knots.round(6), (few[0].t - few[0].t[0]).round(6))[1:-1].all()
    return problem


@pytest.mark.parametrize("inputs", ["problem", "held_problem", "uneven_problem"])
def test_derivatives_by_initial_states_and_knots_of_each_trial(inputs: str, request: pytest.FixtureRequest) -> None:
    """Missing forces are straight lines between knots whether or not the recorded inputs are held."""
    problem = request.getfixturevalue(inputs)
    point = somewhere(problem)
    at = problem.linearize(point, ())
    zero = np.zeros(len(problem.unknowns))
    for trial in range(2):
        for column in range(at.local.shape[1]):
            step = np.zeros((2, at.local.shape[1]))
            step[trial, column] = 1.0
            expected = differences(problem, point, zero, step)
            scale = np.abs(expected).max() + 1e-6
            here = problem.trial_of == trial
            np.testing.assert_allclose(at.local[here, column] / scale, expected[here] / scale, atol=2e-5)
            assert not expected[~here].any()


def test_effects_that_are_not_in_the_hypothesis_have_no_derivative(problem: Problem) -> None:
    at = problem.linearize(problem.start, ("gyro_bias",))
    assert at.shared[:, problem.columns["gyro_bias"]].any()
    assert not at.shared[:, problem.columns["rudder_offset"]].any()
    assert set(problem.active(("gyro_bias",), discrepancy=True)) == {
        *problem.coefficients, *problem.terms, *problem.columns["gyro_bias"],
    }  # fmt: skip


def test_tied_parameters_pass_their_derivatives_on(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """T follows K by an expression: the derivative by K holds both ways in which K acts."""
    study = small.study(ship_folder, small.shortened(offset_runs[:2], 40))
    k = next(p for p in study.parameters if p.name == "K")
    tied = study.replace(parameters=(k, Parameter("T", 10.0, "s", min=1.0, max=100.0, expr="100 * K")))
    problem = Problem(tied, load_effects(("gyro_bias",)), FEW, threads=1)
    assert [problem.unknowns[c].name for c in problem.coefficients] == ["K"]
    point = somewhere(problem)
    at = problem.linearize(point, ("gyro_bias",))
    step = np.zeros(len(problem.unknowns))
    step[problem.coefficients] = 1.0
    expected = differences(problem, point, step, np.zeros((2, at.local.shape[1])))
    scale = np.abs(expected).max()
    np.testing.assert_allclose(at.shared[:, problem.coefficients[0]] / scale, expected / scale, atol=2e-5)


def test_with_nothing_missing_it_is_the_plain_model(ship_folder: Path, offset_runs: list[Trial]) -> None:
    runs = offset_runs[:2]
    study = small.study(ship_folder, runs)
    problem = Problem(study, load_effects(small.EFFECTS), Settings(), threads=1)
    simulated = problem.simulate(problem.start)
    for values, table in zip(simulated, study.simulate(threads=1).values()):
        np.testing.assert_array_equal(values, table.to_numpy())


def test_errors_are_measured_minus_simulated_where_something_was_measured(
    ship_folder: Path, offset_runs: list[Trial]
) -> None:
    psi = np.asarray(offset_runs[1].outputs["psi"]).copy()
    psi[10:30] = math.nan
    holes = [offset_runs[0], dataclasses.replace(offset_runs[1], outputs={**offset_runs[1].outputs, "psi": psi})]
    problem = small.problem(ship_folder, holes)
    errors, simulated = problem.errors(problem.start), problem.simulate(problem.start)
    assert problem.count == len(errors) == 4 * 120 - 20
    for one in problem.series:
        trial = problem.trials[one.trial]
        measured = np.asarray(trial.outputs[problem.outputs[one.channel]])
        kept = np.isfinite(measured)
        np.testing.assert_array_equal(one.t, np.asarray(trial.t)[kept])
        expected = (measured - simulated[one.trial][:, one.channel])[kept]
        np.testing.assert_allclose(errors[one.rows], expected, atol=1e-14)
        assert (problem.trial_of[one.rows] == one.trial).all()
        assert (problem.channel_of[one.rows] == one.channel).all()
        np.testing.assert_array_equal(np.asarray(trial.t)[problem.sample_of[one.rows]], one.t)
        np.testing.assert_array_equal(problem.time_of[one.rows], one.t)
    assert sum(len(one.rows) for one in problem.series) == problem.count


def test_long_records_are_decimated(ship_folder: Path, plain_runs: list[Trial]) -> None:
    t = 0.05 * np.arange(12_000)
    one = plain_runs[0]
    fine = dataclasses.replace(
        one,
        t=t,
        inputs={"delta": np.interp(t % 120.0, one.t, one.inputs["delta"])},
        outputs={name: np.interp(t % 120.0, one.t, values) for name, values in one.outputs.items()},
    )
    problem = small.problem(ship_folder, [fine])
    (trial,) = problem.trials
    assert len(trial) <= 9000
    assert any(step.name == "decimate" for step in trial.steps)
    assert problem.count <= 2 * len(trial)
    assert np.isfinite(problem.errors(problem.start)).all()


def test_times_begin_at_zero(ship_folder: Path, plain_runs: list[Trial]) -> None:
    late = [dataclasses.replace(trial, t=trial.t + 500.0) for trial in plain_runs[:2]]
    early, later = small.problem(ship_folder, plain_runs[:2]), small.problem(ship_folder, late)
    np.testing.assert_allclose(early.errors(early.start), later.errors(later.start), atol=1e-12)


def test_priors(problem: Problem) -> None:
    """Declared for coefficients; typical magnitude times `prior_width` for effects, about their null."""
    names = {problem.unknowns[c].name: c for c in problem.coefficients}
    assert problem.sd[names["K"]] == pytest.approx(0.01)
    (offset,) = problem.columns["rudder_offset"]
    assert problem.mean[offset] == 0.0
    typical = problem.effects["rudder_offset"].priors(problem.study.model)["angle"].sd
    assert problem.sd[offset] == pytest.approx(FEW.prior_width * typical)
    (gain,) = problem.columns["rudder_gain"]
    assert problem.mean[gain] == 1.0


def test_a_free_coefficient_without_prior_gets_one(ship_folder: Path, plain_runs: list[Trial]) -> None:
    study = small.study(ship_folder, plain_runs[:1])
    bare = study.replace(parameters=tuple(p.replace(prior=None) for p in study.parameters))
    problem = Problem(bare, load_effects(("gyro_bias",)), Settings(), threads=1)
    for column in problem.coefficients:
        q = problem.unknowns[column]
        assert q.prior == Prior(q.value, Settings().coefficient_sd * q.value)


def test_a_divergent_run_has_infinite_errors(problem: Problem) -> None:
    shared = problem.start.shared.copy()
    (gain,) = problem.columns["rudder_gain"]
    shared[gain] = 1e307
    assert not np.isfinite(problem.errors(dataclasses.replace(problem.start, shared=shared))).all()


def test_a_step_keeps_parameters_in_their_bounds(problem: Problem) -> None:
    local = np.zeros((2, problem.local_offset(problem.start).shape[1]))
    far = problem.moved(problem.start, np.full(len(problem.unknowns), 1e6), local)
    assert (far.shared <= problem.high).all()
    (gain,) = problem.columns["rudder_gain"]
    assert far.shared[gain] == problem.high[gain]


def test_local_offset_leads_back_to_the_prior_means(problem: Problem) -> None:
    point = somewhere(problem)
    back = problem.moved(point, np.zeros(len(problem.unknowns)), problem.local_offset(point))
    np.testing.assert_allclose(back.initial, problem.initial_mean, atol=1e-14)
    np.testing.assert_allclose(back.forces, 0.0, atol=1e-14)


def test_on_another_trial_nothing_is_missing(problem: Problem, plain_runs: list[Trial]) -> None:
    trial = plain_runs[3]
    sim = problem.on_trial(trial, (), {"K": 0.12})
    y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
    expected = problem.study.simulate({"K": 0.12}, [trial], threads=1)["run_3"].to_numpy()
    np.testing.assert_array_equal(y, expected)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bluerov2_heavy", "mmg", "torpedo", "twin_thruster"])
def test_a_model_takes_all_effects_and_terms_at_once(name: str) -> None:
    """The largest models of each kind: their equations with derivatives must still compile."""
    model = load_model(name)
    trial, first = EffectConformance().trial(model)
    y = simulator(model, [trial], max_step=0.1).outputs(np.zeros((1, 0)), first[None]).y[0]
    outputs = {channel.name: y[:, k] for k, channel in enumerate(model.outputs)}
    study = Study(name, model, Trials([dataclasses.replace(trial, outputs=outputs, synthetic=True)]))
    effects, _ = usable_effects(study, None)
    problem = Problem(study, effects, Settings(), threads=1)
    at = problem.linearize(problem.start, tuple(problem.effects))
    assert len(problem.terms) > 5
    assert np.isfinite(at.shared).all()
    shown = [n for n in problem.effects if at.shared[:, problem.columns[n]].any()]
    assert len(shown) > 0.5 * len(effects), f"{sorted(set(problem.effects) - set(shown))} do not show"
