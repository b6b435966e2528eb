"""The one way seatruth tells a user that something is wrong.

Every error says what was wrong, where, and what to do about it; the command line prints it as one message and exits
with code 2 for bad input, 1 for a run that failed.
"""

from __future__ import annotations

import difflib
import sys
from collections.abc import Iterable

DEBUG = "SEATRUTH_DEBUG"
"""Set this environment variable to see the traceback of an unexpected error."""


class SeatruthError(Exception):
    """Base of all errors of seatruth: what was wrong, where, and what to do.

    Args:
        what: what was wrong.
        where: file, line, column or channel, such as "trial.csv, line 14, column 'u'".
        do: the next step, as a sentence.
        code: the code whose page explains it (`seatruth explain CODE`); by default that of the module that raises it.

    Example:
        >>> from seatruth import SeatruthError
        >>> print(SeatruthError("it is empty", where="log.csv", do="Record again."))
        log.csv: it is empty. Record again.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", do: str = "", code: str = "") -> None:
        self.what, self.where, self.do = what, where, do
        self.code = code or code_of_module(_raiser(self))
        super().__init__(self.message)

    @property
    def message(self) -> str:
        head = f"{self.where}: {self.what}" if self.where else self.what
        head = head if head.endswith((".", "!", "?")) else head + "."
        return f"{head} {self.do}".strip()

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, (type(self), self.what, self.where, self.do, self.code))


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
    """A plug-in (a model, an effect, an optimizer) raised or broke its contract (exit code 1).

    Example:
        >>> from seatruth import BlackBox, Channel, PluginError, Trial
        >>> box = BlackBox("box", lambda trial, p, first: {}, inputs=[], outputs=[Channel("y", "m")], parameters=[])
        >>> try:
        ...     box.run(Trial("run", [0.0, 1.0], {}, {}), {}, None)
        ... except PluginError as problem:
        ...     print(problem)
        model 'box', trial 'run': its function returned no 'y'.
    """


class Interrupted(SeatruthError):
    """The user stopped the run; what it had is kept (exit code 130)."""

    exit_code = 130


class SeatruthWarning(UserWarning):
    """Something a user should know about a result that is still usable.

    Example:
        >>> import warnings
        >>> from seatruth import SeatruthWarning
        >>> warnings.simplefilter("error", SeatruthWarning)  # stop at the first one
    """


def _rebuild(kind: type[SeatruthError], what: str, where: str, do: str, code: str) -> SeatruthError:
    return kind(what, where=where, do=do, code=code)


def _raiser(error: SeatruthError) -> str:
    """The module that makes this error: the caller of its constructor and of those of its subclasses."""
    frame = sys._getframe(2)
    while frame.f_back is not None and frame.f_code.co_name == "__init__" and frame.f_locals.get("self") is error:
        frame = frame.f_back
    return str(frame.f_globals.get("__name__", ""))


def code_of_module(module: str) -> str:
    """The code of the errors that a module raises; "plug-in" for modules outside seatruth.

    Example:
        >>> code_of_module("seatruth.readers.csv_file"), code_of_module("my_ship")
        ('readers-csv-file', 'plug-in')
    """
    if not module.startswith("seatruth."):
        return "plug-in"
    return module.removeprefix("seatruth.").replace(".", "-").replace("_", "-")


def nearest(name: str, known: Iterable[str], *, likeness: float = 0.5) -> str:
    """A sentence that names the known word nearest to a misspelt one, and the others if they are few.

    `likeness`, 0 to 1, is how near it must be: more where there are so many words that some are near to any.
    """
    options = sorted(known)
    close = difflib.get_close_matches(name, options, n=1, cutoff=likeness)
    hint = f"Did you mean {close[0]!r}?" if close else ""
    listing = f"Known: {', '.join(options)}." if options and len(options) <= 40 else ""
    return f"{hint} {listing}".strip()
