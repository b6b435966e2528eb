"""Effects that look back in time through two filters, whose time constant fits the vehicle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from itertools import pairwise
from typing import Any

from seatruth.effects.base import FULL_SIZE, Effect
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.base import Model
from seatruth.models.first_slope import FirstSlope

SLOWEST = 0.5
"""s: time constant of the filters on a ship of full size, whose fastest motion takes several seconds. [S]"""
FASTEST = 0.1
"""s: the shortest one, of small craft, underwater vehicles and models. [S] A delay of 0.08 s of a torpedo's pitch rate,
sampled at 10 Hz, then comes out to 6 % of what it changes; with 0.5 s to 40 %. Shorter ones ask for shorter steps
of integration."""
_STEPS = 2.0
"""Time constants in a step of integration: Runge-Kutta of order 4 diverges at 2.78."""
_POLE = (3.0 + math.sqrt(3.0)) / 6.0
"""Time constant of both filters over the delay, where that is long: with it `delayed` is exact to s^3. It solves
1/6 - c + c^2 = 0, the term in s^3 of exp(-s) (1 + c s)^2, as in S. P. Norsett, BIT 14, 1974."""
_FIRST = 5.0
"""Time constants of the fastest filter over which the slope at the start is taken. [S] What a delay of a few of them
shows of the time before the trial; half a second of a fast vehicle, five samples at 10 Hz."""
_SLOW = ("ship", "glider")
"""Kinds of vehicles that may be slow; other kinds are fast at any size."""


class Filtered(Effect):
    """Base of effects with delays, lags and play: hooks that ask `self.filter_time`.

    Example:
        >>> from seatruth.effects import available
        >>> from seatruth.models import load_model
        >>> delay = available()["rate_delay"]
        >>> delay.filter_time, delay.on(load_model("torpedo")).filter_time
        (0.5, 0.1)
    """

    filter_time: float = SLOWEST
    """s: time constant of a filter where the delay is zero."""
    longest_step = _STEPS * SLOWEST

    def on(self, model: Model) -> Effect:
        """The effect with filters that are as fast as the vehicle: scaled by Froude's rule on ships below 100 m."""
        fitted = copy(self)
        size = dimensions_of(model) if model.kind == "ship" else None
        slow = SLOWEST if size is None else SLOWEST * math.sqrt(min(1.0, size.length / FULL_SIZE))
        fitted.filter_time = max(FASTEST, slow) if model.kind in _SLOW else FASTEST
        fitted.longest_step = _STEPS * fitted.filter_time
        return fitted

    def along(self, output: str, fast: str, *slopes: str) -> dict[str, FirstSlope]:
        """`slopes` of the states of `slope_rates`, which begin on the way on which an output then is."""
        seconds = _FIRST * self.filter_time
        kept = {name: FirstSlope(output, 1.0, seconds) for name in slopes}
        return {fast: FirstSlope(output, -self.filter_time, seconds)} | kept


class DeadTime(Filtered):
    """Base of dead times of actuators: parameter `tau`, of which each of its pairs of filters has its part."""

    in_turn: tuple[tuple[str, str], ...]
    """Names of the states of each pair of filters."""

    def true_inputs(self, i: Any, s: Any, q: Any, e: Any) -> Any:
        value, tau = getattr(i, self.input_name), q.tau / len(self.in_turn)
        for first, second in self.in_turn:
            value = delayed(value, getattr(s, first), getattr(s, second), tau, self.filter_time)
        return i._replace(**{self.input_name: value})

    def rates(self, s: Any, i: Any, p: Any, q: Any, e: Any) -> tuple[Any, ...]:
        value, tau = getattr(i, self.input_name), q.tau / len(self.in_turn)
        rates: list[Any] = []
        for first, second in self.in_turn:
            one, two = getattr(s, first), getattr(s, second)
            rates += delay_rates(value, one, two, tau, self.filter_time)
            value = delayed(value, one, two, tau, self.filter_time)
        return tuple(rates)

    def initial_state(self, y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return tuple(getattr(i, self.input_name) for pair in self.in_turn for _ in pair)


def delay_rates(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> tuple[Any, Any]:
    """Rates of the two filters from which `delayed` takes a value."""
    T = delay_time(tau, filter_time)
    return (value - first) / T, (first - second) / T


def delayed(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> Any:
    """`value` tau ago, from the two filters of `delay_rates`: exact to s^2 of exp(-tau s), smooth for any tau.

    Where tau is long it is exact to s^3.
    """
    share = tau / delay_time(tau, filter_time)
    return value - share * (value - first) - share * (1.0 - 0.5 * share) * (value - 2.0 * first + second)


def lag_time(tau: Any, filter_time: float) -> Any:
    """Time constant of the filters of `lagged`."""
    return math.sqrt(tau * tau + filter_time * filter_time)


def delay_time(tau: Any, filter_time: float) -> Any:
    """Time constant of the filters of a delay: as slow as suits it; as fast as can be where it is early."""
    late = 0.5 * _POLE * (tau + abs(tau))
    return math.sqrt(late * late + filter_time * filter_time)


def slope_rates(value: Any, kept: tuple[Any, ...], T: Any, filter_time: float) -> tuple[Any, ...]:
    """Rates of a value after one filter of time constant `filter_time`, and of its slope after 1 to n of T.

    The slope is what the first filter lags by, over its time. A filter of the value lags, where a trial begins under
    way, by a part that depends on T; one of the slope begins with the slope, whatever T is.

    Args:
        value: of which the filters are, in any unit.
        kept: the states: the value after the first filter, and n slopes, in the same unit per second.
        T: time constant of the n filters, s.
        filter_time: that of the first filter, s.
    """
    fast, *slopes = kept
    rates = [(value - fast) / filter_time]
    for before, after in pairwise((rates[0], *slopes)):
        rates.append((before - after) / T)
    return tuple(rates)


def lagged(value: Any, kept: tuple[Any, ...], tau: Any, filter_time: float) -> Any:
    """`value` through 1 / (1 + tau s), from two filters of its slope: exact to s^2; to every order for a long tau."""
    T = lag_time(tau, filter_time)
    one, two = _slopes(value, kept, T, filter_time)
    return value - tau * (one + (1.0 - tau / T) * (one - two))


def delayed_along(value: Any, kept: tuple[Any, ...], tau: Any, filter_time: float) -> Any:
    """`value` tau ago, from two filters of its slope: as exact as `delayed`, from the first sample of a trial on."""
    T = delay_time(tau, filter_time)
    one, two = _slopes(value, kept, T, filter_time)
    return value - tau * (one + (1.0 - 0.5 * tau / T) * (one - two))


def delayed_twice(position: Any, velocity: Any, kept: tuple[Any, ...], tau: Any, filter_time: float) -> tuple[Any, Any]:
    """A position and its velocity tau ago, or -tau ahead, from four filters of the velocity's slope.

    They are delayed by half of tau twice, each time by H as `delayed_along` does: a planing boat turns by 20 deg within
    a delay. With F a filter of time constant T, and x' = v, it is H^2 x = x + (H + 1) (H - 1) x, and
    (H - 1) x = -tau / 2 (1 + (1 - tau / 4T) (1 - F)) F v; the same holds of a velocity and its slope.
    """
    half, T = 0.5 * tau, delay_time(0.5 * tau, filter_time)
    slopes = _slopes(velocity, kept, T, filter_time)
    velocities = []
    after = velocity
    for slope in slopes:
        after = after - T * slope
        velocities.append(after)
    return position + _twice(velocities, half, T), velocity + _twice(slopes, half, T)


def _twice(rates: Sequence[Any], half: Any, T: Any) -> Any:
    """(H + 1) (H - 1) of what has these rates after one to four filters of time constant T."""
    share = half / T
    second = 1.0 - 0.5 * share
    a, b, c = (one + second * (one - two) for one, two in pairwise(rates))
    return -half * (2.0 * a - share * (a - b) - share * second * (a - 2.0 * b + c))


def _slopes(value: Any, kept: tuple[Any, ...], T: Any, filter_time: float) -> list[Any]:
    """The slope of a value after 1 to n filters of time constant T, without the first filter's lag."""
    fast, *slopes = kept
    part = filter_time / T
    return [after + part * (before - after) for before, after in pairwise(((value - fast) / filter_time, *slopes))]
