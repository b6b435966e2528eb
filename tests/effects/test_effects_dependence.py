"""Whether equations depend on a state."""

from __future__ import annotations

from typing import Any

from seatruth import BlackBox, Channel, Model
from seatruth.effects.dependence import depends_on


class Diver(Model):
    """It sinks by its weight; the water presses it together as it does."""

    name = "diver"
    kind = "auv"
    states = outputs = (Channel("w", "m/s"), Channel("z", "m"))
    squeezed = 0.0

    @classmethod
    def rhs(cls, s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return 0.1 + cls.squeezed * s.z - s.w, s.w


def diver(squeezed: float) -> Model:
    class One(Diver):
        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return 0.1 + squeezed * s.z - s.w, s.w

    return One()


def test_a_depth_enters_where_the_hull_is_pressed_together() -> None:
    assert not depends_on(diver(0.0), "z")
    assert depends_on(diver(1e-3), "z")
    assert depends_on(diver(0.0), "w")
    assert depends_on(diver(0.0), "psi")  # it has none: others say so


def test_what_cannot_be_told_may_depend_on_it() -> None:
    class Broken(Diver):
        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return 1.0 / (s.w - s.w), s.w

    assert depends_on(Broken(), "z")
    box = BlackBox("box", print, inputs=[], outputs=[Channel("z", "m")], states=[], parameters=[])
    assert depends_on(box, "z")
