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
_MADE: Mapping[str, str] = MappingProxyType({"latitude": "x", "northing": "x", "longitude": "y", "easting": "y"})
"""The channels that a receiver's positions become."""
_DEGREES = ("latitude", "longitude")


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

    `hints` say what to do about names of channels that there might have been. That of a latitude or a northing is that
    of the x which they become, in m; longitude and easting become y.
    """
    known = {channel.name: channel for channel in channels}
    result: dict[str, float | Literal["estimate"]] = {}
    for stated_name, value in stated.items():
        name = _MADE.get(stated_name, stated_name) if stated_name not in known else stated_name
        if name != stated_name and name in known:
            what, do = _wrong_position(stated_name, name, value, stated)
            if what:
                problems.add((*path, stated_name), what, do)
                continue
        if name not in known:
            hint = hints.get(stated_name) or nearest(stated_name, known)
            problems.add((*path, stated_name), f"unknown channel {stated_name!r}", hint)
            continue
        with problems.at(*path, stated_name):
            result[name] = deviation(value, known[name].unit, estimate=estimate)
    return result


def _wrong_position(stated: str, made: str, value: float | str, others: Mapping[str, float | str]) -> tuple[str, str]:
    """What is wrong with the noise of a position as a receiver gives it, and what to do; empty where nothing is."""
    twice = [name for name in others if name != stated and (name == made or _MADE.get(name) == made)]
    if twice:
        return f"the noise of {made!r} is stated twice: by {twice[0]!r} as well", f"Remove {stated!r} or {twice[0]!r}."
    if stated in _DEGREES and _bare(value):
        return f"{value} of {stated!r} has no unit: degrees or metres?", f'Write it in metres: {made} = "{value} m".'
    return "", ""


def _bare(value: float | str) -> bool:
    """Whether a value is a number without a unit."""
    if not isinstance(value, str):
        return True
    try:
        float(value)
    except ValueError:
        return False
    return True


def deviation(value: float | str, unit: str, *, estimate: bool = True) -> float | Literal["estimate"]:
    """One standard deviation in `unit`, from 0.01, "0.1 deg" or (where allowed) "estimate"."""
    if estimate and isinstance(value, str) and value.strip() == ESTIMATE:
        return ESTIMATE
    if estimate and quantity(value, unit) is None:
        hint = nearest(str(value), [ESTIMATE]).split("Known:")[0]
        what = f'"{value}" is no number with a unit, nor "estimate"'
        raise BadInput(what, do=f'{hint} Write it as "0.1 {unit}".'.strip())
    return positive(value, unit, "a standard deviation")
