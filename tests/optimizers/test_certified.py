"""least_squares and newton against the certified values of NIST's StRD, and minima known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.models.parameter import Parameter
from seatruth.optimizers import Budget, make, minimise
from seatruth.testing.problems import ResidualCost, at_bound, rosenbrock


@dataclass(frozen=True)
class Certified:
    """One data set of the NIST Statistical Reference Datasets, nonlinear: two starts, certified b and RSS."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    model: Callable[[Array, Array], Array]
    starts: tuple[tuple[float, ...], tuple[float, ...]]
    b: tuple[float, ...]
    rss: float

    def cost(self, start: int) -> ResidualCost:
        x, y = np.array(self.x), np.array(self.y)

        def residuals(B: Array) -> Array:
            with np.errstate(all="ignore"):
                return np.asarray(y - self.model(x, B.T[..., None]))

        def derivative(b: Array) -> Array:
            # The models are analytic, so the complex step gives derivatives to rounding.
            h = 1e-30
            columns = [self.model(x, (b + 1j * h * e)[:, None, None])[0].imag / h for e in np.eye(len(b))]
            return -np.column_stack(columns)

        free = [Parameter(f"b{k + 1}", v, vary=True) for k, v in enumerate(self.starts[start])]
        return ResidualCost(self.name, free, residuals, derivative)


def _rational(x: Array, b: Array) -> Array:
    return np.asarray((b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3))


def _saturation(x: Array, b: Array) -> Array:
    return np.asarray(b[0] * (1 - np.exp(-b[1] * x)))


MISRA1A = Certified(
    "Misra1a",
    (77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0),
    (10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78),
    _saturation,
    ((500.0, 1e-4), (250.0, 5e-4)),
    (2.3894212918e02, 5.5015643181e-04),
    1.2455138894e-01,
)
BOXBOD = Certified(
    "BoxBOD",
    (1.0, 2.0, 3.0, 5.0, 7.0, 10.0),
    (109.0, 149.0, 149.0, 191.0, 213.0, 224.0),
    _saturation,
    ((1.0, 1.0), (100.0, 0.75)),
    (2.1380940889e02, 5.4723748542e-01),
    1.1680088766e03,
)
DANWOOD = Certified(
    "DanWood",
    (1.309, 1.471, 1.490, 1.565, 1.611, 1.680),
    (2.138, 3.421, 3.597, 4.340, 4.882, 5.660),
    lambda x, b: b[0] * x ** b[1],
    ((1.0, 5.0), (0.7, 4.0)),
    (7.6886226176e-01, 3.8604055871e00),
    4.3173084083e-03,
)
THURBER_X = (
    *(-3.067, -2.981, -2.921, -2.912, -2.840, -2.797, -2.702, -2.699, -2.633, -2.481, -2.363, -2.322, -1.501),
    *(-1.460, -1.274, -1.212, -1.100, -1.046, -0.915, -0.714, -0.566, -0.545, -0.400, -0.309, -0.109, -0.103),
    *(0.010, 0.119, 0.377, 0.790, 0.963, 1.006, 1.115, 1.572, 1.841, 2.047, 2.200),
)
THURBER_Y = (
    *(80.574, 84.248, 87.264, 87.195, 89.076, 89.608, 89.868, 90.101, 92.405, 95.854, 100.696, 101.060, 401.672),
    *(390.724, 567.534, 635.316, 733.054, 759.087, 894.206, 990.785, 1090.109, 1080.914, 1122.643, 1178.351),
    *(1260.531, 1273.514, 1288.339, 1327.543, 1353.863, 1414.509, 1425.208, 1421.384, 1442.962, 1464.350),
    *(1468.705, 1447.894, 1457.628),
)
THURBER = Certified(
    "Thurber",
    THURBER_X,
    THURBER_Y,
    _rational,
    ((1000.0, 1000.0, 400.0, 40.0, 0.7, 0.3, 0.03), (1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05)),
    (
        *(1.2881396800e03, 1.4910792535e03, 5.8323836877e02, 7.5416644291e01),
        *(9.6629502864e-01, 3.9797285797e-01, 4.9727297349e-02),
    ),
    5.6427082397e03,
)


@pytest.mark.parametrize("optimizer", ["least_squares", "newton"])
@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("known", [MISRA1A, DANWOOD, THURBER, BOXBOD], ids=lambda known: known.name)
def test_certified_values(known: Certified, start: int, optimizer: str) -> None:
    outcome = minimise(known.cost(start), make(optimizer, tolerance=1e-14), budget=Budget(20_000))
    assert outcome.code == "converged"
    if (known.name, start, optimizer) == ("BoxBOD", 0, "newton"):
        # NIST's hardest start: short first steps are needed, or the search ends on the plateau at infinite b2.
        assert 2 * outcome.value == pytest.approx(9771.5)
        outcome = minimise(known.cost(start), make("newton", tolerance=1e-14, initial_damping=100.0))
    assert 2 * outcome.value == pytest.approx(known.rss, rel=2e-10)
    assert outcome.x == pytest.approx(np.array(known.b), rel=2e-7)


@pytest.mark.parametrize("start", [0, 1])
@pytest.mark.parametrize("known", [MISRA1A, THURBER], ids=lambda known: known.name)
def test_the_last_steps_give_six_digits_with_the_usual_options(known: Certified, start: int) -> None:
    # Without them Thurber stops at 4.8 to 5.7 digits, where the cost falls by less than 1e-10.
    assert minimise(known.cost(start), "least_squares").x == pytest.approx(np.array(known.b), rel=1e-6)
    rough = minimise(known.cost(start), make("least_squares", polish=0))
    assert rough.evaluations < minimise(known.cost(start), "least_squares").evaluations


def test_undamped_newton_converges_quadratically_near_the_minimum() -> None:
    outcome = minimise(MISRA1A.cost(1), make("newton", damping="none"))
    assert outcome.x == pytest.approx(np.array(MISRA1A.b), rel=1e-7)
    steps = outcome.evaluations / 4  # a residual, a Jacobian of two columns and the check of the step
    assert steps <= 12


def test_damping_is_what_keeps_newton_from_diverging() -> None:
    """Where it ends without damping, rounding decides: at its last step, or at a worse minimum."""
    undamped = minimise(THURBER.cost(0), make("newton", damping="none", iterations=60))
    assert 2 * undamped.value > 1.1 * THURBER.rss  # a cost is half the sum of squares
    assert minimise(BOXBOD.cost(0), make("newton", damping="none")).code == "failed"
    damped = minimise(THURBER.cost(0), "newton")
    assert damped.value == pytest.approx(THURBER.rss / 2, rel=1e-9)
    assert undamped.evaluations > damped.evaluations


@pytest.mark.parametrize("optimizer", ["least_squares", "newton", "secant"])
def test_minimum_at_a_bound(optimizer: str) -> None:
    known = at_bound()
    assert minimise(known.cost, optimizer).x == pytest.approx(known.x, abs=1e-7)


@pytest.mark.parametrize("optimizer", ["least_squares", "newton", "secant"])
def test_a_start_that_diverges_is_replaced(optimizer: str) -> None:
    known = rosenbrock()

    class Cliff(ResidualCost):
        def __init__(self) -> None:
            inner = known.cost
            assert isinstance(inner, ResidualCost)
            super().__init__("cliff", inner.parameters, inner._residuals, inner._derivative)

        def residuals(self, x: Array) -> Array:
            return np.full(2, np.nan) if x[0] < -1.0 else super().residuals(x)

    outcome = minimise(Cliff(), optimizer, seed=2)
    assert outcome.x == pytest.approx([1.0, 1.0], abs=1e-6)
    assert outcome.diverged >= 1


@pytest.mark.parametrize("optimizer", ["least_squares", "newton", "secant"])
def test_a_search_without_a_start_has_failed(optimizer: str) -> None:
    inner = rosenbrock().cost
    nowhere = ResidualCost("nowhere", inner.parameters, lambda X: np.full((len(X), 2), np.nan), inner.jacobian)
    outcome = minimise(nowhere, make(optimizer, tries=3))
    assert (outcome.code, outcome.evaluations) == ("failed", 4)
    assert "the start and 3 random starts" in outcome.reason


def test_newton_keeps_signs() -> None:
    cost = ResidualCost(
        "sign",
        [Parameter("a", 0.5, min=-2.0, max=2.0, vary=True)],
        lambda X: np.column_stack([X[:, 0] + 0.7]),
        lambda x: np.eye(1),
    )
    assert minimise(cost, "newton").x == pytest.approx([-0.7])
    assert 0 <= minimise(cost, make("newton", keep_signs=True)).x[0] < 1e-3


class TwoInstruments(ResidualCost):
    """One constant seen by two instruments of unknown noise: maximum likelihood with estimated variances."""

    def __init__(self, first: Array, second: Array) -> None:
        self.data, self.sigma = (first, second), [1.0, 1.0]

        def residuals(X: Array) -> Array:
            return np.hstack([(X - d) / s for d, s in zip(self.data, self.sigma)])

        def derivative(x: Array) -> Array:
            return np.concatenate([np.full(len(d), 1 / s) for d, s in zip(self.data, self.sigma)])[:, None]

        super().__init__("two instruments", [Parameter("a", 0.0, vary=True)], residuals, derivative)

    def reweight(self, x: Array) -> bool:
        before = list(self.sigma)
        self.sigma = [float(np.sqrt(np.mean((d - x[0]) ** 2))) for d in self.data]
        return self.sigma != before


def test_newton_alternates_with_the_innovation_covariance() -> None:
    rng = np.random.default_rng(8)
    first, second = 3.0 + 0.1 * rng.normal(size=60), 3.0 + 2.0 * rng.normal(size=40)
    cost = TwoInstruments(first, second)
    a = float(minimise(cost, "newton").x[0])
    # At the maximum of the likelihood, sum n/2 ln(mean square) has no slope.
    slope = sum(float(len(d) * np.mean(a - d) / np.mean((a - d) ** 2)) for d in (first, second))
    curvature = 60 / 0.1**2
    assert abs(slope / curvature) < 1e-7
    assert cost.sigma == pytest.approx([0.1, 2.0], rel=0.3)
    assert abs(a - 3.0) < 4 * 0.1 / np.sqrt(60)
