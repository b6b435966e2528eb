"""A whole diagnosis: the same again, resumed, interrupted, and of studies that are not as they should be."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth import BadInput, BlackBox, Channel, Diagnosis, Parameter, Prior, Study, Trial, Trials
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.results import NAME
from seatruth.effects import load_effects
from seatruth.progress import ProgressEvent
from seatruth.storage.checkpoint import StaleCheckpoint

pytestmark = pytest.mark.slow


def diagnosed(folder: Path, runs: list[Trial], *, suggest: bool = False, **options: Any) -> Diagnosis:
    """The diagnosis, without the next trial unless it is asked for: that takes most of the time."""
    return diagnose(small.study(folder, runs), small.EFFECTS, threads=1, suggest=suggest, **options)


def codes(found: Diagnosis) -> set[str]:
    return {finding.code for finding in found.findings}


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
    whole = saved(diagnosed(ship_folder, offset_runs, suggest=True), tmp_path / "whole")
    store = tmp_path / "fits"
    for stop in (2, 4):

        def kill(event: ProgressEvent, stop: int = stop) -> None:
            if event.stage == "Hypotheses" and event.done >= stop:
                raise Killed

        with pytest.raises(Killed):
            diagnosed(ship_folder, offset_runs, checkpoint=store, progress=kill)
    resumed = diagnosed(ship_folder, offset_runs, checkpoint=store, suggest=True)
    assert resumed.outcome["resumed"] > 0
    again = saved(resumed, tmp_path / "again")
    assert json.dumps(fixed(again)) == json.dumps(fixed(whole))
    finished = diagnosed(ship_folder, offset_runs, checkpoint=store, suggest=True)
    assert json.dumps(fixed(saved(finished, tmp_path / "finished"))) == json.dumps(fixed(whole))


def test_a_checkpoint_of_other_work_is_refused(
    ship_folder: Path, offset_runs: list[Trial], plain_runs: list[Trial], tmp_path: Path
) -> None:
    options: dict[str, Any] = {"checkpoint": tmp_path / "fits", "validate": False}
    diagnosed(ship_folder, offset_runs, **options)
    with pytest.raises(StaleCheckpoint):
        diagnosed(ship_folder, plain_runs, **options)


def test_an_interrupt_gives_what_there_is(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(event: ProgressEvent) -> None:
        if event.done == 2:
            raise KeyboardInterrupt

    found = diagnosed(ship_folder, offset_runs, progress=stop)
    assert found.outcome["code"] == "interrupted"
    assert found.validation is None
    assert found.next_trial is None
    assert found.verdict.sentence


def test_an_interrupt_of_a_later_stage_keeps_the_verdict(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(event: ProgressEvent) -> None:
        if event.stage == "Trials left out":
            raise KeyboardInterrupt

    found = diagnosed(ship_folder, offset_runs, progress=stop, suggest=True)
    assert found.outcome["code"] == "interrupted"
    assert found.named == ("rudder_offset",)
    assert found.validation is None


def test_an_interrupt_before_anything_is_known_is_one(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(event: ProgressEvent) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diagnosed(ship_folder, offset_runs, progress=stop)


def test_progress_never_counts_beyond_its_total(ship_folder: Path, offset_runs: list[Trial]) -> None:
    events: list[ProgressEvent] = []
    diagnosed(ship_folder, offset_runs, progress=events.append)
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
    found = diagnosed(ship_folder, plain_runs)
    assert found.verdict.kind in ("no_gap", "underpowered")
    assert found.named == ()


@pytest.mark.slow
def test_when_nothing_acts_nothing_is_named(ship_folder: Path) -> None:
    kinds = []
    for seed in range(20):
        found = diagnosed(ship_folder, small.trials(ship_folder, seed=seed))
        kinds.append(found.verdict.kind)
    assert sum(kind in ("effects", "inseparable") for kind in kinds) <= 1


@pytest.mark.slow
def test_the_effect_that_acts_is_named(ship_folder: Path) -> None:
    found = diagnosed(ship_folder, small.trials(ship_folder, {"gyro_bias_b": 0.003}, specs=["gyro_bias"]))
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
    found = diagnosed(ship_folder, shaken(ship_folder, plain_runs))
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
    assert "one-course" in codes(found)
    assert found.verdict.kind in ("inseparable", "effects"), str(found)
    if seed == 1:
        assert set(found.verdict.members) == {"current", "heading_bias"}


# Studies that are not as they should be


def test_one_trial_alone(ship_folder: Path, offset_runs: list[Trial]) -> None:
    found = diagnosed(ship_folder, offset_runs[:1])
    assert "one-trial" in codes(found)
    assert found.validation is None
    assert found.verdict.sentence


def test_trials_without_excitation(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """The rudder is never moved: no cause can be named."""
    rng = np.random.default_rng(1)
    t = plain_runs[0].t
    still = [
        Trial(
            f"still {k}",
            t,
            {"delta": np.zeros(t.size)},
            {name: sd * rng.normal(size=t.size) for name, sd in small.NOISE.items()},
            synthetic=True,
        )
        for k in range(3)
    ]
    found = diagnosed(ship_folder, still)
    assert found.verdict.kind in ("no_gap", "underpowered")
    assert found.effect("rudder_gain").detectable["k"] > 1.0


def test_a_channel_that_no_trial_recorded(ship_folder: Path, offset_runs: list[Trial]) -> None:
    bare = [dataclasses.replace(trial, outputs={"r": trial.outputs["r"]}) for trial in offset_runs]
    found = diagnosed(ship_folder, bare)
    assert set(found.gap["channel"]) == {"r"}
    assert "rudder_offset" in (*found.named, *found.verdict.members)


def test_channels_with_gaps(ship_folder: Path, offset_runs: list[Trial]) -> None:
    holes = []
    for trial in offset_runs:
        psi = np.asarray(trial.outputs["psi"]).copy()
        psi[30:60] = math.nan
        holes.append(dataclasses.replace(trial, outputs={**trial.outputs, "psi": psi}))
    found = diagnosed(ship_folder, holes)
    assert found.named == ("rudder_offset",)
    assert set(found.gap[found.gap["channel"] == "psi"]["n"]) == {len(offset_runs[0]) - 30}


@pytest.mark.slow
def test_the_same_data_twice(ship_folder: Path, offset_runs: list[Trial]) -> None:
    found = diagnosed(ship_folder, [*offset_runs, dataclasses.replace(offset_runs[0], name="copy")])
    assert any("copy" in f.message or "same" in f.message for f in found.findings if f.severity == "error")


def test_a_rate_with_the_wrong_sign_or_unit_is_a_finding(ship_folder: Path, offset_runs: list[Trial]) -> None:
    wrong = [dataclasses.replace(t, outputs={**t.outputs, "r": -t.outputs["r"]}) for t in offset_runs[:2]]
    assert "psi-r-sign" in codes(diagnosed(ship_folder, wrong, validate=False))
    degrees = [dataclasses.replace(t, outputs={**t.outputs, "r": np.rad2deg(t.outputs["r"])}) for t in offset_runs[:2]]
    found = diagnosed(ship_folder, degrees, validate=False)
    assert any("deg/s" in str(finding) for finding in found.findings)


def test_a_simulation_that_is_unstable(offset_runs: list[Trial], tmp_path: Path) -> None:
    """A model that runs away whatever its coefficients."""
    grows = small.SHIP.replace("(p.K * i.delta - s.r) / p.T", "p.K * i.delta + 40.0 * (s.r + 0.01) * (1.0 + s.r * s.r)")
    (tmp_path / "ship.py").write_text(grows)
    with pytest.raises(BadInput, match="diverges"):
        diagnose(small.study(tmp_path, offset_runs), small.EFFECTS, threads=1)


def test_an_unknown_effect(ship_folder: Path, offset_runs: list[Trial]) -> None:
    with pytest.raises(BadInput, match="there is no effect 'curent'"):
        diagnose(small.study(ship_folder, offset_runs), ["curent"], threads=1)


def test_a_trial_of_a_few_samples(ship_folder: Path, offset_runs: list[Trial]) -> None:
    with pytest.raises(BadInput, match="fewer than 10 samples"):
        diagnosed(ship_folder, small.shortened(offset_runs, 9))


def test_a_channel_that_never_changes(ship_folder: Path, offset_runs: list[Trial]) -> None:
    flat = [dataclasses.replace(t, outputs={**t.outputs, "psi": np.zeros(len(t))}) for t in offset_runs[:2]]
    assert diagnosed(ship_folder, flat, validate=False).verdict.sentence


def test_exact_data(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """Trials of the model itself, without noise."""
    study = small.study(ship_folder, plain_runs)
    tables = study.simulate(threads=1)
    exact = [dataclasses.replace(t, outputs={n: tables[t.name][n].to_numpy() for n in t.outputs}) for t in plain_runs]
    found = diagnosed(ship_folder, exact, validate=False)
    assert found.verdict.kind in ("no_gap", "underpowered"), str(found)


def test_nothing_free(ship_folder: Path, offset_runs: list[Trial]) -> None:
    study = small.study(ship_folder, offset_runs)
    held = study.replace(parameters=tuple(p.replace(vary=False, prior=None) for p in study.parameters))
    found = diagnose(held, small.EFFECTS, threads=1, suggest=False)
    assert "no-coefficients" in codes(found)
    assert found.coefficients == ()


def test_a_black_box_gets_the_effects_that_act_from_outside(offset_runs: list[Trial]) -> None:
    def ship(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, np.ndarray]:
        assert first is not None
        t, delta = trial.t, trial.inputs["delta"]
        r, psi = np.empty(t.size), np.empty(t.size)
        r[0], psi[0] = first["r"], first["psi"]
        for k in range(t.size - 1):
            h = float(t[k + 1] - t[k])
            steady, fade = p["K"] * 0.5 * (delta[k] + delta[k + 1]), math.exp(-h / p["T"])
            psi[k + 1] = psi[k] + steady * h + (r[k] - steady) * p["T"] * (1.0 - fade)
            r[k + 1] = steady + (r[k] - steady) * fade
        return {"r": r, "psi": psi}

    motion = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    box = BlackBox(
        "box",
        ship,
        states=motion,
        inputs=(Channel("delta", "rad"),),
        outputs=motion,
        parameters=(
            Parameter("K", 0.1, "1/s", min=0.01, max=1.0, vary=True, prior=Prior(0.1, 0.01)),
            Parameter("T", 10.0, "s", min=1.0, max=100.0, vary=True, prior=Prior(10.0, 1.0)),
        ),
    )
    study = Study(name="box", model=box, trials=Trials(small.shortened(offset_runs[:2], 60)))
    found = diagnose(study, ["rudder_offset", "gyro_bias", "wind"], threads=1, suggest=False)
    assert "wind" in found.unavailable
    assert found.discrepancy is None
    assert "rudder_offset" in (*found.named, *found.verdict.members), str(found)


@pytest.mark.slow
def test_a_user_s_own_effect_takes_part(ship_folder: Path, tmp_path: Path) -> None:
    (tmp_path / "fade.py").write_text(FADE)
    (fade,) = load_effects(["fade.py:Fade"], tmp_path)
    small.folder_with_model(tmp_path)
    runs = small.trials(tmp_path, {"fade_k": 0.5}, specs=["fade.py:Fade"])
    found = diagnose(small.study(ship_folder, runs), [fade, *small.EFFECTS], threads=1, suggest=False)
    assert "fade" in (*found.named, *found.verdict.members), str(found)


FADE = '''
"""A rudder that loses force with its angle."""

from seatruth.effects import Effect
from seatruth.models import Parameter


class Fade(Effect):
    name = "fade"
    title = "rudder that fades with its angle"
    cause = "actuator.steering.gain"
    equation = "delta (1 - k |delta| / 0.35)"
    source = "measured on the slipway"
    needs_inputs = ("delta",)
    acts_on = ("actuator:delta",)
    parameters = (Parameter("k", 0.2, "1", min=-1.0, max=1.0),)
    null = {"k": 0.0}

    @staticmethod
    def true_inputs(i, s, q, e):
        return i._replace(delta=i.delta * (1.0 - q.k * abs(i.delta) / 0.35))
'''
