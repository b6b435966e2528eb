"""Mutated inputs, drawn from a seed or guided by coverage, each watched; what gives way is kept as a file."""

from __future__ import annotations

import hashlib
import inspect
import math
import random
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from attack import guard
from attack.inputs import REFUSALS, Target

_MOST_KEPT = 5
"""Inputs that gave way and are kept, of one target. Chosen here [S]."""


@dataclass
class Tally:
    """What came of the cases of one target."""

    name: str
    tried: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    gave_way: list[str] = field(default_factory=list)
    """The first reasons; `failed` counts all."""
    failed: int = 0
    when: dict[str, int] = field(default_factory=dict)
    """Of kills: how many came upon what."""

    def note(self, case: str, verdict: guard.Verdict) -> None:
        """Counts one case."""
        self.tried += 1
        self.refused += verdict.kind == "refused"
        self.slowest = max(self.slowest, verdict.seconds)
        if verdict.kind == "gave way":
            self.failed += 1
            if len(self.gave_way) < _MOST_KEPT:
                self.gave_way.append(f"{case}: {verdict.reason}")


def run(target: Target, cases: int, seed: int, kept: Path, seconds: float = math.inf) -> Tally:
    """Gives a target so many mutated inputs, for so long at most.

    Those that it gives way to are written into the folder `kept`.
    """
    target.take(target.examples[0])  # loads what is loaded once
    tally, begun = Tally(target.name), time.perf_counter()
    for data in mutants(target, cases, seed):
        if time.perf_counter() - begun > seconds:
            break
        judge(target, data, tally, kept)
    tally.seconds = time.perf_counter() - begun
    return tally


def guided(
    target: Target, cases: int, seed: int, kept: Path, corpus: Path, seconds: float, ended: Callable[[Tally], NoReturn]
) -> NoReturn:
    """The same, led by what of seatruth is covered (atheris, that is libFuzzer).

    Inputs that reached new lines are kept in the folder `corpus`, from which a later run goes on. libFuzzer does not
    give the process back: `ended` gets the tally after the last case, and leaves the process.
    """
    import atheris  # an extra: there are no wheels for every system

    target.take(target.examples[0])  # loads what is to be led by
    _instrument(atheris.instrument_func)
    tally, begun = Tally(target.name), time.perf_counter()

    def one(data: bytes) -> None:
        judge(target, data, tally, kept)
        if tally.tried >= cases or time.perf_counter() - begun > seconds:
            tally.seconds = time.perf_counter() - begun
            ended(tally)

    corpus.mkdir(parents=True, exist_ok=True)
    for k, example in enumerate(target.examples):
        (corpus / str(k)).write_bytes(example)
    atheris.Setup([sys.argv[0], f"-seed={seed or 1}", "-verbosity=0", str(corpus)], one)
    atheris.Fuzz()
    raise AssertionError("libFuzzer ended before its last case")


def _instrument(instrument: Callable[[Any], Any]) -> int:
    """Lets atheris see which lines of seatruth run, and returns of how many functions.

    Of seatruth alone: to instrument NumPy, pandas and all else that is loaded takes minutes, and leads nowhere.
    """
    seen: set[int] = set()
    for name, module in list(sys.modules.items()):
        if name.partition(".")[0] != "seatruth":
            continue
        for owner in (module, *(one for one in vars(module).values() if inspect.isclass(one))):
            for value in list(vars(owner).values()):
                function = getattr(value, "__func__", value)
                if inspect.isfunction(function) and function.__module__ == name and id(function) not in seen:
                    seen.add(id(function))
                    instrument(function)
    return len(seen)


def judge(target: Target, data: bytes, tally: Tally, kept: Path) -> None:
    """Gives one input to a target and counts what comes of it."""
    verdict = guard.call(lambda: target.take(data), REFUSALS)
    name = hashlib.sha256(data).hexdigest()[:12]
    tally.note(name, verdict)
    if verdict.kind == "gave way" and tally.failed <= _MOST_KEPT:
        kept.mkdir(parents=True, exist_ok=True)
        (kept / f"{target.name} {name}").write_bytes(data)


def mutants(target: Target, cases: int, seed: int) -> Iterator[bytes]:
    """Mutated examples: bytes and words put in, taken out, doubled and moved, and parts of two examples joined."""
    draw = random.Random(f"{target.name} {seed}")
    for _ in range(cases):
        data = bytearray(draw.choice(target.examples))
        for _ in range(draw.choice((1, 1, 2, 3, 5, 8))):
            _mutate(data, draw, target)
        yield bytes(data)


def _mutate(data: bytearray, draw: random.Random, target: Target) -> None:
    at = draw.randrange(len(data) + 1)
    length = min(draw.choice((1, 1, 2, 4, 16, 64, 1024)), len(data) - at)
    kind = draw.randrange(7)
    if kind == 0:
        data[at:at] = draw.choice(target.words)
    elif kind == 1:
        del data[at : at + length]
    elif kind == 2:
        data[at : at + 1] = bytes([draw.randrange(256)])
    elif kind == 3:
        data[at:at] = data[at : at + length] * draw.choice((1, 2, 100))
    elif kind == 4:
        data[at : at + length] = draw.choice(target.words)
    elif kind == 5 and at < len(data):
        data[at] ^= 1 << draw.randrange(8)
    else:
        other = draw.choice(target.examples)
        data[at:] = other[draw.randrange(len(other) + 1) :]
