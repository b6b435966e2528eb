"""A reader that crashes, hangs or eats all memory when it is told to."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import numpy as np

from seatruth.errors import BadInput
from seatruth.readers.base import Content, Progress, Reader, Topic


@dataclass(frozen=True)
class Wicked(Reader):
    """Does what its option says, in the process that reads."""

    does: str = field(default="", metadata={"doc": "What it does."})

    name: ClassVar[str] = "wicked"
    title: ClassVar[str] = "nothing good"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        return False

    def read(self, path: Path, progress: Progress) -> Content:
        if self.does == "crash":
            os.abort()
        if self.does == "hang":
            while True:
                pass
        if self.does == "eat":
            return Content([Topic("", {"a": np.ones(10**10)})])
        if self.does == "panic":
            raise BaseException("no Exception at all")
        if self.does == "refuse":
            raise BadInput("it is wrong", where="line 7", do="Mend it.")
        if self.does == "strange":
            return Content([Topic("", {"a": np.array([1 + 1j])})])
        print("noise on standard output")
        os.write(1, b"and from a library")
        progress(0.5)
        texts, dates = np.array(["a", "é"]), np.array(["2025-07-31", "NaT"], dtype="datetime64[us]")
        columns = {"t": np.array([1, 2], dtype=">i4"), "note": texts, "day": dates, "flag": np.array([True, False])}
        other = Topic("b", {"none": np.empty(0)})
        return Content(
            [Topic("a", columns, {"t": "s"}, "t", np.array([3, 4])), other], ["A note."], (1.0, "2025-07-31")
        )
