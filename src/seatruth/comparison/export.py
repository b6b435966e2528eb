"""Runs as files of IOHprofiler, and lists of targets as COCO uses them.

The format is that of IOHexperimenter's logger (de Nobel and others 2024, "IOHexperimenter: benchmarking platform for
iterative optimization heuristics", Evolutionary Computation 32): a JSON file a solver and problem, its runs as text.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from seatruth.comparison.optimisation import CONDITION
from seatruth.errors import BadInput
from seatruth.storage.atomic import write_file

if TYPE_CHECKING:
    import pandas as pd

    from seatruth.comparison.results import Results

_VERSION = "0.3.18"
"""Version of the format."""


def write_ioh(results: Results, folder: str | Path) -> list[Path]:
    """Writes the searches with the largest budgets for IOHanalyzer and iohinspector; returns the JSON files.

    A function is a condition (problem, cost, noise, level), an instance a realisation of it (its number plus 1), and
    `raw_y` the excess over the best known fit in units of chi-square. Runs that failed are left out.
    """
    where = Path(folder)
    written = []
    solvers = results.comparison.solver
    conditions = [runs for _, runs in results.final.groupby(CONDITION, sort=False)]
    for number, runs in enumerate(conditions, 1):
        first = runs.iloc[0]
        name = f"{first['problem']}, {first['cost']}, {100 * first['level']:g} % {first['noise']}"
        for solver, own in runs[runs["status"] == "done"].groupby("solver", sort=False):
            inner = where / _safe(str(solver))
            stem = f"f{number}_{_safe(name)}"
            data = f"data_{stem}/IOHprofiler_f{number}_DIM{int(own['dimension'].iloc[0])}.dat"
            listed, lines = _runs(results, own)
            if not listed:
                continue
            description = {
                "version": _VERSION,
                "suite": "seatruth",
                "function_id": number,
                "function_name": name,
                "maximization": False,
                "algorithm": {
                    "name": str(solver),
                    "info": json.dumps(solvers[str(solver)].describe()),
                },
                "attributes": ["evaluations", "raw_y"],
                "scenarios": [{"dimension": int(own["dimension"].iloc[0]), "path": data, "runs": listed}],
            }
            write_file(inner / data, "\n".join(lines) + "\n")
            written.append(inner / f"IOHprofiler_{stem}.json")
            write_file(written[-1], json.dumps(description, indent=1) + "\n")
    return written


def _runs(results: Results, runs: pd.DataFrame) -> tuple[list[dict[str, Any]], list[str]]:
    """The entries of these runs, and their histories as lines."""
    listed: list[dict[str, Any]] = []
    lines: list[str] = []
    for run in runs.to_dict("records"):
        evaluations, best, _ = results.histories[run["key"]]
        excess = [max(0.0, 2.0 * (value - run["best"])) for value in best]
        if not excess:
            continue
        lines.append("evaluations raw_y")
        lines += [f"{int(at)} {y:.10g}" for at, y in zip(evaluations, excess)]
        stand = {"evals": int(evaluations[-1]), "y": excess[-1], "x": _estimates(results, run["key"])}
        listed.append({"instance": int(run["seed"]) + 1, "evals": int(run["evaluations"]), "best": stand})
    return listed, lines


def _estimates(results: Results, key: str) -> list[float]:
    values = results.estimates.loc[results.estimates["key"] == key, "value"]
    return [float(value) for value in values]


def _safe(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-." else "_" for c in name)


def read_targets(path: str | Path) -> tuple[float, ...]:
    """Targets from a text file: numbers with blanks, commas or lines between them; after % or # a line is a comment.

    COCO's lists of target precisions can be read as they are; here they are excesses in units of chi-square.

    Raises:
        BadInput: the file cannot be read, has no target or one that is not above 0.

    Example:
        >>> from pathlib import Path
        >>> _ = Path("targets.txt").write_text("% two decades\\n1e2, 1e1 1e0\\n")
        >>> read_targets("targets.txt")
        (100.0, 10.0, 1.0)
    """
    source = Path(path)
    try:
        text = source.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as problem:
        why = getattr(problem, "strerror", None) or "it is no text"
        raise BadInput(f"the targets cannot be read ({why})", where=str(path), do="Name a text file.") from None
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        for word in re.split(r"[\s,;]+", re.split("[%#]", line)[0].strip(" \t[]()")):
            if not word:
                continue
            try:
                value = float(word)
            except ValueError:
                value = math.nan
            if not (math.isfinite(value) and value > 0):
                raise BadInput(f"{word!r} is no target", where=f"{path}, line {number}", do="Give numbers above 0.")
            found.append(value)
    if not found:
        raise BadInput("it has no target", where=str(path), do="Give numbers above 0, as 1e2 1e1 1e0.")
    return tuple(sorted(set(found), reverse=True))
