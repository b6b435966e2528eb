"""How a case is watched: one process at a time, with a limit on its time and its memory, and a verdict on its end."""

from __future__ import annotations

import contextlib
import io
import resource
import signal
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

SECONDS = 10.0
"""Most processor time of one case, s: other programs on the machine must not decide what a hang is."""
WAITING = 12.0
"""Longest time of one case, in multiples of the processor time that it may take: a case may also wait for ever."""
MEMORY = 2**30
"""Most memory that one case may take beside the program, bytes."""
WORDS = ("Traceback (most recent call last)", "unexpected ")
"""What no user may see."""


class TooLong(BaseException):
    """The case took too long. No `except Exception` on the way may take it for something else."""


@dataclass(frozen=True)
class Verdict:
    """How a case ended: "answered", "refused", or "gave way" with the reason."""

    kind: str
    reason: str = ""
    seconds: float = 0.0


def _alarm(number: int, frame: FrameType | None) -> None:
    raise TooLong


@contextlib.contextmanager
def limits(seconds: float, memory: int = MEMORY) -> Iterator[None]:
    """Ends what is done inside by TooLong or MemoryError beyond these limits; `seconds` are of processor time."""
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    handlers = {number: signal.signal(number, _alarm) for number in (signal.SIGPROF, signal.SIGALRM)}
    resource.setrlimit(resource.RLIMIT_AS, (size + memory, before[1]))
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
    signal.setitimer(signal.ITIMER_REAL, WAITING * seconds, 1.0)
    try:
        yield
    finally:
        for timer in (signal.ITIMER_PROF, signal.ITIMER_REAL):
            signal.setitimer(timer, 0.0)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        resource.setrlimit(resource.RLIMIT_AS, before)


def command(arguments: list[str], seconds: float = SECONDS) -> Verdict:
    """Runs one command of seatruth in this process and judges what a user would see of it."""
    from seatruth.cli import run

    out, err = io.StringIO(), io.StringIO()
    begun = time.perf_counter()
    try:
        with limits(seconds), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = run(arguments)
    except TooLong:
        return Verdict("gave way", f"more than {seconds:g} s", time.perf_counter() - begun)
    except BaseException as problem:
        return Verdict("gave way", _last(problem), time.perf_counter() - begun)
    took = time.perf_counter() - begun
    shown = out.getvalue() + err.getvalue()
    if any(word in shown for word in WORDS):
        return Verdict("gave way", err.getvalue().strip()[-300:], took)
    if any(ord(character) < 32 and character not in "\n\t" for character in shown):
        return Verdict("gave way", "control characters reach the terminal", took)
    if "too little memory" in shown:
        return Verdict("gave way", f"more than {MEMORY / 2**30:g} GB", took)
    return Verdict("answered" if code == 0 else "refused", err.getvalue().strip()[-200:], took)


def call(function: Callable[[], object], refusals: tuple[type[BaseException], ...]) -> Verdict:
    """Calls a function and judges how it ends: an exception that is no refusal gives way."""
    begun = time.perf_counter()
    try:
        with limits(SECONDS):
            function()
    except refusals as problem:
        return Verdict("refused", str(problem)[:200], time.perf_counter() - begun)
    except TooLong:
        return Verdict("gave way", f"more than {SECONDS:g} s", time.perf_counter() - begun)
    except BaseException as problem:
        return Verdict("gave way", _last(problem), time.perf_counter() - begun)
    return Verdict("answered", "", time.perf_counter() - begun)


def _last(problem: BaseException) -> str:
    frames = traceback.extract_tb(problem.__traceback__)
    place = f" ({Path(frames[-1].filename).name}, line {frames[-1].lineno})" if frames else ""
    return f"{type(problem).__name__}: {str(problem)[:200]}{place}"
