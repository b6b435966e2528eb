"""An answer that is wrong as a whole says so: runs astray, initial states far off, a search that ended short."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from astray_boat import NOISE, Boat, runs, study

from seatruth import Estimate, identify
from seatruth.costs import cost_of
from seatruth.costs.growth import Growth
from seatruth.costs.options import TrajectoryOptions
from seatruth.optimizers import Budget
from seatruth.trials import Trials
from seatruth.uncertainty.reliability import motion, short_of_minimum, step_to_minimum, stray_finding, stray_runs

WRONG = {"K": -1.0, "U": -3.0}
"""Start values from which the search ends half a turn off: the boat goes astern along the track, turned round."""


def codes(estimate: Estimate) -> set[str]:
    return {finding.code for finding in estimate.findings if finding.severity != "note"}


def found_from(values: dict[str, float], **arguments: Any) -> Estimate:
    changes = {"cost": TrajectoryOptions(initial=arguments.pop("initial", "free"))}
    return identify(study(values=values, **changes), threads=1, **arguments)


def test_a_fit_half_a_turn_off_is_found_and_no_parameter_is_called_identified() -> None:
    found = found_from(WRONG)
    assert found.outcome["code"] == "converged"
    psi = found.fit.set_index("channel").loc["psi", "rmse"]
    assert math.degrees(psi) == pytest.approx(160, abs=10)
    assert {"runs-stray", "initial-state-far", "better-optimum"} <= codes(found)
    assert set(found.parameters["verdict"]) == {"doubtful"}
    stray = next(finding for finding in found.findings if finding.code == "runs-stray")
    assert (stray.trial, stray.channel) == ("run 0", "psi")
    assert re.search(r"psi by 1[56]\d deg", stray.message)


def test_a_good_fit_is_left_alone() -> None:
    for initial in ("fixed", "free"):
        found = found_from({}, initial=initial)
        assert codes(found) == set()
        assert set(found.parameters["verdict"]) == {"identified"}


def test_the_noise_that_a_run_exceeds_is_read_from_the_record_where_it_is_estimated() -> None:
    """The residuals of a wrong fit are no noise."""
    found = identify(study(values=WRONG, noise={}), threads=1)
    assert "runs-stray" in codes(found)
    cost = cost_of(study(noise={}, values={"K": 0.5, "T": 3.0, "U": 1.5}), threads=1)
    assert stray_runs(cost, cost.predict(cost.start)) == []


def test_a_run_that_alone_is_far_beyond_its_noise_strays() -> None:
    trials = list(runs(3))
    cost = cost_of(study(3), threads=1)
    exact = [np.column_stack([trial.outputs[name] + sd for name, sd in NOISE.items()]) for trial in trials]
    assert stray_runs(cost, exact) == []
    off = [y.copy() for y in exact]
    off[1][:, 1] += 60.0 * NOISE["x"]  # 6 m: no more than a part of the track
    (stray,) = stray_runs(cost, off)
    assert (stray.trial, stray.channel.name) == ("run 1", "x")
    assert "unlike the other runs" in str(stray)
    everywhere = [y + np.array([0.0, 6.0, 0.0]) for y in exact]
    assert stray_runs(cost, everywhere) == []
    assert motion(trials[1], Boat().outputs, Boat().outputs[1]) > 6.0


def test_a_run_that_hardly_moves_is_no_stray_for_an_error_like_its_motion() -> None:
    """A leg that keeps its place, among runs of tens of metres."""
    trials = list(runs(3))
    kept = dict.fromkeys(("x", "y"), 0.05 * np.sin(trials[1].t))
    still = replace(trials[1], outputs={**trials[1].outputs, **kept})
    cost = cost_of(replace(study(3), trials=Trials([trials[0], still, trials[2]])), threads=1)
    exact = [np.column_stack([trial.outputs[name] for name in NOISE]) for trial in cost.trials]
    error = exact[1] + np.where(np.array([*NOISE]) == "x", 5.0 * NOISE["x"], 0.0)
    assert motion(still, Boat().outputs, Boat().outputs[1]) < 5.0 * NOISE["x"]
    assert stray_runs(cost, [exact[0], error, exact[2]]) == []


def test_the_rate_of_a_straight_run_that_is_noise_is_no_stray() -> None:
    class WithRate(Boat):
        outputs = Boat.states

    rng = np.random.default_rng(1)
    rates = [0.1 * np.sin(runs(3)[0].t), rng.normal(0.0, 0.002, 240), 0.1 * np.cos(runs(3)[2].t)]
    trials = [replace(one, outputs={"r": r, **one.outputs}) for one, r in zip(runs(3), rates)]
    noise = {"r": 0.002, **NOISE}
    cost = cost_of(replace(study(3), model=WithRate(), trials=Trials(trials), noise=noise), threads=1)
    exact = [np.column_stack([trial.outputs[name] for name in noise]) for trial in trials]
    missed = exact[1] + np.array([0.0065, 0.0, 0.0, 0.0])
    assert motion(trials[1], WithRate.outputs, WithRate.outputs[0]) < 0.0065
    assert stray_runs(cost, [exact[0], missed, exact[2]]) == []
    (stray,) = stray_runs(cost, [exact[0], exact[1] + np.array([0.02, 0.0, 0.0, 0.0]), exact[2]])
    assert (stray.trial, stray.channel.name) == ("run 1", "r")


def test_the_advice_is_not_what_is_done_already() -> None:
    free, fixed = (found_from(WRONG, initial=initial).findings for initial in ("free", "fixed"))
    said = [next(one for one in found if one.code == "runs-stray").do for found in (free, fixed)]
    assert ["initial =" in do for do in said] == [False, True]


def test_the_motion_of_a_speed_is_its_size_and_of_a_place_its_spread() -> None:
    trial = runs(1)[0]
    _, x, y = Boat().outputs
    spread = max(float(np.std(trial.outputs[name])) for name in ("x", "y"))
    assert motion(trial, Boat().outputs, x) == motion(trial, Boat().outputs, y) == pytest.approx(spread)
    moved = replace(trial, outputs={**trial.outputs, "x": trial.outputs["x"] + 1e4})
    assert motion(moved, Boat().outputs, x) == pytest.approx(spread)


def test_an_initial_state_within_its_prior_is_not_far() -> None:
    away = study(cost=TrajectoryOptions(initial="free", initial_sd={"x": 30.0, "y": 30.0}), values=WRONG)
    far = {f.channel for f in identify(away, threads=1).findings if f.code == "initial-state-far"}
    assert not far & {"x", "y"}


def test_an_initial_state_far_beyond_its_prior_is_not_told_to_state_one() -> None:
    near = study(cost=TrajectoryOptions(initial="free", initial_sd={"psi": 0.1}), values=WRONG)
    said = [f for f in identify(near, threads=1).findings if f.code == "initial-state-far" and f.channel == "psi"]
    assert said
    assert all("prior deviations from it" in f.message and "initial_sd" not in f.do for f in said)


def test_segments_are_no_runs_that_could_stray() -> None:
    made = study(values=WRONG, cost=TrajectoryOptions(segments=7.5))
    assert "runs-stray" not in codes(identify(made, threads=1))


def test_a_search_that_ended_short_leaves_what_it_would_still_move_in_doubt() -> None:
    found = identify(study(), threads=1, budget=Budget(evaluations=9))
    assert found.outcome["code"] == "budget"
    short = next(finding for finding in found.findings if finding.code == "not-at-minimum")
    assert "its budget was used up" in short.message
    assert "doubtful" in set(found.parameters["verdict"])


def test_the_step_to_the_minimum_of_a_linear_problem_is_exact() -> None:
    rng = np.random.default_rng(0)
    J, x = rng.normal(size=(20, 3)), np.array([1.0, -2.0, 0.5])
    step, fall = step_to_minimum(J @ x, J, np.array([True, True, True]))
    assert step == pytest.approx(-x)
    assert fall == pytest.approx(0.5 * float((J @ x) @ (J @ x)))
    held, less = step_to_minimum(J @ x, J, np.array([True, False, True]))
    assert held[1] == 0.0
    assert less < fall
    assert short_of_minimum(0.05, "converged") is None
    assert short_of_minimum(0.2, "converged") is not None


def test_no_trial_is_needed_for_a_state_that_was_not_recorded() -> None:
    """r is free and not recorded: nothing says where it should be."""
    found = identify(study(2, cost=TrajectoryOptions(initial="free")), threads=1)
    assert "run 1: r" in found.nuisances.index
    assert codes(found) == set()


def test_a_step_to_the_minimum_stays_within_bounds() -> None:
    rng = np.random.default_rng(1)
    J, x = rng.normal(size=(30, 3)), np.array([1.0, -2.0, 0.5])
    every = np.array([True, True, True])
    room = np.array([-0.3, -5.0, -1e-9]), np.array([0.3, 5.0, 1.0])
    step, fall = step_to_minimum(J @ x, J, every, room)
    assert step[0] == pytest.approx(-0.3)
    assert abs(step[2]) <= 1e-9
    assert 0.0 < fall < step_to_minimum(J @ x, J, every)[1]


def test_a_fall_counts_by_the_misfit_and_advice_is_not_what_is_done_already() -> None:
    assert short_of_minimum(5.0, "converged", misfit=100.0) is None
    rough, local = (short_of_minimum(50.0, "converged", misfit=100.0, polished=p) for p in (False, True))
    assert rough is not None
    assert local is not None
    assert 'use = "least_squares"' in rough.do
    assert "least_squares" not in local.do
    assert "starts = 5" in local.do
    budget = short_of_minimum(50.0, "budget", polished=True)
    assert budget is not None
    assert budget.do.startswith("Give it more evaluations")


def test_runs_that_no_start_leads_back_to_their_records_are_said_to_be_such(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an ROV held by its pilot the search was told of a wrong optimum, and how long a segment may be was not."""
    cost = cost_of(study(2))
    stray = stray_runs(cost, [y + 10.0 for y in cost.predict(cost.start)])
    assert stray
    plain = stray_finding(stray, cost)
    monkeypatch.setattr(Growth, "is_too_far", True)
    monkeypatch.setattr(Growth, "sections", 4)
    held = stray_finding(stray, cost)
    assert "segments = ..." in plain.do
    assert "grows" not in plain.message
    assert "No run follows such trials whole: of this model a small error grows" in held.message
    assert re.search(r"`segments = [\d.]+`", held.do)
