"""Sizes and directions on the earth in words, as of a current or a wind: from components north and east.

Example:
    >>> towards({"north": (0.3, 0.02), "east": (0.0, 0.05)})
    '0.300 +- 0.020 m/s towards 0 +- 9.5 deg'
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from seatruth.diagnosis.verdict import EffectParameter
from seatruth.text import with_error

_APART = 2.0
"""Standard errors from which two effects of one cause point in directions of their own. Convention."""


def towards(values: Mapping[str, tuple[float, float]], unit: str = "m/s", systematic: float = 0.0) -> str:
    """Components north and east with their deviations as size and direction: "0.21 +- 0.03 m/s towards 40 +- 8 deg".

    `systematic` is a further error of the size, as a part of it. Empty where there are no components.
    """
    found = _polar(values)
    if found is None:
        return ""
    size, d_size, angle, d_angle = found
    return f"{with_error(size, math.hypot(d_size, systematic * size))} {unit} towards {with_error(angle, d_angle)} deg"


def in_words(parameters: Sequence[EffectParameter]) -> str:
    """The same of the parameters of an effect: an error of its form is one of the size, and none of the direction."""
    unit = parameters[0].unit if parameters else ""
    parts = [q.systematic_error / abs(q.value) for q in parameters if q.systematic_error > 0.0]
    return towards(_components(parameters), unit, max(parts, default=0.0))


def _components(parameters: Sequence[EffectParameter]) -> dict[str, tuple[float, float]]:
    """Values with their deviations, less what is an error of the form."""
    return {q.name: (q.value, math.sqrt(max(q.stderr**2 - q.systematic_error**2, 0.0))) for q in parameters}


def common_direction(members: Sequence[Sequence[EffectParameter]]) -> str:
    """The direction of effects that cannot be told apart, the most probable first: "303 +- 15 deg".

    Where others point elsewhere by more than two standard errors, the range of all: "260 to 303 deg". Empty for one
    effect, and where the first has no direction, or one for each trial.
    """
    found = [_polar(_components(parameters)) for parameters in members]
    if len(found) < 2 or found[0] is None:
        return ""
    known = [one[2:] for one in found if one is not None]
    first, error = known[0]
    off = [(_turn(angle - first), math.hypot(error, other)) for angle, other in known]
    if any(abs(turn) > _APART * both for turn, both in off):
        turns = [turn for turn, _ in off]
        return f"{(first + min(turns)) % 360.0:.0f} to {(first + max(turns)) % 360.0:.0f} deg"
    return f"{with_error(first, error)} deg"


def _polar(values: Mapping[str, tuple[float, float]]) -> tuple[float, float, float, float] | None:
    """Size and direction (deg), each followed by its deviation; None where there are no components."""
    if not {"north", "east"} <= set(values):
        return None
    (north, dn), (east, de) = values["north"], values["east"]
    size = math.hypot(north, east)
    if size == 0.0:
        return None
    d_angle = math.degrees(math.hypot(north * de, east * dn) / size**2)
    return size, math.hypot(north * dn, east * de) / size, math.degrees(math.atan2(east, north)) % 360.0, d_angle


def _turn(angle: float) -> float:
    """An angle (deg) as a turn to either side, -180 to 180."""
    return (angle + 180.0) % 360.0 - 180.0
