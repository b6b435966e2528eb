"""The MMG ship with its steering gear as a state of the equations, as the peers of the engine integrate it.

seatruth itself solves a servo exactly (`seatruth.models.WithServos`); to compare engines, all take the same equations.
"""

from __future__ import annotations

from typing import Any

from seatruth.models import Channel, Parameter
from seatruth.models.mmg import REVOLUTIONS, RUDDER, MMGShip, motion
from seatruth.models.ship_parameters import KVLCC2


class OrderedShip(MMGShip):
    """The steering gear follows the order with a lag and a rate limit; the rudder starts at the first order."""

    name = "ordered_ship"
    title = "Ship, MMG standard method, with the steering gear between order and rudder"
    states = (*MMGShip.states, RUDDER)
    inputs = (Channel("delta_order", "rad", "rudder order, positive turns to starboard"), REVOLUTIONS)
    parameters = (
        *KVLCC2,
        Parameter("rudder_rate", 0.2757620218, "rad/s", 0.02, 0.7, source="[L] 15.8 deg/s, KVLCC2 L-7 model tests"),
        Parameter("T_rudder", 0.5, "s", 0.05, 5.0, source="[S] chosen here", description="lag of the steering gear"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        turn = max(-p.rudder_rate, min(p.rudder_rate, (i.delta_order - s.delta) / p.T_rudder))
        return (*motion(s, s.delta, i.n, p, e), turn)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.u, y.v, y.r, y.x, y.y, y.psi, i.delta_order
