"""The classifier and the orthogonal process on residuals made by hand, where the answer is known."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.blind import program
from withheld.programs import classifier
from withheld.programs.classifier import decided, noise
from withheld.programs.orthogonal import discrepancy, named_by
from withheld.verdicts import problems

import seatruth.sample

N = 240
T = np.linspace(0.0, 1.0, N)
RUNS = [("u", np.arange(N // 2)), ("u", np.arange(N // 2, N))]
NUISANCES = np.stack([np.ones(N), T], axis=1)
SHAPES = {"swing": np.sin(9.0 * T), "step": np.where(T > 0.6, 1.0, 0.0)}


def _changes(rng: np.random.Generator) -> dict[str, np.ndarray]:
    return {name: shape[:, None] * rng.normal(0.0, 6.0, 12) for name, shape in SHAPES.items()}


@pytest.mark.parametrize("name", ["swing", "step", ""])
def test_the_classifier_names_what_it_was_trained_on(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(classifier, "TREES", 30)
    rng = np.random.default_rng(3)
    residuals = 5.0 * SHAPES.get(name, np.zeros(N)) + 40.0 * T + rng.standard_normal(N)
    chances = decided(residuals, NUISANCES, _changes(rng), RUNS, rng)
    assert max(chances, key=lambda key: chances[key]) == name
    assert sum(chances.values()) == pytest.approx(1.0)


def test_the_classifier_says_nothing_of_what_no_draw_is_like() -> None:
    rng = np.random.default_rng(4)
    assert decided(60.0 * np.sin(40.0 * T), NUISANCES, _changes(rng), RUNS, rng) == {}


def test_noise_is_white_and_slow() -> None:
    drawn = noise(np.random.default_rng(5), RUNS, 400)
    assert drawn.shape == (N, 400)
    assert 1.0 < float(drawn.var()) < 3.0
    assert float((drawn[1:120] * drawn[:119]).mean()) > 0.1


def test_a_discrepancy_is_found_is_orthogonal_and_is_named() -> None:
    rng = np.random.default_rng(6)
    residuals = 4.0 * SHAPES["swing"] + 40.0 * T + rng.standard_normal(N)
    runs = [rows for _, rows in RUNS]
    fit = discrepancy(residuals, NUISANCES, runs)
    assert fit.gain > 10.0
    assert np.abs(NUISANCES.T @ fit.mean).max() < 1e-8 * np.abs(fit.mean).sum()
    q, _ = np.linalg.qr(NUISANCES)
    wanted = 4.0 * (SHAPES["swing"] - q @ (q.T @ SHAPES["swing"]))
    assert float(fit.mean @ wanted) / float(wanted @ wanted) == pytest.approx(1.0, abs=0.2)
    scores = named_by(fit, {name: shape[:, None] for name, shape in SHAPES.items()}, NUISANCES)
    assert max(scores, key=lambda key: scores[key]) == "swing"
    # What explains less than half is not the cause.
    scores = named_by(fit, {"other": np.cos(50.0 * T)[:, None]}, NUISANCES)
    assert max(scores, key=lambda key: scores[key]) == "unknown"


def test_white_noise_holds_no_discrepancy() -> None:
    residuals = 3.0 * T + np.random.default_rng(7).standard_normal(N)
    assert discrepancy(residuals, NUISANCES, [rows for _, rows in RUNS]).gain == 0.0


SLOW = ("white", "kinematics", "orthogonal")


@pytest.mark.parametrize(
    "name", ["bic", "rmse", "prior", *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)]
)
def test_a_program_gives_a_verdict_on_a_study_as_it_is(name: str) -> None:
    """With every effect that can act, those that have values for each trial included."""
    found = program(name)(Path(seatruth.sample.__file__).parent / "diagnose.toml")
    assert not problems(found)
    if name == "bic":
        assert found["effects"] in (["current"], ["trial_current"])
