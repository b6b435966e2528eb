"""Units of files become the units inside seatruth, and anything else is refused in words."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth import units
from seatruth.errors import BadInput
from seatruth.units import inside_unit, is_unit, parse_unit, to_si


@pytest.mark.parametrize(
    ("unit", "inside", "factor"),
    [
        ("deg", "rad", math.pi / 180),
        ("°", "rad", math.pi / 180),
        ("deg/s", "rad/s", math.pi / 180),
        ("rpm", "rev/s", 1 / 60),
        ("RPM", "rev/s", 1 / 60),
        ("rev/min", "rev/s", 1 / 60),
        ("1/s", "rev/s", 1.0),
        ("Hz", "rev/s", 1.0),
        ("rad/s", "rev/s", 1 / (2 * math.pi)),
        ("rpm", "rad/s", 2 * math.pi / 60),
        ("rpm", "1/min", 1.0),
        ("rpm", "1/s", 1 / 60),
        ("rev/s", "Hz", 1.0),
        ("deg/s", "1/s", math.pi / 180),
        ("kn", "m/s", 1852 / 3600),
        ("kts", "m/s", 1852 / 3600),
        ("kt", "m/s", 1852 / 3600),
        ("kph", "m/s", 1 / 3.6),
        ("dps", "rad/s", math.pi / 180),
        ("DPS", "rad/s", math.pi / 180),
        ("degs", "rad/s", math.pi / 180),
        ("degs", "rad", math.pi / 180),
        ("rads", "rad/s", 1.0),
        ("usec", "s", 1e-6),
        ("degE7", "deg", 1e-7),
        ("km/h", "m/s", 1 / 3.6),
        ("cm", "m", 0.01),
        ("cm^3", "m^3", 1e-6),
        ("m/s2", "m/s^2", 1.0),
        ("m s-1", "m/s", 1.0),
        ("dbar", "Pa", 1e4),
        ("Nm", "N*m", 1.0),
        ("[m/s]", "m/s", 1.0),
        ("-", "1", 1.0),
        ("%", "1", 0.01),
        ("ms", "s", 1e-3),
    ],
)
def test_conversion(unit: str, inside: str, factor: float) -> None:
    conversion = to_si(unit, inside)
    assert conversion.factor == pytest.approx(factor, rel=1e-15)
    assert conversion.offset == 0.0


def test_temperature_has_an_offset() -> None:
    assert to_si("degC", "K") == pytest.approx((1.0, 273.15))


def test_wrong_dimension_says_both() -> None:
    with pytest.raises(BadInput, match="'m' is length, but 'rad' is a pure number or an angle"):
        to_si("m", "rad")


@pytest.mark.parametrize(("typo", "meant"), [("degg", "deg"), ("knn", "kn"), ("mm/ss", "mm/s")])
def test_unknown_unit_names_the_nearest(typo: str, meant: str) -> None:
    with pytest.raises(BadInput, match=f"Did you mean '{meant}'"):
        to_si(typo, "m/s")


@pytest.mark.parametrize("text", ["9**9**9**9", "m**99999", "__import__('os')", "m+", "", "2 m", "x" * 100, "(((((m"])
def test_hostile_text_is_no_unit_and_takes_no_time(text: str) -> None:
    assert is_unit(text) is (text == "")


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=30))
def test_any_text_is_a_unit_or_is_refused(text: str) -> None:
    try:
        to_si(text, "m/s")
    except BadInput:
        return
    assert is_unit(text)


@pytest.mark.parametrize(
    ("unit", "inside"), [("deg", "rad"), ("rpm", "rev/s"), ("cm", "m"), ("degC", "K"), ("kn", "m/s"), ("%", "1")]
)
def test_inside_unit_of_a_channel_without_declaration(unit: str, inside: str) -> None:
    assert inside_unit(unit) == inside
    to_si(unit, inside_unit(unit))


def test_what_is_known_without_pint_is_what_pint_says() -> None:
    for unit in units._FREQUENT:
        assert parse_unit(unit) is not None
    for (stated, inside), conversion in units._QUICK.items():
        registry = units._registry()
        assert conversion == (registry.Quantity(1.0, parse_unit(stated)).to(parse_unit(inside)).magnitude, 0.0)


def test_a_pint_that_cannot_start_is_not_taken_for_an_unknown_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise TypeError("pint is damaged")

    monkeypatch.setattr(units, "_registry", broken)
    with pytest.raises(TypeError, match="damaged"):
        parse_unit("furlong")
