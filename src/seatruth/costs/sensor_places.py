"""Places of sensors that cannot be meant: beyond the vehicle, or one receiver in two places."""

from __future__ import annotations

from typing import Any

from seatruth.costs.problem import EstimationProblem
from seatruth.effects.vehicle import dimensions_of
from seatruth.models.measures import Place
from seatruth.models.observed import ORIGIN
from seatruth.trials.finding import Finding

_POSITION, _VELOCITY = ("x", "y"), ("v_n", "v_e", "sog")


def far_sensors(problem: EstimationProblem) -> list[Finding]:
    """A warning for each sensor that is farther ahead, aside or up than the model is long, where it states its length.

    Args:
        problem: the study.
    """
    size = dimensions_of(problem.model)
    return [
        Finding(
            "warning",
            "sensor-place",
            f"Its sensor is at {_in_metres(at)}, and the vehicle is {size.length:g} m long.",
            f"channel {name!r}",
            "State `at` in metres forward, starboard and down of the model's origin.",
            channel=name,
        )
        for name, at in sensor_places(problem).items()
        if size is not None and max(abs(x) for x in at) > size.length
    ]


def receiver_in_two_places(problem: EstimationProblem) -> list[Finding]:
    """A note where the position and the velocity over ground are of receivers in two places: of one, a forgotten `at`.

    Args:
        problem: the study.
    """
    places = sensor_places(problem)
    recorded = {name for trial in problem.trials for name in trial.outputs}
    compared = recorded & {channel.name for channel in problem.model.outputs}
    groups = [[name for name in names if name in compared] for names in (_POSITION, _VELOCITY)]
    position, velocity = ({places.get(name, ORIGIN) for name in names} for names in groups)
    if len(position) != 1 or len(velocity) != 1 or position == velocity:
        return []
    (here,), (there,) = position, velocity
    return [
        Finding(
            "note",
            "receiver-places",
            f"The position is that of a receiver at {_in_metres(here)}, the velocity over ground that of one at "
            f"{_in_metres(there)}.",
            f"channel {groups[1][0]!r}",
            "Where one receiver gives both, state its `at` for both.",
            channel=groups[1][0],
        )
    ]


def _in_metres(at: Place) -> str:
    return "the model's origin" if at == ORIGIN else f"[{', '.join(f'{x:g}' for x in at)}] m"


def sensor_places(problem: EstimationProblem) -> dict[str, Place]:
    """Stated places of the sensors, by channel."""
    around: Any = problem.model
    places: dict[str, Place] = {}
    while around is not None:
        places |= {one.channel: one.at for one in getattr(around, "observations", ())}
        around = getattr(around, "base", None)
    return places
