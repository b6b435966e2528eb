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

import chen2011_system as system  # type: ignore[import-not-found,unused-ignore]  # noqa: E402

from seatruth.errors import BadInput  # noqa: E402
from seatruth.manoeuvres import Straight, run_manoeuvre  # noqa: E402
from seatruth.models import Model, Surroundings, load_model  # noqa: E402
from seatruth.models.diving_plane import DivingPlane  # noqa: E402
from seatruth.models.longitudinal_plane import (  # noqa: E402
    READINGS,
    STANDARD,
    LongitudinalPlane,
    LongitudinalPlaneExplicit,
)
from seatruth.testing.models import ModelConformance  # noqa: E402

PLANT = LongitudinalPlane()
TRIAL = system.benchmark()


class TestLongitudinalPlane(ModelConformance):
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {
        "v_x": (-3.0, 10.0),
        "v_y": (-3.0, 3.0),
        "omega_z": (-0.5, 0.5),
        "x_0": (-1e4, 1e4),
        "y_0": (-1e4, 1e4),
        "delta_e": (-0.7, 0.7),
    }
    start: ClassVar[Mapping[str, float]] = {"v_x": 4.0}

    @pytest.fixture(params=LongitudinalPlane.sets)
    def model(self, request: Any) -> Model:
        return LongitudinalPlane(request.param)


class TestLongitudinalPlaneExplicit(TestLongitudinalPlane):
    @pytest.fixture
    def model(self) -> Model:
        return LongitudinalPlaneExplicit()


def test_benchmark_excitation() -> None:
    theta, v_x = np.degrees(TRIAL.outputs["theta"]), TRIAL.outputs["v_x"]
    incidence = np.degrees(np.arctan(TRIAL.outputs["v_y"] / v_x))
    assert len(TRIAL) == 1201
    assert (theta.min(), theta.max()) == pytest.approx((-32.0, 25.0), abs=0.5)
    assert (v_x.min(), v_x.max()) == pytest.approx((2.9, 4.8), abs=0.05)
    assert np.abs(incidence).max() == pytest.approx(9.5, abs=0.1)
    fin = np.degrees(TRIAL.inputs["delta_e"])
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
    plan = system.PitchSteps(pitch=deg(pitch))
    trial = run_manoeuvre(model, plan, values, dt=system.STEP, first_state=system.FIRST, limit=system.SECONDS)
    return system.bounds(trial, 0.03, model=model, values=values)


@pytest.mark.parametrize(
    ("model", "low", "high"), [(LongitudinalPlane(), 420.0, 2500.0), (LongitudinalPlaneExplicit(), 50.0, 250.0)]
)
def test_without_net_weight_the_lateral_group_is_free_up_to_a_scale(model: Model, low: float, high: float) -> None:
    found = neutral(model, 5.0)
    assert low <= found["lambda_22"] <= high
    group = ("lambda_22", "lambda_26", "C_y_alpha", "C_y_delta")
    rest = [found[name] for name in ("lambda_66", "C_x0", "m_z_alpha", "m_z_omega", "m_z_delta")]
    assert min(found[name] for name in group) > 3.0 * max(rest)


def test_the_benchmarks_own_steps_hide_less_of_that() -> None:
    """At 25 deg of pitch the axial force tells a little of it; with the net weight known the bound is 2.9 %."""
    assert neutral(LongitudinalPlane(), 25.0)["lambda_22"] == pytest.approx(200, abs=5)
    assert neutral(LongitudinalPlaneExplicit(), 25.0)["lambda_22"] == pytest.approx(22, abs=1)


def test_without_a_weight_moment_the_moment_row_is_free_up_to_a_scale() -> None:
    """x_B = y_G = 0: nothing known stands in the moment equation, and the bounds are infinite."""
    found = system.bounds(system.benchmark(PLANT, {"y_G": 0.0}), 0.03, values={"y_G": 0.0})
    assert all(math.isinf(found[name]) for name in ("lambda_66", "m_z_alpha", "m_z_omega", "m_z_delta"))
    values = {"y_G": 0.0, "x_B": 0.05}
    held = system.bounds(system.benchmark(PLANT, values), 0.03, values=values)
    assert held["m_z_alpha"] < 60.0  # a known moment anchors it, x_B as well as y_G


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_known_net_weight_of_either_sign_anchors_it(sign: float) -> None:
    values = {"dG": sign * 0.05 * PLANT.nominal()["G"]}
    assert system.bounds(system.benchmark(PLANT, values), 0.03, values=values)["lambda_22"] == pytest.approx(3, abs=0.6)


def test_coasting_without_a_fin_holds_little() -> None:
    """Reading R1: one 4 s run from 20 m/s, at 1 % noise."""
    model = LongitudinalPlane("R1")
    trial = run_manoeuvre(model, Straight(4.0), dt=0.05, first_state={"v_x": 20.0, "y_0": -60.0}, limit=4.0)
    found = system.bounds(trial, 0.01, model=model, free=READINGS["R1"])
    assert min(found[name] for name in ("lambda_26", "lambda_66", "C_y_omega")) > 100.0
    assert all(value > 7.0 for name, value in found.items() if name != "C_x0")


def test_readings_have_11_parameters_and_are_offered() -> None:
    assert [len(names) for names in READINGS.values()] == [11, 11]
    model = load_model("longitudinal_plane", parameter_set="R1")
    assert model.nominal()["C_y_delta"] == model.nominal()["T"] == 0.0
    with pytest.raises(BadInput, match="R3"):
        LongitudinalPlane("R3")


def test_couplings_apart_are_those_of_an_ideal_fluid() -> None:
    """Their power is zero but for what the added masses store: no energy comes from them."""
    p, state = PLANT.nominal(), {"v_x": 4.0, "v_y": -0.4, "omega_z": 0.2, "theta": 0.1}
    one, other = (rates(model, state, {}) for model in (PLANT, LongitudinalPlaneExplicit()))
    d = {name: other[name] - one[name] for name in ("v_x", "v_y", "omega_z")}
    along = (p["m"] + p["lambda_11"]) * d["v_x"]
    across = (p["m"] + p["lambda_22"]) * d["v_y"] + p["lambda_26"] * d["omega_z"]
    turn = p["lambda_26"] * d["v_y"] + (p["J_z"] + p["lambda_66"]) * d["omega_z"]
    assert along == pytest.approx(p["lambda_22"] * -0.4 * 0.2 + p["lambda_26"] * 0.04)
    assert across == pytest.approx(-p["lambda_11"] * 4.0 * 0.2)
    assert turn == pytest.approx(-p["lambda_26"] * 4.0 * 0.2)


def test_mapping_to_the_standard_axes() -> None:
    """The kinematics here are those of the diving plane after the mapping."""
    state = {"v_x": 3.0, "v_y": -0.3, "omega_z": 0.1, "theta": 0.4}
    here = rates(PLANT, state, {})
    mapped = {STANDARD[name][0]: STANDARD[name][1] * value for name, value in state.items()}
    there = rates(DivingPlane(), mapped, {})
    for name in ("theta", "x_0", "y_0"):
        other, sign = STANDARD[name]
        assert sign * here[name] == pytest.approx(there[other])


def test_signs() -> None:
    ahead = {"v_x": 4.0}
    assert rates(PLANT, ahead, {"delta_e": 0.1})["omega_z"] < 0 < rates(PLANT, ahead, {"delta_e": -0.1})["omega_z"]
    nose_up = {"v_x": 4.0, "v_y": -0.2}  # sinking through the water: positive incidence
    level = rates(PLANT, ahead, {})
    assert rates(PLANT, nose_up, {})["v_y"] > level["v_y"]
    assert rates(PLANT, {"theta": 0.2}, {}, {"dG": 0.0})["omega_z"] < 0  # the pendulum rights it
    assert rates(PLANT, {}, {})["v_y"] > 0  # it floats


def test_outside_forces_have_z_down() -> None:
    pushed = rates(PLANT, {}, {}, {"lambda_26": 0.0}, lambda t, s: Surroundings(X=10.0, Z=20.0, M=30.0))
    still = rates(PLANT, {}, {}, {"lambda_26": 0.0})
    p = PLANT.nominal()
    assert (pushed["v_x"] - still["v_x"]) * (p["m"] + p["lambda_11"]) == pytest.approx(10.0)
    assert (pushed["v_y"] - still["v_y"]) * (p["m"] + p["lambda_22"]) == pytest.approx(-20.0)
    assert (pushed["omega_z"] - still["omega_z"]) * (p["J_z"] + p["lambda_66"]) == pytest.approx(30.0)


def test_a_current_carries_the_whole_track() -> None:
    speed, dip = 0.4, 0.6  # m/s, rad below the horizon

    def around(t: float, s: Any) -> Surroundings:
        u_c, w_c = speed * math.cos(s.theta + dip), speed * math.sin(s.theta + dip)
        return Surroundings(t=t, u_c=u_c, w_c=w_c, du_c=-s.omega_z * w_c, dw_c=s.omega_z * u_c)

    common: dict[str, Any] = {"dt": 0.05, "inputs": {"delta_e": deg(2)}, "limit": 10.0}
    still = run_manoeuvre(PLANT, Straight(10.0), first_state={"v_x": 4.0}, **common)
    first = {"v_x": 4.0 + speed * math.cos(dip), "v_y": -speed * math.sin(dip)}
    drifting = run_manoeuvre(PLANT, Straight(10.0), first_state=first, around=around, **common)
    assert drifting.outputs["theta"] == pytest.approx(still.outputs["theta"], abs=1e-5)
    assert drifting.outputs["x_0"] == pytest.approx(still.outputs["x_0"] + speed * math.cos(dip) * still.t, abs=1e-4)
    assert drifting.outputs["y_0"] == pytest.approx(still.outputs["y_0"] - speed * math.sin(dip) * still.t, abs=1e-4)


@settings(max_examples=100, deadline=None)
@given(
    v_x=st.floats(-20, 20),
    v_y=st.floats(-20, 20),
    omega=st.floats(-3, 3),
    theta=st.floats(-20, 20),
    fin=st.floats(-3, 3),
)
def test_finite_everywhere(v_x: float, v_y: float, omega: float, theta: float, fin: float) -> None:
    state = {"v_x": v_x, "v_y": v_y, "omega_z": omega, "theta": theta}
    for model in (PLANT, LongitudinalPlane("R1"), LongitudinalPlaneExplicit()):
        assert all(math.isfinite(x) for x in rates(model, state, {"delta_e": fin}).values())
