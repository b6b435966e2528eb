"""The verdict in plain words: how it ended, how well it fits, which parameters are known, what to look at first."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from seatruth.report.numbers import as_float, count, listed, number, percent, seconds, times
from seatruth.report.view import View, finite

AT_NOISE = 1.2
"""Up to this ratio of RMSE to noise a channel counts as followed to within its noise."""
FAR_ABOVE = 2.0
"""From this ratio on the misfit is one to look at first."""
WORSE_HELD_OUT = 1.5
"""A prediction this many times worse than the fit is one to look at."""
COARSE = 0.3
"""From this ratio of the discretisation error to the noise on the step is too large."""
FEW_EFFECTIVE = 0.1
"""Below this part of independent samples the residuals are strongly autocorrelated."""
MANY_DIVERGED = 0.1
PRIOR_FAR = 2.5
"""Prior standard deviations between an estimate and its prior that ask for an explanation."""
STRONG_PAIR = 0.95
_MOST_WORRIES = 8
_MOST_WEAK = 2
_OWN_WORRY = ("not-at-minimum", "coarse-steps")
"""Findings about the result rather than the data: each is said in full."""

_ENDINGS = {
    "converged": "The search converged",
    "target": "The search reached its target",
    "stall": "The search stopped because the cost no longer fell",
    "budget": "The search stopped before it converged",
    "deadline": "The search stopped before it converged",
    "interrupted": "The search was interrupted: this is the best so far",
    "failed": "The search failed",
}
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


def ending(data: View) -> str:
    """How the search ended, with its effort."""
    outcome = data.outcome
    code = str(outcome.get("code", ""))
    text = _ENDINGS.get(code, f"The search ended ({code})" if code else "How the search ended is not known")
    reason = str(outcome.get("reason", "")).strip().rstrip(".")
    effort = []
    if finite(outcome.get("evaluations")):
        effort.append(f"{count(int(outcome['evaluations']), 'evaluation')}")
    if finite(outcome.get("wall_s")):
        effort.append(seconds(outcome["wall_s"]))
    after = f" after {' in '.join(effort)}" if effort else ""
    return f"{text}{after}{f': {reason}' if reason else ''}."


def fit_in_words(data: View) -> str:
    """How the channels of the trials that were fitted to compare with their noise."""
    ratios = channel_ratios(data.fitted)
    if not len(data.fitted):
        return ""
    own = estimated(data)
    tested = {name: ratio for name, ratio in ratios.items() if name not in own}
    parts = []
    good = [name for name, ratio in tested.items() if ratio <= AT_NOISE]
    poor = {name: ratio for name, ratio in tested.items() if ratio > AT_NOISE}
    if good:
        whole = "On the trials it was fitted to, the model follows"
        parts.append(f"{whole} {listed(good)} to within the noise.")
    if poor:
        texts = [f"{name} ({times(ratio)})" for name, ratio in sorted(poor.items(), key=lambda item: -item[1])]
        every = "every channel whose noise is stated" if own else "every channel"
        lead = "The misfit is larger than the noise in" if good else f"The misfit exceeds the noise in {every}:"
        why = (
            "how much of it is the model's cannot be said before the search has ended"
            if unfinished(data)
            else "there the model leaves something out, or the stated noise is too small"
        )
        parts.append(f"{lead} {listed(texts)}; {why}.")
    sizes = [f"{name} ({_size(data, name)})" for name in ratios if name in own]
    if sizes:
        parts.append(f"The noise of {listed(sizes)} was estimated from the residuals: their size tests nothing.")
    if not ratios:
        parts.append("The noise of the recorded channels is not known, so there is nothing to measure the misfit by.")
    gain = _gain(data.fitted)
    if gain:
        parts.append(gain)
    return " ".join(parts)


def _size(data: View, name: str) -> str:
    rows = data.fitted[data.fitted["channel"] == name]
    channel = data.channel(name)
    return f"RMSE {number(pooled(rows, 'rmse') * channel.factor, 2)} {channel.unit}".strip()


def _gain(rows: pd.DataFrame) -> str:
    """How much smaller the residuals became, in the middle of all channels and trials."""
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = (rows["rmse_start"] / rows["rmse"]).replace([np.inf, -np.inf], np.nan).dropna()
    if not len(gain):
        return ""
    middle = float(gain.median())
    if middle < 1.05:
        return "The fit is hardly better than the start."
    return f"The residuals are typically {times(middle)} smaller than with the starting values."


def parameters_in_words(data: View) -> str:
    """How many parameters are known, and which are not."""
    frame = data.parameters
    if not len(frame):
        return ""
    verdicts = frame["verdict"]
    groups = {
        "weak": "only weakly identified",
        "not identifiable": "not identifiable from these trials",
        "at bound": "at a bound",
        "from prior": "known from the prior rather than from the data",
    }
    known = int((verdicts == "identified").sum())
    if known == len(frame):
        return "The parameter is identified." if known == 1 else f"All {known} free parameters are identified."
    parts = [f"{known} of {count(len(frame), 'free parameter')} {'is' if known == 1 else 'are'} identified"]
    for verdict, words in groups.items():
        names = [str(name) for name in frame.index[verdicts == verdict]]
        if names:
            parts.append(f"{listed(names)} {'is' if len(names) == 1 else 'are'} {words}")
    return "; ".join(parts) + "."


def worries(data: View) -> list[Worry]:
    """What to look at first, the gravest first."""
    found = [worry for source in _SOURCES for worry in source(data)]
    found.sort(key=lambda worry: not worry.grave)
    return found[:_MOST_WORRIES]


def unfinished(data: View) -> bool:
    """Whether the search ended before it could converge."""
    return str(data.outcome.get("code", "")) in ("budget", "deadline", "interrupted", "failed")


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
        if finding["code"] in _OWN_WORRY:
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
    far = (frame["value"] - frame["prior_mean"]).abs() / frame["prior_sd"]
    names = [str(name) for name in frame.index[(far > PRIOR_FAR).to_numpy()]]
    if names:
        yield Worry(
            f"{listed(names)} {'ends' if len(names) == 1 else 'end'} more than {number(PRIOR_FAR, 2)} prior standard "
            "deviations from the prior: one of the two is wrong.",
            "parameters",
        )
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


def channel_ratios(rows: pd.DataFrame) -> dict[str, float]:
    """RMSE over noise of each channel, pooled over its trials by their samples."""
    out = {}
    for name, part in rows.groupby("channel", sort=False):
        ratio = pooled(part, "ratio")
        if math.isfinite(ratio):
            out[str(name)] = ratio
    return out


def pooled(part: pd.DataFrame, column: str) -> float:
    """Root mean square of a column, each row counted with its samples; NaN without any."""
    part = part[np.isfinite(part[column])]
    if not len(part):
        return math.nan
    weight = part["n"].fillna(1.0).clip(lower=1.0)
    return float(np.sqrt(np.average(part[column] ** 2, weights=weight)))


def estimated(data: View) -> set[str]:
    """Channels whose noise was estimated from the residuals."""
    noise = (getattr(data.estimate, "cost", None) or {}).get("noise")
    if not isinstance(noise, Mapping):
        return set()
    return {str(name) for name, said in noise.items() if isinstance(said, Mapping) and said.get("estimated")}


def fits_trajectories(data: View) -> bool:
    """Whether the residuals that the page shows are those that the search made small; a regression has its own."""
    return str((getattr(data.estimate, "cost", None) or {}).get("kind", "trajectory")) == "trajectory"


def strong_pairs(data: View, least: float) -> list[tuple[str, str, float]]:
    """Pairs of estimates with a correlation of at least `least`, the strongest first; of a nuisance only those with
    a parameter."""
    table, own = data.correlation, set(data.parameters.index)
    values = table.to_numpy(dtype=float)
    pairs = []
    names = [str(name) for name in table.index]
    for i, j in zip(*np.nonzero(np.triu(np.abs(np.nan_to_num(values)) >= least, 1))):
        if names[i] in own or names[j] in own:
            pairs.append((names[i], names[j], float(values[i, j])))
    return sorted(pairs, key=lambda pair: -abs(pair[2]))


def findings_of(data: View) -> list[dict[str, str]]:
    """The findings of an estimate as plain texts, the gravest first."""
    return in_order(getattr(data.estimate, "findings", None) or [])


def in_order(given: Sequence[Any]) -> list[dict[str, str]]:
    """Findings as plain texts, the gravest first."""
    keys = ("severity", "code", "trial", "channel", "where", "message", "do")
    order = {"error": 0, "warning": 1, "note": 2}
    found = []
    for finding in given:
        read: Any = finding.get if isinstance(finding, dict) else lambda key, f=finding: getattr(f, key, "")
        texts = {key: str(read(key) or "") for key in keys}
        found.append(texts | {"where": _without_folders(texts["where"])})
    return sorted(found, key=lambda finding: order.get(finding["severity"], 3))


def _without_folders(where: str) -> str:
    """ "/home/me/a.csv, line 3" as "a.csv, line 3": a report is passed on, and its reader has other folders."""
    file, comma, rest = where.partition(", ")
    return f"{file.replace(chr(92), '/').rsplit('/', 1)[-1]}{comma}{rest}"
