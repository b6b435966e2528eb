"""Where a vehicle loses its way on a straight course: coast-downs in which the propeller runs on with the water.

A stop whose revolutions drop at once is recognised by these. A propeller that is left to the water slows down with the
vehicle, and of some logs nothing is known of what drives it: there the speed alone tells. The thresholds are chosen
here [S].
"""

from __future__ import annotations

import math

import numpy as np

from seatruth.arrays import Array
from seatruth.manoeuvres.recording import Recording, noise, smooth
from seatruth.trials.stretches import Stretch

BEFORE_STOP = 0.5
"""Part of the usual greatest speed from which a stop is one; less is berthing."""
SLOWED = 0.6
"""Part of the speed that a stop leaves, or less: it takes two fifths."""
AMIDSHIPS = math.radians(5.0)
"""A rudder within this keeps a course."""
COURSE = math.radians(10.0)
"""The heading stays within this, peak to peak, on a straight run and in the approach."""
_BEGINS = 0.97
"""Part of the speed before at which it is falling."""
_ENDS = 0.01
"""Part of the speed before, above the least, at which it has fallen."""
_EARLIER = 60.0
"""s before the speed falls in which the revolutions do: a large ship is slow to answer."""
_BEYOND_NOISE = 4.0
"""Standard deviations of its noise by which a speed falls at least."""
_WITH_THE_WATER = 0.8
"""Revolutions over speed, both as parts of those before, below which a propeller does not hold the speed. One that the
water turns has about 0.6 of the revolutions that drive the vehicle at the same speed; one that is ordered to run slower
comes back to 1 as the vehicle slows down."""


def slowings(log: Recording) -> list[tuple[Stretch, int, int]]:
    """Falls of the speed by two fifths and more, with the first sample of each and the one after its last."""
    if log.speed is None or log.vertical:
        return []
    speed = smooth(log.speed, 5)
    top = float(np.quantile(np.abs(speed), 0.9))
    found = []
    start = 0
    while (fall := _fall(speed, start, 2.0 * noise(log.speed))) is not None:
        first, start = fall
        stop = start
        lost = float(speed[first] - speed[stop - 1])
        if speed[first] < BEFORE_STOP * top or lost < _BEYOND_NOISE * noise(log.speed) or not _keeps_course(log, *fall):
            continue
        facts = f"speed from {speed[first]:.3g} to {speed[stop - 1]:.3g} m/s"
        if log.drive is not None:
            order = _let_go(log, log.drive, speed, first, stop)
            if order is None:
                continue
            first = order
            facts = f"{log.drive_name} {log.drive_words(log.drive[first], log.drive[stop - 1])}, {facts}"
        found.append((Stretch("stop", "slow-down" if log.drive is None else "coast-down", 0, 0, facts), first, stop))
    return found


def _fall(speed: Array, start: int, slack: float) -> tuple[int, int] | None:
    """The next fall from `start` on: the last sample at the speed before, and the one after that of the least speed."""
    highest = np.maximum.accumulate(speed[start:])
    low = np.flatnonzero((speed[start:] <= SLOWED * highest) & (highest > 0.0))
    if not low.size:
        return None
    down = start + int(low[0])
    before = float(highest[low[0]])
    first = start + int(np.flatnonzero(speed[start:down] >= _BEGINS * before)[-1])
    # It has ended where the speed rises again by what it had to lose to be a stop.
    least = np.minimum.accumulate(speed[down:])
    risen = np.flatnonzero(speed[down:] > least + (1.0 - SLOWED) * before)
    rest = speed[down : down + int(risen[0])] if risen.size else speed[down:]
    near = np.flatnonzero(rest <= float(rest.min()) + max(_ENDS * before, slack))
    return first, down + int(near[0]) + 1


def _keeps_course(log: Recording, first: int, stop: int) -> bool:
    """Whether the vehicle does not turn, which slows it down as well: by its rudder, else by its heading."""
    if log.control is not None:
        return float(np.median(np.abs(log.control[first:stop]))) <= 2.0 * AMIDSHIPS
    return log.angle is not None and float(np.ptp(log.angle[first:stop])) <= COURSE


def _let_go(log: Recording, drive: Array, speed: Array, first: int, stop: int) -> int | None:
    """When the propeller was left to the water, before a fall of the speed; None where it holds the lower speed.

    The revolutions fall before the speed does, and stay below what the speed needs to the end.
    """
    drive = smooth(drive, 5)
    since = int(np.searchsorted(log.t, log.t[first] - _EARLIER))
    before = float(drive[since : first + 1].max())
    half = (first + stop) // 2
    if before <= 0.0:
        return None
    share = drive[half:stop] / before
    if float(np.median(share - _WITH_THE_WATER * speed[half:stop] / speed[first])) > 0.0:
        return None
    return since + int(np.flatnonzero(drive[since : first + 1] >= _BEGINS * before)[-1])
