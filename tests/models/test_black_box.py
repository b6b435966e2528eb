"""A user's callable as a model: what it returns is checked, what it raises is one clear message."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from seatruth.errors import BadInput, PluginError
from seatruth.models import BlackBox, Channel, IsolatedBlackBox, Parameter, Rudder
from seatruth.trials import Trial

TRIAL = Trial("run", np.arange(5.0), {"delta": np.ones(5)}, {"psi": np.zeros(5)})


def ramp(trial: Trial, parameters: dict[str, float], first_state: dict[str, float] | None) -> Mapping[str, Any]:
    start = first_state["psi"] if first_state else 0.0
    return {"psi": start + parameters["K"] * trial.inputs["delta"] * trial.t}


def box(function: Any = ramp, **changes: Any) -> BlackBox:
    fields: dict[str, Any] = {
        "inputs": [Channel("delta", "rad")],
        "outputs": [Channel("psi", "rad", angle=True)],
        "parameters": [Parameter("K", 0.1, "1/s")],
        "states": [Channel("psi", "rad", angle=True)],
    }
    return BlackBox("turns", function, **{**fields, **changes})


def test_runs_from_a_first_state() -> None:
    model = box()
    assert model.first_state({"psi": 2.0}, {"delta": 1.0}, model.nominal()) == (2.0,)
    simulated = model.run(TRIAL, {"K": 0.5}, {"psi": 2.0})
    assert simulated.tolist() == [[2.0], [2.5], [3.0], [3.5], [4.0]]


def test_the_function_cannot_change_what_it_is_given() -> None:
    def greedy(trial: Trial, parameters: dict[str, float], first_state: Any) -> Mapping[str, Any]:
        parameters["K"] = 7.0
        return {"psi": trial.t}

    given = {"K": 0.5}
    box(greedy).run(TRIAL, given, None)
    assert given == {"K": 0.5}


def test_numbers_that_are_not_finite_are_kept_for_the_caller() -> None:
    assert np.isnan(box(lambda *_: {"psi": [np.nan] * 5}).run(TRIAL, {}, None)).all()


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda *_: 1 / 0, "ZeroDivisionError"),
        (lambda *_: [1.0], "not a dict"),
        (lambda *_: {}, "no 'psi'"),
        (lambda *_: {"psi": [1.0, 2.0]}, r"shape \(2,\)"),
        (lambda *_: {"psi": ["a"] * 5}, "no number"),
    ],
)
def test_wrong_answers_are_one_message(function: Any, message: str) -> None:
    with pytest.raises(PluginError, match=message):
        box(function).run(TRIAL, {}, None)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"outputs": []}, "no outputs"),
        ({"states": [Channel("psj", "rad")]}, "psi"),
        ({"inputs": [Channel("a", "1"), Channel("a", "1")]}, "twice"),
        ({"inputs": [Channel("_a", "1")]}, "identifier"),
        ({"actuators": [Rudder("helm", "n")]}, "input 'n', which the model does not have"),
    ],
)
def test_wrong_declarations_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        box(**changes)


def test_it_names_its_actuators() -> None:
    helm = Rudder("helm", "delta")
    assert box(actuators=[helm]).actuators == (helm,)
    assert IsolatedBlackBox(box(actuators=[helm])).actuators == (helm,)


def test_what_cannot_be_called_is_refused() -> None:
    with pytest.raises(BadInput, match="called"):
        box(3)
