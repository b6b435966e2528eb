"""Depths against pitch and speed: the nose up must bring a vehicle up, at the rate that its speeds say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import (
    KNOWN_SCALES,
    alike,
    at_all_times,
    has_channels,
    integral,
    make_finding,
    rms,
    squared_correlation,
    windows,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_DEPTHS = ((0.01, "cm"), (0.001, "mm"), (0.3048, "ft"))
"""m in a unit, and its name."""
_ALIKE = 1e3
"""Condition of the three columns beyond which they are one: a vehicle that heaves as it pitches tells nothing. [S]"""

_TURNED = -0.25
"""Times that the depth changes by what w says, below which w has the other sign. [S] A sensor whose noise adds up to
as much as the heave itself shows 0.5 in place of 1: a quarter leaves room for three times as much."""


@dataclass(frozen=True)
class _Dive:
    """What a trial's depth changes by over windows (m,), and the parts of it that its speeds ahead and down make."""

    trial: Trial
    channel: str
    change: Array
    by_speed: Array
    by_heave: Array | None
    seconds: Array

    @property
    def expected(self) -> Array:
        return self.by_speed if self.by_heave is None else self.by_speed + self.by_heave


def check_depths(trials: Sequence[Trial]) -> Iterator[Finding]:
    """Depth against pitch and speed: its sign trial by trial, the units and the sign of w by all trials together."""
    dives = [dive for trial in trials if (dive := _dive(trial)) is not None]
    turned = [finding for dive in dives for finding in _sign(dive)]
    yield from turned
    if not turned and dives:
        yield from _sizes(dives)
    if not dives:
        yield from _level(trials)


def _dive(trial: Trial) -> _Dive | None:
    """None where a channel is missing, or where too little of the trial has all of them."""
    name = next((name for name in ("z", "depth") if has_channels(trial, name, "theta")), None)
    if name is None:
        return None
    theta = at_all_times(trial, "theta")
    speed = at_all_times(trial, "u") if has_channels(trial, "u") else np.ones(len(trial))
    sinking = -speed * np.sin(theta)
    heaving = _downward(trial) * np.cos(theta) if has_channels(trial, "w") else None
    w = windows(trial.t, [sinking] if heaving is None else [sinking, heaving], [trial.channel(name)])
    if w is None:
        return None
    change, by_speed = w.change(trial.channel(name)), w.change(integral(trial.t, sinking))
    by_heave = None if heaving is None else w.change(integral(trial.t, heaving))
    dive = _Dive(trial, name, change, by_speed, by_heave, w.seconds)
    return dive if min(rms(change), rms(dive.expected)) > 0.0 else None


def _level(trials: Sequence[Trial]) -> Iterator[Finding]:
    """The unit of a depth beside the speed down, of a vehicle whose pitch is not recorded.

    It may well pitch, so that nothing but the factor of another unit is told.
    """
    found = list[tuple[Trial, str, Array, Array]]()
    for trial in trials:
        name = next((name for name in ("z", "depth") if has_channels(trial, name, "w")), None)
        heave = np.zeros(0) if name is None else _downward(trial)
        w = None if name is None else windows(trial.t, [heave], [trial.channel(name)])
        if name is not None and w is not None:
            columns = np.column_stack([w.change(integral(trial.t, heave)), w.seconds])
            found.append((trial, name, w.change(trial.channel(name)), columns))
    if not found:
        return
    trial, name, *_ = found[0]
    change, columns = (np.concatenate([one[k] for one in found]) for k in (2, 3))
    values, *_ = np.linalg.lstsq(columns, change, rcond=None)
    rest, size = change - columns @ values, float(values[0])
    if rest @ rest > (1.0 - limits.SCALE_AGREEMENT) * float(change @ change):
        return
    for factor, unit in _DEPTHS:
        if abs(size * factor - 1.0) < limits.KNOWN_SCALE:
            yield make_finding(
                trial,
                "error",
                "unit",
                f"{name} changes by {size:.3g} times what w says: {name} is in {unit}.",
                f"State unit = '{unit}' for {name}.",
                channel=name,
            )


def _downward(trial: Trial) -> Array:
    """Speed (n,) across the length, towards the keel of a vehicle that does not roll, m/s."""
    w = at_all_times(trial, "w")
    if not has_channels(trial, "phi"):
        return w
    phi = at_all_times(trial, "phi")
    aside = at_all_times(trial, "v") * np.sin(phi) if has_channels(trial, "v") else 0.0
    return w * np.cos(phi) + aside


def _sign(dive: _Dive) -> Iterator[Finding]:
    agreement = squared_correlation(dive.change, dive.expected)
    has_speed = has_channels(dive.trial, "u")
    times = float(dive.change @ dive.expected) / float(dive.expected @ dive.expected)
    turned = times < -limits.DEPTH_TURNED if has_speed else times < 0.0
    if turned and agreement > (limits.AGREEMENT if has_speed and dive.by_heave is not None else 0.3):
        yield make_finding(
            dive.trial,
            "warning",
            "depth-pitch-sign",
            f"{dive.channel} grows while the nose is up (squared correlation {agreement:.2f}).",
            "Depth counts down and theta is positive nose up: change the sign of one of them.",
            channel=dive.channel,
        )


def _sizes(dives: Sequence[_Dive]) -> Iterator[Finding]:
    """How many times what the speeds say the depth changes, where all trials together tell."""
    dives = [dive for dive in dives if dive.by_heave is not None and has_channels(dive.trial, "u")]
    if not dives:
        return
    first = dives[0]
    change = np.concatenate([dive.change for dive in dives])
    # Of a pitch angle with an offset, and of a vehicle that is too light, the depth drifts.
    columns = np.column_stack(
        [
            np.concatenate([dive.by_speed for dive in dives]),
            np.concatenate([dive.by_heave for dive in dives if dive.by_heave is not None]),
            np.concatenate([dive.seconds for dive in dives]),
        ]
    )
    scaled = columns / (scale := _scale(columns))
    if np.linalg.cond(scaled) > _ALIKE:
        return
    values = np.linalg.lstsq(scaled, change)[0]
    rest = change - scaled @ values
    if rest @ rest > (1.0 - limits.SCALE_AGREEMENT) * float(change @ change):
        return
    variance = float(rest @ rest) / max(change.size - columns.shape[1], 1) * alike(rest)
    errors = np.sqrt(variance * np.diag(np.linalg.inv(scaled.T @ scaled))) / scale
    ahead, down, _ = (float(value) for value in values / scale)
    if ahead > 0.0 and abs(np.log(ahead)) > limits.DEPTH_OFF and abs(ahead - 1.0) > limits.SIGNIFICANT * errors[0]:
        yield _scale_finding(first, ahead, float(errors[0]))
    elif down < _TURNED and down + limits.SIGNIFICANT * errors[1] < 0.0:
        yield make_finding(
            first.trial,
            "warning",
            "heave-sign",
            f"w is positive while the vehicle rises: {first.channel} changes by {down:.2f} times what it says "
            f"(standard error {errors[1]:.2f}).",
            "w is positive down, as the depth: set sign = -1 for w, or check how the speed sensor is mounted.",
            channel="w",
        )


def _scale(columns: Array) -> Array:
    """Size of each column, so that their units do not matter to the rank; 1 of one without any."""
    sizes = np.sqrt((columns**2).mean(axis=0))
    return np.where(sizes > 0.0, sizes, 1.0)


def _scale_finding(dive: _Dive, size: float, error: float) -> Finding:
    """The finding about a depth that changes by `size` times what u and theta say."""
    name = dive.channel
    ways = [
        (channel, f"{channel} {fault} {unit}")
        for channel, units in ((name, [(1.0 / factor, unit) for factor, unit in _DEPTHS]), ("u", KNOWN_SCALES))
        for factor, unit in units
        for times, fault in ((factor, "is in"), (1.0 / factor, "was taken for"))
        if abs(size / times - 1.0) < limits.KNOWN_SCALE
    ]
    named = ": " + ", or ".join(fault for _, fault in ways) if ways else ""
    return make_finding(
        dive.trial,
        "warning",
        "depth-scale",
        f"{name} changes by {size:.3g} times what u and theta say (standard error {error:.2g}){named}.",
        f"Check the units of {name}, u and theta.",
        channel=ways[0][0] if ways else name,
    )
