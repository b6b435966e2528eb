"""The section about a multi-start: the optima that its searches ended at."""

from __future__ import annotations

import numpy as np

from seatruth.report import figures
from seatruth.report.blocks import Block, Column, Pictures, Section, Text, table
from seatruth.report.numbers import count, number
from seatruth.report.sections.pictures import Album
from seatruth.report.view import View

_MOST_OPTIMA = 12
_MOST_PARAMETERS = 6


def starts(data: View, album: Album) -> Section | None:
    """Where the starts ended."""
    frame = data.starts
    if len(frame) < 2:
        return None
    lowest = float(frame["cost"].min())
    found = sorted({int(k) for k in frame["optimum"] if k > 0})
    ends = _differing(data)
    best = frame[frame["optimum"] == 1]
    lost = int((frame["optimum"] == 0).sum())
    ended = f"{count(len(frame), 'start')} ended at {count(len(found), 'optimum', 'optima')}; {len(best)} at the best."
    text = (
        f"{ended} Start 1 is at the study's own start values. Two ends are one optimum where the cost does not rise "
        "between them. A cost higher by less than 2 cannot be told from the best if the residuals are white noise of "
        "the stated size."
    )
    if lost:
        text += f" {count(lost, 'start')} found no finite cost."
    columns = [Column("optimum", "number"), Column("starts", "number"), Column("above the best", "number")]
    columns += [Column(name, "number") for name in ends]
    columns.append(Column("which starts", "long"))
    rows = []
    for k in found[:_MOST_OPTIMA]:
        here = frame[frame["optimum"] == k].sort_values(by="cost", kind="stable")
        row = [str(k), str(len(here)), number(float(here["cost"].iloc[0]) - lowest, 3)]
        row += [number(float(here[f"end {name}"].iloc[0]), 4) for name in ends]
        rows.append([*row, ", ".join(str(int(start)) for start in sorted(here["start"]))])
    more = f": the best {_MOST_OPTIMA} of {len(found)}" if len(found) > _MOST_OPTIMA else ""
    blocks: list[Block] = [Text(text)]
    if np.isfinite(frame["cost"]).sum() > 1:
        picture = album.picture(
            figures.waterfall(data),
            f"Cost at the end of {len(frame)} starts, in rising order. The table below has the optima.",
            "Where the starts ended, the best first: a level stretch is one optimum, found again and again. A curve "
            "without one says that the search hardly finds the same optimum twice.",
        )
        blocks.append(Pictures([picture]))
    if rows:
        few = len(ends) < len(data.parameters)
        shown = "; of the parameters those that differ most" if few else ""
        blocks.append(table(f"Optima{more}{shown}", columns, rows))
    return Section("starts", "Where the starts ended", blocks)


def _differing(data: View) -> list[str]:
    """The parameters that differ most between the optima, in standard errors, in the order of the parameters."""
    heads = data.starts[data.starts["optimum"] > 0].sort_values(by="cost", kind="stable").drop_duplicates("optimum")
    names = [str(name) for name in data.parameters.index if f"end {name}" in heads]
    size = data.parameters["stderr"].where(np.isfinite(data.parameters["stderr"]), data.parameters["value"].abs())
    spread = {
        name: float(np.ptp(heads[f"end {name}"])) / (float(size[name]) or 1.0) if len(heads) else 0.0 for name in names
    }
    most = sorted(names, key=lambda name: -spread[name])[:_MOST_PARAMETERS]
    return [name for name in names if name in most]
