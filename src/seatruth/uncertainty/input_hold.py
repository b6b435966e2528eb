"""Whether inputs that step are orders: held between samples they then fit better than joined by lines.

A line begins each step up to a sampling step early. Where that is wrong, the parameters make up for it, and lie outside
their intervals by several of their errors, with residuals that nothing else tells from noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.stepped_orders import stepping_inputs
from seatruth.costs.study_cost import StudyCost
from seatruth.models.black_box import BlackBox
from seatruth.models.fmu import FMU
from seatruth.optimizers import Budget, minimise
from seatruth.text import listed
from seatruth.trials.channel import Hold
from seatruth.trials.finding import Finding

_HOLDS: tuple[Hold, Hold] = ("foh", "zoh")
_BETTER = 10.0
"""nats of likelihood by which a fit with held inputs must be better: odds of 20,000. Chosen here [S]."""
_STEPS = 10
"""Steps of least squares of either fit: it begins at the answer, which is near. Chosen here [S]."""


def held_inputs(study: EstimationProblem, x: Array, *, threads: int | None) -> Finding | None:
    """A warning where inputs that step from rest to rest fit better held between samples; None where they do not.

    Args:
        study: The study.
        x: The answer of its search (K,).
        threads: Threads of a simulation; None for all processors.

    Raises:
        SeatruthError: The model cannot be simulated so.
        KeyboardInterrupt: The user stopped it.
    """
    names = stepping_inputs(study, study.trials)
    if not names or not isinstance(study.cost, TrajectoryOptions):
        return None
    if isinstance(study.model, BlackBox):
        # Its runs may be dear, and only of an FMU it is known what it does between samples.
        known = isinstance(study.model, FMU)
        return _finding(names, "these may be orders, which lines between samples begin too early") if known else None
    before, after = (_refitted(study, study.cost, x, hold, threads) for hold in _HOLDS)
    better = sum(count * math.log(a / after[name][0]) for name, (a, count) in before.items() if after[name][0] > 0.0)
    if not better > _BETTER:
        return None
    worst = max(before, key=lambda name: before[name][0] / max(after[name][0], 1e-300))
    ratio = after[worst][0] / before[worst][0]
    they = "it is" if len(names) == 1 else "they are"
    better_so = f"the trials fit better where {they} held between samples than joined by lines"
    return _finding(names, f"{better_so}: the error of {worst} falls to {100.0 * ratio:.2g} %")


def _finding(names: Mapping[str, int], why: str) -> Finding:
    said = listed([f"{name!r} ({steps} times)" for name, steps in names.items()])
    return Finding(
        "warning",
        "orders-step",
        f"{said} step{'s' if len(names) == 1 else ''} from rest to rest: {why}. True values can lie outside the "
        "intervals.",
        "study",
        'Set hold = "zoh" in [cost]; or name the input under [actuators], if an actuator follows it.',
        channel=next(iter(names)) if len(names) == 1 else "",
    )


def _refitted(
    study: EstimationProblem, options: TrajectoryOptions, x: Array, hold: Hold, threads: int | None
) -> dict[str, tuple[float, int]]:
    """Errors of the channels after a few steps from the answer, with inputs held so.

    Initial states are free: those of noisy first samples leave errors that a shift in time may make up for.
    """
    changed = options.replace(hold=hold, initial="free")
    cost = cost_of(study.replace(cost=changed), threads=threads)
    start = cost.start.copy()
    start[: len(cost.space.free)] = x[: len(cost.space.free)]
    budget = Budget(evaluations=_STEPS * (len(start) + 1))
    outcome = minimise(cost, "least_squares", budget=budget, start=np.clip(start, *cost.bounds))
    if outcome.code == "interrupted":
        raise KeyboardInterrupt
    return _errors(cost, outcome.x)


def _errors(cost: StudyCost, x: Array) -> dict[str, tuple[float, int]]:
    """Root mean square error of each channel over all trials, and of how many samples."""
    parts: dict[str, list[Array]] = {}
    for trial, y in zip(cost.trials, cost.predict(x)):
        for column, channel in enumerate(cost.problem.model.outputs):
            measured = trial.outputs.get(channel.name)
            if measured is not None:
                error = np.asarray(measured - y[:, column])
                parts.setdefault(channel.name, []).append(error[np.isfinite(error)])
    return {name: _size(errors) for name, errors in parts.items() if sum(e.size for e in errors)}


def _size(errors: Sequence[Array]) -> tuple[float, int]:
    joined = np.concatenate(errors)
    return float(np.sqrt(np.mean(joined**2))), joined.size
