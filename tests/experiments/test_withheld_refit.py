"""lambda after a real refit: the linear one where nothing bends, never more where much does."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.cases import drawn_coefficients
from withheld.reality.families import Family, families
from withheld.reality.manoeuvres import auv_trial
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, make
from withheld.referee import Point, left_over, signatures
from withheld.refit import Judged, judged, pairs, refit

AUV = families()["auv"]
TRIALS = ("pitch_zigzag_15", "level_run", "plane_staircase")


def _found(causes: dict[str, dict[str, float]], family: Family = AUV) -> tuple[Judged, float]:
    """What the referee finds of the first cause in full, and to first order."""
    rng = np.random.default_rng(5)
    coefficients = drawn_coefficients(family, rng)
    noise = {name: Noise(0.8 * sd, 0.6 * sd, family.time) for name, sd in family.noise.items()}
    acting = [Present(family.mechanism(key), values) for key, values in causes.items()]
    records = make(family, [auv_trial(name, family.time) for name in TRIALS], coefficients, acting, noise, rng, True)
    gram = signatures(family, records, coefficients, noise, [(p.mechanism.key, [p]) for p in acting]).projected()
    others = list(range(1, len(acting)))
    return judged(family, records, coefficients, noise, acting, 0), left_over(gram, 0, others)


@pytest.mark.parametrize("causes", [
    {"speed_bias": {"b": 0.05}},
    {"depth_scale": {"k": 0.02, "b": 0.0}},
    {"speed_bias": {"b": 0.05}, "depth_scale": {"k": 0.02, "b": 0.0}},
])  # fmt: skip
def test_where_nothing_bends_both_lambdas_agree(causes: dict[str, dict[str, float]]) -> None:
    found, linear = _found(causes)
    assert linear > 10
    assert found.fit.left == pytest.approx(linear, rel=0.02)


@pytest.mark.slow
def test_of_a_large_drag_a_refit_takes_up_what_one_step_cannot() -> None:
    found, linear = _found({"drag": {"k": 0.6}})
    fit = found.fit
    assert 0 < fit.left < 0.5 * linear

    # The same minimum by another's algorithm, over coefficients and first states alike.
    size, shape = len(fit.point.moved), fit.point.firsts.shape

    def point(x: np.ndarray) -> Point:
        return Point(x[:size], np.empty(0), x[size:].reshape(shape))

    def residuals(x: np.ndarray) -> np.ndarray:
        here = found.rig.look(point(x), aim=found.aim)
        return np.concatenate([*(w[:, -1] for w in here.whole), x[:size]])

    def jacobian(x: np.ndarray) -> np.ndarray:
        here = found.rig.look(point(x), aim=found.aim)
        rows = []
        for k, (whole, starts) in enumerate(zip(here.whole, here.whole_starts, strict=True)):
            firsts = np.zeros((len(starts), shape[0], shape[1]))
            firsts[:, k] = starts
            rows.append(-np.hstack([whole[:, :size], firsts.reshape(len(starts), -1)]))
        return np.vstack([*rows, np.eye(size, size + shape[0] * shape[1])])

    start = np.zeros(size + shape[0] * shape[1])
    solved = least_squares(residuals, start, jacobian, ftol=1e-4, max_nfev=15)
    assert fit.left == pytest.approx(2 * solved.cost, rel=0.03)


@pytest.mark.slow
def test_a_rival_that_does_the_same_leaves_next_to_nothing() -> None:
    found, _ = _found({"drag": {"k": 0.6}})
    rivals = [AUV.mechanism(key) for key in ("tether", "thrust", "pitch_gyro_bias", "lag")]
    left = pairs(found, rivals)
    assert set(left) == {one.key for one in rivals}
    assert all(0 <= value <= found.fit.left for value in left.values())
    assert left["tether"] < 0.5 * found.fit.left
    assert left["pitch_gyro_bias"] > 0.9 * found.fit.left


def test_a_start_that_lies_nowhere_does_no_harm() -> None:
    found, _ = _found({"speed_bias": {"b": 0.05}})
    true = found.rig.truth()
    rng = np.random.default_rng(1)
    lost = Point(
        8.0 * rng.standard_normal(true.moved.shape), true.sizes, 300.0 * rng.standard_normal(true.firsts.shape)
    )
    again = refit(found.rig, found.aim, lost)
    assert again.settled
    assert again.left == pytest.approx(found.fit.left, rel=0.02)


def test_a_refit_without_steps_says_that_it_knows_nothing() -> None:
    found, _ = _found({"drag": {"k": 0.6}})
    assert found.fit.settled
    assert not refit(found.rig, found.aim, None, 1).settled
