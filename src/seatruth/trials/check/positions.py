"""Positions against velocities and heading.

Displacements over windows are compared with the integral of the velocities turned into earth axes. Both are complex
numbers, north + i east, so that one complex factor holds a scale and a rotation: m = a p + d T, with a = 1 if all is
well, d the drift over the window's time T (a current, if the velocities are through the water).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import (
    KNOWN_SCALES,
    Windows,
    at_all_times,
    degrees,
    has_channels,
    integral,
    make_finding,
    rms,
    white_noise,
    windows,
)
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class _Motion:
    """Displacement (m,) that a hypothesis expects, and that measured, over the windows."""

    expected: Complex
    measured: Complex
    turned: Complex
    """Change of exp(i psi) over each window: what a metre of lever arm adds."""
    seconds: Array


def displacements(trial: Trial) -> tuple[Complex, Complex] | None:
    """Displacements (m,) over windows, north + i east in m, by speeds and heading and as measured; None without any."""
    w = _windows(trial)
    if w is None:
        return None
    motion = _motion(trial, w)
    return motion.expected, motion.measured


def check_positions(trial: Trial) -> Iterator[Finding]:
    """x and y against u, v and psi."""
    if has_channels(trial, "x", "y", "psi") and not has_channels(trial, "u"):
        yield from _astern(trial)
    if not has_channels(trial, "x", "y", "u", "psi"):
        return
    w = _windows(trial)
    if w is None:
        return
    plain = _motion(trial, w)
    travel = rms(np.abs(plain.measured))
    if travel == 0.0 or rms(np.abs(plain.expected)) == 0.0:
        return
    mismatch = rms(np.abs(plain.measured - plain.expected)) / travel
    if mismatch > limits.DISAGREEMENT:
        named = _named_fault(trial, w, plain, mismatch)
        if named is not None:
            yield named
            return
    yield from _fine(trial, w, plain, mismatch)


def _astern(trial: Trial) -> Iterator[Finding]:
    """The heading against the course made good, where no speed was recorded: half a turn apart all the time."""
    if has_channels(trial, "n") and not (trial.channel("n") > 0).all():
        return  # a propeller that stops or turns astern may well drive it backwards
    position = trial.channel("x") + 1j * trial.channel("y")
    psi = at_all_times(trial, "psi")
    w = windows(trial.t, [psi], [trial.channel("x"), trial.channel("y")])
    if w is None:
        return
    moved = position[w.last] - position[w.first]
    path = float(np.sum(np.abs(moved)))
    drift = moved * np.exp(-1j * psi[(w.first + w.last) // 2])
    turned = np.ptp(np.unwrap(psi[w.first]))
    if path == 0.0 or turned < limits.HEADING_COVERAGE or float(np.sum(drift).real) > -limits.ASTERN * path:
        return  # on one course alone, a current may be stronger than the vehicle
    part = 100 * float(np.sum(drift).real) / -path
    yield make_finding(
        trial,
        "error",
        "heading-astern",
        f"On every course the vehicle moves opposite to psi ({part:.0f} % of the way).",
        "Either psi is 180 deg off (give it an offset of 180 deg), or x and y count the other way (set sign = -1).",
        channel="psi",
    )


def _windows(trial: Trial) -> Windows | None:
    inside = [at_all_times(trial, name) for name in ("u", "v", "psi") if has_channels(trial, name)]
    return windows(trial.t, inside, [trial.channel("x"), trial.channel("y")])


def _motion(
    trial: Trial,
    w: Windows,
    heading: Callable[[Array], Array] = lambda psi: psi,
    body: Callable[[Complex], Complex] = lambda velocity: velocity,
    earth: Callable[[Complex], Complex] = lambda position: position,
) -> _Motion:
    psi = heading(at_all_times(trial, "psi"))
    sway = at_all_times(trial, "v") if has_channels(trial, "v") else np.zeros(len(trial))
    forward = at_all_times(trial, "u")
    if has_channels(trial, "theta"):
        theta = at_all_times(trial, "theta")
        forward = forward * np.cos(theta)
        if has_channels(trial, "w"):
            forward = forward + at_all_times(trial, "w") * np.sin(theta)
    turn = np.exp(1j * psi)
    velocity = body(forward + 1j * sway) * turn
    expected = w.change(integral(trial.t, velocity.real)) + 1j * w.change(integral(trial.t, velocity.imag))
    position = earth(trial.channel("x") + 1j * trial.channel("y"))
    measured = position[w.last] - position[w.first]
    turned = np.exp(1j * psi[w.last]) - np.exp(1j * psi[w.first])
    return _Motion(expected, np.asarray(measured, dtype=np.complex128), turned, w.seconds)


_FAULTS: tuple[tuple[str, str, str, dict[str, Callable[[Any], Any]]], ...] = (
    ("x and y are swapped.", "Swap their columns.", "x", {"earth": lambda z: z.imag + 1j * z.real}),
    ("y counts the other way.", "Set sign = -1 for y.", "y", {"earth": np.conj}),
    ("x counts the other way.", "Set sign = -1 for x.", "x", {"earth": lambda z: -np.conj(z)}),
    (
        "x and y both count the other way, or u and v do.",
        "Set sign = -1 for x and y, or for u and v.",
        "x",
        {"earth": lambda z: -z},
    ),
    (
        "psi counts counter-clockwise.",
        "Set sign = -1 for psi (and for r, if it agrees with psi).",
        "psi",
        {"heading": lambda psi: -psi},
    ),
    (
        "psi counts counter-clockwise from y (a mathematician's heading).",
        "Set sign = -1 and an offset of 90 deg for psi, or swap x and y.",
        "psi",
        {"heading": lambda psi: np.pi / 2 - psi},
    ),
    ("v counts to port.", "Set sign = -1 for v.", "v", {"body": np.conj}),
    (
        "psi and v count the other way (axes y to port or z up).",
        "Set sign = -1 for psi, r and v.",
        "psi",
        {"heading": lambda psi: -psi, "body": np.conj},
    ),
)


def _named_fault(trial: Trial, w: Windows, plain: _Motion, mismatch: float) -> Finding | None:
    """The one fault that, undone, explains the disagreement; nothing where two faults explain it as well."""
    scores: list[tuple[float, int]] = []
    for number, (_, _, channel, undo) in enumerate(_FAULTS):
        if channel == "v" and not has_channels(trial, "v"):
            continue
        motion = _motion(trial, w, **undo)
        scores.append((rms(np.abs(motion.measured - motion.expected)) / rms(np.abs(motion.measured)), number))
    scores.sort()
    best, number = scores[0]
    if best > limits.EXPLAINED * mismatch or abs(_scale(plain)) == 0.0:
        return None
    # A similarity (a scale or a turn) that explains as much is the simpler fault, and is named where scales are.
    if _rest(plain) < 1.5 * best:
        return None
    alike = [_FAULTS[other][0] for score, other in scores[1:] if score < 1.5 * best]
    text, do, channel, _ = _FAULTS[number]
    also = f" It would also fit that {alike[0][0].lower()}{alike[0][1:]}" if alike else ""
    return make_finding(
        trial,
        "error",
        "position-axes",
        f"Displacements disagree with u, v and psi by {100 * mismatch:.0f} %, and by {100 * best:.0f} % if {text}"
        f"{also}",
        do,
        channel=channel,
    )


def _few_places(w: Windows, motion: _Motion) -> NDArray[np.int64]:
    """Ends of the windows that hold more than half of the disagreement, those of most of them; none if it is spread."""
    apart = np.abs(motion.measured - motion.expected) ** 2
    worst = np.argsort(-apart)[: len(apart) // 10]
    few = 1 + int(np.searchsorted(np.cumsum(apart[worst]), 0.5 * float(apart.sum())))
    if few > len(worst):
        return np.zeros(0, dtype=np.int64)
    ends, times = np.unique(np.concatenate([w.first[worst[:few]], w.last[worst[:few]]]), return_counts=True)
    return np.asarray(ends[times == times.max()])


def _scale(motion: _Motion) -> complex:
    """Best complex factor from expected to measured displacement."""
    bottom = float(np.sum(np.abs(motion.expected) ** 2))
    return complex(np.vdot(motion.expected, motion.measured) / bottom) if bottom else 0.0


def _off(size: float) -> float:
    """How far a scale is from one, as a logarithm: the same for one that is twice or half."""
    return abs(math.log(max(size, 1e-12)))


def _rest(motion: _Motion) -> float:
    return rms(np.abs(motion.measured - _scale(motion) * motion.expected)) / rms(np.abs(motion.measured))


def _fine(trial: Trial, w: Windows, motion: _Motion, mismatch: float) -> Iterator[Finding]:
    """Scale, rotation, drift and lever arm, each with its standard error."""
    fit = _regression(motion)
    if fit is None:
        return
    (a, drift, arm), (a_error, drift_error, arm_error), explained = fit
    if explained < limits.AGREEMENT:
        if not _beyond_noise(trial, motion, explained):
            return
        worst = _few_places(w, motion)
        yield make_finding(
            trial,
            "warning",
            "position-disagree",
            "Displacements and the integral of u, v and psi have little in common (disagreement "
            f"{100 * mismatch:.0f} %).",
            ("Look first at the positions at this place, from which most of it comes. " if worst.size else "")
            + "Check the columns, their units and their clocks.",
            channel="x",
            samples=worst,
        )
        return
    size, turn = abs(a), float(np.angle(a))
    scaled = abs(size - 1.0) > max(limits.SCALE_OFF, limits.SIGNIFICANT * a_error)
    # Late positions lose of the turns of a quick zigzag what a drift along its course gives back: displacements as they
    # are then say that no speed is wrong, and neither the scale nor the drift is there.
    traded = scaled and _off(abs(_scale(motion))) < limits.SCALE_KEPT * _off(size)
    if explained > limits.SCALE_AGREEMENT:
        if scaled and not traded:
            yield _scale_finding(trial, size, a_error)
        # Of a steady run on one course a drift may be all of the motion, and nothing is known of its direction.
        known = limits.SIGNIFICANT * a_error < size
        if known and abs(turn) > np.pi - limits.HALF_TURN:
            yield make_finding(
                trial,
                "error",
                "heading-astern",
                f"Displacements point {degrees(abs(turn))} away from where psi, u and v say (standard error "
                f"{degrees(a_error / size)}).",
                "Either psi is 180 deg off (give it an offset of 180 deg), or x and y count the other way, or u and v "
                "do (set sign = -1).",
                channel="psi",
            )
        elif known and abs(turn) > max(limits.HEADING_OFF, limits.SIGNIFICANT * a_error / size):
            yield make_finding(
                trial,
                "warning",
                "heading-offset",
                f"Displacements point {degrees(turn)} clockwise of where psi, u and v say (standard error "
                f"{degrees(a_error / size)}).",
                "Check that x, y and psi refer to the same axes, and that u, v are not through the water.",
                channel="psi",
            )
    speed = rms(np.abs(motion.measured) / motion.seconds)
    if abs(drift) > max(limits.SIGNIFICANT * drift_error, limits.DRIFT_PART * speed) and not traded:
        yield make_finding(
            trial,
            "note",
            "drift",
            f"Positions drift by {abs(drift):.2g} m/s (standard error {drift_error:.1g}) towards "
            f"{np.degrees(np.angle(drift)) % 360:.0f} deg against u, v and psi.",
            "Either u and v are through the water and there is a current, or they have an offset.",
            channel="x",
        )
    turns = np.nanmax(trial.channel("psi")) - np.nanmin(trial.channel("psi")) > limits.ARM_TURN
    # Without a sway velocity the drift in turns looks like an arm: that of the point which does not slide.
    if turns and has_channels(trial, "v") and abs(arm) > max(limits.SIGNIFICANT * arm_error, limits.MIN_ARM):
        without = motion.measured - a * motion.expected - drift * motion.seconds
        left = rms(np.abs(without - arm * motion.turned))
        if left**2 < (1.0 - limits.ARM_PART) * rms(np.abs(without)) ** 2:
            late = -arm.real / speed
            yield make_finding(
                trial,
                "note",
                "lever-arm",
                f"x, y move like a point {arm.real:.2g} m forward and {arm.imag:.2g} m to starboard (standard error "
                f"{arm_error:.1g}) of the point whose velocity is u, v; x, y that are {abs(late):.2g} s "
                f"{'late' if late > 0.0 else 'early'} beside u, v and psi look nearly the same.",
                "If the sensors sit apart, state their places, as `at` in [channels]; if smoothing delayed some "
                "channels, use 'shift_time'.",
                channel="x",
            )


def _beyond_noise(trial: Trial, motion: _Motion, explained: float) -> bool:
    """Whether displacements disagree with the motion more than the noise of their two ends explains.

    Of mean squares, the noise adds to those of the displacements and of what is not explained alike. They are those of
    as many independent numbers as there are windows, so the noise alone may show more than its own mean square.
    """
    noise = 2.0 * sum(_noise(trial, name) ** 2 for name in ("x", "y"))
    total = rms(np.abs(motion.measured)) ** 2
    rest = (1.0 - explained) * total
    if rest <= noise * (1.0 + limits.SIGNIFICANT * math.sqrt(2.0 / motion.seconds.size)):
        return False
    return 1.0 - (rest - noise) / (total - noise) < limits.AGREEMENT


def _noise(trial: Trial, name: str) -> float:
    """Standard deviation of a position from sample to sample, m: what a line through both neighbours does not give."""
    there = np.flatnonzero(np.isfinite(trial.channel(name)))
    t, values = trial.t[there], trial.channel(name)[there]
    steps = np.diff(t)
    if steps.size < limits.FEW_SAMPLES:
        return 0.0
    even = np.maximum(steps[1:], steps[:-1]) < 1.5 * float(np.median(steps))
    bends = (values[2:] - 2.0 * values[1:-1] + values[:-2])[even]
    return white_noise(bends)


def _regression(
    motion: _Motion,
) -> tuple[tuple[complex, complex, complex], tuple[float, float, float], float] | None:
    """Factor, drift and lever arm by complex least squares, their standard errors, and the explained part."""
    columns = np.column_stack([motion.expected, motion.seconds.astype(np.complex128), motion.turned])
    gram = columns.conj().T @ columns
    scale = np.sqrt(np.real(np.diag(gram)))
    if (scale == 0.0).any():
        return None
    if np.linalg.cond(gram / np.outer(scale, scale)) > 1e6:
        return None
    values = np.linalg.solve(gram, columns.conj().T @ motion.measured)
    rest = motion.measured - columns @ values
    freedom = max(motion.measured.size - 3, 1)
    total = float(np.sum(np.abs(motion.measured) ** 2))
    explained = 1.0 - float(np.sum(np.abs(rest) ** 2)) / total if total else 0.0
    # Residuals of neighbouring windows are alike (slow currents, drifting fixes): count the independent ones only.
    lag = float(np.real(np.vdot(rest[:-1], rest[1:])) / max(float(np.sum(np.abs(rest) ** 2)), 1e-300))
    inflation = (1 + max(lag, 0.0)) / max(1 - max(lag, 0.0), 0.05)
    variance = float(np.sum(np.abs(rest) ** 2)) / freedom * inflation
    errors = np.sqrt(variance * np.real(np.diag(np.linalg.inv(gram))))
    a, d, b = (complex(value) for value in values)
    return (a, d, b), (float(errors[0]), float(errors[1]), float(errors[2])), explained


def _scale_finding(trial: Trial, size: float, error: float) -> Finding:
    for factor, unit in KNOWN_SCALES:
        if abs(size / factor - 1.0) < limits.KNOWN_SCALE:
            return make_finding(
                trial,
                "error",
                "unit",
                f"Displacements are {size:.3g} times what u, v and psi say: u and v are in {unit}.",
                f"State unit = '{unit}' for u and v.",
                channel="u",
            )
    return make_finding(
        trial,
        "warning",
        "speed-scale",
        f"Displacements are {size:.3f} times what u, v and psi say (standard error {error:.3f}).",
        "Check the speed sensor's calibration and the units of x, y, u and v.",
        channel="u",
    )
