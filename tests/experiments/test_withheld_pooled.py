"""The published blind sets together: counts read back from their tables, and the pages that state them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[2] / "experiments"))

from withheld.pooled import PAGE, SHARES, in_words, markdown, newest, pool, read

from seatruth.errors import BadInput

ROOT = Path(__file__).resolve().parents[2]
STRONG = "named right, one effect, lambda >= 100"
PAGES = """
**15 blind cases** [S]: a test set drawn with commit aaaaaaa.

| measure | goal | seatruth diagnose (95 % interval) | cases |  | limit |
| --- | --- | --- | --- | --- | --- |
| named right, one effect, lambda >= 100 | >= 0.9 | 0.67 (0.30 to 0.95) | 3 | missed (open) | 1.00 |
| mean set | <= 2.5 | 1.00 | 1 | met (open) | 1.00 |

**30 blind cases** [S]: a test set drawn with commit bbbbbbb.

| measure | goal | seatruth diagnose (95 % interval) | cases |  | limit |
| --- | --- | --- | --- | --- | --- |
| named right, one effect, lambda >= 100 | >= 0.9 | 0.86 (0.30 to 0.95) | 7 | missed (open) |  |

**24 blind cases** [S]: a test set drawn with commit 18379ef.

| named right, one effect, lambda >= 100 | >= 0.9 | 1.00 (0.30 to 1.00) | 9 | met | 1.00 |
"""


def test_counts_of_sets_add_up_and_the_limit_only_where_it_is_known() -> None:
    sets = read(PAGES)
    assert [one.cases for one in sets] == [15, 30]
    assert [one.counts for one in sets] == [{STRONG: (2, 3, 3)}, {STRONG: (6, None, 7)}]
    both = pool(sets)
    assert (both.cases, both.hits[STRONG], both.limit[STRONG]) == (45, (8, 10), (3, 3))


def test_a_share_that_is_no_whole_number_of_cases_is_refused() -> None:
    with pytest.raises(BadInput, match=r"0.50 of 3 cases is no whole number"):
        read(PAGES.replace("0.67 (0.30", "0.50 (0.30"))


def test_the_newest_sets_hold_enough_cases_and_no_more_than_that() -> None:
    sets = read(PAGE.read_text(encoding="utf-8"))
    few = newest(sets)
    assert few == sets[: len(few)]
    assert sum(one.cases for one in few[:-1]) < 150 <= sum(one.cases for one in few)
    assert all(set(one.counts) <= set(SHARES) and one.counts for one in sets)


def test_the_gallery_and_the_front_pages_state_what_the_sets_give() -> None:
    assert markdown() in (ROOT / "experiments" / "README.md").read_text(encoding="utf-8")
    for page in (ROOT / "README.md", ROOT / "docs" / "index.md"):
        text = " ".join(page.read_text(encoding="utf-8").split())
        for count in in_words().split("; "):
            assert count in text, (page.name, count)
