"""Every measure against the motion of a point of a rigid body, differentiated numerically."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from seatruth.models.measures import GRAVITY, MEASURES, Motion, Water, to_body, to_earth

Vector = NDArray[np.float64]
H = 1e-3
T = 7.3
AT = (2.0, -1.5, 0.7)


def attitude(t: float) -> Rotation:
    """Body to earth axes of a vehicle that rolls, pitches and turns."""
    phi, theta, psi = 0.3 * math.sin(0.7 * t), 0.2 * math.cos(0.5 * t), 0.4 * t + 0.1 * math.sin(t)
    return Rotation.from_euler("ZYX", [psi, theta, phi])


def origin(t: float) -> Vector:
    return np.array([30.0 * math.sin(0.1 * t), 12.0 * math.cos(0.2 * t), 0.5 * t])


def slope(function: Callable[[float], Vector], t: float) -> Vector:
    """Derivative by differences of fourth order."""
    return (8.0 * (function(t + H) - function(t - H)) - (function(t + 2 * H) - function(t - 2 * H))) / (12.0 * H)


def rates(t: float) -> Vector:
    """Angular velocity in body axes."""
    return (attitude(t - H).inv() * attitude(t + H)).as_rotvec() / (2.0 * H)


def body_velocity(t: float) -> Vector:
    return np.asarray(attitude(t).inv().apply(slope(origin, t)))


def motion(t: float) -> Motion:
    psi, theta, phi = attitude(t).as_euler("ZYX")
    parts = (origin(t), [phi, theta, psi], body_velocity(t), rates(t), slope(body_velocity, t), slope(rates, t))
    return Motion(*(float(x) for part in parts for x in part))


def sensor(t: float) -> Vector:
    return origin(t) + attitude(t).apply(AT)


def shown(name: str, water: Water | None = None) -> float:
    return float(MEASURES[name].function(motion(T), water or Water(), AT))


VELOCITY = slope(sensor, T)
ACCELERATION = slope(lambda t: slope(sensor, t), T)
IN_BODY = attitude(T).inv()


def test_positions_are_those_of_the_antenna() -> None:
    assert [shown(name) for name in "xyz"] == pytest.approx(sensor(T).tolist())


def test_velocities_in_earth_axes() -> None:
    assert [shown(name) for name in ("v_n", "v_e", "v_d")] == pytest.approx(VELOCITY.tolist(), abs=1e-5)


def test_velocities_in_body_axes() -> None:
    assert [shown(name) for name in "uvw"] == pytest.approx(IN_BODY.apply(VELOCITY).tolist(), abs=1e-5)


def test_velocities_through_the_water_are_those_over_ground_less_the_water() -> None:
    water = Water(0.3, -0.2, 0.1)
    expected = [a - b for a, b in zip(IN_BODY.apply(VELOCITY), water)]
    assert [shown(name, water) for name in ("u_w", "v_w", "w_w")] == pytest.approx(expected, abs=1e-5)


def test_course_and_speed_over_ground() -> None:
    north, east, _ = VELOCITY
    assert shown("sog") == pytest.approx(math.hypot(north, east), abs=1e-5)
    assert math.remainder(shown("cog") - math.atan2(east, north), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-5)


def test_the_course_turns_on_with_the_heading() -> None:
    ahead = Motion(u=2.0, v=-0.4, psi=5.0 * math.pi)
    assert MEASURES["cog"].function(ahead, Water(), (0.0, 0.0, 0.0)) == pytest.approx(5.0 * math.pi - math.atan(0.2))


def test_accelerations() -> None:
    expected = IN_BODY.apply(ACCELERATION)
    assert [shown(name) for name in ("a_x", "a_y", "a_z")] == pytest.approx(expected.tolist(), abs=1e-3)
    force = IN_BODY.apply(ACCELERATION - np.array([0.0, 0.0, GRAVITY]))
    assert [shown(name) for name in ("f_x", "f_y", "f_z")] == pytest.approx(force.tolist(), abs=1e-3)


def test_an_accelerometer_at_rest_shows_gravity_upwards() -> None:
    at = (1.0, 2.0, 3.0)
    assert MEASURES["f_z"].function(Motion(), Water(), at) == -GRAVITY
    assert MEASURES["f_x"].function(Motion(theta=0.1), Water(), at) == pytest.approx(GRAVITY * math.sin(0.1))


def test_the_axes_turn_back() -> None:
    m = motion(T)
    assert to_body(*to_earth((1.0, -2.0, 3.0), m), m) == pytest.approx((1.0, -2.0, 3.0))


def test_names_and_needs() -> None:
    for name, measure in MEASURES.items():
        assert measure.name == name
        assert measure.title
        assert measure.needs
        assert set(measure.needs) <= set(Motion._fields)
