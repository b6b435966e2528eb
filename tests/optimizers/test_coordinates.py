"""Coordinates: from a parameter's own values to the ones that a solver searches in, and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatruth.models.parameter import Parameter, Prior
from seatruth.optimizers import Coordinates, minimise
from seatruth.testing.problems import ellipsoid, half_diverges

PARAMETERS = st.one_of(
    st.builds(
        lambda a, w, f: Parameter("p", a + f * w, min=a, max=a + w, vary=True),
        st.floats(-1e6, 1e6),
        st.floats(1e-3, 1e6),
        st.floats(0, 1),
    ),
    st.builds(
        lambda s, a, w, f: Parameter(
            "p", s * a * w**f, min=min(s * a, s * a * w), max=max(s * a, s * a * w), vary=True, scale="log"
        ),
        st.sampled_from([-1, 1]),
        st.floats(1e-6, 1e3),
        st.floats(1.5, 1e6),
        st.floats(0.01, 0.99),
    ),
    st.builds(
        lambda v, sd: Parameter("p", v, vary=True, prior=Prior(v, sd)), st.floats(-1e3, 1e3), st.floats(1e-3, 1e3)
    ),
    st.builds(lambda v: Parameter("p", abs(v), min=0.0, vary=True), st.floats(-1e3, 1e3)),
    st.builds(lambda v: Parameter("p", v, min=1e-9, vary=True, scale="log"), st.floats(1e-6, 1e3)),
)


class TestCoordinates:
    @given(st.lists(PARAMETERS, min_size=1, max_size=4), st.integers(0, 2**31))
    def test_the_map_goes_there_and_back_inside_the_bounds(self, given_: list[Parameter], seed: int) -> None:
        parameters = [p.replace(name=f"p{k}") for k, p in enumerate(given_)]
        coordinates = Coordinates(parameters)
        rng = np.random.default_rng(seed)
        value = np.array([p.value for p in parameters])
        scale = np.maximum(np.abs(value), 1e-9)
        assert np.all(np.abs(coordinates.x_of(coordinates.start) - value) <= 1e-9 * scale + 1e-9)
        Z = coordinates.sample(rng, 20)
        X = coordinates.x_of(Z)
        assert np.all([p.min <= x <= p.max for row in X for p, x in zip(parameters, row)])
        assert np.allclose(coordinates.z_of(X), Z, atol=1e-6)
        assert np.all(coordinates.box_lower < coordinates.box_upper)
        assert np.isfinite([coordinates.box_lower, coordinates.box_upper]).all()
        higher = coordinates.x_of(coordinates.clip(Z + 1e-3))
        assert np.all(higher >= X), "z must rise with x"

    def test_bounded_parameters_run_from_0_to_1_and_log_ones_by_decades(self) -> None:
        plain = Parameter("a", 2.0, min=1.0, max=5.0, vary=True)
        decades = Parameter("b", 0.1, min=0.01, max=100.0, vary=True, scale="log")
        mirrored = Parameter("c", -0.1, min=-100.0, max=-0.01, vary=True, scale="log")
        c = Coordinates([plain, decades, mirrored])
        assert np.allclose(c.start, [0.25, 0.25, 0.75])
        found = c.x_of(np.array([[0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5]]))
        assert np.allclose(found, np.array([[1, 0.01, -100], [5, 100, -0.01], [3, 1, -1]]))

    def test_the_slope_is_the_derivative(self) -> None:
        c = Coordinates(
            [
                Parameter("a", 2.0, min=1.0, max=5.0, vary=True),
                Parameter("b", 0.1, min=0.01, max=100.0, vary=True, scale="log"),
                Parameter("c", -0.1, min=-100.0, max=-0.01, vary=True, scale="log"),
                Parameter("d", -40.0, vary=True),
            ]
        )
        z, h = c.start + 0.05, 1e-6
        numeric = [(c.x_of(z + h * e) - c.x_of(z - h * e))[k] / (2 * h) for k, e in enumerate(np.eye(4))]
        assert np.allclose(c.slope(z), numeric, rtol=1e-6)

    def test_starts_are_drawn_where_the_parameter_says(self) -> None:
        c = Coordinates(
            [
                Parameter("a", 2.0, min=0.0, max=10.0, vary=True, start=(4.0, 5.0)),
                Parameter("b", 3.0, vary=True, prior=Prior(1.0, 0.25)),
                Parameter("c", 1.0, min=0.01, max=100.0, vary=True, scale="log"),
                Parameter("d", 8.0, vary=True),
            ]
        )
        X = c.x_of(c.sample(np.random.default_rng(1), 4000))
        assert X[:, 0].min() >= 4.0 - 1e-9
        assert X[:, 0].max() <= 5.0 + 1e-9
        assert X[:, 1].min() >= 0.5 - 1e-9
        assert X[:, 1].max() <= 1.5 + 1e-9
        assert abs(np.mean(np.log10(X[:, 2]))) < 0.1  # uniform in the logarithm
        assert X[:, 3].min() >= 0.0
        assert X[:, 3].max() <= 16.0

    def test_the_minimum_does_not_depend_on_the_coordinates(self) -> None:
        # The maximum of the likelihood is where it is in any coordinates: no Jacobian term may move it.
        known = half_diverges()
        moved = ellipsoid("log", 1, 1.0, low=0.01, high=10.0)
        free = [p.replace(scale="log") for p in moved.cost.parameters]
        moved.cost.parameters = tuple(free)
        for name in ("least_squares", "newton", "nelder_mead", "cma_es"):
            assert minimise(moved.cost, name).x == pytest.approx([0.3], abs=1e-7)
        assert known.value == 0.0
