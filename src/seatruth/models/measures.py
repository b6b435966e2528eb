"""What instruments measure, as plain functions of a vehicle's motion: the observation layer's library.

A measure takes the motion at the model's origin, the water's motion in body axes and the place of the sensor, and gives
what an ideal instrument shows there. Rigid-body kinematics: [L] Fossen, Handbook of Marine Craft Hydrodynamics and
Motion Control, 2nd ed., chapter 2. Axes: body x forward, y to starboard, z down; earth north, east, down.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

GRAVITY = 9.80665
"""m/s2: standard gravity, [L] 3rd General Conference on Weights and Measures, 1901."""
_TINY_2 = 1e-12
"""(m/s)^2, added under the root of the speed: keeps its derivative finite at rest, changes nothing else."""


class Motion(NamedTuple):
    """A vehicle's motion at the model's origin; what a model does not have is zero.

    Position m, angles rad, velocity over ground m/s and rates rad/s in body axes, and the rates of change of these six
    (m/s2, rad/s2) as seen in body axes.
    """

    x: Any = 0.0
    y: Any = 0.0
    z: Any = 0.0
    phi: Any = 0.0
    theta: Any = 0.0
    psi: Any = 0.0
    u: Any = 0.0
    v: Any = 0.0
    w: Any = 0.0
    p: Any = 0.0
    q: Any = 0.0
    r: Any = 0.0
    u_dot: Any = 0.0
    v_dot: Any = 0.0
    w_dot: Any = 0.0
    p_dot: Any = 0.0
    q_dot: Any = 0.0
    r_dot: Any = 0.0


class Water(NamedTuple):
    """Velocity of the water over ground in body axes, m/s."""

    u: Any = 0.0
    v: Any = 0.0
    w: Any = 0.0


Place = tuple[float, float, float]
"""Place of a sensor in body axes, m: forward, starboard and down of the model's origin."""
Function = Callable[[Motion, Water, Place], Any]


@dataclass(frozen=True)
class Measure:
    """One quantity that an instrument shows.

    `needs` names the parts of the motion without which it means nothing; those that the model does not have beside
    these are zero (a ship in three degrees of freedom does not roll). `replaces` are the outputs over ground that the
    quantity stands for where a log holds it and not them.
    """

    name: str
    title: str
    unit: str
    function: Function
    needs: tuple[str, ...]
    replaces: tuple[str, ...] = ()
    angle: bool = False
    in_water: bool = False
    """It depends on the water's motion."""
    accelerates: bool = False
    """It depends on accelerations, which only a model's equations give."""
    by_name: bool = True
    """A channel of this name means this measure without further words."""


def velocity_at(m: Motion, at: Place) -> tuple[Any, Any, Any]:
    """Velocity over ground of a point of the body, in body axes, m/s."""
    x, y, z = at
    return m.u + m.q * z - m.r * y, m.v + m.r * x - m.p * z, m.w + m.p * y - m.q * x


def acceleration_at(m: Motion, at: Place) -> tuple[Any, Any, Any]:
    """Acceleration over ground of a point of the body, in body axes, m/s2."""
    x, y, z = at
    p, q, r = m.p, m.q, m.r
    return (
        (m.u_dot + q * m.w - r * m.v) + (m.q_dot * z - m.r_dot * y) + (q * (p * y - q * x) - r * (r * x - p * z)),
        (m.v_dot + r * m.u - p * m.w) + (m.r_dot * x - m.p_dot * z) + (r * (q * z - r * y) - p * (p * y - q * x)),
        (m.w_dot + p * m.v - q * m.u) + (m.p_dot * y - m.q_dot * x) + (p * (r * x - p * z) - q * (q * z - r * y)),
    )


def levelled(vector: tuple[Any, Any, Any], m: Motion) -> tuple[Any, Any, Any]:
    """A vector in body axes as (along the heading, to the right of it, down)."""
    a, b, c = vector
    down = b * math.sin(m.phi) + c * math.cos(m.phi)
    return (
        a * math.cos(m.theta) + down * math.sin(m.theta),
        b * math.cos(m.phi) - c * math.sin(m.phi),
        down * math.cos(m.theta) - a * math.sin(m.theta),
    )


def to_earth(vector: tuple[Any, Any, Any], m: Motion) -> tuple[Any, Any, Any]:
    """A vector in body axes as (north, east, down)."""
    along, across, down = levelled(vector, m)
    return (
        along * math.cos(m.psi) - across * math.sin(m.psi),
        along * math.sin(m.psi) + across * math.cos(m.psi),
        down,
    )


def to_body(north: Any, east: Any, down: Any, m: Motion) -> tuple[Any, Any, Any]:
    """A vector in earth axes as body axes see it: the inverse of `to_earth`."""
    along = north * math.cos(m.psi) + east * math.sin(m.psi)
    across = east * math.cos(m.psi) - north * math.sin(m.psi)
    below = along * math.sin(m.theta) + down * math.cos(m.theta)
    return (
        along * math.cos(m.theta) - down * math.sin(m.theta),
        across * math.cos(m.phi) + below * math.sin(m.phi),
        below * math.cos(m.phi) - across * math.sin(m.phi),
    )


def speed_over_ground(m: Motion, water: Water, at: Place) -> Any:
    """Horizontal speed."""
    along, across, _ = levelled(velocity_at(m, at), m)
    return math.sqrt(along * along + across * across + _TINY_2)


def course_over_ground(m: Motion, water: Water, at: Place) -> Any:
    """Heading plus drift angle: it turns on with the heading and does not jump at north."""
    along, across, _ = levelled(velocity_at(m, at), m)
    return m.psi + math.atan2(across, along)


def _of(function: Callable[[Motion, Place], tuple[Any, Any, Any]], k: int) -> Function:
    """The k-th component of a vector."""

    def component(m: Motion, water: Water, at: Place) -> Any:
        return function(m, at)[k]

    return component


def _through_water(k: int) -> Function:
    def component(m: Motion, water: Water, at: Place) -> Any:
        return velocity_at(m, at)[k] - water[k]

    return component


def _position(m: Motion, at: Place) -> tuple[Any, Any, Any]:
    north, east, down = to_earth(at, m)
    return m.x + north, m.y + east, m.z + down


def _earth_velocity(m: Motion, at: Place) -> tuple[Any, Any, Any]:
    return to_earth(velocity_at(m, at), m)


def specific_force(m: Motion, at: Place) -> tuple[Any, Any, Any]:
    """What an accelerometer shows, in body axes, m/s2: its acceleration without gravity's (-g down at rest)."""
    a, b, c = acceleration_at(m, at)
    x, y, z = to_body(0.0, 0.0, GRAVITY, m)
    return a - x, b - y, c - z


_ALONG = ("forward", "to starboard", "down")
_GROUND = tuple(
    Measure(name, f"velocity over ground in body axes, {way}", "m/s", _of(velocity_at, k), (name,))
    for k, (name, way) in enumerate(zip("uvw", _ALONG))
)
_WATER = tuple(
    Measure(
        f"{name}_w", f"velocity through the water, {way}", "m/s", _through_water(k), (name,), (name,), in_water=True
    )
    for k, (name, way) in enumerate(zip("uvw", _ALONG))
)
_EARTH = tuple(
    Measure(f"v_{way[0]}", f"velocity over ground, {way}", "m/s", _of(_earth_velocity, k), needs, replaces)
    for k, (way, needs, replaces) in enumerate(
        (
            ("north", ("u", "psi"), ("u", "v")),
            ("east", ("u", "psi"), ("u", "v")),
            ("down", ("u", "theta"), ("w",)),
        )
    )
)
_FORCE = tuple(
    Measure(f"f_{axis}", f"specific force (accelerometer, with gravity), {way}", "m/s^2", _of(specific_force, k),
            (name,), accelerates=True)
    for k, (axis, name, way) in enumerate(zip("xyz", "uvw", _ALONG))
)  # fmt: skip
_ACCELERATION = tuple(
    Measure(f"a_{axis}", f"acceleration over ground (gravity removed), {way}", "m/s^2", _of(acceleration_at, k),
            (name,), accelerates=True, by_name=False)
    for k, (axis, name, way) in enumerate(zip("xyz", "uvw", _ALONG))
)  # fmt: skip
_POSITION = tuple(
    Measure(axis, title, "m", _of(_position, k), (axis,))
    for k, (axis, title) in enumerate(
        zip("xyz", ("position of the sensor, north", "position of the sensor, east", "depth of the sensor"))
    )
)
_COURSE = (
    Measure("sog", "speed over ground", "m/s", speed_over_ground, ("u",), ("u", "v")),
    Measure("cog", "course over ground", "rad", course_over_ground, ("u", "psi"), ("u", "v"), angle=True),
)

MEASURES: Mapping[str, Measure] = {
    measure.name: measure for measure in (*_WATER, *_GROUND, *_COURSE, *_EARTH, *_FORCE, *_ACCELERATION, *_POSITION)
}
"""What a channel can measure, by name. Channels of these names mean the same everywhere."""
