"""Units of a user's file to the unit that a channel has inside seatruth.

pint knows the units; this module adds the spellings that logs use (`m/s2`, `kts`, `RPM`, `rev/s`, `Nm`) and one rule:
a propeller speed is counted in revolutions, so "1/s" or "Hz" for a channel in rev/s means revolutions a second, and
"rpm" for a channel in 1/min means one a minute, not 2 pi radians.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from seatruth.errors import BadInput, nearest

_SPELLINGS = {
    "": "1",
    "-": "1",
    "none": "1",
    "rps": "rev/s",
    "r/s": "rev/s",
    "rpm": "rev/min",
    "r/min": "rev/min",
    "kts": "knot",
    "nmi": "nautical_mile",
    "mps": "m/s",
    "kph": "km/h",
    "kmh": "km/h",
    "dps": "deg/s",
    "degps": "deg/s",
    "radps": "rad/s",
    "sec": "s",
    "secs": "s",
    "msec": "ms",
    "usec": "us",
    "celsius": "degC",
    "°c": "degC",
}
_GLUED = {"degs": "deg/s", "rads": "rad/s"}
"""What means a rate where a rate is wanted, and is the plural of an angle, or a dose of radiation, elsewhere."""
_CASED = {
    "Nm": "newton*meter",
    "kNm": "kilonewton*meter",
    "NM": "nautical_mile",
    "C": "degC",
    "degE7": "ten_millionth_degree",
}
"""Case tells these; degE7 is MAVLink's name for positions as whole numbers."""
_COMMON = (
    *("m", "cm", "mm", "km", "ft", "nmi", "m/s", "cm/s", "mm/s", "km/h", "kn", "m/s^2", "rad", "deg", "rad/s", "deg/s"),
    *("rev/s", "rpm", "Hz", "s", "ms", "min", "h", "N", "kN", "N*m", "kN*m", "kg", "t", "Pa", "kPa", "bar", "dbar"),
    *("degC", "K", "V", "A", "W", "kW", "m^3", "cm^3", "l", "kg/m^3", "1", "percent"),
)
_ALLOWED = re.compile(r"[A-Za-z0-9_°µμΩ·*/^().\-+ ²³⁻¹%]{1,60}")
_HOSTILE = re.compile(r"\d{3}|\*\*\s*[-+]?\(|\d\s*\*\*|\*\*[^*]*\*\*[^*/]*\*\*")
"""Towers of powers and long numbers, which no unit needs and which could take for ever to work out."""
_EXPONENT = re.compile(r"(?<=[A-Za-z])([+-]?[1-9])(?![A-Za-z0-9])")


PULSES = frozenset(("us", "\N{MICRO SIGN}s", "\N{GREEK SMALL LETTER MU}s", "microsecond", "microseconds"))
"""Units of the pulses that servos and speed controllers take: commands, whose length is no time of the motion."""
_FREQUENT = frozenset({"1", "m", "m/s", "rad", "rad/s", "deg", "deg/s", "rev/s", "s"})
"""Units of nearly every log. They are known without pint, whose table takes half a second to load."""


class Conversion(NamedTuple):
    """value inside seatruth = factor * value in the file + offset."""

    factor: float
    offset: float

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        if self.factor == 1.0 and self.offset == 0.0:
            return values
        return values * self.factor + self.offset


_DEGREES = Conversion(math.pi / 180.0, 0.0)
_QUICK = {("deg", "rad"): _DEGREES, ("deg/s", "rad/s"): _DEGREES}


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry()
    registry.define("@alias turn = rev")
    registry.define("ten_millionth_degree = 1e-7 * degree")
    return registry


@lru_cache(maxsize=512)
def to_si(unit_from: str, channel_unit: str) -> Conversion:
    """How numbers in `unit_from` become numbers in `channel_unit` (the unit a channel has inside seatruth).

    Degrees to radians, rpm to rev/s (exactly 1/60), knots to m/s, degC to K with its offset. Raises BadInput for an
    unknown unit, naming the nearest, and for units of different dimensions, naming both.
    """
    given = unit_from.strip(), channel_unit.strip()
    if given in _QUICK:
        return _QUICK[given]
    if given[0] == given[1]:
        if given[0] not in _FREQUENT:
            parse_unit(unit_from)
        return Conversion(1.0, 0.0)
    source, target = parse_unit(unit_from), parse_unit(channel_unit)
    registry = _registry()
    if source.dimensionality != target.dimensionality:
        rate = _GLUED.get(given[0].lower())
        if rate is not None and target.dimensionality == parse_unit(rate).dimensionality:
            return to_si(rate, channel_unit)
        raise BadInput(
            f"unit {unit_from!r} is {_dimension(source)}, but {channel_unit!r} is {_dimension(target)}",
            do="Correct the unit or the column.",
        )
    if _counts_turns(target) and not _is_angular(source):
        source = source * registry.rev
    elif _counts_turns(source) and not _is_angular(target):
        target = target * registry.rev
    zero = float(registry.Quantity(0.0, source).to(target).magnitude)
    one = float(registry.Quantity(1.0, source).to(target).magnitude)
    return Conversion(one - zero, zero)


def parse_unit(unit: str) -> Any:
    """pint's unit for a unit's text; BadInput naming the nearest known unit if there is none."""
    text = _spelt(unit)
    if _ALLOWED.fullmatch(text) and not _HOSTILE.search(text):
        registry = _registry()  # outside: a pint that cannot start is no fault of the unit
        try:
            return registry.parse_units(text)
        except Exception:  # pint raises many kinds for text that is no unit; all mean the same to the user
            pass
    raise BadInput(f"unknown unit {unit!r}", do=nearest(unit, _COMMON))


def inside_unit(unit: str) -> str:
    """The unit that seatruth keeps a quantity in, for a channel that declares none: SI, rad, and rev/s for turns."""
    parsed = parse_unit(unit)
    if _counts_turns(parsed) or "revolutions" in str(parsed):
        return "rev/s" if parsed.dimensionality == _registry().Unit("rev/s").dimensionality else "rad"
    base = _registry().Quantity(1.0, parsed).to_base_units().units
    return f"{base:~C}" or "1"


def is_unit(text: str) -> bool:
    """Whether a piece of text is a unit ("m/s", "deg", "-"), as in a header or a row of units."""
    if text in _FREQUENT:
        return True
    try:
        parse_unit(text)
    except BadInput:
        return False
    return True


def _spelt(unit: str) -> str:
    text = unit.strip().strip("[]").strip()
    text = _CASED.get(text) or _SPELLINGS.get(text.lower(), text)
    return _EXPONENT.sub(r"**\1", text.replace("·", "*").replace("^", "**"))


def _counts_turns(unit: Any) -> bool:
    return "turn" in str(unit)


def _is_angular(unit: Any) -> bool:
    return any(word in str(unit) for word in ("turn", "rev", "radian", "degree"))


def _dimension(unit: Any) -> str:
    text = str(unit.dimensionality).replace("[", "").replace("]", "").replace(" ** ", "^")
    return "a pure number or an angle" if text == "dimensionless" else text
