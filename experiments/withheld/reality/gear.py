"""The steering gear: from the order to the angle at which the blade acts.

Dead time, a band without effect, play, a servo of second order with a limited rate, then gain and offset of the
linkage. Where a lane has no servo, the blade follows the order at once; where only its rate is limited, as fast as it
can: with a lag of its own such a servo would show a limit that no order reaches, as a lag.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
DAMPING = 0.9
"""Damping ratio of the servo."""
FINEST = 0.05
"""s; the servo's own step is at most this."""
SHORTEST = 0.03
"""s; a servo with a shorter lag counts as none."""
SLOW = 3.6
"""s: what goes with the gear's times shrinks in proportion for a vehicle whose own time (L / U) is shorter."""


class Gear:
    """State of the gears of all lanes.

    `lag` s is the servo's delay of a slow order (2 zeta / omega), `slowness` s/rad one over its largest rate, `dead` s
    the dead time, `band` rad the orders to either side that do nothing, `play` rad half the width of the play, `gain`
    (more than one) and `offset` (rad) those of the linkage; each (lanes,).
    """

    def __init__(self, lanes: int, time: float = SLOW) -> None:
        self._share = min(1.0, time / SLOW)
        self.lag = np.zeros(lanes)
        self.slowness = np.zeros(lanes)
        self.dead = np.zeros(lanes)
        self.play = np.zeros(lanes)
        self.band = np.zeros(lanes)
        self.gain = np.zeros(lanes)
        self.offset = np.zeros(lanes)
        self.actual = np.zeros(lanes)

    def start(self, order: Array) -> Array:
        """Everything at rest at the first order; the acting angle."""
        self.actual = order - np.clip(order, -self.band, self.band)
        self._turning = np.zeros_like(order)
        self._inside = self.actual.copy()
        self._past = [order.copy()]
        has_lag = self.lag >= SHORTEST * self._share
        self._servo = has_lag
        self._limited = ~has_lag & (self.slowness > 0)
        self._omega = 2 * DAMPING / np.where(has_lag, self.lag, 1.0)
        self._rate = 1 / np.maximum(self.slowness, 1e-9)
        return (1 + self.gain) * self.actual + self.offset

    def advance(self, order: Array, h: float) -> Array:
        """One step of `h` s to this order; the acting angle at its end, rad."""
        self._past.append(order.copy())
        wanted = self._delayed(h) if self.dead.any() else order
        wanted = wanted - np.clip(wanted, -self.band, self.band)
        self._inside = np.clip(self._inside, wanted - self.play, wanted + self.play)
        reached = self.actual + np.clip(self._inside - self.actual, -h * self._rate, h * self._rate)
        at_once = np.where(self._limited, reached, self._inside)
        if self._servo.any():
            parts = max(1, math.ceil(h / (FINEST * self._share) - 1e-9))
            for _ in range(parts):
                push = self._omega**2 * (self._inside - self.actual) - 2 * DAMPING * self._omega * self._turning
                self._turning = np.clip(self._turning + push * h / parts, -self._rate, self._rate)
                self.actual = self.actual + self._turning * h / parts
            self.actual = np.where(self._servo, self.actual, at_once)
        else:
            self.actual = at_once
        return (1 + self.gain) * self.actual + self.offset

    def _delayed(self, h: float) -> Array:
        back = self.dead / h
        whole = np.minimum(np.floor(back).astype(int), len(self._past) - 1)
        part = np.where(whole < len(self._past) - 1, back - np.floor(back), 0.0)
        last = len(self._past) - 1
        lanes = np.arange(len(back))
        past = np.stack(self._past[-(2 + int(whole.max())) :])
        shift = last + 1 - len(past)
        near = past[last - whole - shift, lanes]
        far = past[np.maximum(last - whole - 1 - shift, 0), lanes]
        return np.asarray(near + part * (far - near))
