"""Programs that need no signatures: the rule of the worst channel, and the prior alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from withheld.programs.common import effects_on, refitted
from withheld.verdicts import verdict

BLAMED = {
    "u": "speed_bias", "v": "wind", "r": "rudder_offset", "psi": "heading_bias", "x": "current", "y": "current",
    "w": "cross_flow_vertical", "q": "plane_offset", "theta": "plane_offset", "z": "depth_scale",
}  # fmt: skip
"""What an engineer would blame first when a channel is off."""
QUIET = 1.15
"""Multiples of the data sheet's noise up to which a channel counts as met."""
NONE, UNKNOWN = 0.12, 0.12
"""Prior probabilities: of no effect, and of one that the library does not hold."""


def channel_rule(study: Path) -> dict[str, Any]:
    """Refits the coefficients, looks for the channel that is worst met, and blames what that channel is known for."""
    from withheld.programs.linear import left

    found = refitted(study, effects=False)
    rest = left(found.residuals, found.nuisances)
    sizes = {name: float(np.sqrt(np.mean(rest[rows] ** 2))) for name, rows in found.channels}
    worst = max(sizes, key=lambda name: sizes[name])
    case = study.parent.name
    if sizes[worst] < QUIET:
        return verdict(case, [([], 1.0)])
    return verdict(case, [([BLAMED[worst]], 1.0)], places=[f"sensor:{worst}"])


def prior_only(study: Path) -> dict[str, Any]:
    """Looks at no data: no effect, each effect that can act, and one outside the library, with fixed probabilities."""
    from seatruth import load_study

    names = effects_on(load_study(study).model)
    each = (1.0 - NONE - UNKNOWN) / len(names)
    return verdict(study.parent.name, [([], NONE), (["unknown"], UNKNOWN), *(([name], each) for name in names)])
