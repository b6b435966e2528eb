"""An input in another unit than is stated shows in how the model moves."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import pytest

import seatruth.sample
from seatruth import Study
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trials
from seatruth.uncertainty.input_units import input_units
from seatruth.uncertainty.reversed_inputs import reversed_inputs
from seatruth.uncertainty.short_runs import ShortRuns


@functools.cache
def sample() -> Study:
    return seatruth.sample.load("diagnose.toml")


def with_input(name: str, factor: float) -> Study:
    trials = [
        replace(trial, inputs={**trial.inputs, name: factor * values}, steps=())
        for trial in sample().trials
        for values in (trial.inputs[name],)
    ]
    return sample().replace(trials=Trials(trials), holdout=Trials([]))


def said(study: Study) -> list[Finding]:
    return input_units(ShortRuns(study, None, 1))


@pytest.mark.parametrize(("name", "factor", "unit"), [("n", 60.0, "1/min"), ("n", 2.0 * math.pi, "rad/s")])
def test_an_input_in_another_unit_is_told_with_that_unit(name: str, factor: float, unit: str) -> None:
    (finding,) = said(with_input(name, factor))
    assert finding.code == "input-unit"
    assert finding.channel == name
    assert f"State unit = '{unit}' for {name}" in finding.do


def test_the_unit_that_the_study_states_is_the_one_that_is_wrong() -> None:
    """A rudder in rad that is read as deg: 57 times too small."""
    study = with_input("delta", math.radians(1.0))
    assert said(study) == [], "rad, as if it were rad: no unit is larger"
    stated = [
        replace(trial, steps=(replace(before.steps[0], options={"stated_units": {"delta": "deg"}}),))
        for trial, before in zip(study.trials, sample().trials)
    ]
    (finding,) = said(study.replace(trials=Trials(stated)))
    assert "in rad, not in deg" in finding.message
    assert "State unit = 'rad'" in finding.do
    assert reversed_inputs(study.replace(trials=Trials(stated)), threads=1) == [finding]


@pytest.mark.parametrize(("name", "factor"), [("n", 1.0), ("n", 1.7), ("n", 0.5), ("delta", 0.4), ("delta", 2.5)])
def test_a_strong_or_a_weak_actuator_is_no_other_unit(name: str, factor: float) -> None:
    assert said(with_input(name, factor)) == []


def test_nothing_is_told_where_no_motion_is_recorded() -> None:
    study = with_input("n", 60.0)
    blind = [replace(t, outputs={"v": t.outputs["v"]}) for t in study.trials]
    assert [f.code for f in said(study.replace(trials=Trials(blind)))] == []
