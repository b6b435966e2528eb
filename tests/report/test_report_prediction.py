"""The report of a prediction: what it says, and that odd figures do not break it."""

from __future__ import annotations

import math
from pathlib import Path

from fake_prediction import NAN, prediction

from seatruth.prediction.results import FIGURE_COLUMNS, MEASURED_COLUMNS, table_of
from seatruth.report.figures.manoeuvres import kinds, measured_beside_predicted, predicted_tracks
from seatruth.report.prediction import interval_text, render_prediction, value_text, write_prediction_report


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
