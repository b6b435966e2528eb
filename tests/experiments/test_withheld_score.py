"""Measures on verdicts made by hand, and statistics with known answers."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.goals import measures
from withheld.intervals import bootstrap, calibration_error, wilson
from withheld.measures import brier, confident_and_wrong, confusion, gained, top
from withheld.verdicts import problems, verdict


def _truth(case: str, kind: str, effects: list[str], strength: float, **more: Any) -> dict[str, Any]:
    lambdas = dict.fromkeys(effects, strength)
    return {
        "case": case, "kind": kind, "effects": effects, "lambda": lambdas, "places": ["surge"], "set": effects,
        "oracle": {"closure": 0.8, "refit": 2.0, "floor": 1.0}, "pairs": {}, "stratum": "100-400", "family": "ship",
        "form": None, "stated": True,
        **more,
    }  # fmt: skip


def _value(found: list[Any], name: str) -> float:
    return next(one.value for one in found if one.name == name)


def test_measures_of_verdicts_made_by_hand() -> None:
    closure = {"value": 0.76, "lower": 0.5, "upper": 0.9}
    pairs = [
        (
            _truth("a", "single", ["wind"], 200),
            verdict("a", [(["wind"], 0.8), ([], 0.2)], places=["surge"], closure=closure),
        ),
        (_truth("b", "single", ["wind"], 300), verdict("b", [(["bank"], 0.95), (["wind"], 0.05)], places=["yaw"])),
        (_truth("c", "single", ["wind"], 50), verdict("c", [(["x"], 0.4), (["y"], 0.3), (["wind"], 0.2)])),
        (_truth("d", "double", ["wind", "bank"], 150), verdict("d", [(["bank", "wind"], 0.7)])),
        (_truth("e", "none", [], 0), verdict("e", [([], 0.9)])),
        (_truth("f", "none", [], 0), verdict("f", [(["tether"], 0.5)])),
        (_truth("g", "outside", ["unknown"], 500), verdict("g", [(["unknown"], 0.8)])),
        (_truth("h", "confounded", ["wind"], 100), verdict("h", [(["bank"], 0.5)], set=["bank", "wind", "tether"])),
    ]  # fmt: skip
    prior = {truth["case"]: verdict(truth["case"], [([], 0.1), (["wind"], 0.1)]) for truth, _ in pairs}
    found = measures(pairs, prior)
    assert _value(found, "top-1, one effect, lambda >= 100") == 0.5
    assert _value(found, "top-1, one effect, lambda 25-100") == 0.0
    assert _value(found, "top-3, one effect, lambda >= 25") == 1.0
    assert _value(found, "place, one effect, lambda >= 25") == pytest.approx(1 / 3)
    assert _value(found, "exact set of two, lambda >= 100 each") == 1.0
    assert _value(found, "named right, one effect, lambda >= 100") == 0.5
    assert _value(found, "named right, one effect, lambda 25-100") == 0.0
    assert _value(found, "two causes, all that is named right, lambda >= 100 each") == 1.0
    assert math.isnan(_value(found, "the same over the limit's"))
    assert _value(found, "false cause where none acts") == 0.5
    assert _value(found, "unknown called unknown, lambda >= 100") == 1.0
    assert _value(found, "wrong at a probability of 0.9 or more") == pytest.approx(1 / 8)
    assert _value(found, "truth inside the set") == 1.0
    assert _value(found, "mean set") == 3.0
    # Of four cases one states what closes: 0.76 of the oracle's 0.8.
    assert _value(found, "gap closed over the oracle's, median") == 0.0
    assert _value(found, "its 95 % interval holds the oracle's") == 0.5
    assert confusion(pairs)[("wind", "bank")] == 2
    assert top(pairs[1], 2)
    assert not top(pairs[1], 1)
    assert confident_and_wrong(pairs[1])


def test_a_suggested_trial_is_judged_among_the_survivors_only() -> None:
    truth = _truth("a", "single", ["wind"], 100, pairs={"wind": {"bank": 2.0, "tether": 1.0}})
    truth["next"] = {"bank": 6.0, "tether": 1.0}
    said = verdict("a", [(["wind"], 0.6), (["bank"], 0.4)], next_trial={"manoeuvre": "a zigzag"})
    assert gained((truth, said)) == pytest.approx(3.0)
    assert gained((truth, verdict("a", [(["bank"], 1.0)]))) is None


def test_brier_and_calibration() -> None:
    truth = _truth("a", "single", ["wind"], 100)
    assert brier((truth, verdict("a", [(["wind"], 1.0)]))) == 0.0
    assert brier((truth, verdict("a", [(["bank"], 1.0)]))) == 2.0
    rng = np.random.default_rng(0)
    p = rng.random(20000)
    assert calibration_error([(float(x), bool(rng.random() < x)) for x in p]) < 0.02
    assert calibration_error([(0.9, False)] * 10) == pytest.approx(0.9)


def test_intervals() -> None:
    assert wilson(8, 10) == pytest.approx((0.490, 0.943), abs=1e-3)
    assert wilson(0, 20)[0] == 0.0
    assert wilson(20, 20)[1] == 1.0
    values = np.random.default_rng(1).normal(size=400).tolist()
    low, high = bootstrap(values, lambda x: float(np.mean(x)))
    assert high - low == pytest.approx(2 * 1.96 / 20, rel=0.15)


def test_a_verdict_out_of_form_is_told() -> None:
    good = verdict("a", [(["wind"], 0.7), ([], 0.3)])
    assert problems(good) == []
    assert problems({**good, "verdict": "maybe"})
    assert problems({**good, "causes": [{"cause": "environment", "probability": 0.9}]})
    assert problems(
        {**good, "candidates": [{"effects": [], "probability": 0.7}, {"effects": ["x"], "probability": 0.8}]}
    )
    assert problems({key: good[key] for key in good if key != "places"})
