"""The pull of a line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth import Channel, Model, Parameter
from seatruth.effects import available, with_effects
from seatruth.manoeuvres import Stepper
from seatruth.models import Dimensions


class Rov(Model):
    """An ROV in the plane, whose rates are the forces on it."""

    name = "rov"
    kind = "auv"
    states = outputs = tuple(
        Channel(name, unit) for name, unit in {"u": "m/s", "v": "m/s", "r": "rad/s", "psi": "rad"}.items()
    )
    parameters = (Parameter("m", 80.0, "kg"),)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(1.2, 0.6, 0.5, p.m, 1025.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return e.X, e.Y, e.N, s.r


@pytest.mark.parametrize("heading", [0.0, 0.7, 2.0, -2.5])
def test_it_pulls_one_way_on_any_heading_at_its_place(heading: float) -> None:
    model = with_effects(Rov(), [available()["line_pull"]])
    one = Stepper(model, {"line_pull_north": 6.0, "line_pull_east": -3.0, "line_pull_lever": -0.4})
    X, Y, N, _ = one.rate(0.0, one.first({"u": 0.3, "v": 0.1, "psi": heading}), {})
    c, d = math.cos(heading), math.sin(heading)
    assert (c * X - d * Y, d * X + c * Y) == pytest.approx((6.0, -3.0))
    assert pytest.approx(-0.4 * 1.2 * Y) == N


def test_it_is_as_large_as_the_vehicle_is_heavy_and_begins_all_around() -> None:
    effect = available()["line_pull"]
    priors = effect.priors(Rov())
    assert priors["north"].sd == priors["east"].sd == pytest.approx(7.85, abs=0.01)
    begun = [math.atan2(one["east"], one["north"]) for one in effect.starting_points(Rov())]
    assert np.diff(sorted(np.mod(begun, 2 * math.pi))) == pytest.approx(math.pi / 4)
    assert "acts on auv" in effect.missing(type("Ship", (Rov,), {"kind": "ship"})())


def test_its_place_is_known_to_a_part_of_the_length_however_heavy_the_vehicle_is() -> None:
    effect = available()["line_pull"]
    assert effect.priors(Rov())["lever"] == effect.shape_priors["lever"]
