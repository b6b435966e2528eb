"""The ship as a user would write it in a file of his own: a class whose equations seatruth can see."""

from __future__ import annotations

from typing import Any

from seatruth import Model, load_model
from seatruth.models import Dimensions
from seatruth.models.mmg import motion

_SHIP = load_model("mmg")


class UserShip(Model):
    """KVLCC2 under the MMG standard method."""

    name = "user_ship"
    title = "Ship from a user's file"
    kind = "ship"
    states = _SHIP.states
    inputs = _SHIP.inputs
    outputs = _SHIP.outputs
    parameters = _SHIP.parameters

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return motion(s, i.delta, i.n, p, e)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, p.B, p.d, p.rho * p.nabla, p.rho)
