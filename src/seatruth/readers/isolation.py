"""Reads a file in a process of its own, with bounded memory and processor time.

Libraries that decode binary formats can crash the interpreter, run for ever or ask for all memory when a few bytes of
a file are wrong. In a process of its own they take nothing with them.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from contextlib import suppress
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np

from seatruth.errors import BadInput
from seatruth.processes import END_S, search_path, started
from seatruth.readers import child
from seatruth.readers.base import Content, Topic

MEMORY_BYTES = 1 * 2**30
"""What the process may take beside what the file needs: the libraries and their buffers (0.3 GB measured), and room for
the numbers of a small compressed file (chosen here [S])."""
MEMORY_PER_BYTE = 40
"""Bytes of memory for each byte of the file: a compressed file of repeated values holds about that much (chosen here
[S])."""
SECONDS = 10.0
"""Processor time for any file, s: 20 times what the slowest library takes to start (chosen here [S])."""
SECONDS_PER_MEGABYTE = 6.0
"""Processor time for each megabyte of the file, s: three times what pymavlink, the slowest, takes (chosen here [S])."""


def read_isolated(reader: str, options: Mapping[str, Any], path: Path, progress: Callable[[float], None]) -> Content:
    """What `reader` ("module:Class") reads in a process of its own; BadInput for all that goes wrong there."""
    size = sum(part.stat().st_size for part in path.rglob("*")) if path.is_dir() else path.stat().st_size
    seconds = SECONDS + SECONDS_PER_MEGABYTE * size / 1e6
    order = {
        "reader": reader,
        "options": dict(options),
        "path": str(path),
        "memory": MEMORY_BYTES + MEMORY_PER_BYTE * size,
        "seconds": int(seconds),
        "modules": search_path(),
    }
    with started(child.__file__) as process:
        assert process.stdin is not None
        assert isinstance(process.stdout, BufferedReader)
        try:
            process.stdin.write(json.dumps(order).encode())
            process.stdin.close()
            content = _receive(process.stdout, progress)
            with suppress(subprocess.TimeoutExpired):
                process.wait(END_S)
        except (EOFError, ValueError, OSError):
            content = None
        finally:
            process.kill()
    if isinstance(content, BadInput):
        raise content
    if content is None:
        what = "reading it took too much processor time or memory, or crashed the library that reads it"
        raise BadInput(f"it is damaged: {what}", where=str(path), do="Copy or export it again.")
    return content


def _receive(stream: BufferedReader, progress: Callable[[float], None]) -> Content | BadInput:
    """The child's answer: lines of JSON, then the bytes of all columns in their order."""
    while True:
        line = stream.readline()
        if not line:
            raise EOFError
        message = json.loads(line)
        if "part" in message:
            progress(float(message["part"]))
        elif "what" in message:
            return BadInput(message["what"], where=message["where"], do=message["do"])
        else:
            break
    topics = []
    for topic in message["topics"]:
        arrays = {name: _array(stream, kind, count) for name, kind, count in topic["columns"]}
        lines = _array(stream, *topic["lines"]) if topic["lines"] else None
        topics.append(Topic(topic["name"], arrays, topic["units"], topic["time"], lines, topic["decimal"]))
    start = message["start"]
    return Content(topics, message["notes"], None if start is None else (float(start[0]), str(start[1])))


def _array(stream: BufferedReader, kind: str, count: int) -> np.ndarray[Any, Any]:
    values = np.empty(count, dtype=np.dtype(kind))
    bytes_of: Any = values.view(np.uint8) if values.nbytes else b""
    view = memoryview(bytes_of)
    done = 0
    while done < values.nbytes:
        got = stream.readinto(view[done:])
        if not got:
            raise EOFError
        done += got
    return values
