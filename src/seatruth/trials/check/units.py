"""Units and frames, as far as one channel alone can tell."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import Channels, degrees, has_channels, make_finding, stated_unit, unit_of
from seatruth.trials.finding import Finding
from seatruth.trials.prepare.base import WRAP_JUMP
from seatruth.trials.trial import Trial

_BOUNDED = ("delta", "delta_s", "delta_r", "delta_e", "theta", "phi")
_RATES = ("p", "q", "r")
_SPEEDS = ("u", "v", "w")


def check_units(trial: Trial, model: Channels | None = None) -> Iterator[Finding]:
    """Numbers that the declared unit cannot have, and angles that jump by a turn."""
    for name in (*trial.inputs, *trial.outputs):
        if not has_channels(trial, name):
            continue
        values = trial.channel(name)
        finite = values[np.isfinite(values)]
        size, unit = float(np.quantile(np.abs(finite), 0.995)), unit_of(name, model)
        if name in _BOUNDED and unit == "rad" and size > limits.ANGLE_LIMIT:
            yield _unit(trial, name, f"It reaches {size:.4g} rad ({np.degrees(size):.0f} deg)", "deg")
        elif name == "psi" and unit == "rad":
            yield from _heading(trial, finite)
        elif name in _RATES and unit == "rad/s" and size > limits.YAW_RATE:
            yield _unit(trial, name, f"It reaches {size:.4g} rad/s ({size / 6.2832:.1f} turns a second)", "deg/s")
        elif name in _SPEEDS and unit == "m/s" and size > limits.SPEED:
            yield _unit(trial, name, f"It reaches {size:.4g} m/s", "the unit of the file, as kn or cm/s", "warning")
        elif name == "n" and unit == "rev/s" and size > limits.PROPELLER and not stated_unit(trial, name):
            yield _unit(trial, name, f"It reaches {size:.4g} rev/s ({60 * size:.0f} rpm)", "rpm", "warning")
        elif name in trial.inputs and unit == "rad":
            yield from _long_way(trial, name)
        elif name in ("depth", "z") and unit == "m" and float(np.median(finite)) < -limits.DEPTH_ABOVE:
            yield _above_water(trial, name, float(np.median(finite)))


def _long_way(trial: Trial, name: str) -> Iterator[Finding]:
    """An input's angle that goes from one sample to the next by more than half a turn: the other way is shorter."""
    values = trial.channel(name)
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    far = np.flatnonzero(np.abs(steps) > np.pi)
    if not far.size or float(np.abs(values[rows]).max()) > limits.FULL_TURN:
        return  # an angle beyond a turn runs on already, or is no angle in rad
    before, after = (degrees(float(values[rows[k]])) for k in (far[0], far[0] + 1))
    places = f" ({far.size} such places)" if far.size > 1 else ""
    yield make_finding(
        trial,
        "warning",
        "input-wrapped",
        f"At {trial.t[rows[far[0] + 1]]:.6g} s it goes from {before} to {after} in one sample{places}: between them, "
        "and in its servo, it turns the long way round.",
        f"If it is the direction of a pod, or of anything else that turns on, name {name!r} in the channels of the "
        "preparation step 'unwrap'; if it has to turn back, as at a stop, it is right as it is.",
        channel=name,
        samples=rows[far + 1],
    )


def _unit(trial: Trial, name: str, what: str, unit: str, severity: str = "error") -> Finding:
    return make_finding(
        trial,
        "error" if severity == "error" else "warning",
        "unit",
        f"{what}.",
        f"If the file holds {unit}, state that unit for the column." if len(unit) < 8 else f"State {unit}.",
        channel=name,
    )


def _heading(trial: Trial, finite: Array) -> Iterator[Finding]:
    steps = np.diff(finite)
    full_degrees = np.flatnonzero(np.abs(np.abs(steps) - 360.0) < 20.0)
    if full_degrees.size:
        yield _unit(trial, "psi", f"It jumps by 360 in {full_degrees.size} place(s), a turn in degrees", "deg")
        return
    span = float(np.ptp(finite))
    if span > limits.HEADING_SPAN:
        yield _unit(trial, "psi", f"It spans {span:.4g} rad ({span / 6.2832:.0f} turns)", "deg")
        return
    across = _interpolated(steps)
    if across.size:
        rows = np.flatnonzero(np.isfinite(trial.channel("psi")))[across + 1]
        yield make_finding(
            trial,
            "error",
            "wrapped-between",
            f"In {across.size} place(s) it runs back by a turn over two samples: someone interpolated or averaged it "
            "between 359 and 0 deg, and the sample between is no heading.",
            "Mark those samples with 'mark_invalid' and run 'unwrap' after it, or export the log without resampling.",
            channel="psi",
            samples=rows,
        )
        return
    turns = np.flatnonzero((np.abs(steps) > WRAP_JUMP) & (np.abs(steps) < 2.5 * np.pi))
    if turns.size:
        rows = np.flatnonzero(np.isfinite(trial.channel("psi")))[turns + 1]
        yield make_finding(
            trial,
            "error",
            "wrapped",
            f"It jumps by a turn in {turns.size} place(s), which a fit would take for motion.",
            "Run the preparation step 'unwrap'.",
            channel="psi",
            samples=rows,
        )


def _interpolated(steps: Array) -> NDArray[np.int64]:
    """Steps (n,) that make up a full turn back together with the next one, each far larger than the steps around."""
    if steps.size < limits.FEW_SAMPLES:
        return np.empty(0, dtype=np.int64)
    both = np.abs(steps[1:] + steps[:-1])
    larger = np.minimum(np.abs(steps[1:]), np.abs(steps[:-1])) > limits.OUTLIER_STEPS * max(
        float(np.median(np.abs(steps))), 1e-6
    )
    alone = np.maximum(np.abs(steps[1:]), np.abs(steps[:-1])) < WRAP_JUMP
    turn = np.abs(both - 2 * np.pi) < limits.TURN_BACK
    return np.asarray(np.flatnonzero(turn & larger & alone), dtype=np.int64)


def _above_water(trial: Trial, name: str, median: float) -> Finding:
    return make_finding(
        trial,
        "error",
        "depth-up",
        f"Half of the time it is less than {median:.3g} m, which is out of the water: it counts upward, as in the "
        "torpedo convention (y up), or it is a height.",
        "seatruth counts down: set sign = -1, and check pitch and plane angles for the same convention.",
        channel=name,
    )
