"""Whether a sensor is stated to be farther away than its vehicle is long: a place in other units than metres."""

from __future__ import annotations

from typing import Any

from seatruth.costs.problem import EstimationProblem
from seatruth.effects.vehicle import dimensions_of
from seatruth.trials.finding import Finding


def far_sensors(problem: EstimationProblem) -> list[Finding]:
    """A warning for each sensor that is farther ahead, aside or up than the model is long, where it states its length.

    Args:
        problem: the study.
    """
    size = dimensions_of(problem.model)
    around: Any = problem.model
    places: dict[str, tuple[float, float, float]] = {}
    while around is not None:
        places |= {one.channel: one.at for one in getattr(around, "observations", ())}
        around = getattr(around, "base", None)
    return [
        Finding(
            "warning",
            "sensor-place",
            f"Its sensor is at [{', '.join(f'{x:g}' for x in at)}] m, and the vehicle is {size.length:g} m long.",
            f"channel {name!r}",
            "State `at` in metres forward, starboard and down of the model's origin.",
            channel=name,
        )
        for name, at in places.items()
        if size is not None and max(abs(x) for x in at) > size.length
    ]
