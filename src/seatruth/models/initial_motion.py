"""The motion with which a trial starts, from whatever its instruments measured there.

It is a start, which a fit with free initial states corrects: where nothing measures the motion over ground, that
through the water is taken for it, as if no current ran.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from seatruth.models.measures import Motion, Place, to_body, to_earth, velocity_at

Known = Sequence[tuple[str, str, Place]]
"""(channel, what it measures, place of the sensor)."""
_VELOCITY = ("u", "v", "w")


def initial_motion(own: Mapping[str, float], observations: Known, values: Mapping[str, float]) -> Motion:
    """The motion at the model's origin that measurements of one moment imply.

    Args:
        own: outputs at the model's origin, by standard name.
        observations: the channels of instruments.
        values: what they show; one that is missing was not recorded.

    Returns:
        The motion; what nothing measures is zero, accelerations always. The velocity is, in this order, the one over
        ground in body axes, in earth axes, from course and speed over ground, and the one through the water.

    Example:
        >>> channels = [("sog", "sog", (0.0, 0.0, 0.0)), ("cog", "cog", (0.0, 0.0, 0.0))]
        >>> m = initial_motion({"psi": 0.5}, channels, {"sog": 2.0, "cog": 0.5})
        >>> round(m.u, 6), round(m.v, 6)
        (2.0, 0.0)
    """
    shown: dict[str, tuple[float, Place]] = {}
    for channel, measured, at in observations:
        if channel in values:
            shown.setdefault(measured, (float(values[channel]), at))
    m = Motion(**{name: float(own.get(name, 0.0)) for name in ("phi", "theta", "psi", "p", "q", "r")})
    if "psi" not in own and "cog" in shown:
        m = m._replace(psi=shown["cog"][0])
    elif "psi" not in own and {"v_n", "v_e"} <= {*shown}:
        m = m._replace(psi=math.atan2(shown["v_e"][0], shown["v_n"][0]))
    velocity = {name: float(own[name]) for name in _VELOCITY if name in own}
    for found in (_over_ground(shown, m), _in_earth_axes(shown, m), _course_and_speed(shown, m), _in_water(shown, m)):
        for name, value in found.items():
            velocity.setdefault(name, value)
    m = m._replace(**velocity)
    position = {name: float(own[name]) for name in ("x", "y", "z") if name in own}
    for k, name in enumerate(("x", "y", "z")):
        if name in shown and name not in position:
            value, at = shown[name]
            position[name] = value - to_earth(at, m)[k]
    return m._replace(**position)


def _arm(at: Place, m: Motion) -> tuple[float, float, float]:
    """Velocity of a point of the body that its rotation adds, in body axes."""
    return velocity_at(m._replace(u=0.0, v=0.0, w=0.0), at)


def _over_ground(shown: Mapping[str, tuple[float, Place]], m: Motion) -> dict[str, float]:
    return {name: shown[name][0] - _arm(shown[name][1], m)[k] for k, name in enumerate(_VELOCITY) if name in shown}


def _in_water(shown: Mapping[str, tuple[float, Place]], m: Motion) -> dict[str, float]:
    pairs = [(k, name, shown[f"{name}_w"]) for k, name in enumerate(_VELOCITY) if f"{name}_w" in shown]
    return {name: value - _arm(at, m)[k] for k, name, (value, at) in pairs}


def _in_earth_axes(shown: Mapping[str, tuple[float, Place]], m: Motion) -> dict[str, float]:
    if "v_n" not in shown or "v_e" not in shown:
        return {}
    at = shown["v_n"][1]
    down = shown["v_d"][0] if "v_d" in shown else 0.0
    return _at_origin(shown["v_n"][0], shown["v_e"][0], down, at, m)


def _course_and_speed(shown: Mapping[str, tuple[float, Place]], m: Motion) -> dict[str, float]:
    if "sog" not in shown:
        return {}
    speed, at = shown["sog"]
    course = shown["cog"][0] if "cog" in shown else m.psi
    return _at_origin(speed * math.cos(course), speed * math.sin(course), 0.0, at, m)


def _at_origin(north: float, east: float, down: float, at: Place, m: Motion) -> dict[str, float]:
    """Velocity at the origin in body axes from the one of a sensor in earth axes."""
    return {
        name: float(total - added)
        for name, total, added in zip(_VELOCITY, to_body(north, east, down, m), _arm(at, m), strict=True)
    }
