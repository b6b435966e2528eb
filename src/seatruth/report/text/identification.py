"""The verdict in plain words: how it ended, how well it fits, which parameters are known."""

from __future__ import annotations

import numpy as np
import pandas as pd

from seatruth.report.numbers import count, listed, number, seconds, times
from seatruth.report.readings import channel_ratios, estimated, findings_of, pooled, unfinished
from seatruth.report.view import View, finite

AT_NOISE = 1.2
"""Up to this ratio of RMSE to noise a channel counts as followed to within its noise."""

_ENDINGS = {
    "converged": "The search converged",
    "target": "The search reached its target",
    "stall": "The search stopped because the cost no longer fell",
    "budget": "The search stopped before it converged",
    "deadline": "The search stopped before it converged",
    "interrupted": "The search was interrupted: this is the best so far",
    "failed": "The search failed",
}


def ending(data: View) -> str:
    """How the search ended, with its effort."""
    outcome = data.outcome
    code = str(outcome.get("code", ""))
    text = _ENDINGS.get(code, f"The search ended ({code})" if code else "How the search ended is not known")
    if code == "converged" and any(finding["code"] == "not-at-minimum" for finding in findings_of(data)):
        text += ", but short of a minimum"
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
