"""study.simulate(): open-loop runs as tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_glide import TRUE, study

from seatruth import FormulaOptions, TrajectoryOptions, identify
from seatruth.costs import cost_of
from seatruth.errors import BadInput
from seatruth.models import Parameter
from seatruth.study import formula_study


def test_every_trial_is_a_table_over_time_in_the_models_units() -> None:
    made = study()
    runs = made.simulate()
    assert list(runs) == ["run 0", "run 1", "run 2"]
    for trial in (*made.trials, *made.holdout):
        run = runs[trial.name]
        assert run.index.name == "t"
        np.testing.assert_array_equal(run.index, trial.t)
        assert list(run.columns) == ["v", "s"]
        assert run.attrs["units"] == {"v": "m/s", "s": "m"}
        assert run["v"].iloc[0] == trial.outputs["v"][0]  # it starts from the first sample


def test_it_is_the_run_that_the_cost_predicts() -> None:
    made = study(initial="fixed")
    cost = cost_of(made, threads=1)
    predicted = cost.predict(np.array([TRUE["a"], TRUE["b"]]))
    runs = made.simulate(TRUE, made.trials, threads=1)
    for trial, y in zip(made.trials, predicted, strict=True):
        np.testing.assert_array_equal(runs[trial.name].to_numpy(), y)


def test_an_estimate_brings_its_initial_states() -> None:
    made = study()
    estimate = identify(made, threads=1)
    runs = made.simulate(estimate)
    fitted = estimate.traces.query("trial == 'run 0' and channel == 'v'")["fitted"].to_numpy()
    np.testing.assert_allclose(runs["run 0"]["v"], fitted, rtol=1e-12, atol=1e-12)
    assert runs["run 0"]["v"].iloc[0] != made.trials["run 0"].outputs["v"][0]


def test_inputs_are_held_as_the_study_says() -> None:
    made = study()
    held = made.replace(cost=TrajectoryOptions(hold="zoh"))
    assert (made.simulate()["run 0"]["v"] != held.simulate()["run 0"]["v"]).any()


def test_expressions_follow_and_cannot_be_set() -> None:
    made = study()
    follows = tuple(p.replace(expr="2 * a", vary=False) if p.name == "m" else p for p in made.parameters)
    with_expression = made.replace(parameters=follows)
    run = with_expression.simulate({"a": 1.5})["run 0"]
    np.testing.assert_array_equal(run, made.simulate({"a": 1.5, "m": 3.0})["run 0"])
    with pytest.raises(BadInput, match=r"'m' is set by the expression '2 \* a'"):
        with_expression.simulate({"m": 1.0})


def test_wrong_names_and_twins_are_refused() -> None:
    made = study()
    with pytest.raises(BadInput, match=r"no parameter 'bb'.*Did you mean 'b'"):
        made.simulate({"bb": 1.0})
    with pytest.raises(BadInput, match="two trials are called 'run 0'"):
        made.simulate(trials=[made.trials[0], replace(made.trials[1], name="run 0")])
    assert made.simulate(trials=[]) == {}


def test_a_formula_is_evaluated() -> None:
    table = {"u": [1.0, 2.0, 3.0], "y": [1.0, 2.0, 3.0]}
    made = formula_study("y = a * u + b", table, [Parameter("a", 2.0, vary=True), Parameter("b", 1.0)])
    assert made.cost == FormulaOptions()
    assert made.simulate()["formula"]["y"].tolist() == [3.0, 5.0, 7.0]
    assert made.simulate({"a": 0.0})["formula"]["y"].tolist() == [1.0, 1.0, 1.0]
