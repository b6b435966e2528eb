"""A whole diagnosis: the same again, resumed, interrupted; and what it says of what acts."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import boat_case as boat
import numpy as np
import pytest
import small_case as small

import seatruth.sample
from seatruth import Diagnosis, Trial
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.results import NAME
from seatruth.errors import BadInput
from seatruth.progress import ProgressEvent
from seatruth.storage.checkpoint import StaleCheckpoint

pytestmark = pytest.mark.slow


def fixed(text: str) -> dict[str, Any]:
    """diagnosis.json without times, the checksum over them, and what a resumed run says of itself."""
    content: dict[str, Any] = json.loads(text)
    del content["checksum"]
    del content["provenance"]["time_utc"]
    for name in ("wall_s", "cpu_s", "resumed"):
        del content["outcome"][name]
    return content


def saved(found: Diagnosis, place: Path) -> str:
    return (found.save(place) / NAME).read_text()


class Killed(Exception):
    """Ends a run from its progress callback, as a kill would."""


def test_a_killed_run_goes_on_and_ends_with_the_same_bytes(
    ship_folder: Path, offset_runs: list[Trial], tmp_path: Path
) -> None:
    whole = saved(small.diagnosed(ship_folder, offset_runs, suggest=True), tmp_path / "whole")
    store = tmp_path / "fits"
    for stop in (2, 4):

        def kill(event: ProgressEvent, stop: int = stop) -> None:
            if event.stage == "Hypotheses" and event.done >= stop:
                raise Killed

        with pytest.raises(Killed):
            small.diagnosed(ship_folder, offset_runs, checkpoint=store, progress=kill)
    resumed = small.diagnosed(ship_folder, offset_runs, checkpoint=store, suggest=True)
    assert resumed.outcome["resumed"] > 0
    again = saved(resumed, tmp_path / "again")
    assert json.dumps(fixed(again)) == json.dumps(fixed(whole))
    finished = small.diagnosed(ship_folder, offset_runs, checkpoint=store, suggest=True)
    assert json.dumps(fixed(saved(finished, tmp_path / "finished"))) == json.dumps(fixed(whole))


def test_a_checkpoint_of_other_work_is_refused(
    ship_folder: Path, offset_runs: list[Trial], plain_runs: list[Trial], tmp_path: Path
) -> None:
    options: dict[str, Any] = {"checkpoint": tmp_path / "fits", "validate": False}
    small.diagnosed(ship_folder, offset_runs, **options)
    with pytest.raises(StaleCheckpoint):
        small.diagnosed(ship_folder, plain_runs, **options)


def test_an_interrupt_gives_what_there_is(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(event: ProgressEvent) -> None:
        if event.done == 2:
            raise KeyboardInterrupt

    found = small.diagnosed(ship_folder, offset_runs, progress=stop)
    assert found.outcome["code"] == "interrupted"
    # What is named was predicted on trials left out before it was named.
    assert found.named == ("rudder_offset",)
    assert found.validation is not None
    assert found.next_trial is None
    assert found.verdict.sentence


def test_an_interrupt_of_a_later_stage_keeps_the_verdict(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(event: ProgressEvent) -> None:
        if event.stage == "Trials left out":
            raise KeyboardInterrupt

    found = small.diagnosed(ship_folder, offset_runs, progress=stop, suggest=True)
    assert found.outcome["code"] == "interrupted"
    assert found.named == ("rudder_offset",)
    assert found.validation is not None
    assert found.next_trial is None


def test_an_interrupt_before_anything_is_known_is_one(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(event: ProgressEvent) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        small.diagnosed(ship_folder, offset_runs, progress=stop)


def test_progress_never_counts_beyond_its_total(ship_folder: Path, offset_runs: list[Trial]) -> None:
    events: list[ProgressEvent] = []
    small.diagnosed(ship_folder, offset_runs, progress=events.append)
    assert {"Hypotheses", "Trials left out"} <= {event.stage for event in events}
    assert all(event.total is not None and event.done <= event.total for event in events)


@pytest.mark.slow
def test_threads_change_nothing(ship_folder: Path, offset_runs: list[Trial], tmp_path: Path) -> None:
    study = small.study(ship_folder, offset_runs)
    one, two = (saved(diagnose(study, small.EFFECTS, threads=n), tmp_path / str(n)) for n in (1, 2))
    assert json.dumps(fixed(one)) == json.dumps(fixed(two))


SCRIPT = """
import sys
from seatruth import load_study
from seatruth.diagnosis.pipeline import diagnose
diagnose(load_study("study.toml"), {effects!r}, threads=1).save(sys.argv[1])
"""


@pytest.mark.slow
def test_the_order_of_hashes_changes_nothing(tmp_path: Path) -> None:
    small.files(
        small.folder_with_model(tmp_path), small.trials(tmp_path, {"rudder_gain_k": 0.7}, specs=["rudder_gain"])
    )
    texts = []
    for seed in ("0", "1"):
        subprocess.run(
            [sys.executable, "-c", SCRIPT.format(effects=small.EFFECTS), seed],
            cwd=tmp_path,
            env={**os.environ, "PYTHONHASHSEED": seed},
            check=True,
            timeout=200,
        )
        texts.append((tmp_path / seed / NAME).read_text())
    assert json.dumps(fixed(texts[0])) == json.dumps(fixed(texts[1]))


# What the trials say


@pytest.mark.slow
def test_nothing_acts(ship_folder: Path, plain_runs: list[Trial]) -> None:
    found = small.diagnosed(ship_folder, plain_runs)
    assert found.verdict.kind in ("no_gap", "underpowered")
    assert found.named == ()


@pytest.mark.slow
def test_when_nothing_acts_nothing_is_named(ship_folder: Path) -> None:
    kinds = []
    for seed in range(20):
        found = small.diagnosed(ship_folder, small.trials(ship_folder, seed=seed))
        kinds.append(found.verdict.kind)
    assert sum(kind in ("effects", "inseparable") for kind in kinds) <= 1


@pytest.mark.slow
def test_the_effect_that_acts_is_named(ship_folder: Path) -> None:
    found = small.diagnosed(ship_folder, small.trials(ship_folder, {"gyro_bias_b": 0.003}, specs=["gyro_bias"]))
    assert found.named == ("gyro_bias",), str(found)


def shaken(folder: Path, runs: list[Trial]) -> list[Trial]:
    """The trials under a yaw moment that changes with time in a way of its own in each: outside the library."""
    rng = np.random.default_rng(8)
    found = []
    for trial in runs:
        t = np.asarray(trial.t)
        moment = 4e-3 * np.sin(2 * math.pi * t / rng.uniform(40, 70) + rng.uniform(0, 6))
        K, T = small.TRUE["K"], small.TRUE["T"]
        r, psi = np.zeros(t.size), np.zeros(t.size)
        for k in range(t.size - 1):
            steps = 20
            x, heading = r[k], psi[k]
            for _ in range(steps):
                rate = (K * trial.inputs["delta"][k] - x) / T + moment[k]
                heading += x / steps
                x += rate / steps
            r[k + 1], psi[k + 1] = x, heading
        outputs = {"r": r + small.NOISE["r"] * rng.normal(size=t.size)}
        outputs["psi"] = psi + small.NOISE["psi"] * rng.normal(size=t.size)
        found.append(dataclasses.replace(trial, outputs=outputs))
    return found


def test_a_cause_outside_the_library_is_unknown(ship_folder: Path, plain_runs: list[Trial]) -> None:
    found = small.diagnosed(ship_folder, shaken(ship_folder, plain_runs))
    assert found.verdict.kind == "unknown", str(found)
    assert found.named == ()
    assert found.discrepancy is not None
    assert found.discrepancy.log_evidence > 20.0


@pytest.mark.parametrize("seed", [1, pytest.param(4, marks=pytest.mark.slow)])
def test_look_alikes_are_named_by_what_they_have_in_common(seed: int) -> None:
    """A current and a compass that is off, on one course, weak, and without speeds over ground."""
    model = boat.Boat()
    runs = boat.trials(
        model, [{"delta": np.zeros(80)}] * 3, headings=(0.0, 0.02, -0.02),
        effects={"current_east": 0.02}, specs=["current"], seed=seed,
    )  # fmt: skip
    bare = [dataclasses.replace(t, outputs={n: t.outputs[n] for n in ("r", "psi", "x", "y")}) for t in runs]
    found = diagnose(boat.study(model, bare), ["current", "heading_bias"], threads=1, suggest=False)
    assert "one-course" in small.codes(found)
    assert found.verdict.kind in ("inseparable", "effects"), str(found)
    if seed == 1:
        assert set(found.verdict.members) == {"current", "heading_bias"}


def test_a_sway_with_its_sign_turned_round_stands_beside_the_verdict() -> None:
    sample = seatruth.sample.load("diagnose.toml")
    turned = [replace(one, outputs={**one.outputs, "v": -one.outputs["v"]}) for one in sample.trials[:2]]
    found = diagnose(sample.replace(trials=turned), ["current"], validate=False, suggest=False)
    said = {(one.code, one.channel) for one in found.findings}
    assert said & {("sway-sign", "v"), ("position-axes", "v")}
    right = diagnose(sample.replace(trials=sample.trials[:2]), ["current"], validate=False, suggest=False)
    assert not {one.code for one in right.findings} & {"sway-sign", "position-axes"}


def test_a_diagnosis_of_a_boat_with_half_its_speed_says_so() -> None:
    """Its speed is a coefficient: no effect is needed, and none is named."""
    slow = boat.Boat()
    runs = boat.trials(slow, [{"delta": boat.zigzag(40, 0.1, 8.0)}] * 2, headings=(0.0, 2.0), effects={"U": 1.0})
    found = diagnose(boat.study(slow, runs), ["current"], validate=False, suggest=False)
    (far,) = [one for one in found.findings if one.code == "coefficient-far"]
    assert far.where == "parameter 'U'"
    assert np.isclose(next(one.value for one in found.coefficients if one.name == "U"), 1.0, atol=0.05)


def test_a_scale_error_of_the_gyro_is_told_from_its_bias_and_from_the_rudder(ship_folder: Path) -> None:
    effects = (*small.EFFECTS, "gyro_scale")
    runs = small.trials(ship_folder, {"gyro_scale_k": 0.08}, specs=effects)
    found = diagnose(small.study(ship_folder, runs), effects, threads=1, suggest=False)
    assert (found.verdict.kind, found.named) == ("effects", ("gyro_scale",)), str(found)
    (q,) = found.effect("gyro_scale").parameters
    assert abs(q.value - 0.08) < 3.0 * q.stderr < 0.03


def test_a_fault_beside_the_search_costs_that_part_alone(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A comparison of trials raised a KeyError after eight minutes of fits, and nothing was kept."""

    def broken(*_: Any) -> Any:
        raise KeyError("term_u_hump_3")

    monkeypatch.setattr("seatruth.diagnosis.pipeline.odd_trials", broken)
    found = small.diagnosed(ship_folder, offset_runs)
    (finding,) = [one for one in found.findings if one.code == "part-missing"]
    assert "a fault in seatruth (KeyError: 'term_u_hump_3')" in finding.message
    assert "report it" in finding.do
    assert found.verdict.sentence
    monkeypatch.setenv("SEATRUTH_DEBUG", "1")
    with pytest.raises(KeyError):
        small.diagnosed(ship_folder, offset_runs)

    def refused(*_: Any) -> Any:
        raise BadInput("the trials need 9 GB")

    monkeypatch.delenv("SEATRUTH_DEBUG")
    monkeypatch.setattr("seatruth.diagnosis.pipeline.odd_trials", refused)
    with pytest.raises(BadInput, match="9 GB"):
        small.diagnosed(ship_folder, offset_runs)
