"""Lever arms: a rigid body whose motion is known in closed form, seen from two places."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.trials import Trial, prepare

Array = NDArray[np.float64]
T = np.linspace(0, 20, 2001)
ARM = st.tuples(*[st.floats(-3, 3)] * 3)


def rotation(phi: float, theta: float, psi: float) -> Array:
    """Body to earth, composed from the three elementary turns (not from the formulae under test)."""
    c, s = np.cos, np.sin
    yaw = np.array([[c(psi), -s(psi), 0], [s(psi), c(psi), 0], [0, 0, 1]])
    pitch = np.array([[c(theta), 0, s(theta)], [0, 1, 0], [-s(theta), 0, c(theta)]])
    roll = np.array([[1, 0, 0], [0, c(phi), -s(phi)], [0, s(phi), c(phi)]])
    return np.asarray(yaw @ pitch @ roll)


def body(arm: tuple[float, float, float]) -> tuple[dict[str, Array], dict[str, Array]]:
    """Channels at the origin and at the arm of a body with prescribed position and attitude.

    Velocities and accelerations of the arm's end come from differentiating its position in earth axes analytically:
    the matrices and their derivatives follow from complex steps and nested differences of no formula under test.
    """
    names = ("x", "y", "z", "u", "v", "w", "a_x", "a_y", "a_z")
    origin = {name: np.empty(T.size) for name in names}
    there = {name: np.empty(T.size) for name in names}
    rates = {name: np.empty(T.size) for name in ("phi", "theta", "psi", "p", "q", "r", "p_dot", "q_dot", "r_dot")}
    r = np.array(arm)
    for k, t in enumerate(T):
        place = np.array([2 * t, np.sin(0.3 * t), 5 + np.cos(0.2 * t)])
        velocity = np.array([2, 0.3 * np.cos(0.3 * t), -0.2 * np.sin(0.2 * t)])
        acceleration = np.array([0, -0.09 * np.sin(0.3 * t), -0.04 * np.cos(0.2 * t)])
        angles = np.array([0.2 * np.sin(t), 0.15 * np.cos(0.7 * t), 0.5 * t])
        d = np.array([0.2 * np.cos(t), -0.105 * np.sin(0.7 * t), 0.5])
        dd = np.array([-0.2 * np.sin(t), -0.0735 * np.cos(0.7 * t), 0.0])
        phi, theta, _ = angles
        w = np.array([d[0] - np.sin(theta) * d[2], *_qr(phi, theta, d)])
        w_dot = np.array(
            [
                dd[0] - np.cos(theta) * d[1] * d[2] - np.sin(theta) * dd[2],
                -np.sin(phi) * d[0] * d[1]
                + np.cos(phi) * dd[1]
                + (np.cos(phi) * d[0] * np.cos(theta) - np.sin(phi) * np.sin(theta) * d[1]) * d[2]
                + np.sin(phi) * np.cos(theta) * dd[2],
                -np.cos(phi) * d[0] * d[1]
                - np.sin(phi) * dd[1]
                + (-np.sin(phi) * d[0] * np.cos(theta) - np.cos(phi) * np.sin(theta) * d[1]) * d[2]
                + np.cos(phi) * np.cos(theta) * dd[2],
            ]
        )
        turn = rotation(*angles)
        cross = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        cross_dot = np.array([[0, -w_dot[2], w_dot[1]], [w_dot[2], 0, -w_dot[0]], [-w_dot[1], w_dot[0], 0]])
        for channels, lever in ((origin, np.zeros(3)), (there, r)):
            values = [
                *(place + turn @ lever),
                *(turn.T @ (velocity + turn @ cross @ lever)),
                *(turn.T @ (acceleration + turn @ (cross_dot + cross @ cross) @ lever)),
            ]
            for name, value in zip(names, values, strict=True):
                channels[name][k] = value
        for name, value in zip(rates, [*angles, *w, *w_dot], strict=True):
            rates[name][k] = value
    return {**origin, **rates}, {**there, **rates}


def _qr(phi: float, theta: float, d: Array) -> tuple[float, float]:
    q = np.cos(phi) * d[1] + np.sin(phi) * np.cos(theta) * d[2]
    r = -np.sin(phi) * d[1] + np.cos(phi) * np.cos(theta) * d[2]
    return float(q), float(r)


def test_the_known_motion_is_consistent() -> None:
    """The reference itself: differences of the far point's position are its velocity, and of that its acceleration."""
    _, there = body((1.0, -2.0, 0.5))
    step = T[1] - T[0]
    speed = [np.gradient(there[name], step) for name in ("x", "y", "z")]
    second = [np.gradient(s, step) for s in speed]
    for k in (500, 1500):
        turn = rotation(there["phi"][k], there["theta"][k], there["psi"][k])
        body_speed = turn.T @ np.array([s[k] for s in speed])
        np.testing.assert_allclose(body_speed, [there[n][k] for n in "uvw"], atol=1e-4)
        body_acceleration = turn.T @ np.array([s[k] for s in second])
        np.testing.assert_allclose(body_acceleration, [there[n][k] for n in ("a_x", "a_y", "a_z")], atol=1e-4)


@settings(max_examples=4, deadline=None)
@given(ARM)
def test_six_degrees_of_freedom_round_trip(arm: tuple[float, float, float]) -> None:
    origin, there = body(arm)
    names = ["x", "y", "z", "u", "v", "w", "a_x", "a_y", "a_z"]
    found = prepare.lever_arm(Trial("run", T, {}, there), position=list(arm), channels=names)
    for name in names:
        np.testing.assert_allclose(found.outputs[name], origin[name], rtol=0, atol=1e-10, err_msg=name)


def test_accelerations_without_their_rotational_channels() -> None:
    origin, there = body((1.0, -2.0, 0.5))
    without = {k: v for k, v in there.items() if not k.endswith("_dot")}
    found = prepare.lever_arm(Trial("run", T, {}, without), position=[1.0, -2.0, 0.5], channels=["a_x", "a_y", "a_z"])
    for name in ("a_x", "a_y", "a_z"):
        np.testing.assert_allclose(found.outputs[name], origin[name], atol=1e-5)


def test_a_ship_needs_its_yaw_rate_only() -> None:
    r = 0.1 * np.sin(T)
    run = Trial("run", T, {}, {"u": 0 * T + 1, "v": 0.3 * T, "r": r})
    found = prepare.lever_arm(run, position=[2.0, 0.0, 0.0], channels=["u", "v"])
    np.testing.assert_allclose(found.outputs["u"], 1.0)
    np.testing.assert_allclose(found.outputs["v"], 0.3 * T - 2.0 * r)


def test_what_is_missing_is_refused_unless_told() -> None:
    run = Trial("run", T, {}, {"x": T, "y": 0 * T, "psi": 0.1 * T, "depth": T})
    with pytest.raises(BadInput, match=r"needs 'theta'.*State the place as `at`"):
        prepare.lever_arm(run, position=[2.0, 1.0, 0.0], channels=["x"])
    found = prepare.lever_arm(run, position=[2.0, 1.0, 0.0], channels=["x", "y"], missing="zero")
    np.testing.assert_allclose(found.outputs["x"], T - 2 * np.cos(0.1 * T) + np.sin(0.1 * T))
    assert "phi, theta taken as zero" in found.steps[0].effect
    with pytest.raises(BadInput, match="does not depend"):
        prepare.lever_arm(run, position=[2.0, 1.0, 0.0], channels=["psi"])
    with pytest.raises(BadInput, match="position"):
        prepare.lever_arm(run, position=[2.0], channels=["x"])
