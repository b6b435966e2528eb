"""How long the missing runs of a comparison will take, from short searches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from seatruth.comparison.problem import Run
from seatruth.comparison.runner import STORE
from seatruth.comparison.spec import Comparison
from seatruth.comparison.store import Store
from seatruth.comparison.worker import jobs_of, trial_search
from seatruth.progress import Progress, ProgressEvent, silent

_EVALUATIONS = 1000
"""Evaluations of a short search: twenty generations of fifty candidates. Chosen here [S]."""


def forecast(
    comparison: Comparison, folder: str | Path | None = None, *, progress: Progress | None = None
) -> pd.DataFrame:
    """The time that the missing runs of a comparison will take on one core at most.

    Each solver searches once on the first realisation of each problem and cost, with a small budget. The time of an
    evaluation there, times the largest budget, is the time of each of its searches, unless it converges before.

    Args:
        comparison: What is to be compared.
        folder: The folder of its store; None counts all searches as missing.
        progress: Called after each short search.

    Returns:
        By problem, cost and solver the `searches` that are missing, the time of one (`seconds_each`) and of all
        (`seconds`), in s.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Comparison
        >>> from seatruth.comparison import Noise, Problem, forecast
        >>> study = seatruth.sample.load()
        >>> problems = [Problem("sample", study.replace(trials=study.trials[:1]), start="study")]
        >>> comparison = Comparison(problems, ["cma_es"], [Noise("white", 0.01)], seeds=15, budgets=[100])
        >>> forecast(comparison)["searches"].tolist()
        [15]
    """
    known: set[str] = set()
    if folder is not None and (Path(folder) / STORE).exists():
        with Store(Path(folder) / STORE, write=False) as store:
            known = store.known(run.key for run in comparison.runs)
    groups: dict[tuple[str, str, str], list[Run]] = {}
    for run in comparison.runs:
        if run.of == run.budget and run.key not in known:
            groups.setdefault((run.problem, run.cost, run.solver), []).append(run)
    rows, tell = [], progress or silent
    for done, (group, runs) in enumerate(groups.items()):
        tell(ProgressEvent("Forecast", done=done, total=len(groups), unit="short searches"))
        rows.append([*group, len(runs), *_seconds(comparison, runs)])
    tell(ProgressEvent("Forecast", done=len(groups), total=len(groups), unit="short searches"))
    return pd.DataFrame(rows, columns=["problem", "cost", "solver", "searches", "seconds_each", "seconds"])


def _seconds(comparison: Comparison, runs: Sequence[Run]) -> tuple[float, float]:
    """Time in s of one of these searches, with the largest budget, and of all."""
    (job,) = jobs_of(comparison, [runs[0]])
    evaluations, seconds, ended = trial_search(job, _EVALUATIONS)
    spent = [seconds if ended else seconds * run.budget / max(evaluations, 1) for run in runs]
    return max(spent), sum(spent)
