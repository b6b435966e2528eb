"""Lists in sentences, and the legend of the tags of origin."""

from __future__ import annotations

from seatruth.text import ORIGINS, listed, origin_legend, visible


def test_names_are_listed_as_in_a_sentence() -> None:
    assert [listed(list("abcd")[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert listed(list("abcdefg")) == "a, b, c, d, e and 2 more"
    assert listed(list("abc"), 3) == "a, b and c"


def test_the_legend_explains_the_tags_that_occur() -> None:
    assert origin_legend(["a first guess", "", "[X] of no list"]) == ""
    assert origin_legend(["[S] here; [P] Yan 2005"]) == f"Tags: [P] {ORIGINS['P']}; [S] {ORIGINS['S']}."


def test_what_acts_on_a_terminal_is_shown_as_its_code() -> None:
    assert visible("Ærø, 10°\n\tψ 🚢") == "Ærø, 10°\n\tψ 🚢"
    for character in "\x00\x07\r\x1b\x7f\x9b\u202e\u2066\u2028\udcff":
        assert visible(f"a{character}b").isprintable()
        assert len(visible(f"a{character}b")) >= 4
