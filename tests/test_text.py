"""Lists in sentences, and the legend of the tags of origin."""

from __future__ import annotations

from seatruth.text import ORIGINS, listed, origin_legend


def test_names_are_listed_as_in_a_sentence() -> None:
    assert [listed(list("abcd")[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert listed(list("abcdefg")) == "a, b, c, d, e and 2 more"
    assert listed(list("abc"), 3) == "a, b and c"


def test_the_legend_explains_the_tags_that_occur() -> None:
    assert origin_legend(["a first guess", "", "[X] of no list"]) == ""
    assert origin_legend(["[S] here; [P] Yan 2005"]) == f"Tags: [P] {ORIGINS['P']}; [S] {ORIGINS['S']}."
