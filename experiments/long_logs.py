"""How long does it take to read a long log, and how much memory? A synthetic one in every format.

    python experiments/long_logs.py [--quick]

Formats of tables hold a million rows of twelve channels. Formats of messages, whose libraries decode one message after
another, hold 2,000 samples of eight channels or less, in three to five topics. The time is that of the processor,
of the process that reads the file and of the one that decodes it; the memory is the larger of what the two need.
"""

from __future__ import annotations

import functools
import multiprocessing
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import Options, Results, main
from log_formats import WRITERS, manoeuvre
from reader_fuzz import memory, seconds

from seatruth.readers import read_log

TABLES = ("csv", "parquet", "matlab", "hdf5")
MOST_SECONDS, MOST_MEGABYTES = 10.0, 1000.0
"""What "in seconds" and "bounded" mean here, for a million rows: ten times the size of their numbers."""


def body(options: Options, results: Results) -> None:
    """Reads a long log of every format."""
    results.expect(len(WRITERS))
    rows = []
    for name in WRITERS:
        size = (1_000_000 if name in TABLES else 2_000) // (100 if options.quick else 1)
        definition = {"format": name, "samples": size}
        rows.append({"format": name, **results.stage(name, definition, functools.partial(in_process, name, size))})
    table = pd.DataFrame(rows)
    results.add_table("long_logs", table)
    results.add_text("```\n" + table.to_string(index=False) + "\n```")
    for label, column, most, unit in (
        ("longest reading", "seconds", MOST_SECONDS, "s of processor time"),
        ("most memory", "MB", MOST_MEGABYTES, "MB"),
    ):
        worst = float(table[column].max())
        results.add_figure(label, worst, unit, goal=f"at most {most:g}", met=worst <= most)


def in_process(name: str, size: int) -> dict[str, Any]:
    """The figures of one format, from a process of its own so that its memory is measured alone."""
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as folder:
        with context.Pool(1) as writer:
            path = writer.apply(write, (name, folder, size))
        with context.Pool(1) as reader:
            return reader.apply(read, (path,))


def write(name: str, folder: str, size: int) -> Path:
    """A file of this format with so many samples."""
    run = manoeuvre(np.arange(size) / 100.0)
    if name in TABLES:
        run = run.assign(phi=0.5 * run["v"], p=0.2 * run["r"], q=0.1 * run["r"])
    return WRITERS[name](Path(folder), run).path


def read(path: Path) -> dict[str, Any]:
    """Size and figures of reading a file."""
    files = [path] if path.is_file() else [part for part in path.rglob("*") if part.is_file()]
    before, began = memory()[0], seconds()
    log = read_log(path)
    took, (own, children) = seconds() - began, memory()
    return {
        "samples": max(len(table) for table in log.tables.values()),
        "values": sum(len(table) * len(table.columns) for table in log.tables.values()),
        "file_MB": round(sum(part.stat().st_size for part in files) / 1e6, 1),
        "seconds": round(took, 2),
        "MB": round(max(own - before, children), 1),
    }


if __name__ == "__main__":
    sys.exit(main("long_logs", str(__doc__).splitlines()[0], body, seeds={}))
