"""A search without forces first, and with them where they may explain something."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_case as small
from black_box_boat import box, study, trials

from seatruth.diagnosis.forces_beside import may_do_without
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import fit_null
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.posterior import by_cause, hypotheses, none_and_unknown
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.screening import screen
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import log_prior, noise_prior
from seatruth.effects import load_effects
from seatruth.trials.trial import Trial


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
    # Beside forces the two effects keep the shares of their priors.
    assert none_and_unknown(hypotheses(found, problem.settings))[1] > 0.6


@pytest.mark.slow
def test_forces_are_fitted_beside_a_small_cause_which_they_might_be() -> None:
    _, found = searched(offset=0.002)
    assert found.leader.evidence - found.fits[(), False].evidence < 100.0
    assert ((), True) in found.fits


def equations(folder: Path, runs: list[Trial]) -> Search:
    """The model alone, with forces and without."""
    problem = small.problem(folder, runs)
    found = Search(problem, noise_prior(problem))
    fit_null(found)
    return found


def test_equations_may_do_without_forces_where_an_effect_explains_more(
    ship_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("seatruth.diagnosis.forces_beside.HOPE", 20.0)  # in short trials forces explain little
    found = equations(
        ship_folder, small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=small.EFFECTS)
    )
    assert may_do_without(found)
    assert found.bare
    found.bare = False
    plain, loose = found.fits[(), False], found.fits[(), True]
    del found.fits[(), True]
    assert not may_do_without(found), "forces were not fitted"
    found.fits[(), True] = dataclasses.replace(plain, evidence=plain.evidence + 19.0)
    assert not may_do_without(found), "they explain little"
    found.fits[(), True] = dataclasses.replace(loose, evidence=math.inf)
    tried: list[str] = []
    assert not may_do_without(found, tried.append), "no effect explains as much"
    assert "rudder_offset" in tried, "what takes time is said"
    assert not found.bare


def test_a_search_without_forces_ends_as_one_with_them(ship_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runs = small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=small.EFFECTS)
    whole = search(small.problem(ship_folder, runs), small.silent)
    assert not whole.bare
    monkeypatch.setattr("seatruth.diagnosis.forces_beside.HOPE", 20.0)
    bare = search(small.problem(ship_folder, runs), small.silent)
    assert bare.bare
    assert bare.leader.effects == whole.leader.effects == ("rudder_offset",)
    assert bare.leader.evidence == pytest.approx(whole.leader.evidence, abs=0.05)
    assert len([1 for _, on in bare.fits if on]) < len([1 for _, on in whole.fits if on])
    said = [dict(by_cause(hypotheses(one, one.problem.settings), one.problem.effects)) for one in (bare, whole)]
    assert said[0]["actuator.steering.offset"] == pytest.approx(said[1]["actuator.steering.offset"], abs=0.02)


@pytest.mark.parametrize(("brings", "tried"), [(5.0, False), (15.0, True)])
def test_what_brings_nothing_where_it_is_begun_is_not_tried_without_forces(
    ship_folder: Path, monkeypatch: pytest.MonkeyPatch, brings: float, tried: bool
) -> None:
    effects = [*small.EFFECTS, "rudder_rate_limit"]
    problem = small.problem(ship_folder, small.trials(ship_folder), effects)
    found = Search(problem, noise_prior(problem))
    fit_null(found)
    near = found.fits[(), True]
    found.fits[(), True] = dataclasses.replace(near, evidence=math.inf)  # nothing explains as much
    bare = near.sizes.without_discrepancy()
    nothing = Likelihood(problem, near.linearized(problem)).evidence(bare, ())
    nothing += log_prior(problem.settings, bare, found.known)

    def screened(found: Search, at: Any) -> list[str]:
        ranked = screen(found, at)
        found.screened[("rudder_rate_limit",), False] = nothing + brings
        return [name for name in ranked if name != "rudder_rate_limit"] + ["rudder_rate_limit"]

    monkeypatch.setattr("seatruth.diagnosis.forces_beside.screen", screened)
    said: list[str] = []
    assert not may_do_without(found, said.append)
    assert ("rudder_rate_limit" in said) is tried
    assert "rudder_gain" in said, "others are"
