"""Forms of what is missing that are no cause: another drag curve, and forces of turns to one side."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
def test_it_changes_the_power_and_not_the_drag_at_the_usual_speed(speed: float) -> None:
    size = dimensions_of(load_model("mmg"))
    assert size is not None
    usual = speed or 0.3 * math.sqrt(9.80665 * size.length)
    drag = deceleration(usual, "drag_increase", k=1.0)
    assert drag > 0.0
    assert deceleration(usual, "drag_curve", speed=speed, power=0.7) == pytest.approx(0.0, abs=2e-3 * drag)
    # At twice the speed the model's drag is four times as large, and with the third power eight times.
    twice = deceleration(2.0 * usual, "drag_curve", speed=speed, power=1.0)
    assert twice == pytest.approx((8.0 - 4.0) * drag, rel=1e-2)
    assert deceleration(-2.0 * usual, "drag_curve", speed=speed, power=1.0) == pytest.approx(-twice)
    assert deceleration(0.0, "drag_curve", speed=speed, power=-1.5) == 0.0


@settings(max_examples=25, deadline=None)
@given(st.floats(-1.5, 4.0), st.floats(-3.0, 3.0))
def test_the_whole_drag_is_against_the_motion(power: float, ratio: float) -> None:
    """Of any power within its bounds, at any speed: no vehicle is driven by its drag, and one that is slow stops."""
    speed = 1.3
    own = deceleration(ratio * speed, "drag_increase", k=1.0)
    assert (own + deceleration(ratio * speed, "drag_curve", speed=speed, power=power)) * ratio >= 0.0


def test_only_what_refers_to_a_speed_is_made_for_one() -> None:
    found = DragCurve().at_speed(2.0)
    assert isinstance(found, DragCurve)
    assert found.speed == 2.0
    wind = available()["wind"]
    assert wind.at_speed(2.0) is wind


def test_turns_to_one_side_differ_and_straight_runs_do_not() -> None:
    """In a turn to port the forces to the side and the moment are those to starboard, and the one ahead is reversed."""
    names = {"surge": 4e-4, "force": 1e-3, "moment": 3e-4}
    model = with_effects(load_model("mmg"), [available()["one_sided_turns"]])

    def added(**motion: float) -> list[float]:
        rates = [
            Stepper(model, {f"one_sided_turns_{key}": value for key, value in asked.items()}) for asked in (names, {})
        ]
        with_it, without = (one.rate(0.0, one.first({"u": 1.0, **motion}), REST) for one in rates)
        return [with_it[k] - without[k] for k in (0, 1, 2)]

    states = [channel.name for channel in model.states]
    assert states[:3] == ["u", "v", "r"]
    assert added(v=0.1) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    starboard, port = added(r=0.1), added(r=-0.1)
    assert starboard[0] > 0.0
    assert min(abs(value) for value in starboard) > 1e-5
    assert port == pytest.approx([-starboard[0], starboard[1], starboard[2]])
