"""A drag that rises otherwise with the speed than the model's."""

from __future__ import annotations

import math

import pytest

from seatruth.effects import available, dimensions_of, with_effects
from seatruth.effects.curves import DragCurve
from seatruth.manoeuvres import Stepper
from seatruth.models import load_model

REST = {"delta": 0.0, "n": 0.0}


def deceleration(u: float, effect: str, *, speed: float = 0.0, **values: float) -> float:
    """What an effect adds to the deceleration of the ship without thrust, m/s2."""
    chosen = available()[effect]
    model = with_effects(load_model("mmg"), [chosen.at_speed(speed) if speed else chosen])
    rate = [Stepper(model, {f"{effect}_{name}": value for name, value in asked.items()}) for asked in (values, {})]
    with_it, without = (one.rate(0.0, one.first({"u": u}), REST)[0] for one in rate)
    return without - with_it


@pytest.mark.parametrize("speed", [0.0, 1.3])
def test_it_changes_the_slope_and_not_the_drag_at_the_usual_speed(speed: float) -> None:
    size = dimensions_of(load_model("mmg"))
    assert size is not None
    usual = speed or 0.3 * math.sqrt(9.80665 * size.length)
    drag = deceleration(usual, "drag_increase", k=1.0)
    assert drag > 0.0
    assert deceleration(usual, "drag_curve", speed=speed, slope=0.7) == pytest.approx(0.0, abs=1e-9 * drag)
    # At twice the speed the model's drag is four times as large, and to first order in the slope 0.01 ln 2 of it more.
    twice = deceleration(2.0 * usual, "drag_curve", speed=speed, slope=0.01)
    assert twice == pytest.approx(4.0 * 0.01 * math.log(2.0) * drag)
    assert deceleration(-2.0 * usual, "drag_curve", speed=speed, slope=0.01) == pytest.approx(-twice)
    assert deceleration(0.0, "drag_curve", speed=speed, slope=0.7) == 0.0


def test_only_what_refers_to_a_speed_is_made_for_one() -> None:
    found = DragCurve().at_speed(2.0)
    assert isinstance(found, DragCurve)
    assert found.speed == 2.0
    wind = available()["wind"]
    assert wind.at_speed(2.0) is wind
