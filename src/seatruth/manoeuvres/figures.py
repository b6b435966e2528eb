"""Figures of turning circles and zigzags (advance, overshoot and so on), from simulated and measured trials alike.

Definitions follow the ITTC procedures 7.5-02-06-01 (free-running models) and 7.5-04-02-01 (full-scale trials), and
IMO's resolution MSC.137(76); the execute is read from the record of the steering. Figures that a trial does not hold
are NaN, and `why` gives the reason by name. Figures of stops and spirals are in modules of their own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres.crossings import began, executes, first_crossing, peak
from seatruth.manoeuvres.steering import steered, steering_channel
from seatruth.trials.trial import Trial

_STILL = math.radians(1.0)
"""rad: a rudder that moves by less than this is not moved on purpose; chosen here [S]."""
_STILL_PART = 0.05
"""The same for steering that is no angle, as a part of the largest order; chosen here [S]."""
_FEWEST = 5
"""Samples of a steady turn; fewer hold no rate. Chosen here [S]."""
_CHORDS = 8
"""Chords by which the path up to the second execute is measured; it bends by 10 to 20 deg, so that they are too short
by less than 0.1 per mil. Chosen here [S]."""
_ANGLES = ("delta", "delta_s", "delta_r")
_TURNING = 0.5
"""Part of the largest yaw rate with which a record begins in mid-turn, where it begins with the rudder over: a ship
takes about a length to gather rate. Chosen here [S]."""


@dataclass(frozen=True)
class TurningCircleFigures:
    """Lengths in m, angles in rad, times in s. Positive to starboard: rudder, rate; lengths are magnitudes."""

    rudder: float
    """Rudder angle held; where thrusters steer, the share of full thrust in yaw."""
    execute: float
    """Time at which the rudder began to move."""
    approach_speed: float
    advance: float = math.nan
    """Distance along the original heading when the heading has changed by 90 deg."""
    transfer: float = math.nan
    """Distance across it at 90 deg."""
    tactical_diameter: float = math.nan
    """Distance across it at 180 deg."""
    time_90: float = math.nan
    """From the execute until the heading has changed by 90 deg."""
    time_180: float = math.nan
    steady_diameter: float = math.nan
    drift_angle: float = math.nan
    """Mean of atan2(-v, u) in the steady turn; usually positive in a turn to starboard (the bow points inwards)."""
    speed_ratio: float = math.nan
    """Speed in the steady turn over the approach speed."""
    rate: float = math.nan
    """Yaw rate in the steady turn, rad/s."""
    why: dict[str, str] = field(default_factory=dict)

    @property
    def speed_loss(self) -> float:
        """Part of the approach speed that the steady turn takes."""
        return 1.0 - self.speed_ratio


@dataclass(frozen=True)
class ZigzagFigures:
    """Angles in rad, times in s. `executes` are the times at which the rudder began to move."""

    rudder: float
    """Rudder angle held, mean of both sides; where thrusters steer, the share of full thrust in yaw."""
    first: str
    """Side of the first execute: starboard or port; for a stern plane down or up."""
    executes: tuple[float, ...]
    switch_angles: tuple[float, ...] = ()
    """Heading (or pitch) change from the approach at the second and later executes."""
    overshoots: tuple[float, ...] = ()
    """How much further the heading (or pitch) went after the second and each later execute."""
    initial_turning_time: float = math.nan
    """From the first to the second execute."""
    initial_turning_distance: float = math.nan
    """Way through from the first execute to the second (track reach), m; needs x and y."""
    reach: float = math.nan
    """From the first execute until the heading is back at its first value after the second execute."""
    period: float = math.nan
    """From the first execute until the heading is back at its first value after the third execute."""
    why: dict[str, str] = field(default_factory=dict)

    @property
    def first_overshoot(self) -> float:
        return self.overshoots[0] if self.overshoots else math.nan

    @property
    def second_overshoot(self) -> float:
        return self.overshoots[1] if len(self.overshoots) > 1 else math.nan


def turning_circle_figures(trial: Trial, *, steering: str | None = None) -> TurningCircleFigures:
    """Figures of a turning circle with outputs x, y, psi (and u, v for the drift angle).

    Args:
        trial: the run, from before the execute or from the execute itself, in SI units.
        steering: the channel that steers; positive turns to starboard ahead. Any unit will do. By default delta, or
            where thrusters steer their difference (`steered`).

    Returns:
        The figures. Astern (u < 0 in the approach) the ship's own direction of motion takes the place of its heading.

    Raises:
        BadInput: the trial is no turning circle, or its record begins within the turn.
    """
    where = f"turning circle figures of trial {trial.name!r}"
    trial, steering = _steering(trial, steering)
    t, x, y, psi = _outputs(trial, ("x", "y", "psi"), where)
    psi = np.unwrap(psi)
    delta = _input(trial, steering, where)
    still = _still(steering, delta)
    level = _held(delta, still, where)
    execute, over = _turn_start(trial.t, delta, level, still)
    if over == 0:
        _refuse_mid_turn(t, psi, where)
    speed, drift, astern = _motion(trial, t, x, y, psi, execute)
    sense = -1.0 if astern else 1.0
    side = math.copysign(1.0, level) * sense
    x0, y0, psi0 = (float(np.interp(execute, t, channel)) for channel in (x, y, psi))
    turned = side * (psi - psi0)
    along = sense * ((x - x0) * math.cos(psi0) + (y - y0) * math.sin(psi0))
    # Astern to starboard of the way through is to port of the bow.
    across = side * sense * ((y - y0) * math.cos(psi0) - (x - x0) * math.sin(psi0))
    after = (t >= execute) & (t <= _turn_end(trial, delta, level, execute))
    result: dict[str, float] = {}
    why: dict[str, str] = {}
    for angle, names in ((90.0, ("time_90", "advance", "transfer")), (180.0, ("time_180", "tactical_diameter"))):
        at = first_crossing(t[after], turned[after], math.radians(angle))
        if at is None:
            reached = math.degrees(float(np.max(turned[after], initial=0.0)))
            why.update(dict.fromkeys(names, f"the heading changes by {reached:.0f} deg, not {angle:.0f}"))
            continue
        result[names[0]] = at - execute
        for name in names[1:]:
            result[name] = float(np.interp(at, t, along if name == "advance" else across))
    approach = (t <= execute) & (t >= execute - 10.0)
    before = float(np.mean(speed[approach])) if np.any(approach) else float(speed[0])
    total = float(np.max(turned[after], initial=0.0))
    span = math.radians(360.0) if total >= math.radians(540.0) else math.radians(90.0)
    steady_names = ("steady_diameter", "speed_ratio", "rate", "drift_angle")
    steady = after & (turned >= total - span)
    if total < math.radians(270.0):
        reason = f"the heading changes by {math.degrees(total):.0f} deg; a steady turn takes 270"
        why.update(dict.fromkeys(steady_names, reason))
    elif np.count_nonzero(steady) < _FEWEST:
        why.update(dict.fromkeys(steady_names, f"the steady turn has {np.count_nonzero(steady)} samples"))
    else:
        rate = float(np.polyfit(t[steady] - execute, psi[steady], 1)[0])
        mean = float(np.mean(speed[steady]))
        result.update(
            rate=rate, steady_diameter=2 * mean / abs(rate), speed_ratio=mean / before if before else math.nan
        )
        if drift is None:
            why["drift_angle"] = "the trial has no u and v"
        else:
            result["drift_angle"] = float(np.mean(drift[steady]))
    return TurningCircleFigures(rudder=level, execute=execute, approach_speed=before, why=why, **result)


def zigzag_figures(trial: Trial, *, steering: str | None = None) -> ZigzagFigures:
    """Figures of a zigzag: rudder delta and heading psi, or stern plane delta_s and pitch theta.

    Args:
        trial: the run, from before the first execute, in SI units.
        steering: the channel that steers the heading, where it is another than delta; any unit will do. Where
            thrusters steer, it is their difference (`steered`).

    Raises:
        BadInput: the trial is no zigzag.
    """
    where = f"zigzag figures of trial {trial.name!r}"
    planes = steering is None and "delta_s" in trial.inputs and "theta" in trial.outputs
    trial, steering = _steering(trial, "delta_s" if planes else steering)
    control_name, angle_name, sense = (steering, "theta", -1.0) if planes else (steering, "psi", 1.0)
    t, angle = _outputs(trial, (angle_name,), where)
    control = _input(trial, control_name, where)
    still = _still(control_name, control)
    angle = sense * np.unwrap(angle)
    low, high = (float(q) for q in np.quantile(control, (0.1, 0.9)))
    middle, level = 0.5 * (low + high), 0.5 * (high - low)
    if level < still or low > -0.3 * level or high < 0.3 * level:
        raise BadInput("the rudder is not held to both sides", where=where, do="Give a zigzag.")
    moves = executes(trial.t, control - middle, level, still)
    if len(moves) < 2:
        raise BadInput("the rudder is not reversed", where=where, do="Give a zigzag.")
    times, sides = [time for time, _ in moves], [side for _, side in moves]
    base = float(np.interp(times[0], t, angle))
    overshoots, switches = _overshoots(t, angle, times, sides, base)
    result: dict[str, float] = {"initial_turning_time": times[1] - times[0]}
    why: dict[str, str] = {}
    if not planes and {"x", "y"} <= set(trial.outputs):
        t_xy, x, y = _outputs(trial, ("x", "y"), where)
        # A few chords: each sample's own noise would add to the length of a path through all of them.
        between = np.linspace(times[0], times[1], _CHORDS + 1)
        steps = np.hypot(np.diff(np.interp(between, t_xy, x)), np.diff(np.interp(between, t_xy, y)))
        result["initial_turning_distance"] = float(steps.sum())
    else:
        why["initial_turning_distance"] = "the trial has no x and y"
    for name, k in (("reach", 1), ("period", 2)):
        if k >= len(times):
            why[name] = f"the rudder is executed {len(times)} times"
            continue
        later = t >= times[k]
        back = first_crossing(t[later], -sides[k - 1] * (angle[later] - base), 0.0)
        if back is None:
            why[name] = "the record ends before the heading is back"
        else:
            result[name] = back - times[0]
    sidenames = ("down", "up") if planes else ("starboard", "port")
    if not overshoots:
        why["overshoots"] = "the record ends before the first overshoot"
    return ZigzagFigures(
        rudder=level,
        first=sidenames[0] if sides[0] > 0 else sidenames[1],
        executes=tuple(times),
        switch_angles=tuple(switches),
        overshoots=tuple(overshoots),
        why=why,
        **result,
    )


def _overshoots(
    t: Array, angle: Array, times: list[float], sides: list[float], base: float
) -> tuple[list[float], list[float]]:
    """Overshoots after the second and later executes, and the change of heading at these executes."""
    found, switches = [], []
    for k in range(1, len(times)):
        end = times[k + 1] if k + 1 < len(times) else float(t[-1])
        at = float(np.interp(times[k], t, angle))
        part = (t >= times[k]) & (t <= end)
        if np.count_nonzero(part) < 3:
            continue
        gone = sides[k - 1] * (angle[part] - at)
        top = int(np.argmax(gone))
        if top == gone.size - 1 and k + 1 == len(times):
            continue  # the record ends before the turn is checked
        switches.append(abs(at - base))
        found.append(peak(gone, top))
    return found, switches


def _steering(trial: Trial, stated: str | None) -> tuple[Trial, str]:
    """The trial with the channel that steers it, and the name of that channel."""
    if stated is not None:
        return trial, stated
    trial = steered(trial)
    return trial, steering_channel(trial)


def _outputs(trial: Trial, names: tuple[str, ...], where: str) -> tuple[Array, ...]:
    """Time and the named outputs at the samples where all are valid."""
    for name in names:
        if name not in trial.outputs:
            raise BadInput(f"it needs the output {name!r}", where=where, do=nearest(name, trial.outputs))
    good = np.all([np.isfinite(trial.outputs[name]) for name in names], axis=0)
    if np.count_nonzero(good) < 10:
        raise BadInput("fewer than 10 samples are valid", where=where)
    return (trial.t[good], *(trial.outputs[name][good] for name in names))


def _input(trial: Trial, name: str, where: str) -> Array:
    if name not in trial.inputs:
        raise BadInput(f"it needs the input {name!r}", where=where, do=nearest(name, trial.inputs))
    return trial.inputs[name]


def _still(steering: str, values: Array) -> float:
    """How far the steering moves without being moved on purpose."""
    return _STILL if steering in _ANGLES else _STILL_PART * float(np.max(np.abs(values), initial=0.0))


def _held(delta: Array, still: float, where: str) -> float:
    """The rudder angle of the turn: the one at which the rudder stays longest, amidships apart."""
    over = np.abs(delta) > max(still, 0.1 * float(np.max(np.abs(delta), initial=0.0)))
    if not over.any():
        raise BadInput("the rudder is not used", where=where, do="Give a turning circle.")
    levels, counts = np.unique(np.round(delta[over] / still), return_counts=True)
    longest = float(levels[counts.argmax()]) * still
    near = max(1.5 * still, 0.1 * abs(longest))
    here, opposite = (np.abs(delta - side * longest) < near for side in (1.0, -1.0))
    if np.count_nonzero(opposite) > 0.1 * np.count_nonzero(here):
        raise BadInput("the rudder is held to both sides", where=where, do="Give a turning circle.")
    return float(np.median(delta[here]))


def _turn_start(t: Array, delta: Array, level: float, still: float) -> tuple[float, int]:
    """When the rudder began to move to the angle at which it then stays longest, and the first sample there."""
    over = np.abs(delta - level) < 0.3 * abs(level)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], over.astype(np.int8), [0]))))
    starts, stops = edges[::2], edges[1::2]
    first = int(starts[np.argmax(stops - starts)])
    side = math.copysign(1.0, level)
    size = abs(level)
    return began(t, side * delta, first, 0.0, min(0.4 * size, max(still, 0.05 * size)), 0.6 * size), first


def _refuse_mid_turn(t: Array, psi: Array, where: str) -> None:
    """BadInput for a record that begins with the rudder over and the ship already turning."""
    part = max(5, t.size // 100)
    slopes = np.diff(psi[::part]) / np.diff(t[::part])
    if slopes.size > 2 and abs(slopes[0]) > _TURNING * float(np.max(np.abs(slopes))):
        raise BadInput(
            "the record begins within the turn, so nobody can say where the rudder was laid",
            where=where,
            do="Give the record from the approach on; the steady turn alone has no advance.",
        )


def _turn_end(trial: Trial, delta: Array, level: float, execute: float) -> float:
    """When the turn ends: the rudder is moved off its angle, or the propeller's revolutions are changed."""
    off = np.abs(delta - level) > 0.15 * abs(level)
    reached = trial.t > execute
    there = np.flatnonzero(reached & ~off)
    reached &= np.arange(len(trial)) > (there[0] if there.size else 0)
    ended = reached & off
    if "n" in trial.inputs:
        n = trial.inputs["n"]
        kept = float(np.interp(execute, trial.t, n))
        ended |= (trial.t > execute) & (np.abs(n - kept) > 0.2 * abs(kept))
    stops = np.flatnonzero(ended)
    return float(trial.t[stops[0] - 1]) if stops.size else float(trial.t[-1])


def _motion(trial: Trial, t: Array, x: Array, y: Array, psi: Array, execute: float) -> tuple[Array, Array | None, bool]:
    """Speed and drift angle at the times `t`, and whether the ship goes astern at the execute.

    Speed comes from the positions where u and v are not recorded. Astern the drift angle is that of the way through.
    """
    rates = np.gradient(x, t), np.gradient(y, t)
    ahead = rates[0] * np.cos(psi) + rates[1] * np.sin(psi)
    near = np.abs(t - execute) <= max(2.0, 2.0 * float(np.median(np.diff(t))))
    if "u" in trial.outputs and "v" in trial.outputs:
        good = np.isfinite(trial.outputs["u"]) & np.isfinite(trial.outputs["v"])
        if np.count_nonzero(good) > 10:
            u, v = (np.interp(t, trial.t[good], trial.outputs[name][good]) for name in ("u", "v"))
            astern = float(np.median(u[near])) < 0
            drift = np.arctan2(v, -u) if astern else np.arctan2(-v, u)
            return np.hypot(u, v), drift, astern
    return np.hypot(*rates), None, float(np.median(ahead[near])) < 0
