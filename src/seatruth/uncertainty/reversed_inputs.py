"""Whether a model moves against its record because an input is turned round, or two thrusters are exchanged.

A fit with the sign of the rudder wrong ends somewhere: with a yaw rate that stays near zero, or with a coefficient at
its bound. What is wrong shows at once in the model itself: turned round, the input makes it move as recorded. The runs
start from the record again and again, so that no error in the values can carry them far away: every few minutes, since
a ship goes on for a minute as it turned when the run began, and where that says nothing, every few seconds.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.effects.undeclared_actuators import steering_inputs
from seatruth.models.actuators import Entry, Thruster, entry
from seatruth.models.base import Model
from seatruth.text import listed
from seatruth.trials.finding import Finding
from seatruth.uncertainty.input_units import PITCH, input_units
from seatruth.uncertainty.reversed_drives import AGREES, YAW, reversed_drives, turn_round
from seatruth.uncertainty.short_runs import Change, ShortRuns, judged

_RATES = {"yaw": YAW, "pitch": PITCH}
"""The rate by which a turn is judged, and the angle whose change stands for it where it is not recorded."""
_VERBS = {"yaw": "turns", "pitch": "pitches"}
_OPPOSITE = 0.7
"""Correlation below whose negative they go opposite ways, though no input is known that would mend it: half of what the
one does is the other's mirror image. Chosen here [S]."""
_SIDES = 0.02
"""Part of a thruster's distance from the middle within which another lies opposite to it."""

Way = tuple[str, str, Change]
"""What is done to the inputs, in words; the axis about which it turns the vehicle; and the change itself."""


def reversed_inputs(study: EstimationProblem, x: Array | None = None, *, threads: int | None = None) -> list[Finding]:
    """A warning for each input that makes the model move as recorded only if it is turned round or exchanged.

    Where there is none, for each kind of input that does only in another unit (`input_units`).

    Args:
        study: the study.
        x: values of its free parameters (K,) or more; None takes the start values.
        threads: threads of a simulation; None for all processors.
    """
    if not isinstance(study.cost, TrajectoryOptions):
        return []
    runs, changes = ShortRuns(study, x, threads), _changes(study)
    found, drives = [], reversed_drives(runs, _opposite(study, 1) or _unnamed(study))
    for turns in _RATES:
        about = [(words, change) for words, axis, change in changes if axis == turns]
        channel, lowest = judged(study.model, study.trials, _RATES[turns]), 0.0
        if channel is None or not study.model.inputs:
            continue
        for seconds in runs.lengths:
            now = runs.agreement(channel, {}, seconds)
            if now > AGREES:
                break
            if now >= -AGREES:
                continue
            lowest = min(lowest, now)
            better = [(words, change, runs.agreement(channel, change, seconds)) for words, change in about]
            better = [one for one in better if one[2] > AGREES]
            found += [_finding(study.model, words, turns, change, now, then) for words, change, then in better]
            if better:
                break
        else:
            told = turns == "yaw" and bool(drives)
            found += [_opposite_finding(channel, turns, lowest)] if lowest < -_OPPOSITE and not told else []
    return [*found, *drives] or input_units(runs)


def _opposite_finding(channel: str, turns: str, now: float) -> Finding:
    side = "positive to starboard, psi clockwise" if turns == "yaw" else "positive nose up, as theta"
    return Finding(
        "warning",
        "input-reversed",
        f"The model {_VERBS[turns]} the other way than the record: the correlation of its {turns} rate with the record "
        f"is {now:.2f}.",
        "model",
        f"Check the sign of {channel} ({_RATES[turns][0]} is {side}), and of what turns the model: the columns of two "
        "thrusters may be exchanged.",
        channel=channel,
    )


def _finding(model: Model, words: str, turns: str, change: Change, now: float, then: float) -> Finding:
    exchanged = any(name != source for name, (source, _) in change.items())
    do = (
        "Exchange their columns in [channels], or correct their places (`at`) in the model."
        if exchanged
        else turn_round(model, next(iter(change)))
    )
    return Finding(
        "warning",
        "input-reversed",
        f"The model {_VERBS[turns]} the other way than the record. {words}, it moves as "
        f"recorded: the correlation of its {turns} rate with the record is {now:.2f} as it is, and {then:.2f} then.",
        "model",
        do,
        channel="" if exchanged else next(iter(change)),
    )


def _changes(study: EstimationProblem) -> list[Way]:
    """What can be turned round in a model: each rudder and plane, and thrusters ahead and aft of each other."""
    model = study.model
    found: list[Way] = []
    for turns, kind in (("yaw", "rudder"), ("pitch", "plane")):
        names = dict.fromkeys(steering_inputs(model, kind))
        found += [(f"With the input {name!r} turned round", turns, {name: (name, -1.0)}) for name in names]
    pairs = _opposite(study, 0)
    exchanged = {name: (other, 1.0) for pair in pairs for name, other in (pair, pair[::-1])}
    if exchanged:
        said = listed([f"{one!r} and {other!r}" for one, other in pairs])
        found.append((f"With the inputs {said} exchanged", "pitch", exchanged))
    return found


def _opposite(study: EstimationProblem, side: int) -> list[tuple[str, str]]:
    """Inputs of two thrusters that push alike, at opposite places to starboard (1), or ahead and aft (0)."""
    values = _Values({p.name: p.value for p in study.parameters})
    try:
        placed = [
            (one.input, _triple(one.at, values), _triple(one.towards, values))
            for one in study.model.actuators
            if isinstance(one, Thruster)
        ]
    except (KeyError, AttributeError, TypeError, ValueError):
        return []
    turning = 0 if side == 1 else 2  # a thrust ahead turns in yaw, a thrust down in pitch
    found, taken = [], set[str]()
    for (name, at, towards), (other, there, others_towards) in itertools.combinations(placed, 2):
        mirrored = there * np.where(np.arange(3) == side, -1.0, 1.0)
        opposite = abs(at[side]) > 0 and np.abs(at - mirrored).max() <= _SIDES * abs(at[side])
        alike = np.allclose(towards, others_towards) and abs(towards[turning]) > AGREES
        if name != other and not {name, other} & taken and opposite and alike:
            found.append((name, other))
            taken |= {name, other}
    return found


def _unnamed(study: EstimationProblem) -> list[tuple[str, str]]:
    """Two drives without a name that turn the model to opposite sides and do the same otherwise."""
    pairs = []
    for kind in kinds_of_drives(study.model):
        if len(kind) == 2 and not any(isinstance(one, Thruster) for one in study.model.actuators):
            (one, first), (other, second) = kind.items()
            if first["yaw"] * second["yaw"] < 0.0 < first["surge"] * second["surge"]:
                pairs.append((one, other))
    return pairs


def _triple(entries: Sequence[Entry], values: _Values) -> Array:
    return np.array([float(entry(one, values)) for one in entries])


class _Values:
    """Values by name, as attributes."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self.__dict__.update(values)
