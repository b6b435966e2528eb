"""Angles from what a log has in their place: cosine and sine, or a quaternion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.readers.tables import Table

_LENGTH = 0.2
"""Part by which the length of a direction may differ from 1: more is no rounding and no averaging (chosen here [S])."""
EULER = ("phi", "theta", "psi")


def from_vector(table: Table, columns: Sequence[str], parts: Sequence[Array]) -> Array:
    """Angle (n,) rad from its cosine and sine (n,), of any length but zero; messages name the table and its columns."""
    cosine, sine = parts
    none = np.flatnonzero(np.hypot(cosine, sine) == 0.0)
    if none.size:
        raise BadInput(
            f"{none.size} sample(s) have no direction: both numbers are zero",
            where=f"{table.source}, {table.places(none)}, columns {', '.join(map(repr, columns))}",
            do="Leave missing values empty, or mark them with invalid_where.",
        )
    return np.asarray(np.arctan2(sine, cosine), dtype=np.float64)


def from_quaternion(table: Table, columns: Sequence[str], parts: Sequence[Array], channel: str) -> Array:
    """Roll, pitch or yaw (n,) rad from w, x, y, z (n,) of the quaternion that turns body axes to earth axes.

    The angles are those of the turns yaw, pitch, roll about z, y, x ([L] Fossen, Handbook of Marine Craft
    Hydrodynamics and Motion Control, 2nd ed., section 2.2.2).
    """
    where = f"{table.source}, columns {', '.join(map(repr, columns))}"
    if channel not in EULER:
        raise BadInput(f"a quaternion gives {', '.join(EULER)} and not {channel!r}", where=where, do="Remove it.")
    w, x, y, z = parts
    length = np.sqrt(w * w + x * x + y * y + z * z)
    wrong = np.flatnonzero(np.abs(length - 1.0) > _LENGTH)
    if wrong.size:
        raise BadInput(
            f"{wrong.size} sample(s) are no quaternion: the length of the first is {length[wrong[0]]:.3g}, not 1",
            where=f"{table.source}, {table.places(wrong)}, columns {', '.join(map(repr, columns))}",
            do="Name the columns in the order w, x, y, z.",
        )
    w, x, y, z = w / length, x / length, y / length, z / length
    if channel == "phi":
        angle = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    elif channel == "theta":
        angle = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    else:
        angle = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.asarray(angle, dtype=np.float64)
