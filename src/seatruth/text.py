"""Small pieces of text that several packages write."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

ORIGINS: Mapping[str, str] = {
    "P": "printed in the paper",
    "R": "reconstructed, because the paper's equations or tables are lost",
    "L": "other literature",
    "S": "chosen here",
    "V": "computed by independent code",
}
"""Tags that say where a number or an equation comes from, written in brackets before the source: "[L] Fossen 2011"."""


def listed(names: Sequence[str], most: int = 6) -> str:
    """Names as in a sentence; beyond `most` of them the rest is counted.

    Example:
        >>> listed(["sway", "surge", "yaw"])
        'sway, surge and yaw'
        >>> listed(["a", "b", "c", "d"], 3)
        'a, b and 2 more'
    """
    if len(names) > most:
        return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}" if names else ""


_UNSEEN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
"""Characters that move a terminal's cursor, change its state or reverse the order of what it shows, and half ones."""


def visible(text: str) -> str:
    """A text for a terminal: what would act on the terminal instead of being shown is written as its code.

    Names of trials, channels and files come from files that someone else may have made.

    Example:
        >>> visible("run\\x1b[2J 1")
        'run\\\\x1b[2J 1'
    """
    return _UNSEEN.sub(lambda found: found.group().encode("unicode_escape").decode("ascii"), text)


def origin_legend(sources: Iterable[str]) -> str:
    """What the tags in these sources mean, as one sentence; empty where none has a tag.

    Example:
        >>> origin_legend(["[L] Fossen 2011", "[S] a first guess"])
        'Tags: [L] other literature; [S] chosen here.'
    """
    used = {tag for source in sources for tag in re.findall(r"\[([A-Z])\]", source)}
    meanings = [f"[{tag}] {meaning}" for tag, meaning in ORIGINS.items() if tag in used]
    return f"Tags: {'; '.join(meanings)}." if meanings else ""
