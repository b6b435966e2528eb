"""Chen, Yan and Wang 2011: the experiment's parts do what it says of them, and its quick mode is whole."""

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

import chen2011  # noqa: E402
import chen2011_coupled as coupled  # noqa: E402
import chen2011_design as design  # noqa: E402
import chen2011_runs as runs  # noqa: E402
import chen2011_system as system  # noqa: E402
import common  # noqa: E402

from seatruth.models.longitudinal_plane import READINGS  # noqa: E402

FOUND = {
    **{"pitch": 0.046, "period": 43.366, "middle": -0.347, "k_theta": 0.129, "k_q": 11.263},
    **{"dither": 0.102, "period_1": 7.491, "period_2": 4.637, "share_2": 0.516, "phase_2": 2.391},
}
"""Settings that a search of 6000 evaluations found, rounded."""


def found_trial() -> Any:
    settings = np.array([[FOUND[q.name] for q in design.SETTINGS]])
    return design.trial(design.steered(settings, 60.0)[0])


def test_records_are_paired_and_have_their_noise() -> None:
    one, sd, weight = runs.record(0.03, 4)
    again, _, _ = runs.record(0.03, 4)
    other, _, _ = runs.record(0.03, 5)
    clean = system.benchmark()
    assert weight == 0.03
    for name, size in sd.items():
        apart = one.outputs[name] - clean.outputs[name]
        assert np.array_equal(one.outputs[name], again.outputs[name])
        assert not np.array_equal(one.outputs[name], other.outputs[name])
        assert apart[0] == 0.0
        assert np.std(apart[1:]) == pytest.approx(size, rel=0.1)
        assert size == pytest.approx(0.03 * np.abs(clean.outputs[name]).max())


def test_starts_lie_anywhere_within_the_bounds() -> None:
    starts = [system.random_start(np.random.default_rng(k)) for k in range(200)]
    parts = np.array([[start[name] / system.TRUTH[name] for name in system.FREE] for start in starts])
    assert 0.2 <= parts.min() < 0.22
    assert 2.95 < parts.max() <= 3.0
    assert parts.mean() == pytest.approx(1.6, abs=0.06)


def test_differential_swarm_reaches_the_optimum_from_anywhere() -> None:
    row = runs.search(0.03, "DS", (("differential_swarm", {"particles": 40, "omega": 1.0}),), 1, 80_000)
    assert row["reached"]
    assert abs(row["excess"]) <= runs.REACHED
    # The optimum under noise, not the truth: within a few bounds of it.
    bound = system.bounds(system.benchmark(), 0.03)
    assert max(abs(row["error"][name]) / bound[name] for name in bound) < 4.0


def test_without_noise_the_hybrid_finds_the_truth() -> None:
    row = runs.search(0.0, "hybrid", chen2011.OTHERS["DS, then least_squares"], 0, 40_000)
    assert row["reached"]
    assert max(abs(error) for error in row["error"].values()) < 0.5


@pytest.mark.slow
def test_maximum_likelihood_is_at_the_bound() -> None:
    fits = [runs.fit(0.03, k) for k in range(12)]
    size = runs.ratio([fit["error"] for fit in fits], system.bounds(system.benchmark(), 0.03))
    assert 0.8 < math.sqrt(float(np.mean(np.square(list(size.values()))))) < 1.2
    inside = [value for fit in fits for value in fit["inside"].values()]
    assert np.mean(inside) > 0.88


def test_a_noisy_first_sample_is_estimated_with_the_rest() -> None:
    bound = system.bounds(system.benchmark(), 0.03)
    row = runs.fit(0.03, 3, free_start=True)
    assert max(abs(row["error"][name]) / bound[name] for name in bound) < 4.0


@pytest.mark.slow
def test_results_do_not_depend_on_workers() -> None:
    jobs = [
        {"level": 0.03, "label": "DS", "solver": chen2011.SWARM, "k": k, "evaluations": 500, "elevator": None}
        for k in range(3)
    ]
    one, two = (runs.in_parallel(runs.search, jobs, workers) for workers in (1, 2))
    assert [{**row, "seconds": 0} for row in one] == [{**row, "seconds": 0} for row in two]


def test_a_designed_trial_keeps_its_limits_and_holds_far_more() -> None:
    trial = found_trial()
    fin = trial.inputs["delta_s"]
    assert np.abs(fin).max() <= system.ANGLE + 1e-9
    assert np.abs(np.diff(fin)).max() <= system.RATE * system.STEP + 1e-9
    assert np.abs(trial.outputs["theta"]).max() <= design.PITCH + math.radians(0.5)
    assert trial.outputs["z"].min() > design.SHALLOWEST
    assert trial.outputs["z"].max() < design.DEEPEST + 1.0
    designed, before = (max(system.bounds(run, 0.03).values()) for run in (trial, system.benchmark()))
    assert designed < 3.6
    assert before > 12.0


def test_a_designs_cost_is_its_largest_bound_and_more_where_it_leaves_the_limits() -> None:
    cost = design.DesignCost(60.0, 1)
    inside = np.array([FOUND[q.name] for q in design.SETTINGS])
    steep = inside.copy()
    steep[cost.names.index("k_q")] = 0.1  # hardly damped: it pitches through the vertical
    good, bad = cost.values(np.array([inside, steep]))
    largest = max(system.bounds(found_trial(), 0.03).values())
    assert good == pytest.approx(largest, rel=0.02) or good > largest  # a little beyond 45 deg costs a little
    assert bad > 10.0 * good


def test_coupled_trial_and_its_ties() -> None:
    trial = coupled.benchmark()
    study = coupled.study(trial, coupled.sizes(trial, 0.03))
    assert tuple(q.name for q in study.free) == tuple(
        q.name for q in coupled.PLANT.parameters if q.name in coupled.FREE
    )
    start = study.space.nominal()
    assert start["C_z_beta"] == -start["C_y_alpha"]
    assert np.abs(np.degrees(trial.outputs["theta"])).max() < 25.0
    assert np.ptp(np.degrees(trial.outputs["psi"])) > 30.0
    row = coupled.search("hybrid", chen2011.OTHERS["DS, then least_squares"], 0, 0.03, 20_000)
    assert row["reached"]


def test_both_readings_have_11_parameters() -> None:
    assert tuple(system.FREE) == READINGS["R2"]
    assert len(READINGS["R1"]) == len(READINGS["R2"]) == 11


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("chen2011")
    results = run(out)
    return results.finish(), out


def run(out: Path) -> Any:
    options = common.arguments("chen2011", "", ["--quick", "--out", str(out), "--workers", "1"])
    results = common.Results("chen2011", options)
    chen2011.body(options, results)
    return results


@pytest.mark.slow
def test_quick_mode_meets_every_check_figure_and_resumes(
    quick: tuple[dict[str, Any], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    record, out = quick
    assert record["failures"] == []
    assert pd.read_csv(out / "checks.csv").met.all()
    files = [*record["tables"].values(), *(file for group in record["pictures"].values() for file in group)]
    assert all((out / file).stat().st_size > 0 for file in [*files, "summary.md"])
    text = (out / "result.json").read_text() + (out / "summary.md").read_text()
    assert str(ROOT) not in text
    assert "synthetic" in text
    bounds = pd.read_csv(out / "bounds_in_per_cent.csv", index_col="parameter")
    assert bounds.loc["lambda_22", "no net weight"] > 50 * bounds.loc["lambda_22", "benchmark"]
    monkeypatch.setattr(common.Results, "add_picture", lambda self, name, figure: plt.close(figure))
    again = run(out).finish()
    assert all(stage["resumed"] for stage in again["stages"].values())
    assert again["figures"] == record["figures"] == json.loads((out / "result.json").read_text())["figures"]
