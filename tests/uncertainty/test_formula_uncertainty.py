"""Fitted formulas: scales that cancel are named, intervals cover, rows have no order, the better of two is found."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatruth import identify
from seatruth.costs import cost_of
from seatruth.costs.formula import FormulaCost
from seatruth.errors import BadInput
from seatruth.models import Parameter
from seatruth.study import formula_study
from seatruth.uncertainty import (
    compare_models,
    held_out_errors,
    prediction_intervals,
    repeated_folds,
    unidentifiable_directions,
)


def free(name: str, value: float, low: float = -10.0, high: float = 10.0) -> Parameter:
    return Parameter(name, value, min=low, max=high, vary=True)


def table(rng: np.random.Generator, n: int = 30, noise: float = 0.1) -> dict[str, Any]:
    u, v = rng.uniform(1, 2, n), rng.uniform(1, 3, n)
    return {"u": u, "v": v, "y": (2 * u + 1) / (0.5 * v + 1) + noise * rng.standard_normal(n)}


def named(text: str, *parameters: Parameter) -> list[tuple[str, dict[str, float]]]:
    study = formula_study(text, table(np.random.default_rng(0)), parameters)
    cost = cost_of(study)
    return [(entry["kind"], entry["combination"]) for entry in unidentifiable_directions(cost, cost.start)]


def test_a_ratio_shares_a_scale() -> None:
    ratio = [free("a", 2), free("b", 1), free("c", 0.5), free("d", 1)]
    assert named("y = (a*u + b) / (c*v + d)", *ratio) == [("scale", {"a": 1, "b": 1, "c": 1, "d": 1})]
    assert named("y = (a*u + b) / (c*v + 1)", *ratio[:3]) == []


def test_powers_products_and_sums_are_told_apart() -> None:
    assert named("y = a * b**2 * u", free("a", 2), free("b", 1.5)) == [("scale", {"a": 1, "b": -0.5})]
    assert named("y = a + b + c*u", free("a", 1), free("b", 0.5), free("c", 1)) == [("sum", {"a": 1, "b": -1})]
    found = named("y = a*u/b + c - 2*d", free("a", 2), free("b", 1), free("c", 0.5), free("d", 1))
    assert found == [("scale", {"a": 1, "b": 1}), ("sum", {"c": 1, "d": 0.5})]
    # one that is at zero, as on its bound, still takes part
    assert named("y = (a*u + b) / c", free("a", 2), free("b", 0, 0), free("c", 1)) == [
        ("scale", {"a": 1, "b": 1, "c": 1})
    ]


@pytest.mark.parametrize(
    ("text", "count", "seen"),
    [
        ("y = a * b * u", 2, ["a * b"]),
        ("y = a * b**2 * u", 2, ["a * b^2"]),
        ("y = a * u / b", 2, ["a / b"]),
        ("y = a + b + c*u", 3, ["a + b"]),
        ("y = a*u/b + c - 2*d", 4, ["a / b", "c - 2 d"]),
        ("y = (a*u + b) / (c*v + d)", 4, ["their ratios"]),
    ],
)
def test_what_can_be_seen_all_the_same_is_named(text: str, count: int, seen: list[str]) -> None:
    parameters = [free(name, 1.0 + 0.3 * k) for k, name in enumerate("abcd"[:count])]
    cost = cost_of(formula_study(text, table(np.random.default_rng(0)), parameters))
    sentences = [entry["sentence"] for entry in unidentifiable_directions(cost, cost.start)]
    assert len(sentences) == len(seen)
    for what, sentence in zip(seen, sentences):
        assert f"nothing changes: only {what} can be seen." in sentence


def test_a_parameter_that_nothing_sees_is_no_degeneracy_of_others() -> None:
    assert named("y = a*u + 0*b", free("a", 1), free("b", 1)) == []


def test_the_estimate_says_it_in_words_and_once() -> None:
    study = formula_study(
        "y = (a*u + b) / (c*v + d)",
        table(np.random.default_rng(0)),
        [free(name, 1, 0) for name in "abcd"],
        synthetic=True,
    )
    found = identify(study, threads=1)
    said = [entry["sentence"] for entry in found.identifiability["weak"]]
    assert said[0].startswith("Scales cancel: a, b, c and d can be multiplied by one factor")
    assert not any("do not determine" in sentence for sentence in said)
    assert set(found.parameters["verdict"]) == {"not identifiable"}
    # what counts is known all the same
    assert np.isfinite(found.traces[["lower", "upper"]].to_numpy()).all()
    assert {"input u", "input v"} <= set(found.traces)


def test_the_order_of_the_rows_has_no_meaning() -> None:
    rows = table(np.random.default_rng(3), 40)
    rows["y"] = rows["y"] + 0.3 * np.sign(np.arange(40) - 19.5)  # neighbours are alike
    shuffled = {name: values[np.random.default_rng(1).permutation(40)] for name, values in rows.items()}
    errors = [
        identify(
            formula_study("y = a*u + b", data, [free("a", 1), free("b", 1)]), threads=1
        ).parameters.stderr.to_numpy()
        for data in (rows, shuffled)
    ]
    np.testing.assert_allclose(errors[0], errors[1], rtol=1e-6)


def test_prediction_intervals_are_those_of_linear_regression() -> None:
    rng = np.random.default_rng(0)
    u = rng.uniform(0, 1, 12)
    study = formula_study(
        "y = a*u + b", {"u": u, "y": 3 * u + 0.1 * rng.standard_normal(12)}, [free("a", 1), free("b", 0)]
    )
    cost = cost_of(study)
    assert isinstance(cost, FormulaCost)
    x = np.linalg.lstsq(np.c_[u, np.ones(12)], study.trials[0].outputs["y"])[0]
    cost.reweight(x)
    (found,) = prediction_intervals(cost, x)
    residual = study.trials[0].outputs["y"] - np.c_[u, np.ones(12)] @ x
    s2 = residual @ residual / 10
    spread = s2 * (1 / 12 + (u - u.mean()) ** 2 / ((u - u.mean()) ** 2).sum())
    np.testing.assert_allclose(found.mean_half_width, 2.2281388 * np.sqrt(spread), rtol=1e-6)
    np.testing.assert_allclose(found.half_width, 2.2281388 * np.sqrt(spread + s2), rtol=1e-6)


@pytest.mark.slow
def test_prediction_intervals_cover_new_measurements_of_a_degenerate_formula() -> None:
    inside = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        rows, new = table(rng), table(rng, 20)
        study = formula_study("y = (a*u + b) / (c*v + d)", rows, [free(name, 1, 0) for name in "abcd"])
        estimate = identify(study, threads=1)
        cost = cost_of(study)
        assert isinstance(cost, FormulaCost)
        x = estimate.parameters.value.to_numpy(float)
        cost.reweight(x)
        later = formula_study("y = (a*u + b) / (c*v + d)", new, study.parameters).trials[0]
        (found,) = prediction_intervals(cost, x, [later])
        inside.append(np.abs(new["y"] - found.value) <= found.half_width)
    assert 0.92 < np.mean(inside) < 0.98


def test_what_the_rows_do_not_fix_has_no_interval() -> None:
    u = np.ones(6)
    y = [1.1, 0.9, 1.0, 1.1, 0.8, 1.2]
    study = formula_study("y = a*u + b", {"u": u, "y": y}, [free("a", 1), free("b", 0)], noise=0.1)
    cost = cost_of(study)
    assert isinstance(cost, FormulaCost)
    elsewhere = formula_study("y = a*u + b", {"u": [1.0, 2.0], "y": [1.0, 2.0]}, study.parameters).trials[0]
    (found,) = prediction_intervals(cost, cost.start, [elsewhere])
    assert np.isfinite(found.half_width[0])
    assert np.isinf(found.half_width[1])


def test_the_better_formula_is_preferred_and_equals_are_not() -> None:
    rng = np.random.default_rng(4)
    rows = table(rng, 40, 0.05)
    right = formula_study("y = (a*u + b) / (c*v + 1)", rows, [free(name, 1, 0) for name in "abc"])
    wrong = formula_study("y = a*u + b", rows, [free("a", 1), free("b", 1)])
    scores: dict[str, list[float]] = {"right": [], "wrong": []}
    for parts in repeated_folds(40, 5, 3, rng):
        for name, study in (("right", right), ("wrong", wrong)):
            errors = held_out_errors(study, parts)
            scores[name] += [float(np.mean(errors[part] ** 2)) for part in parts]
    found = compare_models(np.array(scores["right"]), np.array(scores["wrong"]), test_train_ratio=0.25)
    assert found.high < 0
    assert found.p < 0.01
    assert found.first_better == 1.0
    same = compare_models(np.array([1.0, 2.0, 3.0]), np.array([2.0, 1.0, 3.0]))
    assert same.low < 0 < same.high
    assert same.p == pytest.approx(1.0)


def test_folds_are_partitions_and_impossible_ones_are_refused() -> None:
    for parts in repeated_folds(11, 4, 3, np.random.default_rng(0)):
        assert sorted(np.concatenate(parts).tolist()) == list(range(11))
    with pytest.raises(BadInput, match="cannot be split"):
        repeated_folds(3, 4, 1, np.random.default_rng(0))
    with pytest.raises(BadInput, match="two scores or more"):
        compare_models(np.array([1.0]), np.array([2.0]))


def test_a_table_of_conditions_or_of_rows_is_left_out_in_turn() -> None:
    study = formula_study("y = a*u + b", table(np.random.default_rng(0)), [free("a", 1), free("b", 1)], name="turns")
    left = identify(study, threads=1, cross_validate=True).cross_validation
    assert left is not None
    assert list(left["trial"]) == ["turns"]
    assert float(left["rmse"].iloc[0]) > float(left["rmse_fitted"].iloc[0]) > 0
