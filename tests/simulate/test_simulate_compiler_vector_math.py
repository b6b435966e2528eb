"""The engine's vector functions against extended precision, in units of the last place, over all doubles."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from seatruth.models.base import Model
from seatruth.simulate import evaluate_rhs
from seatruth.trials.channel import Channel

Array = NDArray[np.float64]
EXTENDED = np.finfo(np.longdouble).nmant >= 63


def model_of(function: Callable[..., Any], arity: int) -> Model:
    """A model whose first rate is the function of its states."""

    class Probe(Model):
        name = "probe"
        states = tuple(Channel(f"x{k}", "1") for k in range(arity))
        outputs = states

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return (function(*s), *([0.0] * (arity - 1)))

    return Probe()


def evaluated(function: Callable[..., Any], *arguments: Array) -> Array:
    rows = np.stack(arguments, axis=1)
    found = evaluate_rhs(model_of(function, len(arguments)), np.zeros(0), (), {}, rows, np.zeros((len(rows), 0)))
    return found[:, 0]


def ulps(found: Array, exact: NDArray[np.longdouble]) -> Array:
    """Distance in units of the last place of the rounded exact value; infinities and NaN must be the same."""
    rounded = exact.astype(np.float64)
    special = ~np.isfinite(rounded)
    assert np.array_equal(found[special], rounded[special], equal_nan=True)
    with np.errstate(invalid="ignore"):
        distance = np.abs(found.astype(np.longdouble) - exact) / np.spacing(np.abs(rounded))
    distance[special] = 0.0
    return distance.astype(np.float64)


def spread(size: int, low: int, high: int, seed: int = 1) -> Array:
    """Numbers of both signs with exponents evenly between 2^low and 2^high."""
    rng = np.random.default_rng(seed)
    sign = rng.choice([-1.0, 1.0], size)
    return np.asarray(sign * np.exp2(rng.uniform(low, high, size)))


ALL = np.concatenate(
    [spread(200_000, -1074, 1024), spread(200_000, -30, 12), np.array([0.0, -0.0, math.inf, -math.inf, math.nan])]
)
QUARTERS = np.concatenate(
    [np.nextafter(k * math.pi / 2, d) for d in (-math.inf, math.inf) for k in [np.arange(1.0, 5e4)]]
)
ANGLES = np.concatenate([ALL, spread(200_000, 12, 60), QUARTERS])


@pytest.mark.skipif(not EXTENDED, reason="this machine has no extended precision to compare with")
@pytest.mark.parametrize(
    ("function", "exact", "points", "most"),
    [
        (math.sin, np.sin, ANGLES[np.abs(ANGLES) < 2.0**62], 1.5),
        (math.cos, np.cos, ANGLES[np.abs(ANGLES) < 2.0**62], 1.5),
        (math.tan, np.tan, ANGLES[np.abs(ANGLES) < 2.0**62], 4.0),
        (math.exp, np.exp, np.concatenate([ALL, np.linspace(-750.0, 712.0, 400_000)]), 1.0),
        (math.expm1, np.expm1, np.concatenate([ALL, np.linspace(-40.0, 712.0, 400_000)]), 2.5),
        (math.log, np.log, np.concatenate([np.abs(ALL), np.linspace(0.5, 2.0, 400_000)]), 1.0),
        (math.tanh, np.tanh, ALL, 3.0),
        (math.atan, np.arctan, ALL, 2.0),
        (math.sqrt, np.sqrt, np.abs(ALL), 0.51),
        (math.asin, np.arcsin, np.linspace(-1.0, 1.0, 100_000), 1.0),
        (math.acos, np.arccos, np.linspace(-1.0, 1.0, 100_000), 1.0),
        (math.sinh, np.sinh, np.linspace(-712.0, 712.0, 100_000), 2.5),
        (math.cosh, np.cosh, np.linspace(-712.0, 712.0, 100_000), 2.5),
        (math.log1p, np.log1p, np.linspace(-0.999, 1e3, 100_000), 1.5),
        (math.log10, np.log10, np.abs(ALL), 2.0),
        (math.cbrt, np.cbrt, ALL, 4.0),
    ],
)
def test_functions_over_their_range(function: Any, exact: Any, points: Array, most: float) -> None:
    with np.errstate(all="ignore"):
        worst = ulps(evaluated(function, points), exact(points.astype(np.longdouble)))
    where = int(worst.argmax())
    assert worst[where] <= most, f"{function.__name__}({points[where]!r}) is off by {worst[where]:.2f} ulp"


@pytest.mark.skipif(not EXTENDED, reason="this machine has no extended precision to compare with")
def test_two_arguments() -> None:
    y, x = spread(300_000, -300, 300, 2), spread(300_000, -300, 300, 3)
    near = spread(300_000, -3, 3, 4)
    y, x = np.concatenate([y, near]), np.concatenate([x, near[::-1]])
    wide = [v.astype(np.longdouble) for v in (y, x)]
    assert ulps(evaluated(math.atan2, y, x), np.arctan2(*wide)).max() <= 2.0
    far, other = spread(200_000, -1074, 1023, 5), spread(200_000, -1074, 1023, 6)
    both = [np.concatenate([a, b]) for a, b in ((far, y), (other, x))]
    exact = np.hypot(*(v.astype(np.longdouble) for v in both))
    assert ulps(evaluated(math.hypot, *both), exact).max() <= 1.5


def test_atan2_in_every_corner() -> None:
    corners = [0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, 5e-324, -5e-324, 1.7e308, -1.7e308, math.nan]
    y, x = (np.array(v) for v in zip(*((a, b) for a in corners for b in corners)))
    expected = np.arctan2(y, x)
    assert evaluated(math.atan2, y, x) == pytest.approx(expected, rel=1e-15, abs=0.0, nan_ok=True)
    assert np.array_equal(
        np.signbit(evaluated(math.atan2, y, x)[~np.isnan(expected)]), np.signbit(expected[~np.isnan(expected)])
    )


def test_angles_beyond_the_fast_reduction_are_those_of_the_c_library() -> None:
    points = spread(5_000, 41, 1023)
    assert evaluated(math.sin, points) == pytest.approx([math.sin(x) for x in points], rel=1e-15)
    assert evaluated(math.cos, points) == pytest.approx([math.cos(x) for x in points], rel=1e-15)


@pytest.mark.parametrize("power", [-3, -1, 0, 1, 2, 3, 4, 5, 7, 16, 0.5, 1.5, -0.5, 2.5, 0.7, 1 / 3, 20, -2.2])
def test_powers(power: float) -> None:
    points = np.linspace(0.01, 30.0, 1_000)
    assert evaluated(lambda x: x**power, points) == pytest.approx(points**power, rel=1e-14)


@pytest.mark.parametrize(
    ("function", "numpy_function"),
    [
        (lambda a, b: a % b, np.mod),
        (math.fmod, np.fmod),
        (math.copysign, np.copysign),
        (min, np.minimum),
        (max, np.maximum),
        (np.arctan2, np.arctan2),
        (math.pow, np.power),
    ],
)
def test_the_rest_of_two_arguments(function: Any, numpy_function: Any) -> None:
    rng = np.random.default_rng(1)
    a, b = rng.uniform(0.1, 9.0, 1_000), rng.uniform(0.1, 3.0, 1_000)
    assert evaluated(function, a, b) == pytest.approx(numpy_function(a, b), rel=1e-13, abs=1e-13)


@pytest.mark.parametrize(
    "function", [abs, math.fabs, np.sign, math.floor, math.ceil, math.trunc, np.square, math.radians]
)
def test_the_rest_of_one_argument(function: Any) -> None:
    points = np.concatenate([np.linspace(-5.0, 5.0, 1_001), [0.0]])
    expected = [float(function(float(x))) for x in points]
    assert evaluated(function, points) == pytest.approx(expected, rel=1e-15)
