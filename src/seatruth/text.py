"""Small pieces of text that several packages write."""

from __future__ import annotations

from collections.abc import Sequence


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
