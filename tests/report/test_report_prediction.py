"""The report of a prediction: what it says, and that odd figures do not break it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd

from seatruth.prediction import Predictions
from seatruth.prediction.results import FIGURE_COLUMNS, MEASURED_COLUMNS, table_of
from seatruth.report.figures.manoeuvres import kinds, measured_beside_predicted, predicted_tracks
from seatruth.report.prediction import interval_text, render_prediction, value_text, write_prediction_report
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
        "conditions": {"speed": 8.0, "inputs": {"n": 1.5}, "rudder_rate": 0.04, "dt": 0.5, "limit": 900.0,
                       "without": ["current_north"]},
        "lack_of_fit": 3.0, "model_error": 0.016, "form_error": 0.035, "provenance": {"commit": "abc"},
        "findings": [Finding("warning", "held-by-priors", "Priors hold 1 figure.", "prediction", "Fit a turn.")],
    }  # fmt: skip
    return Predictions(**{**values, **changes})


def test_the_page_says_what_was_found_and_escapes_names(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    write_prediction_report(prediction(), path)
    page = path.read_text(encoding="utf-8")
    for words in ("20.1 to 23.3", "19.7 to ∞", "it never comes round", "held out", "1 : 45.7", "made by a simulator"):
        assert words in page, words
    assert "t &lt;1&gt;" in page
    assert "t <1>" not in page
    assert page == render_prediction(prediction())
    assert "1.6 % (standard deviation)" in page
    assert "3.5 % (standard deviation) for the model" in page


def test_angles_are_in_degrees_and_shares_in_per_cent() -> None:
    assert value_text(math.radians(20), "rad") == "20.0"
    assert value_text(0.62, "1") == "62 %"
    assert value_text(NAN, "m") == ""
    assert interval_text({"lower": NAN, "upper": 1.0, "unit": "m"}) == ""


def test_empty_tables_and_pictures_of_nothing(tmp_path: Path) -> None:
    none = prediction(figures=table_of([], FIGURE_COLUMNS), measured=table_of([], MEASURED_COLUMNS), conditions={})
    assert "No manoeuvre was asked for" in render_prediction(none)
    assert kinds(none) == []
    assert measured_beside_predicted(none, "turn").axes == []
    assert predicted_tracks(none, "no such").axes == []


def test_pictures_have_axes_with_units() -> None:
    track = predicted_tracks(prediction(), "turning circle 35").axes[0]
    assert (track.get_xlabel(), track.get_ylabel()) == ("y (m)", "x (m)")
    bars = measured_beside_predicted(prediction(), "turn").axes[0]
    assert "%" in bars.get_xlabel()
    assert len(bars.get_yticklabels()) == 3
