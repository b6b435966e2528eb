"""What steers a vehicle: turns, zigzags, spirals and stops of a boat that thrusters steer, and how they are read."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    AxisSteps,
    CoastDown,
    CrashStop,
    Manoeuvre,
    SpeedSteps,
    Spiral,
    TurningCircle,
    Zigzag,
    run_manoeuvre,
    self_propulsion,
    spiral_figures,
    steered,
    stopping_figures,
    thruster_layout,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.manoeuvres.recognise import recognise
from seatruth.manoeuvres.steady import steady
from seatruth.manoeuvres.steering import RudderSteering, ThrustSteering, steering_in, steering_of
from seatruth.models import load_model
from seatruth.trials import Trial

deg = math.radians
BOAT, ROV = load_model("twin_thruster"), load_model("bluerov2")
SPEED = 1.2
N = self_propulsion(BOAT, SPEED)
AHEAD = {"n_port": N, "n_starboard": N}


def sail(plan: Manoeuvre, values: dict[str, float] | None = None, limit: float = 300.0) -> Trial:
    return run_manoeuvre(BOAT, plan, values, first_state={"u": SPEED}, inputs=AHEAD, limit=limit)


def kinds(trial: Trial) -> list[str]:
    return [stretch.label for stretch in recognise(trial, model=BOAT) if stretch.kind != "straight run"]


def test_what_steers_a_model_and_a_log() -> None:
    assert isinstance(steering_of(load_model("mmg")), RudderSteering)
    assert isinstance(steering_of(BOAT), ThrustSteering)
    assert isinstance(steering_of(ROV), ThrustSteering)
    assert steering_of(load_model("diving_plane_driven")) is None
    run = sail(TurningCircle(0.2, deg(60), by="thrust"))
    assert isinstance(steering_in(run), ThrustSteering)
    assert isinstance(steering_in(replace(run, inputs={})), RudderSteering)


def test_the_straight_approach_keeps_its_speed() -> None:
    run = sail(TurningCircle(0.2, deg(60), approach=20.0, by="thrust"))
    assert run.outputs["u"][:200] == pytest.approx(SPEED, abs=1e-9)
    assert pytest.approx(math.sqrt(77.55 * SPEED / 2 / BOAT.nominal()["k_ahead"])) == N
    with pytest.raises(BadInput, match="no propeller speed keeps 9 m/s"):
        self_propulsion(BOAT, 9.0)


def test_steering_comes_on_top_of_the_thrust_ahead_and_is_read_back() -> None:
    run = steered(sail(TurningCircle(0.2, deg(60), by="thrust")), BOAT)
    port, starboard = (run.inputs[name] * np.abs(run.inputs[name]) / 16.54**2 for name in AHEAD)
    assert run.inputs["thrust_difference"] == pytest.approx(0.5 * (port - starboard))
    assert run.inputs["thrust_difference"][[50, 150]] == pytest.approx([0.0, 0.2], abs=1e-12)
    assert run.inputs["n"] == pytest.approx(N)
    assert steered(run, BOAT) is run
    rudder = run_manoeuvre(load_model("mmg"), TurningCircle(0.3, 0.5), first_state={"u": 1.18}, inputs={"n": 11.85})
    assert steered(rudder, load_model("mmg")) is rudder
    with pytest.raises(BadInput, match="needs the thruster's input 'n_starboard'"):
        steered(replace(run, inputs={"n_port": run.inputs["n_port"]}), BOAT)


def test_orders_beyond_full_power_are_reduced_alike_and_come_back() -> None:
    run = sail(Zigzag(0.9, deg(20), executes=2, by="thrust"))
    assert max(np.abs(run.inputs[name]).max() for name in AHEAD) == pytest.approx(16.54)
    assert run.inputs["n_port"][:100] == pytest.approx(N)
    # The thrust ahead is that of the approach again after a reversal, less the part by which both sides are reduced.
    share = (N / 16.54) ** 2
    assert steered(run, BOAT).inputs["n"][-1] == pytest.approx(16.54 * math.sqrt(share / (share + 0.9)))


@pytest.mark.parametrize("level", [0.1, 0.25])
def test_a_turn_to_port_mirrors_one_to_starboard(level: float) -> None:
    one, other = (sail(TurningCircle(side * level, by="thrust")) for side in (1.0, -1.0))
    for name in ("y", "psi", "v", "r"):
        assert other.outputs[name] == pytest.approx(-one.outputs[name], abs=1e-9), name
    right, left = (turning_circle_figures(steered(run, BOAT)) for run in (one, other))
    assert left.rudder == pytest.approx(-level)
    assert left.rate == pytest.approx(-right.rate)
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter", "time_90", "speed_ratio"):
        assert getattr(left, name) == pytest.approx(getattr(right, name)), name
    assert right.advance > right.transfer > 0
    assert right.why == {}


@pytest.mark.parametrize("level", [0.1, 0.3])
def test_the_rate_of_the_steady_turn_is_that_of_the_balance_of_moments(level: float) -> None:
    # Without cross-flow drag, with G midships, thrust and the yaw damping balance alone.
    values = {"C_d": 0.0, "x_G": 0.0, "Y_v": -300.0}
    run = sail(TurningCircle(level, by="thrust"), values)
    p = BOAT.nominal()
    moment = 2.0 * level * p["y_T"] * p["k_ahead"] * 16.54**2
    rate = (math.sqrt(p["N_r"] ** 2 - 4.0 * p["N_rr"] * moment) + p["N_r"]) / (-2.0 * p["N_rr"])
    assert turning_circle_figures(steered(run, BOAT)).rate == pytest.approx(rate, rel=1e-4)


def test_a_zigzag_is_reversed_and_overshoots() -> None:
    one, other = (sail(Zigzag(0.1, deg(20), first, by="thrust")) for first in ("starboard", "port"))
    found = zigzag_figures(steered(one, BOAT))
    assert (found.rudder, found.first, len(found.executes)) == (pytest.approx(0.1), "starboard", 5)
    assert found.switch_angles == pytest.approx([deg(20)] * 4, abs=deg(0.5))
    assert all(deg(0.2) < overshoot < deg(5) for overshoot in found.overshoots)
    assert found.period > found.reach > found.initial_turning_time > 2.0
    mirrored = zigzag_figures(steered(other, BOAT))
    assert mirrored.first == "port"
    assert mirrored.overshoots == pytest.approx(found.overshoots)
    lazy = zigzag_figures(steered(run_manoeuvre(
        BOAT, Zigzag(0.1, deg(20), by="thrust"), {"N_dr": -80.0}, first_state={"u": SPEED}, inputs=AHEAD
    ), BOAT))  # fmt: skip
    assert lazy.first_overshoot > 1.5 * found.first_overshoot  # more inertia in yaw


def test_a_stop_and_other_orders_of_the_propeller() -> None:
    stop = sail(CrashStop(-8.0))
    found = stopping_figures(steered(stop, BOAT))
    mass = BOAT.nominal()["m"] + 5.5
    assert stop.inputs["n_starboard"][-1] == pytest.approx(-8.0)
    assert 0 < found.track_reach < SPEED * found.stopping_time
    drag = 77.55
    force = 2 * BOAT.nominal()["k_astern"] * 64.0
    # m du/dt = -force - drag u; the reversal takes one step of 0.1 s, in which thrust passes through zero.
    assert found.stopping_time == pytest.approx(mass / drag * math.log(1 + drag * SPEED / force), abs=0.11)
    assert found.lateral_deviation == found.heading_change == 0.0
    assert kinds(stop) == ["crash stop"]
    coast = sail(CoastDown(20.0))
    assert coast.outputs["u"][-1] == pytest.approx(SPEED * math.exp(-20.0 * drag / mass), abs=0.01)
    assert sail(SpeedSteps((5.0, 9.0), 2.0)).inputs["n_port"][[10, 30]] == pytest.approx([5.0, 9.0])
    with pytest.raises(BadInput, match="beyond full power"):
        sail(CrashStop(-20.0))


def test_a_spiral_of_a_boat_that_is_stable() -> None:
    down = (0.15, 0.1, 0.05, 0.0, -0.05, -0.1, -0.15)
    run = sail(Spiral((*down, *down[-2::-1]), 20.0, by="thrust"))
    found = spiral_figures(steered(run, BOAT))
    assert [level for level, _ in found.points] == pytest.approx([*down, *down[-2::-1]], abs=1e-9)
    rates = [rate for _, rate in found.points]
    assert rates[:7] == sorted(rates[:7], reverse=True)
    assert abs(found.loop_width) < 0.1 * found.step
    assert found.step == pytest.approx(0.05)
    share = (N / 16.54) ** 2
    steps = AxisSteps(thruster_layout(BOAT), "yaw", (*down, *down[-2::-1]), 20.0, ahead=share)
    assert sail(steps).outputs["psi"] == pytest.approx(run.outputs["psi"], abs=1e-9)


def test_manoeuvres_of_a_long_recording_are_recognised() -> None:
    plans = (TurningCircle(-0.2, by="thrust"), Zigzag(0.1, deg(20), by="thrust"), CrashStop(-8.0, approach=30.0))
    parts = [sail(plan) for plan in plans]
    joined = {name: np.concatenate([part.channel(name) for part in parts]) for name in ("u", "v", "r", *AHEAD)}
    turned = np.cumsum([0.0, *(part.outputs["psi"][-1] for part in parts[:-1])])
    joined["psi"] = np.concatenate([start + part.outputs["psi"] for start, part in zip(turned, parts, strict=True)])
    rng = np.random.default_rng(0)
    for name, sd in (("u", 0.02), ("psi", deg(0.3)), ("n_port", 0.05), ("n_starboard", 0.05)):
        joined[name] = joined[name] + sd * rng.standard_normal(joined[name].size)
    inputs, outputs = {name: joined.pop(name) for name in AHEAD}, joined
    log = Trial("log", t=0.1 * np.arange(outputs["psi"].size), inputs=inputs, outputs=outputs)
    found = [stretch for stretch in recognise(log, model=BOAT) if stretch.kind != "straight run"]
    assert [stretch.label for stretch in found] == [
        "turning circle 20 % port", "zigzag 10 %/20 starboard first", "crash stop"
    ]  # fmt: skip
    assert found[0].facts.startswith("thrust difference -20.")
    # Without the model full power is the most that the log holds: the same manoeuvres, other shares.
    assert [one.kind for one in recognise(log) if one.kind != "straight run"] == ["turning circle", "zigzag", "stop"]
    assert steady(log)
    track = replace(log, inputs={"n_port": log.inputs["n_port"]})
    assert {one.kind for one in recognise(track, model=BOAT)} == {"stop"}  # which the speed shows alone


def test_what_steers_must_fit_the_vehicle() -> None:
    with pytest.raises(BadInput, match=r"orders 'delta'.*thrusters steer it"):
        sail(TurningCircle(deg(20)))
    with pytest.raises(BadInput, match=r"orders 'yaw'.*A rudder steers it"):
        run_manoeuvre(load_model("mmg"), TurningCircle(0.2, by="thrust"), first_state={"u": 1.18})
    with pytest.raises(BadInput, match="beyond 1"):
        TurningCircle(20.0, by="thrust")
    with pytest.raises(BadInput, match="nothing steers by 'sail'"):
        Spiral((0.1,), 5.0, by="sail")
    with pytest.raises(BadInput, match="needs the input 'delta'"):
        turning_circle_figures(replace(sail(CoastDown(5.0)), inputs={}))


def test_a_vehicle_with_six_thrusters_turns_too() -> None:
    voltage = {"voltage": 16.0}
    n = self_propulsion(ROV, 0.4, inputs=voltage)
    steering = steering_of(ROV)
    assert isinstance(steering, ThrustSteering)
    ahead = {**voltage, **steering.driven(n)}
    plan = TurningCircle(0.05, deg(400), approach=5.0, by="thrust")
    run = run_manoeuvre(ROV, plan, first_state={"u": 0.4}, inputs=ahead, limit=200.0)
    found = turning_circle_figures(steered(run, ROV))
    assert found.rudder == pytest.approx(0.05)
    assert found.tactical_diameter > 0
    assert [one.label for one in recognise(run, model=ROV)] == ["turning circle 5 % starboard"]
