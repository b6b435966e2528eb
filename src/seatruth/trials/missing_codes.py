"""Numbers that a logger writes where it has no value: -9999, 65535, 1e10.

They are numbers like any other to a reader, and a fit that takes them for measurements is ruined. A number counts as
such a code if loggers use it, if it occurs exactly, and if it lies far outside all other numbers of its column. It is
sought in the file's own unit: 65535 has no meaning once it has been converted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array

_NINES = (*(float("9" * k) for k in range(3, 11)), 99.999, 999.9, 999.99, 9999.9, 9999.99)
_SMALL_ENDS = (2.0**15 - 1, 2.0**15, 2.0**16 - 1)
_ENDS = (
    *(2.0**k - 1 for k in (31, 32, 63)),
    2.0**31,
    *(end / part for end in _SMALL_ENDS for part in (1, 10, 100, 1000)),
)
_POWERS = (*(10.0**k for k in range(10, 40)), float(np.finfo(np.float32).max), float(np.finfo(np.float64).max))
_FILL = 9.969209968386869e36
CODES = np.unique(np.array([*_NINES, *_ENDS, *_POWERS, _FILL]))
"""Magnitudes of the codes, chosen here [S]: rows of nines; the ends of integers of 16, 32 and 64 bits, those of 16 also
in tenths to thousandths, as a Doppler log's -32768 mm/s in a log in m/s; powers of ten from 1e10 on (a thruster may
well give 1e6 N); the ends of floats of 32 and 64 bits; and netCDF's fill value (9.969e36, netCDF User's Guide)."""
_ROUNDING = 1e-6
"""Relative: a code of 32 bits that is printed with seven digits."""
_OUTSIDE = 2.0
"""A code is so many times as large as every other number of the column (999 beside headings up to 360); and farther
from them than they span."""
_MOST = 3
"""A column has few codes: more of them in steps of ten are numbers on a logarithmic scale."""
_SURE = 9999.0
"""Magnitude from which a column that holds nothing else is empty; 999 could be a true number of revolutions."""


def missing_codes(values: Array) -> tuple[NDArray[np.bool_], list[float]]:
    """Which samples (n,) hold a code for a missing value, and the codes.

    Example:
        >>> import numpy as np
        >>> rows, codes = missing_codes(np.array([1.2, 1.3, -9999.0, 1.2]))
        >>> rows.tolist(), codes
        ([False, False, True, False], [-9999.0])
    """
    nothing = np.zeros(values.shape, dtype=np.bool_)
    finite = values[np.isfinite(values)]
    if not finite.size or np.abs(finite).max() < CODES[0] * (1 - _ROUNDING):
        return nothing, []
    rows = nothing.copy()
    codes = []
    # Each code is held against the numbers that are smaller than it, so that two codes do not hide one another.
    for code in np.unique(finite)[np.argsort(-np.abs(np.unique(finite)))][: _MOST + 1].tolist():
        if not _is_code(code):
            break
        rest = values[np.isfinite(values) & ~rows & (values != code)]
        if not _far(code, rest):
            break
        rows |= values == code
        codes.append(code)
    return (rows, codes) if len(codes) <= _MOST else (nothing, [])


def _is_code(value: float) -> bool:
    nearest = CODES[int(np.argmin(np.abs(CODES - abs(value))))]
    return bool(abs(abs(value) - nearest) <= _ROUNDING * nearest)


def _far(code: float, rest: Array) -> bool:
    """Whether a number lies outside all others, but for codes among them."""
    others = np.unique(rest)
    plain = np.array([x for x in others[np.argsort(-np.abs(others))][: _MOST + 1].tolist() if not _is_code(x)])
    inner = rest[np.abs(rest) <= np.abs(plain).max()] if plain.size else np.zeros(0)
    if not inner.size:
        return abs(code) >= _SURE
    span, largest = float(np.ptp(inner)), float(np.abs(inner).max())
    away = min(abs(code - float(inner.max())), abs(code - float(inner.min())))
    return abs(code) > _OUTSIDE * largest and away > span
