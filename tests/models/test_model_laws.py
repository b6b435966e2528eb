"""Laws that hold whatever the coefficients: mirror images, drifting frames, energy, finite rates everywhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion import deg, rates

from seatruth.manoeuvres import Straight, TurningCircle, Zigzag, run_manoeuvre, steady_current
from seatruth.models import Environment, Model
from seatruth.models.abkowitz import AbkowitzShip
from seatruth.models.diving_plane import DivingPlane
from seatruth.models.mmg import MMGShip

SHIPS = [
    (MMGShip(), {"C_2_minus": 1.6, "gamma_R_minus": 0.64}, {"u": 1.18}, {"n": 11.85}, 0.1),
    (
        AbkowitzShip(),
        dict.fromkeys(("Y_0", "Y_0u", "Y_0uu", "N_0", "N_0u", "N_0uu"), 0.0),
        {"u": 7.7175},
        {},
        0.5,
    ),
]
"""Model, values that make it symmetric, first state, inputs, step."""


@pytest.mark.parametrize("case", SHIPS, ids=lambda case: case[0].name)
def test_mirror_image(case: tuple[Model, dict[str, float], dict[str, float], dict[str, float], float]) -> None:
    model, values, first, inputs, dt = case
    sides = [
        run_manoeuvre(
            model, Zigzag(deg(20), deg(20), side), values, dt=dt, first_state=first, inputs=inputs, limit=300 * dt
        )
        for side in ("starboard", "port")
    ]
    for name, sign in (("x", 1), ("u", 1), ("y", -1), ("psi", -1), ("v", -1), ("r", -1)):
        assert sides[1].outputs[name] == pytest.approx(sign * sides[0].outputs[name], abs=1e-9)


def test_mirror_image_in_the_vertical() -> None:
    model, values = DivingPlane(), {"Z_0": 0.0, "Z_aw": 0.0, "M_aw": 0.0}
    state = {"u": 1.4, "w": 0.05, "q": 0.02, "theta": 0.1}
    one = rates(model, state, {"delta_s": 0.05}, values)
    other = rates(model, {k: v if k == "u" else -v for k, v in state.items()}, {"delta_s": -0.05}, values)
    assert other == pytest.approx({k: v if k in ("u", "x") else -v for k, v in one.items()})


@pytest.mark.parametrize("case", SHIPS, ids=lambda case: case[0].name)
def test_a_steady_current_carries_the_whole_track(case: Any) -> None:
    """Sailed by the same rudder, the track in a current is the track in still water plus the drift, exactly."""
    model, _, first, inputs, dt = case
    speed, direction = 0.3 * first["u"], deg(70)
    plan = TurningCircle(deg(25), deg(200), approach=2)
    still = run_manoeuvre(model, plan, dt=dt, first_state=first, inputs=inputs)
    moved = {"u": first["u"] + speed * math.cos(direction), "v": speed * math.sin(direction)}
    environment = steady_current(speed, direction)
    drifting = run_manoeuvre(model, plan, dt=dt, first_state=moved, inputs=inputs, environment=environment)
    assert len(drifting) == len(still)
    # Runge-Kutta in two frames differs by its own error only.
    assert drifting.outputs["psi"] == pytest.approx(still.outputs["psi"], abs=1e-5)
    size = model.nominal()["L"]
    for name, part in (("x", math.cos(direction)), ("y", math.sin(direction))):
        carried = still.outputs[name] + speed * part * still.t
        assert drifting.outputs[name] == pytest.approx(carried, abs=1e-4 * size)


def test_a_current_carries_the_diving_vehicle() -> None:
    model, speed, dip = DivingPlane(), 0.2, 0.6

    def environment(t: float, s: Any) -> Environment:
        u_c, w_c = speed * math.cos(s.theta + dip), speed * math.sin(s.theta + dip)
        return Environment(t=t, u_c=u_c, w_c=w_c, du_c=-s.q * w_c, dw_c=s.q * u_c)

    common: dict[str, Any] = {"dt": 0.2, "inputs": {"delta_s": 0.08}, "limit": 60.0}
    still = run_manoeuvre(model, Straight(60.0), first_state={"u": 1.4}, **common)
    first = {"u": 1.4 + speed * math.cos(dip), "w": speed * math.sin(dip)}
    drifting = run_manoeuvre(model, Straight(60.0), first_state=first, environment=environment, **common)
    assert drifting.outputs["theta"] == pytest.approx(still.outputs["theta"], abs=1e-5)
    assert drifting.outputs["x"] == pytest.approx(still.outputs["x"] + speed * math.cos(dip) * still.t, abs=1e-3)
    assert drifting.outputs["z"] == pytest.approx(still.outputs["z"] + speed * math.sin(dip) * still.t, abs=1e-3)


@pytest.mark.parametrize(("name", "force"), [("u", "X"), ("v", "Y")])
def test_force_acts_on_the_virtual_mass_of_the_ship(name: str, force: str) -> None:
    """At rest, a force through the centre of gravity moves the mass and its added mass."""
    p = MMGShip().nominal()
    values = {"x_G": 1e-12, "J_z": 0.011}
    moved = rates(MMGShip(), {}, {}, values, lambda t, s: Environment(**{force: 100.0}))
    added = p["m_x"] if name == "u" else p["m_y"]
    virtual = p["rho"] * p["nabla"] + 0.5 * p["rho"] * p["L"] ** 2 * p["d"] * added
    assert moved[name] * virtual == pytest.approx(100.0, rel=1e-9)


def test_moment_acts_on_the_virtual_inertia_about_midship() -> None:
    p = MMGShip().nominal()
    moved = rates(MMGShip(), {}, {}, None, lambda t, s: Environment(N=100.0))
    m = p["rho"] * p["nabla"]
    area = 0.5 * p["rho"] * p["L"] ** 2 * p["d"]
    inertia = m * (0.25 * p["L"]) ** 2 + m * p["x_G"] ** 2 + area * p["L"] ** 2 * p["J_z"]
    coupling = m * p["x_G"]
    reduced = inertia - coupling**2 / (m + area * p["m_y"])
    assert moved["r"] * reduced == pytest.approx(100.0, rel=1e-9)


def test_inertia_alone_keeps_its_energy() -> None:
    """Without hull, propeller and rudder forces the kinetic energy of the rigid body with its added mass stays."""
    off: tuple[str, ...] = ("R_0", "X_vv", "X_vr", "X_rr", "X_vvvv", "Y_v", "Y_r", "Y_vvv", "Y_vvr", "Y_vrr", "Y_rrr")
    off += ("N_v", "N_r", "N_vvv", "N_vvr", "N_vrr", "N_rrr", "k_0", "k_1", "k_2", "f_alpha")
    model, p = MMGShip(), MMGShip().nominal()
    # The Munk moment of the added masses belongs to N_v, so equal added masses make the rest conservative.
    values = {**dict.fromkeys(off, 0.0), "m_x": p["m_y"]}
    plan = Straight(100.0)
    trial = run_manoeuvre(model, plan, values, dt=0.1, first_state={"u": 1.0, "v": 0.3, "r": 0.1}, limit=100)
    m = p["rho"] * p["nabla"]
    area = 0.5 * p["rho"] * p["L"] ** 2 * p["d"]
    u, v, r = (trial.outputs[name] for name in ("u", "v", "r"))
    inertia = m * (0.25 * p["L"]) ** 2 + m * p["x_G"] ** 2 + area * p["L"] ** 2 * p["J_z"]
    energy = (m + area * p["m_y"]) * (u**2 + v**2) / 2 + inertia * r**2 / 2 + m * p["x_G"] * v * r
    assert np.ptp(energy) / energy[0] < 1e-6


wide = st.floats(-20, 20)
rate = st.floats(-3, 3)


@settings(max_examples=300, deadline=None)
@given(u=wide, v=wide, r=rate, psi=wide, delta=st.floats(-3, 3), n=st.floats(-100, 100))
def test_ships_are_finite_everywhere(u: float, v: float, r: float, psi: float, delta: float, n: float) -> None:
    state = {"u": u, "v": v, "r": r, "psi": psi}
    inputs = {"n": n, "delta": delta}
    for model in (MMGShip(), MMGShip("ESSO_OSAKA"), AbkowitzShip()):
        assert all(math.isfinite(x) for x in rates(model, state, inputs).values())


@settings(max_examples=200, deadline=None)
@given(u=wide, w=wide, q=rate, theta=wide, plane=st.floats(-3, 3))
def test_diving_plane_is_finite_everywhere(u: float, w: float, q: float, theta: float, plane: float) -> None:
    state = {"u": u, "w": w, "q": q, "theta": theta}
    assert all(math.isfinite(x) for x in rates(DivingPlane(), state, {"delta_s": plane}).values())


@settings(max_examples=300, deadline=None)
@given(speed=st.floats(0, 1e-2), angle=st.floats(-math.pi, math.pi), r=st.floats(-0.01, 0.01), n=st.floats(-15, 15))
def test_forces_on_a_ship_nearly_at_rest_are_continuous(speed: float, angle: float, r: float, n: float) -> None:
    """A small motion changes the rates little: no step where the speed, the yaw rate or the revolutions vanish."""
    state = {"u": speed * math.cos(angle), "v": speed * math.sin(angle), "r": r}
    moving, still = (rates(MMGShip(), s, {"n": n, "delta": 0.3}) for s in (state, {}))
    for name in ("u", "v", "r"):
        assert abs(moving[name] - still[name]) <= 0.2 * (speed + 7 * abs(r))


@settings(max_examples=100, deadline=None)
@given(u=st.floats(-2, 2), n=st.floats(-15, 15))
def test_a_symmetric_ship_keeps_its_course(u: float, n: float) -> None:
    found = rates(MMGShip(), {"u": u}, {"n": n})
    assert found["v"] == 0.0
    assert found["r"] == 0.0
