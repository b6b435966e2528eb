"""Options belong to one kind of cost, are checked by themselves, and carry over what two kinds have in common."""

from __future__ import annotations

import pickle
from typing import Any

import pytest

from seatruth.costs.options import (
    OPTIONS,
    FormulaOptions,
    RegressionOptions,
    TrajectoryOptions,
    as_trajectory,
    of_kind,
    option_names,
)
from seatruth.errors import BadInput


def test_each_kind_has_its_own_options() -> None:
    assert {kind: option_names(options) for kind, options in OPTIONS.items()} == {
        "trajectory": ("hold", "max_step", "initial", "initial_sd", "segments", "multiple_shooting", "criterion"),
        "regression": ("form", "equations", "hold", "max_step"),
        "formula": (),
    }
    assert all(options.kind == kind for kind, options in OPTIONS.items())


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        (TrajectoryOptions, {"hold": "zero"}, "hold is 'zero'.*Known: foh, zoh"),
        (TrajectoryOptions, {"initial": "fre"}, "Did you mean 'free'"),
        (TrajectoryOptions, {"criterion": "likely"}, "Did you mean 'likelihood'"),
        (TrajectoryOptions, {"segments": 0.0}, "segments is 0.0. Give seconds > 0"),
        (TrajectoryOptions, {"max_step": True}, "max_step is True"),
        (TrajectoryOptions, {"multiple_shooting": True}, "there are none"),
        (TrajectoryOptions, {"initial_sd": {"r": 0.1}}, "initial states are fixed"),
        (TrajectoryOptions, {"initial": "free", "initial_sd": {"r": -1}}, "initial_sd of 'r' is -1"),
        (RegressionOptions, {"form": "central "}, "Did you mean 'central'"),
        (RegressionOptions, {"hold": "linear"}, "hold is 'linear'"),
    ],
)
def test_values_that_are_not_possible_are_refused(kind: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        kind(**options)


def test_a_copy_has_other_values_and_no_other_options() -> None:
    options = TrajectoryOptions(initial="free", initial_sd={"u": 0.1})
    assert options.replace(hold="zoh") == TrajectoryOptions(hold="zoh", initial="free", initial_sd={"u": 0.1})
    with pytest.raises(BadInput, match=r"a trajectory cost has no option 'form'"):
        options.replace(form="euler")
    with pytest.raises(BadInput, match=r"no option 'segment'.*Did you mean 'segments'"):
        options.replace(segment=3.0)
    assert pickle.loads(pickle.dumps(options)) == options


def test_another_kind_keeps_what_both_have() -> None:
    trajectory = TrajectoryOptions(hold="zoh", max_step=0.1, initial="free")
    assert of_kind(trajectory, "trajectory") is trajectory
    assert of_kind(trajectory, "regression") == RegressionOptions(hold="zoh", max_step=0.1)
    assert of_kind(trajectory, "formula") == FormulaOptions()
    assert as_trajectory(RegressionOptions(hold="zoh", form="euler")) == TrajectoryOptions(hold="zoh")
    assert as_trajectory(FormulaOptions()) == TrajectoryOptions()
    with pytest.raises(BadInput, match=r"no 'regresion' cost.*Did you mean 'regression'"):
        of_kind(trajectory, "regresion")


def test_they_describe_themselves_as_plain_values() -> None:
    assert RegressionOptions(equations=["u", "r"]).describe() == {
        "kind": "regression",
        "form": "trapezoid",
        "equations": ["u", "r"],
        "hold": "foh",
        "max_step": None,
    }
