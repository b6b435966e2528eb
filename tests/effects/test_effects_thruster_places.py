"""Thrusters whose equations and declared places contradict each other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from twin import Twin

from seatruth import BadInput, load_model
from seatruth.effects.thruster_places import check_thruster_places
from seatruth.models import Thruster


class Exchanged(Twin):
    """The left thruster is declared to starboard, and the right one to port."""

    actuators = (
        *(
            replace(one, at=(-0.6, f"{sign}half_beam", 0.0))
            for one, sign in zip(Twin.actuators, ("", "-"))
            if isinstance(one, Thruster)
        ),
        Twin.actuators[2],
    )


class OtherOrder(Twin):
    """Its forces come in another order than its thrusters."""

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return Twin.thrusts(s, i, p, e)[::-1]


@pytest.mark.parametrize("model", [Exchanged(), OtherOrder()])
def test_what_turns_the_other_way_than_it_is_declared_is_refused(model: Twin) -> None:
    with pytest.raises(BadInput) as caught:
        check_thruster_places(model)
    assert "'left' turns the model to starboard by its equations, and to port by its place" in str(caught.value)


def test_what_is_declared_as_it_turns_is_not() -> None:
    check_thruster_places(Twin())
    check_thruster_places(load_model("bluerov2_heavy"))
