"""Coefficients that a fit moves beyond what the study states of them: in a diagnosis often the cause itself.

A lost float or a fouled hull changes what a coefficient stands for, and where that is free, no effect is needed.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass

from seatruth.text import with_error
from seatruth.trials.finding import Finding

_FAR = 3.0
"""Prior standard deviations beyond which a coefficient is where it is not believed to be: once in 370. [S]"""
_NEARER = 2.0
"""Standard errors that the value may be nearer, and still be that far. [S]"""


@dataclass(frozen=True)
class Coefficient:
    """A free coefficient of the model, refitted together with the verdict's effects."""

    name: str
    """Of the coefficient."""
    unit: str
    """Its unit."""
    declared: float
    """Value in the study."""
    prior_sd: float
    """Standard deviation of its prior, whose mean is the declared value."""
    value: float
    """Refitted."""
    stderr: float
    """Its standard error; NaN where it has none."""
    at_bound: bool = False
    """Whether it ended at one of its bounds, beyond which the trials would have it."""


def moved_coefficients(
    stated: Container[str], coefficients: Iterable[Coefficient], *, beside_forces: bool = False
) -> list[Finding]:
    """A finding for each coefficient that surely lies far outside its prior; the farthest first.

    Args:
        stated: the names of those whose priors the study states: one that nobody stated is no belief to be far from.
        coefficients: the fitted ones.
        beside_forces: whether they were fitted beside forces of unknown cause.

    Example:
        >>> far, near = Coefficient("T", "s", 6.0, 1.0, 11.0, 0.5), Coefficient("K", "1/s", 1.0, 0.1, 1.1, 0.1)
        >>> [finding.where for finding in moved_coefficients({"T", "K"}, [far, near])]
        ["parameter 'T'"]
    """
    far = [one for one in coefficients if one.name in stated and _distance(one) > _FAR]
    far.sort(key=lambda one: (-_distance(one), one.name))
    return [_finding(one, beside_forces=beside_forces) for one in far]


def _distance(one: Coefficient) -> float:
    """Prior standard deviations that its value is surely off.

    An error larger than the prior's does not make it less sure: the prior would have held what trials tell no better.
    Nor does a bound, at which it has none.
    """
    error = one.prior_sd if one.at_bound else min(one.stderr, one.prior_sd)
    return (abs(one.value - one.declared) - _NEARER * error) / one.prior_sd


def _finding(one: Coefficient, *, beside_forces: bool) -> Finding:
    unit = "" if one.unit == "1" else f" {one.unit}"
    times = abs(one.value - one.declared) / one.prior_sd
    value = f"{one.value:.4g}" if one.at_bound else with_error(one.value, one.stderr)
    where = " (at its bound)" if one.at_bound else ""
    text = (
        f"The fitted {one.name}, {value}{unit}{where}, is {times:.1f} prior standard deviations from what the study"
        f" states of it, {with_error(one.declared, one.prior_sd)}{unit}."
    )
    do = (
        "If the prior holds, the vehicle has changed in what this stands for, or it makes up for something that the"
        " model lacks."
    )
    if beside_forces:
        # Of an ROV whose thrust has another form, a bollard pull of 235 N was 64; missing forces held the rest.
        do = (
            "Forces of unknown cause were fitted beside it, and may hold the rest of what it stands for: read it"
            f" together with the formula of what is missing. {do}"
        )
    elif one.at_bound or one.stderr > one.prior_sd:
        text += (
            " Without the bound it would end farther still."
            if one.at_bound
            else " The trials tell it less well than the prior does, and yet it was not held there."
        )
        do = (
            "The fit counts each sample of what the model misses as news. Fix it (`vary = false`), and compare what is"
            " missed then. Where [noise] is stated, give --estimate-noise: the noise is then that of the misfit."
            " `seatruth diagnose` counts slow errors as such, and its refitted coefficients hold to their priors."
        )
    return Finding("warning", "coefficient-far", text, f"parameter {one.name!r}", do)
