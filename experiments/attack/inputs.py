"""What is fuzzed: for each kind of input some good examples, and what is done with a mutated one.

A target answers, or refuses with an error of seatruth. Whatever else it does gives way: another exception, a hang, too
much memory, or an answer that differs from what an independent reading gives (`Different`).
"""

from __future__ import annotations

import csv
import math
import shutil
import sqlite3
import tempfile
import warnings
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from attack import boat
from seatruth.errors import SeatruthError, SeatruthWarning


class Different(Exception):
    """An answer that is silently wrong."""


@dataclass(frozen=True)
class Target:
    """One kind of input: examples, words that mutations insert, and what takes a mutated one."""

    name: str
    examples: Sequence[bytes]
    words: Sequence[bytes]
    take: Callable[[bytes], None]


REFUSALS = (SeatruthError,)
_FUNCTIONS = ("sin", "cos", "exp", "sqrt", "log", "tanh", "atan2", "hypot")
_MORE = """
[channels.r]
unit = "deg/s"
sign = -1
invalid_where = "r > 3"
[noise]
r = "0.1 deg/s"
[parameters]
K = { value = 0.2, min = 0, max = 1, prior = { mean = 0.1, sd = 0.1 } }
[[prepare]]
step = "hampel"
channels = ["r"]
[cost]
segments = 5.0
"""


def targets(place: Path, names: Sequence[str]) -> list[Target]:
    """The targets of these names; they keep their files in a folder that is theirs."""
    makers: dict[str, Callable[[Path], Target]] = {
        "expressions": _expressions,
        "study files": _studies,
        "comparison files": _comparisons,
        "logs": _logs,
        "results": _estimates,
        "checkpoints": _jobs,
        "stores": _stores,
    }
    return [makers[name](place) for name in names]


def _expressions(place: Path) -> Target:
    from seatruth.expression import Expression

    values = {"a": 1.5, "b": -0.5, "c_d": 3.0}
    known: dict[str, Any] = {name: getattr(math, name) for name in _FUNCTIONS}
    known |= {"abs": abs, "min": min, "max": max, "pi": math.pi}

    def take(data: bytes) -> None:
        text = data.decode("utf-8", "replace")
        found = Expression(text, values).evaluate(values)
        try:
            # Only what the parser has let through: numbers, these names, arithmetic.
            truth = eval(text.strip(), {"__builtins__": {}, **known}, values)
        except (ArithmeticError, ValueError, NameError, TypeError, SyntaxError, MemoryError, RecursionError):
            return
        if isinstance(truth, complex) or not math.isfinite(truth):
            return
        if not abs(float(found) - truth) <= 1e-9 * (1.0 + abs(truth)):
            raise Different(f"{text!r} is {found!r}, and Python says {truth!r}")

    examples = [
        b"-0.5 * a",
        b"a**2 + b/c_d - sin(b)",
        b"min(a, b, 2e-3) * exp(-(a))",
        b"atan2(a, b) + hypot(3, 4) ** 0.5",
    ]
    return Target("expressions", examples, [b"**", b"a", b"(", b")", b"1e", b"sqrt(", b",", b"-", b"c_d"], take)


def _studies(place: Path) -> Target:
    from seatruth.study import study_from

    source = boat.build(place / "study")

    def take(data: bytes) -> None:
        study_from(data.decode("utf-8"), source)

    long = boat.STUDY + _MORE
    words = [
        b"[",
        b"]",
        b"{",
        b"}",
        b"=",
        b'"',
        b"1e308",
        b"-1",
        b"nan",
        b"inf",
        b"true",
        b"0",
        b"[[trials]]\n",
        b"step = ",
        b"\n",
        b".",
    ]
    return Target("study files", [boat.STUDY.encode(), long.encode()], words, _decoding(take))


def _comparisons(place: Path) -> Target:
    from seatruth.comparison.file import read_comparison

    boat.build(place / "comparison")
    path = place / "comparison" / "comparison.toml"

    def take(data: bytes) -> None:
        path.write_bytes(data)
        read_comparison(path)

    words = [b"[", b"]", b"=", b'"', b"0", b"-1", b"1e9", b"nan", b"levels = ", b"use = ", b"[[solvers]]\n", b"truth"]
    return Target("comparison files", [boat.COMPARISON.encode()], words, take)


def _decoding(take: Callable[[bytes], None]) -> Callable[[bytes], None]:
    def decoded(data: bytes) -> None:
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            return
        take(data)

    return decoded


def _logs(place: Path) -> Target:
    from seatruth.trials import read_trial

    place.mkdir(parents=True, exist_ok=True)
    path = place / "log.csv"

    def take(data: bytes) -> None:
        path.write_bytes(data)
        trial = read_trial(path, inputs={"delta": "delta"}, outputs={"r": "r"})
        truth = _by_hand(data)
        for name, values in (("delta", trial.inputs["delta"]), ("r", trial.outputs["r"])):
            if truth is not None and not np.array_equal(values, truth[name], equal_nan=True):
                raise Different(f"{name} is {values.tolist()[:5]}, and in the file {truth[name].tolist()[:5]}")

    examples = [
        boat.log(6).encode(),
        boat.log(6).replace(",", ";").encode(),
        b't,"delta",r\n0,1,2\n0.5,"1",2.5\n1.0,1,\n',
    ]
    words = [b",", b";", b"\n", b'"', b"\t", b"nan", b"1e5", b"-", b".", b"#", b"\r", b"\0", b"inf", b"0"]
    return Target("logs", examples, words, take)


def _by_hand(data: bytes) -> dict[str, np.ndarray] | None:
    """The columns of a plain log, read with Python's csv; None where it is not plain enough to be sure."""
    if any(mark in data for mark in (b"#", b"%", b"//")):
        return None  # a comment where it begins a line
    try:
        rows = [row for row in csv.reader(data.decode("ascii").splitlines(), strict=True) if row]
        head = [cell.strip() for cell in rows[0]]
        places = {name: head.index(name) for name in ("delta", "r")}
        if len(set(head)) < len(head) or any(len(row) != len(head) for row in rows):
            return None
        cells = {name: [row[k].strip() for row in rows[1:]] for name, k in places.items()}
        return {name: np.array([float(cell) if cell else math.nan for cell in cells[name]]) for name in cells}
    except (ValueError, csv.Error, IndexError):
        return None


def _estimates(place: Path) -> Target:
    from seatruth.estimate import NAME, Estimate
    from seatruth.identification import identify
    from seatruth.optimizers import Budget
    from seatruth.study import load_study

    estimate = identify(load_study(boat.build(place / "estimate")), budget=Budget(evaluations=20), threads=1)
    folder = estimate.save(place / "estimate" / "result")
    whole = {path.name: path.read_bytes() for path in folder.iterdir()}

    def take(data: bytes) -> None:
        # The first byte says which file is replaced.
        name = sorted(whole)[data[0] % len(whole)] if data else NAME
        (folder / name).write_bytes(data[1:])
        try:
            found = Estimate.load(folder)
        finally:
            (folder / name).write_bytes(whole[name])
        if str(found) != str(estimate) or found.seed != estimate.seed:
            raise Different(f"a changed {name} was taken for the result")

    examples = [bytes([k]) + whole[name] for k, name in enumerate(sorted(whole))]
    words = [b'"', b"{", b"}", b"[", b"1", b"null", b"e9", b"\xff", b"\0\0\0\0"]
    return Target("results", examples, words, take)


def _jobs(place: Path) -> Target:
    from seatruth.storage.checkpoint import Checkpoint

    path = place / "run.jobs"
    values: dict[str, dict[str, Any]] = {f"job {k}": {"x": np.arange(3.0) + k, "text": "a"} for k in range(3)}
    with Checkpoint(path, "work") as checkpoint:
        for name, value in values.items():
            checkpoint.put(name, value)
    whole = path.read_bytes()

    def take(data: bytes) -> None:
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeatruthWarning)
            with Checkpoint(path, "work") as checkpoint:
                for name in checkpoint._jobs:
                    if name not in values or list(checkpoint.get(name)["x"]) != list(values[name]["x"]):
                        raise Different(f"a changed record was taken for {name!r}")

    return Target("checkpoints", [whole], [b"\n", b'"', b"{", b" ", b"0", b"$array", b"\xff"], take)


def _stores(place: Path) -> Target:
    from seatruth.comparison.store import Store

    source = place / "store.sqlite"
    with Store(source):
        pass
    with closing(sqlite3.connect(source)) as base:
        base.execute("PRAGMA journal_mode = DELETE")
        base.execute("INSERT INTO sources VALUES (1, '{}')")
        base.execute("INSERT INTO runs (key, solver, value, source, checksum) VALUES ('k', 's', 1.0, 1, 'none')")
        base.commit()
    whole = source.read_bytes()
    folder = Path(tempfile.mkdtemp(dir=place))

    def take(data: bytes) -> None:
        shutil.rmtree(folder)
        folder.mkdir()
        (folder / "a.sqlite").write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SeatruthWarning)
            with Store(folder / "a.sqlite", write=False) as store:
                if store.known(["k"]):
                    raise Different("a run without a checksum was taken")
                for table in ("runs", "fits", "estimates", "fit_parameters", "sources"):
                    store.frame(table)

    return Target("stores", [whole], [b"\xff", b"\0", b"SQLite", b"runs", b"TEXT", b"'"], take)
