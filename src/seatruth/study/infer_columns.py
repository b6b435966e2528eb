"""Infers which column of a log holds which channel, from its name, its unit and its range.

The study file shows each inference with its reason, so that the user can check it. Names decide first ("rudder",
"yaw rate"); the unit comes from the header ("[deg/s]", "(kn)", "_deg"), else from the range of the numbers.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from seatruth.errors import BadInput
from seatruth.study.column_spellings import AUTOPILOTS, MEANT, other_spellings
from seatruth.trials.channel import Channel
from seatruth.units import is_unit, to_si

_NAMES: dict[str, tuple[str, ...]] = {
    "t": (
        *("t", "time", "timestamp", "seconds", "elapsed", "elapsed time", "utc", "datetime", "date time", "stamp"),
        *("unix time", "unix", "epoch", "gps time", "log time"),
    ),
    "x": ("x", "x0", "north", "northing", "pos x", "position x", "x pos", "x position", "x north"),
    "y": ("y", "y0", "east", "easting", "pos y", "position y", "y pos", "y position", "y east"),
    "z": ("z", "z0", "pos z", "position z", "down"),
    "depth": ("depth",),
    "phi": ("phi", "roll", "roll angle", "heel", "heel angle", "bank"),
    "theta": ("theta", "pitch", "pitch angle", "trim"),
    "psi": ("psi", "heading", "yaw", "yaw angle", "hdg", "heading angle", "compass", "gyro heading"),
    "u": (
        *("u", "surge", "surge velocity", "surge speed", "speed", "forward speed", "longitudinal speed", "vx"),
        *("longitudinal velocity", "forward velocity", "velocity x", "ship speed", "u ship", "linear x"),
        *("longitudinal ground speed", "dvl vx", "dvl u", "dvl x"),
    ),
    "v": (
        *("v", "sway", "sway velocity", "sway speed", "transverse speed", "lateral speed", "lateral velocity", "vy"),
        *("linear y", "transverse ground speed", "dvl vy", "dvl v", "dvl y"),
    ),
    "w": (
        *("w", "heave velocity", "heave speed", "vertical speed", "vertical velocity", "vz", "heave rate"),
        *("dvl vz", "dvl w", "dvl z"),
    ),
    "u_w": (
        "u w",
        "stw",
        "speed through water",
        "speed through the water",
        "water speed",
        "log speed",
        "speed log",
        "longitudinal water speed",
    ),
    "v_w": ("v w", "stw across", "transverse speed through water", "transverse water speed"),
    "sog": ("sog", "speed over ground", "gps speed", "gnss speed", "ground speed", "speed gps", "spd"),
    "cog": ("cog", "course over ground", "gps course", "gnss course", "course", "track angle", "gcrs"),
    "v_n": ("v n", "vn", "v north", "north velocity", "velocity north", "vel n", "vel north"),
    "v_e": ("v e", "ve", "v east", "east velocity", "velocity east", "vel e", "vel east"),
    "v_d": ("v d", "vd", "v down", "down velocity", "velocity down", "vel d", "vel down"),
    "latitude": ("latitude", "lat", "gps lat", "gnss lat", "gps latitude"),
    "longitude": ("longitude", "lon", "lng", "long", "gps lon", "gps lng", "gnss lon", "gps longitude"),
    "northing": ("northing", "utm northing", "utm n", "utm north", "north", "utm y"),
    "easting": ("easting", "utm easting", "utm e", "utm east", "east", "utm x"),
    **{
        f"f_{axis}": tuple(f"{word} {axis}" for word in ("f", "acc", "accel", "accelerometer", "linear acceleration"))
        for axis in "xyz"
    },
    "p": ("p", "roll rate", "omega x", "gyro x", "gyr x", "roll velocity"),
    "q": ("q", "pitch rate", "omega y", "gyro y", "gyr y", "pitch velocity"),
    "r": (
        "r",
        "yaw rate",
        "rot",
        "rate of turn",
        "turn rate",
        "omega z",
        "gyro z",
        "gyr z",
        "yaw velocity",
        "rate turn",
        "angular z",
    ),
    "delta": (
        "delta",
        "rudder",
        "rudder angle",
        "helm",
        "rud",
        "rudder position",
        "delta r",
        "steering",
        "steering angle",
        "nozzle",
        "nozzle angle",
        "jet angle",
    ),
    "delta_s": ("delta s", "stern plane", "stern planes", "elevator", "fin", "fin angle", "plane", "elevator angle"),
    "n": (
        *("n", "rpm", "rps", "propeller", "propeller speed", "shaft speed", "prop", "revs", "propeller rate", "shaft"),
        *(
            "prop speed",
            "propeller revs",
            "propeller rpm",
            "shaft rpm",
            "prop rpm",
            "propeller rps",
            "n prop",
            "engine",
        ),
    ),
    "T": ("thrust", "thrust n", "propeller thrust"),
    "voltage": ("voltage", "battery voltage", "batt voltage", "vbat", "v bat", "battery v", "batt v"),
}
_SUFFIXES = {
    "deg": "deg",
    "degrees": "deg",
    "rad": "rad",
    "degs": "deg/s",
    "deg s": "deg/s",
    "deg per s": "deg/s",
    "deg sec": "deg/s",
    "degps": "deg/s",
    "dps": "deg/s",
    "rads": "rad/s",
    "rad s": "rad/s",
    "rad per s": "rad/s",
    "radps": "rad/s",
    "deg min": "deg/min",
    "degmin": "deg/min",
    "m": "m",
    "ft": "ft",
    "ms": "m/s",
    "m s": "m/s",
    "mps": "m/s",
    "m per s": "m/s",
    "kn": "kn",
    "kt": "kn",
    "kts": "kn",
    "knots": "kn",
    "rpm": "rpm",
    "rps": "rev/s",
    "hz": "rev/s",
    "s": "s",
    "sec": "s",
    "min": "min",
    "millis": "ms",
    "msec": "ms",
    "us": "us",
    "pct": "percent",
    "percent": "percent",
}
ORDERS = ("cmd", "command", "commanded", "order", "ordered", "setpoint", "sp", "demand", "demanded", "desired", "des")
"""Words that say that a column holds what an actuator was told."""
_ORDER = 1000
"""Rank of an order behind any column that says what the actuator did."""
_SIDES = {"port": "port", "left": "port", "stbd": "starboard", "stb": "starboard", "right": "starboard"}
_PLACES = frozenset((*_SIDES.values(), "bow", "stern", "fore", "front", "aft", "rear", "centre"))
"""Words of a place of a drive."""
_OF_ANY_THRUSTER = frozenset(
    (
        *("n", "c", "t", "u", "rpm", "rps", "rev", "revs", "thr", "thruster", "thrust", "prop", "propeller"),
        *("motor", "engine", "esc", "speed", "shaft", "power", "throttle"),
    )
)
"""Words in the names of columns and inputs of thrusters that do not say which one it is."""
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


FROM_HEADER = "unit from the header"
"""Why a column has its unit, where its name or header says it."""
VAGUE = frozenset(("speed", "ship speed", "forward speed"))
"""Names of columns that do not say whether the speed is through the water, over ground, or along the bow at all."""
_TOO_LARGE = "numbers up to"
_RUDDER_MOVES = 0.05
"""A rudder that moves by more than this and stays below a quarter turn is in rad: in degrees it would be at rest."""
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
    for order, (column, numbers) in enumerate(columns.items()):
        for channel in wanted:
            match = _match(column, numbers, channel)
            if match is None and channel.name in orders:
                match = _ordered(column, numbers, channel)
            if match is None and thrusters and channel.name in thrusters:
                match = _of_thruster(column, numbers, channel, thrusters[channel.name])
            if match is not None:
                candidates.append((match[0], order, match[1]))
    taken: dict[str, InferredColumn] = {}
    used: set[str] = set()
    for _, _, candidate in sorted(candidates, key=lambda item: item[:2]):
        if candidate.channel not in taken and candidate.column not in used:
            taken[candidate.channel] = candidate
            used.add(candidate.column)
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
    parts = re.split(r"\s*[,;:|/]\s*", text, maxsplit=1)
    if len(parts) == 2 and parts[1] and is_unit(parts[1]):
        return _words(parts[0]), parts[1]
    words = _words(text)
    for length in (3, 2, 1):
        pieces = words.split(" ")
        suffix = " ".join(pieces[-length:])
        if len(pieces) > length and suffix in _SUFFIXES:
            return " ".join(pieces[:-length]), _SUFFIXES[suffix]
    return words, ""


def _match(column: str, numbers: NDArray[np.float64], channel: Channel) -> tuple[int, InferredColumn] | None:
    """How well a column fits a channel (smaller is better), or None."""
    name, unit = split_header(column)
    known = (*AUTOPILOTS.get(channel.name, ()), *_NAMES.get(channel.name, (_words(channel.name),)))
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
    if unit and not _fits(unit, channel.unit):
        return None
    if unit:
        return rank, InferredColumn(channel.name, column, unit, FROM_HEADER)
    if whole in ("rpm", "rps"):
        return rank, InferredColumn(channel.name, column, "rpm" if whole == "rpm" else "rev/s", "unit from the name")
    unit, why = _from_range(numbers, channel)
    return rank, InferredColumn(channel.name, column, unit, why)


def _ordered(column: str, numbers: NDArray[np.float64], channel: Channel) -> tuple[int, InferredColumn] | None:
    """How well a column of orders fits a channel, which it does as if its name did not say that they are orders."""
    words = _words(column).split(" ")
    plain = " ".join(word for word in words if word not in ORDERS)
    if not plain or plain == " ".join(words):
        return None
    hit = _match(plain, numbers, channel)
    return None if hit is None else (hit[0] + _ORDER, replace(hit[1], column=column, order=True))


def _of_thruster(
    column: str, numbers: NDArray[np.float64], channel: Channel, thruster: str
) -> tuple[int, InferredColumn] | None:
    """Whether a column belongs to a thruster, as its side or its number says."""
    words = _words(column).split(" ")
    plain = " ".join(word for word in words if word not in ORDERS)
    name, unit = split_header(plain)
    if unit and not _fits(unit, channel.unit):
        return None
    which = _which(name)
    if not which or which not in (_which(thruster), _which(channel.name)) or not _names_a_thruster(plain):
        return None
    order = plain != " ".join(words)
    why = FROM_HEADER
    if not unit:
        unit, why = next(((_SUFFIXES[w], why) for w in words if w in ("rpm", "rps")), _from_range(numbers, channel))
    return _ORDER * order, InferredColumn(channel.name, column, unit, why, order)


def place_in(description: str) -> str:
    """The words of a drive's description that tell it from others: "port propeller" gives "port".

    Example:
        >>> place_in("stbd ESC, us"), place_in("shaft speed")
        ('starboard', '')
    """
    words = [_SIDES.get(word, word) for word in _words(description).split(" ")]
    return " ".join(word for word in words if word in _PLACES)


def _which(name: str) -> frozenset[str]:
    """What tells a thruster from others: the side, the number, whatever else its name has."""
    words = re.sub(r"(?<=[a-z])(?=[0-9])", " ", _words(name)).split(" ")
    return frozenset(_SIDES.get(word, word) for word in words if word and word not in _OF_ANY_THRUSTER)


def _names_a_thruster(name: str) -> bool:
    """Whether a word of a column's name is one of thrusters."""
    words = re.sub(r"(?<=[a-z])(?=[0-9])", " ", _words(name)).split(" ")
    return any(word in _OF_ANY_THRUSTER for word in words)


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
    if channel.unit in limits:
        other, limit = limits[channel.unit]
        if top > limit:
            return other, f"{_TOO_LARGE} {top:.3g} would be implausible in {channel.unit}"
    return channel.unit, "assumed; the header has no unit"


def _finite(numbers: NDArray[np.float64]) -> NDArray[np.float64]:
    return numbers[np.isfinite(numbers)]


def _fits(unit: str, channel_unit: str) -> bool:
    try:
        to_si(unit, channel_unit)
    except BadInput:
        return False
    return True


def _words(text: str) -> str:
    """Lower-case words of a name: "Rudder_Angle" and "rudderAngle" -> "rudder angle"."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    return re.sub(r"[^a-z0-9]+", " ", spaced.lower()).strip()
