"""Numbers as text: digits from the error, signs, units, and names in lists."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from seatruth.report.numbers import count, estimate, interval, listed, number, seconds, shown
from seatruth.report.sections.parameters import formula


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.289314, 0.0012, "0.2893"),
        (0.289314, 0.0099, "0.2893"),
        (-0.0579, 0.0014, "−0.0579"),
        (12345.6, 230.0, "12350"),
        (3.2e-7, 1.1e-8, "3.20e−7"),
        (0.02, 7.0, "0.02"),
        (0.0, 0.5, "0.00"),
        (1.0, math.nan, "1.000"),
        (math.nan, 1.0, ""),
        (2.0, 1e-15, "2.000000000"),
    ],
)
def test_value_with_the_digits_that_its_error_leaves(value: float, error: float, text: str) -> None:
    assert estimate(value, error) == text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(0.9958, 2, "1.0"), (0, 3, "0"), (None, 3, ""), (math.inf, 3, "∞"), (-math.inf, 3, "−∞"), (1.5e9, 3, "1.50e9"),
     ("x", 3, ""), (999.6, 3, "1000"), (0.00123, 2, "0.0012")],
)  # fmt: skip
def test_numbers(value: object, digits: int, text: str) -> None:
    assert number(value, digits) == text


@given(st.floats(-1e12, 1e12).filter(lambda x: abs(x) > 1e-12), st.floats(1e-12, 1e12))
def test_what_is_shown_is_within_a_twentieth_of_the_error_unless_digits_end(value: float, error: float) -> None:
    shown_value = float(estimate(value, error).replace("−", "-"))
    assert abs(shown_value - value) <= max(0.0501 * error, 1e-9 * abs(value) * 1.01)


def test_interval_lists_counts_and_seconds() -> None:
    assert interval(0.287, 0.29172, 0.0012) == "0.2870 to 0.2917"
    assert interval(math.nan, math.nan, 1.0) == ""
    assert listed([]) == ""
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"
    assert listed(list("abcdefgh"), 4) == "a, b, c and 5 more"
    assert count(1, "trial") == "1 trial"
    assert count(0, "trial") == "0 trials"
    assert (seconds(0.5), seconds(75), seconds(200), seconds(8000), seconds(None)) == (
        *("0.50 s", "75 s", "3 min 20 s"),
        *("2 h 13 min", ""),
    )


def test_angles_in_degrees_everything_else_as_it_stands() -> None:
    assert shown("r", "rad/s").label == "r (deg/s)"
    assert shown("r", "rad/s").factor == pytest.approx(57.29577951)
    assert shown("a", "m/s^2").label == "a (m/s²)"
    assert shown("C", "1").label == "C"


def test_a_combination_as_a_formula() -> None:
    assert formula({"Y_v": -0.71, "N_v": 0.69, "Y_r": 0.01}) == "0.71 Y_v − 0.69 N_v"
    assert formula({"Y_v": -0.7, "Y_r": 0.01}) == "Y_v"
    assert formula({}) == ""
