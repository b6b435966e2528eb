"""Parquet and MATLAB files as tables of columns."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from seatruth.errors import BadInput, nearest
from seatruth.trials.tables import Table, named


def parquet(file: Path, data: bytes) -> Table:
    """The columns of a Parquet file."""
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(io.BytesIO(data))
        names, units = named(table.column_names, str(file))
        columns = {name: table.column(k).to_pandas() for k, name in enumerate(names)}
    except BadInput:
        raise
    except Exception as problem:  # pyarrow raises many kinds for a damaged file
        raise BadInput(f"it cannot be read as Parquet ({_first_line(problem)})", where=str(file)) from None
    for name, field in zip(names, table.schema, strict=True):
        unit = (field.metadata or {}).get(b"unit")
        if unit and name not in units:
            units[name] = unit.decode("utf-8", "replace")
    found = Table(str(file), {name: pd.Series(c).reset_index(drop=True) for name, c in columns.items()}, units)
    if not len(found):
        raise BadInput("it has no rows", where=str(file), do="Check how it was exported.")
    return found


def matlab(file: Path, data: bytes, variable: str | None = None) -> Table:
    """The columns of a MATLAB file up to version 7.2: vectors of one length, or a struct of such vectors."""
    import scipy.io

    if data.startswith(b"MATLAB 7.3") or data.startswith(b"\x89HDF"):
        raise BadInput("MATLAB files of version 7.3 cannot be read", where=str(file), do="Save it with -v7.")
    try:
        stream: Any = io.BytesIO(data)
        content = scipy.io.loadmat(stream, simplify_cells=True)
    except Exception as problem:  # scipy raises many kinds for a damaged file
        raise BadInput(f"it cannot be read as a MATLAB file ({_first_line(problem)})", where=str(file)) from None
    content = {name: value for name, value in content.items() if not name.startswith("__")}
    if variable is not None:
        if variable not in content:
            raise BadInput(f"no variable {variable!r}", where=str(file), do=nearest(variable, content))
        content = {variable: content[variable]}
    flat = dict(_vectors(content))
    if not flat:
        raise BadInput("it holds no columns of numbers", where=str(file), do="Store vectors of one length.")
    lengths = {name: len(values) for name, values in flat.items()}
    usual = max(set(lengths.values()), key=lambda length: (list(lengths.values()).count(length), length))
    kept = {name: values for name, values in flat.items() if len(values) == usual}
    if usual < 2:
        raise BadInput("its variables are single numbers", where=str(file), do="Store vectors of one length.")
    others = {name: length for name, length in lengths.items() if length not in (usual, 1)}
    if others:
        name, length = next(iter(others.items()))
        raise BadInput(
            f"{name!r} has {length} values and the others have {usual}",
            where=str(file),
            do="Name the struct that holds the columns, or store vectors of one length.",
        )
    names, units = named(_short_names(list(kept)), str(file))
    return Table(str(file), {n: pd.Series(values) for n, values in zip(names, kept.values(), strict=True)}, units)


def _vectors(content: Mapping[str, Any], prefix: str = "", depth: int = 0) -> list[tuple[str, Any]]:
    """All vectors in nested structs, as ("struct.field", values); a matrix gives one vector a column."""
    found: list[tuple[str, Any]] = []
    for name, value in content.items():
        full = f"{prefix}{name}"
        if isinstance(value, Mapping) and depth < 8:
            found += _vectors(value, f"{full}.", depth + 1)
        elif isinstance(value, np.ndarray) and value.dtype.kind in "buif" and value.size:
            if value.ndim == 1:
                found.append((full, _native(value)))
            elif value.ndim == 2 and min(value.shape) == 1:
                found.append((full, _native(value.ravel())))
            elif value.ndim == 2:
                found += [(f"{full}({k + 1})", _native(value[:, k])) for k in range(value.shape[1])]
    return found


def _native(values: Any) -> Any:
    return values.astype(values.dtype.newbyteorder("="))


def _short_names(names: list[str]) -> list[str]:
    """Names without the struct they share, if they still differ ("run.u", "run.v" become "u", "v")."""
    last = [name.rpartition(".")[2] for name in names]
    return last if len(set(last)) == len(last) else names


def _first_line(problem: Exception) -> str:
    text = str(problem).strip().splitlines()
    return text[0][:200] if text else type(problem).__name__
