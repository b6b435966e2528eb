"""Waves are begun where the spectrum of what is left shows them, and nowhere else."""

from __future__ import annotations

import math

import boat_case as boat
import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.diagnosis import Diagnosis, diagnose
from seatruth.diagnosis.wave_search import _bands, _best, _frequencies, _Track
from seatruth.effects.kinematics import G
from seatruth.effects.waves import WaveForces
from seatruth.statistics.state_space_noise import NoiseShape

FREQUENCY, TOWARDS = 1.2, 0.8


def _tracks(size: float) -> list[_Track]:
    """Surge speed on four courses, sampled at 1 Hz with noise of 1, in a wave of this size."""
    rng, t, found = np.random.default_rng(3), np.arange(200.0), []
    for heading in (0.0, 1.5, 3.0, 4.5):
        north, east = 3.0 * t * math.cos(heading), 3.0 * t * math.sin(heading)
        along = north * math.cos(TOWARDS) + east * math.sin(TOWARDS)
        phase = FREQUENCY * t - FREQUENCY**2 / G * along + rng.uniform(0.0, 6.0)
        left = size * math.cos(TOWARDS - heading) * np.cos(phase) + rng.normal(size=t.size)
        found.append(_Track(t, left, north, east, np.full(t.size, heading), NoiseShape(), 1.0))
    return found


def test_frequency_and_direction_of_a_wave_are_read_from_several_courses() -> None:
    tracks = _tracks(1.5)
    showing, near = _bands(tracks, _frequencies(tracks))
    assert near.size
    assert len(showing) > 1
    frequency, towards = _best(tracks, showing, near)
    assert frequency == pytest.approx(FREQUENCY, rel=0.01)
    assert abs((towards - TOWARDS + math.pi) % (2.0 * math.pi) - math.pi) < 0.1


def test_noise_shows_no_band() -> None:
    tracks = _tracks(0.0)
    showing, near = _bands(tracks, _frequencies(tracks))
    assert not showing
    assert not near.size
    assert not _frequencies([]).size


def _diagnosis(size: float) -> Diagnosis:
    """Of four zigzags in a wave that meets each in another phase, of this size in m/s2."""
    waves = WaveForces([f"run_{k}" for k in range(4)])
    phases: Array = np.random.default_rng(5).uniform(0.0, 6.0, 4)
    truth = {"wave_forces_ln_frequency": math.log(FREQUENCY), "wave_forces_towards": TOWARDS}
    for k, phase in enumerate(phases):
        truth |= {f"wave_forces_cosine_run_{k}": size * math.cos(phase)}
        truth |= {f"wave_forces_sine_run_{k}": size * math.sin(phase)}
    angles = [{"delta": boat.zigzag(120, 0.3, 15.0)} for _ in range(4)]
    runs = boat.trials(boat.Hull(), angles, headings=(0.0, 1.5, 3.0, 4.5), effects=truth, specs=(waves,))
    return diagnose(
        boat.study(boat.Hull(), runs, boat.NOISE), effects=["wave_forces", "current", "gyro_bias"], threads=1
    )


@pytest.mark.slow
def test_waves_of_another_phase_in_each_trial_are_named_with_their_period() -> None:
    found = _diagnosis(0.05)
    assert found.verdict.effects == ("wave_forces",)
    values = {q.name: q for q in found.effect("wave_forces").parameters}
    for name, truth in (("ln_frequency", math.log(FREQUENCY)), ("towards", TOWARDS)):
        assert abs(values[name].value - truth) < 3.0 * values[name].stderr
    assert "in waves of 5.2" in found.verdict.sentence
    assert found.verdict.causes[0].share > 0.8


@pytest.mark.slow
def test_no_waves_are_named_in_a_calm() -> None:
    assert _diagnosis(0.0).verdict.kind == "no_gap"
