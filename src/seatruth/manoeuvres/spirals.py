"""Figures of a direct spiral (Dieudonné): the steady yaw rate over the rudder, and the loop of an unstable ship.

Definitions follow the ITTC procedure 7.5-04-02-01 and MSC/Circ.1053: the rudder goes down a staircase from one side to
the other and up again, each angle held until the yaw rate is steady. A ship that is not directionally stable keeps
turning to its side beyond amidships. The loop's width is the distance between the rudder angles at which the rate
changes its sign, its height the distance between both rates at rudder amidships.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres.recording import AS_ANGLE, holds
from seatruth.manoeuvres.steering import THRUST_DIFFERENCE, steered, steering_channel
from seatruth.trials.trial import Trial

_STEADY = 1.0 / 3.0
"""Last part of each hold whose mean rate counts; chosen here [S]."""
_DRIFTS = 0.1
"""Part of the largest rate by which the rate may still change over that part; chosen here [S]."""
_FEWEST = 3
"""Rudder angles of a branch. Fewer hold no crossing to either side."""


@dataclass(frozen=True)
class SpiralFigures:
    """Angles in rad, rates in rad/s, positive to starboard. Where thrusters steer, shares of full thrust for angles."""

    points: tuple[tuple[float, float], ...]
    """(rudder, steady yaw rate), in the order of time."""
    loop_width: float = math.nan
    """Known to one step of the staircase where the rate jumps; about zero for a ship that is directionally stable."""
    loop_height: float = math.nan
    step: float = math.nan
    """Largest step of the rudder about amidships: the width is not known better."""
    why: dict[str, str] = field(default_factory=dict)


def spiral_figures(trial: Trial) -> SpiralFigures:
    """Figures of a direct spiral with output psi or r and input delta, or where thrusters steer their difference.

    Raises:
        BadInput: the rudder is not held at several angles.

    Example:
        >>> import math
        >>> from seatruth.manoeuvres import Spiral, run_manoeuvre, spiral_figures
        >>> from seatruth.models import load_model
        >>> down = [math.radians(d) for d in (15, 10, 5, 0, -5, -10, -15)]
        >>> plan = Spiral((*down, *down[-2::-1]), hold=120.0)
        >>> run = run_manoeuvre(load_model("mmg"), plan, dt=0.5, first_state={"u": 1.18}, inputs={"n": 10.4})
        >>> found = spiral_figures(run)
        >>> len(found.points), found.loop_width < found.step
        (13, True)
    """
    where = f"spiral figures of trial {trial.name!r}"
    trial = steered(trial)
    steering = steering_channel(trial)
    if steering not in trial.inputs:
        raise BadInput(f"it needs the input {steering!r}", where=where, do=nearest(steering, trial.inputs))
    by_thrust = steering == THRUST_DIFFERENCE
    unit = AS_ANGLE if by_thrust else 1.0
    rate = _rate(trial, where)
    found, drifting = [], []
    for hold in holds(trial.t, unit * trial.inputs[steering]):
        first = hold.stop - max(3, int(_STEADY * (hold.stop - hold.first)))
        part = slice(max(hold.first, first), hold.stop)
        found.append((hold.level / unit, float(np.mean(rate[part]))))
        half = (part.start + part.stop) // 2
        drifting.append(abs(float(np.mean(rate[half : part.stop]) - np.mean(rate[part.start : half]))))
    if len(found) < _FEWEST:
        raise BadInput("the rudder is not held at three angles or more", where=where, do="Give a spiral.")
    largest = max(abs(value) for _, value in found)
    unsteady = [level for (level, _), drift in zip(found, drifting) if drift > 0.5 * _DRIFTS * largest]
    why: dict[str, str] = {}
    result: dict[str, float] = {}
    branches = _branches(found)
    names = ("loop_width", "loop_height")
    if set(branches) != {1, -1}:
        why = dict.fromkeys(names, "the rudder goes through amidships one way only; a loop takes both")
    elif unsteady:
        shown = f"{100.0 * unsteady[0]:.0f} %" if by_thrust else f"{math.degrees(unsteady[0]):.0f} deg"
        why = dict.fromkeys(names, f"the yaw rate is not steady at the end of the hold at {shown}")
    else:
        down, up = branches[-1], branches[1]
        zero = [_crossing(branch, 1) for branch in (down, up)]
        amidships = [_crossing(branch, 0) for branch in (down, up)]
        if zero[0] is None or zero[1] is None:
            why["loop_width"] = "the yaw rate does not change its sign on both ways"
        else:
            result["loop_width"] = zero[1] - zero[0]
        if amidships[0] is None or amidships[1] is None:
            why["loop_height"] = "the rudder does not pass amidships on both ways"
        else:
            result["loop_height"] = amidships[0] - amidships[1]
        steps = [abs(b[0] - a[0]) for branch in (down, up) for a, b in pairwise(branch) if a[0] * b[0] <= 0]
        result["step"] = max(steps, default=math.nan)
    return SpiralFigures(tuple(found), why=why, **result)


def _rate(trial: Trial, where: str) -> Array:
    if "r" in trial.outputs and np.isfinite(trial.outputs["r"]).all():
        return trial.outputs["r"]
    if "psi" not in trial.outputs:
        raise BadInput("it needs the output 'psi' or 'r'", where=where, do=nearest("psi", trial.outputs))
    good = np.isfinite(trial.outputs["psi"])
    if np.count_nonzero(good) < 10:
        raise BadInput("fewer than 10 samples of the heading are valid", where=where, do="Give a longer record.")
    psi = np.interp(trial.t, trial.t[good], np.unwrap(trial.outputs["psi"][good]))
    return np.asarray(np.gradient(psi, trial.t))


def _branches(points: list[tuple[float, float]]) -> dict[int, list[tuple[float, float]]]:
    """The longest runs of falling (-1) and of rising rudder (+1) that pass amidships."""
    found: dict[int, list[tuple[float, float]]] = {}
    run: list[tuple[float, float]] = [points[0]]
    way = 0
    for before, now in pairwise(points):
        turn = 1 if now[0] > before[0] else -1
        if turn != way and len(run) > 1:
            run = [before]
        way = turn
        run = [*run, now]
        passes = min(point[0] for point in run) < 0 < max(point[0] for point in run)
        if len(run) >= _FEWEST and passes and len(run) > len(found.get(way, [])):
            found[way] = run
    return found


def _crossing(branch: list[tuple[float, float]], of: int) -> float | None:
    """The other coordinate where coordinate `of` (0 rudder, 1 rate) passes zero, on the line between two points."""
    for a, b in pairwise(branch):
        if a[of] == b[of] or a[of] * b[of] > 0:
            continue
        part = -a[of] / (b[of] - a[of])
        return a[1 - of] + part * (b[1 - of] - a[1 - of])
    return None
