"""From a model to the ship, or back: Froude's law, by which a scaled model and its ship make the same waves.

At equal Froude numbers U / sqrt(g L) lengths go with the scale, times and speeds with its root, angles stay and
accelerations too (ITTC 7.5-02-06-01). Friction does not scale so: a model is self-propelled with more revolutions than
its ship would be (its propeller is more heavily loaded), and its rudder so works in a faster stream.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.prepare.base import Options, preparation, with_channels
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.trials.trial import Trial

FROUDE = {
    "m": 1.0,
    "s": 0.5,
    "m/s": 0.5,
    "m/s^2": 0.0,
    "1": 0.0,
    "rad": 0.0,
    "rad/s": -0.5,
    "rev/s": -0.5,
}
"""Power of the scale (ship over model) with which a quantity of this unit grows, under Froude's law."""


class FullScale(Options):
    """`scale`: length of the ship over that of the model (below 1: from the ship to a model). `powers`: the power of
    the scale for channels that are not standard, as { thrust = 3.0 }.
    """

    scale: float = Field(gt=0.0)
    powers: dict[str, float] = Field(default_factory=dict)


@preparation("full_scale", FullScale)
def full_scale(trial: Trial, options: FullScale) -> tuple[Trial, str]:
    """Converts a model's record to the ship's by Froude's law: lengths by the scale, times and speeds by its root."""
    if not math.isfinite(options.scale):
        raise BadInput("the scale is not finite", do="Give the length of the ship over that of the model.")
    for name in options.powers:
        trial.channel(name)
    changed: dict[str, Array] = {}
    for name in (*trial.inputs, *trial.outputs):
        power = options.powers[name] if name in options.powers else _power(name)
        if power != 0.0:
            changed[name] = trial.channel(name) * options.scale**power
    scaled = with_channels(trial, changed)
    time = trial.t * math.sqrt(options.scale)
    if not np.all(np.diff(time) > 0):
        raise BadInput(f"the scale {options.scale:g} leaves no time between samples", do="Check the scale.")
    return (
        Trial(
            name=scaled.name,
            t=time,
            inputs=scaled.inputs,
            outputs=scaled.outputs,
            conditions={**scaled.conditions, "froude_scale": options.scale},
            steps=scaled.steps,
            source=scaled.source,
            synthetic=scaled.synthetic,
            lines=scaled.lines,
        ),
        f"lengths times {options.scale:g}, times and speeds times {math.sqrt(options.scale):.4g}, angles as they were",
    )


def _power(name: str) -> float:
    unit = STANDARD_CHANNELS[name].unit if name in STANDARD_CHANNELS else ""
    if unit not in FROUDE:
        raise BadInput(
            f"nobody said how {name!r} grows with the scale",
            do=f"Leave it out, or say so: powers = {{ {name} = 3.0 }} (a force), 0.0 (an angle or a share).",
        )
    return FROUDE[unit]
