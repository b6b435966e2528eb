"""Numbers as an engineer writes them: no more digits than the error leaves, units that are read, not computed with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from seatruth.text import listed as listed

MINUS = "\N{MINUS SIGN}"
_DIGITS = 10
"""Most significant digits of any number: more say nothing that a measurement could know."""
_DEGREES = 180.0 / math.pi
_SHOWN_UNITS = {
    "rad": ("deg", _DEGREES),
    "rad/s": ("deg/s", _DEGREES),
    "rad/s^2": ("deg/s²", _DEGREES),
    "rad/s2": ("deg/s²", _DEGREES),
    "rad/s**2": ("deg/s²", _DEGREES),
    "1": ("", 1.0),
    "": ("", 1.0),
}


@dataclass(frozen=True)
class Shown:
    """How a channel is shown: its name, the unit on the page, and the factor from the unit inside seatruth."""

    name: str
    unit: str
    factor: float

    @property
    def label(self) -> str:
        """Text of an axis: "r (deg/s)"."""
        return f"{self.name} ({self.unit})" if self.unit else self.name


def shown(name: str, unit: str) -> Shown:
    """Angles in degrees, everything else as it stands."""
    text, factor = _SHOWN_UNITS.get(unit, (unit.replace("^2", "²").replace("^3", "³"), 1.0))
    return Shown(name, text, factor)


def as_float(value: Any) -> float:
    """A number, or NaN for None, text and other things that are none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def number(value: Any, digits: int = 3) -> str:
    """A number with so many significant digits; "" where there is none, the sign of infinity where it is infinite."""
    x = as_float(value)
    if math.isnan(x):
        return ""
    if math.isinf(x):
        return "∞" if x > 0 else MINUS + "∞"
    if x == 0:
        return "0"
    # Rounding can carry: 0.996 to two digits is 1.0, not 1.00.
    rounded = round(x, digits - 1 - _exponent(x))
    return _written(rounded, digits - 1 - _exponent(rounded))


def tick(value: float) -> str:
    """A number on an axis: as short as it goes."""
    return f"{value:g}".replace("-", MINUS).replace("e+0", "e").replace(f"e{MINUS}0", f"e{MINUS}")


def estimate(value: Any, error: Any) -> str:
    """A value rounded to the second significant digit of its standard error: 0.28931(±0.0012) is "0.2893"."""
    x, e = as_float(value), abs(as_float(error))
    if not (math.isfinite(x) and math.isfinite(e) and e > 0):
        return number(x, 4)
    decimals = 1 - _exponent(e)
    # An error much larger than the value leaves it no digit; one is shown, so that the order of magnitude is seen.
    if x != 0:
        decimals = min(max(decimals, -_exponent(x)), _DIGITS - 1 - _exponent(x))
    return _written(x, decimals)


def rounded(value: Any, like: Any) -> str:
    """A number to the third significant digit of a quantity that it is compared with: 1e-9 beside 0.123 is "0"."""
    x, size = as_float(value), abs(as_float(like))
    if not (math.isfinite(x) and math.isfinite(size) and size > 0):
        return number(x, 2)
    decimals = 2 - _exponent(size)
    return _written(x, decimals) if round(x, decimals) else "0"


def interval(lower: Any, upper: Any, error: Any) -> str:
    """ "0.2870 to 0.2917"; "" where neither end is known."""
    low, high = as_float(lower), as_float(upper)
    if not (math.isfinite(low) or math.isfinite(high)):
        return ""
    ends = [estimate(end, error) if math.isfinite(end) else number(end) or "?" for end in (low, high)]
    return f"{ends[0]} to {ends[1]}"


def percent(fraction: Any, digits: int = 2) -> str:
    """A fraction as a percentage: 0.123 is "12 %"."""
    text = number(100.0 * as_float(fraction), digits)
    return f"{text} %" if text else ""


def times(ratio: Any) -> str:
    """A ratio in words: "3.4 times"."""
    return f"{number(ratio, 2)} times"


def count(many: int, one: str, more: str = "") -> str:
    """ "1 parameter", "3 parameters"."""
    return f"{many} {one if many == 1 else more or one + 's'}"


def seconds(value: Any) -> str:
    """A duration: "0.4 s", "12 s", "3 min 20 s"."""
    x = as_float(value)
    if not math.isfinite(x):
        return ""
    if x < 120:
        return f"{number(x, 2)} s" if x < 10 else f"{x:.0f} s"
    minutes, rest = divmod(round(x), 60)
    return f"{minutes} min {rest} s" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"


def moment(provenance: Mapping[str, Any]) -> str:
    """When a result was made: "2026-01-02 03:04 UTC"."""
    text = str(provenance.get("time_utc", ""))
    return f"{text[:10]} {text[11:16]} UTC" if text.endswith("Z") and len(text) == 20 else text


def _exponent(x: float) -> int:
    return math.floor(math.log10(abs(x)))


def _written(x: float, decimals: int) -> str:
    rounded = round(x, decimals)
    size = _exponent(rounded) if rounded else -decimals
    if -5 < size < 6 and decimals < 12:
        text = f"{rounded:.{max(decimals, 0)}f}"
    else:
        mantissa, _, power = f"{x:.{min(max(size + decimals, 0), _DIGITS)}e}".partition("e")
        text = f"{mantissa}e{int(power)}"
    return text.replace("-", MINUS)
