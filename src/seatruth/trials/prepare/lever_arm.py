"""Lever-arm compensation: what a sensor away from the body's origin would have seen at the origin.

A sensor at r in body axes (x forward, y starboard, z down) measures
    v_m = v_o + w x r,   a_m = a_o + dw/dt x r + w x (w x r),   p_m = p_o + C(phi, theta, psi) r
with w = (p, q, r). a is the kinematic acceleration (d/dt of the velocity, gravity removed), seen in body axes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from pydantic import Field

from seatruth.arrays import Array
from seatruth.errors import BadInput, nearest
from seatruth.trials.prepare.base import Options, preparation, regular_step, with_channels
from seatruth.trials.prepare.filters import savgol_slope
from seatruth.trials.trial import Trial

Get = Callable[[str], Array]


class LeverArm(Options):
    """`position` [x, y, z] m of the sensor in body axes, and the `channels` that it measures.

    A rate or attitude that the formula needs and the trial has not is refused, or taken as zero with
    `missing = "zero"`. Rotational accelerations are taken from p_dot, q_dot, r_dot if the trial has them, otherwise
    differentiated over `window` samples.
    """

    position: list[float] = Field(min_length=3, max_length=3)
    channels: list[str] = Field(min_length=1)
    missing: Literal["refuse", "zero"] = "refuse"
    window: int = Field(default=11, ge=5)


@preparation("lever_arm", LeverArm)
def lever_arm(trial: Trial, options: LeverArm) -> tuple[Trial, str]:
    """Moves velocities, accelerations or positions from a sensor's place to the body's origin."""
    if not all(np.isfinite(options.position)):
        raise BadInput("option 'position' is not finite", do="Give metres forward, starboard and down.")
    taken_zero: set[str] = set()
    changed: dict[str, Array] = {}
    largest: list[str] = []

    def get(name: str) -> Array:
        if name in trial.outputs or name in trial.inputs:
            return trial.channel(name)
        if name.endswith("_dot"):
            rate = get(name.removesuffix("_dot"))
            return savgol_slope(rate, regular_step(trial, "a rotational acceleration"), options.window | 1, 3)
        if options.missing == "refuse":
            raise BadInput(
                f"the correction needs {name!r}, which the trial has not",
                do="State the place as `at` in [channels], which needs no attitude and adds no noise; or "
                f"map {name!r}, make it with 'differentiate', or set missing to 'zero' if it stays near zero.",
            )
        taken_zero.add(name)
        return np.zeros(len(trial))

    for name in dict.fromkeys(options.channels):
        values = trial.channel(name)
        if name not in _TERMS:
            raise BadInput(f"{name!r} does not depend on a lever arm", do=nearest(name, _TERMS))
        extra = lever_arm_effect(name, options.position, get, len(trial))
        changed[name] = values - extra
        size = float(np.nanmax(np.abs(extra))) if np.isfinite(extra).any() else float("nan")
        largest.append(f"{name} by up to {size:.3g}")
    effect = f"corrected {', '.join(largest)}"
    if taken_zero:
        effect += f"; {', '.join(sorted(taken_zero))} taken as zero"
    return with_channels(trial, changed), effect


def lever_arm_effect(name: str, position: Sequence[float], get: Get, n: int) -> Array:
    """What a sensor at `position` reads too much in one channel (n,); `get` gives rates and attitudes by name.

    Only what a nonzero arm needs is asked for, so that a horizontal arm forward needs the yaw rate alone.
    """
    total = np.zeros(n)
    for arm, term in zip(position, _TERMS[name], strict=True):
        if arm != 0.0 and term is not None:
            total = total + arm * term(get)
    return total


def _north_x(get: Get) -> Array:
    return _array(np.cos(get("theta")) * np.cos(get("psi")))


def _north_y(get: Get) -> Array:
    phi, theta, psi = get("phi"), get("theta"), get("psi")
    return _array(np.sin(phi) * np.sin(theta) * np.cos(psi) - np.cos(phi) * np.sin(psi))


def _north_z(get: Get) -> Array:
    phi, theta, psi = get("phi"), get("theta"), get("psi")
    return _array(np.cos(phi) * np.sin(theta) * np.cos(psi) + np.sin(phi) * np.sin(psi))


def _east_x(get: Get) -> Array:
    return _array(np.cos(get("theta")) * np.sin(get("psi")))


def _east_y(get: Get) -> Array:
    phi, theta, psi = get("phi"), get("theta"), get("psi")
    return _array(np.sin(phi) * np.sin(theta) * np.sin(psi) + np.cos(phi) * np.cos(psi))


def _east_z(get: Get) -> Array:
    phi, theta, psi = get("phi"), get("theta"), get("psi")
    return _array(np.cos(phi) * np.sin(theta) * np.sin(psi) - np.sin(phi) * np.cos(psi))


def _down_x(get: Get) -> Array:
    return _array(-np.sin(get("theta")))


def _down_y(get: Get) -> Array:
    return _array(np.cos(get("theta")) * np.sin(get("phi")))


def _down_z(get: Get) -> Array:
    return _array(np.cos(get("theta")) * np.cos(get("phi")))


def _array(values: Any) -> Array:
    return np.asarray(values, dtype=np.float64)


Term = Callable[[Get], Array]
_DOWN = (_down_x, _down_y, _down_z)
_TERMS: dict[str, tuple[Term | None, Term | None, Term | None]] = {
    "x": (_north_x, _north_y, _north_z),
    "y": (_east_x, _east_y, _east_z),
    "z": _DOWN,
    "depth": _DOWN,
    "u": (None, lambda g: -g("r"), lambda g: g("q")),
    "v": (lambda g: g("r"), None, lambda g: -g("p")),
    "w": (lambda g: -g("q"), lambda g: g("p"), None),
    "a_x": (
        lambda g: -(g("q") ** 2 + g("r") ** 2),
        lambda g: g("p") * g("q") - g("r_dot"),
        lambda g: g("p") * g("r") + g("q_dot"),
    ),
    "a_y": (
        lambda g: g("q") * g("p") + g("r_dot"),
        lambda g: -(g("r") ** 2 + g("p") ** 2),
        lambda g: g("q") * g("r") - g("p_dot"),
    ),
    "a_z": (
        lambda g: g("r") * g("p") - g("q_dot"),
        lambda g: g("r") * g("q") + g("p_dot"),
        lambda g: -(g("p") ** 2 + g("q") ** 2),
    ),
}
"""For each channel, what one metre of arm along body x, y and z adds to it."""
