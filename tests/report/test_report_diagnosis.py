"""The report of a diagnosis: every kind of verdict, one story, hostile text, numbers that are none."""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import one_story
import pandas as pd
import pytest
from drawing import outline
from fake_diagnosis import KINDS, diagnosis
from test_report_page import Page

from seatruth.diagnosis.parts import Discrepancy
from seatruth.diagnosis.results import Diagnosis
from seatruth.report.diagnosis import figures_which
from seatruth.report.page import render
from seatruth.report.sections import pictures
from seatruth.report.text import diagnosis as text
from seatruth.report.text import gap
from seatruth.study.augment import augmented
from seatruth.trials.finding import Finding

SECTIONS = (
    *("summary", "where", "which", "discrepancy", "noise", "coefficients", "validation", "next-trial", "steps"),
    *("findings", "provenance"),
)
STUDY = '[study]\nname = "fake study"\n\n[model]\nuse = "mmg"\nvary = ["Y_v"]\n\n[[trials]]\nfile = "a.csv"\n'


DRAWN = ("effects", "inseparable", "unknown", "one_trial")
"""Kinds of verdict whose figures the fast tests draw."""


@functools.cache
def rendered(kind: str) -> str:
    """The page of a diagnosis as it comes; of most kinds with figures that are made, but not drawn."""
    if kind in DRAWN:
        return render(diagnosis(kind))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "svg", outline)
        return render(diagnosis(kind))


def page(found: Diagnosis | str) -> str:
    """The text of a page, checked to be well formed and without numbers that are none."""
    parsed = Page(rendered(found) if isinstance(found, str) else render(found))
    ids = {str(section["id"]) for section in parsed.all("section")}
    links = {str(link["href"])[1:] for link in parsed.all("a")}
    assert links <= ids
    shown = parsed.text
    assert not re.search(r"\bnan\b|\bNone\b(?! of)|\binf\b", shown), re.findall(
        r".{30}\b(?:nan|None|inf)\b.{30}", shown
    )
    return shown


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_its_sections_in_order(kind: str) -> None:
    found = diagnosis(kind)
    ids = [str(section["id"]) for section in Page(rendered(kind)).all("section")]
    absent = set() if found.validation is not None else {"validation"}
    absent |= set() if found.next_trial is not None else {"next-trial"}
    assert ids == [name for name in SECTIONS if name not in absent]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in DRAWN])
def test_the_figures_of_every_kind_can_be_drawn(kind: str) -> None:
    html = render(diagnosis(kind))
    drawn = re.findall(r'<svg class="plot".*?</svg>', html, re.DOTALL)
    assert len(drawn) == rendered(kind).count('<svg class="plot"') > 0
    assert all("<path" in svg for svg in drawn)


@pytest.mark.parametrize("kind", KINDS)
def test_all_parts_tell_one_story(kind: str, tmp_path: Path) -> None:
    found = diagnosis(kind)
    (tmp_path / "study.toml").write_text(STUDY)
    effects = {name: name for name in found.named}
    written = augmented(tmp_path / "study.toml", tmp_path, "new", effects, found.augmented["parameters"], {})
    one_story.check(rendered(kind), found, written)


@pytest.mark.usefixtures("undrawn")
def test_a_report_that_tells_two_stories_is_noticed(tmp_path: Path) -> None:
    found = diagnosis()
    (tmp_path / "study.toml").write_text(STUDY)
    found.augmented["parameters"]["current_north"] = 0.378
    values = found.augmented["parameters"]
    written = augmented(tmp_path / "study.toml", tmp_path, "new", {"current": "current"}, values, {})
    with pytest.raises(AssertionError):
        one_story.check(render(found), found, written)


@pytest.mark.parametrize(
    ("kind", "title", "words"),
    [
        ("effects", "A cause is named", "The gap comes from a uniform current of 0.205 ± 0.02 m/s"),
        ("two_causes", "A cause is named", "Probable, but a negligible part of the gap: an offset"),
        ("with_discrepancy", "A cause is named", "Most of the gap comes from"),
        ("implausible", "It looks like a known cause", "another cause may act in the same way"),
        ("not_predictive", "A likely cause", "does not shrink surely on trials left out"),
        ("inseparable", "A kind of cause is named", "wind or wave drift, which these trials cannot tell apart"),
        ("only_small", "No cause of practical size", "heading offset"),
        ("no_gap", "No gap beyond the noise", "No effect is needed"),
        ("underpowered", "These trials cannot decide", "No answer stands out"),
        ("unknown", "No cause of the library", "add to dr/dt: 0.250 v r / U^2 − 0.0200 (rad/s²)"),
        ("unknown_small", "A small rest without a known cause", "What the refitted model leaves is small"),
        ("one_trial", "A likely cause", "nothing can be left out"),
        ("interrupted", "So far: a likely cause", "This diagnosis is not complete: stopped by the user"),
    ],
)
def test_the_box_is_only_as_sure_as_the_evidence(kind: str, title: str, words: str) -> None:
    shown = page(kind)
    assert title in shown
    assert words in shown
    sure = kind in ("effects", "two_causes", "with_discrepancy", "inseparable", "no_gap")
    assert ('class="statement sure"' in rendered(kind)) is sure


def test_each_probability_can_be_followed_in_one_table() -> None:
    found = diagnosis("inseparable")
    rows = one_story.Page(rendered("inseparable")).rows("Hypotheses")
    assert len(rows) == len(found.hypotheses)
    assert rows[0][:6] == ["steady wind", "no", "60.00", "0", "−1.60", "60 %"]
    for row, one in zip(rows, found.hypotheses, strict=True):
        odds = math.exp(float(row[3].replace("−", "-")) + one.log_prior - found.hypotheses[0].log_prior)
        assert odds == pytest.approx(one.probability / found.hypotheses[0].probability, rel=0.01)
    assert rows[-1][-1] == "not converged"


def test_the_tree_and_the_places_show_where_it_acts() -> None:
    shown = one_story.Page(rendered("inseparable"))
    nodes = {row[0]: row[1:] for row in shown.rows("Nodes of the tree")}
    assert nodes["– a steady force fixed to the earth"] == ["97 %", "named"]
    assert nodes["– – a steady wind"][1] == ""
    assert shown.rows("Places")[0][-1] == "named"


def test_effects_have_size_gain_and_what_they_are_taken_for() -> None:
    rows = {row[0]: row for row in one_story.Page(rendered("inseparable")).rows("Effects that took part")}
    assert rows["steady wind"] == [
        *(
            "steady wind",
            "60 %",
            "60.00",
            "140",
            "8.1 ± 1.2 m/s towards 323 ± 8 deg",
            "31.0",
            "12.0",
            "mean wave drift",
        ),
    ]
    assert rows["constant current"][3:7] == ["", "", "", ""]


def test_noise_and_coefficients() -> None:
    shown = one_story.Page(rendered("effects"))
    assert shown.rows("Noise of each channel")[2] == ["x", "m", "0.500", "0.500", "8.0", "150"]
    rows = {row[0]: row for row in shown.rows("Coefficients")}
    assert rows["N_r"] == ["N_r", "1", "−0.05000", "0.010", "−0.0790 ± 0.0020", "−2.9", "far"]
    assert rows["Y_v"][-1] == ""


def test_a_next_trial_that_does_not_help_is_not_suggested() -> None:
    shown = page("two_causes")
    assert "No trial on the menu is likely to double what separates steady wind, mean wave drift and a cause" in shown
    assert "turn by +delta (rudder" not in shown
    assert "Turn by +delta (rudder hard over to starboard)" in page("effects")


@pytest.mark.usefixtures("undrawn")
def test_what_a_verdict_cannot_tell_apart_is_not_distinguished_already() -> None:
    """Of a ship on a pond the wind and the drift of waves were 250 deviations apart by their exact forms."""
    for kind, already in (("inseparable", False), ("underpowered", True)):
        found = diagnosis(kind)
        assert found.next_trial is not None
        far = replace(found, next_trial=replace(found.next_trial, noncentrality_now=6e4, noncentrality_then=8e5))
        said = text.next_in_words(far)
        assert ("already distinguish" in said) is already
        assert ("It would best separate" in said) is not already


def test_errors_of_the_data_stand_above_the_verdict() -> None:
    found = diagnosis()
    found.findings = [
        Finding(
            "error", "psi-r-sign", "psi falls when r is positive.", "/home/me/a.csv, line 3", "Change a sign.", "out"
        ),
        Finding("error", "units", "u is in knots.", "a.csv"),
    ]
    shown = page(found)
    first = "The data first: a.csv, line 3: psi falls when r is positive. Change a sign. There is one more error."
    assert shown.index(first) < shown.index("Where?")
    assert "A cause is named" not in shown
    assert "The data have errors" in shown


def test_bytes_are_the_same_each_time() -> None:
    assert rendered("effects") == render(copy.deepcopy(diagnosis("effects")))


HOSTILE = '<script>alert("x")</script>&amp;{{ 7 * 7 }}$\\frac{1}{0}$\u202e\x07\'"><img src=x onerror=alert(1)>'


def hostile(value: Any) -> Any:
    """Every text of a result replaced by hostile text, but for those that are one of a few words."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fixed = ("kind", "severity")
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        return replace(value, **{name: hostile(part) for name, part in fields.items() if name not in fixed})
    if isinstance(value, (tuple, list)):
        return type(value)(hostile(part) for part in value)
    if isinstance(value, dict):
        return {key: hostile(part) for key, part in value.items()}
    return HOSTILE if isinstance(value, str) else value


def test_hostile_text_stays_text() -> None:
    found = diagnosis("with_discrepancy")
    code = found.outcome["code"]
    for field in dataclasses.fields(found):
        value = getattr(found, field.name)
        if isinstance(value, pd.DataFrame):
            texts = [column for column in value if value[column].dtype.kind not in "bif"]
            setattr(found, field.name, value.assign(**dict.fromkeys(texts, HOSTILE)))
        elif field.name not in ("synthetic", "seed", "shares"):
            setattr(found, field.name, hostile(value))
    found.outcome["code"] = code
    found.unavailable = {HOSTILE: HOSTILE}
    found.causes, found.places = {HOSTILE: 0.9}, {HOSTILE: 0.9}
    found.verdict = replace(found.verdict, places=(HOSTILE,))
    html = render(found)
    Page(html)
    assert html.count("<script") == 1, "its own"
    assert "<img" not in html
    assert "onerror=alert(1)>" not in html.replace("onerror=alert(1)&gt;", "")
    assert "{{ 7 * 7 }}" in html


def test_what_is_missing_is_left_out() -> None:
    found = diagnosis()
    found.validation = found.next_trial = found.discrepancy = None
    found.time = found.region = pd.DataFrame()
    found.traces = found.traces.iloc[:0]
    found.causes, found.places, found.noise, found.coefficients, found.trials = {}, {}, (), (), []
    shown = page(found)
    assert "no missing forces can be estimated" in shown
    assert "Signatures" not in shown
    assert "Measurement noise" not in shown


@pytest.mark.usefixtures("undrawn")
def test_nothing_at_all_is_survived() -> None:
    found = diagnosis("underpowered")
    found.effects = found.hypotheses = ()
    found.gap = found.gap.iloc[:0]
    assert "No answer stands out" in page(found)


def test_numbers_that_are_not_finite_are_shown_as_words() -> None:
    found = diagnosis()
    assert found.validation is not None
    folds = (replace(found.validation.folds[0], error_effects=math.inf, error_discrepancy=math.nan),)
    found.validation = replace(found.validation, folds=folds, control=math.nan)
    found.gap.loc[0, ["rmse_refit", "multiple_refit"]] = math.inf
    found.time.loc[0, "misfit"] = math.inf
    assert "∞" in page(found)
    found.gap[[f"multiple_{fit}" for fit in gap.FITS]] = np.nan
    found.gap["noise"] = 0.0
    page(found)


@pytest.mark.usefixtures("undrawn")
def test_a_prediction_that_is_not_finite_is_said_in_words() -> None:
    found = diagnosis()
    assert found.validation is not None
    folds = (replace(found.validation.folds[0], error_effects=math.inf, error_discrepancy=math.nan),)
    diverging = found.validation = replace(found.validation, folds=folds, control=math.nan)
    found.validation = replace(diverging, gap_explained=math.nan)
    assert "could not be predicted: the motion diverges" in page(found)
    known = (replace(diverging.folds[0], error_effects=1.0),)
    found.validation = replace(diverging, folds=known, gap_explained=math.nan)
    assert "no gap to explain" in page(found)


def test_long_names_and_many_trials_stay_readable() -> None:
    found = diagnosis()
    name = "a very long name of a trial that was sailed in the morning " * 3
    found.gap["trial"] = found.gap["trial"].replace("zigzag_20_20", name)
    found.time["trial"] = found.time["trial"].replace("zigzag_20_20", name)
    found.traces["trial"] = found.traces["trial"].replace("zigzag_20_20", name)
    assert name.strip() in page(found)


def test_small_words() -> None:
    assert text.readable("0.0801 +- 7.2e-05 m/s (94 %)") == "0.0801 ± 0.000072 m/s (94 %)"
    assert text.readable("1e-09 stays, r2e-05 too") == "1e-09 stays, r2e-05 too"
    assert text.capitalized("a turn by +delta") == "A turn by +delta"
    assert text.node_in_words("sensor") == "a sensor"
    assert text.node_in_words("sensor.of_a_plug_in") == "of a plug in"
    assert gap.place_in_words("sensor:u") == "the sensor of u"
    assert gap.place_in_words("T_engine") == "the equation of T_engine"
    found = diagnosis()
    found.discrepancy = Discrepancy({"yaw": 0.2}, (), (), 3.0)
    assert text.formula_in_words(found) == []
    assert "20 % of the usual acceleration in yaw" in text.lacks_in_words(found)


def test_residuals_of_a_thinned_log_are_drawn() -> None:
    found = diagnosis()
    found.traces.loc[found.traces.index % 2 == 1, "measured"] = np.nan
    upper, lower = figures_which.signature(found, *figures_which.clearest(found)[0]).axes
    assert np.isfinite(upper.lines[1].get_ydata()[1:-1]).all()
    assert np.isfinite(lower.lines[-1].get_ydata()[1:-1]).all()


def test_the_sections_of_one_trial_are_left_out_and_said_to_be_less_of_a_check() -> None:
    """A headline gave the part of the gap that is closed on what was left out; below, nothing could be left out."""
    whole, alone = diagnosis("effects"), diagnosis("one_trial")
    assert text.validation_in_words(alone) == "One trial alone: nothing can be left out."
    alone.validation = whole.validation
    said = text.validation_in_words(alone)
    assert said.startswith(text.validation_in_words(whole))
    assert said.endswith("Left out were sections of the one trial, whose others are less of a check.")
