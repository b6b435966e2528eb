"""The sign of a stern plane, from pitch zigzags of the built-in models."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.manoeuvres import PitchZigzag, add_noise, run_manoeuvre
from seatruth.models import load_model
from seatruth.trials import Channel, Trial
from seatruth.trials.check.planes import check_planes

NOISE = {"q": math.radians(0.2), "theta": math.radians(0.2)}


def _zigzag(use: str, first: dict[str, float], **more: Any) -> Trial:
    plan = PitchZigzag(math.radians(5), math.radians(5))
    trial = run_manoeuvre(load_model(use), plan, dt=0.2, first_state=first, rudder_rate=math.radians(20), **more)
    return add_noise(trial, NOISE, np.random.default_rng(1))


TRIALS = {
    "diving_plane": _zigzag("diving_plane", {"u": 1.47, "z": 100.0}, limit=150.0),
    "torpedo": _zigzag("torpedo", {"u": 1.542}, limit=60.0, inputs={"n": 15.0}),
}


def _codes(trial: Trial, without: tuple[str, ...] = (), turn: Callable[[Array], Array] = np.positive) -> list[str]:
    outputs = {name: values for name, values in trial.outputs.items() if name not in without}
    turned = replace(trial, inputs={**trial.inputs, "delta_s": turn(trial.inputs["delta_s"])}, outputs=outputs)
    return [finding.code for finding in check_planes([turned])]


@pytest.mark.parametrize("use", TRIALS)
@pytest.mark.parametrize("without", [(), ("q",), ("theta",)])
def test_a_plane_that_is_turned_round_is_found_and_a_right_one_is_not(use: str, without: tuple[str, ...]) -> None:
    assert _codes(TRIALS[use], without) == []
    assert _codes(TRIALS[use], without, np.negative) == ["plane-sign"]


def test_a_model_whose_planes_pitch_the_nose_up_is_left_alone() -> None:
    trial = TRIALS["diving_plane"]
    turned = replace(trial, inputs={"delta_s": -trial.inputs["delta_s"]})

    class Own:
        inputs = (Channel("delta_s", "rad", "planes, positive pitches the nose up"),)
        outputs = ()

    assert list(check_planes([turned], Own())) == []
    (said,) = check_planes([turned])
    assert "pitches the nose up: after" in said.message


def test_a_plane_that_follows_the_pitch_or_hardly_moves_says_nothing() -> None:
    trial = TRIALS["diving_plane"]
    assert _codes(replace(trial, inputs={"delta_s": 2.0 * trial.outputs["q"]})) == []
    assert _codes(trial, (), lambda plane: -0.001 * plane) == []
    assert _codes(trial, ("q", "theta"), np.negative) == []


def test_an_autopilot_that_hardly_moves_the_plane_is_not_asked_beside_a_zigzag() -> None:
    """In a straight run through waves the plane went with the pitch that it was to stop; the other trials are right."""
    zigzag = TRIALS["diving_plane"]
    small = replace(
        zigzag,
        name="straight",
        inputs={"delta_s": -0.2 * zigzag.inputs["delta_s"]},
        outputs={name: 0.2 * values for name, values in zigzag.outputs.items() if name in ("q", "theta")},
    )
    assert [finding.code for finding in check_planes([small])] == ["plane-sign"]
    assert list(check_planes([zigzag, small])) == []
