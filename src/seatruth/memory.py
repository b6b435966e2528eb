"""Memory is forecast before it is taken: what would not fit is refused, with the reason and the way out."""

from __future__ import annotations

import psutil

from seatruth.errors import BadInput

_SHARE = 0.8
"""Part of the free memory that one thing may take: the rest is for what is made of it. Chosen here [S]."""


def require_memory(size: float, what: str, *, where: str = "", do: str) -> None:
    """Refuses what needs more memory than this machine has left.

    Args:
        size: bytes that it will take.
        what: what takes them, as the start of a sentence: "its 5000000 steps".
        where: file, trial or channel.
        do: how to need less.

    Raises:
        BadInput: there is less.

    Example:
        >>> try:
        ...     require_memory(1e30, "its 5 steps", where="trial 'run'", do="Cut it.")
        ... except BadInput as problem:
        ...     print(problem.message.partition(",")[0])
        trial 'run': its 5 steps need 1e+21 GB of memory
    """
    left = float(psutil.virtual_memory().available)
    if size > _SHARE * left:
        raise BadInput(
            f"{what} need {size / 1e9:.3g} GB of memory, and this machine has {left / 1e9:.3g} GB left",
            where=where,
            do=do,
        )
