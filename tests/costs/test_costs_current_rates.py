"""Models that forget how a current changes in axes that turn are told of; those that know it are not."""

from __future__ import annotations

from typing import Any

import pytest
from asked_models import INPUTS, STATES, Unaware, study

from seatruth import Model, Parameter
from seatruth.analysis import check_study
from seatruth.costs.current_rates import current_rates
from seatruth.models import available, load_model


class Ship(Model):
    """A ship whose equations know how the water moves it."""

    name = "ship"
    states = outputs = STATES
    inputs = INPUTS
    parameters = (Parameter("d", 0.01, "1/m", 0.0, 1.0, vary=True),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, v, r = s.u - e.u_c, s.v - e.v_c, s.r
        ahead = 0.05 * i.n - p.d * u * abs(u) + v * r + e.X
        return ahead + e.du_c, -0.05 * v - u * r + e.dv_c + e.Y, 0.1 * i.delta - 0.2 * r + e.N


class Forgetful(Ship):
    """... and one whose author forgot that the current turns in the ship's axes."""

    name = "forgetful"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        rates = Ship.rhs(s, i, p, e)
        return rates[0] - e.du_c, rates[1] - e.dv_c, rates[2]


class InAir(Ship):
    """The first one with drag in air, which is that of the velocity over the ground."""

    name = "in_air"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        rates = Ship.rhs(s, i, p, e)
        return rates[0] - 2e-4 * s.u * abs(s.u), rates[1] - 2e-4 * s.v * abs(s.v), rates[2]


def test_a_model_that_forgets_the_turning_is_told_of() -> None:
    (found,) = [one for one in check_study(study(Forgetful())) if one.code == "current-rates"]
    assert found.severity == "warning"
    assert "du/dt changes by 0 m/s2 where an even current adds r v_c = 0.0" in found.message
    assert "add e.du_c to the rate of u" in found.do


@pytest.mark.parametrize("model", [Ship(), InAir(), Unaware()], ids=lambda model: model.name)
def test_a_model_that_knows_it_or_needs_not_is_not(model: Model) -> None:
    assert current_rates(study(model)) == []


@pytest.mark.parametrize("name", available())
def test_the_models_of_seatruth_turn_rightly(name: str) -> None:
    model = load_model(name)
    if {"u", "v", "r"} <= {channel.name for channel in model.states} & {channel.name for channel in model.outputs}:
        assert current_rates(study(model)) == []
