"""The tables of a diagnosis agree with one another and with the fits that they come from."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import small_case as small

from seatruth import Diagnosis
from seatruth.diagnosis.pipeline import diagnose
from seatruth.diagnosis.settings import Settings
from seatruth.trials.trial import Trial

TEMPERATURE = Settings().size_temperature


@pytest.fixture(scope="module")
def found(ship_folder: Path, offset_runs: list[Trial]) -> Diagnosis:
    return diagnose(small.study(ship_folder, offset_runs), small.EFFECTS, threads=1)


def test_the_verdict_names_the_effect_with_its_size(found: Diagnosis) -> None:
    assert found.verdict.kind == "effects"
    assert found.named == ("rudder_offset",)
    (q,) = found.effect("rudder_offset").parameters
    assert q.value == pytest.approx(small.OFFSET, abs=4.0 * q.stderr)
    assert q.lower == pytest.approx(q.value - 1.96 * q.stderr)
    assert q.upper == pytest.approx(q.value + 1.96 * q.stderr)
    assert found.verdict.places == ("actuator:delta",)


def test_probabilities_agree(found: Diagnosis) -> None:
    assert sum(one.probability for one in found.hypotheses) == pytest.approx(1.0)
    assert sum(p for _, p in found.answers()) == pytest.approx(1.0)
    for effect in found.effects:
        expected = sum(one.probability for one in found.hypotheses if effect.name in one.effects)
        assert effect.probability == pytest.approx(expected)
    assert [e.probability for e in found.effects] == sorted((e.probability for e in found.effects), reverse=True)
    assert found.verdict.probability == pytest.approx(found.effect("rudder_offset").probability)
    assert found.causes["actuator.steering"] >= found.causes["actuator.steering.offset"]
    assert found.places["actuator:delta"] >= found.effect("rudder_offset").probability - 1e-9


def test_shares_and_the_gap_by_channel_agree(found: Diagnosis) -> None:
    split = found.shares
    assert split.noise + split.parameters + split.effects + split.left == pytest.approx(1.0)
    for which in ("before", "refit", "effects"):
        total = float((found.gap["n"] * found.gap[f"multiple_{which}"] ** 2).sum() / found.gap["n"].sum())
        assert total == pytest.approx(getattr(split, f"misfit_{which}"))
    assert split.misfit_before > split.misfit_refit > split.misfit_effects
    assert split.misfit_effects == pytest.approx(1.0, abs=0.15)


def test_traces_hold_what_the_gap_says(found: Diagnosis) -> None:
    for row in found.gap.to_dict(orient="records"):
        part = found.traces[(found.traces["trial"] == row["trial"]) & (found.traces["channel"] == row["channel"])]
        for which in ("before", "refit", "effects"):
            rmse = math.sqrt(float(np.mean((part["measured"] - part[which]) ** 2)))
            assert rmse == pytest.approx(row[f"rmse_{which}"], rel=1e-9)


def test_noise_is_that_of_the_trials(found: Diagnosis) -> None:
    for channel in found.noise:
        assert channel.white == pytest.approx(small.NOISE[channel.channel], rel=0.1)
        assert channel.slow == 0.0
        assert math.isnan(channel.tau)
        assert channel.samples == 480


def test_coefficients_are_refitted_with_the_effect(found: Diagnosis) -> None:
    for q in found.coefficients:
        assert q.value == pytest.approx(small.TRUE[q.name], abs=4.0 * q.stderr)
        assert q.stderr <= q.prior_sd


def test_noncentrality_is_the_square_of_size_over_its_standard_error(found: Diagnosis) -> None:
    """Within what noise sizes and nonlinearity change: the standard error holds a prior, the noncentrality does not.

    Nor is it divided by the temperature.
    """
    effect = found.effect("rudder_offset")
    (q,) = effect.parameters
    assert effect.noncentrality == pytest.approx(TEMPERATURE * (q.value / q.stderr) ** 2, rel=0.2)
    assert all(0.0 <= value <= effect.noncentrality * (1.0 + 1e-9) for value in effect.confusable.values())


def test_what_is_detectable_is_a_multiple_of_the_standard_error(found: Diagnosis) -> None:
    effect = found.effect("rudder_offset")
    (q,) = effect.parameters
    assert effect.detectable["angle"] == pytest.approx(2.8 * q.stderr / math.sqrt(TEMPERATURE), rel=0.1)
    assert all(limit > 0.0 for other in found.effects for limit in other.detectable.values())


def test_the_augmented_model_holds_the_named_effects_only(found: Diagnosis) -> None:
    (q,) = found.effect("rudder_offset").parameters
    assert found.augmented["effects"] == ["rudder_offset"]
    assert found.augmented["parameters"] == {"rudder_offset_angle": q.value}


def test_prediction_of_trials_left_out(found: Diagnosis) -> None:
    assert found.validation is not None
    assert found.effect("rudder_offset").predictive_gain_lower > 0.0
    total = sum(fold.predictive_gain for fold in found.validation.folds)
    assert found.effect("rudder_offset").predictive_gain == pytest.approx(total)
    assert math.isnan(found.effect("gyro_bias").predictive_gain)


def test_the_suggestion_comes_with_the_motion_that_is_expected(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """After two short trials nobody knows what acts."""
    short = small.shortened(plain_runs[:2], 30)
    found = diagnose(small.study(ship_folder, short), ("rudder_offset", "gyro_bias"), threads=1, validate=False)
    assert found.next_trial is not None
    assert len(found.next_trial.survivors) > 1
    assert set(found.next_trial.motion) == {"r", "psi"}
    assert len(found.next_trial.motion["r"]) == len(found.next_trial.t)
    assert found.next_trial.units["r"] == "rad/s"
