"""Sentences of NMEA 0183 (IEC 61162-1) that hold channels of a vehicle: which field stands where, in which unit.

Positions count the fields behind the name from 0. Source: IEC 61162-1, as described by E. S. Raymond, "NMEA Revealed"
(gpsd project). Signs are the standard's: a negative rate of turn or rudder angle turns the bow to port.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

Value = float | str | None


@dataclass(frozen=True)
class Sentence:
    """One kind of sentence.

    Args:
        fields: name -> (position, unit, how the text becomes a value).
        status: position of a field that is "V" where the device declares its values void; None if there is none.
        clock: positions of UTC time (hhmmss.ss) and of the date (ddmmyy); None where it has none.
        instance: positions of the fields that tell several devices in one kind of sentence apart.
    """

    fields: dict[str, tuple[int, str, Callable[[Sequence[str], int], Value]]]
    status: int | None = None
    clock: tuple[int, int | None] | None = None
    instance: tuple[int, ...] = ()


def _number(parts: Sequence[str], at: int) -> Value:
    return float(parts[at]) if at < len(parts) and parts[at] else None


def _angle(parts: Sequence[str], at: int) -> Value:
    """Degrees from ddmm.mmmm with the hemisphere in the next field."""
    if at + 1 >= len(parts) or not parts[at]:
        return None
    degrees = math.floor(float(parts[at]) / 100)
    return (degrees + (float(parts[at]) - 100 * degrees) / 60) * {"N": 1, "E": 1, "S": -1, "W": -1}[parts[at + 1]]


def _side(parts: Sequence[str], at: int) -> Value:
    """A variation or deviation: positive to the east."""
    value = _number(parts, at)
    return value if value is None else float(value) * {"E": 1, "W": -1}[parts[at + 1]]


def _wind_speed(parts: Sequence[str], at: int) -> Value:
    value = _number(parts, at)
    return (
        value
        if value is None
        else float(value) * {"K": 1 / 3.6, "M": 1.0, "N": 1852 / 3600, "S": 0.44704}[parts[at + 1]]
    )


def _if_valid(parts: Sequence[str], at: int) -> Value:
    """A number whose own status stands in the next field."""
    return _number(parts, at) if at + 1 < len(parts) and parts[at + 1] == "A" else None


SENTENCES = {
    "GGA": Sentence(
        {
            "latitude": (1, "deg", _angle),
            "longitude": (3, "deg", _angle),
            "fix_quality": (5, "", _number),
            "satellites": (6, "", _number),
            "hdop": (7, "", _number),
            "altitude": (8, "m", _number),
        },
        clock=(0, None),
    ),
    "RMC": Sentence(
        {
            "latitude": (2, "deg", _angle),
            "longitude": (4, "deg", _angle),
            "speed_over_ground": (6, "kn", _number),
            "course_over_ground": (7, "deg", _number),
            "magnetic_variation": (9, "deg", _side),
        },
        status=1,
        clock=(0, 8),
    ),
    "VTG": Sentence(
        {
            "course_over_ground": (0, "deg", _number),
            "course_over_ground_magnetic": (2, "deg", _number),
            "speed_over_ground": (4, "kn", _number),
        }
    ),
    "HDT": Sentence({"heading": (0, "deg", _number)}),
    "ROT": Sentence({"rate_of_turn": (0, "deg/min", _number)}, status=1),
    "VHW": Sentence(
        {
            "heading": (0, "deg", _number),
            "heading_magnetic": (2, "deg", _number),
            "speed_through_water": (4, "kn", _number),
        }
    ),
    "VBW": Sentence(
        {
            "longitudinal_water_speed": (0, "kn", _number),
            "transverse_water_speed": (1, "kn", _number),
            "longitudinal_ground_speed": (3, "kn", _number),
            "transverse_ground_speed": (4, "kn", _number),
        }
    ),
    "RSA": Sentence({"rudder": (0, "deg", _if_valid), "rudder_port": (2, "deg", _if_valid)}),
    "RPM": Sentence(
        {"shaft_speed": (2, "rpm", _number), "propeller_pitch": (3, "percent", _number)}, status=4, instance=(0, 1)
    ),
    "MWV": Sentence(
        {"wind_angle": (0, "deg", _number), "wind_speed": (2, "m/s", _wind_speed)}, status=4, instance=(1,)
    ),
}
