"""Time axis, missing samples, and channels that a model needs."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from seatruth.errors import nearest
from seatruth.trials.check import limits
from seatruth.trials.check.helpers import Channels, make_finding
from seatruth.trials.finding import Finding
from seatruth.trials.prepare.base import gaps
from seatruth.trials.trial import Trial


def check_time(trial: Trial) -> Iterator[Finding]:
    """Increasing, regular, without pauses, long enough."""
    if len(trial) < limits.FEW_SAMPLES:
        yield make_finding(
            trial, "warning", "few-samples", f"It has only {len(trial)} samples.", "Use a longer record."
        )
    if len(trial) < 3:
        return
    steps = np.diff(trial.t)
    if not (np.isfinite(trial.t).all() and (steps > 0).all()):
        back = np.flatnonzero(~(steps > 0)) + 1
        yield make_finding(
            trial,
            "error",
            "time-order",
            f"Time does not increase at {back.size} sample(s).",
            "Sort the file by time and delete repeated samples.",
            samples=back[:1],
        )
        return
    step = float(np.median(steps))
    pauses = np.flatnonzero(steps > limits.GAP_STEPS * step)
    if pauses.size:
        longest = pauses[np.argmax(steps[pauses])]
        yield make_finding(
            trial,
            "warning",
            "time-gap",
            f"{pauses.size} pause(s) without samples; the longest is {steps[longest]:.3g} s against a sampling step "
            f"of {step:.3g} s.",
            "What the inputs did in a pause is not known: cut the trial there, or use segments.",
            samples=np.array([longest, longest + 1]),
        )
    usual = np.delete(steps, pauses)
    uneven = float(np.mean(np.abs(usual - step) > limits.JITTER * step))
    if uneven > 0.01:
        yield make_finding(
            trial,
            "note",
            "time-irregular",
            f"Sampling is uneven: {100 * uneven:.0f} % of the steps differ from {step:.3g} s by more than "
            f"{100 * limits.JITTER:.0f} %.",
            "Fits accept it; the steps low_pass and differentiate need 'resample' first.",
        )


def check_missing(trial: Trial) -> Iterator[Finding]:
    """Missing samples of inputs and outputs."""
    yield from _codes(trial)
    for name, values in trial.inputs.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            yield make_finding(
                trial,
                "error",
                "input-missing",
                f"{bad.size} of {values.size} samples are missing, and a simulation needs them all.",
                "Use 'fill_gaps' for short gaps or 'cut' for long ones.",
                channel=name,
                samples=bad,
            )
    for name, values in trial.outputs.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size == values.size:
            yield make_finding(
                trial,
                "error",
                "output-empty",
                "No sample is valid.",
                "Check the column, or say that the trial goes without this output.",
                channel=name,
            )
        elif bad.size > limits.MISSING_PART * values.size:
            yield make_finding(
                trial,
                "warning",
                "output-missing",
                f"{100 * bad.size / values.size:.0f} % of the samples are not valid.",
                "They take no part in the fit. Check that this is meant.",
                channel=name,
            )
        elif bad.size:
            late = int(np.flatnonzero(np.isfinite(values))[0])
            if late > limits.LATE_START:
                yield make_finding(
                    trial,
                    "warning",
                    "output-late",
                    f"Its first valid sample is {trial.t[late] - trial.t[0]:.4g} s after the trial's start.",
                    "An initial state that it gives is that of the later moment: cut the trial's start, or set "
                    'initial = "free".',
                    channel=name,
                    samples=np.arange(late),
                )
            first, stop = max(gaps(values), key=lambda gap: gap[1] - gap[0])
            if stop - first > max(10, limits.LONG_MISSING_PART * values.size):
                yield make_finding(
                    trial,
                    "note",
                    "output-gap",
                    f"No valid sample from t = {trial.t[first]:.4g} to {trial.t[stop - 1]:.4g} s.",
                    "They take no part in the fit. Check that this is meant.",
                    channel=name,
                    samples=np.arange(first, stop),
                )


def _codes(trial: Trial) -> Iterator[Finding]:
    """Numbers that a logger writes for a missing value and that reading has taken out."""
    for step in trial.steps:
        for name, codes in step.options.get("missing_codes", {}).items():
            text = " and ".join(f"{code:.10g}" for code in codes)
            yield make_finding(
                trial,
                "note",
                "missing-code",
                f"The file holds {text} where it has no value; those samples are taken as missing.",
                "They take no part in the fit. If the logger wrote them for another reason, ask what it is.",
                channel=name,
            )


def check_model_channels(trial: Trial, model: Channels) -> Iterator[Finding]:
    """Channels that the model needs and the trial has not."""
    for channel in model.inputs:
        if channel.name not in trial.inputs:
            yield make_finding(
                trial,
                "error",
                "channel-missing",
                f"The model needs the input {channel.name!r} ({channel.description or channel.unit}).",
                f"Map a column to it. {nearest(channel.name, trial.inputs)}".strip(),
                channel=channel.name,
            )
    for channel in model.outputs:
        if channel.name not in trial.outputs:
            yield make_finding(
                trial,
                "warning",
                "channel-missing",
                f"The trial did not record the model's output {channel.name!r}.",
                "It takes no part in the fit; initial states that it would give must come from elsewhere.",
                channel=channel.name,
            )
