"""What to look at first in an identification, in plain words, with the section that shows it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from seatruth.report.numbers import as_float, count, listed, number, percent, times
from seatruth.report.readings import (
    channel_ratios,
    estimated,
    findings_of,
    fits_trajectories,
    strong_pairs,
    unfinished,
)
from seatruth.report.view import View

FAR_ABOVE = 2.0
"""From this ratio on the misfit is one to look at first."""
WORSE_HELD_OUT = 1.5
"""A prediction this many times worse than the fit is one to look at."""
COARSE = 0.3
"""From this ratio of the discretisation error to the noise on the step is too large."""
FEW_EFFECTIVE = 0.1
"""Below this part of independent samples the residuals are strongly autocorrelated."""
MANY_DIVERGED = 0.1
STRONG_PAIR = 0.95
_MOST_WORRIES = 8
_MOST_WEAK = 2
_OWN_WORRY = (
    *("runs-stray", "initial-state-far", "exclusive-optima", "optimum-found-once", "better-optimum"),
    *("not-at-minimum", "coarse-steps", "posterior-short", "posterior-narrow"),
    *("posterior-drifts", "residuals-of-rounding", "input-reversed", "input-unit", "beyond-noise", "step-in-gap"),
    "coefficient-far",
)
"""Findings about the result rather than the data: each is said in full."""
UNFINISHED = {
    "budget": "Give it more evaluations and see whether the estimates still move.",
    "deadline": "Give it more time and see whether the estimates still move.",
    "interrupted": "Run the same command again to go on.",
    "failed": "Do not use the estimates.",
    "stall": "Start it from elsewhere, or with another optimizer, and see whether it ends at the same place.",
}


@dataclass(frozen=True)
class Worry:
    """Something to look at, and the section that shows it."""

    text: str
    section: str
    grave: bool = False


def worries(data: View) -> list[Worry]:
    """What to look at first, the gravest first."""
    found = [worry for source in _SOURCES for worry in source(data)]
    found.sort(key=lambda worry: not worry.grave)
    return found[:_MOST_WORRIES]


def _of_search(data: View) -> Iterator[Worry]:
    code = str(data.outcome.get("code", ""))
    short = any(finding["code"] == "not-at-minimum" for finding in findings_of(data))
    if code in UNFINISHED and not (short and code in ("budget", "stall")):
        yield Worry(UNFINISHED[code], "search", grave=unfinished(data))
    diverged = as_float(data.outcome.get("diverged")) / max(as_float(data.outcome.get("evaluations")), 1.0)
    if diverged > MANY_DIVERGED:
        share = percent(diverged)
        yield Worry(f"{share} of the candidates diverged: the bounds may be too wide for this model.", "search")


def _of_findings(data: View) -> Iterator[Worry]:
    findings = findings_of(data)
    for finding in findings:
        if finding["code"] in _OWN_WORRY and finding["severity"] != "note":
            yield Worry(f"{finding['message']} {finding['do']}".strip(), "findings", grave=True)
    findings = [finding for finding in findings if finding["code"] not in _OWN_WORRY]
    for severity, grave in (("error", True), ("warning", False)):
        some = [finding for finding in findings if finding["severity"] == severity]
        if some:
            first = some[0]
            what = first["message"].rstrip(".")
            where = f"{first['where']}: " if first["where"] else ""
            more = f" (and {len(some) - 1} more)" if len(some) > 1 else ""
            yield Worry(f"{count(len(some), severity).capitalize()}: {where}{what}{more}.", "findings", grave)


def _of_steps(data: View) -> Iterator[Worry]:
    coarse = data.discretisation[data.discretisation["ratio"] > COARSE]
    if len(coarse) and not any(finding["code"] == "coarse-steps" for finding in findings_of(data)):
        worst = coarse["ratio"].idxmax()
        share = percent(coarse["ratio"].max())
        yield Worry(
            f"The time step is too large: its error in {worst} is {share} of the noise. Set max_step.",
            "discretisation",
            grave=bool(coarse["ratio"].max() > 1),
        )


def _of_fit(data: View) -> Iterator[Worry]:
    own = estimated(data)
    ratios = {k: v for k, v in channel_ratios(data.fitted).items() if v > FAR_ABOVE and k not in own}
    if ratios and not unfinished(data):
        names = sorted(ratios, key=lambda name: -ratios[name])
        yield Worry(
            f"{listed(names)} {'is' if len(names) == 1 else 'are'} missed by {times(ratios[names[0]])} the noise"
            f"{' at worst' if len(names) > 1 else ''}. The error bars allow for residuals that hang together in time, "
            "but not for coefficients that bend to make up for what the model lacks.",
            "fit",
            grave=True,
        )


def _of_prediction(data: View) -> Iterator[Worry]:
    fitted, predicted = channel_ratios(data.fitted), channel_ratios(data.held_out)
    worse = {k: v / fitted[k] for k, v in predicted.items() if k in fitted and v > WORSE_HELD_OUT * max(fitted[k], 1.0)}
    if worse:
        names = sorted(worse, key=lambda name: -worse[name])
        yield Worry(
            f"The trials held out are predicted worse than the fit: {listed(names)} by up to "
            f"{times(worse[names[0]])}. The model does not carry over as well as the fit suggests.",
            "held-out",
        )
    table = data.cross_validation
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (table["predicted"] / table["fitted"]).astype(float)
    bad = table[(ratio > WORSE_HELD_OUT * 1.5) & (table["predicted"] > table["noise"].fillna(0))]
    if len(bad):
        trials = [str(name) for name in bad["trial"].unique()]
        yield Worry(
            f"Left out in turn, {listed(trials)} {'is' if len(trials) == 1 else 'are'} predicted up to "
            f"{times(ratio[bad.index].max())} worse than fitted: no other trial shows what "
            f"{'it shows' if len(trials) == 1 else 'they show'}.",
            "cross-validation",
        )


def _of_parameters(data: View) -> Iterator[Worry]:
    frame = data.parameters
    at_bound = [str(name) for name in frame.index[frame["at_bound"]]]
    if at_bound:
        yield Worry(
            f"{listed(at_bound)} stopped at a bound: no standard error there, and those of the others hold only if the "
            "bound is right.",
            "parameters",
            grave=True,
        )
    lost = [str(name) for name in frame.index[frame["verdict"] == "not identifiable"]]
    if lost:
        yield Worry(f"Do not use the {'value' if len(lost) == 1 else 'values'} of {listed(lost)}: fix "
                    f"{'it' if len(lost) == 1 else 'them'}, give a prior, or add a trial that moves "
                    f"{'it' if len(lost) == 1 else 'them'}.", "combinations")  # fmt: skip
    # A combination of one is among the lost above.
    joint = [item for item in data.weak if len(item.get("combination") or {}) > 1]
    yield from (Worry(str(item.get("sentence", "")), "combinations") for item in joint[:_MOST_WEAK])
    pairs = strong_pairs(data, STRONG_PAIR)
    if pairs and not data.weak:
        a, b, value = pairs[0]
        yield Worry(f"{a} and {b} are correlated by {number(value, 3)}: read them together.", "correlation")


def _of_residuals(data: View) -> Iterator[Worry]:
    rows = data.fitted[data.fitted["n"] > 0]
    part = (rows["n_eff"] / rows["n"]).dropna()
    if len(part) and float(part.median()) < FEW_EFFECTIVE and fits_trajectories(data):
        yield Worry(
            f"The residuals hang together in time: typically {percent(float(part.median()))} of the samples count as "
            "independent. The standard errors allow for it; what causes it is in no parameter.",
            "residuals",
        )


_SOURCES = (_of_search, _of_findings, _of_steps, _of_fit, _of_parameters, _of_prediction, _of_residuals)
