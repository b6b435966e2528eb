"""MATLAB files of version 7.3, which are HDF5, and other HDF5 files of vectors."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from seatruth.errors import BadInput
from seatruth.readers.base import Column, Content, Progress, Reader
from seatruth.readers.vectors import topics

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_DEEPEST = 100
"""Groups within groups of a file. [S] Structures of logs have three or four; the library takes 30 s for 3000."""
_MOST_VECTORS = 10_000
"""Vectors that are read from one file; more come from a damaged one (chosen here [S])."""


@dataclass(frozen=True)
class HDF5(Reader):
    """Datasets of numbers, or groups of such datasets: a MATLAB struct is a group.

    MATLAB stores matrices by column, so HDF5 shows them transposed; they are turned back in files that MATLAB wrote.
    """

    variable: str | None = field(default=None, metadata={"doc": "Variable or group that holds the columns."})

    name: ClassVar[str] = "hdf5"
    title: ClassVar[str] = "MATLAB (-v7.3) and HDF5"
    suffixes: ClassVar[tuple[str, ...]] = (".mat", ".h5", ".hdf5")
    modules: ClassVar[tuple[str, ...]] = ("h5py",)
    extra: ClassVar[str] = "seatruth[hdf5]"

    @classmethod
    def recognises(cls, head: bytes, path: Path) -> bool:
        return head.startswith((b"MATLAB 7.3 MAT-file", _SIGNATURE))

    def read(self, path: Path, progress: Progress) -> Content:
        import h5py

        found: dict[str, Column] = {}
        with h5py.File(path, "r") as file:
            names: list[str] = []

            def visited(name: str) -> str | None:
                names.append(name)
                return name if name.count("/") > _DEEPEST else None

            # Hard links alone: a link to another file is not followed.
            if file.visit(visited) is not None:
                raise BadInput(
                    f"groups are nested more than {_DEEPEST} deep",
                    where=str(path),
                    do="Copy what is needed into a flat file.",
                )
            names = [name for name in names if not name.startswith("#") and isinstance(file[name], h5py.Dataset)]
            for k, name in enumerate(names[:_MOST_VECTORS]):
                _add(found, name.replace("/", "."), file[name])
                progress((k + 1) / len(names))
        return Content(topics(found, str(path), self.variable))


def _add(found: dict[str, Column], name: str, dataset: Any) -> None:
    """Adds the vectors of one dataset, if it holds numbers."""
    if dataset.dtype.kind not in "buif" or dataset.ndim not in (1, 2) or not dataset.size:
        return
    if dataset.external or dataset.is_virtual:
        return  # its numbers would come from other files, which the user did not name
    mark = dataset.attrs.get("MATLAB_class")
    if dataset.attrs.get("MATLAB_empty") or mark in (b"char", b"cell", b"struct", b"function_handle"):
        return
    values = np.asarray(dataset[()])
    if mark is not None:
        values = values.T
    if values.ndim == 1 or min(values.shape) == 1:
        found[name] = values.ravel()
    else:
        found.update({f"{name}({k + 1})": values[:, k] for k in range(values.shape[1])})
