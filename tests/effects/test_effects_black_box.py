"""Effects around black boxes, and what each effect on inputs and outputs does to them, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from known_trials import ship_trials
from numpy.typing import NDArray

from seatruth.effects import ExtendedBlackBox, available, with_effects
from seatruth.models import load_model
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.simulate import simulator
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

Array = NDArray[np.float64]
T: Array = np.arange(0.0, 60.0, 0.1)


def echo() -> BlackBox:
    """A black box whose output is its rudder angle, called psi, and its rate."""
    delta, psi, r = Channel("delta", "rad"), Channel("psi", "rad"), Channel("r", "rad/s")

    def run(trial: Trial, parameters: dict[str, float], first: dict[str, float] | None) -> dict[str, Array]:
        angle = np.asarray(trial.inputs["delta"])
        return {"psi": parameters["k"] * angle, "r": np.gradient(angle, trial.t)}

    return BlackBox("echo", run, inputs=[delta], outputs=[psi, r], parameters=[Parameter("k", 1.0)])


def heard(effect: str, delta: Array, **values: float) -> Array:
    """psi of the echo (n,) with one effect around it."""
    model = with_effects(echo(), [available()[effect]])
    given = {f"{effect}_{name}": value for name, value in values.items()}
    sim = simulator(model, [Trial("t", T, {"delta": delta}, {}, synthetic=True)], values={**model.nominal(), **given})
    return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0, :, 0])


WAVE = 0.3 * np.sin(0.4 * T)
STEP = np.where(T > 10.0, 0.3, 0.0)


def test_gains_offsets_and_bands() -> None:
    assert heard("rudder_offset", WAVE, angle=0.05) == pytest.approx(WAVE + 0.05)
    assert heard("rudder_gain", WAVE, k=0.8) == pytest.approx(0.8 * WAVE)
    assert heard("heading_bias", WAVE, b=0.02) == pytest.approx(WAVE + 0.02)
    assert heard("compass_deviation", WAVE, A=0.1, B=0.2) == pytest.approx(
        WAVE + 0.1 * np.sin(WAVE) + 0.2 * np.cos(WAVE)
    )
    within = np.clip(WAVE, -0.1, 0.1)
    assert heard("rudder_dead_band", WAVE, band=0.1) == pytest.approx(WAVE - within, abs=1e-12)


def test_a_long_lag_is_the_exact_one() -> None:
    tau, w = 4.0, 0.4
    exact = (np.sin(w * T) - w * tau * np.cos(w * T) + w * tau * np.exp(-T / tau)) / (1 + (w * tau) ** 2)
    assert heard("rudder_lag", np.sin(w * T), tau=tau) == pytest.approx(exact, abs=0.02)


@pytest.mark.parametrize("tau", [0.1, 0.3, 0.6])
def test_short_lags_and_delays_are_right_to_second_order(tau: float) -> None:
    w = 0.3
    late = T > 8.0
    lagged = (np.sin(w * T) - w * tau * np.cos(w * T)) / (1 + (w * tau) ** 2)
    slow = heard("rudder_lag", np.sin(w * T), tau=tau)
    assert slow[late] == pytest.approx(lagged[late], abs=0.12 * w * tau)
    for effect in ("rudder_delay", "heading_delay"):
        found = heard(effect, np.sin(w * T), tau=tau)
        assert found[late] == pytest.approx(np.sin(w * (T - tau))[late], abs=0.12 * w * tau)


def test_a_rate_limit_holds_and_a_slow_order_passes() -> None:
    limited = heard("rudder_rate_limit", STEP, slowness=20.0)
    ramp = np.clip((T - 10.0) / 20.0, 0.0, 0.3)
    assert np.abs(limited - ramp).max() < 0.03
    gentle = 0.04 * np.sin(0.5 * T)
    assert heard("rudder_rate_limit", gentle, slowness=20.0) == pytest.approx(gentle, abs=1e-12)


def test_backlash_is_late_by_its_slack() -> None:
    slow = 0.3 * np.sin(0.05 * T)  # up, and down after 31 s
    found = heard("rudder_backlash", slow, slack=0.05)
    assert found[T > 20][0] == pytest.approx(slow[T > 20][0] - 0.05, abs=1e-3)
    assert found[-1] == pytest.approx(slow[-1] + 0.05, abs=1e-3)


def test_a_black_box_has_them_as_the_equations_do() -> None:
    ship = load_model("mmg")
    runs, firsts = ship_trials(60.0)
    runs, firsts = runs[:2], firsts[:2]
    inner = {run.name: simulator(ship, [run]) for run in runs}

    def sail(trial: Trial, parameters: dict[str, float], first: dict[str, float] | None) -> dict[str, Array]:
        assert first is not None
        sim = simulator(ship, [trial])
        start = np.array([[first[channel.name] for channel in ship.states]])
        found = sim.outputs(np.zeros((1, 0)), start).y[0]
        return {channel.name: found[:, k] for k, channel in enumerate(ship.outputs)}

    box = BlackBox("box", sail, inputs=ship.inputs, outputs=ship.outputs, parameters=(), states=ship.states)
    values = {
        **{"rudder_offset_angle": 0.02, "rudder_gain_k": 0.9, "rudder_lag_tau": 1.0, "heading_delay_tau": 0.5},
        **{"position_delay_tau": 0.4, "position_lever_arm_forward": 1.0, "speed_scale_k": 0.05},
    }
    effects = [
        *("rudder_offset", "rudder_gain", "rudder_lag", "heading_delay", "position_delay"),
        *("position_lever_arm", "speed_scale"),
    ]
    chosen = [available()[name] for name in effects]
    around = with_effects(box, chosen)
    inside = with_effects(ship, chosen)
    assert isinstance(around, ExtendedBlackBox)
    given = [{channel.name: first.get(channel.name, 0.0) for channel in ship.states} for first in firsts]
    start = np.array([[first[channel.name] for channel in ship.states] for first in given])
    outer = simulator(around, runs, values={**around.nominal(), **values})
    found = outer.outputs(np.zeros((1, 0)), start).y[0]
    both = {**inside.nominal(), **values}
    full = np.array(
        [
            inside.first_state(
                {channel.name: first[channel.name] for channel in ship.outputs},
                {channel.name: float(run.inputs[channel.name][0]) for channel in ship.inputs},
                both,
            )
            for first, run in zip(given, runs)
        ]
    )
    expected = simulator(inside, runs, values=both).outputs(np.zeros((1, 0)), full).y[0]
    nothing = np.concatenate([inner[run.name].outputs(np.zeros((1, 0)), s[None]).y[0] for run, s in zip(runs, start)])
    change = np.abs(expected - nothing).max(axis=0)
    assert (np.abs(found - expected).max(axis=0) < 0.04 * change).all()
    plain = simulator(around, runs).outputs(np.zeros((1, 0)), start).y[0]
    assert plain == pytest.approx(nothing, abs=1e-12)


def test_a_slow_log_takes_several_steps_a_sample() -> None:
    t = np.arange(0.0, 300.0, 5.0)
    delta = np.sin(0.02 * t)
    model = with_effects(echo(), [available()["rudder_lag"]])
    trial = Trial("slow", t, {"delta": delta}, {}, synthetic=True)
    sim = simulator(model, [trial], values={**model.nominal(), "rudder_lag_tau": 2.0})
    found = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0, :, 0]
    assert found[10:] == pytest.approx(np.sin(0.02 * (t - 2.0))[10:], abs=0.01)


def test_only_those_from_outside_can() -> None:
    found = available()
    outside = {name for name, effect in found.items() if effect.suits_black_box}
    assert {"rudder_lag", "heading_delay", "compass_deviation", "depth_lag", "plane_backlash"} <= outside
    assert not {"current", "wind", "added_mass", "sloshing", "quantisation"} & outside
    assert "black box" in found["wind"].missing(echo())
    assert not found["rudder_lag"].missing(echo())


def test_a_run_that_diverged_stays_so() -> None:
    def run(trial: Trial, parameters: dict[str, float], first: dict[str, float] | None) -> dict[str, Array]:
        return {"psi": np.full(len(trial), math.inf)}

    box = BlackBox("bad", run, inputs=[], outputs=[Channel("psi", "rad")], parameters=[])
    model = with_effects(box, [available()["heading_delay"]])
    sim = simulator(model, [Trial("t", T, {}, {}, synthetic=True)], values={"heading_delay_tau": 0.5})
    assert sim.outputs(np.zeros((1, 0)), sim.initial_states).diverged.all()
