"""Depth fusion against a depth that is known."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.trials import Trial, prepare
from seatruth.trials.prepare import fuse

ACCELERATION, WALK = 0.05, 0.01


def known_depth(seed: int, n: int = 1500) -> dict[str, np.ndarray]:
    """Depth, rate and bias drawn from the very process that the filter assumes, at uneven times."""
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.05, 0.15, n))
    d, rate, bias = np.zeros((3, n))
    d[0], rate[0], bias[0] = 20.0, 0.1, 0.3
    for k in range(1, n):
        h = t[k] - t[k - 1]
        cov = ACCELERATION**2 * np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]])
        kick = np.linalg.cholesky(cov) @ rng.standard_normal(2)
        d[k], rate[k] = d[k - 1] + h * rate[k - 1] + kick[0], rate[k - 1] + kick[1]
        bias[k] = bias[k - 1] + WALK * np.sqrt(h) * rng.standard_normal()
    tracker = np.where(np.arange(n) % 25 == 0, d + 0.3 * rng.standard_normal(n), np.nan)
    pressure = d + 0.03 * rng.standard_normal(n)
    pressure[600:700] = np.nan
    inertial = d + bias + 0.05 * rng.standard_normal(n)
    return {"t": t, "d": d, "rate": rate, "bias": bias, "ins": inertial, "pressure": pressure, "tracker": tracker}


def test_fused_depth_beats_every_source_and_knows_its_error() -> None:
    """Normalised estimation error squared: mean 1 a state over many runs, within what sampling allows."""
    squares = []
    for seed in range(8):
        k = known_depth(seed)
        found = fuse(
            k["t"],
            {"ins": (k["ins"], 0.05), "pressure": (k["pressure"], 0.03), "tracker": (k["tracker"], 0.3)},
            frozenset(["ins"]),
            ACCELERATION,
            WALK,
        )
        error = np.stack([found.depth - k["d"], found.rate - k["rate"], found.bias - k["bias"]], axis=1)
        fused = np.sqrt(np.mean(error[:, 0] ** 2))
        for name in ("ins", "pressure", "tracker"):
            assert fused < 0.6 * np.sqrt(np.nanmean((k[name] - k["d"]) ** 2))
        # Every fiftieth sample: errors 5 s apart are nearly independent.
        inverse = np.linalg.inv(found.covariance[::50])
        squares.append(np.einsum("ni,nij,nj->n", error[::50], inverse, error[::50]))
        assert float(found.innovation) == pytest.approx(1.0, abs=0.1)
    nees = np.concatenate(squares)
    assert np.mean(nees) / 3 == pytest.approx(1.0, abs=4 * np.sqrt(2 / 3 / nees.size) * 1.5)


def test_smoother_beats_the_filter_at_a_gap() -> None:
    k = known_depth(1)
    found = fuse(k["t"], {"pressure": (k["pressure"], 0.03)}, acceleration=ACCELERATION)
    gap = slice(600, 700)
    assert np.abs(found.depth - k["d"])[gap].max() < 4 * found.sd[gap].max()
    assert found.sd[650] > 2 * found.sd[500]


def test_the_step_adds_depth_and_its_deviation_and_keeps_the_sources() -> None:
    k = known_depth(2)
    outputs = {"z_ins": k["ins"], "z_p": k["pressure"], "z_track": k["tracker"]}
    run = Trial("dive", k["t"], {}, outputs)
    found = prepare.fuse_depth(
        run, sources={"z_p": 0.03, "z_track": 0.3}, inertial="z_ins", acceleration=ACCELERATION, bias_walk=WALK
    )
    assert set(found.outputs) == {*outputs, "depth", "depth_sd"}
    assert np.std(found.outputs["depth"] - k["d"]) < 0.02
    assert "normalised innovations 1.0" in found.steps[0].effect or "0.9" in found.steps[0].effect
    with pytest.raises(BadInput, match="measures the depth itself"):
        prepare.fuse_depth(run, sources={}, inertial="z_ins")
    with pytest.raises(BadInput, match="Did you mean 'z_p'"):
        prepare.fuse_depth(run, sources={"z_pp": 0.03})
    with pytest.raises(BadInput, match="standard deviation"):
        prepare.fuse_depth(run, sources={"z_p": 0.0})
