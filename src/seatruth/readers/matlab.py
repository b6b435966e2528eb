"""MATLAB files up to version 7.2."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seatruth.errors import BadInput
from seatruth.readers.base import Column, Content, Progress, Reader
from seatruth.readers.vectors import topics

DEEPEST = 8
"""Structs in structs; deeper ones come from damaged files (chosen here [S])."""


@dataclass(frozen=True)
class Matlab(Reader):
    """Vectors of one length, or structs of such vectors, as MATLAB saves them with -v7 and scipy reads them."""

    variable: str | None = field(
        default=None, metadata={"doc": "Variable of a MATLAB or HDF5 file that holds the columns."}
    )

    name: ClassVar[str] = "matlab"
    title: ClassVar[str] = "MATLAB (-v7)"
    suffixes: ClassVar[tuple[str, ...]] = (".mat",)

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        old = path.suffix.lower() == ".mat" and b"\0" in head[:4096]
        return head.startswith(b"MATLAB 5.0 MAT-file") or (old and not head.startswith((b"MATLAB 7.3", b"\x89HDF")))

    def read(self, path: Path, progress: Progress) -> Content:
        import scipy.io

        try:
            content = scipy.io.loadmat(path, simplify_cells=True)
            found = dict(_flat({name: value for name, value in content.items() if not name.startswith("__")}))
        except MemoryError:
            raise
        except Exception as problem:  # scipy raises many kinds for a damaged file
            text = (str(problem).strip() or type(problem).__name__).splitlines()[0][:200]
            raise BadInput(
                f"it is not a sound MATLAB file ({text})", where=str(path), do="Save it again with -v7."
            ) from None
        return Content(topics(found, str(path), self.variable))


def _flat(content: Mapping[str, Any], prefix: str = "", depth: int = 0) -> list[tuple[str, Column]]:
    """All vectors in nested structs, as ("struct.field", values); a matrix gives one vector a column."""
    found: list[tuple[str, Column]] = []
    for name, value in content.items():
        full = f"{prefix}{name}"
        if isinstance(value, Mapping) and depth < DEEPEST:
            found += _flat(value, f"{full}.", depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "buif" and value.size:
            if value.ndim == 1 or (value.ndim == 2 and min(value.shape) == 1):
                found.append((full, value.ravel()))
            elif value.ndim == 2:
                found += [(f"{full}({k + 1})", value[:, k]) for k in range(value.shape[1])]
    return found
