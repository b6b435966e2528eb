"""Whether a model moves otherwise than its record because an input is in another unit than is stated.

Units of outputs show in the record itself, by what one is the integral of. What an input is worth only the model knows:
with a rudder in rad that is taken for deg it hardly turns, and a fit makes a weak rudder of it, or a strange hull.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from seatruth.effects.undeclared_actuators import drive_inputs, steering_inputs
from seatruth.models.actuators import Thruster
from seatruth.models.base import Model
from seatruth.text import listed
from seatruth.trials.check.helpers import stated_unit
from seatruth.trials.finding import Finding
from seatruth.uncertainty.reversed_drives import YAW
from seatruth.uncertainty.short_runs import Change, ShortRuns, judged, speed_of
from seatruth.units import to_si

_ALIKE: Mapping[str, tuple[str, ...]] = {"rad": ("rad", "deg"), "rev/s": ("rev/s", "1/min", "rad/s"), "1": ("1", "%")}
"""Units that are taken for each other, by the unit of the channel."""
_FAR = {"yaw": 0.5, "pitch": 0.5, "speed": 0.3}
"""Part of its motion by which a model must miss it. [S] One that does not turn at all misses the whole; a speed is
mostly that with which a run begins."""
_NEAR = {"yaw": 0.4, "pitch": 0.4, "speed": 0.2}
"""Part of what is missed that may be left in the other unit. [S] A rudder, or a thrust, that is off by a part of itself
comes no nearer with one that is six to sixty times as strong, or as weak: of a twin-screw boat that towed a line, whose
drag the model lacks, 0.39 of the speed was left with a sixth of its revolutions; of rpm taken for rev/s, 0.1."""
PITCH = ("q", "theta")
"""The rate by which a pitch is judged, and the angle whose change stands for it where it is not recorded."""


def input_units(runs: ShortRuns) -> list[Finding]:
    """A warning for each kind of input with which a model moves as recorded once it is read in another unit."""
    model, trials = runs.study.model, runs.study.trials
    rates = {"yaw": judged(model, trials, YAW), "pitch": judged(model, trials, PITCH)}
    found = list[Finding]()
    for motion, names in _inputs(model):
        channels = speed_of(model, trials) if motion == "speed" else tuple(filter(None, (rates[motion],)))
        best = min(_better(runs, motion, names, channels), key=lambda one: one[0], default=None) if channels else None
        found += [] if best is None else [best[1]]
    return found


def _inputs(model: Model) -> Iterator[tuple[str, tuple[str, ...]]]:
    """The motion by which inputs are judged, and these."""
    yield "yaw", tuple(dict.fromkeys(steering_inputs(model, "rudder")))
    yield "pitch", tuple(dict.fromkeys(steering_inputs(model, "plane")))
    named = [one.input for one in model.actuators if isinstance(one, Thruster)]
    yield "speed", tuple(dict.fromkeys((*named, *drive_inputs(model))))


def _better(
    runs: ShortRuns, motion: str, names: Sequence[str], channels: Sequence[str]
) -> Iterator[tuple[float, Finding]]:
    """Units in which a model moves as recorded, where it does not as it is: what it misses then, and what to say."""
    units = {channel.name: channel.unit for channel in runs.study.model.inputs}
    own, stated = ({of[name] for name in names} for of in (units, _stated(runs, units)))
    if len(own) != 1 or len(stated) != 1 or not own <= {*_ALIKE}:
        return
    (kept,), (known,) = own, stated
    for seconds in runs.lengths:
        now = runs.missed(channels, {}, seconds)
        if not now.error > _FAR[motion] * now.size:
            return
        # Only now: the table of units takes half a second to load, and nearly every model moves as recorded.
        size = to_si(known, kept).factor
        for unit in _ALIKE[kept]:
            factor = to_si(unit, kept).factor / size
            if math.isclose(factor, 1.0):
                continue  # as it is stated
            change: Change = {name: (name, factor) for name in names}
            then = runs.missed(channels, change, seconds)
            if then.error < _NEAR[motion] * min(now.error, now.size):
                shown = then.error / now.size
                yield shown, _finding(names, motion, channels, (known, unit), now.error / now.size, shown)


def _stated(runs: ShortRuns, units: Mapping[str, str]) -> dict[str, str]:
    """The unit that the study states for each input, else that of the channel."""
    first = runs.study.trials[0]
    return {name: stated_unit(first, name) or unit for name, unit in units.items()}


def _finding(
    names: Sequence[str], motion: str, channels: Sequence[str], units: tuple[str, str], now: float, then: float
) -> Finding:
    inputs = f"input{'s' if len(names) > 1 else ''} {listed([repr(name) for name in names])}"
    what = channels[0] if len(channels) == 1 else "the speed ahead"
    verb = {"yaw": "turns", "pitch": "pitches", "speed": "drives"}[motion]
    missed = "diverges" if math.isinf(now) else f"misses {what} by {100.0 * now:.0f} %"
    return Finding(
        "warning",
        "input-unit",
        f"The model {verb} otherwise than the record: it {missed}. With the {inputs} in {units[1]}, not in {units[0]}, "
        f"it misses {what} by {100.0 * then:.0f} %.",
        "model",
        f"State unit = {units[1]!r} for {listed([*names])} in [channels], or correct what the model makes of "
        f"{'it' if len(names) == 1 else 'them'}.",
        channel=names[0] if len(names) == 1 else "",
    )
