"""The velocity with which a trial starts that has positions and heading alone."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.models import load_model
from seatruth.simulate.first_velocity import first_velocity
from seatruth.simulate.setup import set_up
from seatruth.trials.trial import Trial

MODEL = load_model("mmg")
T = np.arange(0.0, 100.0, 0.2)


def run(speed: float, drift: float, heading: float, rate: float = 0.0, noise: float = 0.0) -> Trial:
    """Steady motion through a circle, or along a straight line."""
    psi = heading + rate * T
    north = speed * np.cos(psi) - drift * np.sin(psi)
    east = speed * np.sin(psi) + drift * np.cos(psi)
    rng = np.random.default_rng(1)

    def covered(v: Array) -> Array:
        return np.concatenate([[0.0], np.cumsum(0.1 * (v[1:] + v[:-1]))]) + rng.normal(0.0, noise, T.size)

    inputs = {channel.name: np.zeros_like(T) for channel in MODEL.inputs}
    return Trial("run", T, inputs, {"x": covered(north), "y": covered(east), "psi": psi})


@pytest.mark.parametrize("heading", [0.0, 2.0, -3.1])
@pytest.mark.parametrize("rate", [0.0, 0.03, 0.2])
def test_the_speed_is_that_of_the_way_whatever_the_course(heading: float, rate: float) -> None:
    found = first_velocity(MODEL, run(5.0, -0.4, heading, rate))
    assert found["u"] == pytest.approx(5.0, abs=0.05)
    assert found["v"] == pytest.approx(-0.4, abs=0.05)


def test_noise_of_positions_is_averaged() -> None:
    found = first_velocity(MODEL, run(5.0, 0.0, 1.0, noise=0.5))
    assert found["u"] == pytest.approx(5.0, abs=0.1)


@pytest.mark.parametrize("noise", [0.0, 0.005])
def test_a_vehicle_that_starts_from_rest_does(noise: float) -> None:
    still = run(0.0, 0.0, 1.0, noise=noise)
    way = 0.1 * T**2  # 0.2 m/s2
    shown = {"x": still.outputs["x"] + way * np.cos(1.0), "y": still.outputs["y"] + way * np.sin(1.0)}
    found = first_velocity(MODEL, Trial("run", T, still.inputs, {**still.outputs, **shown}))
    assert found["u"] == pytest.approx(0.0, abs=0.02)


def test_a_speed_that_is_recorded_is_taken_instead() -> None:
    trial = run(5.0, 0.0, 1.0)
    known = Trial("run", T, trial.inputs, {**trial.outputs, "u": np.full_like(T, 4.0)})
    assert first_velocity(MODEL, known) == {}
    empty = Trial("run", T, trial.inputs, {**trial.outputs, "u": np.full_like(T, np.nan)})
    assert first_velocity(MODEL, empty)["u"] == pytest.approx(5.0)


def test_nothing_is_said_without_heading_or_positions() -> None:
    trial = run(5.0, 0.0, 1.0)
    for lost in ("x", "y", "psi"):
        rest = {name: values for name, values in trial.outputs.items() if name != lost}
        assert first_velocity(MODEL, Trial("run", T, trial.inputs, rest)) == {}
    few = np.full_like(T, np.nan)
    few[:4] = trial.outputs["x"][:4]
    assert first_velocity(MODEL, Trial("run", T, trial.inputs, {**trial.outputs, "x": few})) == {}


def test_a_simulation_starts_with_it() -> None:
    setup = set_up(MODEL, [run(5.0, -0.4, 1.0)], (), MODEL.nominal())
    state = dict(zip([channel.name for channel in MODEL.states], setup.initial_states[0], strict=True))
    assert state["u"] == pytest.approx(5.0)
    assert ("run", "u") not in setup.assumed_zero
    assert ("run", "r") in setup.assumed_zero
