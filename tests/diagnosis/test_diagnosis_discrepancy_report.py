"""What is reported of a missing force that no effect describes."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.discrepancy.report import describe
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial


@pytest.fixture(scope="module")
def found(ship_folder: Path, offset_runs: list[Trial]) -> Search:
    return search(small.problem(ship_folder, offset_runs, ("gyro_bias",)), small.silent)


def test_a_constant_force_is_told_with_its_size(found: Search) -> None:
    """A rudder that stands off is a constant yaw acceleration K angle / T, if no rudder effect takes part."""
    described = describe(found, ())
    assert described is not None
    assert set(described.sizes) == {"yaw"}
    assert described.log_evidence > 20.0
    terms = {term.term: term for term in described.terms}
    force = np.mean([np.mean(f.value) for f in described.forces])
    constant = terms["1"].coefficient if "1" in terms else 0.0
    expected = small.TRUE["K"] * small.OFFSET / small.TRUE["T"]
    assert force + constant == pytest.approx(expected, rel=0.6)


def test_functions_of_time_cover_each_trial(found: Search) -> None:
    described = describe(found, ())
    assert described is not None
    assert [f.trial for f in described.forces] == [trial.name for trial in found.problem.trials]
    for force in described.forces:
        assert force.equation == "yaw"
        assert len(force.t) == len(force.value) == len(force.stderr)
        assert force.t[0] == 0.0
        assert force.t[-1] >= 119.0 - 1e-9
        assert all(math.isfinite(sd) and sd > 0.0 for sd in force.stderr)


def test_terms_are_those_that_stand_out_and_the_clearest_comes_first(found: Search) -> None:
    described = describe(found, ())
    assert described is not None
    ratios = [abs(term.coefficient) / term.stderr for term in described.terms]
    assert all(ratio > 2.0 for ratio in ratios)
    assert ratios == sorted(ratios, reverse=True)
    assert {term.unit for term in described.terms} <= {"rad/s2"}


def test_none_where_it_was_not_fitted(found: Search) -> None:
    assert describe(found, ("rudder_offset",)) is None


def test_forces_of_no_size_are_told_as_none(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    fit = found.fits[(), True]
    bare = dataclasses.replace(
        fit, sizes=dataclasses.replace(fit.sizes, forces=np.full_like(fit.sizes.forces, -math.inf))
    )
    monkeypatch.setitem(found.fits, ((), True), bare)
    described = describe(found, ())
    assert described is not None
    for force in described.forces:
        assert len(force.t) == len(force.value) == len(force.stderr)
        assert not any(force.stderr)
