"""Kinematics and filters that several effects share."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

G = 9.80665
"""m/s2."""
MIN_TIME_CONSTANT = 0.5
"""s: time constant of a filter whose declared one is zero [S]."""
MAX_STEP = 2.0 * MIN_TIME_CONSTANT
"""s: a Runge-Kutta step of more than 2.78 time constants of a first-order filter diverges."""


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


def filter_rates(value: Any, first: Any, second: Any, tau: Any) -> tuple[Any, Any]:
    """Rates of two first-order filters in a row, each with T = sqrt(tau^2 + MIN_TIME_CONSTANT^2)."""
    T = math.sqrt(tau * tau + MIN_TIME_CONSTANT * MIN_TIME_CONSTANT)
    return (value - first) / T, (first - second) / T


def lagged(value: Any, first: Any, second: Any, tau: Any) -> Any:
    """`value` through 1 / (1 + tau s), from the two filters: exact to s^2, and to
    every order where tau >> MIN_TIME_CONSTANT.
    """
    share = tau / math.sqrt(tau * tau + MIN_TIME_CONSTANT * MIN_TIME_CONSTANT)
    return value - share * (value - first) - share * (1.0 - share) * (value - 2.0 * first + second)


def delayed(value: Any, first: Any, second: Any, tau: Any) -> Any:
    """`value` tau ago, from the two filters: exact to s^2 of exp(-tau s), smooth for any tau."""
    share = tau / math.sqrt(tau * tau + MIN_TIME_CONSTANT * MIN_TIME_CONSTANT)
    return value - share * (value - first) - share * (1.0 - 0.5 * share) * (value - 2.0 * first + second)


def delayed_slowly(value: Any, first: Any, second: Any, tau: Any) -> Any:
    """`value` tau ago, from two filters of time constant MIN_TIME_CONSTANT: exact to s^2 of exp(-tau s).

    For what changes slowly (a position, a heading): where tau is long, quick changes come out too large.
    """
    share = tau / MIN_TIME_CONSTANT
    return value - share * (value - first) - share * (1.0 - 0.5 * share) * (value - 2.0 * first + second)


def clipped(value: Any, limit: Any) -> Any:
    """`value` between -limit and +limit; its derivative at limit = 0 is that from above."""
    return 0.5 * (abs(value + limit) - abs(value - limit))
