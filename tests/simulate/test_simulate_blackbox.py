"""A user's own simulator behind the same interface: the same numbers as the compiled model gives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from known_models import Lag, record_of

from seatruth.errors import BadInput, PluginError
from seatruth.models.black_box import BlackBox
from seatruth.models.isolated import failures_of
from seatruth.simulate import evaluate_rhs, simulator
from seatruth.trials.trial import Trial


def lag_in_python(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, Any]:
    """The same Runge-Kutta steps, by hand."""
    assert first is not None
    push, t = trial.inputs["push"], trial.t
    x, angle = [first["x"]], [first["angle"]]
    for k in range(len(t) - 1):
        h, ends = t[k + 1] - t[k], (push[k], 0.5 * (push[k] + push[k + 1]), push[k + 1])

        def rate(x: float, u: float) -> float:
            return (p["k"] * u - x) / p["T"]

        k1 = rate(x[-1], ends[0])
        k2 = rate(x[-1] + h / 2 * k1, ends[1])
        k3 = rate(x[-1] + h / 2 * k2, ends[1])
        k4 = rate(x[-1] + h * k3, ends[2])
        a, b, c = x[-1] + h / 2 * k1, x[-1] + h / 2 * k2, x[-1] + h * k3
        angle.append(angle[-1] + h / 6 * (x[-1] + 2 * a + 2 * b + c))
        x.append(x[-1] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    found = {"x": np.array(x), "angle": np.array(angle)}
    return {name: values * math.nan for name, values in found.items()} if p["k"] > 5.0 else found


def box() -> BlackBox:
    lag = Lag()
    return BlackBox(
        "lag", lag_in_python, inputs=lag.inputs, outputs=lag.outputs, parameters=lag.parameters, states=lag.states
    )


def trials() -> list[Trial]:
    t = np.arange(21) * 0.1
    return [record_of(t, np.sin, x=0.1 * t, angle=t), record_of(t[:12], np.cos, name="other", x=t[:12])]


def test_a_function_that_gives_up_at_some_parameters_has_diverged_there() -> None:
    """A diagnosis of a boat ended after four minutes with "RuntimeError: diverged" of its simulator, nothing kept."""

    def gives_up(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, Any]:
        if p["k"] > 5.0:
            raise RuntimeError("diverged")
        return lag_in_python(trial, p, first)

    model = box()
    model.function = gives_up
    sim = simulator(model, trials(), free=("k", "T"))
    with pytest.raises(PluginError, match="RuntimeError: diverged"):
        sim.outputs(np.array([[6.0, 2.0]]), sim.initial_states)
    found = sim.outputs(np.array([[1.5, 2.0], [6.0, 2.0]]), sim.initial_states)
    assert found.diverged.tolist() == [[False, False], [True, True]]
    assert (
        failures_of(model) == "2 of 4 runs of the simulator failed: 2 times its function raised RuntimeError: diverged."
    )
    model.succeeded = {"other": 1}  # nothing was ever given for the first trial: that is no divergence
    with pytest.raises(PluginError, match="RuntimeError: diverged"):
        sim.outputs(np.array([[6.0, 2.0]]), sim.initial_states)


def test_it_agrees_with_the_compiled_model() -> None:
    pair = [simulator(model, trials(), free=("k", "T")) for model in (Lag(), box())]
    theta = np.array([[1.5, 2.0], [1.2, 1.0], [0.7, 3.0]])
    weights = np.linspace(0.5, 1.5, pair[0].measured.size).reshape(pair[0].measured.shape)
    ours, theirs = (sim.squared_errors(theta, sim.initial_states + 0.1, weights) for sim in pair)
    assert theirs.sums == pytest.approx(ours.sums, rel=1e-9)
    assert theirs.x_end == pytest.approx(ours.x_end, rel=1e-9)
    ours_j, theirs_j = (sim.jacobian(theta[0], sim.initial_states, ["x", "angle"]) for sim in pair)
    assert theirs_j.dy == pytest.approx(ours_j.dy, abs=1e-8)
    assert theirs_j.dx_end == pytest.approx(ours_j.dx_end, abs=1e-8)
    assert theirs_j.y == pytest.approx(ours_j.y, rel=1e-9)
    states = [sim.states(theta[0], sim.initial_states) for sim in pair]
    assert states[1] == pytest.approx(states[0], rel=1e-9)
    assert pair[0].steps == pair[1].steps


def test_runs_that_are_not_finite_have_diverged() -> None:
    sim = simulator(box(), trials(), free=("k",))
    found = sim.squared_errors(np.array([[1.0], [9.0]]), sim.initial_states, np.ones(sim.measured.shape))
    assert found.diverged.tolist() == [[False, False], [True, True]]
    assert np.isinf(found.sums[1]).all()


def test_what_a_black_box_cannot_do_is_said() -> None:
    with pytest.raises(BadInput, match="black box"):
        evaluate_rhs(box(), np.zeros(0), (), box().nominal(), np.zeros((3, 2)), np.zeros((3, 1)))
    sim = simulator(box(), trials(), free=("k",))
    assert np.isnan(sim.discretisation_error(np.ones(1), sim.initial_states)).all()
    with pytest.raises(BadInput, match="no state"):
        sim.jacobian(np.ones(1), sim.initial_states, ["z"])
    with pytest.raises(BadInput, match="no input"):
        simulator(box(), [Trial("bare", np.arange(3.0), {}, {})])
