"""A trial that is unlike the others is told before what it would be taken for."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.odd_trial import odd_trials
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial

EFFECTS = ("rudder_offset", "rudder_gain", "gyro_bias", "rudder_delay")


def turned(trial: Trial, degrees: float) -> Trial:
    """The trial with its rudder recorded so far to port of where it stood."""
    return dataclasses.replace(trial, inputs={"delta": trial.inputs["delta"] - math.radians(degrees)})


@pytest.mark.parametrize("acts", [False, True])
def test_a_trial_with_a_wrong_column_is_named(ship_folder: Path, acts: bool) -> None:
    """Also where something else acts in all of them."""
    specs = ["gyro_bias"] if acts else []
    runs = small.trials(ship_folder, {"gyro_bias_b": math.radians(0.3)} if acts else None, specs=specs)
    runs[0] = turned(runs[0], 3.0)
    (finding,) = odd_trials(search(small.problem(ship_folder, runs, EFFECTS), small.silent))
    assert (finding.severity, finding.code, finding.trial) == ("error", "odd-trial", "run_0")
    assert ("with yaw rate bias" in finding.message) == acts


def test_none_is_where_all_share_what_acts(
    ship_folder: Path, offset_runs: list[Trial], plain_runs: list[Trial]
) -> None:
    shared = [turned(run, 3.0) for run in plain_runs]
    for runs in (offset_runs, plain_runs, shared, [*plain_runs[:2], turned(plain_runs[2], 3.0)]):
        assert odd_trials(search(small.problem(ship_folder, runs, EFFECTS), small.silent)) == []


def test_an_interrupt_keeps_what_the_search_reached(
    ship_folder: Path, plain_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = search(small.problem(ship_folder, [turned(plain_runs[0], 3.0), *plain_runs[1:]], EFFECTS), small.silent)

    def interrupted(*_: object) -> bool:
        raise KeyboardInterrupt

    monkeypatch.setattr("seatruth.diagnosis.odd_trial._explained", interrupted)
    told = list[str]()
    assert odd_trials(found, lambda text, done, total: told.append(text)) == []
    assert found.interrupted
    assert told == ["which trial the others do not need", "the others without run_0"]


def test_the_others_may_have_terms_of_their_own(
    ship_folder: Path, plain_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a workboat the humps of the resistance stood at other speeds without its fastest run: all fits were lost."""
    found = search(small.problem(ship_folder, [turned(plain_runs[0], 3.0), *plain_runs[1:]], EFFECTS), small.silent)
    named = found.problem.named
    monkeypatch.setattr(found.problem, "named", lambda point: dict(list(named(point).items())[:2]))
    (finding,) = odd_trials(found)
    assert finding.trial == "run_0"


def test_of_a_trial_that_goes_further_the_form_of_the_model_may_be_another(ship_folder: Path) -> None:
    """A rudder that fades with its angle, which is large in one trial alone."""
    (ship_folder / "fade.py").write_text(small.FADE)
    fading = small.trials(ship_folder, {"fade_k": 0.8}, specs=["fade.py:Fade"])
    little = small.trials(ship_folder)
    runs = [dataclasses.replace(little[3], name=f"run_{k}", t=little[3].t) for k in range(3)]
    rng = np.random.default_rng(5)
    runs = [
        dataclasses.replace(
            run, outputs={n: y + small.NOISE[n] * 0.1 * rng.normal(size=y.size) for n, y in run.outputs.items()}
        )
        for run in runs
    ]
    runs.append(dataclasses.replace(fading[1], name="run_3"))
    (finding,) = odd_trials(search(small.problem(ship_folder, runs, EFFECTS), small.silent))
    assert (finding.severity, finding.code) == ("warning", "odd-trial")
    assert "goes further than the others in delta" in finding.message
