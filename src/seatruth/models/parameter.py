"""Parameters and what is known of them before the data speak (lmfit's vocabulary)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

from seatruth.errors import BadInput


@dataclass(frozen=True)
class Prior:
    """A normal prior N(mean, sd) on a parameter.

    Args:
        mean: mean, in the parameter's unit.
        sd: standard deviation, in the parameter's unit; above 0.

    Raises:
        BadInput: a number is not finite, or sd is not positive.

    Example:
        >>> from seatruth import Parameter, Prior
        >>> Parameter("Y_v", -0.3, vary=True, prior=Prior(-0.3, 0.06)).prior.sd
        0.06
    """

    mean: float
    sd: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and math.isfinite(self.sd) and self.sd > 0):
            raise BadInput(f"a prior needs a finite mean and a positive sd, not N({self.mean}, {self.sd})")


@dataclass(frozen=True)
class Parameter:
    """One coefficient of a model, in lmfit's vocabulary.

    Args:
        name: identifier by which equations use it.
        value: nominal value, where a search starts; in `unit`.
        unit: unit inside seatruth (SI, rad, rev/s); "1" for a pure number.
        min, max: bounds, in `unit`; infinite where there are none.
        vary: True to identify it.
        prior: prior knowledge of its value.
        scale: "linear", or "log" to search in log(|value|), which needs bounds on one side of zero.
        start: region (low, high) in which random starts are drawn; None takes the bounds.
        expr: arithmetic expression over other parameters that gives the value, such as "-0.5 * Y_v".
        source: where the nominal value comes from.
        description: what it is, in a few words.

    Raises:
        BadInput: the values do not fit together.

    Example:
        >>> from seatruth import Parameter
        >>> Parameter("T", 8.0, "s", min=0.5, max=60.0, vary=True).replace(value=9.0).value
        9.0
    """

    name: str
    value: float
    unit: str = "1"
    min: float = -math.inf
    max: float = math.inf
    vary: bool = False
    prior: Prior | None = None
    scale: Literal["linear", "log"] = "linear"
    start: tuple[float, float] | None = None
    expr: str | None = None
    source: str = ""
    description: str = ""

    def __post_init__(self) -> None:
        where = f"parameter {self.name!r}"
        if not self.name.isidentifier():
            raise BadInput(f"{self.name!r} is not a usable name", where=where, do="Use letters, digits, underscores.")
        for name in ("value", "min", "max"):  # whole numbers too: arrays of them would round every step
            object.__setattr__(self, name, float(getattr(self, name)))
        if not math.isfinite(self.value):
            raise BadInput(f"its value is {self.value}", where=where)
        if not self.min < self.max:
            raise BadInput(f"its bounds [{self.min:g}, {self.max:g}] are empty", where=where)
        if self.vary and self.expr is None and not self.min <= self.value <= self.max:
            raise BadInput(
                f"its start {self.value:g} lies outside its bounds [{self.min:g}, {self.max:g}]",
                where=where,
                do="Widen the bounds or change the value; where a study states a prior alone, that is its mean.",
            )
        if self.vary and self.expr is not None:
            raise BadInput("it is set by an expression and cannot vary", where=where, do="Remove `vary` or `expr`.")
        if self.start is not None and not self.min <= self.start[0] <= self.start[1] <= self.max:
            raise BadInput(f"its start region {self.start} is not inside its bounds", where=where)
        if self.scale == "log" and not (self.min > 0 or self.max < 0):
            raise BadInput("log scale needs bounds on one side of zero", where=where, do="Set min > 0 (or max < 0).")

    def replace(self, **changes: Any) -> Parameter:
        """Returns a copy with some fields changed. Raises BadInput where they do not fit together."""
        return replace(self, **changes)
