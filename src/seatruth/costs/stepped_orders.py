"""Orders that step: between samples, where lines would begin them too early, or in a pause, where nobody knows when."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import RegressionOptions, TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.effects.undeclared_actuators import bare, drive_commands
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.text import listed
from seatruth.trials.channel import Hold
from seatruth.trials.check.helpers import pauses
from seatruth.trials.check.limits import COARSE_INPUT_STEP
from seatruth.trials.check.sensors import least_noise
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

_RESTS = 0.5
"""Part of the samples at which an order that steps stays as it was. Chosen here [S]."""
_DITHER = 0.01
"""Part of an order's range by which it may change and still stays as it was. Chosen here [S]."""
_ROUNDED, _HARDLY = 3, 0.02
"""Units of the last digit, and part of its size, within which an input that is rounded keeps one value. Chosen here
[S]."""


def without_stale_notes(
    findings: Iterable[Finding], problem: EstimationProblem, trials: Iterable[Trial]
) -> list[Finding]:
    """The findings about trials without those that ask for what the study says.

    An input is an order, initial states are free, the noise is larger than the rounding, the antenna has a place.
    """
    runs = {trial.name: trial for trial in trials}
    ordered = {servo.input for servo in problem.model.servos}
    placed = _has_place(problem.model, "x")
    free = isinstance(problem.cost, TrajectoryOptions) and problem.cost.initial == "free"
    return [
        finding
        for finding in findings
        if not (finding.code == "input-jumps" and finding.channel in ordered)
        and not (finding.code == "output-late" and free)
        and not (finding.code == "lever-arm" and placed)
        and not (finding.code == "quantised" and _noise_is_enough(runs.get(finding.trial), finding.channel, problem))
    ]


def _has_place(model: Model | None, channel: str) -> bool:
    """Whether a model shows a channel at a place of its own, whatever else is wrapped about it."""
    while model is not None:
        if any(one.channel == channel and any(one.at) for one in getattr(model, "observations", ())):
            return True
        model = getattr(model, "base", None)
    return False


def _noise_is_enough(trial: Trial | None, name: str, problem: EstimationProblem) -> bool:
    """Whether a study states a noise of an output that holds the rounding of its record."""
    stated = problem.noise.get(name, 0.0)
    return trial is not None and not isinstance(stated, str) and stated >= least_noise(trial.channel(name))


def stepped_orders(problem: EstimationProblem, trials: Iterable[Trial]) -> list[Finding]:
    """A warning where orders, or commands of drives, step while the study joins their samples by straight lines."""
    options = problem.cost
    if not isinstance(options, TrajectoryOptions | RegressionOptions):
        return []
    runs = list(trials)
    count: dict[str, int] = {}
    spacing = 0.0
    ordered = dict.fromkeys([*(servo.input for servo in problem.model.servos), *_commands(problem)])
    for name in _joined_by_lines(ordered, problem, options.hold):
        steps = [_steps(trial, name) for trial in runs]
        if sum(steps):
            count[name] = sum(steps)
            usual = [float(np.median(np.diff(trial.t))) for trial, found in zip(runs, steps) if found]
            spacing = max(spacing, *usual)
    if not count:
        return []
    said = listed([f"{name!r} ({found} times)" for name, found in count.items()])
    return [
        Finding(
            "warning",
            "orders-step",
            f"Orders step, those of {said}, and lines between samples begin each step up to a sampling step early "
            f"({spacing:.2g} s). A lag or a rate limit makes up for it, with a wrong value.",
            "study",
            'Set hold = "zoh" in [cost], or of these alone in [channels], if orders change when they are recorded.',
            channel=next(iter(count)) if len(count) == 1 else "",
        )
    ]


def stepping_inputs(problem: EstimationProblem, trials: Iterable[Trial]) -> dict[str, int]:
    """How often inputs that are no orders, as far as is known, jump from rest to rest while lines join their samples.

    No actuator does that between two samples. Empty where the study holds inputs between samples.
    """
    options = problem.cost
    if not isinstance(options, TrajectoryOptions):
        return {}
    ordered, runs = {*(servo.input for servo in problem.model.servos), *_commands(problem)}, list(trials)
    names = [channel.name for channel in problem.model.inputs if channel.name not in ordered]
    joined = _joined_by_lines(names, problem, options.hold)
    count = {name: sum(_steps(trial, name) for trial in runs) for name in joined}
    return {name: steps for name, steps in count.items() if steps}


def _joined_by_lines(names: Iterable[str], problem: EstimationProblem, usual: Hold) -> list[str]:
    """Those of these inputs that go from sample to sample on lines."""
    return [name for name in names if problem.model.holds.get(name, usual) == "foh"]


def _commands(problem: EstimationProblem) -> tuple[str, ...]:
    """Commands of drives: a drive does not step, but what it is told does. A simulator may hold them itself."""
    return () if isinstance(problem.model, BlackBox) else drive_commands(bare(problem.model))


def _steps(trial: Trial, name: str) -> int:
    """How often an input jumps from rest to rest; 0 where the trial has none of that name, or lacks samples of it."""
    values = trial.inputs.get(name)
    return 0 if values is None or not np.isfinite(values).all() else steps_from_rest(values)


def steps_from_rest(values: Array) -> int:
    """How often an order (n,) jumps from rest to rest; 0 where it moves most of the time.

    An autopilot that holds a course or a depth changes its orders a little all the time, which counts as rest. So does
    the last digit of what is rounded: 659, 660 and 661 rpm.

    Example:
        >>> steps_from_rest(np.array([1500.0, 1501.0, 1501.0, 1500.0, 1680.0, 1681.0, 1680.0]))
        1
        >>> steps_from_rest(np.array([660.0, 660.0, 661.0, 661.0, 661.0, 659.0, 659.0]))
        0
    """
    if len(values) < 3:
        return 0
    change, span = np.abs(np.diff(values)), float(np.ptp(values))
    if 0.0 < span < _HARDLY * float(np.abs(values).max()) and span < (_ROUNDED + 0.5) * change[change > 0.0].min():
        return 0
    if span == 0 or np.mean(change <= _DITHER * span) < _RESTS:
        return 0
    return int(np.sum(change > COARSE_INPUT_STEP * span))


def steps_in_gaps(problem: EstimationProblem, trials: Iterable[Trial]) -> list[Finding]:
    """A warning where an input changes much over a pause of the sampling: when it did, decides what the run does."""
    if not isinstance(problem.cost, TrajectoryOptions) or problem.cost.segments is not None:
        return []  # a segment begins anew soon after
    found: dict[str, list[tuple[str, float]]] = {}
    for trial in trials:
        if len(trial) < 3 or not (np.diff(trial.t) > 0).all():
            continue
        before, _ = pauses(trial)
        for name, values in trial.inputs.items():
            span = float(np.ptp(values)) if np.isfinite(values).all() else 0.0
            jumps = [k for k in before if span > 0 and abs(values[k + 1] - values[k]) > COARSE_INPUT_STEP * span]
            if jumps:
                longest = max(float(trial.t[k + 1] - trial.t[k]) for k in jumps)
                found.setdefault(trial.name, []).append((name, longest))
    if not found:
        return []
    inputs = list(dict.fromkeys(name for rows in found.values() for name, _ in rows))
    longest = max(pause for rows in found.values() for _, pause in rows)
    return [
        Finding(
            "warning",
            "step-in-gap",
            f"{listed([repr(name) for name in inputs])} step{'s' if len(inputs) == 1 else ''} during pauses of the log "
            f"of up to {longest:.2g} s, in {listed([repr(name) for name in found])}. When is not known, and the "
            "parameters make up for it: their intervals need not hold the truth.",
            "study",
            "Set split_at_gaps = true in [[trials]].",
            channel=inputs[0] if len(inputs) == 1 else "",
        )
    ]
