"""Trials in sections: the same samples, times and forces, and how a search comes to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import seatruth.sample
from seatruth.costs.growth import Growth
from seatruth.diagnosis import hypothesis_fits
from seatruth.diagnosis import search as searching
from seatruth.diagnosis.discrepancy.model import force_input
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.localization import in_time
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sections import RunsBend, finding, in_sections, left_out_together, most_sections
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import first_sizes, noise_prior
from seatruth.effects import load_effects
from seatruth.effects.each_trial import TrialCurrent
from seatruth.models.base import whole_name
from seatruth.storage.checkpoint import Checkpoint
from seatruth.trials.trial import Trial


def run(name: str, samples: int) -> Trial:
    t = 0.5 * np.arange(float(samples))
    return Trial(name, t, {"delta": t}, {"r": t})


@given(st.lists(st.integers(2, 400), min_size=1, max_size=4), st.sampled_from([1, 2, 4, 8]))
def test_sections_hold_every_sample_once_with_its_time(sizes: list[int], sections: int) -> None:
    whole = [run(f"run {k}", size) for k, size in enumerate(sizes)]
    parts = in_sections(whole, Settings(sections=sections))
    for trial in whole:
        own = [part for part in parts if whole_name(part.name) == trial.name]
        assert np.array_equal(np.concatenate([part.t for part in own]), trial.t)
        assert np.array_equal(np.concatenate([part.outputs["r"] for part in own]), trial.outputs["r"])
        assert len(own) == 1 or min(len(part) for part in own) >= 24
    assert sorted(k for group in left_out_together(parts) for k in group) == list(range(len(parts)))


def test_sections_of_one_trial_are_left_out_together_and_those_of_a_single_one_apart() -> None:
    one, other = run("turn", 400), run("stop", 200)
    assert left_out_together(in_sections([one, other], Settings(sections=4))) == [[0, 1, 2, 3], [4, 5]]
    assert left_out_together(in_sections([one], Settings(sections=4))) == [[0], [1], [2], [3]]
    assert [most_sections([run("any", samples)]) for samples in (40, 120, 400, 4000)] == [1, 2, 8, 8]


def test_what_is_left_stands_where_it_is_in_the_whole_trial() -> None:
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings(sections=2))
    parts = in_time(problem, problem.errors(problem.start))
    for trial in study.trials:
        own = parts[parts["trial"] == trial.name]
        assert own["from_s"].min() == 0.0
        assert own["to_s"].max() == pytest.approx(trial.duration)
        assert own["from_s"].is_monotonic_increasing
    assert int(parts["n"].sum()) == problem.count


def test_a_section_has_the_values_of_its_trial() -> None:
    """A current of its own in each trial is the same in all sections of one."""
    study = seatruth.sample.load("diagnose.toml")
    names = [trial.name for trial in study.trials]
    problem = Problem(study, [TrialCurrent().of_trials(names)], Settings(sections=2))
    numbers = [problem.model.number_of(trial.name) for trial in problem.trials]
    assert numbers == [float(names.index(whole_name(trial.name))) for trial in problem.trials]
    assert problem.model.number_of("another run §2") == -1.0


def test_forces_of_a_section_begin_where_it_does() -> None:
    """The derivative by a knot is that of the force which the run itself feels, and time goes on for effects."""
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings(sections=2, knots=4))
    later = next(k for k, trial in enumerate(problem.trials) if trial.t[0] > 0.0)
    start = problem.start
    at = problem.linearize(start, (), discrepancy=True)
    for equation in range(len(problem.equations)):
        size = 1e-4 * problem.usual[equation]
        forces = start.forces.copy()
        forces[later, equation, 1] = size
        moved = problem.errors(Point(start.shared, start.initial, forces)) - at.errors
        here = problem.trial_of == later
        column = len(problem.initial_names) + 4 * equation + 1
        expected = at.local[here, column] * size
        assert np.abs(expected).max() > 0.0
        assert moved[here] == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
        assert not moved[~here].any()
    assert force_input(next(iter(problem.discrepancy.equations))) in problem.trials[later].inputs


@pytest.mark.parametrize(("fits_at", "sections"), [(1, 1), (2, 8), (99, 1)])
def test_trials_are_cut_where_the_model_alone_cannot_be_fitted_to_whole_ones(
    fits_at: int, sections: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it cannot be fitted to sections either it is not their length, and the trials stay whole."""
    study = seatruth.sample.load("diagnose.toml")

    def fitted(found: Search, _: object) -> None:
        if found.may_cut and found.problem.settings.sections < fits_at:
            raise RunsBend

    monkeypatch.setattr(searching, "fit_null", fitted)
    problem = Problem(study, load_effects(["current"]), Settings())
    found = searching._begun(problem, Checkpoint(None, ""), lambda *_: None, 10, may_cut=True)
    assert found.problem.settings.sections == sections
    longest = max(len(trial) for trial in problem.trials)
    assert len(found.problem.trials) == len(problem.trials) if sections == 1 else longest >= 50 * sections
    assert "sections of about" in finding(study.trials, 2).message


def test_trials_along_which_runs_part_are_cut_before_anything_is_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a vehicle held by its pilot, four minutes of fits to whole trials ended in a false answer."""
    problem = Problem(seatruth.sample.load("diagnose.toml"), load_effects(["current"]), Settings())
    fitted: list[int] = []
    monkeypatch.setattr(searching, "fit_null", lambda found, _: fitted.append(found.problem.settings.sections))
    monkeypatch.setattr(Growth, "sections", 2)
    for too_far, may_cut, sections in ((False, True, 1), (True, False, 1), (True, True, 2)):
        monkeypatch.setattr(Growth, "is_too_far", too_far)
        searching._begun(problem, Checkpoint(None, ""), lambda *_: None, 10, may_cut=may_cut)
        assert fitted.pop() == sections
        assert not fitted


@pytest.mark.slow
def test_trials_are_cut_where_the_fit_of_the_model_alone_ends_far_short(monkeypatch: pytest.MonkeyPatch) -> None:
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings())
    found = Search(problem, noise_prior(problem))
    loose = hypothesis_fits.fit_once(found, (), True, problem.start, first_sizes(problem, found.known))
    assert loose is not None
    for may_cut, ahead, cut in ((False, 1e4, False), (True, 0.01, False), (True, 0.1, True)):
        short = replace(loose, ahead=ahead * problem.count, settled=False)
        monkeypatch.setattr(hypothesis_fits, "fit_once", lambda *_, **__: short)  # noqa: B023
        again = Search(problem, found.known, fits={((), True): short, ((), False): loose}, may_cut=may_cut)
        if cut:
            with pytest.raises(RunsBend):
                hypothesis_fits.fit_null(again)
        else:
            hypothesis_fits.fit_null(again)


@pytest.mark.slow
def test_trials_are_cut_where_runs_without_forces_lose_the_heading(monkeypatch: pytest.MonkeyPatch) -> None:
    """A craft that holds no course was followed with forces in whole runs, and a lever arm named that is not there."""
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings())
    found = Search(problem, noise_prior(problem))
    plain = hypothesis_fits.fit_once(found, (), False, problem.start, first_sizes(problem, found.known))
    assert plain is not None
    monkeypatch.setattr(hypothesis_fits, "fit_once", lambda *_, **__: plain)
    monkeypatch.setattr(hypothesis_fits, "follows", lambda *_: True)
    monkeypatch.setattr(hypothesis_fits, "fit_again", lambda *_, **__: None)
    sections = problem.in_sections(2)
    for at, may_cut, lost, cut in (
        (problem, False, True, False), (problem, True, False, False), (problem, True, True, True),
        (sections, True, True, False),  # that forces hold: whole runs would go further astray
    ):  # fmt: skip
        monkeypatch.setattr(hypothesis_fits, "loses_heading", lambda *_: lost)  # noqa: B023
        again = Search(at, found.known, fits={((), True): plain, ((), False): plain}, may_cut=may_cut)
        if cut:
            with pytest.raises(RunsBend):
                hypothesis_fits.fit_null(again)
        else:
            hypothesis_fits.fit_null(again)
