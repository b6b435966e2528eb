"""Section about the rows of a fitted formula: measured, computed, and how far a measurement may lie from that."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from seatruth.report import figures
from seatruth.report.blocks import Block, Column, Pictures, Section, Table, Text, table
from seatruth.report.numbers import count, number
from seatruth.report.sections.pictures import Album
from seatruth.report.view import View

MOST_ROWS = 60
"""Rows in the table; of more, those whose measurement is farthest from what is computed, and those without one."""
_TEXT = (
    "The interval is where one more measurement at the same inputs would lie in 95 of 100 cases. It allows for the "
    "scatter of these rows and for how well they fix the formula, not for what the formula leaves out and all rows of "
    "one condition share: leaving whole conditions out shows that. Rows of the file without a measurement are only "
    "predicted."
)


def rows(data: View, album: Album) -> Section | None:
    """Measured against computed, and the rows with their prediction intervals."""
    if not data.is_table or not data.trial_names:
        return None
    parts = []
    for name in data.trial_names:
        frame = data.trace(name, data.channels_of(name)[0])
        parts.append(frame.assign(trial=name))
    frame = pd.concat(parts, ignore_index=True)
    inside = (frame["measured"] >= frame["lower"]) & (frame["measured"] <= frame["upper"])
    known = np.isfinite(frame["measured"]) & np.isfinite(frame["upper"] - frame["lower"])
    text = _TEXT
    if known.any():
        text += f" Of {count(int(known.sum()), 'row')} with both, {int(inside[known].sum())} lie inside."
    blocks: list[Block] = [Text(text)]
    alt = "Measured over computed values with 95 % prediction intervals; the line is where both are equal."
    blocks.append(Pictures([album.picture(figures.measured_against_computed(data), alt, alt)]))
    blocks.append(_table(data, frame))
    return Section("rows", "Measured and computed", blocks)


def _table(data: View, frame: pd.DataFrame) -> Table:
    channel = data.channel(next(iter(data.series))[1])
    inputs = [str(name) for name in frame if str(name).startswith("input ")]
    several = frame["trial"].nunique() > 1
    shown, caption = frame, "Rows"
    if len(frame) > MOST_ROWS:
        far = (frame["measured"] - frame["fitted"]).abs().fillna(math.inf).to_numpy()
        shown = frame.iloc[np.sort(np.argsort(-far, kind="stable")[:MOST_ROWS])]
        caption = f"{MOST_ROWS} of {len(frame)} rows: those without a measurement and those farthest from it"
    columns = [Column("row", "number", "of the table, the first is 1")]
    columns += [Column("trial")] if several else []
    columns += [Column(name.removeprefix("input "), "number") for name in inputs]
    columns += [Column("measured", "number"), Column("computed", "number"), Column("95 % interval")]
    columns += [Column("difference", "number", "measured less computed")]
    out = []
    for _, row in shown.iterrows():
        measured, fitted = float(row["measured"]), float(row["fitted"])
        between = (
            f"{number(row['lower'], 3)} to {number(row['upper'], 3)}" if math.isfinite(row["upper"]) else "unknown"
        )
        line = [f"{row['t'] + 1:.0f}", *([str(row["trial"])] if several else [])]
        line += [number(row[name], 4) for name in inputs]
        line += [number(measured, 4), number(fitted, 4), between, number(measured - fitted, 2)]
        out.append(line)
    return table(f"{caption}, {channel.label}", columns, out)
