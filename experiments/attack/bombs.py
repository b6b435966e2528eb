"""Binary logs that unpack to far more than they weigh, or that lead nowhere: workbooks, MATLAB and HDF5 files."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import openpyxl
from scipy.io import savemat

Write = Callable[[Path], None]


def bombs() -> Iterator[tuple[str, str, Write]]:
    """Name, file and writer of each."""
    yield "a workbook that unpacks to 600 MB", "log.xlsx", _workbook
    yield "a MATLAB file that unpacks to 300 MB", "log.mat", _matlab
    yield "an HDF5 file of 3,000 nested groups", "log.h5", _nested
    yield "an HDF5 file of 1e12 numbers", "log.h5", _huge
    yield "an HDF5 file of links that loop", "log.h5", _looped
    yield "an HDF5 file whose numbers are those of a device", "log.h5", _elsewhere


def _workbook(path: Path) -> None:
    small = path.with_suffix(".small")
    book = openpyxl.Workbook()
    book.create_sheet(index=0).append(["t", "delta"])
    book.save(small)
    row = b'<row><c t="n"><v>0</v></c><c t="n"><v>1</v></c></row>' * 100_000
    with zipfile.ZipFile(small) as given, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for name in given.namelist():
            head, mark, tail = given.read(name).partition(b"</sheetData>")
            with made.open(name, "w") as member:
                member.write(head)
                for _ in range(120 if name.endswith("sheet1.xml") else 0):
                    member.write(row)
                member.write(mark + tail)
    small.unlink()


def _matlab(path: Path) -> None:
    savemat(path, {"t": np.zeros(40_000_000)}, do_compression=True)


def _nested(path: Path) -> None:
    with h5py.File(path, "w") as file:
        group = file
        for _ in range(3000):
            group = group.create_group("g")
        group["t"] = np.arange(100.0)


def _huge(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("t", (10**12,), chunks=(10**6,), compression="gzip", dtype="f8")


def _looped(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(100.0)
        file["loop"], file["up"] = h5py.SoftLink("/loop"), h5py.SoftLink("/")
        file["out"], file["hard"] = h5py.ExternalLink("/etc/passwd", "/x"), file["/"]


def _elsewhere(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file.create_dataset("t", (100,), dtype="f8", external=[("/dev/zero", 0, 800)])
