"""Positions against the velocity over ground that a satellite receiver gives, and speeds through the water against it.

A receiver gives its speed and course (`sog`, `cog`), or its velocity north and east (`v_n`, `v_e`). These hold what a
log's u and v hold where neither was recorded: which way x and y count, and in what unit a speed stands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import (
    KNOWN_SCALES,
    Windows,
    at_all_times,
    has_channels,
    integral,
    make_finding,
    rms,
    windows,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

Complex = NDArray[np.complex128]
_UNITS = (*KNOWN_SCALES, (3600.0 / 1852.0, "m/s"))
"""Factor from a number to the speed in m/s where it is read as m/s, or, of the last, as knots."""
_AXES: tuple[tuple[str, str, str, Callable[[Complex], Complex]], ...] = (
    (
        "x and y (latitude and longitude) are swapped.",
        "Exchange their columns.",
        "x",
        lambda z: np.asarray(z.imag + 1j * z.real),
    ),
    ("y counts the other way.", "Set sign = -1 for y.", "y", lambda z: np.asarray(np.conj(z))),
    ("x counts the other way.", "Set sign = -1 for x.", "x", lambda z: np.asarray(-np.conj(z))),
    ("x and y both count the other way.", "Set sign = -1 for both.", "x", lambda z: np.asarray(-z)),
)

_LENGTHS = ((1e-3, "m", "km"), (1e3, "km", "m"), (0.3048, "ft", "m"), (1.0 / 0.3048, "m", "ft"))
"""Factor on a length in m that is in the first unit, and was read in the second."""
_VELOCITIES = (("sog", "cog"), ("v_n", "v_e"))

_HEADINGS: tuple[tuple[str, str, Callable[[Array], Array]], ...] = (
    ("it counts counter-clockwise.", "Set sign = -1 for psi (and for r, if it agrees with psi).", lambda psi: -psi),
    (
        "it counts counter-clockwise from east (as ROS does).",
        "Set sign = -1 and offset = 1.5708 (90 deg) for psi, and sign = -1 for r if it agrees with psi.",
        lambda psi: np.pi / 2 - psi,
    ),
)
"""Headings that point nowhere near the course. One that is half a turn off is named by `check_positions`."""


def check_ground_track(trial: Trial) -> Iterator[Finding]:
    """x and y against the velocity over ground; the speed through the water against that over ground."""
    for names in _VELOCITIES:
        if has_channels(trial, *names):
            found = list(_track(trial, names)) if has_channels(trial, "x", "y") else []
            yield from found
            if not found and has_channels(trial, "psi") and not has_channels(trial, "u"):
                yield from _heading(trial, names)
            # Against a speed over ground that is wrong itself, the other one would be blamed.
            if not found and has_channels(trial, "u_w"):
                yield from _through_the_water(trial, names)
            return


def velocity_over_ground(trial: Trial) -> Complex | None:
    """Velocity over ground (n,), north + i east, m/s; None where it is not recorded."""
    for names in _VELOCITIES:
        if has_channels(trial, *names):
            return _velocity(trial, names)
    return None


def _velocity(trial: Trial, names: tuple[str, str]) -> Complex:
    """Velocity over ground (n,), north + i east."""
    one, other = (at_all_times(trial, name) for name in names)
    return np.asarray(one * np.exp(1j * other) if names[0] == "sog" else one + 1j * other, dtype=np.complex128)


def _windows(trial: Trial, inside: Complex) -> Windows | None:
    return windows(trial.t, [inside.real, inside.imag], [trial.channel("x"), trial.channel("y")])


def _way(trial: Trial, w: Windows, velocity: Complex) -> Complex:
    """Displacement (m,) over each window at this velocity."""
    change = w.change(integral(trial.t, velocity.real)) + 1j * w.change(integral(trial.t, velocity.imag))
    return np.asarray(change, dtype=np.complex128)


def _track(trial: Trial, names: tuple[str, str]) -> Iterator[Finding]:
    velocity = _velocity(trial, names)
    w = _windows(trial, velocity)
    if w is None:
        return
    position = trial.channel("x") + 1j * trial.channel("y")
    moved, expected = np.asarray(position[w.last] - position[w.first]), _way(trial, w, velocity)
    travel = rms(np.abs(moved))
    if travel == 0.0 or rms(np.abs(expected)) == 0.0:
        return

    def apart(one: Complex, other: Complex) -> float:
        return rms(np.abs(one - other)) / travel

    mismatch, said = apart(moved, expected), " and ".join(names)
    if mismatch <= limits.DISAGREEMENT:
        return
    options: list[tuple[float, Finding]] = []

    def message(left: float, text: str) -> str:
        return f"Displacements disagree with {said} by {100 * mismatch:.0f} %, and by {100 * left:.0f} % if {text}"

    for text, do, channel, undo in _AXES:
        left = apart(undo(moved), expected)
        options.append((left, make_finding(trial, "error", "position-axes", message(left, text), do, channel=channel)))
    if names[0] == "sog" and has_channels(trial, "psi"):
        heading = np.asarray(at_all_times(trial, "sog") * np.exp(1j * at_all_times(trial, "psi")))
        if _windows(trial, heading) is not None:
            left = apart(moved, _way(trial, w, heading))
            text, do = "psi stands in the place of cog.", "Exchange the columns of psi and cog, or leave cog out."
            options.append(
                (left, make_finding(trial, "error", "heading-course", message(left, text), do, channel="cog"))
            )
    size = travel / rms(np.abs(expected))
    for factor, unit in _UNITS:
        if abs(size / factor - 1.0) < limits.KNOWN_SCALE:
            left, do = apart(moved, factor * expected), f"State unit = '{unit}' for {names[0]}."
            text = message(left, f"{said} stand in {unit}.")
            options.append((left, make_finding(trial, "error", "unit", text, do, channel=names[0])))
    for factor, unit, stated in _LENGTHS:
        for channel, undo in _in_length(factor):
            left = rms(np.abs(undo(moved) - expected)) / rms(np.abs(undo(moved)))
            verb = "stand" if channel == "x and y" else "stands"
            text = message(left, f"{channel} {verb} in {unit}, not in {stated}.")
            do = f"State unit = '{unit}' for {channel}."
            options.append((left, make_finding(trial, "error", "unit", text, do, channel=channel[0])))
    best, found = min(options, key=lambda option: option[0])
    if best <= limits.EXPLAINED * mismatch:
        yield found


def _in_length(factor: float) -> Iterator[tuple[str, Callable[[Complex], Complex]]]:
    """The positions that may stand in another unit, and displacements with these so many times as long."""
    yield "x and y", lambda z: np.asarray(factor * z)
    yield "x", lambda z: np.asarray(factor * z.real + 1j * z.imag)
    yield "y", lambda z: np.asarray(z.real + 1j * factor * z.imag)


def _heading(trial: Trial, names: tuple[str, str]) -> Iterator[Finding]:
    """psi against the course: a heading that counts another way is near it nowhere but by chance."""
    velocity, psi = _velocity(trial, names), at_all_times(trial, "psi")
    good = np.isfinite(velocity) & np.isfinite(psi)
    if int(good.sum()) < limits.FEW_SAMPLES or _turned(velocity[good]) < limits.HEADING_COVERAGE:
        return
    velocity, psi = velocity[good], psi[good]
    size = rms(np.abs(velocity))
    if size == 0.0:
        return
    left = {
        text: rms(np.abs(velocity - np.abs(velocity) * np.exp(1j * read(psi)))) / size for text, _, read in _HEADINGS
    }
    now = rms(np.abs(velocity - np.abs(velocity) * np.exp(1j * psi))) / size
    best = min(_HEADINGS, key=lambda option: left[option[0]])
    if left[best[0]] <= limits.EXPLAINED * now:
        yield make_finding(
            trial,
            "error",
            "heading-course",
            f"psi disagrees with the course over ground by {100 * now:.0f} %, and by {100 * left[best[0]]:.0f} % if "
            f"{best[0]}",
            best[1],
            channel="psi",
        )


def _through_the_water(trial: Trial, names: tuple[str, str]) -> Iterator[Finding]:
    """The unit of the speed through the water, where it is a known factor off on courses a quarter turn apart."""
    velocity, through = _velocity(trial, names), at_all_times(trial, "u_w")
    good = np.isfinite(velocity) & np.isfinite(through) & (np.abs(velocity) > 0.5 * rms(np.abs(velocity)))
    if int(good.sum()) < limits.FEW_SAMPLES or _turned(velocity[good]) < limits.HEADING_COVERAGE:
        return
    ratio = np.abs(velocity[good]) / np.maximum(np.abs(through[good]), 1e-12)
    low, middle, high = np.quantile(ratio, [0.25, 0.5, 0.75])
    if high - low > limits.DISAGREEMENT * middle:
        return
    for factor, unit in _UNITS:
        if abs(middle / factor - 1.0) < limits.KNOWN_SCALE:
            yield make_finding(
                trial,
                "error",
                "unit",
                f"On every course the speed over ground is {middle:.3g} times u_w: u_w stands in {unit}.",
                f"State unit = '{unit}' for u_w.",
                channel="u_w",
            )


def _turned(velocity: Complex) -> float:
    """Range of the course, rad."""
    return float(np.ptp(np.unwrap(np.angle(velocity))))
