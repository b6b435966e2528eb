"""Directions on the earth in words."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from seatruth.diagnosis.earth_directions import common_direction, in_words, towards
from seatruth.diagnosis.verdict import EffectParameter


def pointing(angle: float, error: float, size: float = 2.0) -> tuple[EffectParameter, ...]:
    """Components of an effect towards an angle (deg) with an error (deg), and its lever."""
    north, east = size * math.cos(math.radians(angle)), size * math.sin(math.radians(angle))
    sd = size * math.radians(error)
    return tuple(
        EffectParameter(name, "m/s", value, deviation, 0.0, 0.0, 0.0, 1.0)
        for name, value, deviation in (("north", north, sd), ("east", east, sd), ("lever", 0.1, 0.1))
    )


def test_components_as_size_and_direction() -> None:
    assert towards({"north": (0.0, 0.1), "east": (0.3, 0.1)}).endswith("towards 90 +- 19 deg")
    assert towards({"angle": (0.1, 0.1)}) == ""
    assert towards({"north": (0.0, 0.1), "east": (0.0, 0.1)}) == ""


def test_an_error_of_the_form_is_one_of_the_size_and_not_of_the_direction() -> None:
    """A wind over areas that nobody measured: how fast it is stays open by a fifth, where it blows does not."""
    sure = pointing(50.0, 3.0)
    open_ = [replace(q, stderr=math.hypot(q.stderr, 0.2 * q.value), systematic_error=0.2 * q.value) for q in sure[:2]]
    assert in_words(sure) == "2.00 +- 0.10 m/s towards 50.0 +- 3.0 deg"
    assert in_words([*open_, sure[2]]) == "2.00 +- 0.41 m/s towards 50.0 +- 3.0 deg"
    assert in_words(()) == ""


def test_effects_that_point_alike_have_the_direction_of_the_most_probable() -> None:
    """A current, which stood for a wind where trials were predicted, pointed 43 deg elsewhere, with an error of 36."""
    assert common_direction([pointing(303.0, 15.0), pointing(260.0, 36.0)]) == "303 +- 15 deg"


@pytest.mark.parametrize(
    ("angles", "said"),
    [((303.0, 260.0), "260 to 303 deg"), ((350.0, 20.0), "350 to 20 deg"), ((20.0, 350.0), "350 to 20 deg")],
)
def test_effects_that_point_elsewhere_have_a_range(angles: tuple[float, float], said: str) -> None:
    assert common_direction([pointing(angle, 5.0) for angle in angles]) == said


def test_without_directions_nothing_is_said() -> None:
    bias = (EffectParameter("b", "rad", 0.1, 0.01, 0.0, 0.0, 0.0, 1.0),)
    assert common_direction([bias, bias]) == ""
    assert common_direction([pointing(303.0, 15.0)]) == "", "one effect says it with its size"
    assert common_direction([pointing(303.0, 15.0), bias]) == "303 +- 15 deg"
