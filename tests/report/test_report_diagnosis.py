"""The report of a diagnosis: each kind of verdict reads as what it is, and nothing that is missing stops the page."""

from __future__ import annotations

import copy
import math
import re
from html.parser import HTMLParser
from typing import Any

import pandas as pd
import pytest

from seatruth.diagnosis.results import Diagnosis, answer, towards
from seatruth.report.diagnosis import words
from seatruth.report.page import render
from seatruth.trials.finding import Finding


def effect(name: str, title: str, unit: str = "m/s") -> dict[str, Any]:
    parameters = [{"name": q, "unit": unit, "null": 0.0, "typical": 0.2} for q in ("north", "east")]
    return {
        **{"name": name, "number": 1, "title": title, "family": "environment", "equation": "nu_r = nu - nu_c"},
        **{"acts_on": ["kinematics"], "equivalent": [], "distinguished_by": "a full turn", "source": "<[L] a & book>"},
        "parameters": parameters,
    }


def row(name: str, title: str, probability: float, other: str, near: float) -> dict[str, Any]:
    parameters = [
        {"name": q, "unit": "m/s", "value": v, "stderr": 0.02, "lower": v - 0.04, "upper": v + 0.04, "null": 0.0}
        for q, v in (("north", 0.16), ("east", 0.13))
    ]
    return {
        **{"name": name, "number": 1, "title": title, "acts_on": ["kinematics"], "probability": probability},
        **{"log_evidence": 40.0, "lambda": 90.0, "parameters": parameters, "apart": {other: near}},
        **{"in_words": towards({"north": (0.16, 0.02), "east": (0.13, 0.02)}), "equivalent": []},
        **{"detectable": {"north": 0.05, "east": math.inf}, "confused_with": {other: near}},
    }


@pytest.fixture
def diagnosis() -> Diagnosis:
    """As if a current had been named on two trials."""
    t = [0.0, 1.0, 2.0, 3.0]
    gap = [
        {
            **{"trial": trial, "channel": channel, "unit": unit, "n": 4, "noise": 0.1, "rmse_before": 0.9},
            **{"rmse_refit": 0.5, "rmse_effect": 0.1, "multiple_before": 9.0, "multiple_refit": 5.0},
            "multiple_effect": 1.0,
        }
        for trial in ("out", "back")
        for channel, unit in (("x", "m"), ("psi", "rad"))
    ]
    cell = {"n": 40, "misfit": 9.0, "p": 0.001, "p_adjusted": 0.01, "stands_out": True}
    place = {"log_evidence": 30.0, "probability": 0.9, "log_evidence_left": -2.0}
    fold = {"manoeuvre": "zigzag", "chosen": ["current"], "before": 9.0, "refit": 5.0, "effect": 1.2, "flexible": 4.0}
    return Diagnosis(
        study="a <study> & more",
        model="mmg",
        synthetic=False,
        seed=0,
        trials=[{"name": n, "samples": 4, "duration_s": 3.0, "conditions": {}, "steps": []} for n in ("out", "back")],
        effects=[effect("current", "constant current"), effect("wind", "steady wind")],
        left_out={"trim": "the model has no output 'theta'"},
        noise=[
            {
                **{"channel": "x", "step_s": 1.0, "sd": 0.1, "innovation": 0.1, "order": 0, "memory_s": 0.0},
                **{"n": 8, "n_eff": 8.0},
            }
        ],
        gap=gap,
        shares={
            **{"noise": 0.1, "parameters": 0.5, "effects": 0.4, "left": 0.0, "misfit_before": 50.0},
            **{"misfit_refit": 25.0, "misfit_effects": 1.0},
        },
        where={
            "places": [{"place": "sensor:x", **place}, {"place": "surge", **place, "probability": 0.1}],
            "time": [{"trial": n, "from_s": 0.0, "to_s": 3.0, **cell} for n in ("out", "back")],
            "region": [
                {"variable": "heading", "unit": "rad", "cell": "north-east", "from": 0.4, "to": 1.2, **cell},
                {"variable": "speed", "unit": "m/s", "cell": "0.5 to 1", "from": 0.5, "to": 1.0, **cell},
            ],
        },
        candidates=[
            {"effects": ["current"], "probability": 0.93, "log_evidence": 40.0},
            {"effects": ["wind"], "probability": 0.06, "log_evidence": 35.0},
            {"effects": [], "probability": 0.01, "log_evidence": 0.0},
        ],
        which=[
            row("current", "constant current", 0.93, "wind", 4.0),
            row("wind", "steady wind", 0.06, "current", 3.0),
        ],
        verdict={
            **{"kind": "effects", "effects": ["current"], "set": [], "probability": 0.93, "places": ["kinematics"]},
            **{
                "beside": False,
                "powerless": ["wind"],
                "unknown": 0.0,
                "none": 0.01,
                "sentence": "The gap comes from it (93%).",
            },
        },
        unnamed=None,
        how_far={
            "folds": [{"trial": n, **fold} for n in ("out", "back")],
            "closure": {"value": 0.95, "lower": 0.9, "upper": 1.0},
            "errors": {"before": 9.0, "refit": 5.0, "effect": 1.2, "flexible": 4.0, "floor": 1.0},
            "by_manoeuvre": [{"manoeuvre": "zigzag", "refit": 5.0, "effect": 1.2}],
            "why": "",
        },
        next_trial={
            **{"manoeuvre": "turn by +delta", "text": "delta hard over", "survivors": ["current", "wind"]},
            **{"lambda_now": 4.0, "lambda_then": 100.0, "gain": 25.0, "t": t, "inputs": {"delta": [0.1] * 4}},
            "pairs_now": [{"pair": ["current", "wind"], "lambda": 4.0}],
            "menu": [{"manoeuvre": "turn", "text": "", "lambda": 100.0, "weakest": ["current", "wind"]}],
            "motion": {"x": t, "y": t, "psi": [0.0, 0.1, 0.2, 0.3]},
            "units": {"delta": "rad", "x": "m", "y": "m", "psi": "rad"},
        },
        augmented={"model": "mmg", "effects": ["current"], "parameters": {"current_north": 0.16, "current_east": 0.13}},
        outcome={"code": "done", "reason": "everything was asked", "wall_s": 30.0, "fits": 20},
        traces=pd.DataFrame(
            [
                {
                    "trial": r["trial"],
                    "t": x,
                    "channel": r["channel"],
                    "measured": x,
                    "before": 0,
                    "refit": 1,
                    "effect": x,
                }
                for r in gap
                for x in t
            ]
        ),
        provenance={"versions": {"seatruth": "1"}, "time_utc": "2026-01-02T03:04:05Z"},
    )


class Checker(HTMLParser):
    """Opens and closes in order, no id twice, every link inside the page leads somewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "link", "br", "img"):
            self.open.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(str(value))
            if name == "href" and str(value).startswith("#"):
                self.links.append(str(value)[1:])

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in ("meta", "link", "br", "img"):
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] != "style":
            self.text += f" {data}"


def page(diagnosis: Diagnosis) -> str:
    """The text of the page, checked."""
    checker = Checker()
    checker.feed(render(diagnosis))
    assert not checker.open
    assert len(checker.ids) == len(set(checker.ids))
    assert set(checker.links) <= set(checker.ids)
    text = re.sub(r"\s+", " ", checker.text)
    assert not re.search(r"\bnan\b|\bNone\b(?! (of|on))|\binf\b", text), re.findall(
        r".{30}(?:\bnan\b|\bNone\b|\binf\b).{30}", text
    )
    return text


def test_a_named_cause(diagnosis: Diagnosis) -> None:
    text = page(diagnosis)
    for said in (
        "A cause is named",
        "0.206 ± 0.02 m/s towards 39",
        "with probability 93.0 %",
        "it closes 95 % of what refitting leaves (95 %: 90 % to 100 %)",
        "Next likeliest: steady wind (6.00 %)",
        "These trials hardly tell it from steady wind",
        "kinematics (motion over ground",
        "heading north-east",
        "from 2.0 to 10 standard deviations",
        "At their typical magnitude these trials could not have shown: steady wind",
        "false discovery rate",
        "the model has no output 'theta'",
        "<[L] a & book>",
    ):
        assert said in text, said
    assert "SYNTHETIC" not in text


def test_bytes_are_the_same_each_time(diagnosis: Diagnosis) -> None:
    assert render(diagnosis) == render(copy.deepcopy(diagnosis))


@pytest.mark.parametrize(
    ("kind", "changes", "said"),
    [
        ("effects", {"probability": 0.65}, "A likely cause"),
        ("no_gap", {"effects": []}, "No gap beyond the noise"),
        ("underpowered", {"effects": []}, "These trials do not say enough"),
        ("underpowered", {"effects": [], "set": ["wind"]}, "No cause stands out"),
        ("inseparable", {"set": ["current", "wind"]}, "One of constant current and steady wind"),
        ("unknown", {"effects": []}, "None of the 2 effects that took part explains it"),
    ],
)
def test_each_kind_of_verdict(diagnosis: Diagnosis, kind: str, changes: dict[str, Any], said: str) -> None:
    diagnosis.verdict |= {"kind": kind, **changes}
    if not diagnosis.named:
        diagnosis.augmented["effects"] = []
    assert said in page(diagnosis)
    if kind == "inseparable":
        assert "told apart by a full turn" in page(diagnosis)


def test_what_has_no_name_is_drawn_and_written_as_a_formula(diagnosis: Diagnosis) -> None:
    diagnosis.verdict |= {"kind": "unknown", "effects": []}
    diagnosis.unnamed = {
        **{"place": "yaw", "unit": "rad/s2", "log_evidence": 12.0, "equation": "yaw", "formula_log_evidence": 20.0},
        "in_time": [{"trial": "out", "t": [0.0, 1.0], "value": [0.1, 0.2], "stderr": [0.05, 0.05]}],
        "formula": [
            {"term": "v r", "coefficient": 0.01, "stderr": 0.001, "factor": 0.25},
            {"term": "1", "coefficient": -0.02, "stderr": 0.001, "factor": -0.02},
        ],
        "beside": [],
    }
    assert words.formula_in_words(diagnosis.unnamed) == "add to dr/dt: 0.250 v r − 0.0200 (SI units)"
    text = page(diagnosis)
    assert "add to dr/dt" in text
    assert "the yaw equation" in text


def test_errors_of_the_data_stand_above_the_verdict(diagnosis: Diagnosis) -> None:
    diagnosis.findings = [
        Finding(
            "error", "psi-r-sign", "psi falls when r is positive.", "/home/me/a.csv, line 3", "Change a sign.", "out"
        )
    ]
    text = page(diagnosis)
    assert text.index("psi falls when r is positive. Change a sign.") < text.index("Where?")
    assert "A cause is named" not in text
    assert "/home/me" not in text


def test_what_is_missing_is_left_out(diagnosis: Diagnosis) -> None:
    """As after an interrupt: no trials left out, no next trial, nothing unnamed, no cells."""
    diagnosis.how_far = diagnosis.next_trial = None
    diagnosis.where = {"places": [], "time": [], "region": []}
    diagnosis.traces = diagnosis.traces.iloc[:0]
    diagnosis.outcome |= {"code": "interrupted", "reason": "stopped by the user"}
    text = page(diagnosis)
    assert "This diagnosis is not whole: stopped by the user" in text
    assert "Not asked: no trial was left out" in text
    assert "The next trial" not in text


def test_numbers_that_are_not_finite_are_shown_as_words(diagnosis: Diagnosis) -> None:
    assert diagnosis.how_far is not None
    diagnosis.how_far["folds"][0]["effect"] = math.inf
    diagnosis.how_far["errors"]["flexible"] = math.nan
    for fold in diagnosis.how_far["folds"]:
        fold["flexible"] = math.nan
    diagnosis.which[0]["lambda"] = math.nan
    assert "∞" in page(diagnosis)
    diagnosis.how_far["closure"] = {"value": math.nan, "lower": math.nan, "upper": math.nan}
    assert "hardly any gap to close" in page(diagnosis)


def test_one_trial_alone(diagnosis: Diagnosis) -> None:
    diagnosis.how_far = {"folds": [], "closure": None, "why": "One trial alone: nothing can be left out."}
    assert "nothing can be left out" in page(diagnosis)


def test_small_words() -> None:
    assert words.chance(0.99999) == "over 99.9 %"
    assert words.chance(1e-7) == "under 0.05 %"
    assert words.readable("0.0801 +- 7.2e-05 m/s (94%)") == "0.0801 ± 0.000072 m/s (94 %)"
    assert words.readable("1e-09 stays, r2e-05 too") == "1e-09 stays, r2e-05 too"
    assert words.place_in_words("sensor:u") == "the sensor of u"
    assert words.place_in_words("T_engine") == "the equation of T_engine"
    assert answer(["current", "wind"]) == "current and wind"
    assert towards({"north": (0.0, 0.1), "east": (0.3, 0.1)}).endswith("towards 90 +- 19 deg")
    assert towards({"angle": (0.1, 0.1)}) == ""
