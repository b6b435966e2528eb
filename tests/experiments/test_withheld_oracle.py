"""What one who knows the cause closes on trials left out."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.cases import drawn_coefficients
from withheld.oracle import oracle_closure
from withheld.reality.families import families
from withheld.reality.manoeuvres import auv_trial
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, make
from withheld.referee import signatures
from withheld.refit import judged

AUV = families()["auv"]
TRIALS = ("pitch_zigzag_15", "level_run", "plane_staircase", "level_run")


def closed(causes: dict[str, dict[str, float]], known: int) -> dict[str, float]:
    """What the oracle closes that knows the first so many causes."""
    rng = np.random.default_rng(5)
    coefficients = drawn_coefficients(AUV, rng)
    offset = np.array([(coefficients[name] - value) / (0.15 * abs(value)) for name, value in AUV.coefficients.items()])
    noise = {name: Noise(0.8 * sd, 0.6 * sd, 3.0) for name, sd in AUV.noise.items()}
    acting = [Present(AUV.mechanism(key), values) for key, values in causes.items()]
    records = make(AUV, [auv_trial(name, AUV.time) for name in TRIALS], coefficients, acting, noise, rng, True)
    found = signatures(AUV, records, coefficients, noise, [(p.mechanism.key, [p]) for p in acting])
    alone = judged(AUV, records, coefficients, noise, acting, 0).fit
    return oracle_closure(found, alone, records, noise, range(len(acting)), offset, known=range(known))


def test_who_knows_the_cause_closes_the_gap_to_the_noise() -> None:
    found = closed({"speed_bias": {"b": 0.05}}, 1)
    assert found["floor"] == pytest.approx(1.0, abs=0.1)
    assert found["refit"] > found["floor"] + 0.05
    assert found["closure"] == pytest.approx(1.0, abs=0.1)


def test_what_the_oracle_does_not_know_it_does_not_close() -> None:
    """The refit here takes the first cause alone for the gap, so the second is left of both."""
    half = closed({"speed_bias": {"b": 0.05}, "depth_scale": {"k": 0.05, "b": 0.0}}, 1)
    whole = closed({"speed_bias": {"b": 0.05}, "depth_scale": {"k": 0.05, "b": 0.0}}, 2)
    assert half["with_effect"] > whole["with_effect"] + 0.02
    assert whole["with_effect"] == pytest.approx(whole["floor"], abs=0.05)
