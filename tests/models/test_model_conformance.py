"""Every built-in model passes the suite that a third party's model inherits; so does a user's model in a few lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import pytest

from seatruth.models import Channel, Model, Parameter
from seatruth.models.abkowitz import AbkowitzShip
from seatruth.models.diving_plane import DivingPlane, DivingPlaneDriven
from seatruth.models.mmg import MMGShip
from seatruth.testing.models import ModelConformance


class TestMMG(ModelConformance):
    @pytest.fixture(params=MMGShip.sets)
    def model(self, request: Any) -> Model:
        return MMGShip(request.param)


class TestDivingPlaneDriven(ModelConformance):
    @pytest.fixture
    def model(self) -> Model:
        return DivingPlaneDriven()


class OwnShip(Model):
    """A user's model that takes the equations of a built-in one, of its class and of an instance."""

    name = "own_ship"
    title = "the Mariner with more yaw damping"
    source = "[S] made for this test"
    states, inputs, outputs = AbkowitzShip.states, AbkowitzShip.inputs, AbkowitzShip.outputs
    parameters = (*AbkowitzShip.parameters, Parameter("more", 0.01, "1/s", 0.0, 1.0, source="[S] made for this test"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u, v, r, *rest = AbkowitzShip.rhs(s, i, p, e)
        same = MARINER.rhs(s, i, p, e)
        return (u, 0.5 * (v + same[1]), r - p.more * s.r, *rest)


MARINER = AbkowitzShip()


class TestOwnShip(ModelConformance):
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {"u": (-3.0, 12.0), "r": (-0.02, 0.02)}
    start: ClassVar[Mapping[str, float]] = {"u": 7.5}

    @pytest.fixture
    def model(self) -> Model:
        return OwnShip()


class TestAbkowitz(ModelConformance):
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {"u": (-3.0, 12.0), "r": (-0.02, 0.02)}
    start: ClassVar[Mapping[str, float]] = {"u": 7.5}

    @pytest.fixture
    def model(self) -> Model:
        return AbkowitzShip()


class TestDivingPlane(ModelConformance):
    @pytest.fixture
    def model(self) -> Model:
        return DivingPlane()


class Nomoto(Model):
    """A user's model: yaw rate and heading from the rudder."""

    name = "nomoto"
    title = "Nomoto's first-order steering"
    source = "[L] Nomoto 1957"
    states = (Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("delta", "rad"),)
    outputs = states
    parameters = (
        Parameter("K", 0.2, "1/s", 0.01, 1.0, source="[S] chosen here"),
        Parameter("T", 10.0, "s", 1.0, 100.0, source="[S] chosen here"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.K * i.delta - s.r) / p.T, s.r


class TestUserModel(ModelConformance):
    @pytest.fixture
    def model(self) -> Model:
        return Nomoto()
