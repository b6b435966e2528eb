"""Manoeuvres by thrusters: who pushes along which axis, what is ordered, and a station kept under a current."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    AxisSteps,
    StationKeeping,
    ThrusterSteps,
    run_manoeuvre,
    steady_current,
    thruster_layout,
)
from seatruth.models import load_model

BOAT, ROV = load_model("twin_thruster"), load_model("bluerov2_heavy")
BATTERY = {"voltage": 16.0}


def test_which_axes_the_thrusters_have() -> None:
    assert list(thruster_layout(BOAT).axes) == ["surge", "yaw"]
    assert list(thruster_layout(ROV).axes) == ["surge", "sway", "heave", "roll", "pitch", "yaw"]
    assert "pitch" not in thruster_layout(load_model("bluerov2")).axes
    assert list(thruster_layout(load_model("diving_plane_driven")).axes) == ["surge"]
    with pytest.raises(BadInput, match="names no thruster"):
        thruster_layout(load_model("mmg"))


def test_orders_are_reduced_alike_where_full_power_is_reached() -> None:
    layout = thruster_layout(BOAT)
    half = layout.orders({"surge": 0.25})
    assert half == pytest.approx(dict.fromkeys(layout.full, 0.5 * layout.full["n_port"]))
    both = layout.orders({"surge": 1.0, "yaw": 0.5})
    assert both["n_port"] == layout.full["n_port"]
    assert both["n_starboard"] == pytest.approx(layout.full["n_starboard"] * math.sqrt(0.5 / 1.5))


def test_a_spiral_by_differential_thrust() -> None:
    plan = AxisSteps(thruster_layout(BOAT), "yaw", (0.1, 0.3, 0.0, -0.3, -0.1), 30.0, ahead=0.4)
    assert plan.label == "yaw steps 0.1/0.3/0/-0.3/-0.1, 0.4 ahead"
    run = run_manoeuvre(BOAT, plan)
    assert run.t[-1] == pytest.approx(150.0)
    r = run.outputs["r"][[290, 590, 890, 1190, 1490]]
    assert r == pytest.approx(-r[::-1], abs=1e-3)
    assert r[1] > r[0] > 0.05
    thrust = np.sign(run.inputs["n_port"]) * run.inputs["n_port"] ** 2
    assert thrust[100] + run.inputs["n_starboard"][100] ** 2 == pytest.approx(0.8 * 16.54**2)


def test_single_thrusters_and_axes() -> None:
    layout = thruster_layout(ROV)
    run = run_manoeuvre(ROV, ThrusterSteps(layout, (0.2, -0.2), 1.0), inputs=BATTERY)
    orders = np.array([run.inputs[name][5::10] for name in layout.full])
    assert ((orders != 0.0).sum(axis=0) == 1).all()
    assert orders[2].tolist() == pytest.approx([0.0] * 4 + [0.2**0.5, -(0.2**0.5)] + [0.0] * 10)
    dive = run_manoeuvre(ROV, AxisSteps(layout, "heave", (0.2,), 5.0), inputs=BATTERY)
    assert dive.outputs["z"][-1] > 0.5
    with pytest.raises(BadInput, match="cannot act in 'sway'"):
        AxisSteps(thruster_layout(BOAT), "sway", (0.1,), 5.0)
    with pytest.raises(BadInput, match="time to hold"):
        AxisSteps(layout, "sway", (), 5.0)


def test_a_station_is_kept_under_a_current() -> None:
    current = steady_current(0.3, 1.2)
    boat = run_manoeuvre(BOAT, StationKeeping(thruster_layout(BOAT), 200.0), dt=0.2, environment=current)
    off = np.hypot(boat.outputs["x"], boat.outputs["y"])
    assert off.max() < 5.0
    assert off[-100:].max() < 1.0
    assert math.cos(boat.outputs["psi"][-1] - 1.2) < -0.95  # the bow against the current
    layout = thruster_layout(ROV, BATTERY, dead_band=0.07)
    plan = StationKeeping(layout, 100.0, at=(0.0, 0.0, 1.0), heading=0.5)
    rov = run_manoeuvre(ROV, plan, inputs=BATTERY, environment=current)
    assert np.hypot(rov.outputs["x"], rov.outputs["y"])[-300:].max() < 0.2
    assert rov.outputs["z"][-300:] == pytest.approx(1.0, abs=0.1)
    assert rov.outputs["psi"][-300:] == pytest.approx(0.5, abs=0.1)
    assert np.abs(rov.outputs["theta"][-300:]).max() < 0.1


def test_a_station_needs_thrust() -> None:
    with pytest.raises(BadInput, match="Name the model's other inputs"):
        StationKeeping(thruster_layout(ROV), 10.0)
    with pytest.raises(BadInput, match="'yaw'"):
        StationKeeping(thruster_layout(load_model("diving_plane_driven")), 10.0)
    with pytest.raises(BadInput, match="between 0 and 1"):
        thruster_layout(BOAT, dead_band=1.0)
    with pytest.raises(BadInput, match="positive"):
        StationKeeping(thruster_layout(BOAT), -1.0)
