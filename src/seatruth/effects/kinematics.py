"""Pieces of equations that several effects share."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

G = 9.80665
"""m/s2."""
QUICKEST = 0.5
"""s: time constant of a follower whose own one is zero."""
LONGEST_STEP = 2.0 * QUICKEST
"""s: a Runge-Kutta step of more than 2.7 time constants diverges."""


class Through(NamedTuple):
    """Velocity through the water (m/s) and rates (rad/s) in body axes; zero where the model has no such state."""

    u: Any
    v: Any
    w: Any
    p: Any
    q: Any
    r: Any


def through_water(s: Any, e: Any) -> Through:
    """The vehicle's motion relative to the water."""
    return Through(
        getattr(s, "u", e.u_c) - e.u_c,
        getattr(s, "v", e.v_c) - e.v_c,
        getattr(s, "w", e.w_c) - e.w_c,
        getattr(s, "p", 0.0),
        getattr(s, "q", 0.0),
        getattr(s, "r", 0.0),
    )


def into_body(north: Any, east: Any, s: Any) -> tuple[Any, Any, Any]:
    """A horizontal vector of the earth in body axes; angles that the model does not have are zero."""
    phi, theta, psi = getattr(s, "phi", 0.0), getattr(s, "theta", 0.0), getattr(s, "psi", 0.0)
    along = north * math.cos(psi) + east * math.sin(psi)
    across = east * math.cos(psi) - north * math.sin(psi)
    up = along * math.sin(theta)
    return (
        along * math.cos(theta),
        across * math.cos(phi) + up * math.sin(phi),
        up * math.cos(phi) - across * math.sin(phi),
    )


def sinking(s: Any) -> Any:
    """Downward velocity over ground, m/s."""
    phi, theta = getattr(s, "phi", 0.0), getattr(s, "theta", 0.0)
    v, w = getattr(s, "v", 0.0), getattr(s, "w", 0.0)
    return (v * math.sin(phi) + w * math.cos(phi)) * math.cos(theta) - getattr(s, "u", 0.0) * math.sin(theta)


def followers(value: Any, first: Any, second: Any, tau: Any) -> tuple[Any, Any]:
    """d/dt of two first-order followers in a row, T = sqrt(tau^2 + QUICKEST^2)."""
    T = math.sqrt(tau * tau + QUICKEST * QUICKEST)
    return (value - first) / T, (first - second) / T


def lagging(value: Any, first: Any, second: Any, tau: Any) -> Any:
    """`value` through 1 / (1 + tau s), from its followers: exact to s^2, and altogether where tau >> QUICKEST."""
    share = tau / math.sqrt(tau * tau + QUICKEST * QUICKEST)
    return value - share * (value - first) - share * (1.0 - share) * (value - 2.0 * first + second)


def delayed(value: Any, first: Any, second: Any, tau: Any) -> Any:
    """`value` tau ago, from its followers: exact to s^2 of exp(-tau s), smooth for any tau."""
    share = tau / math.sqrt(tau * tau + QUICKEST * QUICKEST)
    return value - share * (value - first) - share * (1.0 - 0.5 * share) * (value - 2.0 * first + second)


def behind(value: Any, first: Any, second: Any, tau: Any) -> Any:
    """`value` tau ago, from followers of time constant QUICKEST: exact to s^2 of exp(-tau s).

    For what changes slowly (a position, a heading): where tau is long, quick changes come out too large.
    """
    share = tau / QUICKEST
    return value - share * (value - first) - share * (1.0 - 0.5 * share) * (value - 2.0 * first + second)


def within(value: Any, limit: Any) -> Any:
    """`value` between -limit and +limit; its derivative at limit = 0 is that from above."""
    return 0.5 * (abs(value + limit) - abs(value - limit))
