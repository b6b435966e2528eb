"""Standard deviations as a study file writes them: a number in SI units, text with a unit, or "estimate"."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Literal

from seatruth.errors import BadInput, nearest
from seatruth.study.validation import Problems
from seatruth.trials import Channel
from seatruth.units import to_si

ESTIMATE: Literal["estimate"] = "estimate"
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def deviations(
    stated: Mapping[str, float | str],
    channels: Sequence[Channel],
    path: tuple[str, ...],
    problems: Problems,
    *,
    estimate: bool = True,
) -> dict[str, float | Literal["estimate"]]:
    """The standard deviation of each channel that is stated, in the channel's unit inside seatruth."""
    known = {channel.name: channel for channel in channels}
    result: dict[str, float | Literal["estimate"]] = {}
    for name, value in stated.items():
        if name not in known:
            problems.add((*path, name), f"unknown channel {name!r}", nearest(name, known))
            continue
        with problems.at(*path, name):
            result[name] = deviation(value, known[name].unit, estimate=estimate)
    return result


def quantity(value: float | str, unit: str) -> float:
    """A number in `unit`, or text with a unit of its own ("3.5 deg"), in `unit`. BadInput for other text."""
    if not isinstance(value, str):
        return float(value)
    match = _QUANTITY.fullmatch(value)
    if match is None:
        raise BadInput(f'"{value}" is no number with a unit', do=f'Write it as "0.1 {unit}".')
    return float(match.group(1)) * (to_si(match.group(2), unit).factor if match.group(2) else 1.0)


def deviation(value: float | str, unit: str, *, estimate: bool = True) -> float | Literal["estimate"]:
    """One standard deviation in `unit`, from 0.01, "0.1 deg" or (where allowed) "estimate"."""
    number, factor = value, 1.0
    if isinstance(value, str):
        if estimate and value.strip() == ESTIMATE:
            return ESTIMATE
        match = _QUANTITY.fullmatch(value)
        if match is None:
            hint = nearest(value, [ESTIMATE]).split("Known:")[0] if estimate else ""
            what = 'is no number with a unit, nor "estimate"' if estimate else "is no number with a unit"
            raise BadInput(f'"{value}" {what}', do=f'{hint} Write it as "0.1 {unit}".'.strip())
        number = float(match.group(1))
        # A deviation is a difference: units with another zero (degC) convert by their factor alone.
        factor = to_si(match.group(2), unit).factor if match.group(2) else 1.0
    result = float(number) * factor
    if not (math.isfinite(result) and result > 0):
        raise BadInput(f"a standard deviation of {value} is not possible", do="Give a positive number.")
    return result
