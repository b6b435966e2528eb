"""Profiles walk until they have risen, and say what the data bound."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth import Budget, Parameter, identify
from seatruth.report import render
from seatruth.study import formula_study
from seatruth.uncertainty.profile import DROP_95, profile_verdict


def fitted(expression: str, y: Any, *, names: list[str], **parameters: dict[str, Any]) -> Any:
    x = np.linspace(0.0, 1.0, 40)
    table = pd.DataFrame({"x": x, "y": y(x)})
    free = [Parameter(name, vary=True, **options) for name, options in parameters.items()]
    study = formula_study(expression, table, free, noise=0.05, name="formula")
    return identify(study, profile=names, budget=Budget(5000), threads=1)


def wobble(x: np.ndarray) -> np.ndarray:
    return np.asarray(0.05 * np.cos(40.0 * x))


def test_a_linear_parameter_is_bounded_by_the_linear_interval() -> None:
    found = fitted("y = a + b*x", lambda x: 1.0 + 2.0 * x + wobble(x), names=["b"], a={"value": 0.5}, b={"value": 1.0})
    verdict = profile_verdict(found.profile["b"])
    assert verdict.kind == "bounded"
    assert len(found.profile["b"]) == 9  # nothing to walk for
    half = math.sqrt(2 * DROP_95) * 0.05 / (np.sqrt(40) * np.std(np.linspace(0.0, 1.0, 40)))
    assert verdict.upper - verdict.lower == pytest.approx(2 * half, rel=1e-3)


def test_a_rate_that_is_too_fast_to_see_is_half_bounded() -> None:
    # The first sample after x = 0 is at 1/39: rates far above 39 all look alike, slow ones do not.
    found = fitted(
        "y = a*(1 - exp(-k*x))", lambda x: np.where(x > 0, 1.0, 0.0) + wobble(x), names=["k"],
        a={"value": 1.0}, k={"value": 200.0, "min": 0.0, "max": 1000.0},
    )  # fmt: skip
    verdict = profile_verdict(found.profile["k"])
    assert verdict.kind == "half bounded"
    assert 39.0 < verdict.lower < 200.0
    assert verdict.upper == math.inf
    assert found.profile["k"]["value"].max() == 1000.0  # it was followed to the bound
    assert "half bounded" in render(found)


def test_one_of_two_that_act_as_their_sum_is_flat() -> None:
    found = fitted(
        "y = (a + b)*x", lambda x: 2.0 * x + wobble(x), names=["a"],
        a={"value": 0.5, "min": -100.0, "max": 100.0}, b={"value": 1.0, "min": -1e4, "max": 1e4},
    )  # fmt: skip
    curve = found.profile["a"]
    assert profile_verdict(curve).kind == "flat"
    assert curve["value"].min() < -10.0
    assert curve["value"].max() > 10.0


def test_walking_resumes_where_it_was_interrupted(tmp_path: Path) -> None:
    x = np.linspace(0.0, 1.0, 40)
    table = pd.DataFrame({"x": x, "y": 2.0 * x + wobble(x)})
    free = [Parameter(name, 1.0, min=-50.0, max=50.0, vary=True) for name in ("a", "b")]
    study = formula_study("y = (a + b)*x", table, free, noise=0.05, name="formula")
    first = identify(study, profile=["a"], checkpoint=tmp_path / "run", threads=1)
    calls: list[Any] = []
    again = identify(study, profile=["a"], checkpoint=tmp_path / "run", threads=1, progress=calls.append)
    assert first.profile is not None
    assert again.profile is not None
    pd.testing.assert_frame_equal(first.profile["a"], again.profile["a"], check_exact=True)
    assert not [event for event in calls if event.stage == "Profile"]


def test_a_profile_that_diverges_is_bounded_there() -> None:
    value = np.array([0.0, 1.0, 2.0, 3.0])
    verdict = profile_verdict(pd.DataFrame({"value": value, "cost": [np.inf, 0.0, 0.1, 0.2]}))
    assert verdict.kind == "half bounded"
    assert verdict.lower == 1.0
    assert profile_verdict(pd.DataFrame({"value": value, "cost": np.full(4, np.inf)})).kind == "flat"
