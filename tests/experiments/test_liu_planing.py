"""The planing craft of Liu, Yue and Yu: check figures, its study files, and what its quick version says."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from seatruth import identify
from seatruth.costs import cost_of
from seatruth.optimizers import Budget, make, minimise
from seatruth.uncertainty import unidentifiable_directions

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import common  # noqa: E402
import liu_planing  # noqa: E402
import liu_planing_folds as cross  # noqa: E402
import liu_planing_solvers as solvers  # noqa: E402
import liu_planing_system as system  # noqa: E402


@pytest.mark.parametrize("name", ["M1", "M2"])
def test_printed_coefficients_give_the_sheets_diameters(name: str) -> None:
    model: Any = system.study(name).model
    for speed, expected in system.SHEET[name].items():
        columns = {"speed": np.full(5, speed), "froude": system.froude(np.full(5, speed))}
        columns |= {"rudder": np.array(system.ANGLES), "displacement": np.full(5, 50.0)}
        found = model.evaluate(columns, system.PRINTED[name])
        np.testing.assert_allclose(found, expected, atol=0.0501)
        plain = system.model_1 if name == "M1" else system.model_2
        np.testing.assert_allclose(found, plain(columns["speed"], columns["rudder"]), rtol=1e-6)


def test_the_two_formulas_agree_without_a_factor() -> None:
    """[V] rms log-ratio 0.125 with a best scale of 2165 against 2273 as printed; kilograms, not tonnes."""
    speed, rudder = np.meshgrid(np.arange(1.0, 2.65, 0.1), np.arange(10.0, 35.5, 1.0))
    ratio = np.log(system.model_1(speed, rudder) / system.model_2(speed, rudder))
    assert math.sqrt(np.mean(ratio**2)) == pytest.approx(0.125, abs=0.005)
    factor = system.LOBAS * system.DISPLACEMENT / system.RUDDER_AREA
    assert factor == pytest.approx(2273, abs=0.5)
    assert factor * math.exp(-np.mean(ratio)) == pytest.approx(2165, rel=0.01)


def test_the_synthetic_table_is_the_generators() -> None:
    kept, made = pd.read_csv(system.HERE / "synthetic_turns.csv"), system.turns(system.SEED)
    pd.testing.assert_frame_equal(kept, made, atol=1e-6)
    assert len(made) == 30
    mean = made.groupby("draft").diameter.mean() / made.groupby("draft").speed.mean()
    assert mean[0.14] > mean[0.13]
    assert made.groupby(["draft", "voltage"]).speed.nunique().eq(1).all()


@pytest.mark.parametrize(("name", "count"), [("M1", 6), ("M2", 5)])
def test_the_study_file_is_fitted_and_its_scale_named(name: str, count: int) -> None:
    study = system.study(name)
    assert study.synthetic
    estimate = identify(study, threads=1)
    said = estimate.identifiability["weak"][0]
    assert len(said["combination"]) == count
    assert set(said["combination"].values()) == {1.0}
    assert set(estimate.parameters.verdict) <= {"not identifiable", "at bound"}
    assert 0.3 < math.sqrt(float((estimate.fit.rmse**2).mean())) < 0.6
    fixed = cost_of(solvers.study(name, fixed=True), threads=1)
    assert unidentifiable_directions(fixed, fixed.start) == []


def test_the_genetic_algorithm_takes_the_papers_settings() -> None:
    options = {"crossing": "sbx", "population": 200, "generations": 2000, "crossover": 0.8, "mutation": 0.15}
    cost = cost_of(system.study("M2"), threads=1)
    found = minimise(cost, make("genetic", **options), seed=1, budget=Budget(40_200))
    best = minimise(cost, "least_squares", seed=1)
    squares = [float(np.mean(cost.errors(x) ** 2)) for x in (found.x, best.x)]
    assert squares[1] <= squares[0] < 1.05 * squares[1]


def test_conditions_are_left_out_whole() -> None:
    table = system.turns(system.SEED)
    parts = cross.conditions(table, ("draft", "voltage"))
    assert [len(rows) for rows in parts] == [5] * 6
    assert sorted(np.concatenate(parts).tolist()) == list(range(30))


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("liu_planing")
    options = common.arguments("liu_planing", "", ["--quick", "--out", str(out), "--workers", "1", "--data", str(out)])
    results = common.Results("liu_planing", options)
    liu_planing.body(options, results)
    return results.finish(), out


@pytest.mark.slow
def test_quick_version(quick: tuple[dict[str, Any], Path]) -> None:
    record, out = quick
    assert record["failures"] == []
    figures = record["figures"]
    assert figures["check figures [V]"]["met"] is True
    assert figures["least squares and Newton at the optimum"]["met"] is True
    rows = pd.read_csv(out / "solvers.csv")
    assert set(rows.solver) >= {"genetic", "differential_swarm", "particle_swarm", "cma_es", "newton", "ls_svm"}
    assert rows[rows.solver == "ls_svm"].why.str.contains("not enter the formula linearly").all()
    text = (out / "result.json").read_text() + (out / "summary.md").read_text()
    assert "synthetic" in text
    assert "the real trials are not there" in text
    assert str(ROOT) not in text
    assert json.loads((out / "result.json").read_text())["figures"] == figures


def test_real_turning_circles() -> None:
    import liu_planing_turns as circles

    folder = ROOT.parent / "shared" / "data" / "esso_osaka"
    if not folder.is_dir():
        pytest.skip("the real trials are not there")
    table = circles.measured(folder)
    assert len(table) == 9
    assert table.rudder.between(19, 36).all()
    assert set(table.side) == {-1.0, 1.0}
    assert table.tactical.between(2, 5).all()
    # more rudder, tighter turn, on either side
    for _, part in table.groupby("side"):
        assert part[part.rudder > 30].tactical.max() < part[part.rudder < 25].tactical.min()
