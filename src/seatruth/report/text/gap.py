"""How large the gap is and where it lies, in the sentences that the report of a diagnosis and the terminal share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import AT_NOISE, chance
from seatruth.report.numbers import Shown, listed, number, percent, shown

WORTH_MENTION = 0.05
"""Probability from which a further answer or place is mentioned. Chosen here [S]."""
_BEYOND_STATED = 4.0
"""Estimated noise, white and slow, over the stated one, from which it is told. [S] Slow errors of sensors are up to
three times the white ones."""
_SHOWS = 1.5
"""Error over noise from which a channel is said to show the gap. Chosen here [S]."""

PROBABLE = 0.5
"""Probability of an effect from which it is what fits best, and is told though it is not named. Chosen here [S]."""
SURE_FORCES = 5.0
"""nats of evidence for missing forces from which these say where it acts. [S] Odds of 150."""
FITS = ("before", "refit", "effects")
"""Columns of the fits that are compared: the declared model, refitted, and with the verdict's effects."""

PLACES = {
    **{name: f"the {name} equation" for name in ("surge", "sway", "heave", "roll", "pitch", "yaw")},
    "kinematics": "the kinematics (motion over ground against motion through the water)",
}
"""Equations in words."""


@dataclass(frozen=True)
class ChannelGap:
    """The gap of one channel over all trials: root mean square errors by fit, in the channel's unit and over noise."""

    channel: Shown
    noise: float
    rmse: Mapping[str, float]
    multiple: Mapping[str, float]


def fits(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The fits that are compared: the third only where the verdict has effects."""
    return FITS if diagnosis.augmented.get("effects") else FITS[:2]


def place_in_words(place: str) -> str:
    """ "sensor:u" as "the sensor of u"."""
    kind, _, channel = place.partition(":")
    if channel:
        return f"the {'sensor' if kind == 'sensor' else 'actuator'} of {channel}"
    return PLACES.get(place, f"the equation of {place}")


def channels(diagnosis: Diagnosis) -> list[ChannelGap]:
    """The gap by channel over all trials, errors pooled over samples."""
    found = []
    for name in dict.fromkeys(diagnosis.gap["channel"]):
        rows = diagnosis.gap[diagnosis.gap["channel"] == name]
        weight = rows["n"].to_numpy(dtype=float)
        noise = float(rows["noise"].iloc[0])
        rmse = {
            fit: float(np.sqrt((weight * rows[f"rmse_{fit}"].to_numpy(dtype=float) ** 2).sum() / weight.sum()))
            for fit in FITS
        }
        multiple = {fit: size / noise if noise > 0 else math.nan for fit, size in rmse.items()}
        found.append(ChannelGap(shown(str(name), str(rows["unit"].iloc[0])), noise, rmse, multiple))
    return found


def _beyond_stated(diagnosis: Diagnosis) -> str:
    """What is taken for noise far beyond what the study states: "times the noise" then says less than it seems to."""
    times = {
        one.channel: math.hypot(one.white, one.slow if math.isfinite(one.slow) else 0.0) / one.declared
        for one in diagnosis.noise
        if math.isfinite(one.declared)
    }
    far = {name: ratio for name, ratio in times.items() if ratio > _BEYOND_STATED}
    if not far:
        return ""
    said = listed([f"{name} ({number(ratio, 2)} times)" for name, ratio in far.items()], len(far))
    return (
        f" The noise was estimated far above what the study states for {said}: motion that the model lacks may be in"
        " it."
    )


def gap_in_words(diagnosis: Diagnosis) -> str:
    """How large the gap is before and after the refit, and its split."""
    rows = channels(diagnosis)
    if not rows:
        return ""
    worst = max(rows, key=lambda row: _or_zero(row.multiple["refit"]))
    if worst.multiple["refit"] < AT_NOISE:
        before = max(_or_zero(row.multiple["before"]) for row in rows)
        text = f"Refitted under its priors, the model meets every channel to its noise ({number(before, 2)} × before)."
        text += " What it leaves is small, but of a shape that noise does not have." if diagnosis.named else ""
    else:
        sizes = [number(worst.multiple[fit], 2) for fit in ("refit", "before")]
        text = (
            f"Refitted under its priors, the model misses {worst.channel.name} most: by {sizes[0]} times the noise "
            f"({sizes[1]} times before)."
        )
    text += _beyond_stated(diagnosis)
    shares = diagnosis.shares
    parts = [
        words.format(percent(part))
        for part, words in (
            (shares.noise, "{} is noise"),
            (shares.parameters, "the refit of the coefficients removes {}"),
            (shares.effects, "the effects of the verdict remove {}"),
            (shares.left, "{} is not explained"),
        )
        if part >= 0.005
    ]
    return f"{text} Of the misfit of the declared model, {listed(parts)}." if parts else text


def where_in_words(diagnosis: Diagnosis) -> str:
    """Place, channels, time and operating region."""
    sentences = []
    if diagnosis.verdict.places:
        acting = "It acts in" if diagnosis.verdict.kind == "effects" else "It most likely acts in"
        said = listed([place_in_words(place) for place in diagnosis.verdict.places])
        other = _places_of_others(diagnosis)
        sentences.append(f"{acting} {said}{f', or in {listed(other)}' if other else ''}.")
    elif diagnosis.verdict.kind != "no_gap":
        likely = [(place, p) for place, p in ranked(diagnosis.places) if p >= WORTH_MENTION][:3]
        if likely:
            shares = listed([f"{place_in_words(place)} ({chance(p)})" for place, p in likely])
            if diagnosis.verdict.kind != "unknown":
                sentences.append(f"If something acts, the most probable places are {shares}.")
            elif _rests_on_what_is_not_named(diagnosis, likely[0][0]):
                sentences.append(f"What fits best acts in {shares}, and is not named.")
            elif likely[0][1] > 0.5:
                sentences.append(f"It most probably acts in {shares}.")
            else:
                sentences.append(
                    _of_missing_forces(diagnosis)
                    or f"It is not decided where it acts: the most probable places are {shares}."
                )
    seen = sorted(
        (row for row in channels(diagnosis) if row.multiple["refit"] > _SHOWS), key=lambda row: -row.multiple["refit"]
    )
    if seen:
        multiples = [f"{row.channel.name} ({number(row.multiple['refit'], 2)} × noise)" for row in seen[:4]]
        sentences.append(f"It shows in {listed(multiples)}.")
    time, region = significant(diagnosis.time), significant(diagnosis.region)
    if len(time) and len(time) == len(diagnosis.time):
        sentences.append("It shows at all times.")
    elif len(time):
        first = time.iloc[int(np.argmax(time["misfit"]))]
        span = f"{first['trial']}, {number(first['from_s'])} to {number(first['to_s'])} s"
        sentences.append(f"In time it shows in {len(time)} of {len(diagnosis.time)} parts, most in {span}.")
    if len(region):
        sentences.append(f"It is worst at {cell_in_words(region.iloc[int(np.argmax(region['misfit']))])}.")
    return " ".join(sentences) or "It shows nowhere in particular."


def _places_of_others(diagnosis: Diagnosis) -> list[str]:
    """Where the look-alikes of a named cause act, if elsewhere: of two alike thrusters, either may be the weak one."""
    acts_on = {effect.name: effect.acts_on for effect in diagnosis.effects}
    others = [
        place_in_words(place)
        for cause in diagnosis.verdict.causes
        for name in cause.effects[1:]
        for place in acts_on.get(name, ())
        if place not in diagnosis.verdict.places
    ]
    return list(dict.fromkeys(others))


def _rests_on_what_is_not_named(diagnosis: Diagnosis, place: str) -> bool:
    """Whether an effect that is probable acts at a place of an unknown cause: it was refused, and its place with it."""
    return any(place in effect.acts_on and effect.probability > PROBABLE for effect in diagnosis.effects)


def _of_missing_forces(diagnosis: Diagnosis) -> str:
    """Where forces that no effect describes act, the largest first; empty where the trials do not surely show any."""
    missing = diagnosis.discrepancy
    if missing is None or missing.log_evidence < SURE_FORCES:
        return ""
    sizes = [
        f"{place_in_words(name)} ({percent(size)} of its usual acceleration)"
        for name, size in ranked(missing.sizes)
        if size >= WORTH_MENTION
    ]
    return f"No effect decides where it acts; forces are missing in {listed(sizes[:3])}." if sizes else ""


def ranked(probabilities: Mapping[str, float]) -> list[tuple[str, float]]:
    """The most probable first; equal ones by name."""
    return sorted(probabilities.items(), key=lambda entry: (-entry[1], entry[0]))


def significant(cells: pd.DataFrame) -> pd.DataFrame:
    """Cells of time or region that stand out with the false discovery rate held at 5 %."""
    return cells.loc[cells["significant"].astype(bool)] if len(cells) else cells


def cell_in_words(cell: pd.Series) -> str:
    """ "speed 0.5 to 0.8 m/s", "heading north-east"."""
    if cell["variable"] == "heading":
        return f"heading {cell['cell']}"
    scale = shown(str(cell["variable"]), str(cell["unit"]))
    ends = " to ".join(number(float(cell[end]) * scale.factor, 3) for end in ("from", "to"))
    return f"{scale.name} {ends} {scale.unit}".strip()


def _or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0
