"""Figures of a stop (crash stop, coast-down): how far the ship goes on after the order, and where to.

Definitions follow the ITTC procedure 7.5-04-02-01 (full-scale manoeuvring trials) and IMO's MSC.137(76): the way from
the order of the propeller until the ship is dead in the water. Figures that a trial does not hold are NaN, and `why`
gives the reason by name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres.crossings import first_crossing
from seatruth.manoeuvres.steering import steered
from seatruth.trials.trial import Trial

_CHANGED = 0.05
"""Part of the range of the drive by which it leaves its approach value at the execute; chosen here [S]."""
_APPROACH = 10.0
"""s before the execute over which the approach is averaged, as for turning circles."""
_CHORDS = 60
"""Chords by which the path is measured: the noise of each sample of a fast record would add to its length. A path that
bends by half a turn is so measured too short by 0.1 per mil. Chosen here [S]."""


@dataclass(frozen=True)
class StoppingFigures:
    """Lengths in m, angles in rad, times in s. The ship may go ahead or astern before."""

    execute: float
    """Time at which the drive was changed."""
    approach_speed: float
    """Along the ship before the execute, m/s; negative astern."""
    track_reach: float = math.nan
    """Way along the path until the ship is dead in the water."""
    head_reach: float = math.nan
    """Way along the direction of motion at the execute."""
    lateral_deviation: float = math.nan
    """Way across it, positive to the right of that direction."""
    heading_change: float = math.nan
    """Positive clockwise."""
    stopping_time: float = math.nan
    why: dict[str, str] = field(default_factory=dict)


def stopping_figures(trial: Trial, *, drive: str = "n") -> StoppingFigures:
    """Figures of a stop with outputs x, y, psi (and u, if there is one) and the input that drives the ship.

    The ship is dead in the water when its velocity along the ship changes sign; without u, that of its positions.

    Args:
        trial: the run, from before the execute, in SI units.
        drive: the channel that drives the ship: revolutions, power, a throttle. Any unit will do. By default n, or
            what stands for it where several thrusters drive the ship (`steered`).

    Raises:
        BadInput: the drive does not change, or the ship makes no way before.

    Example:
        >>> from seatruth.manoeuvres import CrashStop, run_manoeuvre, stopping_figures
        >>> from seatruth.models import load_model
        >>> plan = CrashStop(revolutions=-8.0)
        >>> run = run_manoeuvre(load_model("mmg"), plan, dt=0.2, first_state={"u": 1.18}, inputs={"n": 10.4})
        >>> round(stopping_figures(run).track_reach)
        39
    """
    where = f"stopping figures of trial {trial.name!r}"
    if drive == "n" and drive not in trial.inputs:
        trial = steered(trial)
    if drive not in trial.inputs:
        raise BadInput(f"it needs the input {drive!r}", where=where, do=nearest(drive, trial.inputs))
    for name in ("x", "y", "psi"):
        if name not in trial.outputs:
            raise BadInput(f"it needs the output {name!r}", where=where, do=nearest(name, trial.outputs))
    good = np.all([np.isfinite(trial.outputs[name]) for name in ("x", "y", "psi")], axis=0)
    if np.count_nonzero(good) < 10:
        raise BadInput("fewer than 10 samples are valid", where=where, do="Give a longer record.")
    t, x, y = trial.t[good], trial.outputs["x"][good], trial.outputs["y"][good]
    psi = np.unwrap(trial.outputs["psi"][good])
    execute = _execute(trial.t, trial.inputs[drive], where)
    along = _along(trial, t, x, y, psi)
    approach = (t <= execute) & (t >= execute - _APPROACH)
    before = float(np.mean(along[approach])) if approach.any() else float(along[0])
    if not abs(before) > 0.0:
        raise BadInput("the ship makes no way before the execute", where=where, do="Give the approach as well.")
    sense = math.copysign(1.0, before)
    x0, y0, psi0 = (float(np.interp(execute, t, channel)) for channel in (x, y, psi))
    after = t >= execute
    dead = first_crossing(t[after], -sense * along[after], 0.0)
    if dead is None or not after.any():
        left = abs(float(along[-1]) / before)
        names = ("track_reach", "head_reach", "lateral_deviation", "heading_change", "stopping_time")
        reason = f"the record ends with {100 * left:.0f} % of the approach speed"
        return StoppingFigures(execute, before, why=dict.fromkeys(names, reason))
    between = np.linspace(execute, dead, _CHORDS + 1)
    path_x, path_y = np.interp(between, t, x), np.interp(between, t, y)
    gone_x, gone_y = float(path_x[-1]) - x0, float(path_y[-1]) - y0
    return StoppingFigures(
        execute=execute,
        approach_speed=before,
        track_reach=float(np.hypot(np.diff(path_x), np.diff(path_y)).sum()),
        head_reach=sense * (gone_x * math.cos(psi0) + gone_y * math.sin(psi0)),
        lateral_deviation=sense * (gone_y * math.cos(psi0) - gone_x * math.sin(psi0)),
        heading_change=float(np.interp(dead, t, psi)) - psi0,
        stopping_time=dead - execute,
    )


def _execute(t: Array, drive: Array, where: str) -> float:
    """When the drive leaves its first value: the last sample at which it still has it."""
    first = float(np.median(drive[: max(1, drive.size // 100)]))
    span = float(np.max(np.abs(drive - first)))
    left = np.flatnonzero(np.abs(drive - first) > _CHANGED * span) if span > 0 else np.zeros(0, dtype=np.intp)
    if left.size == 0 or abs(first) <= _CHANGED * span:
        raise BadInput("the drive is not changed from an approach under way", where=where, do="Give a stop.")
    return float(t[max(0, int(left[0]) - 1)])


def _along(trial: Trial, t: Array, x: Array, y: Array, psi: Array) -> Array:
    """Velocity along the ship, negative astern: measured, or from the positions."""
    if "u" in trial.outputs:
        good = np.isfinite(trial.outputs["u"])
        if np.count_nonzero(good) > 10:
            return np.asarray(np.interp(t, trial.t[good], trial.outputs["u"][good]))
    return np.asarray(np.gradient(x, t) * np.cos(psi) + np.gradient(y, t) * np.sin(psi))
