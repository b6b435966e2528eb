"""Figures of the trials: time histories with residuals, tracks, and the autocorrelation of the residuals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from seatruth.arrays import Array
from seatruth.report.figures.posterior import HALF, band
from seatruth.report.figures.style import (
    BLUE,
    CYCLE,
    DASHES,
    FAINT,
    GREY,
    INK,
    MEASURED,
    VERMILLION,
    few_ticks,
    nothing,
    placed,
    spaced,
    styled,
    text,
    thinned,
    trace,
    zoomable,
)
from seatruth.report.numbers import number
from seatruth.report.view import View, view

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

START_DASHES = (0, (4, 2))
_CELL = (4.8, 2.75)
_LAGS = 60
"""Lags in the figure of the autocorrelation."""
_ACF_SPAN = 0.25
"""And the longest of them, as part of the trial."""


@styled
def traces(
    estimate: Estimate | View, trial: str | None = None, channels: Sequence[str] | None = None, legend: bool = True
) -> Figure:
    """Measured, fitted and start over time, one panel a channel, the residuals (measured - fitted) below each.

    `trial`: by default the first. The grey band of the residuals is twice the noise; a blue one is that of the
    ensemble. Angles in degrees.
    """
    data = view(estimate)
    trial = trial if trial is not None else next(iter(data.trial_names), "")
    chosen = [name for name in data.channels_of(trial) if channels is None or name in channels]
    chosen = [name for name in chosen if _any_finite(data, trial, name)]
    if not chosen:
        return nothing("No time histories.")
    across = min(len(chosen), 2)
    down = math.ceil(len(chosen) / across)
    top = 0.3 if legend else 0.0
    figure = Figure(figsize=(_CELL[0] * across, _CELL[1] * down + top))
    for k, name in enumerate(chosen):
        left, bottom = _CELL[0] * (k % across), _CELL[1] * (down - 1 - k // across)
        upper = placed(figure, left + 0.72, bottom + 1.16, 3.93, 1.32)
        lower = placed(figure, left + 0.72, bottom + 0.44, 3.93, 0.6, sharex=upper)
        _history(upper, lower, data, trial, name)
    if legend:
        _legend(figure, data.is_held_out(trial), with_band="band_lower" in data.trace(trial, chosen[0]))
    return figure


def _any_finite(data: View, trial: str, channel: str) -> bool:
    frame = data.trace(trial, channel)
    return bool(np.isfinite(frame[["measured", "fitted"]].to_numpy()).any() and np.isfinite(frame["t"]).all())


def _history(upper: Axes, lower: Axes, data: View, trial: str, name: str) -> None:
    frame, channel = data.trace(trial, name), data.channel(name)
    t = frame["t"].to_numpy()
    measured, fitted, start = (frame[column].to_numpy() for column in ("measured", "fitted", "start"))
    residual = measured - fitted
    if "band_lower" in frame:
        band(upper, lower, t, fitted, (frame["band_lower"].to_numpy(), frame["band_upper"].to_numpy()))
    _line(upper, t, measured, color=MEASURED, linewidth=2.6, gid=trace("measured"))
    _line(upper, t, start, color=VERMILLION, linestyle=START_DASHES, linewidth=1.0, gid=trace("start"))
    _line(upper, t, fitted, color=BLUE, linewidth=1.2, gid=trace("fitted"))
    _limits(upper, (measured, fitted), start)
    noise = data.noise(trial, name)
    if math.isfinite(noise) and noise > 0:
        lower.axhspan(-2 * noise, 2 * noise, color=FAINT, linewidth=0)
    lower.axhline(0, color=GREY, linewidth=0.7)
    _line(lower, t, residual, color=INK, linewidth=0.7, gid=trace("residual"))
    if np.isfinite(residual).any():
        size = 1.08 * max(float(np.nanmax(np.abs(residual))), 2.4 * noise if math.isfinite(noise) else 0.0, 1e-12)
        lower.set_ylim(-size, size)
    few_ticks(upper, 6, 4)
    lower.yaxis.set_major_locator(MaxNLocator(2, symmetric=True))
    span = float(t[-1] - t[0]) or 1.0
    upper.set_xlim(t[0] - 0.01 * span, t[-1] + 0.01 * span)
    upper.tick_params(labelbottom=False)
    upper.set_ylabel(text(channel.label, 24))
    lower.set_ylabel("residual")
    lower.set_xlabel("t (s)")
    for axes in (upper, lower):
        axes.yaxis.set_label_coords(-0.148, 0.5)
        zoomable(axes, "t")
    upper.set_title(_summary(data, trial, name), loc="right", pad=3, color=INK)


def _summary(data: View, trial: str, name: str) -> str:
    rows = data.fit[(data.fit["trial"] == trial) & (data.fit["channel"] == name)]
    if not len(rows) or not math.isfinite(rows["rmse"].iloc[0]):
        return ""
    row, channel = rows.iloc[0], data.channel(name)
    size = f"RMSE {number(row['rmse'] * channel.factor, 2)} {channel.unit}".strip()
    if math.isfinite(row["rmse_start"]):
        size += f", before {number(row['rmse_start'] * channel.factor, 2)}"
    return f"{size}; {number(row['ratio'], 2)} × noise" if math.isfinite(row["ratio"]) else size


def _line(axes: Axes, t: Array, y: Array, **kwargs: Any) -> None:
    y = np.where(np.isfinite(y), y, np.nan)
    line = spaced(t, y)
    t, y = t[line], y[line]
    kept = thinned(t, y)
    axes.plot(t[kept], y[kept], **kwargs)


def _limits(axes: Axes, main: Sequence[Array], other: Array) -> None:
    """Limits that hold what was measured and fitted; a start far away is cut, so that it cannot flatten them."""
    values = np.concatenate([y[np.isfinite(y)] for y in main])
    if not values.size:
        return
    low, high = float(values.min()), float(values.max())
    span = (high - low) or abs(high) or 1.0
    beyond = other[np.isfinite(other)]
    if beyond.size:
        low = min(low, max(float(beyond.min()), low - 0.5 * span))
        high = max(high, min(float(beyond.max()), high + 0.5 * span))
    room = 0.05 * ((high - low) or span)
    axes.set_ylim(low - room, high + room)


def _legend(figure: Figure, held_out: bool, tracks_only: bool = False, with_band: bool = False) -> None:
    marks: list[Artist] = [
        Line2D([], [], color=MEASURED, linewidth=2.6, label="measured"),
        Line2D([], [], color=BLUE, linewidth=1.2, label="predicted" if held_out else "fitted"),
        Line2D([], [], color=VERMILLION, linestyle=START_DASHES, linewidth=1.0, label="start"),
    ]
    if not tracks_only:
        marks.append(Line2D([], [], color=INK, linewidth=0.7, label="residual"))
    if with_band:
        marks.append(Patch(color=HALF, alpha=0.6, label="parameters, 95 %"))
    figure.legend(handles=marks, loc="upper left", ncols=5, columnspacing=1.2, borderaxespad=0.2)


def track_trials(data: View) -> list[str]:
    """Trials with both positions in their time histories."""
    return [name for name in data.trial_names if {"x", "y"} <= set(data.channels_of(name)) and _track(data, name)]


@styled
def tracks(estimate: Estimate | View, trials: Sequence[str] | None = None, legend: bool = True) -> Figure:
    """Tracks over ground with equal axes, x up and y to the right, one panel a trial."""
    data = view(estimate)
    chosen = [name for name in track_trials(data) if trials is None or name in trials]
    if not chosen:
        return nothing("No trial has both x and y.")
    across = min(len(chosen), 2)
    down = math.ceil(len(chosen) / across)
    top = 0.3 if legend else 0.0
    shapes = [_track_height(_track(data, name)) for name in chosen]
    heights = [max(shapes[k * across : (k + 1) * across]) for k in range(down)]
    figure = Figure(figsize=(4.8 * across, sum(heights) + 0.78 * down + top))
    up = sum(heights) + 0.78 * down
    for k, name in enumerate(chosen):
        if k % across == 0:
            up -= heights[k // across] + 0.78
        axes = placed(figure, 4.8 * (k % across) + 0.72, up + 0.46, 3.93, heights[k // across])
        _draw_track(axes, _track(data, name), text(name))
    if legend:
        _legend(figure, all(data.is_held_out(name) for name in chosen), tracks_only=True)
    return figure


Track = dict[str, tuple[Array, Array]]


def _track(data: View, trial: str) -> Track:
    """(y, x) of what was measured, fitted and simulated at the start; empty without any point."""
    x, y = data.trace(trial, "x"), data.trace(trial, "y")
    if len(x) != len(y) or not np.array_equal(x["t"], y["t"]):
        return {}
    found: Track = {}
    for name in ("measured", "fitted", "start"):
        east, north = y[name].to_numpy(dtype=float), x[name].to_numpy(dtype=float)
        known = np.isfinite(east) & np.isfinite(north)
        if known.any():
            found[name] = (np.where(known, east, np.nan), np.where(known, north, np.nan))
    return found if "measured" in found or "fitted" in found else {}


def _box(track: Track) -> tuple[float, float, float, float]:
    """Limits around what was measured and fitted, equal scales kept in mind."""
    points = [track[name] for name in ("measured", "fitted") if name in track]
    east, north = (np.concatenate([point[k] for point in points]) for k in (0, 1))
    west, right, south, top = np.nanmin(east), np.nanmax(east), np.nanmin(north), np.nanmax(north)
    room = 0.06 * max(float(right - west), float(top - south), 1e-6)
    return float(west) - room, float(right) + room, float(south) - room, float(top) + room


def _track_height(track: Track) -> float:
    """Inches for a panel 3.93 in wide so that equal axes fill it, within reason."""
    west, east, south, north = _box(track)
    return float(np.clip(3.93 * (north - south) / (east - west), 1.3, 3.6))


def _draw_track(axes: Axes, track: Track, title: str) -> None:
    looks: dict[str, dict[str, Any]] = {
        "measured": {"color": MEASURED, "linewidth": 2.6},
        "start": {"color": VERMILLION, "linestyle": START_DASHES, "linewidth": 1.0},
        "fitted": {"color": BLUE, "linewidth": 1.2},
    }
    for name, look in looks.items():
        if name in track:
            east, north = track[name]
            line = spaced(_clock(east), east)
            east, north = east[line], north[line]
            kept = np.union1d(thinned(_clock(east), east, 300), thinned(_clock(north), north, 300))
            axes.plot(east[kept], north[kept], gid=trace(name), **look)
    east, north = next(iter(track.values()))
    first = int(np.flatnonzero(np.isfinite(east))[0])
    axes.plot([east[first]], [north[first]], marker="o", color=INK, markersize=4, zorder=5)
    west, right, south, top = _box(track)
    wide, high = axes.get_position().width, axes.get_position().height
    across, up = axes.figure.get_size_inches() if isinstance(axes.figure, Figure) else (1.0, 1.0)
    shape = (high * up) / (wide * across)
    more_east = max((top - south) / shape - (right - west), 0.0) / 2
    more_north = max((right - west) * shape - (top - south), 0.0) / 2
    axes.set_xlim(west - more_east, right + more_east)
    axes.set_ylim(south - more_north, top + more_north)
    axes.set_aspect("equal", adjustable="box")
    zoomable(axes)
    few_ticks(axes, 6, 5)
    axes.set_xlabel("y (m)")
    axes.set_ylabel("x (m)")
    axes.set_title(title, loc="right", pad=3, color=INK)


def _clock(values: Array) -> Array:
    return np.arange(len(values), dtype=float)


@styled
def autocorrelation(estimate: Estimate | View, channels: Sequence[str] | None = None) -> Figure:
    """Autocorrelation of the residuals over the lag, one panel a channel, one line a trial; the band is that of white
    noise (95 %)."""
    data = view(estimate)
    found = residual_channels(data)
    chosen = [name for name in found if channels is None or name in channels]
    if not chosen:
        return nothing("No residuals.")
    across = min(len(chosen), 2)
    down = math.ceil(len(chosen) / across)
    figure = Figure(figsize=(4.8 * across, 2.0 * down))
    for k, name in enumerate(chosen):
        axes = placed(figure, 4.8 * (k % across) + 0.6, 2.0 * (down - 1 - k // across) + 0.46, 4.05, 1.26)
        _autocorrelation(axes, data, name)
    return figure


def residual_channels(data: View) -> list[str]:
    """Channels that have residuals in a trial that was fitted to."""
    return list(
        dict.fromkeys(
            channel
            for (_, channel), rows in data.series.items()
            if not rows["held_out"].iloc[0] and np.isfinite(rows["measured"] - rows["fitted"]).any()
        )
    )


def _autocorrelation(axes: Axes, data: View, channel: str) -> None:
    least = math.inf
    for k, trial in enumerate(name for name in data.trial_names if not data.is_held_out(name)):
        frame = data.trace(trial, channel)
        residual = (frame["measured"] - frame["fitted"]).to_numpy()
        if np.isfinite(residual).sum() < 8 or not np.nanstd(residual) > 0:
            continue
        step = float(np.median(np.diff(frame["t"].to_numpy())))
        values = acf(residual)
        kept = np.unique(np.linspace(0, len(values) - 1, _LAGS).round().astype(int))
        axes.plot(kept * step, values[kept], color=CYCLE[k % 6], linestyle=DASHES[k % 6], linewidth=1.0)
        least = min(least, float(np.isfinite(residual).sum()))
    if math.isfinite(least):
        band = 1.96 / math.sqrt(least)
        axes.axhspan(-band, band, color=FAINT, linewidth=0, zorder=0)
    axes.axhline(0, color=GREY, linewidth=0.7)
    axes.set_ylim(-1.05, 1.05)
    axes.set_yticks([-1, 0, 1])
    axes.xaxis.set_major_locator(MaxNLocator(6))
    axes.set_xlim(left=0)
    axes.set_xlabel("lag (s)")
    axes.set_ylabel("correlation")
    axes.set_title(text(channel), loc="right", pad=3, color=INK)


def acf(residual: Array) -> Array:
    """Autocorrelation (lags 0, 1, ...) of a residual (n,) with NaN where there is no sample, up to a quarter of it."""
    known = np.isfinite(residual)
    x = np.where(known, residual - residual[known].mean(), 0.0)
    n = max(int(_ACF_SPAN * len(x)), 2)
    length = 1 << (2 * len(x) - 1).bit_length()
    power = np.fft.irfft(np.abs(np.fft.rfft(x, length)) ** 2, length)[:n]
    pairs = np.fft.irfft(np.abs(np.fft.rfft(known.astype(float), length)) ** 2, length)[:n].round()
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(pairs > 0, power / pairs / (power[0] / pairs[0]), np.nan))
