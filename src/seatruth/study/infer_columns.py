"""Infers which column of a log holds which channel, from its name, its unit and its range.

The study file shows each inference with its reason, so that the user can check it. Names decide first ("rudder",
"yaw rate"); the unit comes from the header ("[deg/s]", "(kn)", "_deg"), else from the range of the numbers.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.study.column_names import (
    ACTED,
    BRIDGE,
    NAMES,
    OF_ANY_THRUSTER,
    ORDERS,
    PLACES,
    SIDES,
    SUFFIXES,
    TOLD_BY_UNIT,
    TWINS,
)
from seatruth.study.column_spellings import AUTOPILOTS, MEANT, other_spellings, spelt_out
from seatruth.trials.channel import Channel
from seatruth.units import is_unit, to_si

_ORDER = 1000
"""Rank of an order behind any column that may say what the actuator did, and of that behind any that does say so."""
_ONE_OF_TWO = 500
"""Rank of a column of one side, or of the mean of both, behind any column of the whole."""
_BRACKETS = re.compile(r"^(.*?)\s*[\[(<{]([^\])>}]*)[\])>}]\s*$")

_NUMBERED = re.compile(r"\[\d+\]$")
"""The number of a sensor among several of its kind, or of a value in an array."""


@dataclass(frozen=True)
class InferredColumn:
    """One column that is taken for a channel: the unit of its numbers, and the reason."""

    channel: str
    column: str
    unit: str
    why: str
    order: bool = False
    """Whether the column's name says that it holds orders."""
    turned: str = ""
    """Keys of the study that turn its numbers into the channel's, beside the unit: "scale = 0.0025, offset = -3.75"."""
    others: tuple[str, ...] = ()
    """Columns of the other sides: the channel is the mean of all."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Every column that the channel is made of."""
        return (self.column, *self.others)


FROM_HEADER = "unit from the header"
"""Why a column has its unit, where its name or header says it."""
VAGUE = frozenset(("speed", "ship speed", "forward speed"))
"""Names of columns that do not say whether the speed is through the water, over ground, or along the bow at all."""
_TOO_LARGE = "numbers up to"
_RUDDER_MOVES = 0.05
"""A rudder that moves by more than this and stays below a quarter turn is in rad: in degrees it would be at rest."""
_SHARE, _PER_CENT = 10.0, 120.0
"""Of an input without a unit, a part of what a drive gives, above which numbers are per cent, and the most that are."""
_WOUND_UP = 130.0
"""rad, 20 turns; more than any manoeuvre turns."""


def infer_columns(
    columns: Mapping[str, NDArray[np.float64]],
    wanted: Sequence[Channel],
    *,
    orders: Collection[str] = (),
    thrusters: Mapping[str, str] | None = None,
) -> dict[str, InferredColumn]:
    """Columns (name to numbers) that match the wanted channels, at most one for each, best match first.

    `orders` are channels whose column may hold orders ("rudder_cmd"); `thrusters` holds the inputs of thrusters with
    their names, "n_port": "port", whose columns are told by the side or the number alone ("rpm_left", "thr_3").
    """
    candidates: list[tuple[int, int, InferredColumn]] = []
    twins: dict[tuple[str, ...], dict[str, tuple[int, int, InferredColumn]]] = {}
    for order, (column, numbers) in enumerate(columns.items()):
        for channel in wanted:
            match = _match(column, numbers, channel)
            if match is None and channel.name in {*orders, *TWINS}:
                hit = _of_actuator(column, numbers, channel)
                if hit is not None and hit.side and channel.name in TWINS:
                    group = twins.setdefault((channel.name, hit.plain, hit.found.unit), {})
                    group.setdefault(hit.side, (hit.rank + _ONE_OF_TWO, order, hit.found))
                elif hit is not None and not hit.side and (channel.name in orders or not hit.found.order):
                    match = hit.rank, hit.found
            if match is None and thrusters and channel.name in thrusters:
                match = _of_thruster(column, numbers, channel, thrusters[channel.name])
            if match is not None:
                candidates.append((match[0], order, match[1]))
    candidates += [_mean(list(group.values())) for group in twins.values() if _is_wanted(group, orders)]
    taken: dict[str, InferredColumn] = {}
    used: set[str] = set()
    for _, _, candidate in sorted(candidates, key=lambda item: item[:2]):
        if candidate.channel not in taken and not used & {*candidate.columns}:
            taken[candidate.channel] = candidate
            used.update(candidate.columns)
    psi, delta = taken.get("psi"), taken.get("delta")
    if psi and delta and psi.why.startswith(_TOO_LARGE) and delta.unit == "rad":
        # In a turning circle the heading exceeds a full turn, so its range does not show the unit: the rudder does.
        moves, top = np.ptp(_finite(columns[delta.column])), np.max(np.abs(_finite(columns[psi.column])))
        if moves > _RUDDER_MOVES and top < _WOUND_UP:
            taken["psi"] = InferredColumn(
                "psi", psi.column, "rad", "assumed, as the rudder is in rad; the header has no unit"
            )
    return taken


def split_header(header: str) -> tuple[str, str]:
    """Name and unit of a header: "yaw rate [deg/s]" -> ("yaw rate", "deg/s"); the unit is "" where it has none."""
    text = header.strip()
    bracket = _BRACKETS.match(text)
    if bracket and (not bracket.group(2).strip() or is_unit(bracket.group(2))):
        return _words(bracket.group(1)), bracket.group(2).strip()
    name, _, end = text.replace(" ", "_").rpartition("_")
    if name and "/" in end and is_unit(end):  # "ROT_deg/min"
        return _words(name), end
    parts = re.split(r"\s*[,;:|/]\s*", text, maxsplit=1)
    if len(parts) == 2 and parts[1] and is_unit(parts[1]):
        return _words(parts[0]), parts[1]
    words = _words(text)
    for length in (3, 2, 1):
        pieces = words.split(" ")
        suffix = " ".join(pieces[-length:])
        if len(pieces) > length and suffix in SUFFIXES:
            return " ".join(pieces[:-length]), SUFFIXES[suffix]
    return words, ""


def _match(column: str, numbers: NDArray[np.float64], channel: Channel) -> tuple[int, InferredColumn] | None:
    """How well a column fits a channel (smaller is better), or None."""
    name, unit = split_header(column)
    known = (*AUTOPILOTS.get(channel.name, ()), *NAMES.get(channel.name, (_words(channel.name),)))
    whole = _words(column)
    words = (name, whole, *_last_parts(column))
    rank = next((known.index(word) for word in words if word in known), None)
    if rank is None:
        rank = next((len(known) + known.index(word) for word in other_spellings(name, channel.name, known)), None)
    meant = next((MEANT[word] for word in words if word in MEANT), channel.name)
    if rank is None or meant != channel.name:
        return None
    if channel.unit == "s" and unit == "m/s":
        unit = "ms"  # "time_ms"
    if unit and not unit_fits(unit, channel.unit):
        if whole not in known:
            return None
        unit = ""  # the end of the channel's own name: of "flow_in", or "u_bar"
    if unit:
        return rank, InferredColumn(channel.name, column, unit, FROM_HEADER)
    if whole in ("rpm", "rps"):
        return rank, InferredColumn(channel.name, column, "rpm" if whole == "rpm" else "rev/s", "unit from the name")
    if name in TOLD_BY_UNIT:
        return None
    if name in BRIDGE and channel.unit == "rad/s":
        return rank, InferredColumn(channel.name, column, "deg/min", "assumed, as bridges log a rate of turn")
    unit, why = _from_range(numbers, channel)
    return rank, InferredColumn(channel.name, column, unit, why)


class _OfActuator(NamedTuple):
    """A column of an actuator: how well it fits, as what, its side ("" for none), and its name without the side."""

    rank: int
    found: InferredColumn
    side: str
    plain: str


def _of_actuator(column: str, numbers: NDArray[np.float64], channel: Channel) -> _OfActuator | None:
    """How a column fits a channel without the words in its name for orders, for what acted, and for a side."""
    words = spelt_out(_words(column)).split(" ")
    sides = [SIDES[word] for word in words if word in SIDES]
    order, acted = (any(word in kind for word in words) for kind in (ORDERS, ACTED))
    plain = " ".join(word for word in words if word not in (*ORDERS, *ACTED, *SIDES))
    if not plain or len(sides) > 1 or plain == " ".join(words):
        return None
    hit = _match(plain, numbers, channel)
    if hit is None:
        return None
    rank = hit[0] + (_ORDER if order else -_ORDER if acted else 0)
    name = " ".join(word for word in words if word not in SIDES)
    return _OfActuator(rank, replace(hit[1], column=column, order=order), sides[0] if sides else "", name)


def _is_wanted(group: Mapping[str, tuple[int, int, InferredColumn]], orders: Collection[str]) -> bool:
    """Whether columns of the sides may be taken: what acted always, orders where the channel may hold them."""
    return all(not found.order or found.channel in orders for _, _, found in group.values())


def _mean(sides: Sequence[tuple[int, int, InferredColumn]]) -> tuple[int, int, InferredColumn]:
    """The columns of both sides as one, whose mean the channel is; the one side where there is no other."""
    rank, place, first = sides[0]
    others = tuple(found.column for _, _, found in sides[1:])
    why = f"{first.why}; mean of both sides" if others else f"{first.why}; of one side"
    return rank, place, replace(first, why=why, others=others)


def _of_thruster(
    column: str, numbers: NDArray[np.float64], channel: Channel, thruster: str
) -> tuple[int, InferredColumn] | None:
    """Whether a column belongs to a thruster, as its side or its number says."""
    words = _words(column).split(" ")
    plain = " ".join(word for word in words if word not in (*ORDERS, *ACTED))
    name, unit = split_header(plain)
    if unit and not unit_fits(unit, channel.unit):
        return None
    which = _which(name)
    if not which or which not in (_which(thruster), _which(channel.name)) or not _names_a_thruster(plain):
        return None
    order = any(word in ORDERS for word in words)
    why = FROM_HEADER
    if not unit:
        unit, why = next(((SUFFIXES[w], why) for w in words if w in ("rpm", "rps")), _from_range(numbers, channel))
    acted = any(word in ACTED for word in words)
    return _ORDER * (order - acted), InferredColumn(channel.name, column, unit, why, order)


def place_in(description: str) -> str:
    """The words of a drive's description that tell it from others: "port propeller" gives "port".

    Example:
        >>> place_in("stbd ESC, us"), place_in("shaft speed")
        ('starboard', '')
    """
    words = [SIDES.get(word, word) for word in _words(description).split(" ")]
    return " ".join(word for word in words if word in PLACES)


def _which(name: str) -> frozenset[str]:
    """What tells a thruster from others: the side, the number, whatever else its name has."""
    words = re.sub(r"(?<=[a-z])(?=[0-9])", " ", _words(name)).split(" ")
    return frozenset(SIDES.get(word, word) for word in words if word and word not in OF_ANY_THRUSTER)


def _names_a_thruster(name: str) -> bool:
    """Whether a word of a column's name is one of thrusters."""
    words = re.sub(r"(?<=[a-z])(?=[0-9])", " ", _words(name)).split(" ")
    return any(word in OF_ANY_THRUSTER for word in words)


def _last_parts(column: str) -> tuple[str, ...]:
    """The field, and the last two parts of it, of a topic's field: "/odom.twist.linear.x" -> "x", "linear x".

    A single letter says nothing without its topic, so it is not among them.
    """
    text = column.strip()
    parts = (text if _NUMBERED.search(text) else _BRACKETS.sub(r"\1", text)).split(".")
    if len(parts) < 2:
        return ()
    if parts[-1] == "data":  # ROS messages of a single value are called after their topic
        return (_words(parts[-2].rpartition("/")[2]),)
    pair = f"{_NUMBERED.sub('', parts[-2])} {parts[-1]}"
    words = (_words(pair), split_header(pair)[0], split_header(parts[-1])[0])
    return tuple(word for word in words if len(word) > 1)


def _from_range(numbers: NDArray[np.float64], channel: Channel) -> tuple[str, str]:
    """The unit that makes the numbers plausible; the unit of the channel if the numbers allow it."""
    finite = _finite(numbers)
    if finite.size == 0:
        return channel.unit, "no numbers to guess the unit from"
    top = float(np.max(np.abs(finite)))
    if channel.name == "t":
        step = float(np.median(np.abs(np.diff(finite)))) if finite.size > 1 else 0.0
        return ("ms", "steps this large are milliseconds") if step >= 20 else ("s", "assumed; the header has no unit")
    if channel.unit == "deg" and top > (90.0 if channel.name == "latitude" else 180.0):
        return "ddmm", f"{_TOO_LARGE} {top:.5g} are no degrees but NMEA's ddmm.mmmm"
    limits = {
        "rad": ("deg", 2 * np.pi if channel.name in ("psi", "phi", "theta", "cog") else np.pi / 2),
        "rad/s": ("deg/s", 1.0),
        "rev/s": ("rpm", 25.0),
        "m/s": ("kn", 20.0),
    }
    if channel.unit == "1" and _SHARE < top <= _PER_CENT:
        return "percent", f"{_TOO_LARGE} {top:.3g} are per cent, if the model's 1 is full"
    if channel.unit in limits:
        other, limit = limits[channel.unit]
        if top > limit:
            return other, f"{_TOO_LARGE} {top:.3g} would be implausible in {channel.unit}"
    return channel.unit, "assumed; the header has no unit"


def _finite(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    return numbers[np.isfinite(numbers)]


def unit_fits(unit: str, wanted: str) -> bool:
    """Whether a unit can be turned into another one.

    Example:
        >>> unit_fits("kn", "m/s"), unit_fits("kn", "rad")
        (True, False)
    """
    try:
        to_si(unit, wanted)
    except BadInput:
        return False
    return True


def _words(text: str) -> str:
    """Lower-case words of a name: "Rudder_Angle" and "rudderAngle" -> "rudder angle"."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    return re.sub(r"[^a-z0-9]+", " ", spaced.lower()).strip()
