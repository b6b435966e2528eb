"""The picture of the withheld-effect benchmark: what its published table says, each share beside its goal.

It is drawn from the table of experiments/README.md whenever the site is made, so that it never says anything else.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from seatruth.report.figures.style import CYCLE, INK, placed, styled

_HEADING = "## withheld"
_SHARE = re.compile(r"(?P<value>[\d.]+) \((?P<low>[\d.]+) to (?P<high>[\d.]+)\)")
_GOAL = re.compile(r"[\d.]+")
"""The bound of a goal, or both."""
_ENDS = " (95 % interval)"
"""How the head of a column with shares and intervals ends."""
_MARKS = "osD^vPX"
_ROW = 0.42
"""Height of a measure, inches."""


@dataclass(frozen=True)
class Scored:
    """A column of shares: its title; of each measure the goal as printed, the share and the ends of its interval."""

    title: str
    rows: dict[str, tuple[str, float, float, float]]


def insert(page: Path) -> None:
    """Draws the picture and puts it below the heading of the benchmark."""
    text = page.read_text(encoding="utf-8")
    heading, section = _section(text)
    found = tables(section)
    if not found:
        raise ValueError(f"{page.name} has no table of the benchmark's scores to draw")
    folder = page.parent / "figures"
    folder.mkdir(exist_ok=True)
    picture(found).savefig(folder / "withheld.svg")
    shown = (
        f"{heading}\n\n![Scores of the blind sets beside their goals](figures/withheld.svg)\n\n"
        "Shares of the table below (synthetic cases), with 95 % intervals; the black bars are the goals.\n"
    )
    page.write_text(text.replace(f"{heading}\n", shown, 1), encoding="utf-8")


def _section(text: str) -> tuple[str, str]:
    """The benchmark's heading, and what stands below it."""
    found = re.search(rf"^({_HEADING}[^\n]*)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError(f"there is no heading {_HEADING!r}")
    return found[1], found[2]


def tables(section: str) -> list[Scored]:
    """What a table of shares says in each column that has intervals, with the measures that have a goal."""
    found: list[Scored] = []
    columns: dict[int, Scored] = {}
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
        if not cells:
            columns = {}
        elif cells[:2] == ["measure", "goal"]:
            shares = [(place, cell) for place, cell in enumerate(cells) if cell.endswith(_ENDS)]
            columns = {place: Scored(cell.removesuffix(_ENDS), {}) for place, cell in shares}
            found += columns.values()
        for place, one in columns.items():
            if cells[1] and (share := _SHARE.fullmatch(cells[place])):
                value, low, high = (float(share[end]) for end in ("value", "low", "high"))
                one.rows[cells[0]] = (cells[1], value, low, high)
    return [one for one in found if one.rows]


@styled
def picture(found: Sequence[Scored]) -> Figure:
    """Each share with its interval, a mark for each column, and its goal."""
    names = list(dict.fromkeys(name for one in found for name in one.rows))
    figure = Figure(figsize=(7.6, _ROW * len(names) + 0.9))
    axes: Any = placed(figure, 3.5, 0.45, 4.0, _ROW * len(names))
    for k, one in enumerate(found):
        off = (k - (len(found) - 1) / 2) * 0.7 / len(found)
        look = {"color": CYCLE[k % len(CYCLE)], "marker": _MARKS[k % len(_MARKS)]}
        for name, (_, value, low, high) in one.rows.items():
            y = names.index(name) + off
            axes.plot([low, high], [y, y], color=look["color"], linewidth=1.0)
            axes.plot([value], [y], markersize=4.5, linestyle="none", **look)
        axes.plot([], [], linestyle="none", label=one.title, **look)
    goals = {name: next(one.rows[name][0] for one in found if name in one.rows) for name in names}
    for y, name in enumerate(names):
        for goal in _GOAL.findall(goals[name]):
            axes.plot([float(goal)] * 2, [y - 0.42, y + 0.42], color=INK, linewidth=1.8)
    axes.set_yticks(range(len(names)), labels=[f"{name} ({goals[name]})" for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel("share")
    axes.grid(visible=False, axis="y")
    figure.legend(loc="upper right", ncols=3)
    return figure
