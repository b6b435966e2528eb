"""What a preparation step is: a pure function of a trial with typed options that leaves itself on record.

    @preparation("change_sign", ChangeSign)
    def change_sign(trial: Trial, options: ChangeSign) -> tuple[Trial, str]:
        ...

The function returns the new trial and, in words and numbers, what it did. The decorated name is called as
`change_sign(trial, channels=["delta"])`, and listed under its name in STEPS for study files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from seatruth.arrays import Array
from seatruth.errors import BadInput, SeatruthError, nearest
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.trials.trial import Step, Trial

REGULAR = 0.02
"""Steps of time may differ by this part of their median and still be one rate: loggers write rounded times."""
WRAP_JUMP = 1.5 * np.pi
"""A step of an angle beyond this is a wrap: no vehicle turns three quarters of a circle between two samples."""


class Options(BaseModel):
    """Base of every step's options: unknown names and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


Chosen = TypeVar("Chosen", bound=Options)


@dataclass(frozen=True)
class Preparation(Generic[Chosen]):
    """A named step: call it with a trial and its options."""

    name: str
    options: type[Chosen]
    function: Callable[[Trial, Chosen], tuple[Trial, str]]

    @property
    def summary(self) -> str:
        """What the step does, in one line."""
        return (self.function.__doc__ or "").strip().splitlines()[0]

    def __call__(self, trial: Trial, /, **options: Any) -> Trial:
        chosen = self._checked(options)
        try:
            changed, effect = self.function(trial, chosen)
        except SeatruthError as problem:
            where = f"step {self.name!r}" + (f", {problem.where}" if problem.where else f", trial {trial.name!r}")
            raise BadInput(problem.what, where=where, do=problem.do) from None
        return changed.with_step(Step(self.name, chosen.model_dump(exclude_none=True), effect))

    def _checked(self, options: Mapping[str, Any]) -> Chosen:
        where = f"step {self.name!r}"
        known = list(self.options.model_fields)
        for option in options:
            if option not in known:
                raise BadInput(f"no option {option!r}", where=where, do=nearest(option, known))
        try:
            return self.options(**options)
        except ValidationError as problem:
            first = problem.errors()[0]
            path = ".".join(str(part) for part in first["loc"])
            text = first["msg"].removeprefix("Value error, ")
            raise BadInput(f"option {path!r}: {text}" if path else text, where=where) from None


STEPS: dict[str, Preparation[Any]] = {}
"""Every preparation step by its name in study files."""


def preparation(
    name: str, options: type[Chosen]
) -> Callable[[Callable[[Trial, Chosen], tuple[Trial, str]]], Preparation[Chosen]]:
    """Enters a function in STEPS under a name."""

    def enter(function: Callable[[Trial, Chosen], tuple[Trial, str]]) -> Preparation[Chosen]:
        step = Preparation(name, options, function)
        STEPS[name] = step
        return step

    return enter


def apply_steps(trial: Trial, steps: Sequence[tuple[str, Mapping[str, Any]]]) -> Trial:
    """Runs steps, given as (name, options), in order; BadInput for an unknown step or option names the nearest."""
    for name, options in steps:
        if name not in STEPS:
            raise BadInput(f"no preparation step {name!r}", do=nearest(name, STEPS))
        trial = STEPS[name](trial, **dict(options))
    return trial


def with_channels(trial: Trial, values: Mapping[str, Array]) -> Trial:
    """A copy in which these inputs or outputs have new values; a name that is neither becomes an output."""
    inputs = {k: values.get(k, v) for k, v in trial.inputs.items()}
    outputs = {k: values.get(k, v) for k, v in trial.outputs.items()}
    outputs.update({k: v for k, v in values.items() if k not in inputs and k not in outputs})
    return replace(trial, inputs=inputs, outputs=outputs)


def chosen_channels(trial: Trial, names: Sequence[str] | None, default: Iterable[str]) -> list[str]:
    """The named channels, checked, or the default ones."""
    if names is None:
        return list(default)
    for name in names:
        trial.channel(name)
    return list(dict.fromkeys(names))


def regular_step(trial: Trial, why: str) -> float:
    """The time step, s; BadInput if the trial is not evenly sampled."""
    if len(trial) < 2:
        raise BadInput("it has fewer than two samples", do="Cut less.")
    steps = np.diff(trial.t)
    step = float(np.median(steps))
    off = np.flatnonzero(np.abs(steps - step) > REGULAR * step)
    if off.size:
        k = int(off[0])
        raise BadInput(
            f"{why} needs evenly sampled data, but after t = {trial.t[k]:g} s the next sample comes {steps[k]:g} s "
            f"later instead of {step:g} s ({off.size} such steps)",
            do="Run the step 'resample' before it.",
        )
    return step


def refuse_wrapped(trial: Trial, names: Iterable[str], why: str) -> None:
    """BadInput if an angle among the channels jumps by a turn."""
    for name in names:
        jumps = jumps_by_a_turn(trial, name) if is_angle(name) else 0
        if jumps:
            raise BadInput(
                f"{name!r} jumps by a turn {jumps} time(s), which {why} would smear",
                do=f"Run the step 'unwrap' on {name!r} before it.",
            )


def jumps_by_a_turn(trial: Trial, name: str) -> int:
    """How often a channel steps by nearly a full turn from one valid sample to the next."""
    values = trial.channel(name)
    finite = values[np.isfinite(values)]
    return int((np.abs(np.diff(finite)) > WRAP_JUMP).sum())


def is_angle(name: str) -> bool:
    """Whether a standard channel of this name wraps at a full turn."""
    return name in STANDARD_CHANNELS and STANDARD_CHANNELS[name].angle


def gaps(values: Array) -> list[tuple[int, int]]:
    """Runs of missing samples as (first, one past the last)."""
    missing = np.concatenate([[False], ~np.isfinite(values), [False]]).astype(np.int8)
    edges = np.diff(missing)
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))


def bridged(t: Array, values: Array) -> Array:
    """Missing samples replaced on a straight line between their valid neighbours (held at the ends)."""
    ok: NDArray[np.bool_] = np.isfinite(values)
    if ok.all() or not ok.any():
        return values
    return np.asarray(np.interp(t, t[ok], values[ok]), dtype=np.float64)


def counted(parts: Mapping[str, int], total: int, verb: str) -> str:
    """ "removed 14 of 6000 samples of u, 2 of v", or that there was nothing to do."""
    counts = [f"{count} of {name}" for name, count in parts.items() if count]
    return f"{verb} {', '.join(counts)} ({total} samples each)" if counts else f"{verb} none of {total} samples"
