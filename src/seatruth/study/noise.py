"""Standard deviations as a study file writes them: a number in SI units, text with a unit, or "estimate"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Literal

from seatruth.errors import BadInput, nearest
from seatruth.study.quantity import positive, quantity
from seatruth.study.validation import Problems
from seatruth.trials import Channel

ESTIMATE: Literal["estimate"] = "estimate"


def deviations(
    stated: Mapping[str, float | str],
    channels: Sequence[Channel],
    path: tuple[str, ...],
    problems: Problems,
    *,
    estimate: bool = True,
    hints: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, float | Literal["estimate"]]:
    """The standard deviation of each channel that is stated, in the channel's unit inside seatruth.

    `hints` say what to do about names of channels that there might have been.
    """
    known = {channel.name: channel for channel in channels}
    result: dict[str, float | Literal["estimate"]] = {}
    for name, value in stated.items():
        if name not in known:
            problems.add((*path, name), f"unknown channel {name!r}", hints.get(name) or nearest(name, known))
            continue
        with problems.at(*path, name):
            result[name] = deviation(value, known[name].unit, estimate=estimate)
    return result


def deviation(value: float | str, unit: str, *, estimate: bool = True) -> float | Literal["estimate"]:
    """One standard deviation in `unit`, from 0.01, "0.1 deg" or (where allowed) "estimate"."""
    if estimate and isinstance(value, str) and value.strip() == ESTIMATE:
        return ESTIMATE
    if estimate and quantity(value, unit) is None:
        hint = nearest(str(value), [ESTIMATE]).split("Known:")[0]
        what = f'"{value}" is no number with a unit, nor "estimate"'
        raise BadInput(what, do=f'{hint} Write it as "0.1 {unit}".'.strip())
    return positive(value, unit, "a standard deviation")
