"""Parquet and MATLAB files as tables of columns."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from seatruth.errors import BadInput, nearest
from seatruth.trials import mat_subprocess
from seatruth.trials.tables import Table, named


def parquet(file: Path, data: bytes) -> Table:
    """The columns of a Parquet file."""
    import pyarrow.parquet

    try:
        content = pyarrow.parquet.read_table(io.BytesIO(data))
        names, units = named(content.column_names, str(file))
        columns = {name: content.column(k).to_pandas() for k, name in enumerate(names)}
    except BadInput:
        raise
    except Exception as problem:  # pyarrow raises many kinds for a damaged file
        raise BadInput(
            f"it cannot be read as Parquet ({_first_line(problem)})", where=str(file), do="Write the file again."
        ) from None
    for name, field in zip(names, content.schema, strict=True):
        unit = (field.metadata or {}).get(b"unit")
        if unit and name not in units:
            units[name] = unit.decode("utf-8", "replace")
    table = Table(str(file), {name: pd.Series(c).reset_index(drop=True) for name, c in columns.items()}, units)
    if not len(table):
        raise BadInput("it has no rows", where=str(file), do="Check how it was exported.")
    return table


def matlab(file: Path, data: bytes, variable: str | None = None) -> Table:
    """The columns of a MATLAB file up to version 7.2: vectors of one length, or a struct of such vectors."""
    if data.startswith(b"MATLAB 7.3") or data.startswith(b"\x89HDF"):
        raise BadInput("MATLAB files of version 7.3 cannot be read", where=str(file), do="Save it with -v7.")
    flat = _vectors(file, data)
    if variable is not None:
        chosen = {name: values for name, values in flat.items() if _belongs(name, variable)}
        if not chosen:
            known = {name.partition(".")[0].partition("(")[0] for name in flat}
            raise BadInput(
                f"no variable {variable!r} with columns of numbers", where=str(file), do=nearest(variable, known)
            )
        flat = chosen
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


def _vectors(file: Path, data: bytes) -> dict[str, Any]:
    """Every vector in the file by its name, read in a process of its own (see mat_subprocess)."""
    child = Path(mat_subprocess.__file__)
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-P", str(child)], input=data, capture_output=True, env=environment, check=False
    )
    if done.returncode != 0:
        said = done.stderr.decode("utf-8", "replace").strip()
        why = f" ({said})" if done.returncode == mat_subprocess.REFUSED and said else ""
        raise BadInput(f"it is not a sound MATLAB file{why}", where=str(file), do="Save it again with -v7.")
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
        names = arrays["arr_0"].tolist()
        return {name: arrays[f"arr_{k + 1}"] for k, name in enumerate(names)}


def _belongs(name: str, variable: str) -> bool:
    return name == variable or name.startswith((f"{variable}.", f"{variable}("))


def _short_names(names: list[str]) -> list[str]:
    """Names without the struct they share, if they still differ ("run.u", "run.v" become "u", "v")."""
    last = [name.rpartition(".")[2] for name in names]
    return last if len(set(last)) == len(last) else names


def _first_line(problem: Exception) -> str:
    text = str(problem).strip().splitlines()
    return text[0][:200] if text else type(problem).__name__
