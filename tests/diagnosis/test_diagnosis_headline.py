"""The headline of a decision."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis.decision import Decision
from seatruth.diagnosis.headline import closed_beside_terms, headline
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.parts import Fold, Shares, Validation
from seatruth.diagnosis.search import search
from seatruth.diagnosis.size_errors import sizes_of
from seatruth.diagnosis.verdict import EffectParameter, NamedCause

SHARES = Shares(0.1, 0.2, 0.65, 0.05, 10.0, 8.0, 1.1)
FOLDS = tuple(Fold(name, ("gyro_bias",), 3.0, 2.9, 2.8, 2.7, 1.0, 0.2, 9.0) for name in ("a", "b"))
UNPROVEN = Validation(FOLDS, 0.05, -0.4, 0.5, 0.1)
TRUTH = {"gyro_bias_b": 0.004}


@pytest.fixture(scope="module")
def found(ship_folder: Path) -> Search:
    """Trials of a ship whose gyro has a bias."""
    runs = small.trials(ship_folder, TRUTH, specs=["gyro_bias"])
    return search(small.problem(ship_folder, runs), small.silent)


def parameters(found: Search, name: str) -> tuple[EffectParameter, ...]:
    fit = found.best((name,))
    return () if fit is None else sizes_of(found.problem, fit, name)


def test_what_is_not_named_is_told_with_its_size(found: Search) -> None:
    """Of an ROV a compass 4.04 deg off, which was right, was refused without a number."""
    model, said = found.problem.study.model, Decision("unknown", (), 0.99, True, ())

    def told(said: Decision) -> str:
        return headline(found, model, said, (), 0.99, SHARES, None, lambda name: parameters(found, name))

    refused = told(replace(said, outdone=("gyro_bias",)))
    assert "It looks like yaw rate bias (b 0.2" in refused
    assert "deg/s), but trials left out do not bear it out" in refused
    either = ("gyro_bias", "heading_bias")
    open_ = told(Decision("underpowered", (), 0.9, False, (), refused=either[:1], alike=either, acts=True))
    unknown = told(replace(said, refused=either[:1], alike=either))
    for sentence in (open_, unknown):
        assert "deg/s) or heading bias (" in sentence
        assert "which does not surely predict trials left out." in sentence
    once = told(replace(said, refused=("gyro_bias",), form=("gyro_bias", "heading_bias")))
    assert once.count("yaw rate bias") == 1
    assert "It looks like heading bias, or like damping or drag" in once
    assert "of no practical size: yaw rate bias (b 0.2" in told(replace(said, small=("gyro_bias",)))


def test_what_cannot_be_told_from_none_is_not_significant(found: Search) -> None:
    """Of a boat in a current an arm of its antenna of 0.14 +- 0.09 m stood beside it as significant."""
    said = Decision("unknown", (), 0.99, True, (), small=("gyro_bias",))
    known = parameters(found, "gyro_bias")
    vague = tuple(replace(one, stderr=abs(one.value - one.null) / 1.5) for one in known)

    def told(sizes: tuple[EffectParameter, ...]) -> str:
        return headline(found, found.problem.study.model, said, (), 0.99, SHARES, None, lambda name: sizes)

    assert "of no practical size: yaw rate bias" in told(known)
    assert "yaw rate bias" not in told(vague)


def test_an_error_of_a_sensor_is_measured_in_its_own_channels_where_all_others_drown_it(found: Search) -> None:
    cause = NamedCause("sensor", "yaw rate bias", ("gyro_bias",), 0.99, "b 0.23 +- 0.01 deg/s", 0.2, False, False)
    said = Decision("effects", (), 0.99, False, ("gyro_bias",))

    def told(validation: Validation, *causes: NamedCause) -> str:
        model = found.problem.study.model
        return headline(found, model, said, causes, 0.99, SHARES, validation, lambda name: parameters(found, name))

    assert "Of what r misses there beside free terms, it closes" in told(UNPROVEN, cause)
    assert "beside free terms" not in told(replace(UNPROVEN, lower=0.02), cause)
    rudder = replace(cause, effects=("rudder_offset",))
    assert "beside free terms" not in told(UNPROVEN, cause, rudder), "whole runs judge what moves the vehicle"


def test_what_a_cause_closes_beside_free_terms_is_told_where_runs_stray() -> None:
    """Errors of trials left out of a boat of another form, in a current: refit, effects, terms, both, noise."""

    def folds(*both: float) -> Validation:
        errors = ((7.2, 13.4, 9.3), (43.1, 76.2, 91.1), (117.2, 119.4, 8.2))
        parts = [
            Fold(str(k), ("current",), refit, effects, terms, left, 1.0, 0.2, 9.0)
            for k, ((refit, effects, terms), left) in enumerate(zip(errors, both))
        ]
        return Validation(tuple(parts), -0.19, -1.7, 1.3, 0.31)

    assert (
        closed_beside_terms(folds(1.1, 8.9, 1.2)) == "Of what free terms in the equations leave there, it closes 92 %."
    )
    assert closed_beside_terms(folds(1.1, 8.9, 1.2), them=True).endswith("they close 92 %.")
    assert closed_beside_terms(folds(8.9, 1.0, 8.0)) == "", "in one trial of three"
    assert closed_beside_terms(folds(1.0, 95.0, 1.0)) == "", "in all it is less than half"
    assert closed_beside_terms(folds(9.3, 91.1, 8.2)) == ""
