"""Draws docs/figures/diagnosis.png, the picture at the top of the README, from the result of `seatruth demo`.

python tools/readme_picture.py seatruth-demo/diagnosis
"""

from __future__ import annotations

import sys
import textwrap
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from seatruth import Diagnosis
from seatruth.effects import available
from seatruth.effects.each_trial import EachTrial
from seatruth.report.figures.style import BLUE, GREY, INK, MEASURED, VERMILLION, few_ticks, placed, styled

TARGET = Path(__file__).parents[1] / "docs" / "figures" / "diagnosis.png"
_TRIAL = "turning_circle_35"
_EFFECTS = 6


@styled
def picture(diagnosis: Diagnosis) -> Figure:
    """The headline, the track of a turning circle before and after, and the most probable effects."""
    figure = Figure(figsize=(9.6, 3.0))
    headline = "\n".join(textwrap.wrap(diagnosis.verdict.sentence, 106))
    figure.text(0.02, 0.96, headline, va="top", size=10.0, weight="bold")
    traces = diagnosis.traces[diagnosis.traces["trial"] == _TRIAL]
    north, east = (traces[traces["channel"] == name] for name in ("x", "y"))
    track = placed(figure, 0.75, 0.5, 2.6, 1.9)
    for column, colour, width, label in (
        ("measured", MEASURED, 4.0, "measured (synthetic)"),
        ("refit", VERMILLION, 1.2, "model, refitted"),
        ("effects", BLUE, 1.2, "with the named effect"),
    ):
        points = np.column_stack([east[column].to_numpy(), north[column].to_numpy()])
        points = points[np.isfinite(points).all(axis=1)]
        track.plot(points[:, 0], points[:, 1], color=colour, linewidth=width, label=label)
    track.set_aspect("equal", adjustable="datalim")
    few_ticks(track, 5, 4)
    track.set_xlabel("y (m)")
    track.set_ylabel("x (m)")
    track.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.2)
    likely = _likely(diagnosis)[:_EFFECTS]
    bars = placed(figure, 7.55, 0.5, 1.85, 1.9)
    height = np.arange(len(likely))
    bars.barh(height, [probability for _, probability in likely], color=[BLUE, *[GREY] * (len(likely) - 1)], height=0.6)
    bars.set_yticks(height, labels=[title for title, _ in likely], color=INK)
    bars.invert_yaxis()
    bars.set_xlim(0, 1)
    bars.set_xlabel("probability that it acts")
    bars.grid(visible=False, axis="y")
    return figure


def _likely(diagnosis: Diagnosis) -> list[tuple[str, float]]:
    """Titles and probabilities of effects, the highest first; the same with a value for each trial is no other one."""
    library, found = available(), {effect.name: effect.probability for effect in diagnosis.effects}
    titles = {effect.name: effect.title for effect in diagnosis.effects}
    for name in list(found):
        effect = library.get(name)
        if isinstance(effect, EachTrial) and effect.like.name in found:
            found[effect.like.name] += found.pop(name)
    return sorted(((titles[name], p) for name, p in found.items()), key=lambda one: -one[1])


def main(arguments: list[str]) -> int:
    """Loads the result in the folder that is named and writes the picture."""
    if len(arguments) != 1:
        sys.stderr.write(f"{__doc__}\n")
        return 2
    TARGET.parent.mkdir(exist_ok=True)
    picture(Diagnosis.load(arguments[0])).savefig(TARGET, dpi=100, metadata={"Software": None})
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
