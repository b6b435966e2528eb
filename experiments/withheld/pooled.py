"""All published blind sets as one table: how often the diagnosis was right, with all of its versions and the newest.

The counts are read back from the sets' own tables (`blind_sets.md`), so that no figure of the gallery is typed.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from seatruth.errors import BadInput
from withheld.intervals import wilson
from withheld.markdown import row

PAGE = Path(__file__).with_name("blind_sets.md")
NEWEST = 150
"""Cases at least that the newest sets hold together: a share of a fifth of them has an interval of +- 0.13."""
SINCE = re.compile(r"commit (18379ef)")
"""The newest set that takes no part, nor any before it: their cases or their scores were made in another way."""
SHARES: dict[str, str] = {
    "named right, one effect, lambda >= 100": ">= 0.9",
    "named right, one effect, lambda 25-100": "",
    "top-3, one effect, lambda >= 25": "",
    "false cause where none acts": "<= 0.03",
    "the same, nothing acts": "",
    "the same, another form": "",
    "wrong at a probability of 0.9 or more": "<= 0.02",
    "unknown called unknown, lambda >= 100": ">= 0.7",
    "unknown said of what is known": "<= 0.05",
    "truth inside the set": ">= 0.95",
    "truth inside what is named, all cases with a cause": "",
    "its 95 % interval holds the oracle's": "0.9 to 0.98",
    "next trial doubles the separation, or none can": ">= 0.8",
    "exact set of two, lambda >= 100 each": "",
    "two causes, all that is named right, lambda >= 100 each": "",
}
"""Measures that are shares of cases, and their goals: their counts add up."""
_TITLES = {"its 95 % interval holds the oracle's": "the interval of the gap closed holds the oracle's"}
_TITLE = re.compile(r"\*\*(\d+) blind cases\b")
_ROUNDED = 0.0051
"""Half of the last digit of a share, and what binary fractions add."""
_SHARE = re.compile(r"[\d.]+(?= \()")


@dataclass(frozen=True)
class Set:
    """A published set: its cases, and of each share the hits, those of the limit (None: none), and the cases."""

    cases: int
    counts: dict[str, tuple[int, int | None, int]]


@dataclass(frozen=True)
class Pool:
    """Several sets together, by measure as in `Set`; of the limit, the hits and the cases of the sets that have one."""

    cases: int
    hits: dict[str, tuple[int, int]]
    limit: dict[str, tuple[int, int]]


def read(text: str) -> list[Set]:
    """The sets of a page, the newest first, down to the one before `SINCE`.

    Raises BadInput where a share is no whole number of cases.
    """
    found: list[Set] = []
    for line in text.splitlines():
        title = _TITLE.match(line)
        if title is not None and SINCE.search(line):
            break
        if title is not None:
            found.append(Set(int(title[1]), {}))
        cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else [""]
        share = _SHARE.match(cells[2]) if cells[0] in SHARES and len(cells) > 5 else None
        if share is not None and found:
            of = int(cells[3])
            # The limit may have scored fewer cases than there are.
            limit = None if cells[-1] in ("", "-") else round(float(cells[-1]) * of)
            found[-1].counts[cells[0]] = (_count(share[0], of, cells[0]), limit, of)
    return found


def _count(share: str, of: int, name: str) -> int:
    """How many cases a share printed with two digits is."""
    count = round(float(share) * of)
    if abs(count / of - float(share)) > _ROUNDED:
        raise BadInput(f"{share} of {of} cases is no whole number of cases", where=f"{PAGE.name}, {name!r}",
                       do="Print the set's table again.")  # fmt: skip
    return count


def pool(sets: Sequence[Set]) -> Pool:
    """The counts of several sets together."""
    hits: dict[str, tuple[int, int]] = {}
    limit: dict[str, tuple[int, int]] = {}
    for name in SHARES:
        rows = [one.counts[name] for one in sets if name in one.counts]
        hits[name] = (sum(one[0] for one in rows), sum(one[2] for one in rows))
        limit[name] = (sum(one[1] or 0 for one in rows), sum(one[2] for one in rows if one[1] is not None))
    return Pool(sum(one.cases for one in sets), hits, limit)


def newest(sets: Sequence[Set]) -> list[Set]:
    """The newest sets that have `NEWEST` cases together."""
    found: list[Set] = []
    for one in sets:
        if sum(each.cases for each in found) >= NEWEST:
            break
        found.append(one)
    return found


def markdown(page: Path = PAGE) -> str:
    """The table of all sets beside the newest, in Markdown."""
    sets = read(page.read_text(encoding="utf-8"))
    pools = [pool(newest(sets)), pool(sets)]
    titles = [f"newest {pools[0].cases} cases", f"all {pools[1].cases} cases"]
    head = ["measure", "goal", *(cell for title in titles for cell in (f"{title} (95 % interval)", "", "limit"))]
    lines = [row(head), row(["---"] * len(head))]
    for name, goal in SHARES.items():
        cells = [cell for one in pools for cell in _cells(one, name)]
        lines.append(row([_TITLES.get(name, name), goal, *cells]))
    return "\n".join(lines) + "\n"


def in_words(page: Path = PAGE) -> str:
    """The phrases in which the front pages give the counts of all sets, with "; " between them.

    Strong and weaker causes that were named, false ones, and what was wrong at a probability of 0.9 or more.
    """
    found = pool(read(page.read_text(encoding="utf-8")))
    strong, weaker = "named right, one effect, lambda >= 100", "named right, one effect, lambda 25-100"
    false, wrong = "false cause where none acts", "wrong at a probability of 0.9 or more"
    return (
        f"{found.cases} blind synthetic cases; {_of(found.hits[strong])} strong single causes; "
        f"({found.limit[strong][0]} can be found; {_of(found.hits[weaker])} weaker ones; "
        f"{_of(found.hits[false])} cases where none acts; {_of(found.hits[wrong])}"
    )


def _of(hits: tuple[int, int]) -> str:
    return f"{hits[0]} of {hits[1]}"


def _cells(found: Pool, name: str) -> list[str]:
    hits, limit = found.hits[name], found.limit[name]
    if not hits[1]:
        return ["", "", ""]
    low, high = wilson(*hits)
    share = f"{hits[0] / hits[1]:.2f} ({low:.2f} to {high:.2f})"
    return [share, _of(hits), f"{limit[0] / limit[1]:.2f}" if limit[1] else ""]
