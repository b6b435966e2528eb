"""A study says what is wrong with it, and its hash tells studies apart by what decides their result."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from known_runs import Yaw, YawGain, yaw_trials

from seatruth.costs import KINDS, cost_of
from seatruth.costs.base import Cost
from seatruth.costs.options import FormulaOptions, RegressionOptions, TrajectoryOptions, option_names
from seatruth.errors import BadInput, PluginError
from seatruth.models.parameter import Parameter, Prior
from seatruth.study import Study
from seatruth.trials.trial import Trials

TRIALS = yaw_trials(("a", "b", "c"))


def study(**changes: Any) -> Study:
    options = {name: changes.pop(name) for name in option_names(TrajectoryOptions) if name in changes}
    fields = {"name": "yaw", "model": Yaw(), "trials": TRIALS[:2], "holdout": TRIALS[2:]}
    return Study(**{**fields, "cost": TrajectoryOptions(**options), **changes})


class Alone(Cost):
    """The square of one parameter, and nothing else that solvers could ask for."""

    parameters = (Parameter("a", 1.0, vary=True),)
    gives = frozenset({"values"})
    description: Mapping[str, Any] = {}

    def values(self, X: np.ndarray) -> np.ndarray:
        return 0.5 * X[:, 0] ** 2


def test_a_cost_refuses_what_it_does_not_give() -> None:
    cost = Alone()
    for ask, ability in (
        (lambda: cost.residuals(cost.start), "residuals"),
        (lambda: cost.jacobian(cost.start), "derivatives"),
        (cost.regression, "regression"),
    ):
        with pytest.raises(PluginError, match=f"cost Alone: it gives no {ability}.*`needs`"):
            ask()


def test_a_study_knows_its_parts() -> None:
    made = study()
    assert [parameter.name for parameter in made.free] == ["K", "T", "c"]
    assert made.synthetic
    assert made.cost == TrajectoryOptions()
    assert made.cost.kind == "trajectory"
    assert made.replace(cost=RegressionOptions()).cost.describe() == {
        "kind": "regression",
        "form": "trapezoid",
        "equations": None,
        "hold": "foh",
        "max_step": None,
    }
    shuffled = study(parameters=tuple(reversed(Yaw.parameters)))
    assert [parameter.name for parameter in shuffled.parameters] == ["K", "T", "c", "K_over_T"]
    assert set(KINDS) == {"trajectory", "regression", "formula"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cost": "trajectory"}, "cost is 'trajectory'.*Give TrajectoryOptions"),
        ({"criterion": "likely"}, "Did you mean 'likelihood'"),
        ({"noise": {"rr": 0.1}}, "unknown output 'rr'.*Did you mean 'r'"),
        ({"noise": {"r": -0.1}}, "noise of 'r' is -0.1"),
        ({"noise": {"r": float("nan")}}, "noise of 'r' is nan"),
        ({"initial_sd": {"r": 0.1}}, "initial states are fixed"),
        ({"initial": "free", "initial_sd": {"u": 0.1}}, "unknown state 'u'"),
        ({"initial": "free", "initial_sd": {"r": 0}}, "initial_sd of 'r' is 0"),
        ({"segments": 0.0}, "segments is 0"),
        ({"max_step": -1.0}, "max_step is -1"),
        ({"multiple_shooting": True}, "there are none"),
        ({"cost": RegressionOptions(equations=["rr"])}, "no equation of 'rr'"),
        ({"parameters": Yaw.parameters[:3]}, "'K_over_T' of model 'yaw' is missing"),
        (
            {"parameters": (*Yaw.parameters, Yaw.parameters[0].replace(name="Kk"))},
            "no parameter 'Kk'.*Did you mean 'K'",
        ),
        ({"parameters": (*Yaw.parameters, Yaw.parameters[0])}, "twice|called 'K'"),
        ({"trials": Trials([])}, "no trial to fit"),
        ({"constraints": ["K > 1"]}, "start values break"),
        ({"cost": FormulaOptions()}, "is no formula"),
    ],
)
def test_what_does_not_fit_together_is_said(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        cost_of(study(**changes))
    with pytest.raises(ValueError, match=message):
        cost_of(study(**changes))


def test_trials_that_cannot_be_used_are_named() -> None:
    first = TRIALS[0]
    for broken, message in (
        (replace(first, inputs={}), "trial 'a': it has no input 'delta'"),
        (replace(first, inputs={"delta": np.full(240, np.nan)}), "not numbers"),
        (replace(first, outputs={"psi": np.full(240, np.nan)}), "no valid sample of any output"),
        (replace(first, outputs={}), "no valid sample of any output"),
        (first.section(0, 1), "only one sample"),
    ):
        with pytest.raises(BadInput, match=message):
            study(trials=Trials([broken]))
    with pytest.raises(BadInput, match=r"no 'trails'.*Did you mean 'trials'"):
        study().replace(trails=TRIALS)


def test_the_hash_is_of_what_decides_the_result() -> None:
    base = study()
    assert base.content_hash == study(name="another", provenance={"file": "x"}).content_hash
    data = np.array(TRIALS[0].outputs["r"])
    data[100] += 1e-12
    touched = replace(TRIALS[0], outputs={**TRIALS[0].outputs, "r": data})
    others = [
        study(trials=Trials([touched, TRIALS[1]])),
        study(trials=TRIALS[:1]),
        study(holdout=Trials([])),
        study(noise={"r": 0.1}),
        study(noise={"r": 0.2}),
        study(segments=60.0),
        study(initial="free"),
        study(constraints=["K > 0"]),
        study(cost=RegressionOptions()),
        study(parameters=tuple(q.replace(prior=Prior(1, 1)) if q.name == "K" else q for q in Yaw.parameters)),
        study(parameters=tuple(q.replace(vary=False) if q.name == "K" else q for q in Yaw.parameters)),
        Study("yaw", YawGain(), TRIALS[:2], holdout=TRIALS[2:]),
    ]
    hashes = {made.content_hash for made in [base, *others]}
    assert len(hashes) == len(others) + 1
    assert cost_of(base).description != cost_of(base, trials=TRIALS[:1]).description


def test_costs_on_other_trials() -> None:
    cost = cost_of(study(), trials=TRIALS[2:], threads=1)
    assert [trial.name for trial in cost.trials] == ["c"]
    assert {group.trial for group in cost.residual_blocks} == {"c"}


def test_studies_travel_to_other_processes() -> None:
    made = study(initial="free", noise={"psi": 0.01, "r": "estimate"})
    assert made.content_hash  # a kept hash travels too
    again = pickle.loads(pickle.dumps(made))
    assert again.content_hash == made.content_hash
    x = cost_of(made).start[None]
    np.testing.assert_array_equal(cost_of(again).values(x), cost_of(made).values(x))


def test_it_shows_itself_in_a_notebook() -> None:
    shown = study(name="<yaw> & more")._repr_html_()
    assert "&lt;yaw&gt; &amp; more" in shown
    assert "(synthetic)" in shown
    for part in ("K", "free parameter", "Held out", "c"):
        assert part in shown
