"""The next trial: its menu, what it adds to the distances between causes, and what is suggested of it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import small_case as small
from seatruth.diagnosis.discrepancy.score_test import Probes, probes
from seatruth.diagnosis.result_builder import Parts

from seatruth.diagnosis.experiment_design.candidates import MOST, Menu
from seatruth.diagnosis.experiment_design.discrimination import Rivals
from seatruth.diagnosis.experiment_design.select import next_trial
from seatruth.diagnosis.fit import fit
from seatruth.diagnosis.hypotheses import Search, floor_of, search
from seatruth.diagnosis.posterior import UNKNOWN, candidates, detectable, powerless, verdict
from seatruth.diagnosis.problem import GapProblem
from seatruth.effects import load_effects
from seatruth.trials.trial import Trials

CHANCES = {"rudder_offset": 0.7, "gyro_bias": 0.2, "heading_bias": 0.1}


def quiet(text: str) -> None:
    """No progress."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.folder_with_model(tmp_path_factory.mktemp("next"))


@pytest.fixture(scope="module")
def problem(folder: Path) -> GapProblem:
    runs = small.trials(folder, {"rudder_offset_angle": 0.02}, specs=["rudder_offset"])
    return GapProblem(small.study(folder, runs), load_effects(small.EFFECTS), threads=1)


@pytest.fixture(scope="module")
def found(problem: GapProblem) -> Search:
    floor, full, plain = floor_of(problem, quiet)
    return search(problem, floor, full.x, plain.x, quiet)


@pytest.fixture(scope="module")
def probed(problem: GapProblem, found: Search) -> Probes:
    return probes(problem, found.floor, found.base)


def test_the_menu_stays_within_what_the_trials_did(problem: GapProblem) -> None:
    menu = Menu(problem)
    longest = max(t.duration for t in problem.trials)
    values = np.concatenate([np.asarray(t.inputs["delta"]) for t in problem.trials])
    for name in menu.phases:
        option = menu.trial([name])
        delta = np.asarray(option.trial.inputs["delta"])
        assert np.abs(delta - np.median(values)).max() <= np.abs(values - np.median(values)).max() + 1e-12
        assert option.trial.duration == pytest.approx(longest, abs=1.0)
        assert "s in all" in option.text
    assert {"turn by +delta", "turn by -delta", "zigzag of delta", "staircase of delta"} < set(menu.phases)
    assert "reciprocal course: " in menu.starts()


def test_a_programme_is_its_manoeuvres_one_after_another_and_its_name_says_it(problem: GapProblem) -> None:
    menu = Menu(problem)
    names = ["turn by +delta", "straight run", "zigzag of delta"]
    whole = menu.trial(names, "reciprocal course: ")
    single = len(menu.t)
    for k, name in enumerate(names):
        part = menu.trial([name]).trial
        assert np.array_equal(whole.trial.inputs["delta"][k * single : (k + 1) * single], part.inputs["delta"][:-1])
    again = menu.named(whole.name)
    assert again.name == whole.name
    assert np.array_equal(again.trial.inputs["delta"], whole.trial.inputs["delta"])
    turned = whole.trial.outputs["psi"][0] - menu.trial(names).trial.outputs["psi"][0]
    assert turned == pytest.approx(np.pi)
    with pytest.raises(KeyError):
        menu.named("a manoeuvre of no menu")


def test_a_channel_counts_at_the_samples_at_which_it_is_recorded(folder: Path) -> None:
    """A heading every third sample says a third of what one at every sample would."""
    runs = small.trials(folder)
    keep = np.arange(len(runs[0])) % 3 == 0
    sparse = [
        dataclasses.replace(t, outputs={**t.outputs, "psi": np.where(keep, t.outputs["psi"], np.nan)}) for t in runs
    ]
    menu = Menu(GapProblem(small.study(folder, sparse), load_effects(small.EFFECTS), threads=1))
    option = menu.trial(["straight run"]).trial
    assert np.isfinite(option.outputs["psi"]).sum() == pytest.approx(len(option) / 3, abs=1.0)
    assert np.isfinite(option.outputs["r"]).all()


def test_a_further_trial_never_takes_information_away(problem: GapProblem, found: Search) -> None:
    rivals, menu = Rivals(found, CHANCES), Menu(problem)
    one, more = (
        rivals.after(menu.trial(["zigzag of delta"]).trial),
        rivals.after(menu.trial(["zigzag of delta"] * 2).trial),
    )
    assert one is not None
    assert more is not None
    for pair, value in rivals.before.items():
        assert one[pair] >= value * (1.0 - 1e-6)
        assert more[pair] >= one[pair] * (1.0 - 1e-6)


def test_the_distance_is_the_fall_of_the_misfit_that_refitting_a_rival_leaves(
    problem: GapProblem, found: Search
) -> None:
    """Against refits to noise-free trials of the true cause, before and with one more trial."""
    rivals, option = Rivals(found, CHANCES), Menu(problem).trial(["turn by -delta"]).trial
    after = rivals.after(option)
    assert after is not None
    true = found.fits[("rudder_offset",)]
    values = dict(zip(problem.names, true.x))
    runs = []
    for trial in [*problem.trials, option]:
        cost = problem.cost_of(problem.model, (), values, Trials([trial]))
        own = [f"{trial.name}: {state}" for state in ("r", "psi")]
        x = np.array([values.get(n, s) for n, s in zip(cost.names, cost.start)])
        assert all(name in cost.names for name in own)
        y = cost.predict(x)[0]
        runs.append(dataclasses.replace(trial, outputs={"r": y[:, 0], "psi": y[:, 1]}))
    for many, table in ((4, rivals.before), (5, after)):
        study = problem.study.replace(trials=Trials(runs[:many]))
        clean = GapProblem(study, load_effects(small.EFFECTS), threads=1)
        clean.mean[clean.coefficients] = true.x[problem.coefficients]
        floor = dataclasses.replace(
            found.floor, series=tuple(clean.series), of=tuple(found.floor.of[k % 2] for k in range(len(clean.series)))
        )
        got = fit(clean, ("gyro_bias",), floor, clean.start)
        assert table[("rudder_offset", "gyro_bias")] == pytest.approx(2.0 * got.cost, rel=0.05)


def test_a_motion_that_leaves_what_was_recorded_is_not_on_the_menu(problem: GapProblem, found: Search) -> None:
    rivals, menu = Rivals(found, CHANCES), Menu(problem)
    wild = menu.trial(["turn by +delta"]).trial
    wild = dataclasses.replace(wild, inputs={"delta": 10.0 * np.asarray(wild.inputs["delta"])})
    assert rivals.after(wild) is None


def test_the_suggestion_is_the_best_of_the_menu(found: Search, probed: Probes) -> None:
    got = next_trial(found, {**CHANCES, UNKNOWN: 0.1}, quiet, probed)
    assert got is not None
    assert got["survivors"] == [*CHANCES, UNKNOWN]
    assert set(got["gains"]) == {*CHANCES, UNKNOWN}
    assert min(got["gains"].values()) >= 1.0 - 1e-6
    assert got["menu"][0]["manoeuvre"] == got["manoeuvre"]
    assert got["lambda_then"] >= got["lambda_now"]
    assert len(got["manoeuvre"].split(", then ")) <= MOST
    assert set(got["inputs"]) == {"delta"}
    assert len(got["t"]) == len(got["inputs"]["delta"])
    assert got == next_trial(found, {**CHANCES, UNKNOWN: 0.1}, quiet, probed)


def test_one_survivor_needs_no_further_trial(found: Search) -> None:
    assert next_trial(found, {"rudder_offset": 1.0}, quiet) is None


def test_a_survivor_of_next_to_no_size_stands_at_its_typical_one(problem: GapProblem, found: Search) -> None:
    key = ("gyro_bias",)
    x, linear = found.fits[key].x.copy(), found.fits[key].linear
    x[problem.columns["gyro_bias"]] = 0.0
    flat = dataclasses.replace(
        found.fits[key], x=x, linear=dataclasses.replace(linear, errors=found.base.linear.errors)
    )
    weak = Search(problem, found.floor, {**found.fits, key: flat}, found.screens, found.starts)
    assert Rivals(weak, CHANCES).before[("gyro_bias", "rudder_offset")] > 1.0


def test_the_suggestion_comes_with_the_motion_that_is_expected(problem: GapProblem, found: Search) -> None:
    answers = candidates(found, [])
    least = detectable(found)
    judged = dataclasses.replace(verdict(answers, powerless(found, least), 4), together=("rudder_offset", "gyro_bias"))
    parts = Parts(problem.study, problem, found, found, [], answers, judged, least, [], quiet, 0)
    got = parts.suggestion()
    assert got is not None
    assert set(got["motion"]) == {"r", "psi"}
    assert len(got["motion"]["r"]) == len(got["t"])
    assert got["units"]["r"] == "rad/s"
