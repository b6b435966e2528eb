"""Output-error cost: values, residuals and derivatives agree; options do what they say; optima are the right ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from known_runs import Yaw, YawGain, yaw_trials
from scipy.optimize import least_squares

from seatruth.costs import TrajectoryCost, cost_of
from seatruth.costs.options import TrajectoryOptions, option_names
from seatruth.errors import BadInput
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter, Prior
from seatruth.optimizers import Budget, Problem, StaleCheckpoint, from_callable, minimise
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

NOISE = {"psi": 0.01, "r": 0.002}
TRIALS = yaw_trials()


def with_gaps(trials: Trials) -> Trials:
    found = []
    for k, trial in enumerate(trials):
        outputs = {name: np.array(values) for name, values in trial.outputs.items()}
        outputs["psi"][30 + 5 * k : 60] = np.nan
        outputs["r"][::3] = np.nan
        if k:
            del outputs["r"]
        found.append(replace(trial, outputs=outputs))
    return Trials(found)


def tied() -> tuple[Parameter, ...]:
    """The model's parameters with one tied to two free ones (and used by nothing), one tied into the equations."""
    return tuple(
        q.replace(expr="0.5 * K * T + 20 * K", vary=False, prior=Prior(5.0, 0.7))
        if q.name == "c"
        else q.replace(expr="K / T")
        if q.name == "K_over_T"
        else q.replace(prior=Prior(0.25, 0.02))
        if q.name == "K"
        else q
        for q in Yaw.parameters
    )


def study(**changes: Any) -> Study:
    options = {name: changes.pop(name) for name in option_names(TrajectoryOptions) if name in changes}
    fields = {"name": "yaw", "model": Yaw(), "trials": TRIALS, "noise": NOISE, "cost": TrajectoryOptions(**options)}
    return Study(**{**fields, **changes})


STUDIES: dict[str, Callable[[], Study]] = {
    "plain": study,
    "free": lambda: study(initial="free"),
    "prior": lambda: study(initial="free", initial_sd={"psi": 0.02}),
    "gaps": lambda: study(trials=with_gaps(TRIALS), initial="free"),
    "tied": lambda: study(parameters=tied(), constraints=["K * T > 0"]),
    "segments": lambda: study(segments=30.0),
    "free segments": lambda: study(segments=30.0, initial="free", trials=with_gaps(TRIALS)),
    "shooting": lambda: study(segments=30.0, multiple_shooting=True),
    "free shooting": lambda: study(
        segments=30.0, multiple_shooting=True, initial="free", initial_sd={"r": 0.01}, parameters=tied()
    ),
    "estimated": lambda: study(noise={"psi": 0.01}, initial="free"),
    "likelihood": lambda: study(noise={}, criterion="likelihood", trials=with_gaps(TRIALS)),
    "likelihood shooting": lambda: study(
        noise={}, criterion="likelihood", segments=30.0, multiple_shooting=True, initial="free"
    ),
}


def near(cost: TrajectoryCost, rng: np.random.Generator, size: float = 0.05) -> np.ndarray:
    low, high = cost.bounds
    scale = np.maximum(np.abs(cost.start), 0.2 * (high - low))
    return np.clip(cost.start + size * scale * rng.standard_normal(len(cost.start)), low, high)


@pytest.mark.parametrize("name", STUDIES)
def test_values_residuals_and_derivatives_agree(name: str) -> None:
    cost = cost_of(STUDIES[name]())
    rng = np.random.default_rng(3)
    x = near(cost, rng)
    cost.reweight(x)
    r = cost.residuals(x)
    value = cost.values(x[None])[0]
    assert cost.value_of(r) == pytest.approx(value, rel=1e-9)
    if cost.noise_known:
        assert 0.5 * r @ r == pytest.approx(value, rel=1e-9)
    jacobian = cost.jacobian(x)
    assert jacobian.shape == (len(r), len(x))
    for k in range(len(x)):
        h = 1e-5 * max(abs(x[k]), 1e-2)
        step = h * np.eye(len(x))[k]
        expected = (cost.residuals(x + step) - cost.residuals(x - step)) / (2 * h)
        np.testing.assert_allclose(jacobian[:, k], expected, rtol=1e-4, atol=1e-6 * np.abs(expected).max() + 1e-9)
    # where noise was estimated, the slope of the cost is that of the weighted residuals
    direction = rng.standard_normal(len(x)) * np.maximum(np.abs(x), 1e-2)
    ahead, behind = (cost.values((x + sign * 1e-6 * direction)[None])[0] for sign in (1, -1))
    assert (jacobian.T @ r) @ direction == pytest.approx((ahead - behind) / 2e-6, rel=2e-4, abs=1e-3)


@pytest.mark.parametrize("name", STUDIES)
def test_groups_hold_every_residual_once_and_say_where_it_is_from(name: str) -> None:
    made = STUDIES[name]()
    cost = cost_of(made)
    x = cost.start
    r = cost.residuals(x)
    rows = np.concatenate([group.rows for group in cost.residual_blocks])
    assert sorted(rows) == list(range(len(r)))
    whole = cost.predict(x)
    for group in cost.residual_blocks:
        if group.kind != "data":
            continue
        trial = made.trials[group.trial]
        np.testing.assert_array_equal(group.t, trial.t[group.sample])
        assert (np.diff(group.sample) > 0).all()
        assert np.isfinite(trial.outputs[group.channel][group.sample]).all()
        if made.cost.segments is None and made.cost.criterion == "weighted":
            column = [channel.name for channel in made.model.outputs].index(group.channel)
            error = trial.outputs[group.channel] - whole[made.trials.names.index(group.trial)][:, column]
            np.testing.assert_allclose(r[group.rows] * cost.sigma[group.channel], error[group.sample], atol=1e-12)
    priors = {group.channel for group in cost.residual_blocks if group.kind == "prior"}
    assert priors == {
        "plain": set(),
        "tied": {"K", "c"},
        "prior": {"a: psi", "b: psi"},
        "free shooting": {"K", "c", "a: r", "b: r"},
    }.get(name, set())


@given(st.lists(st.integers(1, 239), min_size=1, max_size=60), st.floats(0.9, 1.1))
@settings(max_examples=15, deadline=None)
def test_samples_that_are_not_valid_take_no_part(lost: list[int], factor: float) -> None:
    trial = TRIALS[0]
    outputs = {name: np.array(values) for name, values in trial.outputs.items()}
    outputs["psi"][lost] = np.nan
    cost = cost_of(study(trials=Trials([replace(trial, outputs=outputs)])))
    full = cost_of(study(trials=Trials([trial])))
    x = cost.start * factor
    error = (trial.outputs["psi"] - full.predict(x)[0][:, 0])[sorted(set(lost))]
    missing = 0.5 * np.sum((error / NOISE["psi"]) ** 2)
    assert cost.values(x[None])[0] + missing == pytest.approx(full.values(x[None])[0], rel=1e-9)


def test_populations_cost_what_their_members_cost_and_do_not_depend_on_threads() -> None:
    made = STUDIES["free shooting"]()
    cost, other = cost_of(made, threads=1), cost_of(made, threads=3)
    rng = np.random.default_rng(0)
    X = np.array([near(cost, rng) for _ in range(40)])
    values = cost.values(X)
    np.testing.assert_array_equal(values, other.values(X))
    np.testing.assert_allclose(values, [cost.values(x[None])[0] for x in X], rtol=1e-12)


def test_candidates_that_diverge_or_break_a_constraint_cost_infinity() -> None:
    cost = cost_of(study(constraints=["K < 0.3"]))
    wild = np.array([0.2, 1e-3, -3e6])
    broken = np.array([0.31, 8.0, 30.0])
    fair = cost.start
    np.testing.assert_array_equal(np.isinf(cost.values(np.array([wild, fair, broken]))), [True, False, True])
    assert np.isinf(cost.residuals(broken)).all()
    assert np.isinf(cost.residuals(wild)).all()
    assert len(cost.residuals(wild)) == len(cost.residuals(fair))
    unknown = cost_of(study(noise={}))
    assert np.isinf(unknown.values(wild[None]))
    before = unknown.sigma
    assert not unknown.reweight(wild)
    assert unknown.sigma == before
    outcome = minimise(cost, "least_squares")
    assert outcome.code == "converged"
    assert cost.space.feasible(outcome.x[None])[0]


def test_fixed_and_free_starts() -> None:
    fixed, free = cost_of(study()), cost_of(study(initial="free"))
    assert fixed.nuisances == ()
    assert free.nuisances == ("a: r", "a: psi", "b: r", "b: psi")
    assert free.names[:3] == ("K", "T", "c")
    assert len(fixed.residuals(fixed.start)) == 4 * 239  # first samples are matched, not fitted
    assert len(free.residuals(free.start)) == 4 * 240
    found = minimise(free, "least_squares").x
    # the true starts: r 0.01 and 0.02, psi 0.2 and 0.1
    np.testing.assert_allclose(found[3:], [0.01, 0.2, 0.02, 0.1], atol=0.006)
    assert abs(minimise(fixed, "least_squares").x[0] / 0.2 - 1) < 0.15


def test_a_start_that_no_output_feels_is_not_freed() -> None:
    only_r = Trials([replace(trial, outputs={"r": trial.outputs["r"]}) for trial in TRIALS])
    cost = cost_of(study(trials=only_r, initial="free"))
    assert cost.nuisances == ("a: r", "b: r")


def test_a_prior_on_the_start_counts_the_first_sample_once() -> None:
    cost = cost_of(STUDIES["prior"]())
    psi = [group for group in cost.residual_blocks if group.kind == "data" and group.channel == "psi"]
    assert all(group.sample[0] == 1 for group in psi)
    tight = cost_of(study(initial="free", initial_sd={"psi": 1e-6, "r": 1e-6}))
    found = minimise(tight, "least_squares").x
    np.testing.assert_allclose(found[3:], tight.start[3:], atol=1e-5)
    np.testing.assert_allclose(found[:3], minimise(cost_of(study()), "least_squares").x, rtol=1e-3)


def test_multiple_shooting_reaches_the_optimum_of_whole_runs() -> None:
    whole = cost_of(study(initial="free"))
    pieces = cost_of(study(initial="free", segments=20.0, multiple_shooting=True))
    assert len(pieces.parameters) > 20
    best, joined = minimise(whole, "least_squares"), minimise(pieces, "least_squares")
    np.testing.assert_allclose(joined.x[:3], best.x[:3], rtol=2e-4)
    assert joined.value == pytest.approx(best.value, abs=0.05)
    gaps = [group for group in pieces.residual_blocks if group.kind == "continuity"]
    assert {group.channel for group in gaps} == {"psi", "r"}
    np.testing.assert_allclose(pieces.predict(joined.x)[1], whole.predict(best.x)[1], atol=1e-3)


def test_segments_start_anew_from_the_data() -> None:
    cost = cost_of(study(segments=30.0, trials=yaw_trials(noise=(0, 0))))
    x = np.array([0.2, 8.0, 30.0])
    assert cost.values(x[None])[0] == pytest.approx(0, abs=1e-12)
    errors = cost.errors(np.array([0.3, 8.0, 30.0]))
    assert np.nanmax(np.abs(errors)) < 1.0  # an open run of 120 s drifts by more
    assert minimise(cost, "least_squares").x == pytest.approx(x, rel=1e-6)


@pytest.mark.parametrize("criterion", ["weighted", "likelihood"])
def test_unknown_noise_every_solver_finds_the_same_likelihood(criterion: str) -> None:
    made = study(noise={"psi": "estimate"}, criterion=criterion)
    reference = minimise(cost_of(made), "newton")
    assert reference.code == "converged"

    def forgetful(problem: Problem, rng: np.random.Generator) -> str:
        """A solver of residuals that knows nothing of weights."""
        return str(least_squares(problem.residuals, problem.start, problem.jacobian, x_scale="jac").message)

    other = from_callable(forgetful, needs=frozenset({"residuals", "derivatives"}))
    for solver in ("least_squares", other, "nelder_mead", ["differential_evolution", "least_squares"]):
        cost = cost_of(made)
        outcome = minimise(cost, solver, seed=2, budget=Budget(3000))
        np.testing.assert_allclose(outcome.x, reference.x, rtol=3e-4, err_msg=str(solver))
        assert outcome.value == pytest.approx(reference.value, abs=1e-3)
        assert outcome.value == pytest.approx(cost.values(outcome.x[None])[0], abs=1e-6)
        assert cost.sigma == pytest.approx({"psi": 0.01, "r": 0.002}, rel=0.1)
        assert cost.estimated == {"psi", "r"}


def test_estimated_noise_weighs_channels_rightly_from_a_far_start() -> None:
    far = tuple(q.replace(value=3 * q.value) if q.vary else q for q in Yaw.parameters)
    found = minimise(cost_of(study(noise={}, parameters=far)), "least_squares")
    near_by = minimise(cost_of(study(noise={})), "least_squares")
    np.testing.assert_allclose(found.x, near_by.x, rtol=1e-4)


def test_an_interrupted_hybrid_with_unknown_noise_goes_on_with_the_same_result(tmp_path: Path) -> None:
    solvers = ["differential_swarm", "least_squares"]
    whole = minimise(cost_of(study(noise={})), solvers, seed=5, budget=Budget(1500))
    first = minimise(cost_of(study(noise={})), solvers, seed=5, budget=Budget(1500), checkpoint=tmp_path / "c")
    cost = cost_of(study(noise={}))
    again = minimise(cost, solvers, seed=5, budget=Budget(1500), checkpoint=tmp_path / "c")
    assert whole.value == first.value == again.value
    np.testing.assert_array_equal(whole.x, again.x)
    changed = cost_of(study(noise={"r": 0.002}))
    with pytest.raises(StaleCheckpoint, match="differ"):
        minimise(changed, solvers, seed=5, budget=Budget(1500), checkpoint=tmp_path / "c")


def test_predictions_of_other_trials() -> None:
    new = yaw_trials(("c",), seed=8, n=400)
    x = np.array([0.2, 8.0, 30.0])
    for initial in ("fixed", "free"):
        cost = cost_of(study(initial=initial))
        full = np.concatenate([x, cost.start[3:]])
        (predicted,) = cost.predict(full, new)
        assert predicted.shape == (400, 2)
        error = np.stack([new[0].outputs["psi"], new[0].outputs["r"]], axis=1) - predicted
        rms = np.sqrt(np.mean(error**2, axis=0))
        if initial == "free":  # the start is estimated from 80 samples, so the noise is all that is left
            assert (rms < [0.02, 0.0024]).all()
        else:
            assert (rms < [0.25, 0.01]).all()
    assert cost.predict(full, []) == []
    # nothing after the warm-up is looked at
    late = np.where(np.arange(400) < 81, new[0].outputs["psi"], 9.0)
    spoilt = replace(new[0], outputs={"psi": late, "r": new[0].outputs["r"]})
    np.testing.assert_array_equal(cost.predict(full, [spoilt])[0], predicted)


def test_discretisation_is_small_and_named() -> None:
    cost = cost_of(study())
    found = cost.discretisation(cost.start)
    assert set(found) == {"psi", "r"}
    assert 0 < found["psi"] < 1e-4


def test_regression_view_and_its_refusals() -> None:
    gain = YawGain()
    trials = yaw_trials(model=gain, noise=(1e-5, 1e-6))
    outcome = minimise(cost_of(Study("gain", gain, trials, noise={"psi": 1e-5, "r": 1e-6})), "ls_svm")
    np.testing.assert_allclose(outcome.x, [0.025, -0.125, -4.0], rtol=0.06)
    with pytest.raises(BadInput, match=r"'T' do.* not enter the equations of motion linearly"):
        minimise(cost_of(study()), "ls_svm")
    hidden = Trials([replace(trial, outputs={"psi": trial.outputs["psi"]}) for trial in trials])
    with pytest.raises(BadInput, match="state 'r', which no trial measured"):
        minimise(cost_of(Study("gain", gain, hidden)), "ls_svm")


def test_a_black_box_behind_the_same_interface() -> None:
    def run(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, np.ndarray]:
        assert first is not None
        t = trial.t - trial.t[0]
        return {"r": p["gain"] + (first["r"] - p["gain"]) * np.exp(-t / p["lag"])}

    rate = TRIALS[0].table().reset_index()["r"]
    model = BlackBox(
        "lag",
        run,
        inputs=Yaw.inputs,
        outputs=Yaw.outputs[1:],
        states=Yaw.states[:1],
        parameters=[Parameter("gain", 0.03, vary=True), Parameter("lag", 9.0, vary=True)],
    )
    t = np.arange(80) * 0.5
    y = 0.05 + (0.01 - 0.05) * np.exp(-t / 6.0) + 1e-4 * np.asarray(rate)[:80]
    trial = Trial("step", t, {"delta": np.zeros(80)}, {"r": y})
    cost = cost_of(Study("box", model, Trials([trial]), noise={"r": 1e-4}, cost=TrajectoryOptions(initial="free")))
    assert cost.nuisances == ("step: r",)
    assert "regression" not in cost.gives
    outcome = minimise(cost, "least_squares")
    np.testing.assert_allclose(outcome.x, [0.05, 6.0, 0.01], rtol=0.02)
    assert np.isnan(cost.discretisation(outcome.x)["r"])
