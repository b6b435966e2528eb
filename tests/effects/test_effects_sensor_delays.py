"""Sensors that are late, from the first sample of a trial on."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth.effects import available, load_effects, with_effects
from seatruth.models import Channel, Model, Observation, load_model, observed
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial


@pytest.mark.parametrize("shown", [(), ("v_n", "v_e"), ("sog", "cog"), ("u_w",), ("u_w", "v_w"), ("x", "y")])
def test_a_late_position_is_late_from_the_first_sample_on(shown: tuple[str, ...]) -> None:
    """Whatever shows the speed there. A trial that began with a jump would ask for half of the delay."""
    model = observed(load_model("mmg"), [Observation(name) for name in shown])
    extended = with_effects(model, [available()["position_delay"]])
    t = np.arange(0.0, 5.0, 0.1)
    inputs = {"delta": np.zeros(t.size), "n": np.full(t.size, 12.0)}
    moving = {"u": 1.2, "v": 0.0, "r": 0.0, "psi": 0.5, "x": 3.0, "y": -2.0, "sog": 1.2, "cog": 0.5}
    moving |= {"v_n": 1.2 * math.cos(0.5), "v_e": 1.2 * math.sin(0.5), "u_w": 1.2, "v_w": 0.0}
    names = [channel.name for channel in extended.outputs]
    recorded = {name: np.full(t.size, moving[name]) for name in names}
    if shown == ("x", "y"):  # no speed at all: that of the first positions
        way = {"x": moving["v_n"] * t, "y": moving["v_e"] * t}
        recorded = {"psi": recorded["psi"], **{name: recorded[name] + way[name] for name in shown}}
    run = Trial("run", t, inputs, recorded)
    sim = simulator(extended, [run], free=("position_delay_tau",), values=extended.nominal())
    now, late = sim.outputs(np.array([[0.0], [0.4]]), sim.initial_states).y[:, 0]
    for position, velocity in (("x", "v_n"), ("y", "v_e")):
        k = names.index(position)
        assert now[k] - late[k] == pytest.approx(0.4 * moving[velocity], rel=1e-3)


@pytest.mark.parametrize(("tau", "turns", "near"), [(0.4, 0.1, 5e-5), (1.2, 0.1, 1e-4), (1.2, 0.7, 5e-4)])
def test_a_late_receiver_shows_all_it_gives_late(tau: float, turns: float, near: float) -> None:
    """Position and velocity over ground of the past, once the filters have forgotten the start."""
    model = observed(load_model("mmg"), [Observation("v_n"), Observation("v_e")])
    extended = with_effects(model, [available()["receiver_delay"]])
    t = np.arange(0.0, 60.0, 0.1)
    inputs = {"delta": 0.3 * np.sin(turns * t), "n": np.full(t.size, 12.0)}
    first = {"u": 1.2, "v": -0.1, "r": 0.05, "psi": 0.5, "x": 0.0, "y": 0.0}
    first |= {"v_n": 1.2 * math.cos(0.5) + 0.1 * math.sin(0.5), "v_e": 1.2 * math.sin(0.5) - 0.1 * math.cos(0.5)}
    run = Trial("run", t, inputs, {name: np.full(t.size, value) for name, value in first.items()})
    sim = simulator(extended, [run], free=("receiver_delay_tau",), values=extended.nominal())
    now, late = sim.outputs(np.array([[0.0], [tau]]), sim.initial_states).y
    ago = round(tau / 0.1)
    for k, channel in enumerate(extended.outputs):
        shown, then = late[ago:, k], now[:-ago, k]
        if channel.name not in ("x", "y", "v_n", "v_e"):
            assert (late[:, k] == now[:, k]).all()
            continue
        assert np.abs(now[ago:, k] - then).max() > 0.01
        assert shown[50:] == pytest.approx(then[50:], abs=near)
        # How fast the velocity turns at the start is no part of the filters' first state.
        assert late[0, k] == pytest.approx(now[0, k] - tau * (now[1, k] - now[0, k]) / 0.1, abs=0.05 * tau)
    bare = load_model("mmg")
    assert available()["receiver_delay"].missing(bare) == "the model has no output 'v_n'"


@pytest.mark.parametrize(("effect", "tau"), [("depth_lag", 0.4), ("depth_lag", 4.0), ("depth_delay", 0.6)])
def test_a_depth_sensor_is_late_already_where_a_trial_begins_under_way(effect: str, tau: float) -> None:
    """Of a glider that sinks at 0.3 m/s throughout, the depth is tau times that behind from the first sample on."""

    class Sinking(Model):
        name = "sinking"
        kind = "glider"
        states = outputs = (Channel("u", "m/s"), Channel("theta", "rad"), Channel("z", "m"))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return 0.0 * s.u, 0.0 * s.theta, -s.u * math.sin(s.theta)

    u, theta = 0.6, -math.radians(30.0)
    model = with_effects(Sinking(), load_effects([effect]))
    t = np.arange(0.0, 30.0, 0.5)
    known = {"u": np.full_like(t, u), "theta": np.full_like(t, theta), "z": 5.0 + 0.3 * t}
    trial = Trial("dive", t, {}, known, synthetic=True)
    sim = simulator(model, [trial], values={**model.nominal(), f"{effect}_tau": tau})
    z = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0][:, 2]
    assert z == pytest.approx(5.0 + 0.3 * t - 0.3 * tau, abs=1e-4)


class _Slowing(Model):
    """It slows down and turns ever faster, as it did before the trial; a velocity over ground changes alike."""

    name = "slowing"
    states = outputs = tuple(
        Channel(name, unit)
        for name, unit in (
            ("u", "m/s"),
            ("v", "m/s"),
            ("r", "rad/s"),
            ("v_n", "m/s"),
            ("v_e", "m/s"),
            ("x", "m"),
            ("y", "m"),
        )
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return -0.5 + 0.0 * s.u, 0.1, 0.2, -0.4, 0.3, s.v_n, s.v_e


@pytest.mark.parametrize("tau", [0.05, 0.363, 1.5])
@pytest.mark.parametrize("effect", ["speed_delay", "rate_delay", "receiver_delay"])
def test_a_sensor_shows_the_motion_before_the_trial_at_its_start(effect: str, tau: float) -> None:
    """Of a torpedo that slowed down by 0.5 m/s2 when its trials began, a log 0.36 s late was estimated as 0.15 s."""
    t = np.arange(0.0, 8.0, 0.1)

    def past(at: Any) -> dict[str, Any]:
        speeds = {"u": 2.0 - 0.5 * at, "v": 0.1 * at, "r": 0.2 * at, "v_n": 1.0 - 0.4 * at, "v_e": 0.3 * at}
        return speeds | {"x": at - 0.2 * at**2, "y": 0.15 * at**2}

    late = {name for place in available()[effect].acts_on for name in [place.removeprefix("sensor:")]}
    recorded = {name: values for name, values in past(t - tau).items() if name in late}
    recorded |= {name: values for name, values in past(t).items() if name not in late}
    model = with_effects(_Slowing(), load_effects([effect]))
    trial = Trial("run", t, {}, recorded, synthetic=True)
    engine = simulator(model, [trial], values={**model.nominal(), f"{effect}_tau": tau})
    first = engine.initial_states.copy()
    names = [channel.name for channel in model.states]
    # A fit finds the state at the start; a late sensor shows an earlier one. What follows a state moves with it.
    for name, value in past(0.0).items():
        moved = value - first[0, names.index(name)]
        first[0, names.index(name)] += moved
        for follower, (leader, sign) in model.follows.items():
            if leader == name:
                first[0, names.index(follower)] += sign * moved
        if effect == "receiver_delay" and f"{effect}_{name}_0" in names:
            first[0, names.index(f"{effect}_{name}_0")] += moved
    shown = engine.outputs(np.zeros((1, 0)), first).y[0]
    for k, channel in enumerate(model.outputs):
        assert shown[:, k] == pytest.approx(recorded[channel.name], abs=2e-6), channel.name
