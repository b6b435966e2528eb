"""Whether a model moves against its record because an input is turned round, or two thrusters are exchanged.

A fit with the sign of the rudder wrong ends somewhere: with a yaw rate that stays near zero, or with a coefficient at
its bound. What is wrong shows at once in the model itself: turned round, the input makes it move as recorded. The runs
start from the record again and again, so that no error in the values can carry them far away: every few minutes, since
a ship goes on for a minute as it turned when the run began, and where that says nothing, every few seconds.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.effects.undeclared_actuators import drive_inputs, resting_inputs, steering_inputs
from seatruth.errors import SeatruthError
from seatruth.models.actuators import Entry, Thruster, entry
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.text import listed
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial, Trials

_SECONDS = (240.0, 60.0, 15.0)
"""s between two starts from the record: some time constants in yaw and pitch (T of Nomoto's equation) of small
vehicles, of launches and of ships: a second, ten, a minute. Where the longest agree, no others are asked; in shorter
ones a quick vehicle is not carried away. Chosen here [S]."""
_FEWEST_SAMPLES, _MOST_PIECES = 15, 200
_AGREES = 0.5
"""Correlation of simulated and recorded rate from which they agree; below its negative they go opposite ways. Chosen
here [S]."""
_RATES = {"yaw": ("r", "psi"), "pitch": ("q", "theta")}
"""The rate by which a turn is judged, and the angle whose derivative stands for it where it is not recorded."""
_VERBS = {"yaw": "turns", "pitch": "pitches"}
_OPPOSITE = 0.7
"""Correlation below whose negative they go opposite ways, though no input is known that would mend it: half of what the
one does is the other's mirror image. Chosen here [S]."""
_SPEEDS = ("u", "u_w", "sog")
"""The speed by which a drive is judged: the first that the model shows and all trials hold."""
_FAR, _NEAR = 0.3, 0.5
"""Part of its speed by which a vehicle must be missed, and part of that which is left with its drive turned round.
Chosen here [S]: a thrust or a drag that is off by any factor of one sign comes no nearer the wrong way round."""
_LOST = 1e100
"""In SI units; a run that goes so far has diverged, and what is left of it says nothing."""
_SIDES = 0.02
"""Part of a thruster's distance from the middle within which another lies opposite to it."""

Taken = Mapping[str, tuple[str, float]]
Compared = Callable[[str, Taken, float], tuple[Array, Array]]
Change = tuple[str, str, Taken]
"""What is done to the inputs, in words; the axis about which it turns the vehicle; and, for each input that is
changed, the input whose record takes its place, and the sign of that."""


def reversed_inputs(study: EstimationProblem, x: Array | None = None, *, threads: int | None = None) -> list[Finding]:
    """A warning for each input that makes the model move as recorded only if it is turned round or exchanged.

    Args:
        study: the study.
        x: values of its free parameters (K,) or more; None takes the start values.
        threads: threads of a simulation; None for all processors.
    """
    if not isinstance(study.cost, TrajectoryOptions):
        return []
    found, changes, compared = [], _changes(study), partial(_compared, study, x, threads)
    for turns in _RATES:
        about = [(words, change) for words, axis, change in changes if axis == turns]
        channel, lowest = _judged(study.model, study.trials, _RATES[turns]), 0.0
        if channel is None or not study.model.inputs:
            continue
        for seconds in _lengths(study):
            now = _agreement(compared, channel, {}, seconds)
            if now > _AGREES:
                break
            if now >= -_AGREES:
                continue
            lowest = min(lowest, now)
            better = [(words, change, _agreement(compared, channel, change, seconds)) for words, change in about]
            better = [one for one in better if one[2] > _AGREES]
            found += [_finding(study.model, words, turns, change, now, then) for words, change, then in better]
            if better:
                break
        else:
            found += [_opposite_finding(channel, turns, lowest)] if lowest < -_OPPOSITE else []
    return [*found, *_reversed_drives(study, compared)]


def _reversed_drives(study: EstimationProblem, compared: Compared) -> list[Finding]:
    """A warning for the drives that must be turned round for the model to keep the recorded speed."""
    thrusters = [one.input for one in study.model.actuators if isinstance(one, Thruster)]
    names = tuple(dict.fromkeys((*thrusters, *drive_inputs(study.model))))
    channel = _judged(study.model, study.trials, _SPEEDS)
    if not names or channel is None:
        return []
    change = {name: (name, -1.0) for name in names}
    for seconds in _lengths(study):
        try:
            now, size = _missed(compared, channel, {}, seconds)
            if now <= _FAR * size or math.isinf(now):
                return []
            then = _missed(compared, channel, change, seconds)[0]
        except SeatruthError:  # it cannot be simulated so: other findings say why
            return []
        if then < _NEAR * now:
            said = f"the input {names[0]!r}" if len(names) == 1 else f"the inputs {listed([repr(n) for n in names])}"
            return [_drive_finding(study.model, said, names[0], channel, then / now)]
    return []


def _lengths(study: EstimationProblem) -> tuple[float, ...]:
    """s between two starts from the record: of a black box, whose runs may take long, only the longest."""
    return _SECONDS[:1] if isinstance(study.model, BlackBox) else _SECONDS


def _missed(compared: Compared, channel: str, change: Taken, seconds: float) -> tuple[float, float]:
    """Norm of the error of a channel, infinite where a run diverges, and of its record; as `_compared`."""
    simulated, measured = compared(channel, change, seconds)
    if _diverges(simulated):
        return math.inf, float(np.linalg.norm(measured))
    return float(np.linalg.norm(simulated - measured)), float(np.linalg.norm(measured))


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


def _turn_round(model: Model, name: str) -> str:
    """What turns an input round."""
    rest = (resting_inputs(model) or {}).get(name, 0.0)
    offset = f" and offset = {2.0 * rest:g}" if rest else ""
    return f"Set sign = -1{offset} for {name} in [channels], or change the sign of what it does in the model."


def _drive_finding(model: Model, said: str, name: str, channel: str, left: float) -> Finding:
    return Finding(
        "warning",
        "input-reversed",
        f"The model drives the other way than the record. With {said} turned round, it moves as recorded: it then "
        f"misses {channel} by {100 * left:.0f} % of what it misses as it is.",
        "model",
        _turn_round(model, name),
        channel=name,
    )


def _finding(model: Model, words: str, turns: str, change: Taken, now: float, then: float) -> Finding:
    exchanged = any(name != source for name, (source, _) in change.items())
    do = (
        "Exchange their columns in [channels], or correct their places (`at`) in the model."
        if exchanged
        else _turn_round(model, next(iter(change)))
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


def _changes(study: EstimationProblem) -> list[Change]:
    """What can be turned round in a model: each rudder and plane, and thrusters that lie opposite to each other."""
    model = study.model
    found: list[Change] = []
    for turns, kind in (("yaw", "rudder"), ("pitch", "plane")):
        names = dict.fromkeys(steering_inputs(model, kind))
        found += [(f"With the input {name!r} turned round", turns, {name: (name, -1.0)}) for name in names]
    for turns, pairs in (("yaw", _opposite(study, 1) or _unnamed(study)), ("pitch", _opposite(study, 0))):
        change = {name: (other, 1.0) for pair in pairs for name, other in (pair, pair[::-1])}
        if change:
            said = listed([f"{one!r} and {other!r}" for one, other in pairs])
            found.append((f"With the inputs {said} exchanged", turns, change))
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
        alike = np.allclose(towards, others_towards) and abs(towards[turning]) > _AGREES
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


def _agreement(compared: Compared, channel: str, change: Taken, seconds: float) -> float:
    """Correlation about zero of a simulated with the recorded rate; 0 where nothing tells, or nothing can be simulated.

    Other findings say why it cannot.
    """
    try:
        simulated, measured = compared(channel, change, seconds)
    except SeatruthError:
        return 0.0
    if _diverges(simulated):
        return 0.0
    size = float(np.sqrt((simulated @ simulated) * (measured @ measured)))
    return float(simulated @ measured) / size if size > 0 else 0.0


def _diverges(simulated: Array) -> bool:
    """Whether a run (n,) goes beyond numbers whose squares can be added up."""
    return bool(np.abs(simulated).max(initial=0.0) > _LOST)


def _compared(
    study: EstimationProblem, x: Array | None, threads: int | None, channel: str, change: Taken, seconds: float
) -> tuple[Array, Array]:
    """A channel (n,) as simulated and as recorded, in pieces of so many seconds; of an angle its change over each."""
    resting = resting_inputs(study.model) or {}
    pieces = [piece for trial in study.trials for piece in _pieces(_changed(trial, change, resting), seconds)]
    if not pieces:
        return np.zeros(0), np.zeros(0)
    options: Any = study.cost
    plain = options.replace(segments=None, multiple_shooting=False, initial="fixed", initial_sd={})
    cost: StudyCost = cost_of(study.replace(trials=Trials(pieces[:_MOST_PIECES]), cost=plain), threads=threads)
    column = [one.name for one in study.model.outputs].index(channel)
    at = np.clip(cost.start if x is None else x[: len(cost.start)], *cost.bounds)
    pairs = [
        (_rate(y[:, column], channel), _rate(piece.outputs[channel], channel))
        for piece, y in zip(cost.trials, cost.predict(at))
    ]
    simulated, measured = (np.concatenate(part) for part in zip(*pairs))
    good = np.isfinite(simulated) & np.isfinite(measured)
    return simulated[good], measured[good]


def _judged(model: Model, trials: Sequence[Trial], names: Sequence[str]) -> str | None:
    """The first of these channels that the model shows and all trials hold."""
    shown = {channel.name for channel in model.outputs}
    for name in names:
        if name in shown and all(name in t.outputs and np.isfinite(t.outputs[name]).any() for t in trials):
            return name
    return None


def _changed(trial: Trial, change: Mapping[str, tuple[str, float]], resting: Mapping[str, float]) -> Trial:
    """The trial with inputs exchanged, or turned round about the value at which they rest."""
    inputs = {
        name: trial.inputs[source] if sign > 0.0 else 2.0 * resting.get(name, 0.0) - trial.inputs[source]
        for name, (source, sign) in change.items()
        if source in trial.inputs
    }
    return replace(trial, inputs={**trial.inputs, **inputs})


def _pieces(trial: Trial, seconds: float) -> list[Trial]:
    """The trial in pieces of so many seconds, however long its gaps are."""
    turns = np.floor((trial.t - trial.t[0]) / seconds)
    edges = [0, *(np.flatnonzero(np.diff(turns)) + 1).tolist(), len(trial)]
    return [
        trial.section(first, stop, f"{trial.name} {number}")
        for number, (first, stop) in enumerate(itertools.pairwise(edges))
        if stop - first >= _FEWEST_SAMPLES
    ]


def _rate(values: Array, channel: str) -> Array:
    """A rate (n,); of an angle, its change over the piece so far, which noise hides less than it hides a slope."""
    return values - values[np.argmax(np.isfinite(values))] if channel in ("psi", "theta") else values
