"""The menu from which the next trial is put together."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.experiment_design.candidates import SLOW_START, Menu
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.models import Model, Observation, Parameter, Thruster, load_model, observed
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def problem(ship_folder: Path, offset_runs: list[Trial]) -> Problem:
    return small.problem(ship_folder, offset_runs)


def test_the_menu_stays_within_what_the_trials_did(problem: Problem) -> None:
    menu = Menu(problem)
    longest = max(t.duration for t in problem.trials)
    values = np.concatenate([np.asarray(t.inputs["delta"]) for t in problem.trials])
    for name in menu.phases:
        option = menu.trial([name])
        delta = np.asarray(option.trial.inputs["delta"])
        assert np.abs(delta - np.median(values)).max() <= np.abs(values - np.median(values)).max() + 1e-12
        assert option.trial.duration == pytest.approx(longest, abs=1.0)
        assert "s in all" in option.text
    assert {"turn by +delta", "turn by -delta", "zigzag of delta", "staircase of delta"} < set(menu.phases)
    assert "reciprocal course: " in menu.starts()


def test_manoeuvres_follow_one_another_and_the_name_says_which(problem: Problem) -> None:
    menu = Menu(problem)
    names = ["turn by +delta", "straight run", "zigzag of delta"]
    whole = menu.trial(names, "reciprocal course: ")
    single = len(menu.t)
    # The rudder needs its time from where the last one ended.
    there = math.ceil(2.0 * menu.full["delta"] / (menu.rates["delta"] * menu.step))
    assert there < single / 4
    for k, name in enumerate(names):
        part = menu.trial([name]).trial
        orders = whole.trial.inputs["delta"][k * single : (k + 1) * single]
        assert orders[there:] == pytest.approx(part.inputs["delta"][there:-1])
    again = menu.named(whole.name)
    assert again.name == whole.name
    assert np.array_equal(again.trial.inputs["delta"], whole.trial.inputs["delta"])
    turned = whole.trial.outputs["psi"][0] - menu.trial(names).trial.outputs["psi"][0]
    assert turned == pytest.approx(np.pi)
    with pytest.raises(KeyError):
        menu.named("a manoeuvre of no menu")


def test_no_input_moves_faster_than_on_record(problem: Problem) -> None:
    menu = Menu(problem)
    fastest = max(float(np.abs(np.diff(t.inputs["delta"]) / np.diff(t.t)).max()) for t in problem.trials)
    zigzag = menu.trial(["zigzag of delta"]).trial
    rates = np.abs(np.diff(zigzag.inputs["delta"])) / menu.step
    assert rates.max() <= fastest * (1.0 + 1e-9)
    assert zigzag.inputs["delta"].max() == pytest.approx(menu.usual["delta"] + menu.full["delta"])
    menu.rates["delta"] = menu.full["delta"] / menu.seconds * 16.0
    slow = menu.trial(["zigzag of delta"]).trial.inputs["delta"]
    assert np.abs(np.diff(slow)).max() == pytest.approx(menu.step * menu.rates["delta"])
    assert slow[0] == pytest.approx(menu.usual["delta"] + menu.step * menu.rates["delta"])


def test_a_channel_counts_at_the_samples_at_which_it_is_recorded(ship_folder: Path, plain_runs: list[Trial]) -> None:
    keep = np.arange(len(plain_runs[0])) % 3 == 0
    sparse = [
        dataclasses.replace(t, outputs={**t.outputs, "psi": np.where(keep, t.outputs["psi"], math.nan)})
        for t in plain_runs
    ]
    option = Menu(small.problem(ship_folder, sparse)).trial(["straight run"]).trial
    assert np.isfinite(option.outputs["psi"]).sum() == pytest.approx(len(option) / 3, abs=1.0)
    assert np.isfinite(option.outputs["r"]).all()


def catamaran(port: np.ndarray, starboard: np.ndarray) -> Menu:
    model = boat.Catamaran()
    runs = boat.trials(model, [{"port": port, "starboard": starboard}], headings=(0.0,))
    return Menu(Problem(boat.study(model, runs), load_effects(["gyro_bias"]), Settings(), threads=1))


def test_actuators_of_one_kind_move_together() -> None:
    delta = boat.zigzag(60, 0.2, 9.0)
    menu = catamaran(delta, 0.95 * delta)
    assert menu.steering == [("port", "starboard")]
    moved = menu.trial(["turn by +port and starboard"]).trial
    assert moved.inputs["port"].max() == pytest.approx(0.2)
    assert moved.inputs["starboard"].max() == pytest.approx(0.19)
    assert not any(name in menu.phases for name in ("turn by +port", "turn by +starboard"))


def test_actuators_that_moved_apart_are_moved_apart() -> None:
    menu = catamaran(boat.zigzag(60, 0.2, 9.0), boat.zigzag(60, 0.2, 14.0))
    assert menu.steering == [("port",), ("starboard",)]
    assert {"turn by +port", "turn by +starboard"} < set(menu.phases)


def test_a_vehicle_without_a_drive_can_start_slowly() -> None:
    delta = boat.zigzag(60, 0.2, 9.0)
    menu = catamaran(delta, delta)
    assert SLOW_START in menu.starts()
    slow, usual = menu.trial(["straight run"], SLOW_START), menu.trial(["straight run"])
    assert slow.trial.outputs["u"][0] == pytest.approx(0.6 * usual.trial.outputs["u"][0])
    assert "60 % of the usual speed" in slow.text


def test_a_zigzag_is_about_no_angle_and_a_turn_is_no_drive() -> None:
    """The median of either is the angle that was held."""
    for delta in (boat.zigzag(60, 0.2, 9.0), np.full(60, 0.2)):
        menu = catamaran(delta, delta)
        assert menu.usual["port"] == 0.0
        assert not menu.drives
        for name in menu.phases:
            assert np.abs(menu.trial([name]).trial.inputs["port"]).max() <= 0.2 + 1e-12


def test_a_trim_is_kept() -> None:
    delta = 0.02 + boat.zigzag(60, 0.2, 9.0) * (np.arange(60) > 35)
    assert catamaran(delta, delta).usual["port"] == pytest.approx(0.02)


def test_what_instruments_show_turns_with_the_first_heading() -> None:
    """A course of satellites and velocities in earth axes start straight ahead on the new heading."""
    channels = ("sog", "cog", "v_n", "v_e", "v_w")
    delta = boat.zigzag(60, 0.2, 9.0)
    base = boat.Catamaran()
    runs = boat.trials(base, [{"port": delta, "starboard": delta}], headings=(0.0,))
    shown = {"sog": 2.0, "cog": 0.1, "v_n": 2.0, "v_e": 0.2, "v_w": 0.1}
    runs = [
        dataclasses.replace(t, outputs={**t.outputs, **{k: np.full(len(t), x) for k, x in shown.items()}}) for t in runs
    ]
    model = observed(base, [Observation(name) for name in channels], keep=("u", "v"))
    menu = Menu(Problem(boat.study(model, runs), load_effects(["gyro_bias"]), Settings(), threads=1))
    first = {name: values[0] for name, values in menu.trial(["straight run"], "beam course: ").trial.outputs.items()}
    assert first["cog"] == first["psi"] == pytest.approx(runs[0].outputs["psi"][0] + math.pi / 2)
    speed = math.hypot(2.0, 0.2)
    assert (first["v_n"], first["v_e"]) == pytest.approx(
        (speed * math.cos(first["psi"]), speed * math.sin(first["psi"]))
    )
    assert first["v_w"] == 0.0
    assert menu.trial(["straight run"], SLOW_START).trial.outputs["sog"][0] == pytest.approx(1.2)


def thrusting(model: Model, **inputs: np.ndarray) -> Menu:
    t = np.arange(60.0)
    outputs = {channel.name: np.zeros(60) for channel in model.outputs}
    runs = [Trial(f"run {k}", t, inputs, outputs, synthetic=True) for k in range(2)]
    return Menu(Problem(boat.study(model, runs), load_effects(["gyro_bias"]), Settings(), threads=1))


def test_a_boat_with_two_thrusters_steers_by_their_difference() -> None:
    rise = boat.zigzag(60, 2.0, 9.0) * (np.arange(60) > 35)
    menu = thrusting(load_model("twin_thruster"), n_port=10.0 + rise, n_starboard=10.0 - 0.5 * rise)
    assert menu.driving == [("n_port", "n_starboard")]
    assert not menu.steering
    assert list(menu.axes) == ["yaw thrust"]
    spiral = menu.phases["staircase of yaw thrust"].inputs
    assert spiral["n_port"] - 10.0 == pytest.approx(10.0 - spiral["n_starboard"])
    assert np.abs(spiral["n_port"] - 10.0).max() == pytest.approx(0.75)  # as far as starboard went
    slow = menu.phases["slow step of +yaw thrust"].inputs
    assert (slow["n_port"][0], slow["n_starboard"][0]) == pytest.approx((7.0, 5.0))
    single = menu.phases["one thruster after another"].inputs
    assert (single["n_port"][0], single["n_starboard"][0]) == pytest.approx((6.0, 10.0))
    assert (single["n_port"][-1], single["n_starboard"][-1]) == pytest.approx((10.0, 6.0))


def test_no_thruster_goes_farther_than_on_record() -> None:
    """Of a boat at 600 rpm that had stopped once, 1200 rpm were asked of one thruster, which had never exceeded 900."""
    stopping = np.where(np.arange(60) < 50, 10.0, 0.0)
    turning = 3.0 * ((np.arange(60) > 10) & (np.arange(60) < 25))
    menu = thrusting(load_model("twin_thruster"), n_port=stopping + turning, n_starboard=stopping - turning)
    assert menu.full["n_port"] == pytest.approx(10.0)
    assert menu.axes["yaw thrust"] == pytest.approx({"n_port": 3.0, "n_starboard": -3.0})
    step = menu.phases["step of +yaw thrust"]
    assert step.text == "yaw thrust as far as it went (n_port 13 rev/s, n_starboard 7 rev/s) and held"
    menu.units.update(n_port="1")
    assert "(n_port 13, n_starboard 7 rev/s)" in menu._steered("yaw thrust", menu.axes["yaw thrust"])[0].text
    for name, phase in menu.phases.items():
        for order in phase.inputs.values():
            assert order.min() >= 0.0, name
            assert order.max() <= 13.0, name


def test_an_underwater_vehicle_steps_along_each_axis_and_keeps_its_battery() -> None:
    model = load_model("bluerov2")
    moved = {one.input: boat.zigzag(60, 0.5, 5.0 + k) for k, one in enumerate(model.actuators)}
    menu = thrusting(model, **moved, voltage=np.full(60, 15.0))
    assert list(menu.axes) == [f"{axis} thrust" for axis in ("surge", "sway", "heave", "roll", "yaw")]
    assert {"step of +heave thrust", "zigzag of sway thrust", "one thruster after another"} < set(menu.phases)
    assert not any("voltage" in phase.inputs for phase in menu.phases.values())
    assert menu.trial(["step of +heave thrust"]).trial.inputs["voltage"].tolist() == [15.0] * 60
    still = thrusting(model, **{**moved, "c_5": np.zeros(60)}, voltage=np.full(60, 15.0))
    assert list(still.axes) == [f"{axis} thrust" for axis in ("surge", "sway", "yaw")]


def test_thrusters_that_hold_a_depth_do_not_drive() -> None:
    """Of an ROV "c_vp and c_vs at 60 %" was suggested for a minute: from 20 m it would have come to the surface."""
    model = load_model("bluerov2")
    moved = {one.input: boat.zigzag(60, 0.2, 5.0 + k) for k, one in enumerate(model.actuators)}
    hovering = {name: 0.5 + 0.1 * moved[name] for name in ("c_5", "c_6")}
    menu = thrusting(model, **{**moved, **hovering}, voltage=np.full(60, 15.0))
    assert menu.driving == []
    assert not any("coast-down" in name or name.startswith("slow") for name in menu.phases)
    ahead = {name: 0.5 + 0.1 * moved[name] for name in ("c_1", "c_2", "c_3", "c_4")}
    both = thrusting(model, **{**moved, **hovering, **ahead}, voltage=np.full(60, 15.0))
    assert both.driving == [("c_1", "c_2", "c_3", "c_4")]


class Pulses(Model):
    """The boat with two thrusters in pulses of their speed controllers, under names of their own."""

    name, title, kind = "pulses", "two speed controllers", "ship"
    states = outputs = tuple(c for c in load_model("twin_thruster").states if c.name in ("u", "v", "r", "psi"))
    inputs = (Channel("pwm_left", "1"), Channel("pwm_right", "1"))
    parameters = (Parameter("T", 4.0, "m/s2", 0.1, 9.0, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        left, right = (i.pwm_left - 1500.0) / 400.0, (i.pwm_right - 1500.0) / 400.0
        surge = p.T * (left * abs(left) + right * abs(right)) - s.u + e.X
        return surge, -s.v + e.Y, p.T * (left * abs(left) - right * abs(right)) - s.r + e.N, s.r


class Named(Pulses):
    """The same with its thrusters named."""

    name = "named"
    actuators = (
        Thruster("left", "pwm_left", (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), full=1900.0),
        Thruster("right", "pwm_right", (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), full=1900.0),
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return tuple(p.T * (x - 1500.0) / 400.0 * abs((x - 1500.0) / 400.0) for x in i)


@pytest.mark.parametrize("model", [Pulses(), Named()], ids=["unnamed", "named"])
def test_drives_in_pulses_go_to_their_rest_and_not_to_zero(model: Model) -> None:
    rise = boat.zigzag(60, 40.0, 9.0) * (np.arange(60) > 35)
    menu = thrusting(model, pwm_left=1700.0 + rise, pwm_right=1700.0 - rise)
    assert menu.driving == [("pwm_left", "pwm_right")]
    assert not menu.steering
    assert list(menu.axes) == ["yaw thrust"]
    coast = menu.phases["coast-down (pwm_left and pwm_right to 1500)"].inputs
    assert coast["pwm_left"][-1] == coast["pwm_right"][-1] == 1500.0
    slow = menu.phases["slow step of +yaw thrust"].inputs
    assert (slow["pwm_left"][0], slow["pwm_right"][0]) == pytest.approx((1660.0, 1580.0))
    for phase in menu.phases.values():
        assert all(1100.0 <= float(x.min()) <= float(x.max()) <= 1900.0 for x in phase.inputs.values())


class Jet(Pulses):
    """One lever, and a wheel in pulses that steers it."""

    name = "jet"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        wheel, lever = (i.pwm_left - 1500.0) / 500.0, (i.pwm_right - 1500.0) / 500.0
        return p.T * lever - s.u + e.X, -s.v + e.Y, p.T * lever * wheel - s.r + e.N, s.r


def test_a_command_that_steers_is_no_drive() -> None:
    menu = thrusting(Jet(), pwm_left=1500.0 + boat.zigzag(60, 90.0, 9.0), pwm_right=np.full(60, 1700.0))
    assert menu.steering == [("pwm_left",)]
    assert menu.driving == [("pwm_right",)]
    assert menu.usual == {"pwm_left": 1500.0, "pwm_right": 1700.0}


def test_the_legs_of_a_zigzag_turn_by_half_a_circle_at_most(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """A survey of a quarter of an hour was to be followed by a zigzag with legs of 95 s, each of several circles."""
    assert Menu(small.problem(ship_folder, offset_runs)).leg == pytest.approx(offset_runs[0].duration / 8.0, rel=0.02)
    fast = [
        dataclasses.replace(run, outputs={**run.outputs, "psi": 0.3 * np.asarray(run.t)}) for run in offset_runs
    ]  # half a circle in 10.5 s
    menu = Menu(small.problem(ship_folder, fast))
    assert 0.8 * np.pi / 0.3 <= menu.leg <= np.pi / 0.3
    assert f"alternating every {menu.leg:.3g} s" in menu.phases["zigzag of delta"].text
