"""The uniform current during a turning circle, from positions one revolution apart, and a turn without it.

MSC/Circ.1053 (explanatory notes to IMO's MSC.137(76)), 3.4.2.5: in a steady turn the ship comes back to the same
heading after one revolution; without a current it would come back to the same place. The displacement over the time
is the local current velocity, and its mean over all headings the current. Wind, and a turn that is not steady, look
alike; the spread of the local velocities shows them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from seatruth.arrays import Array
from seatruth.errors import BadInput
from seatruth.trials.prepare.base import Options, preparation, with_channels
from seatruth.trials.trial import Trial

STEADY_FROM = 180.0
"""deg of heading change from which the turn counts as steady; chosen here [S]: half a turn after the execute the
speed and the rate of ships have settled, and two circles are then enough for half a turn of pairs."""
_MOST_PAIRS = 73
"""Headings at which positions are compared, evenly spaced; 5 deg apart over a circle. Chosen here [S]."""


@dataclass(frozen=True)
class TurnCurrent:
    """A uniform current, m/s: `north` along x and `east` along y, and the sd of its local values over the turn."""

    north: float
    east: float
    sd_north: float
    sd_east: float
    turned: float
    """Heading change over which pairs of positions one revolution apart were compared, rad."""

    @property
    def speed(self) -> float:
        return math.hypot(self.north, self.east)


def turn_current(trial: Trial, *, steady_from: float = STEADY_FROM) -> TurnCurrent:
    """The uniform current during a turning circle with outputs x, y and psi.

    Args:
        trial: the run, from the approach on, in SI units.
        steady_from: heading change from which the turn is steady, deg.

    Raises:
        BadInput: a channel is missing, or the heading changes by less than `steady_from` + 360 deg.

    Example:
        >>> import math
        >>> from seatruth.manoeuvres import TurningCircle, run_manoeuvre, steady_current
        >>> from seatruth.models import load_model
        >>> from seatruth.trials.prepare import turn_current
        >>> plan = TurningCircle(math.radians(35), math.radians(1000))
        >>> under_way = {"first_state": {"u": 1.18}, "inputs": {"n": 10.4}}
        >>> run = run_manoeuvre(load_model("mmg"), plan, **under_way, environment=steady_current(0.1, 0.0))
        >>> found = turn_current(run)
        >>> round(found.north, 2), abs(round(found.east, 2))
        (0.1, 0.0)
    """
    where = f"trial {trial.name!r}"
    for name in ("x", "y", "psi"):
        if name not in trial.outputs:
            raise BadInput(f"the current of a turn needs {name!r}", where=where, do=f"Map a column to {name!r}.")
    good = np.all([np.isfinite(trial.outputs[name]) for name in ("x", "y", "psi")], axis=0)
    if np.count_nonzero(good) < 10:
        raise BadInput("fewer than 10 samples are valid", where=where, do="Give a longer record.")
    t, x, y = trial.t[good], trial.outputs["x"][good], trial.outputs["y"][good]
    psi = np.unwrap(trial.outputs["psi"][good])
    turned = (psi - psi[0]) * math.copysign(1.0, psi[-1] - psi[0])
    # A noisy heading goes back and forth: its running maximum is what has been turned.
    turned = np.maximum.accumulate(turned)
    first, last = math.radians(steady_from), float(turned[-1]) - 2 * math.pi
    if last <= first:
        raise BadInput(
            f"the heading changes by {math.degrees(turned[-1]):.0f} deg; the current of a turn takes more than "
            f"{steady_from + 360:.0f}",
            where=where,
            do="Go on with the turn, 720 deg in all, or state the current with the effect 'current'.",
        )
    rising = np.concatenate(([True], np.diff(turned) > 0))
    span = min(last - first, 2 * math.pi)  # over whole circles all headings count alike
    headings = first + span * np.linspace(0.0, 1.0, _MOST_PAIRS)
    before = np.interp(headings, turned[rising], t[rising])
    after = np.interp(headings + 2 * math.pi, turned[rising], t[rising])
    north, east = ((np.interp(after, t, place) - np.interp(before, t, place)) / (after - before) for place in (x, y))
    return TurnCurrent(
        float(np.mean(north)), float(np.mean(east)), float(np.std(north)), float(np.std(east)), float(span)
    )


class RemoveCurrent(Options):
    """`north`, `east` m/s of the current; by default both come from the turn itself (MSC/Circ.1053, 3.4.2.5), whose
    heading must change by more than `steady_from` + 360 deg. x and y, u and v, v_n and v_e become those over the water.
    """

    north: float | None = None
    east: float | None = None
    steady_from: float = Field(default=STEADY_FROM, ge=0.0)


@preparation("remove_current", RemoveCurrent)
def remove_current(trial: Trial, options: RemoveCurrent) -> tuple[Trial, str]:
    """Takes a uniform current out of positions and velocities over ground, as in a turning circle."""
    if (options.north is None) != (options.east is None):
        raise BadInput("only one part of the current is given", do="Give both 'north' and 'east', or neither.")
    if options.north is not None and options.east is not None:
        north, east, how = options.north, options.east, "as stated"
    else:
        found = turn_current(trial, steady_from=options.steady_from)
        north, east = found.north, found.east
        spread = f"local values spread by {found.sd_north:.2g} and {found.sd_east:.2g} m/s"
        how = f"from {math.degrees(found.turned):.0f} deg of the turn, {spread}"
    if not (math.isfinite(north) and math.isfinite(east)):
        raise BadInput("the current is not finite", do="Give numbers in m/s.")
    changed = _without(trial, north, east)
    if not changed:
        raise BadInput("it has no position and no velocity over ground", do="Leave the step out.")
    return with_channels(trial, changed), f"removed a current of {north:.4g} m/s north, {east:.4g} m/s east, {how}"


def _without(trial: Trial, north: float, east: float) -> dict[str, Array]:
    """The channels over ground, as they are over the water."""
    found: dict[str, Array] = {}
    outputs = trial.outputs
    elapsed = trial.t - trial.t[0]
    for name, part in (("x", north), ("y", east)):
        if name in outputs:
            found[name] = outputs[name] - part * elapsed
    for name, part in (("v_n", north), ("v_e", east)):
        if name in outputs:
            found[name] = outputs[name] - part
    if {"u", "v"} & set(outputs):
        if "psi" not in outputs:
            raise BadInput("u and v over the water need the heading 'psi'", do="Map a column to 'psi'.")
        cos, sin = np.cos(outputs["psi"]), np.sin(outputs["psi"])
        for name, along in (("u", north * cos + east * sin), ("v", east * cos - north * sin)):
            if name in outputs:
                found[name] = outputs[name] - along
    if {"sog", "cog"} & set(outputs):
        raise BadInput(
            "speed and course over ground are not those over the water",
            do="Leave sog and cog out of [channels]; x and y hold the same motion.",
        )
    return found
