"""The experiment on Zhao and others 2018: its guidance, sensors and preparation, and what its quick version finds."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import common  # noqa: E402
import zhao2018  # noqa: E402
import zhao2018_channels as system  # noqa: E402
import zhao2018_runs as runs  # noqa: E402
import zhao2018_sensors as sensors  # noqa: E402

from seatruth.models.torpedo_channels import FREE  # noqa: E402


def prepared(run: str, seed: int = 4) -> Any:
    return sensors.prepared(sensors.logged(runs.truth(run), "T1", np.random.default_rng(seed)), fused=False)


def errors(ready: Any, run: str, name: str) -> Any:
    true = runs.truth(run)
    return ready.outputs[name] - np.interp(ready.t, true.t, true.outputs[name])


def test_the_weave_drives_the_rudder_to_its_limit_and_the_planes_not() -> None:
    found = runs.saturation(runs.truth("weave"))
    assert found["rudder at its limit, %"] > 15
    assert found["planes at their limit, %"] < 1
    assert abs(found["largest depth, m"]) < 0.5


def test_fins_keep_their_limits_and_rates() -> None:
    for name in ("weave", "planes", "mixed 1"):
        trial = runs.truth(name)
        for fin in ("delta", "delta_s"):
            assert np.abs(trial.inputs[fin]).max() <= runs.LIMIT + 1e-12
            rate = np.abs(np.diff(trial.inputs[fin])) / runs.STEP
            assert rate.max() <= math.radians(runs.T1.rate) + 1e-9


def test_preparation_brings_the_log_to_the_origin_in_si() -> None:
    """Axes, units, signs and lever arms: what is left of each channel is less than its raw noise, and no outlier."""
    ready = prepared("mixed 1")
    assert len(ready) == 1201
    for name in ("u", "v", "w", "p", "q", "r", "phi", "theta", "psi"):
        left = errors(ready, "mixed 1", name)
        inside = left[5:-5]
        assert np.sqrt(np.mean(inside**2)) == pytest.approx(0.7 * sensors.NOISE[name], rel=0.15), name
        assert np.abs(inside).max() < 5 * sensors.NOISE[name], name
        assert abs(np.mean(inside)) < 0.15 * sensors.NOISE[name], name
    for fin in ("delta", "delta_s"):
        true = runs.truth("mixed 1")
        assert np.abs(ready.inputs[fin] - np.interp(ready.t, true.t, true.inputs[fin])).max() < math.radians(2.5)


def test_the_log_is_not_what_the_model_takes() -> None:
    true = runs.truth("mixed 1")
    log = sensors.logged(true, "T1", np.random.default_rng(1))
    r = log.outputs["r"][sensors.IDLE :] * sensors.DEGREE
    assert np.corrcoef(r, true.outputs["r"])[0, 1] < -0.9
    assert log.inputs["n"].max() == pytest.approx(1525)
    assert np.isnan(log.outputs["z_x"]).mean() > 0.9


def test_accelerations_are_moved_to_the_origin() -> None:
    true = runs.truth("weave")
    rates = sensors.rates_of(true, "T1")
    expected = rates["v"] + true.outputs["r"] * true.outputs["u"] - true.outputs["p"] * true.outputs["w"]
    ready = prepared("weave")
    left = (ready.outputs["a_y"] - np.interp(ready.t, true.t, expected))[10:-10]
    assert np.sqrt(np.mean(left**2)) < 2.0 * sensors.NOISE["a_y"]


def test_noise_of_the_bound_holds_what_the_raw_samples_hold() -> None:
    assert sensors.bound_noise(("r",))["r"] == pytest.approx(sensors.NOISE["r"] / math.sqrt(2.0))


def test_channel_trial_makes_recorded_motions_inputs() -> None:
    trial = system.channel_trial("roll", prepared("weave"))
    assert set(trial.inputs) == {"delta", "delta_d", "n", "u", "v", "r", "theta", "a_y"}
    assert set(trial.outputs) == {"p", "phi"}


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("zhao2018")
    return run(out).finish(), out


def run(out: Path) -> Any:
    options = common.arguments("zhao2018", "", ["--quick", "--out", str(out), "--workers", "2"])
    results = common.Results("zhao2018", options)
    zhao2018.body(options, results)
    return results


@pytest.mark.slow
def test_quick_mode_meets_every_check_figure(quick: tuple[dict[str, Any], Path]) -> None:
    record, out = quick
    assert record["failures"] == []
    checks = pd.read_csv(out / "checks.csv")
    assert len(checks) > 20
    assert checks.met.all()


@pytest.mark.slow
def test_quick_mode_names_the_degenerate_channel_and_decides(quick: tuple[dict[str, Any], Path]) -> None:
    figures = quick[0]["figures"]
    degenerate = figures["forward channel, four free: called not identifiable"]
    assert degenerate["value"] == 4
    assert "lambda_11" in degenerate["note"]
    said = {c: figures[f"open loop of the {c} channel, tank's values"]["note"] for c in FREE}
    assert "agrees" in said["roll"]
    assert all("needs identification" in said[c] for c in ("forward", "lateral", "longitudinal"))


@pytest.mark.slow
def test_quick_mode_damped_newton_comes_home_and_undamped_not_always(quick: tuple[dict[str, Any], Path]) -> None:
    starts = pd.read_csv(quick[1] / "starts.csv")
    assert starts[starts.way == "damped"].reached.all()
    assert not starts[(starts.way == "undamped") & (starts.channel == "lateral")].reached.all()


@pytest.mark.slow
def test_quick_mode_predicts_runs_that_were_not_fitted(quick: tuple[dict[str, Any], Path]) -> None:
    table = pd.read_csv(quick[1] / "validation.csv").set_index(["run", "values"])
    for name in runs.UNFITTED:
        before, channels, after = (table.loc[(name, way)] for way in ("tank", "channels", "all at once"))
        for key in ("u", "r", "psi", "theta"):
            assert channels[key] < 0.25 * before[key], key
            assert after[key] < 0.25 * before[key], key
            # little above the noise that the measurement itself carries
            assert after[key] < 1.3 * sensors.bound_noise((key,))[key], key


@pytest.mark.slow
def test_quick_mode_stays_near_the_bound(quick: tuple[dict[str, Any], Path]) -> None:
    table = pd.read_csv(quick[1] / "error_over_bound.csv")
    # one seed: the goal of 1.2 over 40 is the full version's to meet
    assert 0.4 < math.sqrt((table["own data"] ** 2).mean()) < 1.7
    assert 0.4 < math.sqrt((table["all at once"] ** 2).mean()) < 1.7


@pytest.mark.slow
def test_quick_mode_leaves_a_complete_result_and_resumes(
    quick: tuple[dict[str, Any], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    record, out = quick
    files = [*record["tables"].values(), *(file for group in record["pictures"].values() for file in group)]
    assert all((out / file).stat().st_size > 0 for file in [*files, "summary.md"])
    text = (out / "result.json").read_text() + (out / "summary.md").read_text()
    assert str(ROOT) not in text
    assert "synthetic" in text
    monkeypatch.setattr(common.Results, "add_picture", lambda self, name, figure: plt.close(figure))
    again = run(out).finish()
    assert all(stage["resumed"] for stage in again["stages"].values())
    assert again["figures"] == record["figures"] == json.loads((out / "result.json").read_text())["figures"]
