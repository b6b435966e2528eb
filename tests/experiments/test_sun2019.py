"""The glider of Sun, Wang and Sang 2019: closed forms, what is recorded, bounds, and the whole quick experiment."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import common  # noqa: E402
import sun2019  # noqa: E402
import sun2019_system as system  # noqa: E402

from seatruth.manoeuvres import Trim  # noqa: E402

LATERAL = ("K_beta", "K_MR", "K_p", "K_MY", "K_r", "Y_delta")


@pytest.mark.parametrize("alpha", [1.0, 3.0, 6.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_closed_form_finds_the_trim_of_its_glide(alpha: float, sign: float) -> None:
    """The sliding mass that the closed form asks for holds the six-degree-of-freedom model at that incidence."""
    closed = system.closed_glide(sign * math.radians(alpha), sign * 0.4)
    found = system.steady(Trim(sign * 0.4, closed["x_p"]))
    assert found["alpha"] == pytest.approx(sign * math.radians(alpha), rel=1e-6)
    assert found["glide"] == pytest.approx(closed["glide"], rel=1e-6)
    assert found["V"] == pytest.approx(closed["V"], rel=1e-6)


def test_best_lift_to_drag_is_at_the_root_of_the_drag_ratio() -> None:
    best = math.sqrt(system.TRUTH["K_D0"] / system.TRUTH["K_D"])
    ratios = {k: system.closed_glide(k * best, 0.5)["L/D"] for k in (0.8, 1.0, 1.2)}
    assert ratios[1.0] > max(ratios[0.8], ratios[1.2])


@pytest.mark.parametrize(("rudder", "small", "large"), [(10, 7.6, 5.3), (20, 5.5, 3.9), (30, 4.8, 3.3)])
def test_closed_form_turning_radius(rudder: float, small: float, large: float) -> None:
    angle = math.radians(rudder)
    assert system.closed_radius(angle, 0.0058) == pytest.approx(small, abs=0.05)
    assert system.closed_radius(angle, 0.012) == pytest.approx(large, abs=0.05)
    ratio = system.steady(system.DIVE, angle)["radius"] / system.closed_radius(angle, 0.012)
    assert 2.0 < ratio < 5.0  # it has neither sway nor centripetal balance


@pytest.fixture(scope="module")
def runs() -> tuple[Any, ...]:
    return tuple(system.trials_of(system.DESIGNS[-1].plans, 2))


def test_recorded_runs_have_fixes_at_their_ends_only_and_noise_of_its_size(runs: tuple[Any, ...]) -> None:
    suite = system.SUITES["and fixes at both ends"]
    noisy = system.recorded(runs[0], suite, np.random.default_rng(1))
    for name in ("x", "y"):
        assert np.isfinite(noisy.outputs[name]).sum() == pytest.approx(2 * (system.FIXES + 1), abs=1)
    assert np.std(noisy.outputs["theta"] - runs[0].outputs["theta"]) == pytest.approx(math.radians(0.2), rel=0.15)
    # velocities are a guess at the start, and nothing after it
    assert np.isfinite(noisy.outputs["u"]).sum() == 1
    assert noisy.synthetic


def test_what_a_sawtooth_cannot_tell(runs: tuple[Any, ...]) -> None:
    """It never turns, so nothing lateral shows; and without a position or a velocity nobody sees the current."""
    on_board = system.bound(runs[:2], system.SUITES["on board"], system.HYDRODYNAMIC, 2)["bounds"]
    assert {name for name, row in on_board.items() if row["verdict"] == "not identifiable"} == set(LATERAL)
    assert {on_board[name]["verdict"] for name in system.CURRENT} == {"weak"}
    with_fixes = system.bound(runs, system.SUITES["and fixes at both ends"], system.HYDRODYNAMIC, 2)["bounds"]
    assert {row["verdict"] for row in with_fixes.values()} == {"identified"}


def test_a_free_heave_added_mass_trades_off_with_the_pitch_moment(runs: tuple[Any, ...]) -> None:
    free = (*system.HYDRODYNAMIC, *system.ADDED)
    found = system.bound(runs, system.SUITES["and fixes at both ends"], free, 2)
    assert any("A_33 and K_M trade off" in sentence for sentence in found["trade-offs"])
    assert found["bounds"]["K_M"]["verdict"] == "weak"


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    out = tmp_path_factory.mktemp("sun2019")
    options = common.arguments("sun2019", "", ["--quick", "--out", str(out), "--workers", "2"])
    results = common.Results("sun2019", options)
    sun2019.body(options, results)
    return results.finish(), out


@pytest.mark.slow
def test_quick_mode(quick: tuple[dict[str, Any], Path]) -> None:
    record, out = quick
    assert record["failures"] == []
    assert record["figures"]["check figures [V]"]["met"] is True
    assert len(pd.read_csv(out / "checks.csv")) == 24
    drift = pd.read_csv(out / "drift_in_the_current.csv")
    assert drift["change of depth, m"].max() < 1e-6
    noise = pd.read_csv(out / "noise_runs.csv")
    assert (noise.ended == "converged").all()
    # ten times the bound would be a wrong optimum; two seeds cannot judge more
    assert (noise.error.abs() < 5 * noise.crlb).all()
    glides = pd.read_csv(out / "glide_against_controls.csv").dropna()
    assert len(glides) == 4
    assert glides["simulated glide"].to_numpy() == pytest.approx(glides["glide"].to_numpy(), abs=1e-4)


@pytest.mark.slow
def test_quick_mode_leaves_a_complete_result(quick: tuple[dict[str, Any], Path]) -> None:
    record, out = quick
    files = [*record["tables"].values(), *(file for group in record["pictures"].values() for file in group)]
    assert all((out / file).stat().st_size > 0 for file in [*files, "summary.md"])
    text = (out / "result.json").read_text() + (out / "summary.md").read_text()
    assert str(ROOT) not in text
    assert "synthetic" in text
    assert record["figures"] == json.loads((out / "result.json").read_text())["figures"]
