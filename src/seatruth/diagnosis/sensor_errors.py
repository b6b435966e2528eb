"""What an error of a sensor explains of trials left out in the channels of that sensor.

Over all channels it may drown in what a model of another form misses of the others. What a sensor says beside the rest
of the record is another matter: free terms in the equations, the same in all trials, move every channel with the
vehicle, and cannot change what one sensor says of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import ensure
from seatruth.diagnosis.prediction_errors import PredictionErrors, Simulated, noise_deviation
from seatruth.diagnosis.sections import left_out_together
from seatruth.diagnosis.sensor_channels import sensor_channels
from seatruth.text import listed

_MOST = 0.5
"""Part of what free terms leave of its own channels from which it is told what an error of a sensor closes. [S]"""


@dataclass(frozen=True)
class SensorErrors:
    """Errors of a trial left out in a sensor's channels: root mean square in standard deviations of the noise."""

    noise: float
    """What the best fit to all trials leaves there."""
    without: float
    """Free terms in the equations, refitted to the other trials, and no error of the sensor."""
    having: float
    """The same with it."""


def errors_of_sensor(search: Search, name: str, shown: Key) -> list[SensorErrors]:
    """Errors of trials left out in the channels on which an effect acts, with it and without, beside free terms.

    The other effects of the set stand in both. Empty where a fit with terms is missing, or the algebra fails; a trial
    that has none of these channels is left out.
    """
    problem, having = search.problem, search.fits.get((shown, True))
    without = None if having is None else ensure(search, tuple(other for other in shown if other != name), having)
    channels = sensor_channels(problem, name)
    if not channels or having is None or without is None:
        return []
    models = [Simulated.of(problem, fit, terms=True) for fit in (without, having)]
    deviation, found = noise_deviation(problem, search.leader.sizes), list[SensorErrors]()
    for group in left_out_together(problem.trials):
        others = [k for k in range(len(problem.trials)) if k not in group]
        for left in group:
            try:
                errors = PredictionErrors(problem, deviation, left, others, models[0])
                before, after = (errors.of(model, channels) for model in models)
            except np.linalg.LinAlgError:
                return []
            if not math.isnan(before):
                found.append(SensorErrors(errors.noise(search.leader, channels), before, after))
    return found


def closed_of_its_own(errors: Sequence[SensorErrors], channels: Sequence[str]) -> str:
    """What an error of a sensor closes of its own channels in trials left out, where it is most of it; else empty.

    Over all channels it may close nothing. Of an ROV whose positions came 1.0 s late the delay was right to 1 %, and
    closed all that they missed; headings, of which it says nothing, were missed as much as without it.

    Example:
        >>> closed_of_its_own([SensorErrors(1.0, 3.0, 1.1), SensorErrors(1.0, 2.0, 1.0)], ["x", "y"])
        'Of what x and y miss there beside free terms, it closes 97 %.'
    """
    missed = sum(max(0.0, one.without - one.noise) for one in errors)
    closed = sum(one.without - one.having for one in errors)
    if not (missed > 0.0 and closed > _MOST * missed):
        return ""
    verb, part = "misses" if len(channels) == 1 else "miss", 100.0 * min(1.0, closed / missed)
    return f"Of what {listed(channels)} {verb} there beside free terms, it closes {part:.0f} %."
