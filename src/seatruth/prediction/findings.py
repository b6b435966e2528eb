"""What a user of predicted figures should know: what holds them, what is not in their intervals."""

from __future__ import annotations

import math

import pandas as pd

from seatruth.prediction.parameter_draws import ParameterDraws
from seatruth.text import listed
from seatruth.trials.finding import Finding

_LACKS = 1.5
"""Factor in the variance from which the trials' disagreement is worth a word. Chosen here [S]."""
_MISSING = 0.02
"""Share of draws without a figure from which it is worth a word. Chosen here [S]."""
_MOVED = 0.05
"""Share of draws on a bound from which the intervals are doubtful. Chosen here [S]."""


def findings(
    figures: pd.DataFrame, measured: pd.DataFrame, drawn: ParameterDraws, level: float, model_error: float
) -> list[Finding]:
    """Findings of a prediction, gravest first."""
    found = [*_doubts(drawn), *_by_priors(figures), *_missing(figures), *_outside(measured, level)]
    if model_error > 0.0:
        found.append(
            Finding(
                "note",
                "intervals-widened",
                "Figures of the fitted trials miss their predictions by more than the parameters leave open: all "
                f"intervals hold a further error of {100 * model_error:.2g} % (standard deviation).",
                "prediction",
                "`seatruth diagnose` looks for what the model lacks.",
            )
        )
    if math.isnan(drawn.lack_of_fit):
        found.append(
            Finding(
                "note",
                "one-trial-fitted",
                "One trial was fitted, so nothing tells how far trials disagree; the intervals leave that out.",
                "prediction",
                "Fit two trials or more.",
            )
        )
    elif drawn.lack_of_fit > _LACKS:
        found.append(
            Finding(
                "note",
                "trials-disagree",
                f"Trials disagree by more than their residuals let expect: intervals are wider for it "
                f"(variance of the trials' part times {drawn.lack_of_fit:.2g}).",
                "prediction",
                "`seatruth diagnose` looks for what the model lacks.",
            )
        )
    order = {"error": 0, "warning": 1, "note": 2}
    return sorted(found, key=lambda finding: order[finding.severity])


def _doubts(drawn: ParameterDraws) -> list[Finding]:
    found = []
    if drawn.fixed_by_nothing:
        found.append(
            Finding(
                "warning",
                "held-by-nothing",
                f"Neither trials nor priors nor bounds hold {listed(drawn.fixed_by_nothing)}; the intervals take the "
                "estimate as if it were known.",
                "prediction",
                "Give them a prior or bounds in [parameters].",
            )
        )
    if drawn.moved > _MOVED:
        found.append(
            Finding(
                "warning",
                "draws-on-bounds",
                f"{100 * drawn.moved:.0f} % of the draws had to be moved onto bounds or constraints: so little of the "
                "estimate's uncertainty lies inside them that the intervals are doubtful.",
                "prediction",
                "Widen the bounds, or give priors in their place.",
            )
        )
    return found


def _by_priors(figures: pd.DataFrame) -> list[Finding]:
    chosen = figures[figures.held_by == "priors"]
    if not len(chosen):
        return []
    names = [f"{row.title} ({row.manoeuvre})" for row in chosen.itertuples()]
    return [
        Finding(
            "warning",
            "held-by-priors",
            f"Priors hold {len(names)} of {len(figures)} figures, the trials hardly: {listed(names[:4])}"
            f"{' and others' if len(names) > 4 else ''}.",
            "prediction",
            "Fit a trial of that kind (a turn for a turn), or take the interval as what the priors say.",
        )
    ]


def _missing(figures: pd.DataFrame) -> list[Finding]:
    found = []
    chosen = figures[(figures.missing > _MISSING) | (figures.why != "")]
    for label, part in chosen.groupby("manoeuvre", sort=False):
        worst = part.iloc[int(part.missing.to_numpy().argmax())]
        reason = f" At the estimate: {worst.why}." if worst.why else ""
        found.append(
            Finding(
                "note",
                "figures-missing",
                f"{100 * worst.missing:.0f} % of the draws have no {worst.title} in a {label}.{reason} They count as "
                "larger than all others.",
                "prediction",
                "Raise the time limit, or narrow the priors that allow such a ship.",
            )
        )
    return found


def _outside(measured: pd.DataFrame, level: float) -> list[Finding]:
    known = measured[measured.measured.notna() & measured.lower.notna()]
    if not len(known):
        return []
    outside = known[~known.inside.astype(bool)]
    allowed = (1.0 - level) * len(known)
    if len(outside) <= 2.0 * allowed + 1.0:
        return []
    names = [f"{row.title} ({row.trial})" for row in outside.itertuples()]
    return [
        Finding(
            "warning",
            "intervals-miss",
            f"{len(outside)} of {len(known)} measured figures lie outside their {100 * level:.0f} % intervals: "
            f"{listed(names[:4])}{' and others' if len(names) > 4 else ''}. The model lacks something that none of its "
            "parameters can hold.",
            "prediction",
            "Do not rely on the intervals of other manoeuvres; `seatruth diagnose` looks for what is missing.",
        )
    ]
