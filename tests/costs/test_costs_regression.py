"""Equation error: the published recoveries in the diving plane, and that all views of the cost agree."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from known_runs import VISCOUS, Yaw, YawGain, dive, diving_parameters, yaw_trials

from seatruth.costs import cost_of
from seatruth.costs.finite_differences import differences
from seatruth.costs.options import RegressionOptions, TrajectoryOptions, option_names
from seatruth.costs.regression import RegressionCost
from seatruth.errors import BadInput
from seatruth.models.diving_plane import DivingPlane
from seatruth.models.parameter import Prior
from seatruth.optimizers import Budget, minimise
from seatruth.study import Study
from seatruth.trials.trial import Trials

DIVE = dive()
TRUTH = DivingPlane().nominal()
DOMINANT = ("X_uu", "X_wq", "X_qq", "Z_0", "Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds", "z_B")


def diving(**changes: Any) -> Study:
    options = {name: changes.pop(name) for name in option_names(RegressionOptions) if name in changes}
    fields: dict[str, Any] = {
        "name": "dive",
        "model": DivingPlane(),
        "trials": Trials([DIVE]),
        "parameters": diving_parameters(off=0.5),
        "cost": RegressionOptions(**options),
        **changes,
    }
    return Study(**fields)


def regression_of(study: Study) -> RegressionCost:
    cost = cost_of(study)
    assert isinstance(cost, RegressionCost)
    return cost


def errors_of(study: Study, solver: Any = "ls_svm", **options: Any) -> dict[str, float]:
    """Relative error in per cent by parameter."""
    cost = cost_of(study)
    x = minimise(cost, solver, **options).x
    return {name: 100 * (value / TRUTH[name] - 1) for name, value in zip(cost.names, x)}


def test_trapezoid_recovers_the_dominant_coefficients_as_published() -> None:
    found = errors_of(diving())
    assert all(abs(found[name]) < 1.5 for name in DOMINANT)
    # the quadratic ones are hardly excited: 9 % and more, as in the published pattern
    assert 5 < found["Z_aw"] < 15
    assert all(abs(found[name]) > 9 for name in ("Z_waw", "Z_qaq", "M_aw", "M_waw", "M_qaq"))
    assert found["Z_waw"] == pytest.approx(42, abs=8)
    assert found["M_waw"] == pytest.approx(-243, abs=60)


def test_euler_and_central_differ_as_published() -> None:
    euler, central = errors_of(diving(form="euler")), errors_of(diving(form="central"))
    assert all(5 < abs(euler[name]) < 25 for name in ("Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds"))
    assert all(1 < abs(central[name]) < 5 for name in ("Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds"))


def test_more_fin_identifies_the_weak_ones_too() -> None:
    found = errors_of(diving(trials=Trials([dive(fin_deg=15.0)])))
    assert found.pop("M_waw") == pytest.approx(-17, abs=4)
    assert all(abs(error) < 2.0 for error in found.values())


def test_other_solvers_reach_the_same_regression() -> None:
    reference = errors_of(diving())
    squares = errors_of(diving(), "least_squares")
    newton = errors_of(diving(), "newton")
    for name in DOMINANT:
        assert squares[name] == pytest.approx(reference[name], abs=0.05)
        assert newton[name] == pytest.approx(reference[name], abs=0.05)
    few = ("Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds")
    bounded = tuple(
        q.replace(min=min(0.2 * TRUTH[q.name], 3 * TRUTH[q.name]), max=max(0.2 * TRUTH[q.name], 3 * TRUTH[q.name]))
        if q.name in few
        else q
        for q in diving_parameters(few, off=0.5)
    )
    closed = errors_of(diving(parameters=bounded))
    swarm = errors_of(diving(parameters=bounded), "differential_swarm", budget=Budget(20_000), seed=3)
    for name in few:
        assert swarm[name] == pytest.approx(closed[name], abs=0.1)


def test_simulation_with_the_recovered_coefficients_follows_the_run() -> None:
    cost = cost_of(diving())
    x = minimise(cost, "ls_svm").x
    (y,) = cost.predict(x)
    names = [channel.name for channel in cost.problem.model.outputs]
    depth = y[:, names.index("z")] - DIVE.outputs["z"]
    pitch = np.degrees(y[:, names.index("theta")] - DIVE.outputs["theta"])
    assert np.abs(depth).max() < 0.1
    assert np.sqrt(np.mean(pitch**2)) < 0.1
    assert cost.discretisation(x)["theta"] < np.radians(0.01)


def test_trajectory_fit_recovers_what_the_regression_cannot() -> None:
    """The same run through output error: the run has no noise, so everything that it excites comes back exactly."""
    few = ("X_uu", "Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds", "M_qaq")
    study = diving(cost=TrajectoryOptions(), parameters=diving_parameters(few, off=0.7))
    found = errors_of(study, "least_squares")
    # The run was made with the fin at mid-step as the mean of the ends, as the engine does: agreement to rounding.
    assert max(abs(error) for error in found.values()) < 0.01


def test_a_swarm_recovers_them_from_anywhere_by_simulation() -> None:
    few = ("X_uu", "Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds")
    parameters = tuple(
        q.replace(min=min(0.2 * q.value, 3 * q.value), max=max(0.2 * q.value, 3 * q.value), value=1.7 * q.value)
        if q.name in few
        else q
        for q in diving_parameters(few)
    )
    noise = {"u": 0.01, "w": 1e-3, "q": 1e-3, "theta": 1e-3, "z": 0.01, "x": 0.1}
    study = diving(cost=TrajectoryOptions(), parameters=parameters, noise=noise)
    found = errors_of(study, "differential_swarm", budget=Budget(50_000), seed=4)
    assert max(abs(error) for error in found.values()) < 0.01


@pytest.mark.parametrize("form", ["euler", "central", "trapezoid"])
def test_values_residuals_derivatives_and_regression_agree(form: str) -> None:
    parameters = tuple(
        q.replace(prior=Prior(-0.07, 0.004))
        if q.name == "Z_ds"
        else q.replace(expr="-0.5 * Z_ds")
        if q.name == "X_ww"
        else q
        for q in diving_parameters(off=0.8)
    )
    cost = cost_of(diving(parameters=parameters, form=form))
    rng = np.random.default_rng(1)
    x = cost.start * (1 + 0.1 * rng.standard_normal(len(cost.start)))
    cost.reweight(x)
    r, jacobian = cost.residuals(x), cost.jacobian(x)
    assert cost.value_of(r) == pytest.approx(cost.values(x[None])[0], rel=1e-9)
    for k in range(len(x)):
        step = 1e-3 * abs(x[k]) * np.eye(len(x))[k]  # linear: any step is exact
        expected = (cost.residuals(x + step) - cost.residuals(x - step)) / (2e-3 * abs(x[k]))
        np.testing.assert_allclose(jacobian[:, k], expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())
    X = x * (1 + 0.05 * rng.standard_normal((30, len(x))))
    np.testing.assert_allclose(cost.values(X), [cost.value_of(cost.residuals(row)) for row in X], rtol=1e-9)
    blocks = cost.regression().blocks
    assert [block.name for block in blocks] == ["equation of u", "equation of w", "equation of q"]
    for block, state in zip(blocks, ("u_dot", "w_dot", "q_dot")):
        rows = next(group.rows for group in cost.residual_blocks if group.channel == state)
        error = block.target - block.regressors @ x[block.columns]
        np.testing.assert_allclose(error, r[rows] * cost.sigma[state], rtol=1e-7, atol=1e-12)


def test_a_constant_thrust_is_the_intercept() -> None:
    free = ("X_uu", "X_wq", "X_qq", "X_T")
    parameters = diving_parameters(free, off=0.5)
    cost = cost_of(diving(parameters=parameters))
    (block,) = cost.regression().blocks
    assert block.intercept
    assert block.intercept_index == cost.names.index("X_T")
    found = errors_of(diving(parameters=parameters))
    assert all(abs(error) < 2 for error in found.values())


def test_a_measured_acceleration_is_used_as_it_is() -> None:
    cost = regression_of(diving(form="euler"))
    x = np.array([TRUTH[name] for name in cost.names])
    exact = {name: np.array(values) for name, values in DIVE.outputs.items()}
    rates = cost._predicted(x[None])[0]  # the true accelerations at the samples
    for column, state in enumerate(cost.equations):
        exact[f"{state}_dot"] = rates[:, column]
    found = errors_of(diving(trials=Trials([replace(DIVE, outputs=exact)]), form="euler"), "least_squares")
    assert max(abs(error) for error in found.values()) < 0.01


def test_differences_leave_gaps_out() -> None:
    t = np.array([0.0, 1, 2, 3, 9, 10, 11])
    x = (t**2)[:, None]
    euler, ahead = differences(t, x, "euler")
    np.testing.assert_array_equal(euler[:, 0], [1, 3, 5, np.nan, 19, 21, np.nan])
    assert not ahead.any()
    central, _ = differences(t, x, "central")
    np.testing.assert_array_equal(central[:, 0], [np.nan, 2, 4, np.nan, np.nan, 20, np.nan])
    step, ahead = differences(t, x, "trapezoid")
    np.testing.assert_array_equal(step, euler)
    np.testing.assert_array_equal(ahead, [0.5] * 6 + [0])


def test_gaps_and_several_trials() -> None:
    gain = YawGain()
    trials = yaw_trials(("a", "b", "c"), model=gain, noise=(0, 0))
    holes = [
        replace(
            trial,
            outputs={"psi": trial.outputs["psi"], "r": np.where(np.arange(240) % 50 < 7, np.nan, trial.outputs["r"])},
        )
        for trial in trials
    ]
    cost = regression_of(Study("gain", gain, Trials(holes), cost=RegressionOptions()))
    assert cost.equations == ("r",)
    assert len(cost.residuals(cost.start)) < 3 * (239 - 5 * 7)
    np.testing.assert_allclose(minimise(cost, "ls_svm").x, [0.025, -0.125, -4.0], rtol=0.03)


def test_nonlinear_equations_take_residuals() -> None:
    cost = regression_of(Study("yaw", Yaw(), yaw_trials(noise=(0, 0)), cost=RegressionOptions()))
    assert cost.linear is None
    with pytest.raises(BadInput, match="'T' does not enter"):
        cost.regression()
    far = cost.start * 1.3
    jacobian = cost.jacobian(far)
    for k in range(3):
        step = 1e-6 * far[k] * np.eye(3)[k]
        expected = (cost.residuals(far + step) - cost.residuals(far - step)) / (2e-6 * far[k])
        np.testing.assert_allclose(jacobian[:, k], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(minimise(cost, "least_squares").x, [0.2, 8.0, 30.0], rtol=0.06)
    assert cost.values(far[None])[0] == pytest.approx(cost.value_of(cost.residuals(far)))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lost": "w"}, "equation of 'u' needs state 'w', which no trial measured"),
        ({"lost": "theta"}, "equation of 'w' needs state 'theta'|equation of 'q' needs state 'theta'"),
        ({"equations": ["x"]}, "equation of 'x' holds no free parameter"),
        ({"equations": ["heave"]}, "no equation of 'heave'"),
    ],
)
def test_what_cannot_be_done_is_said(changes: dict[str, Any], message: str) -> None:
    changes = dict(changes)
    lost = changes.pop("lost", None)
    trial = replace(DIVE, outputs={name: values for name, values in DIVE.outputs.items() if name != lost})
    with pytest.raises(BadInput, match=message):
        cost_of(diving(trials=Trials([trial]), **changes))


def test_chosen_equations_only() -> None:
    surge = diving(parameters=diving_parameters(("X_uu", "X_wq", "X_qq")))
    assert regression_of(surge).equations == ("u",)
    assert regression_of(diving(equations=["w", "q"])).equations == ("w", "q")
    assert set(VISCOUS) == set(cost_of(diving()).names)
