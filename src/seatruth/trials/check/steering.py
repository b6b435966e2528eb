"""Whether a positive rudder turns the bow to starboard.

A ship in a hard turn loses up to two thirds of its speed, and her yaw rate falls while the rudder stays where it is. No
linear law between rudder, yaw rate and yaw acceleration holds through that, and one fitted to it can have either sign.
What holds for every steered vehicle that runs ahead is plainer: where the rudder has been moved and then held, the yaw
rate at the end of the hold has changed towards the side to which the rudder was moved; and a rudder held hard over
turns the vehicle to its side.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import scipy.special
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import (
    Channels,
    at_all_times,
    degrees,
    filled,
    has_channels,
    integral,
    make_finding,
    rate_of,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial


@dataclass(frozen=True)
class Hold:
    """A stretch in which the rudder stays where it is: first and one past the last sample, and its angle, rad."""

    first: int
    stop: int
    level: float


def check_steering(trial: Trial, model: Channels | None = None) -> Iterator[Finding]:
    """Whether a positive rudder turns to starboard, where the rudder is moved and then held."""
    if not (has_channels(trial, "delta") and (has_channels(trial, "r") or has_channels(trial, "psi"))):
        return
    for channel in model.inputs if model is not None else ():
        if channel.name == "delta" and "port" in channel.description.lower():
            return  # the model's own rudder is positive to port
    said = _against_the_rudder(trial)
    if said:
        yield make_finding(
            trial,
            "warning",
            "rudder-sign",
            f"A positive rudder turns the bow to port: {said}.",
            "Positive delta turns to starboard in seatruth unless the model says otherwise: set sign = -1 for delta, "
            "or correct the sign of r and psi.",
            channel="delta",
        )


def _against_the_rudder(trial: Trial) -> str:
    """How the bow turns against the rudder, in words; empty if it does not, or if the trial cannot tell."""
    delta, ahead = trial.channel("delta"), runs_ahead(trial)
    found = [hold for hold in holds(trial.t, delta) if ahead[hold.first : hold.stop].all()]
    rate, heading = _yaw(trial)
    turned = [
        (hold.level, float(heading[hold.stop - 1] - heading[hold.first]))
        for hold in found
        if abs(hold.level) >= limits.HARD_OVER and np.isfinite(rate[hold.first : hold.stop]).all()
    ]
    with_it = max((change * np.sign(level) for level, change in turned), default=0.0)
    against = max((-change * np.sign(level) for level, change in turned), default=0.0)
    if against > limits.HEADING_COVERAGE and against > 4.0 * with_it:
        return f"the heading changes by {degrees(against)} against a rudder that is held hard over"
    moves = movements(found, delta, rate)
    agreement = agreement_of(moves)
    if agreement > -limits.RUDDER_AGREEMENT or by_chance(agreement, len(moves)) > limits.RUDDER_CHANCE:
        return ""
    return (
        f"after {len(moves)} movements of the rudder the yaw rate has changed the other way (correlation "
        f"{agreement:.2f})"
    )


def agreement_of(moves: list[tuple[float, float]]) -> float:
    """Correlation about zero of the changes of the yaw rate with those of the rudder; 0 without any."""
    moved, answered = np.array(moves, dtype=np.float64).reshape(-1, 2).T
    size = float(np.sqrt((moved @ moved) * (answered @ answered)))
    return float(moved @ answered) / size if size else 0.0


def by_chance(agreement: float, many: int) -> float:
    """Probability of so low a correlation about zero of `many` unrelated pairs (Student's t, many - 1 degrees)."""
    if many < 2:
        return 1.0
    t = agreement * np.sqrt((many - 1) / max(1.0 - agreement**2, 1e-12))
    return float(scipy.special.stdtr(many - 1, t))


def holds(t: Array, delta: Array) -> list[Hold]:
    """Stretches in which the rudder (n,) stays within a tenth of its range, each at least as long as it takes to move.

    A rudder that is moved all the time, as a helmsman or an autopilot in waves does, has none: there the rudder follows
    the bow as much as the bow follows the rudder, and nothing can be read from their agreement.
    """
    steps = np.diff(t)
    if t.size < 3 * limits.HOLD_SAMPLES or not np.isfinite(delta).all():
        return []
    smooth = scipy.ndimage.median_filter(delta, size=limits.HOLD_SAMPLES, mode="nearest")
    span = float(np.ptp(smooth))
    if span < limits.SMALL_ANGLE_INPUT:
        return []
    reach = limits.HOLD_SAMPLES
    fastest = float(np.abs(smooth[reach:] - smooth[:-reach]).max()) / reach
    length = min(max(reach, int(np.ceil(span / fastest))), t.size) if fastest > 0 else reach
    top = scipy.ndimage.maximum_filter1d(smooth, length, mode="nearest")
    bottom = scipy.ndimage.minimum_filter1d(smooth, length, mode="nearest")
    still = top - bottom <= limits.HELD_BAND * span
    still[1:] &= steps <= limits.GAP_STEPS * float(np.median(steps))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    before, after = length // 2, (length - 1) // 2
    found = []
    for first, stop in zip(edges[::2].tolist(), edges[1::2].tolist()):
        first, stop = max(0, first - before), min(t.size, stop + after)
        found.append(Hold(first, stop, float(np.median(smooth[first:stop]))))
    return found


def movements(found: list[Hold], delta: Array, rate: Array) -> list[tuple[float, float]]:
    """(change of the rudder, change of the yaw rate), from the end of one hold to the end of the next.

    Only movements of at least a quarter of the rudder's range count, and only holds in which the yaw rate is known.
    """
    span = float(np.ptp(delta))
    moves = []
    for one, other in itertools.pairwise(found):
        moved = other.level - one.level
        ends = [
            float(np.mean(rate[max(hold.first, hold.stop - limits.HOLD_SAMPLES) : hold.stop])) for hold in (one, other)
        ]
        if abs(moved) >= limits.MOVED_PART * span and np.isfinite(ends).all():
            moves.append((moved, ends[1] - ends[0]))
    return moves


def runs_ahead(trial: Trial) -> NDArray[np.bool_]:
    """Where the vehicle runs ahead (n,), as far as the trial tells; rudder and planes work the other way astern."""
    ahead = np.ones(len(trial), dtype=np.bool_)
    if has_channels(trial, "u"):
        u = at_all_times(trial, "u")
        ahead &= ~(u < 0.2 * float(np.nanquantile(np.abs(u), 0.9)))
    if has_channels(trial, "n"):
        ahead &= ~(trial.channel("n") < 0)  # a propeller astern turns the flow at the rudder round
    return ahead


def _yaw(trial: Trial) -> tuple[Array, Array]:
    """Yaw rate and heading (n,), one from the other where it is not recorded."""
    rate = rate_of(trial, "r", "psi")
    return rate, integral(trial.t, rate) if has_channels(trial, "r") else filled(trial, "psi")
