"""Options of each kind of cost. An option exists only on the kind that uses it.

from seatruth import RegressionOptions, Study, TrajectoryOptions
Study("zigzags", model, trials, cost=TrajectoryOptions(initial="free", hold="zoh"))
Study("zigzags", model, trials, cost=RegressionOptions(form="central"))
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar, Literal, Self

import numpy as np

from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.trials.channel import Hold

Kind = Literal["trajectory", "regression", "formula"]
Form = Literal["euler", "central", "trapezoid"]

_HOLDS = ("foh", "zoh")


@dataclass(frozen=True)
class _Options:
    """What the options of all kinds have in common."""

    kind: ClassVar[Kind]

    def replace(self, **changes: Any) -> Self:
        """Returns a copy with some options changed.

        Raises:
            BadInput: an option does not exist or its value is not possible.
        """
        known = option_names(type(self))
        for name in changes:
            if name not in known:
                raise BadInput(f"a {self.kind} cost has no option {name!r}", where="cost", do=nearest(name, known))
        return dataclasses.replace(self, **changes)

    def check(self, model: Model, where: str) -> None:
        """Checks what depends on the model. Raises BadInput; `where` names the study."""

    def describe(self) -> dict[str, Any]:
        """Returns the kind and all options as plain values, for results and hashes."""
        found: dict[str, Any] = {"kind": self.kind}
        for name in option_names(type(self)):
            value = getattr(self, name)
            found[name] = dict(value) if isinstance(value, Mapping) else list(value) if _is_list(value) else value
        return found


@dataclass(frozen=True)
class TrajectoryOptions(_Options):
    """Options of the trajectory cost (output error: simulate each trial and compare it with the record).

    Args:
        hold: input between samples: "foh" (first-order hold, straight lines) or "zoh" (zero-order hold, constant).
        max_step: longest integration step, s; None takes one step per sample and more in gaps.
        initial: initial state of each trial: "fixed" (from its first samples) or "free" (estimated as well).
        initial_sd: standard deviation of the first samples by state, in the state's unit; only with initial="free".
        segments: length of the segments into which trials are cut, s; None simulates whole trials.
        multiple_shooting: the initial states of the segments are free and must join the segment before.
        criterion: "weighted" (least squares, channels independent) or "likelihood" (the full measurement-noise
            covariance R is estimated).

    Raises:
        BadInput: a value is not possible.

    Example:
        >>> from seatruth import TrajectoryOptions
        >>> TrajectoryOptions(initial="free").replace(segments=30.0).segments
        30.0
    """

    kind: ClassVar[Kind] = "trajectory"
    hold: Hold = "foh"
    max_step: float | None = None
    initial: Literal["fixed", "free"] = "fixed"
    initial_sd: Mapping[str, float] = field(default_factory=dict)
    segments: float | None = None
    multiple_shooting: bool = False
    criterion: Literal["weighted", "likelihood"] = "weighted"

    def __post_init__(self) -> None:
        _one_of("hold", self.hold, _HOLDS)
        _one_of("initial", self.initial, ("fixed", "free"))
        _one_of("criterion", self.criterion, ("weighted", "likelihood"))
        _seconds("max_step", self.max_step)
        _seconds("segments", self.segments)
        for name, value in self.initial_sd.items():
            if not is_positive(value):
                raise BadInput(f"initial_sd of {name!r} is {value!r}", where="cost", do="Give a number > 0.")
        if self.initial_sd and self.initial != "free":
            raise BadInput(
                "initial_sd is stated but the initial states are fixed", where="cost", do='Set initial = "free".'
            )
        if self.multiple_shooting and self.segments is None:
            raise BadInput(
                "multiple_shooting joins segments, and there are none", where="cost", do="Set segments = ...."
            )

    def check(self, model: Model, where: str) -> None:
        states = [channel.name for channel in model.states]
        for name in self.initial_sd:
            if name not in states:
                raise BadInput(f"initial_sd of an unknown state {name!r}", where=where, do=nearest(name, states))


@dataclass(frozen=True)
class RegressionOptions(_Options):
    """Options of the regression cost (equation error: fit accelerations, without simulating).

    Args:
        form: difference quotient that gives the accelerations: "euler", "central" or "trapezoid".
        equations: names of the states whose equations are fitted; None takes all with free parameters.
        hold: input between samples when the fitted model predicts a trial: "foh" or "zoh".
        max_step: longest integration step of such a prediction, s; None takes one step per sample.

    Raises:
        BadInput: a value is not possible.

    Example:
        >>> from seatruth import RegressionOptions
        >>> RegressionOptions(equations=["u", "r"]).equations
        ('u', 'r')
    """

    kind: ClassVar[Kind] = "regression"
    form: Form = "trapezoid"
    equations: Sequence[str] | None = None
    hold: Hold = "foh"
    max_step: float | None = None

    def __post_init__(self) -> None:
        _one_of("form", self.form, ("euler", "central", "trapezoid"))
        _one_of("hold", self.hold, _HOLDS)
        _seconds("max_step", self.max_step)
        if self.equations is not None:
            object.__setattr__(self, "equations", tuple(self.equations))

    def check(self, model: Model, where: str) -> None:
        states = [channel.name for channel in model.states]
        for name in self.equations or ():
            if name not in states:
                raise BadInput(f"there is no equation of {name!r}", where=where, do=nearest(name, states))


@dataclass(frozen=True)
class FormulaOptions(_Options):
    """Options of the formula cost (a static formula fitted to a table): there are none.

    Example:
        >>> from seatruth import FormulaOptions
        >>> FormulaOptions().describe()
        {'kind': 'formula'}
    """

    kind: ClassVar[Kind] = "formula"


CostOptions = TrajectoryOptions | RegressionOptions | FormulaOptions
OPTIONS: dict[Kind, type[TrajectoryOptions] | type[RegressionOptions] | type[FormulaOptions]] = {
    "trajectory": TrajectoryOptions,
    "regression": RegressionOptions,
    "formula": FormulaOptions,
}


def option_names(options: type[Any]) -> tuple[str, ...]:
    """Names of the options of one kind."""
    return tuple(entry.name for entry in fields(options))


def of_kind(options: CostOptions, kind: str) -> CostOptions:
    """Options of another kind that keep what both kinds have; the options themselves where they are of that kind.

    Raises:
        BadInput: there is no such kind.
    """
    if kind == options.kind:
        return options
    for name, wanted in OPTIONS.items():
        if name == kind:
            shared = set(option_names(wanted)) & set(option_names(type(options)))
            return wanted(**{key: getattr(options, key) for key in shared})
    raise BadInput(f"there is no {kind!r} cost", where="cost", do=nearest(kind, OPTIONS))


def as_trajectory(options: CostOptions) -> TrajectoryOptions:
    """Options of a trajectory cost that keep how inputs are held and steps are limited; themselves if they are that."""
    if isinstance(options, TrajectoryOptions):
        return options
    if isinstance(options, RegressionOptions):
        return TrajectoryOptions(hold=options.hold, max_step=options.max_step)
    return TrajectoryOptions()


def is_positive(value: Any) -> bool:
    """Whether a value is a finite number above zero."""
    real = isinstance(value, (int, float, np.floating, np.integer)) and not isinstance(value, bool)
    return real and math.isfinite(value) and value > 0


def _one_of(name: str, value: Any, choices: Sequence[str]) -> None:
    if value not in choices:
        raise BadInput(f"{name} is {value!r}", where="cost", do=nearest(str(value), choices))


def _seconds(name: str, value: Any) -> None:
    if value is not None and not is_positive(value):
        raise BadInput(f"{name} is {value!r}", where="cost", do="Give seconds > 0.")


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str)
