"""A whole diagnosis of studies that are not as they should be, of black boxes, and with a user's own effect."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth import BadInput, BlackBox, Channel, Parameter, Prior, Study, Trial, Trials
from seatruth.diagnosis.pipeline import diagnose
from seatruth.effects import load_effects

pytestmark = pytest.mark.slow

_MILLIONS = 1e12
"""Units of a coefficient in those of another: newton metres beside what is of the order of one."""


class BoatInMillions(boat.Boat):
    """The boat with its rudder's effect in other units."""

    name = "boat in millions"
    parameters = tuple(
        dataclasses.replace(
            one, value=one.value * _MILLIONS, min=one.min * _MILLIONS, max=one.max * _MILLIONS,
            prior=Prior(0.15 * _MILLIONS, 0.02 * _MILLIONS),
        ) if one.name == "K" else one
        for one in boat.Boat.parameters
    )  # fmt: skip

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        surge, sway, _, *rest = boat.Boat.rhs(s, i, p, e)
        return (surge, sway, (p.K * i.delta / _MILLIONS - s.r) / p.T, *rest)


def test_the_units_of_a_coefficient_change_nothing() -> None:
    rudders = [{"delta": boat.zigzag(120, angle, every)} for angle, every in ((0.2, 15.0), (-0.2, 15.0), (0.3, 30.0))]
    runs = boat.trials(
        boat.Boat(), rudders, headings=[0.0, 1.0, 2.0], specs=["rudder_lag"], effects={"rudder_lag_tau": 0.8}
    )
    usual, heavy = (
        diagnose(boat.study(model, runs), ["rudder_lag", "gyro_bias"], suggest=False)
        for model in (boat.Boat(), BoatInMillions())
    )
    assert usual.named == heavy.named == ("rudder_lag",)
    others = {(one.effects, one.discrepancy): one for one in heavy.hypotheses}
    for one in usual.hypotheses:
        assert others[one.effects, one.discrepancy].log_evidence == pytest.approx(one.log_evidence, abs=0.05)
    assert usual.validation is not None
    assert heavy.validation is not None
    for fold, other in zip(usual.validation.folds, heavy.validation.folds, strict=True):
        assert other.error_effects == pytest.approx(fold.error_effects, rel=1e-3)
        assert other.left_open == pytest.approx(fold.left_open, rel=1e-3)


def test_one_trial_alone(ship_folder: Path, offset_runs: list[Trial]) -> None:
    found = small.diagnosed(ship_folder, offset_runs[:1])
    assert "one-trial" in small.codes(found)
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
    found = small.diagnosed(ship_folder, still)
    assert found.verdict.kind in ("no_gap", "underpowered")
    assert found.effect("rudder_gain").detectable["k"] > 1.0


def test_a_channel_that_no_trial_recorded(ship_folder: Path, offset_runs: list[Trial]) -> None:
    bare = [dataclasses.replace(trial, outputs={"r": trial.outputs["r"]}) for trial in offset_runs]
    found = small.diagnosed(ship_folder, bare)
    assert set(found.gap["channel"]) == {"r"}
    assert "rudder_offset" in (*found.named, *found.verdict.members)


def test_channels_with_gaps(ship_folder: Path, offset_runs: list[Trial]) -> None:
    holes = []
    for trial in offset_runs:
        psi = np.asarray(trial.outputs["psi"]).copy()
        psi[30:60] = math.nan
        holes.append(dataclasses.replace(trial, outputs={**trial.outputs, "psi": psi}))
    found = small.diagnosed(ship_folder, holes)
    assert found.named == ("rudder_offset",)
    assert set(found.gap[found.gap["channel"] == "psi"]["n"]) == {len(offset_runs[0]) - 30}


@pytest.mark.slow
def test_the_same_data_twice(ship_folder: Path, offset_runs: list[Trial]) -> None:
    found = small.diagnosed(ship_folder, [*offset_runs, dataclasses.replace(offset_runs[0], name="copy")])
    assert any("copy" in f.message or "same" in f.message for f in found.findings if f.severity == "error")


def test_a_rate_with_the_wrong_sign_or_unit_is_a_finding(ship_folder: Path, offset_runs: list[Trial]) -> None:
    wrong = [dataclasses.replace(t, outputs={**t.outputs, "r": -t.outputs["r"]}) for t in offset_runs[:2]]
    assert "psi-r-sign" in small.codes(small.diagnosed(ship_folder, wrong, validate=False))
    degrees = [dataclasses.replace(t, outputs={**t.outputs, "r": np.rad2deg(t.outputs["r"])}) for t in offset_runs[:2]]
    found = small.diagnosed(ship_folder, degrees, validate=False)
    assert any("deg/s" in str(finding) for finding in found.findings)


def test_what_is_named_says_what_it_predicts_whether_asked_or_not(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """The decision has left trials out: a report that denied it would be wrong."""
    found = small.diagnosed(ship_folder, offset_runs, validate=False)
    assert found.named == ("rudder_offset",)
    assert found.validation is not None
    assert "On trials left out" in found.verdict.sentence


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
        small.diagnosed(ship_folder, small.shortened(offset_runs, 9))


def test_a_channel_that_never_changes(ship_folder: Path, offset_runs: list[Trial]) -> None:
    flat = [dataclasses.replace(t, outputs={**t.outputs, "psi": np.zeros(len(t))}) for t in offset_runs[:2]]
    assert small.diagnosed(ship_folder, flat, validate=False).verdict.sentence


def test_exact_data(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """Trials of the model itself, without noise."""
    study = small.study(ship_folder, plain_runs)
    tables = study.simulate(threads=1)
    exact = [dataclasses.replace(t, outputs={n: tables[t.name][n].to_numpy() for n in t.outputs}) for t in plain_runs]
    found = small.diagnosed(ship_folder, exact, validate=False)
    assert found.verdict.kind in ("no_gap", "underpowered"), str(found)


def test_nothing_free(ship_folder: Path, offset_runs: list[Trial]) -> None:
    study = small.study(ship_folder, offset_runs)
    held = study.replace(parameters=tuple(p.replace(vary=False, prior=None) for p in study.parameters))
    found = diagnose(held, small.EFFECTS, threads=1, suggest=False)
    assert "no-coefficients" in small.codes(found)
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
    (tmp_path / "fade.py").write_text(small.FADE)
    (fade,) = load_effects(["fade.py:Fade"], tmp_path)
    small.folder_with_model(tmp_path)
    runs = small.trials(tmp_path, {"fade_k": 0.5}, specs=["fade.py:Fade"])
    found = diagnose(small.study(ship_folder, runs), [fade, *small.EFFECTS], threads=1, suggest=False)
    first = max(found.effects, key=lambda effect: effect.probability)
    assert first.name == "fade", str(found)
    assert "fade" in (*found.named, *found.verdict.members), str(found)
