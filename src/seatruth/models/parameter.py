"""Parameters and what is known of them before the data speak (lmfit's vocabulary)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

from seatruth.errors import BadInput


@dataclass(frozen=True)
class Prior:
    """A normal prior N(mean, sd) on the parameter's value in its own unit."""

    mean: float
    sd: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and math.isfinite(self.sd) and self.sd > 0):
            raise BadInput(f"a prior needs a finite mean and a positive sd, not N({self.mean}, {self.sd})")


@dataclass(frozen=True)
class Parameter:
    """One coefficient of a model.

    `value` is the nominal value and where a search starts; `min`, `max` bound it; `vary` frees it. `start` is the
    region in which random starts are drawn (the bounds where it is None). `scale` "log" searches in log(|value|).
    `expr` is an arithmetic expression over other parameters that replaces the value. `source` says where the nominal
    value comes from.
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
                do="Widen the bounds or change the value.",
            )
        if self.vary and self.expr is not None:
            raise BadInput("it is set by an expression and cannot vary", where=where, do="Remove `vary` or `expr`.")
        if self.start is not None and not self.min <= self.start[0] <= self.start[1] <= self.max:
            raise BadInput(f"its start region {self.start} is not inside its bounds", where=where)
        if self.scale == "log" and not (self.min > 0 or self.max < 0):
            raise BadInput("log scale needs bounds on one side of zero", where=where, do="Set min > 0 (or max < 0).")

    def replace(self, **changes: Any) -> Parameter:
        """A copy with some fields changed."""
        return replace(self, **changes)
