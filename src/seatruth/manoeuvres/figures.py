"""Figures of turning circles and zigzags (advance, overshoot and so on), from simulated and measured trials alike.

Definitions follow the ITTC procedure 7.5-02-06-01 for free-running manoeuvring tests; the execute is read
from the record of the rudder. Figures that a trial does not hold are NaN, and `why` gives the reason by name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.trials.trial import Trial

_STILL = math.radians(1.0)
"""rad: a rudder that moves by less than this is not moved on purpose; chosen here [S]."""


@dataclass(frozen=True)
class TurningCircleFigures:
    """Lengths in m, angles in rad, times in s. Positive to starboard: rudder, rate; lengths are magnitudes."""

    rudder: float
    execute: float
    """Time at which the rudder began to move."""
    approach_speed: float
    advance: float = math.nan
    """Distance along the original heading when the heading has changed by 90 deg."""
    transfer: float = math.nan
    """Distance across it at 90 deg."""
    tactical_diameter: float = math.nan
    """Distance across it at 180 deg."""
    steady_diameter: float = math.nan
    drift_angle: float = math.nan
    """Mean of atan2(-v, u) in the steady turn; usually positive in a turn to starboard (the bow points inwards)."""
    speed_ratio: float = math.nan
    """Speed in the steady turn over the approach speed."""
    rate: float = math.nan
    """Yaw rate in the steady turn, rad/s."""
    why: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ZigzagFigures:
    """Angles in rad, times in s. `executes` are the times at which the rudder began to move."""

    rudder: float
    """Rudder angle held, mean of both sides."""
    first: str
    """Side of the first execute: starboard or port; for a stern plane down or up."""
    executes: tuple[float, ...]
    switch_angles: tuple[float, ...] = ()
    """Heading (or pitch) change from the approach at the second and later executes."""
    overshoots: tuple[float, ...] = ()
    """How much further the heading (or pitch) went after the second and each later execute."""
    initial_turning_time: float = math.nan
    """From the first to the second execute."""
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


def turning_circle_figures(trial: Trial) -> TurningCircleFigures:
    """Figures of a turning circle with outputs x, y, psi (and u, v for the drift angle) and input delta.

    BadInput, with the reason, if the trial is no turning circle.
    """
    where = f"turning circle figures of trial {trial.name!r}"
    t, x, y, psi = _outputs(trial, ("x", "y", "psi"), where)
    psi = np.unwrap(psi)
    delta = _input(trial, "delta", where)
    level = _held(delta, where)
    execute = _turn_start(trial.t, delta, level)
    side = math.copysign(1.0, level)
    x0, y0, psi0 = (float(np.interp(execute, t, channel)) for channel in (x, y, psi))
    turned = side * (psi - psi0)
    along = (x - x0) * math.cos(psi0) + (y - y0) * math.sin(psi0)
    across = side * ((y - y0) * math.cos(psi0) - (x - x0) * math.sin(psi0))
    after = (t >= execute) & (t <= _turn_end(trial, delta, level, execute))
    result: dict[str, float] = {}
    why: dict[str, str] = {}
    for angle, names in ((90.0, ("advance", "transfer")), (180.0, ("tactical_diameter",))):
        at = _first_crossing(t[after], turned[after], math.radians(angle))
        if at is None:
            reached = math.degrees(float(np.max(turned[after], initial=0.0)))
            why.update(dict.fromkeys(names, f"the heading changes by {reached:.0f} deg, not {angle:.0f}"))
            continue
        for name in names:
            result[name] = float(np.interp(at, t, along if name == "advance" else across))
    approach = (t <= execute) & (t >= execute - 10.0)
    speed, drift = _motion(trial, t, x, y, psi)
    before = float(np.mean(speed[approach])) if np.any(approach) else float(speed[0])
    total = float(np.max(turned[after], initial=0.0))
    span = math.radians(360.0) if total >= math.radians(540.0) else math.radians(90.0)
    steady_names = ("steady_diameter", "speed_ratio", "rate", "drift_angle")
    if total < math.radians(270.0):
        reason = f"the heading changes by {math.degrees(total):.0f} deg; a steady turn takes 270"
        why.update(dict.fromkeys(steady_names, reason))
    else:
        steady = after & (turned >= total - span)
        rate = float(np.polyfit(t[steady], psi[steady], 1)[0])
        mean = float(np.mean(speed[steady]))
        result.update(
            rate=rate, steady_diameter=2 * mean / abs(rate), speed_ratio=mean / before if before else math.nan
        )
        if drift is None:
            why["drift_angle"] = "the trial has no u and v"
        else:
            result["drift_angle"] = float(np.mean(drift[steady]))
    return TurningCircleFigures(rudder=level, execute=execute, approach_speed=before, why=why, **result)


def zigzag_figures(trial: Trial) -> ZigzagFigures:
    """Figures of a zigzag: rudder delta and heading psi, or stern plane delta_s and pitch theta.

    BadInput, with the reason, if the trial is no zigzag.
    """
    where = f"zigzag figures of trial {trial.name!r}"
    planes = "delta_s" in trial.inputs and "theta" in trial.outputs
    control_name, angle_name, sense = ("delta_s", "theta", -1.0) if planes else ("delta", "psi", 1.0)
    t, angle = _outputs(trial, (angle_name,), where)
    control = _input(trial, control_name, where)
    angle = sense * np.unwrap(angle)
    low, high = (float(q) for q in np.quantile(control, (0.1, 0.9)))
    middle, level = 0.5 * (low + high), 0.5 * (high - low)
    if level < _STILL or low > -0.3 * level or high < 0.3 * level:
        raise BadInput("the rudder is not held to both sides", where=where, do="Give a zigzag.")
    moves = _executes(trial.t, control - middle, level)
    if len(moves) < 2:
        raise BadInput("the rudder is not reversed", where=where, do="Give a zigzag.")
    times, sides = [time for time, _ in moves], [side for _, side in moves]
    base = float(np.interp(times[0], t, angle))
    overshoots, switches = [], []
    for k in range(1, len(times)):
        end = times[k + 1] if k + 1 < len(times) else float(t[-1])
        at = float(np.interp(times[k], t, angle))
        part = (t >= times[k]) & (t <= end)
        if np.count_nonzero(part) < 3:
            continue
        gone = sides[k - 1] * (angle[part] - at)
        peak = int(np.argmax(gone))
        if peak == gone.size - 1 and k + 1 == len(times):
            continue  # the record ends before the turn is checked
        switches.append(abs(at - base))
        overshoots.append(_peak(t[part], gone, peak))
    result: dict[str, float] = {"initial_turning_time": times[1] - times[0]}
    why: dict[str, str] = {}
    for name, k in (("reach", 1), ("period", 2)):
        if k >= len(times):
            why[name] = f"the rudder is executed {len(times)} times"
            continue
        later = t >= times[k]
        back = _first_crossing(t[later], -sides[k - 1] * (angle[later] - base), 0.0)
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


def _held(delta: Array, where: str) -> float:
    """The rudder angle of the turn: the one at which the rudder stays longest, amidships apart."""
    over = np.abs(delta) > max(_STILL, 0.1 * float(np.max(np.abs(delta), initial=0.0)))
    if not over.any():
        raise BadInput("the rudder is not used", where=where, do="Give a turning circle.")
    degrees, counts = np.unique(np.round(delta[over] / _STILL), return_counts=True)
    longest = float(degrees[counts.argmax()]) * _STILL
    near = max(1.5 * _STILL, 0.1 * abs(longest))
    here, opposite = (np.abs(delta - side * longest) < near for side in (1.0, -1.0))
    if np.count_nonzero(opposite) > 0.1 * np.count_nonzero(here):
        raise BadInput("the rudder is held to both sides", where=where, do="Give a turning circle.")
    return float(np.median(delta[here]))


def _turn_start(t: Array, delta: Array, level: float) -> float:
    """When the rudder began to move to the angle at which it then stays longest."""
    over = np.abs(delta - level) < 0.3 * abs(level)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], over.astype(np.int8), [0]))))
    starts, stops = edges[::2], edges[1::2]
    first = int(starts[np.argmax(stops - starts)])
    side = math.copysign(1.0, level)
    size = abs(level)
    return _began(t, side * delta, first, 0.0, min(0.4 * size, max(_STILL, 0.05 * size)), 0.6 * size)


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


def _executes(t: Array, control: Array, level: float) -> list[tuple[float, float]]:
    """When the rudder began each swing to a side (time, side +1 or -1), a swing being one that passes 60 % of level."""
    moves: list[tuple[float, float]] = []
    side = 0.0
    for k in np.flatnonzero(np.abs(control) > 0.6 * level):
        now = math.copysign(1.0, control[k])
        if now == side:
            continue
        # A reversal leaves the other side's level, the first execute leaves rest.
        base = -level if side else 0.0
        threshold = -0.9 * level if side else min(0.4 * level, max(_STILL, 0.05 * level))
        moves.append((_began(t, now * control, int(k), base, threshold, 0.5 * (threshold + 0.6 * level)), now))
        side = now
    return moves


def _began(t: Array, rising: Array, index: int, base: float, threshold: float, middle: float) -> float:
    """The time at which `rising` left `base` on its way up to where it is at `index`.

    It is where the line through its last crossings of `threshold` and `middle` meets `base`: for a rudder that turns
    at a constant rate the moment it began to move, whatever noise it has at rest.
    """
    early, late = (_last_crossing(t, rising, index, level) for level in (threshold, middle))
    return max(float(t[0]), early - (late - early) * (threshold - base) / (middle - threshold))


def _last_crossing(t: Array, values: Array, index: int, level: float) -> float:
    """Last time before sample `index` at which `values` rises through `level`, linear between samples."""
    below = np.flatnonzero(values[: index + 1] <= level)
    if below.size == 0:
        return float(t[0])
    k = int(below[-1])
    if k == index:
        return float(t[k])
    return float(t[k] + (t[k + 1] - t[k]) * (level - values[k]) / (values[k + 1] - values[k]))


def _first_crossing(t: Array, values: Array, level: float) -> float | None:
    """First time at which `values` rises through `level`, linear between samples."""
    above = np.flatnonzero(values >= level)
    if above.size == 0:
        return None
    k = int(above[0])
    if k == 0:
        return float(t[0])
    part = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(t[k - 1] + part * (t[k] - t[k - 1]))


def _motion(trial: Trial, t: Array, x: Array, y: Array, psi: Array) -> tuple[Array, Array | None]:
    """Speed and drift angle at the times `t`; speed from the positions where u and v are not recorded."""
    if "u" in trial.outputs and "v" in trial.outputs:
        good = np.isfinite(trial.outputs["u"]) & np.isfinite(trial.outputs["v"])
        if np.count_nonzero(good) > 10:
            u, v = (np.interp(t, trial.t[good], trial.outputs[name][good]) for name in ("u", "v"))
            return np.hypot(u, v), np.arctan2(-v, u)
    return np.hypot(np.gradient(x, t), np.gradient(y, t)), None


def _peak(t: Array, values: Array, k: int) -> float:
    """Height of the maximum at sample k, from the parabola through it and its neighbours."""
    if not 0 < k < values.size - 1:
        return float(values[k])
    a, b, c = values[k - 1], values[k], values[k + 1]
    bend = a - 2 * b + c
    return float(b - (c - a) ** 2 / (8 * bend)) if bend < 0 else float(b)
