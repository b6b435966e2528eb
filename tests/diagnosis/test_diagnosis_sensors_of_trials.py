"""A sensor that is off in one trial alone: its log was switched on anew."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis.assembly import Assembly
from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial

OFF = math.radians(0.5)
EFFECTS = (*small.EFFECTS, "trial_gyro_bias")


@pytest.fixture(scope="module")
def runs(ship_folder: Path) -> list[Trial]:
    """The rudder is off in all trials, the gyro in the third."""
    found = small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=["rudder_offset"])
    found[2] = dataclasses.replace(found[2], outputs={**found[2].outputs, "r": found[2].outputs["r"] + OFF})
    return found


def test_an_offset_in_one_trial_is_named_with_that_trial_beside_what_acts_in_all(
    ship_folder: Path, runs: list[Trial]
) -> None:
    found = diagnose(small.study(ship_folder, runs), EFFECTS, threads=1, suggest=False)
    named = {effect for cause in found.verdict.causes for effect in cause.effects}
    assert named == {"rudder_offset", "trial_gyro_bias"}
    own = next(effect for effect in found.effects if effect.name == "trial_gyro_bias").parameters
    for q, true in zip(own, (0.0, 0.0, OFF, 0.0), strict=True):
        assert abs(q.value - true) < 4.0 * q.stderr < 0.2 * OFF
    assert "deg/s in 'run_2'" in found.verdict.sentence


def test_an_offset_in_all_trials_stays_one(ship_folder: Path) -> None:
    runs = small.trials(ship_folder, {"gyro_bias_b": OFF}, specs=["gyro_bias"])
    found = diagnose(small.study(ship_folder, runs), EFFECTS, threads=1, suggest=False, validate=False)
    assert [cause.effects[0] for cause in found.verdict.causes] == ["gyro_bias"]


def test_a_gyro_that_may_differ_from_trial_to_trial_keeps_its_name(ship_folder: Path, runs: list[Trial]) -> None:
    """The node of the tree above both is "an offset or a scale error of a gyro", which says less."""
    found = search(small.problem(ship_folder, runs, EFFECTS), small.silent)
    assembly = Assembly(found.problem.study, found, 1)
    both = Cluster(("trial_gyro_bias", "gyro_bias"), "sensor.bias_or_scale.rate", 0.9, ("trial_gyro_bias",))
    assert assembly._named(both).title == "yaw rate bias"
    other = Cluster(("trial_gyro_bias", "rudder_offset"), "", 0.9, ("trial_gyro_bias",))
    assert assembly._named(other).title == "one of several causes"
