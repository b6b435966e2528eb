"""Sections about the trials: fit against noise, time histories, tracks, residuals, predictions."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from seatruth.report import figures
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Table, Text, table
from seatruth.report.figures.quality import worst_ratio
from seatruth.report.figures.runs import residual_channels, track_trials
from seatruth.report.numbers import count, listed, number, percent, rounded, times
from seatruth.report.readings import channel_ratios, estimated, fits_trajectories
from seatruth.report.sections.pictures import Album
from seatruth.report.view import View
from seatruth.statistics.posterior_sample import Ensemble

MOST_PANELS = 48
"""Time histories on one page; of more, the trials that fit worst and best."""
MOST_TRACKS = 16
_BEST = 2
_LEGEND = (("measured", "measured"), ("fitted", "fitted or predicted"), ("start", "with the starting values"))
_SIMULATED = "Open loop: each trial is simulated from its first state with the recorded inputs alone. "
_BAND = ("band", "band of the parameters, 95 %")
_RESIDUAL = ("residual", "residual, measured less fitted; the band is twice the noise")


def fit(data: View, album: Album) -> Section | None:
    """The fit against the noise."""
    rows = data.fitted
    if not len(rows):
        return None
    own = estimated(data) & set(rows["channel"])
    first = "Each row is computed from its columns. " if data.is_table else _SIMULATED
    text = first + (
        "RMSE: root mean square of the residuals. Ratio: RMSE over the noise; 1 means that only noise is left. Before: "
        "RMSE with the starting values."
    )
    if own:
        text += f" The noise of {listed(sorted(own))} was estimated from these residuals: its ratio is near 1 anyway."
    blocks: list[Block] = [Text(text), _fit_table("Fit of each trial and channel", data, rows)]
    if (np.isfinite(data.fit["ratio"]) & (data.fit["ratio"] > 0)).any():
        ratios = channel_ratios(rows)
        worst = max(ratios, key=lambda name: ratios[name]) if ratios else ""
        picture = album.picture(
            figures.fit(data),
            "RMSE over noise of each channel and trial, before and after the fit."
            + (f" Largest after the fit: {worst}, {times(ratios[worst])} the noise." if worst else ""),
            "RMSE over noise, logarithmic. Shaded: within the noise.",
        )
        blocks.append(Pictures([picture]))
    return Section("fit", "Fit against the noise", blocks)


def _fit_table(caption: str, data: View, rows: pd.DataFrame) -> Table:
    columns = [
        Column("trial"),
        Column("channel"),
        Column("unit"),
        Column("RMSE", "number"),
        Column("noise", "number", "standard deviation"),
        Column("ratio", "number", "RMSE over noise"),
        Column("before", "number", "RMSE with the starting values"),
        Column("bias", "number", "mean residual"),
        Column("samples", "number"),
        Column("effective", "number", "independent samples, allowing for autocorrelation"),
        Column("autocorrelation", "number", "of neighbouring residuals"),
    ]
    out = []
    for _, row in rows.iterrows():
        channel = data.channel(str(row["channel"]))
        size = {key: float(row[key]) * channel.factor for key in ("rmse", "noise", "rmse_start", "bias")}
        out.append(
            [
                str(row["trial"]),
                channel.name,
                channel.unit,
                number(size["rmse"], 3),
                number(size["noise"], 3),
                number(row["ratio"], 3),
                number(size["rmse_start"], 3),
                rounded(size["bias"], size["rmse"]),
                f"{row['n']:.0f}" if math.isfinite(row["n"]) else "",
                f"{row['n_eff']:.0f}" if math.isfinite(row["n_eff"]) else "",
                number(row["autocorrelation"], 2),
            ]
        )
    return table(caption, columns, out)


def histories(data: View, album: Album) -> Section | None:
    """Time histories, one trial after the other."""
    names = data.trial_names
    if not names or data.is_table:
        return None
    per_trial = max(len(data.channels_of(name)) for name in names)
    chosen = worst_and_best(data, names, max(MOST_PANELS // max(per_trial, 1), 1))
    blocks: list[Block] = []
    if len(chosen) < len(names):
        blocks.append(
            Text(
                f"Shown: {len(chosen)} of {len(names)} trials, those that fit worst and best, and those held out. The "
                "table above has all of them."
            )
        )
    if data.ensemble is not None:
        blocks.append(Text(_band_text(data.ensemble)))
    bands = () if data.ensemble is None else (_BAND,)
    blocks.append(Pictures([], (*_LEGEND, *bands, _RESIDUAL)))
    for name in chosen:
        pictures = []
        for channel in data.channels_of(name):
            frame = data.trace(name, channel)
            if not np.isfinite(frame[["measured", "fitted"]].to_numpy()).any() or not np.isfinite(frame["t"]).all():
                continue
            alt = f"{channel} over time in trial {name}: measured, fitted, start, residual.{_rmse(data, name, channel)}"
            pictures.append(album.picture(figures.traces(data, name, [channel], legend=False), alt))
        if pictures:
            blocks.append(Heading(name, "held out: predicted, not fitted to" if data.is_held_out(name) else ""))
            blocks.append(Pictures(pictures))
    if not any(isinstance(block, Heading) for block in blocks):
        return None
    return Section("histories", "Time histories", blocks)


def _band_text(ensemble: Ensemble) -> str:
    """What the bands hold, and what they do not."""
    if ensemble.source == "posterior":
        made = f"95 % of what {count(ensemble.members, 'draw')} of the posterior predict lies in the blue band"
    else:
        few = " (of so few nearly from the lowest to the highest)" if ensemble.members < 40 else ""
        made = (
            f"The blue band spans what {count(ensemble.members, 'end')} of starts predict whose cost cannot be told "
            f"from the best, from the 2.5 to the 97.5 % quantile{few}"
        )
    lost = f" {count(ensemble.diverged, 'simulation')} diverged and is not in it." if ensemble.diverged == 1 else ""
    if ensemble.diverged > 1:
        lost = f" {count(ensemble.diverged, 'simulation')} diverged and are not in it."
    return (
        f"{made}. It holds what the parameters leave open, and nothing else: no measurement noise and nothing that the "
        f"model lacks, so measured values may lie outside. In the residuals it lies around zero.{lost}"
    )


def _rmse(data: View, trial: str, channel: str) -> str:
    rows = data.fit[(data.fit["trial"] == trial) & (data.fit["channel"] == channel)]
    if not len(rows) or not math.isfinite(rows["rmse"].iloc[0]):
        return ""
    unit = data.channel(channel)
    return f" RMSE {number(rows['rmse'].iloc[0] * unit.factor, 2)} {unit.unit}."


def worst_and_best(data: View, names: list[str], most: int) -> list[str]:
    """At most so many trials in their order: the worst, up to two of the best, and of those held out the worst."""
    if len(names) <= most:
        return names
    order = sorted(names, key=lambda name: -np.nan_to_num(worst_ratio(data, name), nan=-1.0))
    held = [name for name in order if data.is_held_out(name)][: max(most // 3, 1)]
    fitted = [name for name in order if not data.is_held_out(name)]
    left = max(most - len(held), 0)
    best = fitted[-min(_BEST, left // 2) :] if left // 2 else []
    worst = [name for name in fitted if name not in best][: left - len(best)]
    kept = {*held, *best, *worst}
    return [name for name in names if name in kept]


def tracks(data: View, album: Album) -> Section | None:
    """Tracks over ground."""
    names = track_trials(data)
    if not names or data.is_table:
        return None
    chosen = worst_and_best(data, names, MOST_TRACKS)
    pictures = [
        album.picture(
            figures.tracks(data, [name], legend=False),
            f"Track of trial {name}: measured, {'predicted' if data.is_held_out(name) else 'fitted'}, start.",
            "held out" if data.is_held_out(name) else "",
        )
        for name in chosen
    ]
    blocks: list[Block] = []
    if len(chosen) < len(names):
        blocks.append(Text(f"Shown: {len(chosen)} of {len(names)} trials, those that fit worst and best."))
    blocks.append(Pictures(pictures, (*_LEGEND, ("first", "where it begins"))))
    return Section("tracks", "Tracks", blocks)


def residuals(data: View, album: Album) -> Section | None:
    """Autocorrelation of the residuals."""
    if data.is_table or not residual_channels(data):
        return None
    rows = data.fitted[(data.fitted["n"] > 0) & np.isfinite(data.fitted["n_eff"])]
    text = (
        "If the model were right and the noise white, the correlation would fall to the band at once. What stays above "
        "it is motion that the model does not explain, and neighbouring samples then say partly the same."
    )
    if len(rows):
        total, effective = float(rows["n"].sum()), float(rows["n_eff"].sum())
        text += (
            f" Of {count(round(total), 'sample')} about {number(effective, 3)} ({percent(effective / total)}) count as "
            f"independent{'; the standard errors allow for it' if fits_trajectories(data) else ''}."
        )
    pictures = [
        album.picture(
            figures.autocorrelation(data, [name]),
            f"Autocorrelation of the residuals of {name} over the lag, each trial.",
        )
        for name in residual_channels(data)
    ]
    return Section("residuals", "Residuals over time", [Text(text), Pictures(pictures)])


def held_out(data: View, album: Album) -> Section | None:
    """Prediction of the trials that took no part in the fit."""
    rows = data.held_out
    if not len(rows):
        return None
    fitted, predicted = channel_ratios(data.fitted), channel_ratios(rows)
    trials = [str(name) for name in rows["trial"].unique()]
    parts = [
        f"{listed(trials)} took no part in the fit and {'is' if len(trials) == 1 else 'are'} predicted with the "
        "estimates: the fairest test of what the model is good for."
    ]
    both = [name for name in predicted if name in fitted]
    if both:
        pairs = [f"{name} {number(predicted[name], 2)} ({number(fitted[name], 2)})" for name in both]
        parts.append(f"RMSE over noise when predicted, in brackets when fitted: {listed(pairs, 12)}.")
    return Section(
        "held-out", "Prediction of trials held out", [Text(" ".join(parts)), _fit_table("Trials held out", data, rows)]
    )


def cross_validation(data: View, album: Album) -> Section | None:
    """Each trial left out in turn."""
    rows = data.cross_validation
    if not len(rows):
        return None
    columns = [
        Column("trial"),
        Column("channel"),
        Column("unit"),
        Column("RMSE predicted", "number"),
        Column("RMSE fitted", "number"),
        Column("predicted / fitted", "number"),
        Column("noise", "number"),
    ]
    out = []
    for _, row in rows.iterrows():
        channel = data.channel(str(row["channel"]))
        predicted, within, noise = (float(row[key]) * channel.factor for key in ("predicted", "fitted", "noise"))
        ratio = predicted / within if within > 0 else math.nan
        numbers = [number(x, 3) for x in (predicted, within, ratio, noise)]
        out.append([str(row["trial"]), channel.name, channel.unit, *numbers])
    blocks: list[Block] = [
        Text(
            "Each trial was left out in turn, the parameters were fitted to the others, and the trial was predicted. A "
            "prediction much worse than the fit: no other trial shows what this one does, or the parameters were bent "
            "to fit it."
        ),
        table("Left out in turn", columns, out),
    ]
    if (np.isfinite(rows["predicted"].astype(float)) & (rows["noise"].astype(float) > 0)).any():
        picture = album.picture(
            figures.cross_validation(data),
            "RMSE over noise of each trial and channel, fitted to and left out. The table above has the numbers.",
            "RMSE over noise, logarithmic.",
        )
        blocks.append(Pictures([picture]))
    return Section("cross-validation", "Leave one trial out", blocks)
