"""Whether fits follow the trials."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import seatruth.sample
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.followed import follows, loses_heading
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import first_sizes, noise_prior
from seatruth.effects import load_effects


def test_a_fit_that_takes_the_motion_for_noise_does_not_follow_it() -> None:
    """Of a catamaran that holds no course, a fit came to its end with a noise of 24 deg in heading."""
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings())
    first = first_sizes(problem, noise_prior(problem))
    assert follows(problem, first, first)
    motion = [np.sqrt(np.mean([np.nanvar(t.outputs[name]) for t in problem.trials])) for name in problem.outputs]
    large = np.maximum(np.log(0.3 * np.array(motion)), first.white + np.log(4.0))
    heading = problem.outputs.index("psi")
    order = [c for c in range(len(large)) if c != heading]
    for missed in range(1, len(large)):
        white = np.where(np.isin(np.arange(len(large)), order[:missed]), large, first.white)
        followed = follows(problem, replace(first, white=white), first)
        assert followed == (2 * missed < len(large))
    # A heading that is missed by 15 deg is not followed, though it turns on for several radians.
    assert motion[heading] > 1.0
    for noise, said in ((0.2, True), (0.27, False)):
        white = np.where(np.arange(len(large)) == heading, np.log(noise), first.white)
        assert follows(problem, replace(first, white=white, shape=(0,) * len(large)), first) == said
    # In sections it is the heading that counts.
    cut = SimpleNamespace(
        settings=Settings(sections=2), outputs=problem.outputs, trials=problem.trials, model=problem.model
    )
    for channels, said in ((order, True), ([*order, heading], False)):
        white = np.where(np.isin(np.arange(len(large)), channels), large, first.white)
        assert follows(cast(Any, cut), replace(first, white=white), first) == said
    # What the record itself shows as white noise is noise, however large beside the motion.
    assert follows(problem, replace(first, white=large), replace(first, white=large))


def test_a_record_without_a_sample_says_nothing_of_the_motion(recwarn: pytest.WarningsRecorder) -> None:
    """A section of an AUV's trial lay between two fixes: numpy warned, and its positions were never missed."""
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings())
    first = first_sizes(problem, noise_prior(problem))
    empty = SimpleNamespace(outputs={name: np.full(5, np.nan) for name in ("x", "y")})
    cut: Any = SimpleNamespace(
        settings=problem.settings, outputs=problem.outputs, trials=[*problem.trials, empty], model=problem.model
    )
    for white in (first.white, first.white + 20.0):
        fitted = replace(first, white=white)
        assert follows(cut, fitted, first) == follows(problem, fitted, first) == (white is first.white)
    assert not recwarn.list


def test_runs_lose_a_heading_that_they_miss_by_more_than_a_radian() -> None:
    """However far other channels are missed: positions in metres are no angles."""
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings())
    heading = problem.outputs.index("psi")
    for radians, metres, lost in ((0.9, 50.0, False), (1.1, 0.1, True)):
        errors = np.where(problem.channel_of == heading, radians, metres)
        seen = SimpleNamespace(
            errors=lambda _, errors=errors: errors, model=problem.model, channel_of=problem.channel_of
        )
        fit = SimpleNamespace(point=problem.start)
        assert loses_heading(cast(Any, seen), cast(Fit, fit)) == lost


def test_an_angle_that_no_trial_recorded_is_not_lost(recwarn: pytest.WarningsRecorder) -> None:
    study = seatruth.sample.load("diagnose.toml")
    problem = Problem(study, load_effects(["current"]), Settings())
    heading = problem.outputs.index("psi")
    rows = problem.channel_of != heading
    seen = SimpleNamespace(
        errors=lambda _: np.full(int(rows.sum()), 50.0), model=problem.model, channel_of=problem.channel_of[rows]
    )
    assert not loses_heading(cast(Any, seen), cast(Fit, SimpleNamespace(point=problem.start)))
    assert not recwarn.list
