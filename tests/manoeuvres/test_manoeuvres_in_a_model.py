"""What a log lacks is said by the model's own words for what steers and drives it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from long_log import long_log

from seatruth import Channel, Model
from seatruth.manoeuvres.in_a_model import not_recorded, not_understood
from seatruth.models import Rudder
from seatruth.trials import Trial

T = np.arange(0.0, 60.0)


class Glider(Model):
    name = "pitching"
    states = outputs = (Channel("u", "m/s"), Channel("q", "rad/s"), Channel("theta", "rad", angle=True))
    inputs = (Channel("x_b", "m"),)
    actuators = (Rudder("battery", "x_b", turns="pitch", full=0.02),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return -s.u, -i.x_b - s.q, s.q


class Elevator(Glider):
    inputs = (Channel("tail", "rad"),)
    actuators = (Rudder("tail", "tail", turns="pitch"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return -s.u, -i.tail - s.q, s.q


def test_what_is_not_recorded_is_said_with_what_it_hides() -> None:
    log, _ = long_log()
    assert not_recorded(log) == []
    assert [line.split(":")[0] for line in not_recorded(replace(log, inputs={}))] == [
        "There is no rudder and no thrusters",
        "There is no drive",
    ]


def test_a_weight_that_pitches_is_no_missing_rudder() -> None:
    log = Trial("yo", T, {}, {"x_b": 0.0 * T, "theta": 0.0 * T, "u": 0.0 * T + 0.4})
    assert not_understood(log, Glider()) == []  # 20 mm count as a plane hard over

    class Unnamed(Glider):
        inputs = (Channel("delta_s", "m"),)
        actuators = ()

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return -s.u, -i.delta_s - s.q, s.q

    told = not_understood(replace(log, inputs={"delta_s": 0.0 * T}), Unnamed())
    assert told == ["'delta_s' steers in m, which is no angle: zigzags cannot be told by it."]
    assert not any("rudder" in line for line in not_recorded(log, Glider()))
    assert any("no rudder" in line for line in not_recorded(log))


def test_a_plane_of_any_name_is_a_plane() -> None:
    log = Trial("yo", T, {}, {"tail": 0.0 * T, "u": 0.0 * T + 0.4})
    assert not_understood(log, Elevator()) == [
        "A plane steers and no pitch is recorded: zigzags in pitch cannot be found."
    ]
    pitching = replace(log, outputs={**log.outputs, "theta": 0.0 * T})
    assert not_understood(pitching, Elevator()) == []
    assert not any("rudder" in line for line in not_recorded(pitching, Elevator()))
