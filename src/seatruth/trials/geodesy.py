"""Geographic and UTM coordinates as north and east of an origin, on the WGS-84 ellipsoid (pymap3d, utm)."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.errors import BadInput

MAX_DISTANCE = 50e3
"""m from the origin: there the tangent plane is 0.5 m short of the distance over the ground (d^3 / 6 R^2), and anything
further is a wrong fix more often than a trial (chosen here [S])."""
_ZONE = re.compile(r"\s*(?:zone\s*)?(\d{1,2})\s*(north|south|n)\s*", re.IGNORECASE)


def to_plane(latitude: Array, longitude: Array, origin: tuple[float, float]) -> tuple[Array, Array]:
    """North and east (n,), m, of places in degrees from an origin in degrees, in its tangent plane at height zero."""
    import pymap3d

    north, east, _ = pymap3d.geodetic2ned(latitude, longitude, 0.0, origin[0], origin[1], 0.0)
    return np.asarray(north, dtype=np.float64), np.asarray(east, dtype=np.float64)


def parse_zone(zone: str) -> tuple[int, bool]:
    """Number of a UTM zone and whether it is in the northern hemisphere; BadInput for anything else."""
    match = _ZONE.fullmatch(zone)
    if match is None or not 1 <= int(match[1]) <= 60:
        raise BadInput(
            f"{zone!r} is no UTM zone",
            do='Write number and hemisphere, as "32 north" ("32S" could be a band of latitude).',
        )
    return int(match[1]), match[2].lower().startswith("n")


def geographic(northing: Array, easting: Array, ok: NDArray[np.bool_], zone: str, where: str) -> tuple[Array, Array]:
    """Latitude and longitude (n,) in degrees of UTM coordinates in m; NaN where they are not `ok`."""
    import utm

    number, northern = parse_zone(zone)
    latitude, longitude = np.full(northing.size, np.nan), np.full(northing.size, np.nan)
    inside = (easting[ok] >= 100e3) & (easting[ok] < 1000e3) & (northing[ok] >= 0.0) & (northing[ok] <= 10000e3)
    if not inside.all():
        bad = int(np.flatnonzero(~inside)[0])
        raise BadInput(
            f"easting {easting[ok][bad]:.10g} m, northing {northing[ok][bad]:.10g} m are no UTM coordinates",
            where=where,
            do="An easting has 6 digits. Exchange the columns, or name local coordinates x (north) and y (east).",
        )
    latitude[ok], longitude[ok] = utm.to_latlon(easting[ok], northing[ok], number, northern=northern)
    return latitude, longitude


def convergence(latitude: Array, longitude: Array, origin: tuple[float, float]) -> float:
    """Largest angle, rad, between true north at places (n,) and at the origin."""
    turned = np.abs((longitude - origin[1] + 180.0) % 360.0 - 180.0) * np.sin(np.radians(np.abs(latitude)))
    return float(np.radians(turned.max())) if turned.size else 0.0


def from_ddmm(values: Array) -> Array:
    """Degrees from NMEA's ddmm.mmmm."""
    size = np.abs(values)
    degrees = np.floor(size / 100.0)
    return np.asarray(np.sign(values) * (degrees + (size - 100.0 * degrees) / 60.0), dtype=np.float64)
