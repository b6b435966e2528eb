"""The servo of an actuator: from its order to what it does, solved exactly.

A servo follows its order o with a first-order lag and a rate limit:

    dz/dt = clip((o - z) / lag, -1 / slowness, 1 / slowness)

z is a rudder's angle or a propeller's revolutions; the slowness is one over the fastest rate, so that both parameters
vanish where the servo does nothing. The order does not depend on the motion, and it is a straight line in each
integration step. So z has a closed form there, of three parts at most: at the limit towards the order; behind it by
the lag; at the limit behind an order that is too fast. Neither a short lag nor a quick one asks for shorter steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

_INSTANT = 1e-13
"""s: added to a lag, which divides; small against rounding of any time. Chosen here [S]."""
_UNLIMITED = 1e-18
"""Added to a slowness, which divides, in s per unit of the input. Chosen here [S]: so small that where a servo has
neither, its order never reaches the limit."""
_TINY = 1e-300
"""Least positive number that divides or has a logarithm."""


@dataclass(frozen=True)
class Servo:
    """The servo in front of an input of a model.

    `input` is the channel, whose record is the order; `state` the model's state that holds what the actuator does.
    `settings(p)` gives the lag (s) and the slowness (s per unit of the input) from the model's parameters.
    """

    input: str
    state: str
    settings: Callable[[Any], tuple[Any, Any]]


def servo_state(channel: str) -> str:
    """Name of the state that holds what the actuator of an input does."""
    return f"{channel}_acting"


def stages(z: Any, order: Any, later: Any, h: Any, lag: Any, slowness: Any) -> tuple[Any, Any, Any]:
    """What the actuator does at the start, the middle and the end of a step of `h` s.

    `z` is where it stands, `order` and `later` are the orders at the start and the end. The value for the start is the
    one with which Simpson's rule, by which a Runge-Kutta step sums its inputs, meets the exact mean over the step: a
    servo that is quicker than the step acts with its true impulse. Where the servo reaches its order within the step,
    this value lies beside the true one. The values at the middle and the end are exact.

    Example:
        >>> from seatruth.models.servo import stages
        >>> [round(x, 3) for x in stages(0.0, 1.0, 1.0, 0.5, lag=0.0, slowness=1.0)]  # one unit a second, half a second
        [0.0, 0.25, 0.5]
    """
    T, R = lag + _INSTANT, 1.0 / (slowness + _UNLIMITED)
    slope = (later - order) / h
    behind, half = _behind(order - z, slope, T, R, 0.5 * h)[0], 0.5 * (order + later)
    at_end, area = _behind(order - z, slope, T, R, h)
    middle, end = half - behind, later - at_end
    mean = half - area / h
    return 6.0 * mean - 4.0 * middle - end, middle, end


def _behind(error: Any, slope: Any, T: Any, R: Any, t: Any) -> tuple[Any, Any]:
    """How far the servo is behind its order after `t` s, and the integral of that, without a branch.

    `error` is the distance at the start, `slope` the rate of the order, `T` the lag, `R` the fastest rate.
    """
    band = T * R
    # At the limit, towards the order, until the lag alone holds it below the limit.
    side = math.copysign(1.0, error)
    t_1 = min(t, max(0.0, abs(error) - band) / max(_TINY, R - side * slope))
    fall = slope - side * R
    e_1 = error + fall * t_1
    area = t_1 * (error + 0.5 * fall * t_1)
    # Behind by the lag; an order faster than the limit takes it out of that band again.
    ahead = math.copysign(1.0, slope)
    left = max(_TINY, min(1.0, (abs(slope) * T - band) / max(_TINY, ahead * (slope * T - e_1))))
    t_2 = min(t - t_1, -T * math.log(left))
    gone = math.exp(-t_2 / T)
    e_2 = slope * T + (e_1 - slope * T) * gone
    area = area + slope * T * t_2 + (e_1 - slope * T) * T * (1.0 - gone)
    # At the limit, behind the order.
    t_3 = t - t_1 - t_2
    rise = ahead * max(0.0, abs(slope) - R)
    return e_2 + rise * t_3, area + t_3 * (e_2 + 0.5 * rise * t_3)
