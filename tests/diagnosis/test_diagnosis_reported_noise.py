"""The noise of the channels in a result."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.reported_noise import noise_of_channels
from seatruth.diagnosis.sizes import NoisePrior, first_sizes, noise_prior, noise_shapes


def test_white_and_slow_parts_stand_apart_beside_what_the_study_states(tmp_path: Path) -> None:
    folder = small.folder_with_model(tmp_path)
    problem = small.problem(folder, small.trials(folder))
    shapes = noise_shapes(problem.settings)
    slow = next(k for k, shape in enumerate(shapes) if (shape.ratio, shape.tau) == (1.7, 10.0))
    known = NoisePrior({0: 0.02}, {})
    sizes = first_sizes(problem, replace(noise_prior(problem), declared=known.declared))
    sizes = replace(sizes, shape=(slow, *(0 for _ in sizes.shape[1:])))
    first, second, *_ = noise_of_channels(Search(problem, known), sizes)
    assert (first.white, first.slow, first.tau, first.declared) == pytest.approx((0.02, 0.034, 10.0, 0.02))
    assert first.samples == int((problem.channel_of == 0).sum())
    assert second.slow == 0.0
    assert math.isnan(second.tau)
    assert math.isnan(second.declared)
