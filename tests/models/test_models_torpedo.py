"""The torpedo-like vehicle against its check figures, its printed equations and its channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest
from motion import balance, deg, modes, rates
from scipy.optimize import brentq

from seatruth.errors import BadInput
from seatruth.manoeuvres import Manoeuvre, Straight, run_manoeuvre
from seatruth.models import Model, load_model
from seatruth.models.rigid_body import solved
from seatruth.models.torpedo import Torpedo, Torpedo324
from seatruth.models.torpedo_channels import CHANNELS, channel
from seatruth.models.torpedo_parameters import TIES
from seatruth.testing.models import ModelConformance
from seatruth.trials import Trial

FULL = {"T1": (Torpedo("T1"), 1525.0 / 60.0), "T2": (Torpedo324(), 1000.0 / 60.0)}
T1, T2 = FULL["T1"][0], FULL["T2"][0]


class TestTorpedo(ModelConformance):
    @pytest.fixture(params=["T1", "T2"])
    def model(self, request: Any) -> Model:
        return FULL[request.param][0]


class TestChannels(ModelConformance):
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {"u": (0.5, 3.0), "v": (-0.3, 0.3), "w": (-0.3, 0.3)}

    @pytest.fixture(params=list(CHANNELS))
    def model(self, request: Any) -> Model:
        return channel(request.param)


def cruise(name: str) -> dict[str, float]:
    """Steady speed, and the roll at which the propeller's torque is balanced."""
    model, n = FULL[name]
    steady = balance(model, {"u": 2.0}, {"n": n}, ("u",))
    return {**steady, "phi": brentq(lambda phi: rates(model, {**steady, "phi": phi}, {"n": n})["p"], -0.2, 0.2)}


@pytest.mark.parametrize(("name", "speed", "roll"), [("T1", 1.542, 0.50), ("T2", 5.36, 1.26)])
def test_speed_and_roll_trim(name: str, speed: float, roll: float) -> None:
    steady = cruise(name)
    assert steady["u"] == pytest.approx(speed, abs=0.006 if name == "T2" else 0.0006)
    assert math.degrees(steady["phi"]) == pytest.approx(roll, abs=0.006)


@pytest.mark.parametrize(("name", "seconds"), [("T1", 12.6), ("T2", 7.6)])
def test_coast_down_to_half_speed(name: str, seconds: float) -> None:
    model, _ = FULL[name]
    steady = cruise(name)
    trial = run_manoeuvre(model, Straight(20.0), dt=0.05, first_state={"u": steady["u"]}, limit=20.0)
    u = trial.outputs["u"]
    half = float(np.interp(0.5 * u[0], u[::-1], trial.t[::-1]))
    assert half == pytest.approx(seconds, abs=0.06)


def test_modes_of_t1() -> None:
    model, n = FULL["T1"]
    names = ("u", "v", "w", "p", "q", "r", "phi", "theta")
    found = modes(model, cruise("T1"), {"n": n}, names)
    for value in (-4.06, -1.67 + 4.64j, -0.216 + 0.265j):
        assert np.abs(found - value).min() < 0.006, (value, found)
    assert 2 * math.pi / 4.64 == pytest.approx(1.35, abs=0.005)


def test_modes_of_t2() -> None:
    model, n = FULL["T2"]
    names = ("u", "v", "w", "p", "q", "r", "phi", "theta")
    found = modes(model, cruise("T2"), {"n": n}, names)
    assert np.abs(found - (-1.98 + 1.96j)).min() < 0.01
    real = found[np.abs(found.imag) < 1e-9].real
    assert real.max() == pytest.approx(-0.025, abs=0.001)


class Turn(Manoeuvre):
    """Rudder held; the stern plane holds the pitch at zero; roll is left free."""

    def __init__(self, rudder: float) -> None:
        self.rudder = rudder

    @property
    def label(self) -> str:
        return "turn with pitch held"

    def helm(self) -> Any:
        return lambda t, y: {"delta": self.rudder, "delta_s": max(-0.26, min(0.26, 2.0 * y["theta"] + 2.0 * y["q"]))}


@pytest.mark.parametrize(
    ("name", "rudder", "diameter", "beta", "speed"),
    [
        *[("T1", 5.0, 16.9, -5.2, 1.41), ("T1", 10.0, 8.7, -10.0, 1.16), ("T1", 15.0, 6.0, -14.4, 0.96)],
        *[("T2", 5.0, 108.0, -1.7, None), ("T2", 10.0, 54.0, -3.5, None), ("T2", 15.0, 36.0, -5.2, None)],
    ],
)
def test_turning_circle(name: str, rudder: float, diameter: float, beta: float, speed: float | None) -> None:
    model, n = FULL[name]
    run = run_manoeuvre(
        model,
        Turn(deg(rudder)),
        dt=0.1,
        first_state=cruise(name),
        inputs={"n": n},
        rudder_rate=deg(30.0),
        limit=70.0 if name == "T1" else 110.0,
    )
    y = {key: float(values[-1]) for key, values in run.outputs.items()}
    V = math.sqrt(y["u"] ** 2 + y["v"] ** 2 + y["w"] ** 2)
    turn = (run.outputs["psi"][-1] - run.outputs["psi"][-11]) / 1.0
    assert 2.0 * V / turn == pytest.approx(diameter, abs=0.06 if name == "T1" else 0.6)
    assert math.degrees(math.asin(y["v"] / V)) == pytest.approx(beta, abs=0.06)
    if speed is not None:
        assert abs(V - speed) < 0.006


def test_elevator_step_of_t1_settles() -> None:
    """The planes 3 deg up against the fin convention (positive is nose down) pitch the nose up to 15.7 deg."""
    trial = planes_up("T1", 60.0)
    theta = np.degrees(trial.outputs["theta"])
    assert theta[-1] == pytest.approx(15.7, abs=0.06)
    assert theta.max() == pytest.approx(16.8, abs=0.06)
    assert trial.outputs["z"][-1] < trial.outputs["z"][0]


def test_elevator_step_of_t2_pitches_through_the_vertical() -> None:
    assert np.degrees(planes_up("T2", 40.0).outputs["theta"]).max() > 85.0


def planes_up(name: str, seconds: float) -> Trial:
    model, n = FULL[name]

    class Planes(Manoeuvre):
        @property
        def label(self) -> str:
            return "step of the planes"

        def helm(self) -> Any:
            return lambda t, y: None if abs(y["theta"]) > 1.5 else {"delta_s": deg(-3.0)}

    return run_manoeuvre(
        model, Planes(), dt=0.05, first_state=cruise(name), inputs={"n": n}, rudder_rate=deg(30.0), limit=seconds
    )


def printed(name: str, s: Mapping[str, float], i: Mapping[str, float], p: Mapping[str, float]) -> np.ndarray:
    """Accelerations in torpedo axes as the vectors of a rigid body with a fluid's added mass give them, by NumPy."""
    v, w = np.array([s["u"], -s["w"], s["v"]]), np.array([s["p"], -s["r"], s["q"]])
    g, J = np.array([p["x_G"], p["y_G"], p["z_G"]]), np.array([p["J_x"], p["J_y"], p["J_z"]])
    cross = np.array([[0, -g[2], g[1]], [g[2], 0, -g[0]], [-g[1], g[0], 0]])
    M = np.zeros((6, 6))
    M[:3, :3], M[3:, 3:] = p["m"] * np.eye(3), np.diag(J)
    M[:3, 3:], M[3:, :3] = -p["m"] * cross, p["m"] * cross
    M += np.diag([p[f"lambda_{k}{k}"] for k in range(1, 7)])
    M[1, 5] += p["lambda_26"]
    M[5, 1] += p["lambda_26"]
    M[2, 4] += p["lambda_35"]
    M[4, 2] += p["lambda_35"]
    V = np.linalg.norm(v)
    alpha, beta = -math.atan(v[1] / v[0]), math.atan(v[2] / math.hypot(v[0], v[1]))
    q_v = 0.5 * p["rho"] * V**2 * math.pi * p["D"] ** 2 / 4
    rate = w * p["L"] / V
    up = np.array(
        [math.sin(s["theta"]), math.cos(s["theta"]) * math.cos(s["phi"]), -math.cos(s["theta"]) * math.sin(s["phi"])]
    )
    G, n = p["m"] * p["g"], i["n"]
    force = (
        q_v
        * np.array(
            [
                -p["C_x0"],
                p["C_y_alpha"] * alpha + p["C_y_de"] * i["delta_s"] + p["C_y_wz"] * rate[2],
                p["C_z_beta"] * beta + p["C_z_dr"] * i["delta"] + p["C_z_wy"] * rate[1],
            ]
        )
        - p["dG"] * up
    )
    force[0] += p["k_1"] * n + p["k_2"] * n * abs(n)
    moment = q_v * p["L"] * np.array(
        [
            p["m_x_beta"] * beta
            + p["m_x_wx"] * rate[0]
            + p["m_x_wy"] * rate[1]
            + p["m_x_dr"] * i["delta"]
            + p["m_x_dd"] * i["delta_d"],
            p["m_y_beta"] * beta + p["m_y_wy"] * rate[1] + p["m_y_dr"] * i["delta"],
            p["m_z_alpha"] * alpha + p["m_z_wz"] * rate[2] + p["m_z_de"] * i["delta_s"],
        ]
    ) + np.cross(g, -G * up)
    moment[0] += p["k_Q"] * n * abs(n)
    force -= p["m"] * (np.cross(w, v) + np.cross(w, np.cross(w, g)))
    moment -= p["m"] * np.cross(g, np.cross(w, v)) + np.cross(w, J * w)
    return np.linalg.solve(M, np.concatenate([force, moment]))


@pytest.mark.parametrize("name", ["T1", "T2"])
def test_equations_are_those_of_a_rigid_body_in_torpedo_axes(name: str) -> None:
    """With the centre of gravity anywhere, and weight that is not buoyancy; by vectors and a matrix instead of rows."""
    model, n = FULL[name]
    rng = np.random.default_rng(5)
    values = model.nominal() | {"x_G": 0.02, "z_G": -0.01, "dG": 1.5, "J_y": 1.1 * model.nominal()["J_y"]}
    for _ in range(20):
        s = dict(zip((*"uvwpqr", "phi", "theta", "psi"), rng.uniform(-0.4, 0.4, 9).tolist()))
        s["u"] += 1.5
        i = {"delta": 0.1, "delta_s": -0.07, "delta_d": 0.03, "n": n}
        found = rates(model, s, i, values)
        torpedo = [found["u"], -found["w"], found["v"], found["p"], -found["r"], found["q"]]
        assert torpedo == pytest.approx(printed(name, s, i, values), rel=1e-9, abs=1e-11)


def test_kinematics_are_the_marine_ones() -> None:
    s = {"u": 1.2, "v": 0.1, "w": -0.2, "p": 0.1, "q": -0.2, "r": 0.3, "phi": 0.2, "theta": -0.3, "psi": 0.7}
    found = rates(T1, s, {})
    (sf, cf), (st, ct), (sp, cp) = ((math.sin(s[k]), math.cos(s[k])) for k in ("phi", "theta", "psi"))
    C = np.array(
        [
            [cp * ct, cp * st * sf - sp * cf, cp * st * cf + sp * sf],
            [sp * ct, sp * st * sf + cp * cf, sp * st * cf - cp * sf],
            [-st, ct * sf, ct * cf],
        ]
    )
    assert [found[k] for k in "xyz"] == pytest.approx(C @ [s["u"], s["v"], s["w"]])
    assert found["phi"] == pytest.approx(s["p"] + (s["q"] * sf + s["r"] * cf) * st / ct)
    assert found["theta"] == pytest.approx(s["q"] * cf - s["r"] * sf)
    assert found["psi"] == pytest.approx((s["q"] * sf + s["r"] * cf) / ct)


@pytest.mark.parametrize("name", list(CHANNELS))
def test_channel_is_its_part_of_the_coupled_model(name: str) -> None:
    """With all else at rest the channel's rates are those of the coupled model."""
    s = {"forward": {"u": 1.3}, "roll": {"u": 1.3, "p": 0.2, "phi": 0.1}}.get(name, {"u": 1.3})
    s |= {"lateral": {"v": -0.1, "r": 0.2}, "longitudinal": {"w": 0.05, "q": 0.1, "theta": 0.2}}.get(name, {})
    i = {"delta": 0.1 if name in ("roll", "lateral") else 0.0, "delta_s": 0.05 if name == "longitudinal" else 0.0}
    i |= {"n": 20.0 if name == "forward" else 0.0, "delta_d": 0.02 if name == "roll" else 0.0}
    values = T1.nominal() | {"m_x_dr": 0.004}
    if name in ("forward", "lateral"):  # which leave out what the centre of gravity couples them with
        values["y_G"] = 0.0
    full = rates(T1, s, i, values)
    model = channel(name)
    given = i | {
        "u": 1.3,
        "v": 0.0,
        "r": 0.0,
        "theta": 0.0,
        "a_y": full["v"],
        "a_x": full["u"] + s.get("q", 0.0) * s.get("w", 0.0),
    }
    own = {q.name: values[q.name] for q in model.parameters}
    found = rates(model, {key: v for key, v in s.items() if key in {c.name for c in model.states}}, given, own)
    for key, value in found.items():
        assert value == pytest.approx(full[key], rel=1e-6, abs=1e-12), key


def test_forward_channel_has_a_common_factor() -> None:
    """Twice the drag, the thrust and the mass is the same motion."""
    model = channel("forward")
    p = model.nominal()
    twice = (
        p | {q: 2.0 * p[q] for q in ("C_x0", "k_1", "k_2")} | {"lambda_11": 2.0 * (p["m"] + p["lambda_11"]) - p["m"]}
    )
    assert rates(model, {"u": 0.9}, {"n": 20.0}, twice)["u"] == pytest.approx(
        rates(model, {"u": 0.9}, {"n": 20.0})["u"]
    )


@pytest.mark.parametrize("model", [T1, T2])
def test_sets_keep_the_ties_of_a_body_of_revolution(model: Model) -> None:
    values = model.nominal()
    for name, tie in TIES.items():
        other = tie.removeprefix("-")
        assert values[name] == (-values[other] if tie.startswith("-") else values[other])


def test_sets_by_name() -> None:
    assert load_model("torpedo", parameter_set="T2").nominal() == load_model("torpedo_324").nominal()
    with pytest.raises(BadInput, match="T3"):
        Torpedo("T3")
    with pytest.raises(BadInput, match="longitudinal"):
        channel("longitudnal")


def test_solution_of_a_symmetric_system() -> None:
    rng = np.random.default_rng(2)
    A = rng.standard_normal((5, 5))
    A = A @ A.T + np.eye(5)
    b = rng.standard_normal(5)
    assert solved(tuple(map(tuple, A.tolist())), tuple(b.tolist())) == pytest.approx(np.linalg.solve(A, b).tolist())
