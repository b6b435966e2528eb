"""The script of the process in which a file is read (see `isolation`).

It takes one JSON object on stdin, bounds its own memory and processor time, reads the file, and writes lines of JSON to
stdout: {"part": 0.5} as it goes on; {"what", "where", "do"} if the file was refused; else the names and types of all
columns, and after that line their bytes. What a library prints goes nowhere.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from typing import Any, BinaryIO


def main() -> None:
    """Reads one file; always ends with one answer."""
    order = json.loads(sys.stdin.buffer.read())
    out = os.fdopen(os.dup(1), "wb")
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)
    sys.path[:] = order["modules"]
    limit(order["memory"], order["seconds"])
    try:
        answer = read(order, out)
    except MemoryError:
        answer = refusal("reading it would take more memory than a file of its size can need", order["path"])
    except BaseException as problem:  # libraries raise all kinds for a damaged file, and Rust's panic is no Exception
        answer = refusal(*_why(problem, order["path"]))
    if isinstance(answer, dict):
        out.write(json.dumps(answer).encode() + b"\n")
    out.flush()
    os._exit(0)  # nothing to tidy up, and a damaged library may hang on the way out


def read(order: Mapping[str, Any], out: BinaryIO) -> dict[str, str] | None:
    """Reads the file and writes what is in it; None, or why it was refused."""
    import importlib

    module, _, name = order["reader"].partition(":")
    reader = getattr(importlib.import_module(module), name)(**order["options"])

    from pathlib import Path

    told = 0.0

    def progress(part: float) -> None:
        nonlocal told
        if part >= told + 0.01:
            told = part
            out.write(json.dumps({"part": part}).encode() + b"\n")
            out.flush()

    write(reader.read(Path(order["path"]), progress), out)
    return None


def write(content: Any, out: BinaryIO) -> None:
    """Writes a Content: one line of JSON, then the bytes of its columns."""
    import numpy as np

    arrays: list[Any] = []

    def described(values: Any) -> tuple[str, int]:
        values = np.ascontiguousarray(values)
        if values.dtype.kind == "O" and any(isinstance(value, bytes) for value in values):
            values = np.array([value[:64] if isinstance(value, bytes) else b"" for value in values], dtype=np.bytes_)
        elif values.dtype.kind == "O":
            values = np.array([str(value)[:64] for value in values], dtype=np.str_)
        if values.dtype.kind not in "biufmMUS" or values.ndim != 1:
            raise TypeError(f"a column of kind {values.dtype} with {values.ndim} dimensions")
        values = values.astype(values.dtype.newbyteorder("="), copy=False)
        arrays.append(values)
        return values.dtype.str, values.size

    topics = [
        {
            "name": topic.name,
            "columns": [(name, *described(values)) for name, values in topic.columns.items()],
            "lines": None if topic.lines is None else described(topic.lines),
            "units": dict(topic.units),
            "time": topic.time,
            "decimal": topic.decimal,
        }
        for topic in content.topics
    ]
    head = {"topics": topics, "notes": list(content.notes), "start": content.start}
    out.write(json.dumps(head).encode() + b"\n")
    for values in arrays:
        if values.nbytes:
            out.write(memoryview(values.view(np.uint8)))


def refusal(what: str, where: str, do: str = "Copy or export it again.") -> dict[str, str]:
    """The answer that refuses a file."""
    return {"what": what, "where": where, "do": do}


def _why(problem: BaseException, path: str) -> tuple[str, str, str]:
    do = "Copy or export it again."
    from seatruth.errors import SeatruthError

    if isinstance(problem, SeatruthError):
        return problem.what, problem.where or path, problem.do or do
    text = str(problem).strip().splitlines()
    return f"it is damaged ({text[0][:200] if text else type(problem).__name__})", path, do


def limit(memory: int, seconds: int) -> None:
    """A damaged size field must not take the machine's memory or time; not every system can bound them."""
    try:
        import resource

        for kind, most in ((resource.RLIMIT_DATA, memory), (resource.RLIMIT_CPU, seconds)):
            hard = resource.getrlimit(kind)[1]
            resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, OSError, ValueError):
        return


if __name__ == "__main__":
    main()
