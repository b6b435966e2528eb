"""Kinematics that several effects share."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

G = 9.80665
"""m/s2."""


class RelativeVelocity(NamedTuple):
    """Velocity relative to the water (m/s) and rates (rad/s) in body axes; zero where the model has no such state."""

    u: Any
    v: Any
    w: Any
    p: Any
    q: Any
    r: Any


def relative_velocity(s: Any, e: Any) -> RelativeVelocity:
    """The vehicle's motion relative to the water."""
    return RelativeVelocity(
        getattr(s, "u", e.u_c) - e.u_c,
        getattr(s, "v", e.v_c) - e.v_c,
        getattr(s, "w", e.w_c) - e.w_c,
        getattr(s, "p", 0.0),
        getattr(s, "q", 0.0),
        getattr(s, "r", 0.0),
    )


def to_body_axes(north: Any, east: Any, s: Any) -> tuple[Any, Any, Any]:
    """A horizontal vector (north, east) in body axes (x, y, z); angles that the model does not have are zero."""
    phi, theta, psi = getattr(s, "phi", 0.0), getattr(s, "theta", 0.0), getattr(s, "psi", 0.0)
    along = north * math.cos(psi) + east * math.sin(psi)
    across = east * math.cos(psi) - north * math.sin(psi)
    up = along * math.sin(theta)
    return (
        along * math.cos(theta),
        across * math.cos(phi) + up * math.sin(phi),
        up * math.cos(phi) - across * math.sin(phi),
    )


def sink_rate(s: Any) -> Any:
    """Downward velocity over ground, m/s."""
    phi, theta = getattr(s, "phi", 0.0), getattr(s, "theta", 0.0)
    v, w = getattr(s, "v", 0.0), getattr(s, "w", 0.0)
    return (v * math.sin(phi) + w * math.cos(phi)) * math.cos(theta) - getattr(s, "u", 0.0) * math.sin(theta)


def clipped(value: Any, limit: Any) -> Any:
    """`value` between -limit and +limit; its derivative at limit = 0 is that from above."""
    return 0.5 * (abs(value + limit) - abs(value - limit))
