"""Coefficients that the refit moves beyond what the study states of them: often the cause itself.

A lost float or a fouled hull changes what a coefficient stands for, and where that is free, no effect is needed.
"""

from __future__ import annotations

from collections.abc import Sequence

from seatruth.diagnosis.parts import Coefficient
from seatruth.study import Study
from seatruth.text import with_error
from seatruth.trials.finding import Finding

_FAR = 3.0
"""Prior standard deviations beyond which a coefficient is where it is not believed to be: once in 370. [S]"""
_NEARER = 2.0
"""Standard errors that the value may be nearer, and still be that far. [S]"""


def moved_coefficients(study: Study, coefficients: Sequence[Coefficient]) -> list[Finding]:
    """A finding for each coefficient that surely lies far outside the prior that the study states; the farthest first.

    A prior that nobody stated is no belief to be far from.
    """
    stated = {p.name for p in study.parameters if p.vary and p.prior is not None}
    far = [one for one in coefficients if one.name in stated and _distance(one) > _FAR]
    return [_finding(one) for one in sorted(far, key=lambda one: (-_distance(one), one.name))]


def _distance(one: Coefficient) -> float:
    """Prior standard deviations that its value is surely off."""
    return (abs(one.value - one.declared) - _NEARER * one.stderr) / one.prior_sd


def _finding(one: Coefficient) -> Finding:
    unit = "" if one.unit == "1" else f" {one.unit}"
    times = abs(one.value - one.declared) / one.prior_sd
    text = (
        f"The refitted {one.name}, {with_error(one.value, one.stderr)}{unit}, is {times:.1f} prior standard deviations"
        f" from what the study states of it, {with_error(one.declared, one.prior_sd)}{unit}."
    )
    do = (
        "If the prior holds, the vehicle has changed in what this stands for, or it makes up for something that the"
        " model lacks."
    )
    return Finding("warning", "coefficient-far", text, f"parameter {one.name!r}", do)
