"""Models that name their actuators: what they may declare, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from seatruth import BadInput
from seatruth.models import Channel, Model, Parameter, Rudder, Thruster
from seatruth.models.actuators import entry

PORT = Thruster("port", "n", at=(-0.5, "-b", 0.0), towards=(1.0, 0.0, 0.0), full=20.0)


def model(*actuators: Rudder | Thruster, thrusts: bool = False) -> Model:
    class Boat(Model):
        name = "boat"
        states = outputs = (Channel("u", "m/s"),)
        inputs = (Channel("n", "rev/s"), Channel("helm", "rad"))
        parameters = (Parameter("b", 0.3, "m"),)

        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return (i.n - s.u,)

    Boat.actuators = actuators
    if thrusts:
        Boat.thrusts = staticmethod(lambda s, i, p, e: (i.n,))
    return Boat()


def test_entries_are_numbers_or_parameters() -> None:
    class P:
        b = 0.3

    assert [entry(value, P) for value in PORT.at] == [-0.5, -0.3, 0.0]
    assert entry("b", P) == 0.3
    assert model(PORT, Rudder("nozzle", "n", full=20.0)).actuators[0].kind == "thruster"
    assert (Rudder("nozzle", "n").kind, Rudder("plane", "n", turns="pitch").kind) == ("rudder", "plane")


@pytest.mark.parametrize(
    ("actuators", "said"),
    [
        ((Rudder("a rudder", "n"),), "not a usable name"),
        ((PORT, replace(PORT, towards=(0.0, 1.0, 0.0))), "two actuators are called 'port'"),
        ((Rudder("rudder", "delta"),), "the input 'delta'"),
        ((replace(PORT, at=("beam", 0.0, 0.0)),), "'beam', which is no parameter"),
        ((replace(PORT, full=0.0),), "a positive input at full power"),
        ((Rudder("jet", "n"),), "'jet' is in rev/s, no angle: state `full`, the input hard over, in rev/s"),
        ((Rudder("jet", "n", full=-1.0),), "'jet' needs a positive input hard over"),
        ((Rudder("helm", "helm", full=0.6),), "'helm' is an angle, which needs no `full`"),
        ((replace(PORT, diameter=-1.0),), "a positive diameter"),
    ],
)
def test_what_is_wrong_is_said(actuators: tuple[Any, ...], said: str) -> None:
    with pytest.raises(BadInput, match=said):
        model(*actuators)


def test_thrusts_need_thrusters() -> None:
    with pytest.raises(BadInput, match="names no Thruster"):
        model(Rudder("rudder", "n", full=20.0), thrusts=True)
