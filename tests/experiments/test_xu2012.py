"""The diving plane of Xu and others 2012: its experiment recovers what independent code says that must be recovered."""

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
import xu2012  # noqa: E402
import xu2012_system as system  # noqa: E402

STRONG = ("Z_0", "Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds")
WEAK = ("Z_aw", "Z_waw", "Z_qaq", "M_aw", "M_waw", "M_qaq")
TRIAL = system.zigzag()


def errors(form: str = "trapezoid", trial: Any = TRIAL) -> dict[str, float]:
    return system.percent(system.separate(trial, form))


def test_trapezoid_recovers_what_the_trial_moves_and_no_more() -> None:
    found = errors()
    assert max(abs(found[name]) for name in (*STRONG, "X_uu", "X_wq", "X_qq", "X_T", "z_B")) < 1.5
    assert min(abs(found[name]) for name in WEAK) > 8.99
    assert found["Z_waw"] == pytest.approx(42, abs=0.5)
    assert found["M_waw"] == pytest.approx(-243, abs=0.5)


@pytest.mark.parametrize(("form", "low", "high"), [("euler", 5.5, 23.5), ("central", 1.0, 5.0)])
def test_cruder_forms_err_on_the_strong_ones_too(form: str, low: float, high: float) -> None:
    found = [abs(errors(form)[name]) for name in STRONG]
    assert low < min(found)
    assert max(found) < high


def test_more_fin_identifies_all_but_one() -> None:
    found = errors(trial=system.zigzag(15.0))
    assert found.pop("M_waw") == pytest.approx(-17, abs=0.5)
    assert max(abs(error) for error in found.values()) < 2.0


def test_the_known_coefficient_of_u_comes_out_as_a_check() -> None:
    assert system.literal_surge(TRIAL)["C_u"] == pytest.approx(1.0, abs=1e-5)


def test_noise_leaves_the_known_start_alone_and_has_its_size() -> None:
    sd = system.noise_of(TRIAL, 0.01)
    noisy = system.noisy(TRIAL, sd, np.random.default_rng(3))
    for name, size in sd.items():
        apart = noisy.outputs[name] - TRIAL.outputs[name]
        assert apart[0] == 0.0
        assert np.std(apart[1:]) == pytest.approx(size, rel=0.2)
    assert sd["z"] < 0.02  # of the change of depth, not of the depth


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("xu2012")
    results = run(out)
    return results.finish(), out


def run(out: Path) -> Any:
    options = common.arguments("xu2012", "", ["--quick", "--out", str(out), "--workers", "2"])
    results = common.Results("xu2012", options)
    xu2012.body(options, results)
    return results


@pytest.mark.slow
def test_quick_mode_meets_every_check_figure(quick: tuple[dict[str, Any], Path]) -> None:
    record, out = quick
    assert record["failures"] == []
    checks = pd.read_csv(out / "checks.csv")
    assert len(checks) > 50
    assert checks.met.all()
    assert record["figures"]["check figures [V]"]["met"] is True


@pytest.mark.slow
def test_quick_mode_tables(quick: tuple[dict[str, Any], Path]) -> None:
    record, out = quick
    sense = pd.read_csv(out / "errors_in_per_cent.csv", index_col="coefficient").sensitivity
    assert (sense[list(STRONG)] > 0.1).all()
    assert (sense[list(WEAK)] < 0.1).all()
    assert record["figures"]["rank correlation of sensitivity and error"]["value"] < -0.7
    bounds = pd.read_csv(out / "bounds_in_per_cent.csv", index_col="coefficient")
    assert (bounds.loc[list(STRONG), "5 deg, 120 s"] < 10).all()
    assert (bounds.loc[list(WEAK), "15 deg, 120 s"] < 0.5 * bounds.loc[list(WEAK), "5 deg, 120 s"]).all()
    solvers = pd.read_csv(out / "solvers.csv").set_index("solver")
    assert solvers.reached[["newton", "least_squares"]].all()
    assert set(solvers.index) >= {"ls_svm", "cma_es", "genetic", "particle_swarm", "nelder_mead", "simulated_annealing"}
    noise = pd.read_csv(out / "noise.csv").set_index(["level", "coefficient"])
    ratio = noise["trajectory rms, %"] / noise["crlb, %"]
    assert math.sqrt((ratio**2).mean()) < 1.2
    # noise in the states biases a regression: at 3 % it is out of the question
    assert noise.loc[0.03].loc[list(STRONG), "ls_svm rms, %"].max() > 20
    assert noise.loc[0.03].loc[list(STRONG), "trajectory rms, %"].max() < 20


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
