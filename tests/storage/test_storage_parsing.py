"""JSON texts of any kind are values or a ValueError."""

from __future__ import annotations

import pytest

from seatruth.storage.parsing import parsed


def test_values() -> None:
    assert parsed('{"x": [1, 2.5, null]}') == parsed(b'{"x": [1, 2.5, null]}') == {"x": [1, 2.5, None]}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[" * 100_000, "nested"),
        ('{"a":' * 100_000, "nested"),
        ("", "Expecting value"),
        ("[1,", "Expecting value"),
        (b"\xff\xfe\x00", "decode"),
        ("9" * 5000, "digits"),
    ],
)
def test_what_is_none_is_a_value_error(text: str | bytes, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        parsed(text)
