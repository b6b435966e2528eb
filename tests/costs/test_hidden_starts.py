"""Hidden states of a sensor's delay start with the motion that they follow, not with the noise of the first sample."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.costs import TrajectoryCost
from seatruth.costs.options import TrajectoryOptions
from seatruth.effects import available, with_effects
from seatruth.models import load_model
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

STEP, LENGTH = 0.5, 120


def trial(noise: float = 0.05, seed: int = 0) -> Trial:
    """Ten-degree steps of the rudder at a steady speed, with outputs that are nothing but noise about the start."""
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(LENGTH)
    delta = np.radians(10.0) * np.sign(np.sin(t / 6.0))
    outputs = {name: noise * rng.normal(size=LENGTH) for name in ("x", "y", "psi", "v", "r")}
    outputs["u"] = 1.18 + noise * rng.normal(size=LENGTH)
    return Trial("steps", t, {"delta": delta, "n": np.full(LENGTH, 11.85)}, outputs, synthetic=True)


def cost_with(effect: str, tau: float, noise: float = 0.05) -> TrajectoryCost:
    model = with_effects(load_model("mmg"), [available()[effect]])
    parameters = tuple(
        p.replace(vary=p.name.startswith(effect), value=tau if p.name.startswith(effect) else p.value)
        for p in model.parameters
    )
    sizes = {channel.name: 1.0 for channel in model.outputs}
    return TrajectoryCost(
        Study(
            name="delays",
            model=model,
            parameters=parameters,
            trials=Trials([trial(noise)]),
            noise=sizes,
            cost=TrajectoryOptions(initial="free"),
        )
    )


@pytest.mark.parametrize("effect", ["speed_delay", "rate_delay", "heading_delay", "position_delay"])
def test_derivatives_by_the_start_take_what_follows_along(effect: str) -> None:
    cost = cost_with(effect, 0.6)
    x, h = cost.start, 1e-5
    jacobian = cost.jacobian(x)
    for k, name in enumerate(cost.names):
        step = np.zeros(len(x))
        step[k] = h
        numeric = (cost.residuals(x + step) - cost.residuals(x - step)) / (2 * h)
        assert jacobian[:, k] == pytest.approx(numeric, rel=1e-4, abs=1e-4 * max(1.0, np.abs(numeric).max())), name


@pytest.mark.parametrize(
    ("effect", "channel"),
    [
        ("speed_delay", "u"),
        ("speed_delay", "v"),
        ("rate_delay", "r"),
        ("heading_delay", "psi"),
        ("position_delay", "x"),
    ],
)
def test_a_start_that_moves_moves_what_is_recorded_at_once(effect: str, channel: str) -> None:
    cost = cost_with(effect, 0.6)
    k = list(cost.names).index(f"steps: {channel}")
    moved = cost.start.copy()
    moved[k] += 0.01
    row = next(group.rows[0] for group in cost.residual_blocks if group.channel == channel)
    change = cost.residuals(cost.start)[row] - cost.residuals(moved)[row]
    assert abs(change) == pytest.approx(0.01, rel=1e-6)


def _simulated(cost: TrajectoryCost) -> np.ndarray:
    """Outputs (n, D) from the cost's own start: what was recorded less the residuals."""
    (one,) = cost.trials
    residuals = cost.residuals(cost.start)
    names = [channel.name for channel in cost.problem.model.outputs]
    found = np.empty((len(one), len(names)))
    for group in cost.residual_blocks:
        if group.kind == "data":
            k = names.index(group.channel)
            found[group.sample, k] = np.asarray(one.outputs[group.channel])[group.sample] - residuals[group.rows]
    return found


@pytest.mark.parametrize("tau", [-0.8, 0.2, 0.8])
def test_a_position_that_is_late_is_where_it_was(tau: float) -> None:
    late, now = (_simulated(cost_with("position_delay", value, noise=0.0)) for value in (tau, 0.0))
    t = STEP * np.arange(LENGTH)
    inside = (t > 4.0) & (t < 55.0)
    for k in (0, 1):
        wanted = np.interp(t - tau, t, now[:, k])
        assert late[inside, k] == pytest.approx(wanted[inside], abs=0.02)


def test_a_prediction_may_start_far_from_what_a_wrong_sensor_shows() -> None:
    """A steady run with a compass that is wrong by far more than the heading changes."""
    wrong = 0.25
    cost = cost_with("heading_bias", wrong, noise=1e-4)
    cost = TrajectoryCost(cost.problem.replace(noise=dict.fromkeys(cost.problem.noise, 1e-4)))
    (recorded,) = cost.trials
    straight = {**recorded.inputs, "delta": np.zeros(LENGTH)}
    calm = Trial("straight", recorded.t, straight, dict(recorded.outputs), synthetic=True)
    true = cost_with("heading_bias", 0.0, noise=1e-4).predict(np.array([0.0, *cost.start[1:]]), [calm])[0]
    names = [channel.name for channel in cost.problem.model.outputs]
    shown = {name: true[:, k] + (wrong if name == "psi" else 0.0) for k, name in enumerate(names)}
    run = Trial("straight", recorded.t, straight, shown, synthetic=True)
    found = cost.predict(cost.start, [run])[0]
    for k, name in enumerate(names):
        assert found[:, k] == pytest.approx(shown[name], abs=1e-3), name
