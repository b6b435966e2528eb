"""Effects that look back in time through two filters, whose time constant fits the vehicle."""

from __future__ import annotations

import math
from copy import copy
from typing import Any

from seatruth.effects.base import FULL_SIZE, Effect
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.base import Model

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


def filter_rates(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> tuple[Any, Any]:
    """Rates of two first-order filters in a row, each with T = sqrt(tau^2 + filter_time^2)."""
    T = math.sqrt(tau * tau + filter_time * filter_time)
    return (value - first) / T, (first - second) / T


def delay_rates(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> tuple[Any, Any]:
    """Rates of the two filters from which `delayed` takes a value."""
    return filter_rates(value, first, second, _POLE * tau, filter_time)


def lagged(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> Any:
    """`value` through 1 / (1 + tau s), from the two filters: exact to s^2, and to every order where tau is long."""
    share = tau / math.sqrt(tau * tau + filter_time * filter_time)
    return value - share * (value - first) - share * (1.0 - share) * (value - 2.0 * first + second)


def delayed(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> Any:
    """`value` tau ago, from the two filters of `delay_rates`: exact to s^2 of exp(-tau s), smooth for any tau.

    Where tau is long it is exact to s^3.
    """
    late = _POLE * tau
    return _looked_back(value, first, second, tau / math.sqrt(late * late + filter_time * filter_time))


def delayed_slowly(value: Any, first: Any, second: Any, tau: Any, filter_time: float) -> Any:
    """`value` tau ago, from two filters of time constant `filter_time`: exact to s^2 of exp(-tau s).

    For what may also be early, and changes slowly (a position, a heading): where tau is long, quick changes come
    out too large.
    """
    return _looked_back(value, first, second, tau / filter_time)


def carried(position: Any, first: Any, second: Any, tau: Any, filter_time: float) -> Any:
    """A position tau ago, or -tau ahead, from the two filters of `carried_rates` of its velocity.

    As exact as `delayed`. The filters hold velocities, which they are at the start whatever tau is; those of a
    position lag it by a way that depends on their time constant, and so on tau.
    """
    share = tau / _late(tau, filter_time)
    return position - tau * (first + (1.0 - 0.5 * share) * (first - second))


def carried_velocity(velocity: Any, first: Any, second: Any, tau: Any, filter_time: float) -> Any:
    """The velocity tau ago, or -tau ahead, from the same two filters."""
    return _looked_back(velocity, first, second, tau / _late(tau, filter_time))


def carried_rates(velocity: Any, first: Any, second: Any, tau: Any, filter_time: float) -> tuple[Any, Any]:
    """Rates of two filters of a velocity, as slow as suits a delay; for what is early, as fast as can be."""
    T = _late(tau, filter_time)
    return (velocity - first) / T, (first - second) / T


def _looked_back(value: Any, first: Any, second: Any, share: Any) -> Any:
    """A value `share` time constants ago, from two filters of it: exact to s^2."""
    return value - share * (value - first) - share * (1.0 - 0.5 * share) * (value - 2.0 * first + second)


def _late(tau: Any, filter_time: float) -> Any:
    late = 0.5 * _POLE * (tau + abs(tau))
    return math.sqrt(late * late + filter_time * filter_time)
