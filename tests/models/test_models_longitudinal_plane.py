"""The longitudinal plane against the check figures of its benchmark, which independent code computed."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion import deg, rates

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import chen2011_system as system  # noqa: E402

from seatruth.errors import BadInput  # noqa: E402
from seatruth.manoeuvres import Straight, run_manoeuvre  # noqa: E402
from seatruth.models import Environment, Model, load_model  # noqa: E402
from seatruth.models.longitudinal_plane import (  # noqa: E402
    READINGS,
    LongitudinalPlane,
    LongitudinalPlaneExplicit,
)
from seatruth.models.torpedo import Torpedo324  # noqa: E402
from seatruth.testing.models import ModelConformance  # noqa: E402

PLANT = LongitudinalPlane()
TRIAL = system.benchmark()


class TestLongitudinalPlane(ModelConformance):
    start: ClassVar[Mapping[str, float]] = {"u": 4.0}

    @pytest.fixture(params=LongitudinalPlane.sets)
    def model(self, request: Any) -> Model:
        return LongitudinalPlane(request.param)


class TestLongitudinalPlaneExplicit(TestLongitudinalPlane):
    @pytest.fixture
    def model(self) -> Model:
        return LongitudinalPlaneExplicit()


def test_benchmark_excitation() -> None:
    theta, v_x = np.degrees(TRIAL.outputs["theta"]), TRIAL.outputs["u"]
    incidence = np.degrees(np.arctan(TRIAL.outputs["w"] / v_x))
    assert len(TRIAL) == 1201
    assert (theta.min(), theta.max()) == pytest.approx((-32.0, 25.0), abs=0.5)
    assert (v_x.min(), v_x.max()) == pytest.approx((2.9, 4.8), abs=0.05)
    assert np.abs(incidence).max() == pytest.approx(9.5, abs=0.1)
    fin = np.degrees(TRIAL.inputs["delta_s"])
    assert np.abs(fin).max() <= 20.0 + 1e-9
    assert np.abs(np.diff(fin)).max() / 0.05 <= 60.0 + 1e-6


def test_bounds_of_the_benchmark() -> None:
    found = system.bounds(TRIAL, 0.03)
    expected = {"lambda_22": 2.9, "lambda_26": 12.6, "lambda_66": 8.3, "C_x0": 0.6, "C_x_alpha": 3.4}
    assert {name: found[name] for name in expected} == pytest.approx(expected, abs=0.05)
    lift = [found[name] for name in READINGS["R2"] if name.startswith("C_y")]
    moment = [found[name] for name in READINGS["R2"] if name.startswith("m_z")]
    assert (min(lift), max(lift)) == pytest.approx((1.9, 3.7), abs=0.06)
    # 2.54 to 2.77 with the elevator linear between samples, 2.50 to 2.74 with it held: the sheet says 2.6 to 2.8
    assert (min(moment), max(moment)) == pytest.approx((2.6, 2.8), abs=0.07)


def test_bounds_grow_with_the_noise_alone() -> None:
    one, three = system.bounds(TRIAL, 0.01), system.bounds(TRIAL, 0.03)
    assert {name: 3.0 * value for name, value in one.items()} == pytest.approx(three)


def neutral(model: Model, pitch: float) -> dict[str, float]:
    """Bounds at 3 % noise of the benchmark with steps of `pitch` deg, as heavy as the water that it displaces."""
    values = {"dG": 0.0}
    trial = system.benchmark(model, values, system.PitchSteps(pitch=deg(pitch)))
    return system.bounds(trial, 0.03, model=model, values=values)


@pytest.mark.parametrize(
    ("model", "low", "high"), [(LongitudinalPlane(), 420.0, 2500.0), (LongitudinalPlaneExplicit(), 50.0, 250.0)]
)
def test_without_net_weight_the_lateral_group_is_free_up_to_a_scale(model: Model, low: float, high: float) -> None:
    found = neutral(model, 5.0)
    assert low <= found["lambda_22"] <= high
    group = ("lambda_22", "lambda_26", "C_y_alpha", "C_y_de")
    rest = [found[name] for name in ("lambda_66", "C_x0", "m_z_alpha", "m_z_wz", "m_z_de")]
    assert min(found[name] for name in group) > 3.0 * max(rest)


def test_the_benchmarks_own_steps_hide_less_of_that() -> None:
    """At 25 deg of pitch the axial force tells a little of it; with the net weight known the bound is 2.9 %."""
    assert neutral(LongitudinalPlane(), 25.0)["lambda_22"] == pytest.approx(200, abs=5)
    assert neutral(LongitudinalPlaneExplicit(), 25.0)["lambda_22"] == pytest.approx(22, abs=1)


def test_without_a_weight_moment_the_moment_row_is_free_up_to_a_scale() -> None:
    """x_B = y_G = 0: nothing known stands in the moment equation, and the bounds are infinite."""
    found = system.bounds(system.benchmark(PLANT, {"y_G": 0.0}), 0.03, values={"y_G": 0.0})
    assert all(math.isinf(found[name]) for name in ("lambda_66", "m_z_alpha", "m_z_wz", "m_z_de"))
    values = {"y_G": 0.0, "x_B": 0.05}
    held = system.bounds(system.benchmark(PLANT, values), 0.03, values=values)
    assert held["m_z_alpha"] < 60.0  # a known moment anchors it, x_B as well as y_G


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_known_net_weight_of_either_sign_anchors_it(sign: float) -> None:
    values = {"dG": sign * 0.05 * PLANT.nominal()["m"] * 9.81}
    assert system.bounds(system.benchmark(PLANT, values), 0.03, values=values)["lambda_22"] == pytest.approx(3, abs=0.6)


def test_coasting_without_a_fin_holds_little() -> None:
    """Reading R1: one 4 s run from 20 m/s, at 1 % noise."""
    model = LongitudinalPlane("R1")
    trial = run_manoeuvre(model, Straight(4.0), dt=0.05, first_state={"u": 20.0, "z": 60.0}, limit=4.0)
    found = system.bounds(trial, 0.01, model=model, free=READINGS["R1"])
    assert min(found[name] for name in ("lambda_26", "lambda_66", "C_y_wz")) > 100.0
    assert all(value > 7.0 for name, value in found.items() if name != "C_x0")


def test_readings_have_11_parameters_and_are_offered() -> None:
    assert [len(names) for names in READINGS.values()] == [11, 11]
    model = load_model("longitudinal_plane", parameter_set="R1")
    assert model.nominal()["C_y_de"] == model.nominal()["T"] == 0.0
    with pytest.raises(BadInput, match="R3"):
        LongitudinalPlane("R3")


def test_couplings_apart_are_those_of_an_ideal_fluid() -> None:
    p, state = PLANT.nominal(), {"u": 4.0, "w": 0.4, "q": 0.2, "theta": 0.1}
    one, other = (rates(model, state, {}) for model in (PLANT, LongitudinalPlaneExplicit()))
    dv_x, dv_y, dw_z = other["u"] - one["u"], -(other["w"] - one["w"]), other["q"] - one["q"]
    assert (p["m"] + p["lambda_11"]) * dv_x == pytest.approx(p["lambda_22"] * -0.4 * 0.2 + p["lambda_26"] * 0.04)
    across = (p["m"] + p["lambda_22"]) * dv_y + p["lambda_26"] * dw_z
    turn = p["lambda_26"] * dv_y + (p["J_z"] + p["lambda_66"]) * dw_z
    assert across == pytest.approx(-p["lambda_11"] * 4.0 * 0.2)
    assert turn == pytest.approx(-p["lambda_26"] * 4.0 * 0.2)


@settings(max_examples=50, deadline=None)
@given(
    u=st.floats(1, 8), w=st.floats(-1, 1), q=st.floats(-0.5, 0.5), theta=st.floats(-1.2, 1.2), fin=st.floats(-0.4, 0.4)
)
def test_it_is_the_vertical_part_of_the_coupled_model(u: float, w: float, q: float, theta: float, fin: float) -> None:
    """Its equations are those of the 6-DOF vehicle moving in that plane, with the origin at the buoyancy centre."""
    shared = [name for name in Torpedo324().nominal() if name in PLANT.nominal() and name != "y_G"]
    values = {name: PLANT.nominal()[name] for name in shared} | {"y_G": 0.0, "k_1": 0.0, "k_2": 0.0, "k_Q": 0.0}
    state = {"u": u, "w": w, "q": q, "theta": theta}
    coupled = rates(Torpedo324(), state, {"delta_s": fin}, values)
    plane = rates(PLANT, state, {"delta_s": fin}, {"y_G": 0.0, "T": 0.0, "C_x_alpha": 0.0})
    assert plane == pytest.approx({name: coupled[name] for name in plane}, abs=1e-6)


def test_signs() -> None:
    ahead = {"u": 4.0}
    assert rates(PLANT, ahead, {"delta_s": 0.1})["q"] < 0 < rates(PLANT, ahead, {"delta_s": -0.1})["q"]
    sinking = {"u": 4.0, "w": 0.2}  # through the water: positive incidence
    assert rates(PLANT, sinking, {})["w"] < rates(PLANT, ahead, {})["w"]
    assert rates(PLANT, {"theta": 0.2}, {}, {"dG": 0.0})["q"] < 0  # the pendulum rights it
    assert rates(PLANT, {}, {})["w"] < 0  # it floats


def test_outside_forces_act_on_the_virtual_masses() -> None:
    pushed = rates(PLANT, {}, {}, {"lambda_26": 0.0}, lambda t, s: Environment(X=10.0, Z=20.0, M=30.0))
    still = rates(PLANT, {}, {}, {"lambda_26": 0.0})
    p = PLANT.nominal()
    assert (pushed["u"] - still["u"]) * (p["m"] + p["lambda_11"]) == pytest.approx(10.0)
    assert (pushed["w"] - still["w"]) * (p["m"] + p["lambda_22"]) == pytest.approx(20.0)
    assert (pushed["q"] - still["q"]) * (p["J_z"] + p["lambda_66"]) == pytest.approx(30.0)


def test_a_current_carries_the_whole_track() -> None:
    speed, dip = 0.4, 0.6  # m/s, rad below the horizon

    def environment(t: float, s: Any) -> Environment:
        u_c, w_c = speed * math.cos(s.theta + dip), speed * math.sin(s.theta + dip)
        return Environment(t=t, u_c=u_c, w_c=w_c, du_c=-s.q * w_c, dw_c=s.q * u_c)

    common: dict[str, Any] = {"dt": 0.05, "inputs": {"delta_s": deg(2)}, "limit": 10.0}
    still = run_manoeuvre(PLANT, Straight(10.0), first_state={"u": 4.0}, **common)
    first = {"u": 4.0 + speed * math.cos(dip), "w": speed * math.sin(dip)}
    drifting = run_manoeuvre(PLANT, Straight(10.0), first_state=first, environment=environment, **common)
    assert drifting.outputs["theta"] == pytest.approx(still.outputs["theta"], abs=1e-5)
    assert drifting.outputs["x"] == pytest.approx(still.outputs["x"] + speed * math.cos(dip) * still.t, abs=1e-4)
    assert drifting.outputs["z"] == pytest.approx(still.outputs["z"] + speed * math.sin(dip) * still.t, abs=1e-4)


@settings(max_examples=100, deadline=None)
@given(u=st.floats(-20, 20), w=st.floats(-20, 20), q=st.floats(-3, 3), theta=st.floats(-20, 20), fin=st.floats(-3, 3))
def test_finite_everywhere(u: float, w: float, q: float, theta: float, fin: float) -> None:
    state = {"u": u, "w": w, "q": q, "theta": theta}
    for model in (PLANT, LongitudinalPlane("R1"), LongitudinalPlaneExplicit()):
        assert all(math.isfinite(x) for x in rates(model, state, {"delta_s": fin}).values())
