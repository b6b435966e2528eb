"""The underwater vehicle with thrusters: hover, righting, allocation, energy, tether, and a user's own layout."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from motion import balance, rates

from seatruth.errors import BadInput
from seatruth.manoeuvres import Straight, run_manoeuvre, thruster_layout
from seatruth.models import Model, Parameter, Rudder, Thruster
from seatruth.models.rov import ROV, BlueROV2, BlueROV2Heavy, thrust
from seatruth.testing.models import ModelConformance

P = BlueROV2Heavy().nominal()
MOTION = ("u", "v", "w", "p", "q", "r")
KGF = 9.80665


class Values:
    """Nominal values as attributes."""

    def __getattr__(self, name: str) -> float:
        return P[name]


class Five(ROV):
    """A user's vehicle: main thrusters whose place is a parameter, one across, two that lift."""

    name = "five"
    title = "five thrusters"
    source = "[S] made for this test"
    parameters = (*ROV.parameters, Parameter("beam", 0.2, "m", 0.1, 0.4, source="[S] test"))
    actuators = (
        Thruster("port", "port", at=(-0.2, "-beam", 0.0), towards=(1.0, 0.0, 0.0), full=1.0),
        Thruster("starboard", "starboard", at=(-0.2, "beam", 0.0), towards=(1.0, 0.0, 0.0), full=1.0),
        Thruster("across", "across", at=(0.0, 0.0, 0.0), towards=(0.0, 1.0, 0.0), full=1.0),
        Thruster("lift_fore", "lift", at=(0.2, 0.0, 0.0), towards=(0.0, 0.0, -1.0), full=1.0),
        Thruster("lift_aft", "lift", at=(-0.2, 0.0, 0.0), towards=(0.0, 0.0, -1.0), full=1.0),
    )


class TestROV(ModelConformance):
    @pytest.fixture(params=[BlueROV2, BlueROV2Heavy, Five])
    def model(self, request: Any) -> Model:
        made: Model = request.param()
        return made


def test_it_hovers_where_weight_and_buoyancy_agree() -> None:
    still = rates(BlueROV2(), {"psi": 1.0, "z": 10.0}, {"voltage": 16.0})
    assert list(still.values()) == pytest.approx([0.0] * len(still), abs=1e-12)
    heavier = rates(BlueROV2Heavy(), {}, {})["w"]  # by 0.1 kg, as published
    assert heavier == pytest.approx(P["g"] * (P["m"] - P["rho"] * P["nabla"]) / (P["m"] - P["Z_dw"]))


def test_the_centre_of_buoyancy_rights_it() -> None:
    stiff = P["rho"] * P["g"] * P["nabla"] * 0.01
    rolled, pitched = (rates(BlueROV2Heavy(), {angle: 0.3}, {}) for angle in ("phi", "theta"))
    assert rolled["p"] == pytest.approx(-stiff * math.sin(0.3) / (P["I_x"] - P["K_dp"]))
    assert pitched["q"] == pytest.approx(-stiff * math.sin(0.3) / (P["I_y"] - P["M_dq"]))
    weights = rates(BlueROV2Heavy(), {}, {}, {"x_G": 0.01, "z_B": 0.0})  # nose heavy
    assert weights["q"] < 0.0
    assert rates(BlueROV2Heavy(), {}, {}, {"y_B": 0.01})["p"] < 0.0  # buoyancy to starboard lifts that side


def test_the_thrust_is_that_of_the_maker() -> None:
    """kgf at full command, by voltage."""
    for voltage, ahead, astern in ((12.0, 3.71, 2.92), (14.0, 4.52, 3.52), (16.0, 5.25, 4.10)):
        assert thrust(1.0, voltage, Values()) == pytest.approx(ahead * KGF, rel=0.02)
        assert thrust(-1.0, voltage, Values()) == pytest.approx(-astern * KGF, rel=0.02)
    assert thrust(0.07, 16.0, Values()) == thrust(-0.05, 16.0, Values()) == 0.0
    quarter = 0.07 + 0.25 * 0.93
    assert thrust(quarter, 16.0, Values()) == pytest.approx(thrust(1.0, 16.0, Values()) / 16.0)


@pytest.mark.parametrize("model", [BlueROV2(), BlueROV2Heavy(), Five()], ids=lambda model: model.name)
def test_orders_along_an_axis_move_it_along_that_axis(model: Model) -> None:
    even = {"T_astern": P["T_ahead"], "nabla": model.nominal()["m"] / 1000.0}
    layout = thruster_layout(model, {"voltage": 16.0})
    assert {"surge", "sway", "heave", "yaw"} < {*layout.axes, "roll", "pitch"}
    law = {"dead_band": 0.0}
    for axis, state in zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), MOTION, strict=True):
        if axis in layout.axes:
            found = rates(model, {}, {**layout.orders({axis: 0.5}), "voltage": 16.0}, even | law)
            assert found[state] > 0.0
            assert {name: found[name] for name in MOTION if name != state} == pytest.approx(
                dict.fromkeys((name for name in MOTION if name != state), 0.0), abs=1e-9
            )


def test_two_thrusters_may_have_one_order() -> None:
    assert [channel.name for channel in Five().inputs] == ["port", "starboard", "across", "lift", "voltage"]
    found = rates(Five(), {}, {"lift": 1.0, "voltage": 16.0}, {"nabla": 0.0135})
    assert found["w"] == pytest.approx(-2 * P["T_ahead"] / (P["m"] - P["Z_dw"]))
    assert found["q"] == pytest.approx(0.0, abs=1e-12)


def test_inertia_alone_keeps_its_energy_and_damping_takes_it() -> None:
    """With the centre of gravity off in every direction; weight and buoyancy are left out."""
    model = BlueROV2Heavy()
    offset = {"x_G": 0.03, "y_G": -0.02, "z_G": 0.04, "g": 1e-12}
    damping = ("X_u", "Z_w", "M_q", "X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr", "l_t")
    first = {"u": 0.5, "v": 0.2, "w": -0.1, "p": 0.3, "q": -0.2, "r": 0.4}
    x, y, z = (offset[name] for name in ("x_G", "y_G", "z_G"))
    G = P["m"] * np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    mass = np.zeros((6, 6))
    mass[:3, :3] = P["m"] * np.eye(3)
    mass[:3, 3:], mass[3:, :3] = -G, G
    mass[3:, 3:] = np.diag([P["I_x"], P["I_y"], P["I_z"]]) - G @ G / P["m"]
    mass -= np.diag([P[name] for name in ("X_du", "Y_dv", "Z_dw", "K_dp", "M_dq", "N_dr")])
    for values, kept in ((dict.fromkeys(damping, 0.0), True), ({}, False)):
        run = run_manoeuvre(model, Straight(6.0), offset | values, dt=0.02, first_state=first)
        nu = np.array([run.outputs[name] for name in MOTION])
        energy = 0.5 * np.einsum("it,ij,jt->t", nu, mass, nu)
        assert (np.ptp(energy) / energy[0] < 1e-6) if kept else (np.diff(energy) < 0.0).all()


def test_top_speed_is_between_what_was_measured_and_what_the_maker_says() -> None:
    """0.72 m/s at less thrust (von Benzon et al. 2022), 1.5 m/s (Blue Robotics); a longer tether slows it."""
    model = BlueROV2Heavy()
    full = {**thruster_layout(model).orders({"surge": 1.0}), "voltage": 16.0}
    speeds = []
    for length in (0.0, 10.0, 100.0):

        class Towing(BlueROV2Heavy):
            parameters = tuple(q.replace(value=length) if q.name == "l_t" else q for q in BlueROV2Heavy.parameters)

        speeds.append(balance(Towing(), {"u": 1.0}, full, ("u",))["u"])
    assert 0.72 < speeds[1] < 1.5
    assert speeds[0] > speeds[1] > speeds[2]


def test_a_tether_that_turns_about_its_end_pulls_with_a_quarter() -> None:
    """The moment of the drag about the far end, over the length."""
    s, V, length = np.linspace(0.0, 1.0, 2001), 0.7, 10.0
    line = 0.5 * P["rho"] * P["C_t"] * P["d_t"] * (V * s) ** 2
    pull = np.trapezoid(line * s, s) * length
    bare, towing = (rates(BlueROV2Heavy(), {"v": V}, {}, {"l_t": x, "x_t": 0.0})["v"] for x in (0.0, length))
    assert (bare - towing) * (P["m"] - P["Y_dv"]) == pytest.approx(pull, rel=1e-5)
    sinking = rates(BlueROV2Heavy(), {}, {}, {"w_t": 5.0, "x_t": -0.2})
    assert sinking["q"] > 0.0  # a weight at the stern lifts the nose


def test_the_lighter_vehicle_floats_by_itself() -> None:
    p = BlueROV2().nominal()
    assert p["rho"] * p["nabla"] == pytest.approx(p["m"])
    steady = balance(BlueROV2(), {"w": -0.1}, {"c_5": 0.4, "c_6": 0.4, "voltage": 16.0}, ("w",))
    assert steady["w"] < -0.05  # positive vertical thrust lifts


def test_a_layout_that_is_none_is_refused() -> None:
    with pytest.raises(BadInput, match="must be Thrusters"):

        class Steered(ROV):
            name = "steered"
            actuators = (Rudder("fin", "delta"),)
