"""Models that leave a force from outside out of one equation are told of; those that take all, or none, are not."""

from __future__ import annotations

from typing import Any

import pytest
from asked_models import INPUTS, STATES, Unaware, study

from seatruth import Model, Parameter
from seatruth.analysis import check_study
from seatruth.costs.outside_forces import outside_forces
from seatruth.models import available, load_model


class Ship(Model):
    """A ship on which all three forces act, with added masses that couple sway and yaw."""

    name = "ship"
    states = outputs = STATES
    inputs = INPUTS
    parameters = (
        Parameter("m", 2e5, "kg", 1e5, 3e5),
        Parameter("d", 0.01, "1/m", 0.0, 1.0, vary=True),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, v = s.u - e.u_c, s.v - e.v_c
        X = p.m * (0.05 * i.n - p.d * u * abs(u)) + e.X
        Y, N = e.Y - 0.05 * p.m * v, e.N + p.m * (0.1 * i.delta - 0.2 * s.r)
        across = (20.0 * Y - 0.3 * N) / (p.m * 19.9)
        turning = (N - 0.3 * Y) / (p.m * 19.9)
        return X / p.m + v * s.r + e.du_c, across - u * s.r + e.dv_c, turning


class WithoutSurge(Ship):
    """... whose author left the force ahead out."""

    name = "without_surge"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return Ship.rhs(s, i, p, e._replace(X=0.0))


class Backwards(Ship):
    """... who counted the moment the other way."""

    name = "backwards"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return Ship.rhs(s, i, p, e._replace(N=-e.N))


def test_a_force_left_out_of_one_equation_is_told_of() -> None:
    (found,) = [one for one in check_study(study(WithoutSurge())) if one.code == "outside-forces"]
    assert found.severity == "warning"
    assert "e.X does not raise the rate of u." in found.message
    assert "Add e.X to the forces" in found.do


def test_a_moment_that_counts_the_other_way_is_told_of() -> None:
    (found,) = outside_forces(study(Backwards()))
    assert "e.N does not raise the rate of r" in found.message


@pytest.mark.parametrize("model", [Ship(), Unaware()], ids=lambda model: model.name)
def test_a_model_that_takes_all_forces_or_none_is_not(model: Model) -> None:
    assert outside_forces(study(model)) == []


@pytest.mark.parametrize("name", available())
def test_all_forces_act_on_the_models_of_seatruth(name: str) -> None:
    assert outside_forces(study(load_model(name))) == []
