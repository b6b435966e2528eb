"""The one way seatruth tells a user that something is wrong.

Every error says what was wrong, where, and what to do about it; the command line prints it as one message and exits
with code 2 for bad input, 1 for a run that failed.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class SeatruthError(Exception):
    """Something the user can put right: what was wrong, where, and what to do.

    `where` names the file, line, column or channel ("trial.csv, line 14, column 'u'"); `do` is the next step.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", do: str = "") -> None:
        self.what, self.where, self.do = what, where, do
        super().__init__(self.message)

    @property
    def message(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        head = head if head.endswith((".", "!", "?")) else head + "."
        return f"{head} {self.do}".strip()

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, (type(self), self.what, self.where, self.do))


class BadInput(SeatruthError, ValueError):
    """A file, a study, an option or an argument is wrong (exit code 2). It is also a `ValueError`.

    Example:
        >>> from seatruth import BadInput, Budget
        >>> try:
        ...     Budget(evaluations=-1)
        ... except ValueError as problem:
        ...     print(problem)
        budget: evaluations = -1 is no limit. Give a positive number.
    """

    exit_code = 2


class PluginError(SeatruthError):
    """A plug-in (a model, an effect, an optimizer) raised or broke its contract."""


class Interrupted(SeatruthError):
    """The user stopped the run; what it had is kept (exit code 130)."""

    exit_code = 130


class SeatruthWarning(UserWarning):
    """Something a user should know about a result that is still usable."""


def _rebuild(kind: type[SeatruthError], what: str, where: str, do: str) -> SeatruthError:
    return kind(what, where=where, do=do)


def nearest(name: str, known: Iterable[str]) -> str:
    """A sentence that names the known word nearest to a misspelt one, and the others if they are few."""
    options = sorted(known)
    close = difflib.get_close_matches(name, options, n=1, cutoff=0.5)
    hint = f"Did you mean {close[0]!r}?" if close else ""
    listing = f"Known: {', '.join(options)}." if options and len(options) <= 40 else ""
    return f"{hint} {listing}".strip()
