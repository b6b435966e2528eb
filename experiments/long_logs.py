"""How long does it take to read a long log, and how much memory? A synthetic one in every format.

    python experiments/long_logs.py [--quick] [--huge]

Formats of tables hold a million rows of twelve channels. Formats of messages, whose libraries decode one message after
another, hold 2,000 samples of eight channels or less, in three to five topics; a tenth and a hundredth of each are read
too. The time is that of the processor, of the process that reads the file and of the one that decodes it; the memory is
the larger of what the two need.
With --huge, tables of ten million rows are read in place of all that.
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
from common import COLOURS, Options, Results, main
from log_formats import WRITERS, manoeuvre
from reader_fuzz import memory, seconds

from seatruth.readers import read_log

TABLES = ("csv", "parquet", "matlab", "hdf5")
MOST_SECONDS, MOST_MEGABYTES = 10.0, 1000.0
"""What "in seconds" and "bounded" mean here, for a million rows: ten times the size of their numbers."""
SWITCHES = {"huge": "tables of ten million rows alone"}
MOST_TIMES_NUMBERS = 3.0
"""What "bounded" means for ten million rows, where the libraries themselves count for little: the file's numbers,
a copy of them, and as much again for what a format needs on the way."""


def body(options: Options, results: Results) -> None:
    """Reads a long log of every format, or a huge one of every table."""
    huge = options.asked("huge")
    names = TABLES if huge else tuple(WRITERS)
    shares = (1,) if huge or options.quick else (100, 10, 1)
    results.expect(len(names) * len(shares))
    rows = []
    for name in names:
        longest = (10_000_000 if huge else 1_000_000 if name in TABLES else 2_000) // (100 if options.quick else 1)
        for size in (longest // share for share in shares):
            work, stage = functools.partial(in_process, name, size), f"{name} {size}"
            rows.append({"format": name, **results.stage(stage, {"format": name, "samples": size}, work)})
    table = pd.DataFrame(rows)
    results.add_picture("long_logs", picture(table))
    if huge:
        table["times_numbers"] = (1e6 * table["MB"] / (8 * table["values"])).round(2)
    results.add_table("long_logs", table)
    results.add_text("```\n" + table.to_string(index=False) + "\n```")
    goals = [("longest reading", "seconds", MOST_SECONDS * (10 if huge else 1), "s of processor time")]
    if huge and not options.quick:
        goals += [("most memory", "times_numbers", MOST_TIMES_NUMBERS, "times the size of the numbers")]
    else:
        goals += [("most memory", "MB", MOST_MEGABYTES, "MB")]
    for label, column, most, unit in goals:
        worst = float(table[column].max())
        results.add_figure(label, worst, unit, goal=f"at most {most:g}", met=worst <= most)


def picture(table: pd.DataFrame) -> Any:
    """Processor time and memory over the samples of a log: formats of tables on the left, of messages on the right."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 2, figsize=(9.0, 5.6), sharex="col", sharey="row", layout="constrained")
    tables = table["format"].isin(TABLES)
    groups = {"tables": table[tables], "messages, and sheets of Excel": table[~tables]}
    for (upper, lower), (kind, own) in zip(panels.T, groups.items(), strict=True):
        for k, (name, part) in enumerate(own.groupby("format", sort=False)):
            look = {"color": COLOURS[(0, 3, 2, 4, 1, 5, 7)[k % 7]], "marker": "osD^vPX"[k % 7], "ms": 5, "lw": 1.2}
            upper.plot(part["samples"], part["seconds"].clip(lower=0.01), label=name, **look)
            lower.plot(part["samples"], part["MB"].clip(lower=1.0), **look)
        upper.set_title(f"{kind} (synthetic logs)", fontsize=9)
        for axes, goal in ((upper, MOST_SECONDS), (lower, MOST_MEGABYTES)):
            axes.axhline(goal, color="black", ls="--", lw=1)
            axes.set(xscale="log", yscale="log")
            axes.grid(True, alpha=0.3)
        lower.set_xlabel("samples (1)")
        if len(own):
            upper.legend(fontsize=8, ncols=4, loc="upper left", bbox_to_anchor=(0.0, 0.94))
    panels[0, 0].set_ylabel("processor time (s)")
    panels[1, 0].set_ylabel("most memory (MB)")
    return figure


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
    sys.exit(main("long_logs", str(__doc__).splitlines()[0], body, seeds={}, switches=SWITCHES))
