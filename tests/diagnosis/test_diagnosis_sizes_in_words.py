"""Sizes of effects in the words of those who sail."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from seatruth.diagnosis.sizes_in_words import effect_in_words, size_in_words
from seatruth.diagnosis.verdict import EffectParameter
from seatruth.effects import available, dimensions_of
from seatruth.models import Channel, Model, Order, Rudder, load_model, with_servos

SHIP = load_model("mmg")
STATED = with_servos(SHIP, {"delta": Order(lag=0.3, rate_limit=math.radians(2.8))})


def slowness(value: float, stderr: float, unit: str = "s/rad") -> EffectParameter:
    return EffectParameter("slowness", unit, value, stderr, value - 2 * stderr, value + 2 * stderr, 0.0, 50.0)


@pytest.mark.parametrize(
    ("model", "value", "stderr", "words"),
    [
        (SHIP, 1.0 / math.radians(2.0), 0.01 / math.radians(2.0), "2.000 +- 0.020 deg/s"),
        # What is added to the stated 20.46 s/rad makes 35.81, which is 1.6 deg/s.
        (STATED, 1.0 / math.radians(1.6) - 1.0 / math.radians(2.8), 0.36, "1.600 +- 0.016 deg/s in place of 2.8 deg/s"),
    ],
)
def test_a_slowness_is_told_as_the_rate_at_which_the_rudder_turns(
    model: Model, value: float, stderr: float, words: str
) -> None:
    effect = available()["rudder_rate_limit"]
    assert effect_in_words(effect, model, (slowness(value, stderr),)) == words
    assert effect_in_words(effect, SHIP, (slowness(0.0, stderr),)).startswith("slowness")  # no limit has no rate


def test_other_effects_keep_their_words() -> None:
    angle = EffectParameter("angle", "rad", math.radians(2.0), math.radians(0.1), 0.03, 0.04, 0.0, 0.1)
    assert effect_in_words(available()["rudder_offset"], SHIP, (angle,)) == "angle 2.00 +- 0.10 deg"
    twin = load_model("twin_thruster")
    form = next(one for one in available()["thruster_rate_limit"].variants(twin) if one.which)
    assert effect_in_words(form, twin, (slowness(2.0, 0.1, "s"),)) == "slowness 2.00 +- 0.10 s"
    assert effect_in_words(available()["rudder_rate_limit"], SHIP, ()) == ""


@pytest.mark.parametrize(
    ("name", "value", "stderr", "unit", "words"),
    [
        ("net_weight", 0.001, 0.0001, "1", "0.0305 +- 0.0031 kg"),
        ("buoyancy_gradient", -1e-4, 1e-5, "1/m", "-0.00305 +- 0.00031 kg/m"),
        ("flooding", 1e-5, 1e-6, "1/s", "1.10 +- 0.11 kg/h, lever -0.200 +- 0.010"),
    ],
)
def test_weights_are_told_in_kilograms(name: str, value: float, stderr: float, unit: str, words: str) -> None:
    """A share of the mass is what the equations want, and not what a crew weighs."""
    torpedo = load_model("torpedo")
    size = dimensions_of(torpedo)
    assert size is not None
    assert size.mass == 30.5
    share = EffectParameter("share", unit, value, stderr, 0.0, 0.0, 0.0, 1.0)
    lever = EffectParameter("lever", "1", -0.2, 0.01, 0.0, 0.0, 0.0, 0.2)
    parameters = (share, lever) if name == "flooding" else (share,)
    assert effect_in_words(available()[name], torpedo, parameters) == words


class Glider(Model):
    """What pitches by a battery that is moved, by 0.02 m to either side."""

    name = "glider"
    kind = "glider"
    states = outputs = (Channel("q", "rad/s"), Channel("theta", "rad", angle=True))
    inputs = (Channel("x_b", "m"),)
    actuators = (Rudder("battery", "x_b", turns="pitch", full=0.02),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return -i.x_b - s.q - s.theta, s.q


def test_sizes_at_an_input_that_is_no_angle_are_in_its_unit() -> None:
    full = math.radians(35.0)
    angle = EffectParameter("angle", "rad", 0.1 * full, 0.01 * full, 0.0, 0.1, 0.0, 0.1)
    assert effect_in_words(available()["plane_offset"], Glider(), (angle,)) == "angle 0.00200 +- 0.00020 m"
    limit = available()["plane_rate_limit"]
    slow = slowness(20.0 / full, 1.0 / full)  # 20 s from the middle to hard over
    assert effect_in_words(limit, Glider(), (slow,)) == "0.001000 +- 5.0e-05 m/s"
    ordered = with_servos(Glider(), {"x_b": Order(rate_limit=0.004)})
    assert effect_in_words(limit, ordered, (slow,)) == "0.000800 +- 3.2e-05 m/s in place of 0.004 m/s"


def test_one_size_of_each_trial_is_told_as_a_range() -> None:
    current = available()["trial_current_along"].of_trials(("down", "up"))
    own = [EffectParameter(q.name, "m/s", v, 0.002, v, v, 0.0, 0.3) for q, v in zip(current.parameters, (-0.18, 0.2))]
    assert effect_in_words(current, load_model("diving_plane"), own) == "along -0.18 to 0.2 m/s"


def test_sizes_are_in_degrees_and_currents_have_a_direction() -> None:
    angle = EffectParameter("angle", "rad", math.radians(1.2), math.radians(0.3), 0.0, 0.0, 0.0, 0.1)
    gain = EffectParameter("gain", "1", 0.9, 0.02, 0.0, 0.0, 1.0, 0.1)
    assert size_in_words((angle, gain)) == "angle 1.20 +- 0.30 deg, gain 0.900 +- 0.020"
    north = EffectParameter("north", "m/s", 0.0, 0.1, 0.0, 0.0, 0.0, 0.1)
    east = replace(north, name="east", value=0.3)
    assert size_in_words((north, east)) == "0.30 +- 0.10 m/s towards 90 +- 19 deg"
    assert size_in_words(()) == ""


def test_values_of_each_trial_are_given_as_their_range() -> None:
    def of(name: str, value: float, unit: str = "m/s") -> EffectParameter:
        return EffectParameter(name, unit, value, 0.1, 0.0, 0.0, 0.0, 0.1)

    found = size_in_words([of("north_out", 0.3), of("east_out", -0.03), of("north_back", 0.4), of("east_back", 0.04)])
    assert found == "0.3 to 0.4 m/s towards 354 to 6 deg"
    sides = [(0.1, 0.0), (0.0, 0.2), (-0.1, -0.1)]
    around = [of(f"{way}_{k}", value) for k, pair in enumerate(sides) for way, value in zip(("north", "east"), pair)]
    assert size_in_words(around) == "0.1 to 0.2 m/s, in each trial in another direction"
    assert (
        size_in_words([of("lever", 0.2, "m"), of("north_a", 0.0), of("east_a", 2.0)])
        == "2 to 2 m/s towards 90 to 90 deg"
    )


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((-0.03, 8.0, 0.01, 0.0), "b 8 deg in 'two', -0.03 to 0.01 deg in the others"),
        ((1.0, 2.0, 3.0, 4.0), "b 1 to 4 deg"),
        ((0.0, 8.0), "b 0 to 8 deg"),
    ],
)
def test_a_trial_that_stands_apart_is_named(values: tuple[float, ...], words: str) -> None:
    names = ("one", "two", "three", "four")[: len(values)]
    effect = available()["trial_heading_bias"].of_trials(names)
    found = tuple(
        EffectParameter(f"b_{name}", "rad", math.radians(value), 1e-3, 0.0, 0.0, 0.0, 0.1)
        for name, value in zip(names, values)
    )
    assert effect_in_words(effect, SHIP, found) == words
