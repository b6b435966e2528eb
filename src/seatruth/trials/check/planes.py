"""Whether a positive stern plane pitches the nose down.

The weight below the centre of buoyancy rights a vehicle whose plane is held, so that its pitch rate dies away; what
keeps the sign of the plane is the mean pitch rate while the plane is held, beside that of the hold before. A plane that
an autopilot moves against every pitch rate follows it, and tells nothing: there the rate does not come after the plane.
Nor does a movement count that is small beside those of other trials: it is a correction, in waves against each of them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
import scipy.fft

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import Channels, has_channels, make_finding, rate_of
from seatruth.trials.check.steering import agreement_of, by_chance, holds, runs_ahead
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial


def check_planes(trials: Sequence[Trial], model: Channels | None = None) -> Iterator[Finding]:
    """Whether a positive stern plane pitches the nose down, where the plane is moved and then held."""
    for channel in model.inputs if model is not None else ():
        if channel.name == "delta_s" and "nose up" in channel.description.lower():
            return  # the model's own planes
    planes = [trial for trial in trials if has_channels(trial, "delta_s")]
    least = limits.MOVED_PART * max((float(np.ptp(trial.channel("delta_s"))) for trial in planes), default=0.0)
    for trial in planes:
        moves = _moves_of(trial, least)
        agreement = agreement_of(moves)
        if agreement < limits.RUDDER_AGREEMENT or by_chance(-agreement, len(moves)) > limits.RUDDER_CHANCE:
            continue
        yield make_finding(
            trial,
            "warning",
            "plane-sign",
            f"A positive stern plane pitches the nose up: after {len(moves)} movements the pitch has gone that way "
            f"(correlation {agreement:.2f}).",
            "Positive delta_s pitches the nose down in seatruth unless the description of the model's input says that "
            "it pitches the nose up: set sign = -1 for delta_s, or correct the sign of theta and q.",
            channel="delta_s",
        )


def _moves_of(trial: Trial, least: float) -> list[tuple[float, float]]:
    """As `_movements`; none where no pitch is recorded, or where it does not come after the plane."""
    if not (has_channels(trial, "q") or has_channels(trial, "theta")):
        return []
    rate = rate_of(trial, "q", "theta")
    return _movements(trial, rate, least) if _answers(trial.channel("delta_s"), rate) else []


def _answers(plane: Array, rate: Array) -> bool:
    """Whether the pitch rate (n,) is most like the plane (n,) some samples before, not at the time or after."""
    known = np.isfinite(rate)
    if not known.any():
        return False
    rate = np.interp(np.arange(rate.size), np.flatnonzero(known), rate[known])
    length = scipy.fft.next_fast_len(2 * plane.size, real=True)  # by Fourier transforms: logs may be long
    spectra = [scipy.fft.rfft(values - values.mean(), length) for values in (rate, plane)]
    likeness = np.abs(scipy.fft.irfft(spectra[0] * spectra[1].conj(), length))
    lag = int(np.argmax(likeness))
    return 0 < lag < plane.size


def _movements(trial: Trial, rate: Array, least: float) -> list[tuple[float, float]]:
    """(change of the plane, change of the mean pitch rate) from each hold to the next, where the vehicle runs ahead.

    Changes of the plane below `least` rad do not count.
    """
    plane, ahead = trial.channel("delta_s"), runs_ahead(trial)
    found = [
        (hold.level, float(np.nanmean(own)))
        for hold in holds(trial.t, plane)
        if ahead[hold.first : hold.stop].all() and np.isfinite(own := rate[hold.first : hold.stop]).any()
    ]
    changes = [(level - before[0], mean - before[1]) for before, (level, mean) in itertools.pairwise(found)]
    return [(moved, answered) for moved, answered in changes if abs(moved) >= least]
