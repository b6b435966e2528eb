"""What `predict` returns: figures of manoeuvres with intervals, and the measured ones beside the predicted ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from seatruth.trials.finding import Finding

FIGURE_COLUMNS = (
    *("manoeuvre", "kind", "figure", "title", "unit", "value", "lower", "upper"),
    *("held_by", "prior_share", "missing", "why"),
)
MEASURED_COLUMNS = (
    *("trial", "role", "manoeuvre", "kind", "figure", "title", "unit", "measured", "predicted", "lower", "upper"),
    *("resolution", "inside", "held_by", "prior_share", "missing", "why"),
)
_NUMBERS = ("value", "measured", "predicted", "lower", "upper", "resolution", "prior_share", "missing")
TRACK_COLUMNS = ("manoeuvre", "ship", "t", "x", "y", "psi", "delta")


def table_of(rows: Sequence[Mapping[str, Any]], columns: Sequence[str]) -> pd.DataFrame:
    """A table whose columns of numbers are numbers, also where it has no rows."""
    frame = pd.DataFrame(list(rows), columns=list(columns))
    return frame.astype({name: "float64" for name in columns if name in _NUMBERS})


@dataclass(eq=False)
class Predictions:
    """Figures of manoeuvres that an estimate predicts, with their intervals.

    Attributes:
        study, model: names.
        synthetic: whether a simulator made any of the trials behind the estimate.
        figures: table of the planned manoeuvres: manoeuvre, kind ("turn", "zigzag", "stop", "spiral",
            "spiral by thrust"), figure, title, unit, value (at the estimate), lower, upper, held_by ("trials", "both",
            "priors"), prior_share (of the variance), missing (share of the draws without the figure), why (there is no
            value). SI units and rad.
        measured: table of the manoeuvres in the study's trials, with the role of the trial ("fit", "holdout"), the
            measured value, the predicted one, the resolution of the record (steps of time, noise), which the interval
            holds besides, and whether it holds the measured value.
        tracks: manoeuvre, ship (0 is the estimate, others are draws), t (s), x, y (m), psi, delta (rad;
            where thrusters steer the share of full thrust in yaw).
        level: probability of the intervals.
        draws, seed: number of parameter draws and their seed.
        scale: length of the ship over that of the model (Froude); 1 for results as they were simulated.
        conditions: approach speed (m/s), inputs and their units, rudder rate (rad/s, where there is a rudder), step and
            time limit (s), and whether effects of the environment were taken away.
        lack_of_fit: factor in the variance of the trials' part of the covariance; NaN where one trial shows none.
        model_error: relative error (standard deviation) that all intervals hold besides, as the figures of the fitted
            trials miss their predictions by more than parameters leave open; 0 where they do not, or where no
            manoeuvre of the trials was predicted.
        form_error: the same for the model's form beyond the trials, which the intervals of `figures` hold.
        findings: what a user should read.
        provenance: versions, study and estimate behind it.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Budget, identify, predict
        >>> study = seatruth.sample.load()
        >>> found = predict(study, identify(study, budget=Budget(evaluations=40)), [], draws=60)
        >>> sorted(set(found.measured["kind"]))
        ['turn', 'zigzag']
    """

    study: str
    model: str
    synthetic: bool
    figures: pd.DataFrame
    measured: pd.DataFrame
    tracks: pd.DataFrame
    level: float
    draws: int
    seed: int
    scale: float
    conditions: dict[str, Any]
    lack_of_fit: float
    model_error: float
    form_error: float
    findings: list[Finding] = field(default_factory=list)
    provenance: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        label = "SYNTHETIC trials\n" if self.synthetic else ""
        shown = self.figures[["manoeuvre", "figure", "value", "lower", "upper", "unit", "held_by"]]
        return f"{label}{self.study}: {self.model}\n{shown.to_string(index=False, float_format=lambda v: f'{v:.4g}')}"

    __repr__ = __str__

    def _repr_html_(self) -> str:
        label = "<b>SYNTHETIC trials.</b> " if self.synthetic else ""
        return f"<p>{label}{self.study} ({self.model})</p>{self.figures.to_html(index=False)}"
