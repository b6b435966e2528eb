"""A sway velocity with its sign turned round: positions slide to the other side in turns than it says.

Drift angles of 2 to 4 deg pass the checks of single trials, where a current or a compass may explain as much. All
trials together tell: over windows the displacement is m = a A + b B + d T, with A and B what the speeds ahead and
across add up to over ground, a complex for a scale and a heading that is off, d the drift of each trial over its
windows' time T. Where all is well, b = 1.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.sensor_places import sensor_places
from seatruth.models.observed import ORIGIN
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import alike, at_all_times, has_channels, integral, windows
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_TURNED = -0.5
"""b below which the sign is taken to be turned round, and not the sway to be small. Halfway from none to -1."""
_ALIKE = 1e4
"""Condition of the columns from which the trials do not tell them apart. [S]"""

_COMPARED = ("x", "y", "psi", "u", "v")

Complex = NDArray[np.complex128]


def turned_sway(problem: EstimationProblem, known: Iterable[Finding] = ()) -> list[Finding]:
    """A warning where the sway velocities of all trials together have the sign that positions say is wrong.

    Args:
        problem: the study; it tells where the sensors stand.
        known: what is wrong already; beside an error of one of these channels nothing is said.
    """
    if any(one.severity == "error" and one.channel in _COMPARED for one in known):
        return []
    places = sensor_places(problem)
    antenna, log = (complex(*places.get(name, ORIGIN)[:2]) for name in ("x", "v"))
    trials = [trial for trial in problem.trials if has_channels(trial, *_COMPARED)]
    parts = [part for trial in trials if (part := _displacements(trial, antenna - log)) is not None]
    if not parts:
        return []
    moved = np.concatenate([one.moved for one in parts])
    across = np.concatenate([one.across for one in parts])
    drift = np.zeros((len(moved), len(parts)), dtype=np.complex128)
    row = 0
    for k, one in enumerate(parts):
        drift[row : row + len(one.moved), k] = one.seconds
        row += len(one.moved)
    ahead = np.concatenate([one.ahead for one in parts])
    found = _share(moved, across, np.column_stack([ahead, 1j * ahead, drift, 1j * drift]))
    if found is None or not (found[0] < _TURNED and found[0] + limits.SIGNIFICANT * found[1] < 0.0):
        return []
    turned = np.concatenate([one.turned for one in parts])
    arm = _share(moved - across, turned, np.column_stack([ahead, 1j * ahead, drift, 1j * drift]))
    elsewhere = ""
    if arm is not None:
        side = "ahead of" if arm[0] > 0.0 else "behind"
        elsewhere = (
            f", or state where the position's antenna stands: {abs(arm[0]):.2g} m {side} where the study has it would "
            "look the same"
        )
    return [
        Finding(
            "warning",
            "sway-sign",
            f"In turns the positions slide to the other side than v says: they move by {found[0]:.2f} times what it "
            f"adds up to over ground (standard error {found[1]:.2f}).",
            "channel 'v'",
            f"v is positive to starboard: set sign = -1 for v{elsewhere}.",
            channel="v",
        )
    ]


class _Displacements:
    """Of one trial, over its windows: displacements, what speeds ahead and across add up to, exp(i psi), seconds."""

    def __init__(self, moved: Complex, ahead: Complex, across: Complex, turned: Complex, seconds: Array) -> None:
        self.moved, self.ahead, self.across, self.turned, self.seconds = moved, ahead, across, turned, seconds


def _displacements(trial: Trial, arm: complex) -> _Displacements | None:
    """Those of the log, to which the antenna's `arm` (m, forward + i starboard) leads; None of too few windows."""
    psi, u, v = (at_all_times(trial, name) for name in ("psi", "u", "v"))
    w = windows(trial.t, [psi, u, v], [trial.channel("x"), trial.channel("y")])
    if w is None:
        return None
    direction = np.exp(1j * psi)

    def over(velocity: Complex) -> Complex:
        change = w.change(integral(trial.t, velocity.real)) + 1j * w.change(integral(trial.t, velocity.imag))
        return np.asarray(change, dtype=np.complex128)

    position = trial.channel("x") + 1j * trial.channel("y")
    turned = np.asarray(direction[w.last] - direction[w.first], dtype=np.complex128)
    moved = np.asarray(position[w.last] - position[w.first] - arm * turned, dtype=np.complex128)
    return _Displacements(moved, over(u * direction), over(1j * v * direction), turned, w.seconds)


def _share(moved: Complex, wanted: Complex, beside: Complex) -> tuple[float, float] | None:
    """How many times a column is in displacements beside others, each with a real factor, and its standard error.

    None where it cannot be told from the others, or where together they explain too little to believe them.
    """
    columns = np.column_stack([wanted, beside])
    stacked, right = np.concatenate([columns.real, columns.imag]), np.concatenate([moved.real, moved.imag])
    scale = np.sqrt((stacked**2).mean(axis=0))
    if not (np.isfinite(stacked).all() and np.isfinite(right).all() and (scale > 0.0).all()):
        return None
    scaled = stacked / scale
    if len(right) <= scaled.shape[1] or np.linalg.cond(scaled) > _ALIKE:
        return None
    values = np.linalg.lstsq(scaled, right)[0]
    rest = right - scaled @ values
    if rest @ rest > (1.0 - limits.SCALE_AGREEMENT) * float(right @ right):
        return None
    variance = float(rest @ rest) / (len(rest) - scaled.shape[1]) * alike(rest)
    error = np.sqrt(variance * np.linalg.inv(scaled.T @ scaled)[0, 0]) / scale[0]
    return float(values[0] / scale[0]), float(error)
