"""The search of sizes: smooth functions whose top is known, and shapes of simulated noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.size_search import maximise, with_shape
from seatruth.diagnosis.sizes import Sizes, noise_shapes
from seatruth.statistics.state_space_noise import whiten

SETTINGS = Settings()


def sizes(**changes: object) -> Sizes:
    start = Sizes(np.log([0.1, 0.5]), (0, 0), np.log([0.1, 0.1]), np.log([0.1, 0.1]), np.zeros(1))
    return replace(start, **changes)


class Function:
    """An objective whose slopes and curvature are differences."""

    def __init__(self, function: Callable[[Sizes], float], least: float = -math.inf) -> None:
        self.function, self.lowest, self.asked_for_noise = function, least, set[bool]()

    def __call__(self, sizes: Sizes) -> float:
        return self.function(sizes)

    def slopes(self, sizes: Sizes, *, noise: bool) -> tuple[Array, Array]:
        self.asked_for_noise.add(noise)
        n, h = len(sizes.vector), 1e-4
        moving = [k for k in range(n) if np.isfinite(sizes.vector[k])]
        slope, curvature = np.zeros(n), np.zeros((n, n))

        def at(*steps: tuple[int, float]) -> float:
            moved = sizes.vector
            for k, step in steps:
                moved[k] += step
            return self.function(sizes.at(moved))

        for a in moving:
            slope[a] = (at((a, h)) - at((a, -h))) / (2.0 * h)
            for b in moving:
                cross = at((a, h), (b, h)) - at((a, h), (b, -h)) - at((a, -h), (b, h)) + at((a, -h), (b, -h))
                curvature[a, b] = -cross / (4.0 * h * h)
        return slope, curvature

    def outlook(self, sizes: Sizes, c: int) -> Callable[[int, float], float]:
        """Nothing else moves with the noise: what a shape is worth is what the objective says of it."""
        return lambda shape, log_white: self.function(with_shape(sizes, c, shape, log_white))

    def least(self, sizes: Sizes) -> Array:
        found = np.full(len(sizes.vector), -math.inf)
        found[: len(sizes.white)] = self.lowest
        return found


@Function
def smooth(s: Sizes) -> float:
    return -float(
        10.0 * ((s.white - np.log([0.3, 0.2])) ** 2).sum()
        + ((s.terms - np.log([0.02, 0.3])) ** 2).sum()
        + (s.forces[0] - s.terms[0]) ** 2
        + (s.forces[1] + 2.0) ** 2
        + (math.atanh(s.coupling[0]) - 0.5) ** 2
    )


def test_it_finds_the_top_of_a_smooth_function() -> None:
    best, value = maximise(smooth, sizes(), SETTINGS, channels=(0, 1), shapes=False, sweeps=3)
    assert value == pytest.approx(smooth(best))
    assert value > -0.01
    np.testing.assert_allclose(np.exp(best.white), [0.3, 0.2], rtol=0.02)


def test_no_noise_goes_below_its_least() -> None:
    held = Function(smooth.function, least=math.log(0.25))
    best, _ = maximise(held, sizes(white=np.log([0.4, 0.4])), SETTINGS, channels=(0, 1), shapes=False, sweeps=3)
    np.testing.assert_allclose(np.exp(best.white), [0.3, 0.25], rtol=0.02)
    assert best.white[1] == math.log(0.25)


def test_where_a_whole_step_falls_a_shorter_one_is_taken() -> None:
    """Newton's step of sqrt(1 + x^2) overshoots from beyond 1, ever further."""

    @Function
    def far(s: Sizes) -> float:
        return -float(np.sqrt(1.0 + (s.white - 1.0) ** 2).sum())

    best, value = maximise(far, sizes(white=np.array([3.0, -2.0])), SETTINGS, channels=(0, 1), shapes=False, sweeps=9)
    np.testing.assert_allclose(best.white, 1.0, atol=0.2)
    assert value == pytest.approx(-2.0, abs=0.02)


def test_where_the_algebra_fails_it_stays() -> None:
    class Failing(Function):
        def slopes(self, sizes: Sizes, *, noise: bool) -> tuple[Array, Array]:
            raise np.linalg.LinAlgError("rounding")

    best, value = maximise(Failing(smooth.function), sizes(), SETTINGS, channels=(0, 1), shapes=False)
    assert (best.vector == sizes().vector).all()
    assert value == smooth(sizes())


def test_it_never_gets_worse_and_leaves_other_channels_alone() -> None:
    @Function
    def objective(s: Sizes) -> float:
        return -float((s.white**2).sum())

    best, value = maximise(objective, sizes(), SETTINGS, channels=(1,), sweeps=3)
    assert value >= objective(sizes())
    assert best.white[0] == sizes().white[0]


def test_the_noise_may_be_held() -> None:
    rising = Function(lambda s: float(s.white.sum() - ((s.terms - 1.0) ** 2).sum()))
    best, _ = maximise(rising, sizes(), SETTINGS, channels=(0, 1), noise=False)
    np.testing.assert_array_equal(best.white, sizes().white)
    assert best.shape == (0, 0)
    np.testing.assert_allclose(best.terms, 1.0, atol=0.01)
    assert rising.asked_for_noise == {False}


def test_it_finds_the_shape_of_noise_by_its_neighbours() -> None:
    """The likelihood of a simulated series: half white, half slow."""
    rng = np.random.default_rng(0)
    n, ratio, tau = 4000, 1.0, 10.0
    t, slow = np.arange(float(n)), np.zeros(4000)
    fade = math.exp(-1.0 / tau)
    for k in range(1, n):
        slow[k] = fade * slow[k - 1] + ratio * math.sqrt(1.0 - fade**2) * rng.normal()
    series = 0.2 * (rng.normal(size=n) + slow)
    shapes = noise_shapes(SETTINGS)

    @Function
    def objective(s: Sizes) -> float:
        white, log_determinant = whiten(series, t, shapes[s.shape[0]])
        return -0.5 * float(white @ white) * math.exp(-2.0 * s.white[0]) - n * float(s.white[0]) - 0.5 * log_determinant

    start = sizes(white=np.log([0.1, 0.5])).without_discrepancy()
    best, _ = maximise(objective, start, SETTINGS, channels=(0,), sweeps=10)
    found = shapes[best.shape[0]]
    assert found.ratio == 1.0
    assert found.tau == 10.0
    assert math.exp(best.white[0]) == pytest.approx(0.2, rel=0.05)


@pytest.mark.parametrize(("behind", "tried"), [(0.0, True), (60.0, False)])
def test_a_shape_that_the_residuals_refuse_is_not_tried(behind: float, tried: bool) -> None:
    asked: set[int] = set()

    class Refused(Function):
        def outlook(self, sizes: Sizes, c: int) -> Callable[[int, float], float]:
            return lambda shape, log_white: -behind * (shape != sizes.shape[c])

    def function(s: Sizes) -> float:
        asked.add(s.shape[0])
        return float(s.shape[0] > 0)

    best, _ = maximise(Refused(function), sizes().without_discrepancy(), SETTINGS, channels=(0,), sweeps=1)
    assert (len(asked) > 1, best.shape[0] > 0) == (tried, tried)


def test_of_a_channel_the_shapes_that_its_residuals_like_best_are_tried() -> None:
    asked: list[int] = []

    class Liking(Function):
        def outlook(self, sizes: Sizes, c: int) -> Callable[[int, float], float]:
            return lambda shape, log_white: 0.1 * shape

    def function(s: Sizes) -> float:
        asked.append(s.shape[0])
        return -float(s.shape[0] > 0)

    best, _ = maximise(Liking(function), sizes().without_discrepancy(), SETTINGS, channels=(0,), sweeps=1)
    assert best.shape == (0, 0)
    tried = [shape for shape in asked if shape > 0]
    assert len(tried) == 2
    assert set(tried) == {1 + 3 * len(SETTINGS.noise_times) + 3}  # the largest and slowest, by two white deviations
