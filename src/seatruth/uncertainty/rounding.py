"""Records that the model follows to their last digits, so that standard errors are those of rounding."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.study_cost import StudyCost
from seatruth.text import listed
from seatruth.trials.finding import Finding

_ROUNDED = 1e-4
"""Part of the standard errors that rounding may make before it is said: certified ones are asked for to four digits
(McCullough 1998)."""


def rounded_share(cost: StudyCost, predicted: Sequence[Array]) -> dict[str, float]:
    """By how much rounding can change the standard errors that rest on a channel, as a part of them, at most 1.

    Half a unit in the last place of each sample, u, changes the sum of squares SS of the residuals r by 2 r u each,
    and a standard error by half of the relative change of SS: by |r u| / SS. A channel that never changes is left out.

    Args:
        cost: The cost with its trials.
        predicted: Outputs (n, D) of each trial at the answer.
    """
    found = {}
    for column, channel in enumerate(cost.problem.model.outputs):
        errors, lasts = [], []
        for trial, y in zip(cost.trials, predicted):
            measured = trial.outputs.get(channel.name)
            if measured is None:
                continue
            valid = np.isfinite(measured)
            if valid.any() and np.ptp(measured[valid]) > 0:
                errors.append((measured - y[:, column])[valid])
                lasts.append(0.5 * np.spacing(np.abs(measured[valid])))
        if errors and np.isfinite(r := np.concatenate(errors)).all():
            squares, change = float(r @ r), float(np.linalg.norm(r * np.concatenate(lasts)))
            found[channel.name] = min(1.0, change / squares) if squares > 0 else 1.0
    return found


def rounded_finding(shares: dict[str, float]) -> Finding | None:
    """The finding that standard errors are those of rounding; None where they are not. `shares`: `rounded_share`."""
    rounded = {name: share for name, share in shares.items() if share > _ROUNDED}
    if not rounded:
        return None
    digits = int(-math.log10(max(rounded.values())))
    right = f"at most {digits} right {'digit' if digits == 1 else 'digits'}" if digits else "no right digit"
    return Finding(
        "warning",
        "residuals-of-rounding",
        f"The model follows the record of {listed(list(rounded))} to the last digits that a number here can hold: what "
        f"is left is rounding. The standard errors have {right} and do not describe a sensor's noise.",
        "data",
        "If these are measurements, see whether this model computed the channel; if they are synthetic, add noise.",
        channel=next(iter(rounded)) if len(rounded) == 1 else "",
    )
