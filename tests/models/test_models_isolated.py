"""A black box in processes of its own: a failure is NaN and is counted, and no run is made twice."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth import simulator
from seatruth.errors import BadInput, PluginError
from seatruth.models import BlackBox, Channel, IsolatedBlackBox, Parameter
from seatruth.models.isolated import failures_of
from seatruth.storage.cache_folder import CACHE
from seatruth.trials import Trial

TRIAL = Trial("run", np.arange(4.0), {"delta": np.ones(4)}, {"psi": np.zeros(4)})


def ramp(trial: Trial, p: dict[str, float], first: Any) -> dict[str, Any]:
    if p["K"] > 5.0:
        os.abort()
    if p["K"] > 4.0:
        time.sleep(60.0)
    if p["K"] > 3.0:
        return {"psi": trial.t * np.nan}
    return {"psi": p["K"] * trial.inputs["delta"] * trial.t}


def box(**options: Any) -> IsolatedBlackBox:
    plain = BlackBox(
        "ramp",
        ramp,
        inputs=[Channel("delta", "rad")],
        outputs=[Channel("psi", "rad")],
        parameters=[Parameter("K", 1.0, "1/s", min=0.0, max=10.0)],
    )
    return IsolatedBlackBox(plain, **{"time_limit": 2.0, **options})


@pytest.mark.slow
def test_a_crash_a_hang_and_nan_cost_one_run_each() -> None:
    model = box(time_limit=1.0)
    sim = simulator(model, [TRIAL], free=("K",), threads=2)
    found = sim.outputs(np.array([[1.0], [6.0], [4.5], [3.5], [2.0]]), sim.initial_states)
    assert found.diverged[:, 0].tolist() == [False, True, True, True, False]
    assert found.y[4, :, 0].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert model.counts.simulated == 5
    assert model.counts.failures.total() == 2
    said = failures_of(model)
    assert "2 of 5 runs" in said
    assert "took longer than 1 s" in said
    assert "SIGABRT" in said
    model.stop()


def test_no_run_is_made_twice() -> None:
    model = box()
    first = model.run(TRIAL, {"K": 2.0}, None)
    first[:] = 7.0  # what a caller does with it is the caller's business
    assert model.run(TRIAL, {"K": 2.0}, None)[:, 0].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert (model.counts.simulated, model.counts.kept) == (1, 1)
    other = Trial("run", TRIAL.t, {"delta": 2.0 * np.ones(4)}, TRIAL.outputs)
    assert model.run(other, {"K": 2.0}, None)[1, 0] == 4.0
    model.stop()


def test_an_identity_keeps_runs_on_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE, str(tmp_path / "cache"))
    model = box(identity=f"ramp 1 {tmp_path}")
    model.run(TRIAL, {"K": 2.0}, None)
    assert len(list((tmp_path / "cache").glob("runs/*/*.run"))) == 1
    box(identity=f"ramp 2 {tmp_path}").run(TRIAL, {"K": 2.0}, None)  # another version of it
    assert len(list((tmp_path / "cache").glob("runs/*/*.run"))) == 2
    model.stop()


def test_a_simulator_that_never_runs_is_said_at_once() -> None:
    model = box()
    sim = simulator(model, [TRIAL], free=("K",), threads=1)
    with pytest.raises(PluginError, match=r"failed in each of its first 1 runs.*SIGABRT"):
        sim.outputs(np.array([[6.0]]), sim.initial_states)
    model.stop()


@pytest.mark.parametrize("limit", [0.0, float("nan"), float("inf")])
def test_a_time_limit_that_is_none_is_refused(limit: float) -> None:
    with pytest.raises(BadInput, match="no time limit"):
        box(time_limit=limit)


def test_derivatives_do_not_trust_digits_that_are_noise() -> None:
    def noisy(trial: Trial, p: dict[str, float], first: Any) -> dict[str, Any]:
        wave = np.sin(1e9 * p["K"] + np.arange(len(trial)) ** 2)  # as of a step control: 1e-6 of the outputs
        return {"psi": trial.t * p["K"] ** 2 + 3e-6 * wave}

    plain = BlackBox(
        "noisy",
        noisy,
        inputs=[],
        outputs=[Channel("psi", "rad")],
        parameters=[Parameter("K", 1.0, "1/s")],
    )
    model = IsolatedBlackBox(plain, time_limit=20.0)
    sim = simulator(model, [TRIAL], free=("K",), threads=1)
    slope = sim.jacobian(np.ones(1), sim.initial_states).dy[:, 0, 0]
    assert slope == pytest.approx(2.0 * TRIAL.t, rel=0.02, abs=0.1)
    model.stop()
