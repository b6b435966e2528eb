"""Small pieces of text that several packages write."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from decimal import Decimal

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


def with_error(value: float, error: float) -> str:
    """A value and its standard error to two digits, the value to the last digit of the error.

    Example:
        >>> with_error(0.0800213, 0.000118), with_error(318.71, 19.6), with_error(3.31e-6, 9.7e-7)
        ('0.08002 +- 0.00012', '319 +- 20', '3.31e-06 +- 9.7e-07')
        >>> with_error(0.075, 0.01)
        '0.075 +- 0.010'
    """
    short = f"{error:#.2g}".rstrip(".")
    if not (math.isfinite(value) and math.isfinite(error) and error > 0.0) or abs(value) < _SMALL:
        return f"{value:.3g} +- {short}"
    digits = -int(Decimal(short).as_tuple().exponent)
    return f"{value:.{min(max(digits, 0), _DECIMALS)}f} +- {short}"


_SMALL, _DECIMALS = 1e-4, 9
"""Size of a value below which it is written with a power of ten; most decimals of another. Chosen here [S]."""
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
