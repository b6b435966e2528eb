"""Lists in sentences."""

from __future__ import annotations

from seatruth.text import listed


def test_names_are_listed_as_in_a_sentence() -> None:
    assert [listed(list("abcd")[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert listed(list("abcdefg")) == "a, b, c, d, e and 2 more"
    assert listed(list("abc"), 3) == "a, b and c"
