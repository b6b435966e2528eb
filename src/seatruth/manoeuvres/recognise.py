"""Recognises manoeuvres in a long recording: turning circles, zigzags, stops and straight runs, and steady stretches.

What the rudder does decides, or the difference of thrusters: where it is held, and to which side it goes next. The
heading confirms it: it goes on turning in a circle and comes back in a zigzag. The definitions are those of
ITTC 7.5-02-06-01 (free-running manoeuvring tests); the thresholds are chosen here [S], wide enough for a helmsman and
his instruments.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.manoeuvres.in_a_model import in_a_model
from seatruth.manoeuvres.recording import (
    PLAY,
    Hold,
    Recording,
    holds,
    means,
    merged,
    noise,
    runs,
    smooth,
)
from seatruth.manoeuvres.slowing import AMIDSHIPS, BEFORE_STOP, COURSE, SLOWED, slowings
from seatruth.models.base import Model
from seatruth.trials.stretches import Stretch, named
from seatruth.trials.trial import Trial

LEAST_TURN_RUDDER = math.radians(4.5)
"""The smallest rudder of a turning circle."""
MOST_TURN_RUDDER = math.radians(75.0)
"""The largest one: flap rudders go to 70 deg. Pods that are turned further push across, and turn the vehicle about."""
LEAST_CIRCLE = math.pi
"""rad: a turn that ends earlier has no tactical diameter."""
LEAST_ZIGZAG_RUDDER = math.radians(2.0)
LEAST_HOLDS = 3
"""Sides of a zigzag: the first execute and two reversals, which give the first overshoot."""
MOST_SWING = math.radians(75.0)
"""A zigzag is reversed before the heading has changed by more (35/35 with its overshoot)."""
ALIKE = 0.35
"""Part by which the sides of a zigzag may differ from their median, in rudder and in heading at the reversals."""
HEADING_SLACK = math.radians(0.25)
"""... or this, whichever is larger: the last digit of a compass. More, and chance makes zigzags of course keeping."""
WINDING = 1.2
"""Way of the heading, there and back, over its change in a turning circle: it goes on turning to one side."""
ON_COURSE = 0.25 * COURSE
"""A straight run begins and ends within this of its usual heading: where it leaves that for good, a turn begins."""
APPROACH = 20.0
"""s before the first order that belong to the manoeuvre, where the vehicle keeps its course: its figures need them."""
SHORTEST = 20.0
"""s: a straight or steady stretch that is shorter is none; an option of the command."""
STOPPED = 0.2
"""Part of the revolutions to which a stop brings them, or below."""
SAME_DRIVE = 0.2
"""Part by which the revolutions may change within a turning circle or a straight run."""
UNDERWAY = 0.2
"""Part of the usual greatest speed above which a vehicle is under way."""


def recognise(log: Trial, *, shortest: float = SHORTEST, model: Model | None = None) -> list[Stretch]:
    """The manoeuvres of a log, in the order of time; no sample belongs to two of them.

    Args:
        log: the recording, in SI units, with delta and psi or delta_s and theta; u, or x and y; n where there is one.
            Where thrusters steer, with their inputs in place of delta and n.
        shortest: the shortest straight run, s.
        model: the model of the vehicle, which knows its thrusters; without one n_port and n_starboard are two.

    Returns:
        Stretches of the kinds "turning circle", "zigzag", "stop" and "straight run"; none where none is recognised.

    Example:
        >>> import math
        >>> from seatruth.manoeuvres import TurningCircle, run_manoeuvre
        >>> from seatruth.models import load_model
        >>> plan = TurningCircle(math.radians(35), math.radians(400))
        >>> log = run_manoeuvre(load_model("mmg"), plan, dt=0.5, first_state={"u": 1.18}, inputs={"n": 11.85})
        >>> [stretch.label for stretch in recognise(log)]
        ['turning circle 35 starboard']
    """
    found: list[Stretch] = []
    for part in in_a_model(log, model):
        taken = np.zeros(part.t.size, dtype=np.bool_)
        for search in (_circles, _zigzags, _stops, slowings):
            for stretch, first, stop in search(part):
                if not taken[first:stop].any():
                    first = _approach(part, first, taken)
                    start, end = part.rows(first, stop)
                    taken[first:stop] = True
                    found.append(Stretch(stretch.kind, stretch.label, start, end, stretch.facts))
        found += _straights(part, taken, shortest)
    return named(found)


Found = list[tuple[Stretch, int, int]]


def _circles(log: Recording) -> Found:
    """Rudder held to one side while the heading changes by half a turn and more."""
    if log.control is None or log.angle is None or log.vertical:
        return []
    found: Found = []
    held = merged(holds(log.t, log.control))
    for k, hold in enumerate(held):
        if abs(hold.level) < LEAST_TURN_RUDDER or (log.by == "rudder" and abs(hold.level) > MOST_TURN_RUDDER):
            continue
        first = held[k - 1].stop - 1 if k and held[k - 1].stop <= hold.first else hold.first
        stop = min(hold.stop, _driven(log, first, hold.stop))
        turned = float(log.angle[stop - 1] - log.angle[first])
        way = float(np.abs(np.diff(smooth(log.angle[first:stop], max(1, (stop - first) // 20)))).sum())
        if turned * math.copysign(1.0, hold.level) < LEAST_CIRCLE or way > WINDING * abs(turned):
            continue
        side = "starboard" if hold.level > 0 else "port"
        label = f"turning circle {log.level(hold.level)} {side}"
        facts = f"{log.control_words(hold.level)}, heading changes by {math.degrees(turned):.0f} deg"
        found.append((Stretch("turning circle", label, 0, 0, facts), first, stop))
    return found


def _driven(log: Recording, first: int, stop: int) -> int:
    """Where the revolutions leave what they were at the first sample, or `stop`."""
    if log.drive is None:
        return stop
    kept = float(log.drive[first])
    off = np.flatnonzero(np.abs(log.drive[first:stop] - kept) > SAME_DRIVE * abs(kept) + 4.0 * noise(log.drive))
    return first + int(off[0]) if off.size else stop


def _zigzags(log: Recording) -> Found:
    """Rudder held to one side and the other by turns, reversed each time at the same change of heading."""
    if log.control is None or log.angle is None:
        return []
    found: Found = []
    held = merged(holds(log.t, log.control))
    k = 0
    while k < len(held):
        last = k
        while last + 1 < len(held) and _opposite(held[last], held[last + 1]):
            last += 1
        chain = held[k : last + 1]
        if len(chain) >= LEAST_HOLDS:
            found += _zigzag(log, held[k - 1] if k else None, chain)
        k = max(last, k + 1)
    return found


def _opposite(one: Hold, other: Hold) -> bool:
    sizes = abs(one.level), abs(other.level)
    return (
        one.level * other.level < 0
        and min(sizes) > LEAST_ZIGZAG_RUDDER
        and abs(sizes[0] - sizes[1]) < max(ALIKE * max(sizes), PLAY)
    )


def _zigzag(log: Recording, before: Hold | None, chain: Sequence[Hold]) -> Found:
    """One zigzag from a chain of holds to alternate sides; without those at its ends that do not belong to it."""
    assert log.angle is not None
    first = before.stop - 1 if before is not None else chain[0].first
    base = float(log.angle[first])
    signs = [math.copysign(1.0, hold.level) for hold in chain]
    switches = [sign * (float(log.angle[hold.stop - 1]) - base) for sign, hold in zip(signs, chain[:-1])]
    usual = float(np.median(switches))
    slack = max(ALIKE * abs(usual), HEADING_SLACK)
    # The heading at a reversal lies on the side to which the rudder was held, and as far out as at the others.
    fits = [abs(switch - usual) <= slack and 0 < switch < MOST_SWING for switch in switches]
    runs = [list(group) for fit, group in itertools.groupby(range(len(fits)), key=lambda j: fits[j]) if fit]
    if not runs:
        return []
    chosen = max(runs, key=len)
    if len(chosen) < LEAST_HOLDS - 1:
        return []
    a, b = chosen[0], chosen[-1] + 1
    start = first if a == 0 else chain[a - 1].stop - 1
    stop = _back(log, chain[b], base, signs[b])
    rudder = float(np.median([abs(hold.level) for hold in chain[a : b + 1]]))
    heading = float(np.median([switches[j] for j in chosen]))
    sides = ("down", "up") if log.vertical else ("starboard", "port")
    side = sides[0] if signs[a] > 0 else sides[1]
    kind = "pitch zigzag" if log.vertical else "zigzag"
    label = f"{kind} {log.level(rudder)}/{abs(round(math.degrees(heading))):g} {side} first"
    swings = "reversals at " + ", ".join(f"{math.degrees(switches[j]):.1f}" for j in chosen[:8])
    return [(Stretch("zigzag", label, 0, 0, f"{log.control_words(rudder)}, {swings} deg"), start, stop)]


def _back(log: Recording, hold: Hold, base: float, sign: float) -> int:
    """The end of the last swing: the rudder is moved, or the heading is further out than a zigzag goes."""
    assert log.angle is not None
    out = sign * (log.angle[hold.first : hold.stop] - base)
    beyond = np.flatnonzero(out > MOST_SWING)
    return hold.first + int(beyond[0]) if beyond.size else hold.stop


def _stops(log: Recording) -> Found:
    """Revolutions brought down to a fifth or astern while the vehicle is under way, until it has slowed down."""
    if log.drive is None or log.speed is None:
        return []
    usual = float(np.quantile(np.abs(log.drive), 0.9))
    speed = smooth(log.speed, 5)
    top = float(np.quantile(np.abs(speed), 0.9))
    ahead = log.drive > 0.5 * usual
    down = log.drive < STOPPED * usual
    found: Found = []
    for first, stop in runs(down):
        before = np.flatnonzero(ahead[:first])
        if not usual or not before.size:
            continue
        order = int(before[-1]) + 1
        begun = float(speed[order - 1])
        slow = np.flatnonzero(speed[first:stop] <= 0.0)
        end = first + int(slow[0]) + 1 if slow.size else stop
        if (
            begun < BEFORE_STOP * top
            or float(speed[first:end].min()) > SLOWED * begun
            or log.t[first] - log.t[order - 1] > APPROACH
        ):
            continue
        if log.control is not None and not log.vertical and _hard_over(log.control[order:end]):
            continue
        astern = float(np.median(log.drive[first:end])) < -0.05 * usual
        label = "crash stop" if astern else "coast-down"
        facts = f"{log.drive_name} {log.drive_words(log.drive[order - 1], float(np.median(log.drive[first:end])))}, "
        facts += f"speed from {begun:.3g} to {speed[end - 1]:.3g} m/s"
        found.append((Stretch("stop", label, 0, 0, facts), order - 1, end))
    return found


def _hard_over(control: Array) -> bool:
    """Whether the rudder is used for more than keeping the course through most of a stretch."""
    return control.size > 0 and float(np.median(np.abs(control))) > 2.0 * AMIDSHIPS


def _straights(log: Recording, taken: NDArray[np.bool_], shortest: float) -> list[Stretch]:
    """Where the rudder stays near amidships, the heading on its course, and the vehicle under way."""
    if log.angle is None or log.speed is None or log.vertical:
        return []
    speed = smooth(log.speed, 5)
    top = float(np.quantile(np.abs(speed), 0.9))
    free = ~taken & (speed > max(UNDERWAY * top, 4.0 * noise(log.speed)))
    if log.control is not None:
        free &= np.abs(scipy.ndimage.median_filter(log.control, size=5, mode="nearest")) <= AMIDSHIPS
    found = []
    for first, stop in runs(free):
        for a, b in _within(log.angle[first:stop], COURSE):
            a, b = _on_course(log.angle, first + a, first + b)
            b = min(b, _driven(log, a, b))
            start, end = log.rows(a, b)
            if end - start >= shortest and not _crabs(log, a, b):
                found.append(Stretch("straight run", "straight run", start, end, means(log, a, b)))
    return found


def _crabs(log: Recording, first: int, stop: int) -> bool:
    """Whether the vehicle goes further to the side than along its bow, as one that is pushed across."""
    if log.ahead is None or log.aside is None:
        return False
    return bool(abs(np.ptp(log.aside[[first, stop - 1]])) > abs(np.ptp(log.ahead[[first, stop - 1]])))


def _on_course(angle: Array, first: int, stop: int) -> tuple[int, int]:
    """A stretch without the turns at its ends: it begins and ends near its usual heading."""
    near = np.flatnonzero(np.abs(angle[first:stop] - np.median(angle[first:stop])) <= ON_COURSE)
    return (first + int(near[0]), first + int(near[-1]) + 1) if near.size else (first, first + 1)


def _within(values: Array, span: float) -> list[tuple[int, int]]:
    """Parts one after another, each as long as it can be while its values stay within `span`, peak to peak."""
    parts = []
    first, low, high = 0, math.inf, -math.inf
    for k, value in enumerate(values.tolist()):
        low, high = min(low, value), max(high, value)
        if high - low > span:
            parts.append((first, k))
            first, low, high = k, value, value
    return [*parts, (first, values.size)]


def _approach(log: Recording, first: int, taken: NDArray[np.bool_]) -> int:
    """The first sample of the approach: on course, rudder near amidships, revolutions as at the first order."""
    start = first
    while start > 0 and not taken[start - 1] and log.t[first] - log.t[start - 1] <= APPROACH:
        k = start - 1
        if log.control is not None and abs(log.control[k]) > AMIDSHIPS:
            break
        if log.angle is not None and abs(log.angle[k] - log.angle[first]) > 0.5 * COURSE:
            break
        if log.drive is not None and abs(log.drive[k] - log.drive[first]) > SAME_DRIVE * abs(log.drive[first]):
            break
        start = k
    return start
