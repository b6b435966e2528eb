"""Predicted manoeuvres as `predict` gives them, made up: with figures that are missing, unbounded and not finite."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd

from seatruth.prediction import Predictions
from seatruth.prediction.results import FIGURE_COLUMNS, MEASURED_COLUMNS, table_of
from seatruth.trials.finding import Finding

INF, NAN = math.inf, math.nan


def figure(name: str, unit: str, value: float, lower: float, upper: float, **more: object) -> dict[str, object]:
    row = {"manoeuvre": "turning circle 35", "kind": "turn", "figure": name, "title": name, "unit": unit}
    row |= {"value": value, "lower": lower, "upper": upper, "held_by": "priors", "prior_share": 0.8, "missing": 0.0}
    return {**row, "why": "", **more}


def beside(name: str, unit: str, measured: float, predicted: float, lower: float, upper: float) -> dict[str, object]:
    row = {"trial": "t <1>", "role": "holdout", "manoeuvre": "turn", "kind": "turn", "figure": name, "title": name}
    row |= {
        "unit": unit,
        "measured": measured,
        "predicted": predicted,
        "lower": lower,
        "upper": upper,
        "resolution": 0.0,
    }
    inside = lower <= measured <= upper
    return {**row, "inside": inside, "held_by": "trials", "prior_share": 0.1, "missing": 0.0, "why": ""}


def prediction(**changes: object) -> Predictions:
    t = np.linspace(0, 1, 20)
    track = pd.DataFrame(
        [("turning circle 35", ship, v, v, ship * v, v, 0.6) for ship in (0, 1, 2) for v in t],
        columns=["manoeuvre", "ship", "t", "x", "y", "psi", "delta"],
    )
    rows = [
        figure("advance", "m", 21.7, 20.1, 23.3),
        figure("tactical_diameter", "m", 24.0, 19.7, INF, missing=0.1),
        figure("drift_angle", "rad", NAN, NAN, NAN, missing=1.0, why="it never comes round", held_by=""),
        figure("rate", "rad/s", 0.05, 0.05, 0.05, held_by="", prior_share=NAN),
        figure("speed_loss", "1", 0.5, 0.4, 0.6),
    ]
    compared = [
        beside("advance", "m", 22.0, 21.7, 20.1, 23.3),
        beside("transfer", "m", 40.0, 10.0, 9.0, INF),
        beside("drift_angle", "rad", 0.5, 0.3, 0.3, 0.3),
        beside("rate", "rad/s", NAN, 0.05, 0.04, 0.06),
        beside("speed_loss", "1", 0.5, 0.0, 0.0, 0.0),
    ]
    values: dict[str, object] = {
        "study": "ship", "model": "mmg", "synthetic": True, "level": 0.95, "draws": 60, "seed": 0, "scale": 45.7,
        "figures": table_of(rows, FIGURE_COLUMNS), "measured": table_of(compared, MEASURED_COLUMNS), "tracks": track,
        "conditions": {"speed": 8.0, "inputs": {"n": 1.5}, "units": {"n": "rev/s"}, "rudder_rate": 0.04, "dt": 0.5,
                       "limit": 900.0, "without": ["current_north"]},
        "lack_of_fit": 3.0, "model_error": 0.016, "form_error": 0.035, "provenance": {"commit": "abc"},
        "findings": [Finding("warning", "held-by-priors", "Priors hold 1 figure.", "prediction", "Fit a turn.")],
    }  # fmt: skip
    return Predictions(**{**values, **changes})
