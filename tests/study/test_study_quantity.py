"""Numbers with units in a study file."""

from __future__ import annotations

import math

import pytest

from seatruth import BadInput
from seatruth.study.quantity import positive, quantity


def test_numbers_and_text() -> None:
    assert quantity(0.5, "rad") == 0.5
    assert quantity("90 deg", "rad") == pytest.approx(math.pi / 2)
    assert quantity(" 3e-1 s ", "s") == 0.3
    assert quantity("soon", "s") is None


@pytest.mark.parametrize("value", ["-1 s", 0.0, "1e999 s"])
def test_a_size_is_positive(value: float | str) -> None:
    with pytest.raises(BadInput, match=r"a lag of .* is not possible"):
        positive(value, "s", "a lag")


def test_a_wrong_dimension_is_said() -> None:
    with pytest.raises(BadInput, match="'m'"):
        positive("3 m", "s", "a lag")


def test_text_without_a_unit_is_refused_unless_it_needs_none() -> None:
    with pytest.raises(BadInput, match=r'"0\.1 rad", or the number alone, which is in rad'):
        quantity("0.1", "rad")
    assert quantity("0.1", "1") == 0.1
