"""A black box is searched without forces first, and with them where they may explain something."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from black_box_boat import box, study, trials

from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.posterior import hypotheses, none_and_unknown
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects


def searched(push: Any = None, *, offset: float = 0.0) -> tuple[Problem, Search]:
    runs = trials(offset=offset) if push is None else trials(push, offset=offset)
    problem = Problem(study(box(), runs), load_effects(["rudder_offset", "gyro_bias"]), Settings())
    return problem, search(problem, lambda *_: None)


@pytest.mark.slow
def test_forces_that_bring_nothing_beside_a_cause_are_not_fitted_in_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("seatruth.diagnosis.forces_beside.HOPE", 50.0)  # these trials are short: forces are 107 behind
    problem, found = searched(offset=0.2)
    assert found.bare
    assert found.leader.effects == ("rudder_offset",)
    assert not found.leader.discrepancy
    assert (("rudder_offset",), True) in found.fits
    assert ((), True) not in found.fits
    # It keeps its share all the same, by its linearized evidence.
    assert -math.inf < found.screened[(), True] < found.leader.evidence
    rows = hypotheses(found, problem.settings)
    assert [one for one in rows if not one.effects and one.discrepancy and not one.settled]
    assert none_and_unknown(rows)[1] < 1e-3


@pytest.mark.slow
def test_forces_are_fitted_where_no_effect_explains_the_trials() -> None:
    def odd(t: float, y: dict[str, float]) -> dict[str, float]:
        return {"X": -8.0 * float(t > 20.0), "Y": 0.0, "N": 12.0 * np.sin(t / 7.0)}

    problem, found = searched(odd)
    assert not found.bare
    assert found.fits[(), True].evidence > found.fits[(), False].evidence + 100.0
    assert none_and_unknown(hypotheses(found, problem.settings))[1] > 0.7


@pytest.mark.slow
def test_forces_are_fitted_beside_a_small_cause_which_they_might_be() -> None:
    _, found = searched(offset=0.002)
    assert found.leader.evidence - found.fits[(), False].evidence < 100.0
    assert ((), True) in found.fits
