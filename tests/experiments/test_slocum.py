"""The Slocum glider's models, and, where the real trials are, what its record holds."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth import BadInput, Trial, identify, simulator
from seatruth.testing.models import ModelConformance

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "experiments"))

import common  # noqa: E402
import slocum  # noqa: E402
import slocum_glide as glide  # noqa: E402

FILE = ROOT.parent / "shared" / "data" / slocum.FILE
real = pytest.mark.skipif(not FILE.exists(), reason="the real trials (../shared/data) are not on this machine")


class TestUnsteady(ModelConformance):
    ranges = {  # noqa: RUF012
        **{"ahead": (0.05, 0.6), "down": (-0.3, 0.3), "theta": (-0.5, 0.5), "V_b": (-2.5e-4, 2.5e-4)},
        **{"rho": (1003.0, 1027.0), "P": (0.0, 4e5)},
    }
    start = {"ahead": 0.3, "down": 0.12}  # noqa: RUF012

    @pytest.fixture
    def model(self) -> Any:
        return glide.UNSTEADY

    def test_first_state_returns_the_outputs(self, model: Any) -> None:
        """Speed is not always recorded, so the first state has the recorded sinking and the usual glide angle."""
        first = model.first_state(
            {"sink": 0.12, "U": math.nan}, {"theta": -0.38, "V_b": 0.0, "rho": 1005.0, "P": 0.0}, model.nominal()
        )
        assert first == pytest.approx((0.12 / math.tan(0.435), 0.12))


def cast(theta: float, V_b: float, size: int = 20, **outputs: float) -> Trial:
    t = 10.0 * np.arange(size)
    inputs = {"theta": theta, "V_b": V_b, "rho": 1005.5, "P": 2e5}
    return Trial(
        "made",
        t,
        {name: np.full(size, value) for name, value in inputs.items()},
        {name: np.full(size, outputs.get(name, 0.1)) for name in ("sink", "U")},
        synthetic=True,
    )


@pytest.mark.parametrize(("theta", "V_b"), [(-0.38, -2.3e-4), (0.385, 2.3e-4)])
def test_steady_glide_balances_its_forces_and_is_where_the_unsteady_one_settles(theta: float, V_b: float) -> None:
    p = glide.PUBLISHED | {"m": 70.1}
    trial = cast(theta, V_b, 80)
    found = glide.steady_run(trial, p, None)
    sink, U = float(found["sink"][0]), float(found["U"][0])
    assert sink * V_b < 0
    angle = math.asin(-sink / U)
    alpha = theta - angle
    q = 0.5 * 1005.5 * p["S"] * U**2
    drag, lift = q * (p["C_D0"] + p["C_D1"] * alpha**2), q * p["C_L"] * alpha
    up = 9.81 * (1005.5 * (p["V_g"] * (1 - p["epsilon"] * 2e5) + V_b) - p["m"])
    # along earth axes: drag against the motion, lift across it, buoyancy less weight up
    assert -drag * math.cos(angle) - lift * math.sin(angle) == pytest.approx(0.0, abs=1e-9)
    assert -drag * math.sin(angle) + lift * math.cos(angle) + up == pytest.approx(0.0, abs=1e-9)
    values = glide.UNSTEADY.nominal() | {"m": 70.1}
    engine = simulator(glide.UNSTEADY, [trial], (), values, max_step=1.0)
    y = engine.outputs(np.zeros((1, 0)), engine.initial_states).y[0]
    assert y[-1] == pytest.approx([sink, U], rel=1e-6)


def test_a_heavy_glider_with_its_nose_up_does_not_glide() -> None:
    assert (glide.steady_run(cast(0.38, -2.3e-4), glide.PUBLISHED, None)["U"] == 0).all()


def test_fit_recovers_made_constants() -> None:
    """Synthetic casts at two buoyancies, dives with speed and climbs without: mass, drag and lift come back."""
    rng, truth = np.random.default_rng(2), glide.PUBLISHED | {"m": 70.08, "C_D0": 0.18, "C_L": 6.5}
    casts = []
    for k in range(8):
        sign = -1.0 if k % 2 == 0 else 1.0
        bare = replace(cast(0.38 * sign, 2.3e-4 * sign), name=f"made {k}")
        y = glide.steady_run(bare, truth, None)
        outputs = {name: values + 0.002 * rng.standard_normal(len(bare)) for name, values in y.items()}
        made = replace(bare, outputs=outputs)
        casts.append(made if sign < 0 else glide.without_speed(made))
    found = identify(glide.study(glide.STEADY, casts, slocum.CHOSEN), threads=1).parameters
    for name in slocum.CHOSEN:
        assert abs(found.value[name] - truth[name]) < 4 * found.stderr[name]
        assert found.verdict[name] == "identified"


def test_without_the_record_it_says_where_to_look(tmp_path: Path) -> None:
    options = common.arguments("slocum", "", ["--data", str(tmp_path)])
    with pytest.raises(BadInput, match="--data"):
        slocum.body(options, common.Results("slocum", replace(options, out=tmp_path / "out")))


@pytest.fixture(scope="module")
def casts() -> list[Trial]:
    return list(glide.read(FILE))


@real
@pytest.mark.data
def test_the_record_has_18_dives_and_climbs_and_one_speed_that_cannot_be(casts: list[Trial]) -> None:
    dives = glide.dives(casts)
    assert (len(casts), len(dives)) == (36, 18)
    assert all(run.name.startswith("dive") for run in dives)
    implied = {dive.name: math.degrees(glide.implied_incidence(dive)) for dive in dives}
    odd = implied.pop("dive 35")
    assert odd > 15
    assert 2 < min(implied.values()) < max(implied.values()) < 5
    for run in casts:
        assert np.diff(run.t).min() > 0
        assert (np.sign(run.outputs["sink"]) == (1 if run.name.startswith("dive") else -1)).all()


@real
@pytest.mark.data
def test_depth_alone_gives_the_published_drag_and_predicts_the_speed(casts: list[Trial]) -> None:
    used = [run for run in casts if run.name != "dive 35"]
    kept = [glide.without_speed(run) for run in used[:18]]
    found = identify(glide.study(glide.STEADY, kept, ("m", "C_D0")), threads=1).parameters
    assert found.value["C_D0"] == pytest.approx(0.15, abs=0.01)
    values = glide.PUBLISHED | dict(zip(found.index, found.value))
    errors = np.concatenate([run.outputs["U"] - glide.steady_run(run, values, None)["U"] for run in used[18:]])
    assert math.sqrt(np.nanmean(errors**2)) < 0.015


@pytest.mark.slow
@real
@pytest.mark.data
def test_quick_mode(tmp_path: Path) -> None:
    options = common.arguments("slocum", "", ["--quick", "--out", str(tmp_path), "--workers", "2"])
    results = common.Results("slocum", options)
    slocum.body(options, results)
    record = results.finish()
    assert record["failures"] == []
    figures = record["figures"]
    assert figures["left out, mass, drag, lift from depth and speed"]["value"] < 15
    # the area scales drag and lift alike, and mass and volume go together: the software must say so
    assert "S (not identifiable)" in figures["all eight free: parameters identified"]["note"]
    summary = (tmp_path / "summary.md").read_text()
    assert "m and V_g trade off" in summary
    assert str(ROOT) not in summary
