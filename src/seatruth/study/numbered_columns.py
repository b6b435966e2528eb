"""Finds the columns of a numbered family of inputs (pwm_1 to pwm_6) by their numbers: servo1_raw to servo6_raw.

The names of such columns say little: autopilots record what went to each of their outputs. So a family of columns is
taken as a whole or not at all, where as many of them can be the inputs as there are inputs.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatruth.study.column_names import ORDERS
from seatruth.study.infer_columns import FROM_HEADER, InferredColumn, place_in, split_header, unit_fits
from seatruth.trials.channel import Channel
from seatruth.units import PULSES

Numbers = NDArray[np.float64]
_OUTPUTS = ("servo", "servos", "pwm", "rcou", "rcout", "output", "outputs", "out", "channel", "channels", "ch", "c")
"""Words of an autopilot's outputs, which are pulses, or shares of full command."""
_DRIVES = ("motor", "motors", "mot", "esc", "thruster", "thrusters", "thr", "thrust", "prop", "propeller", "rpm", "rps")
_BESIDE = ("raw", "value", "actuator", "actuators", "control", "controls", "throttle", "speed", "u", "t", "n")
"""Words beside these. Any other one, "current" or "temperature", says that the column is something else."""
_RADIO = frozenset(("rc", "rcin", "manual", "joystick", "stick", "sticks"))
"""Words of topics that hold what a pilot asked for ..."""
_OUT = frozenset(("out", "output", "outputs", "servo", "override"))
"""... unless one of these is beside it."""
_IN_ARRAY = re.compile(r"\[(\d+)\]$")
_NUMBER = re.compile(r"(.*?)(\d+)(\D*)")
_PULSE = (400.0, 2600.0)
"""us: pulses of servos lie between these; an output that is off is recorded as 0."""
_NARROW = (1100.0, 1900.0)
"""us, of speed controllers of underwater thrusters; others take 1000 to 2000. [L] Blue Robotics, Basic ESC."""


_SIDES = ("port", "starboard")
"""In the order in which outputs are taken for them."""


class _Member(NamedTuple):
    number: int
    column: str
    unit: str
    order: bool


def numbered_columns(columns: Mapping[str, Numbers], inputs: Sequence[Channel]) -> dict[str, InferredColumn]:
    """Columns (name to numbers) by input, for each family of numbered inputs of which one family of columns fits best.

    Example:
        >>> import numpy as np
        >>> log = {f"servo{k}_raw": np.array([1500.0, 1600.0]) for k in (1, 2)}
        >>> found = numbered_columns(log, [Channel("pwm_1", "us"), Channel("pwm_2", "us")])
        >>> {name: hit.column for name, hit in found.items()}
        {'pwm_1': 'servo1_raw', 'pwm_2': 'servo2_raw'}
    """
    wanted: dict[tuple[str, str], list[tuple[int, Channel]]] = {}
    for channel in inputs:
        split = _NUMBER.fullmatch(channel.name)
        if split is not None and not split[3].strip("_"):
            wanted.setdefault((split[1].strip("_").lower(), channel.unit), []).append((int(split[2]), channel))
    found: dict[str, InferredColumn] = {}
    for (stem, _), numbered in wanted.items():
        if len(numbered) > 1:
            channels = [channel for _, channel in sorted(numbered, key=lambda pair: pair[0])]
            found |= _best(columns, channels, stem)
    return found


def pulse_columns(columns: Mapping[str, Numbers], inputs: Sequence[Channel]) -> dict[str, InferredColumn]:
    """Columns (name to numbers) of inputs in pulses that are told by their sides, taken in order, port first.

    Autopilots number their outputs. Where one family of columns, or what moves of it, is as many as there are inputs,
    nothing but which of them is which is a guess.

    Example:
        >>> import numpy as np
        >>> log = {name: np.array([1500.0, 1600.0]) for name in ("RCOU.C1", "RCOU.C3")}
        >>> found = pulse_columns(log, [Channel("stbd", "us"), Channel("left", "us")])
        >>> {name: hit.column for name, hit in found.items()}
        {'left': 'RCOU.C1', 'stbd': 'RCOU.C3'}
    """
    sides = {channel.name: place_in(channel.name) or place_in(channel.description) for channel in inputs}
    known_sides = {*sides.values()} == {*_SIDES} and len(inputs) == len(_SIDES)
    if not known_sides or any(channel.unit not in PULSES for channel in inputs):
        return {}
    channels = sorted(inputs, key=lambda channel: _SIDES.index(sides[channel.name]))
    fits = []
    for members in _families(columns, "pwm").values():
        moving = [member for member in members if _moves(columns[member.column])]
        chosen = members if len(members) == len(channels) else moving
        hits = [_taken(member, columns[member.column], one) for member, one in zip(chosen, channels)]
        known = [hit for hit in hits if hit is not None]
        if len(chosen) == len(channels) == len(known):
            fits.append(known)
    why = "guessed by the order of their numbers: check which is port, and which way each turns"
    return {hit.channel: replace(hit, why=why) for hit in fits[0]} if len(fits) == 1 else {}


def _best(columns: Mapping[str, Numbers], channels: Sequence[Channel], stem: str) -> dict[str, InferredColumn]:
    """The columns of one family of inputs; none where no family of columns fits, or two fit alike."""
    fits: dict[int, list[dict[str, InferredColumn]]] = {}
    for (head, tail), members in _families(columns, stem).items():
        chosen = _as_many(members, columns, len(channels))
        hits = [_taken(member, columns[member.column], one) for member, one in zip(chosen, channels)]
        known = [hit for hit in hits if hit is not None]
        if chosen and len(known) == len(channels):
            words = {*f"{head} {tail}".split()}
            # What is called as the input is goes before what a motor did, that before an output, an order last.
            rank = 0 if stem in words else 1 if words & {*_DRIVES} else 2
            fits.setdefault(rank + 3 * known[0].order, []).append({hit.channel: hit for hit in known})
    best = fits[min(fits)] if fits else []
    return best[0] if len(best) == 1 else {}


def _families(columns: Mapping[str, Numbers], stem: str) -> dict[tuple[str, str], list[_Member]]:
    """Columns that differ in a number alone and whose names say that they drive something, by the rest of the name."""
    found: dict[tuple[str, str], list[_Member]] = {}
    known = {stem, *_OUTPUTS, *_DRIVES, *_BESIDE}
    for column in columns:
        topic, _, field = column.strip().rpartition(".")
        name, unit = split_header(_IN_ARRAY.sub(r" \1", field))
        split = _NUMBER.fullmatch(name)
        place = {*re.findall("[a-z]+", topic.lower())}
        if split is None or (place & _RADIO and not place & _OUT):
            continue
        said = f"{split[1]} {split[3]}".split()
        plain = [word for word in said if word not in ORDERS]
        if {*plain} <= known and {stem, *_OUTPUTS, *_DRIVES} & {*plain, *place}:
            member = _Member(int(split[2]), column, unit, plain != said)
            found.setdefault((f"{topic} {split[1]}", split[3]), []).append(member)
    return {key: sorted(members) for key, members in found.items()}


def _as_many(members: Sequence[_Member], columns: Mapping[str, Numbers], count: int) -> Sequence[_Member]:
    """As many members of a family as there are inputs: all, the first ones if no other moves, or those that move."""
    if len(members) <= count:
        return members if len(members) == count else ()
    moving = [member for member in members if _moves(columns[member.column])]
    if {*moving} <= {*members[:count]}:
        return members[:count]
    return moving if len(moving) == count else ()


def _moves(numbers: Numbers) -> bool:
    finite = numbers[np.isfinite(numbers)]
    return bool(finite.size) and float(np.ptp(finite)) > 0.0


def _taken(member: _Member, numbers: Numbers, channel: Channel) -> InferredColumn | None:
    """A column as an input; None where its unit or its numbers cannot be that."""
    by_number = "by its number alone, so check which it is and which way it turns"
    hit = InferredColumn(channel.name, member.column, member.unit, f"{FROM_HEADER}; {by_number}", member.order)
    finite = numbers[np.isfinite(numbers)]
    on = finite[finite != 0.0]
    pulses = bool(on.size) and _PULSE[0] <= float(on.min()) and float(on.max()) <= _PULSE[1]
    command = channel.unit == "1"
    if command and (member.unit in PULSES or (not member.unit and pulses)):
        if not pulses:
            return None
        half = 400.0 if _NARROW[0] <= float(on.min()) and float(on.max()) <= _NARROW[1] else 500.0
        why = f"assumed: {1500 - half:.0f} to {1500 + half:.0f} us are -1 to 1; {by_number}"
        turned = f"scale = {1.0 / half:g}, offset = {-1500.0 / half:g}"
        return InferredColumn(channel.name, member.column, "1", why, member.order, turned)
    if member.unit:
        return hit if unit_fits(member.unit, channel.unit) else None
    if channel.unit in PULSES:
        right = pulses
    elif command:
        right = not finite.size or float(np.abs(finite).max()) <= 1.5
    else:
        right = False  # without a unit, a force or a speed of revolution is known by the names of drives alone
    why = f"assumed; the header has no unit; {by_number}"
    return InferredColumn(channel.name, member.column, channel.unit, why, member.order) if right else None
