"""How a filter of a model stands where a trial begins: along the way on which its output then is."""

from __future__ import annotations

from typing import NamedTuple


class FirstSlope(NamedTuple):
    """A part of the start of a hidden state: `factor` times the slope with which the record of `output` begins.

    The slope is that of the first `seconds` of the record, in units of the output per second. A filter that lags by T s
    begins T times the slope behind (`factor` -T); one that holds a slope begins with it (`factor` 1).

    Example:
        >>> FirstSlope("u", -0.1, 0.5).factor
        -0.1
    """

    output: str
    factor: float
    seconds: float
