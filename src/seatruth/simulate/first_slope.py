"""The slope with which a record begins: that of the motion before it, which filters remember.

A trial seldom begins at rest or in a steady state alone: a log may be cut where the vehicle slows down. A filter that
began as if nothing had moved before would show a late sensor in time for as long as the delay.
"""

from __future__ import annotations

import numpy as np

from seatruth.trials.trial import Trial

_FEWEST = 5
"""Samples that a slope takes at least. [S] Longer times show what came after the start."""


def first_slope(trial: Trial, channel: str, seconds: float) -> float:
    """Slope of a straight line through the first samples of an output, per second, as far as these show one.

    What a standard error of the slope could do by itself is taken off: a slope of z standard errors counts 1 - 1 / z^2,
    and none below one (the positive part of the estimator of James and Stein, 1961, of one slope about zero).

    Args:
        trial: whose output is read.
        channel: name of the output.
        seconds: from the first sample on, or over five samples, whichever is longer.

    Returns:
        Units of the output per second; zero where fewer than five samples were recorded.

    Example:
        >>> t = np.arange(0.0, 10.0, 0.1)
        >>> slowing = Trial("run", t, {}, {"u": 2.0 - 0.5 * t + 0.01 * np.cos(40.0 * t)}, synthetic=True)
        >>> round(first_slope(slowing, "u", 1.0), 2)
        -0.5
    """
    values = np.asarray(trial.outputs.get(channel, np.full(len(trial), np.nan)))
    rows = np.flatnonzero(np.isfinite(values))
    t = np.asarray(trial.t)[rows]
    if rows.size < _FEWEST:
        return 0.0
    count = max(_FEWEST, int(np.searchsorted(t, t[0] + seconds)))
    t, values = t[:count] - t[:count].mean(), values[rows[:count]]
    squares = float(t @ t)
    slope = float(t @ values) / squares
    left = values - values.mean() - slope * t
    variance = float(left @ left) / (t.size - 2) / squares
    return slope * max(0.0, 1.0 - variance / slope**2) if slope**2 > 0.0 else 0.0
