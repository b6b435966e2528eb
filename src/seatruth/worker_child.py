"""The script of a process in which somebody else's code runs (see `workers`).

Messages are a length of eight bytes and a pickle. The first holds the search path of modules, the parent's process
number and a pickled function. Each further one holds arguments; the answer is ("done", result, processor seconds) or
("raised", kind, text). What the function prints goes nowhere, and the keyboard's interrupt is the parent's business.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
import sys
import time
from typing import IO, Any


def main() -> None:
    """Answers until the parent closes the pipe."""
    source, out = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    first = pickle.loads(receive(source))
    sys.path[:] = first["modules"]
    from seatruth.processes import end_with

    end_with(first["parent"])
    function: Any = None
    try:
        function = pickle.loads(first["function"])
        answer: tuple[Any, ...] = ("ready",)
    except BaseException as problem:  # the function's module may do anything when it is imported
        answer = ("raised", type(problem).__name__, str(problem))
    send(out, answer)
    while function is not None:
        try:
            arguments = receive(source)
        except EOFError:
            break
        began = time.process_time()
        try:
            answer = ("done", function(*pickle.loads(arguments)), time.process_time() - began)
        except MemoryError:
            answer = ("raised", "MemoryError", "the machine has too little memory for it")
        except BaseException as problem:
            answer = ("raised", type(problem).__name__, str(problem)[:2000])
        send(out, answer)
    out.flush()
    os._exit(0)  # foreign code may hang on the way out


def send(stream: IO[bytes], message: Any) -> None:
    """Writes one message of plain values and arrays."""
    send_bytes(stream, pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))


def send_bytes(stream: IO[bytes], data: bytes) -> None:
    """Writes one message that is pickled already."""
    stream.write(struct.pack("<Q", len(data)))
    stream.write(data)
    stream.flush()


def receive(stream: IO[bytes]) -> bytes:
    """The bytes of one message; EOFError where the other side has ended."""
    head = stream.read(8)
    if len(head) < 8:
        raise EOFError
    (size,) = struct.unpack("<Q", head)
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


if __name__ == "__main__":
    main()
