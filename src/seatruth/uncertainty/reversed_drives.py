"""Which drives must be turned round, or exchanged, for a model to turn and drive as its record.

Two thrusters that are both turned round turn a boat as two that are exchanged do, and one that is turned round neither
turns nor drives it the other way: so each explanation is tried on the yaw rate and on the speed, and the one that mends
both is named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from seatruth.effects.undeclared_actuators import drive_inputs, resting_inputs, steering_inputs
from seatruth.models.actuators import Thruster
from seatruth.models.base import Model
from seatruth.text import listed
from seatruth.trials.finding import Finding
from seatruth.uncertainty.short_runs import Change, Missed, ShortRuns, judged, speed_of

AGREES = 0.5
"""Correlation of simulated and recorded rate from which they agree; below its negative they go opposite ways. Chosen
here [S]."""
YAW = ("r", "psi")
"""The rate by which a turn is judged, and the angle whose change stands for it where it is not recorded."""
_FAR, _NEAR = 0.3, 0.5
"""Part of its speed by which a vehicle must be missed, and part of that which is left with its drive turned round.
Chosen here [S]: a thrust or a drag that is off by any factor of one sign comes no nearer the wrong way round."""
_MOST_ALONE = 8
"""Drives up to which each is tried alone: a run more for each. Chosen here [S]."""

Pairs = Sequence[tuple[str, str]]
Kind = Literal["all", "exchanged", "both", "one"]


@dataclass(frozen=True)
class _Way:
    """One explanation: what is done to the inputs, in words, and what the user does about it."""

    kind: Kind
    words: str
    do: str
    change: Change


@dataclass(frozen=True)
class _Tried:
    """How a model moves: the correlation of its yaw rate, and by how much it misses yaw rate and speed; None for what
    is not recorded."""

    agreement: float | None
    yaw: Missed | None
    speed: Missed | None

    @property
    def opposite(self) -> bool:
        return self.agreement is not None and self.agreement < -AGREES

    @property
    def doubtful(self) -> bool:
        return self.agreement is not None and self.agreement <= AGREES

    @property
    def far(self) -> bool:
        return self.speed is not None and self.speed.error > _FAR * self.speed.size


def turn_round(model: Model, *names: str) -> str:
    """What turns inputs round."""
    rest = (resting_inputs(model) or {}).get(names[0], 0.0)
    command = any(channel.name in names and channel.unit == "1" for channel in model.inputs)
    offset = f" and offset = {2.0 * rest:g}" if rest else " (and turn the sign of its offset, if any)" * command
    what = "what it does" if len(names) == 1 else "what they do"
    return f"Set sign = -1{offset} for {listed([*names])} in [channels], or change the sign of {what} in the model."


def reversed_drives(runs: ShortRuns, pairs: Pairs) -> list[Finding]:
    """A warning for the drives that must be turned round or exchanged for the model to move as recorded.

    Args:
        runs: of the study.
        pairs: inputs of drives to port and to starboard that do the same otherwise.
    """
    model, trials = runs.study.model, runs.study.trials
    named = [one.input for one in model.actuators if isinstance(one, Thruster)]
    drives = tuple(dict.fromkeys((*named, *drive_inputs(model))))
    rate, speed = judged(model, trials, YAW), speed_of(model, trials)
    if not drives or not (speed or rate):
        return []
    ways = _ways(model, drives, pairs, rate is not None)
    # Where a rudder steers, or no pair of drives does, what the drives do to the turn is not theirs alone.
    free = not pairs or bool(steering_inputs(model, "rudder"))

    def tried(change: Change, seconds: float) -> _Tried:
        return _Tried(
            runs.agreement(rate, change, seconds) if rate else None,
            runs.missed((rate,), change, seconds) if rate else None,
            runs.missed(speed, change, seconds) if speed else None,
        )

    for seconds in runs.lengths:
        now = tried({}, seconds)
        if not now.far and not now.doubtful:
            return []
        each = [(way, tried(way.change, seconds)) for way in ways]
        mended = _clearest([(way, then) for way, then in each if _mends(way.kind, now, then, free)])
        if mended:
            return [_finding(mended, now, speed)]
    return []


def _ways(model: Model, drives: Sequence[str], pairs: Pairs, yaws: bool) -> list[_Way]:
    both = {name: (name, -1.0) for name in drives}
    found = [_Way("all", f"{_inputs(drives)} turned round", turn_round(model, *drives), both)]
    if pairs:
        said = listed([f"{one!r} and {other!r}" for one, other in pairs])
        swapped: dict[str, tuple[str, float]] = {a: (b, 1.0) for pair in pairs for a, b in (pair, pair[::-1])}
        exchange = "Exchange their columns in [channels], or correct their places (`at`) in the model."
        found.append(_Way("exchanged", f"the inputs {said} exchanged", exchange, swapped))
        change = {name: (swapped.get(name, (name, 1.0))[0], -1.0) for name in drives}
        do = f"Exchange the columns of {said} in [channels]. {turn_round(model, *drives)}"
        whole = f"{_inputs(drives)} turned round"
        words = f"{whole} and exchanged" if len(drives) == 2 else f"{whole}, and {said} exchanged"
        found.append(_Way("both", words, do, change))
    if yaws and 1 < len(drives) <= _MOST_ALONE:
        found += [
            _Way("one", f"{_inputs([name])} alone turned round", turn_round(model, name), {name: (name, -1.0)})
            for name in drives
        ]
    return found


def _mends(kind: Kind, now: _Tried, then: _Tried, free: bool) -> bool:
    """Whether a model moves as recorded in one way, and not as it is."""
    slower = now.speed is None or then.speed is None or then.speed.error <= max(now.speed.error, _FAR * now.speed.size)
    # A log that is turned by a right angle shows no speed, and any drive that brakes comes nearer to that.
    nearer = (
        now.speed is not None
        and then.speed is not None
        and then.speed.error < min(_NEAR * now.speed.error, then.speed.size)
    )
    if kind == "one":
        # A correlation says nothing on a straight course, where a drive that is turned round shows as a spin.
        turns = now.yaw is not None and then.yaw is not None and then.yaw.error < _NEAR * now.yaw.error
        # A turn that is the record's mirror image is the sign of more than one drive, or of the rate itself.
        return turns and slower and not now.opposite and not then.opposite
    if now.opposite and not free:
        return then.agreement is not None and then.agreement > AGREES and slower
    if kind == "exchanged" and now.opposite:
        return then.agreement is not None and then.agreement > AGREES and slower
    if kind == "exchanged":
        return False
    turned = free or then.agreement is None or not then.doubtful or not (now.agreement or 0.0) > AGREES
    return now.far and nearer and turned and (free or not then.opposite)


def _clearest(mended: list[tuple[_Way, _Tried]]) -> list[tuple[_Way, _Tried]]:
    """Those of several ways that the speed, and then the yaw rate, do not tell from the best one."""
    for tell in ("speed", "yaw"):
        errors = [missed.error for _, then in mended if (missed := getattr(then, tell)) is not None]
        if len(errors) == len(mended) > 1:
            mended = [one for one, error in zip(mended, errors) if error * _NEAR <= min(errors)]
    return mended


def _finding(mended: Sequence[tuple[_Way, _Tried]], now: _Tried, speed: Sequence[str]) -> Finding:
    (way, then), *_ = mended
    verbs = ["turns"] if now.opposite else []
    verbs += ["drives"] if way.kind in ("all", "both") and now.far else []
    told = f"{' and '.join(verbs)} the other way than" if verbs and way.kind != "one" else "moves otherwise than"
    shown = []
    if now.agreement is not None and then.agreement is not None and (now.doubtful or way.kind != "all"):
        shown.append(
            f"the correlation of its yaw rate with the record is {now.agreement:.2f} as it is, and "
            f"{then.agreement:.2f} then"
        )
    if now.speed is not None and then.speed is not None and now.far:
        left = 100.0 * then.speed.error / now.speed.error
        what = speed[0] if len(speed) == 1 else "the speed ahead"
        shown.append(f"it then misses {what} by {left:.0f} % of what it misses as it is")
    words = ", or with ".join(one.words for one, _ in mended)
    each = " Or: ".join(one.do for one, _ in mended)
    do = each if len(mended) == 1 else f"No record tells which: try each. {each}"
    turned = [name for name, (source, _) in way.change.items() if name == source]
    return Finding(
        "warning",
        "input-reversed",
        f"The model {told} the record. With {words}, it moves as recorded: {', and '.join(shown)}.",
        "model",
        do,
        channel=turned[0] if turned and len(mended) == 1 else "",
    )


def _inputs(names: Sequence[str]) -> str:
    return f"the input {names[0]!r}" if len(names) == 1 else f"the inputs {listed([repr(name) for name in names])}"
