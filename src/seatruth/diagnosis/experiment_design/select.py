"""The next trial: which one of a menu would tell best apart what these trials cannot.

Each surviving cause in turn is taken for the true one, at the size that was fitted. What the others leave of its trace
once they and all coefficients are refitted is its lambda to the nearest of them (`rivals.py`). A trial's worth is the
chance that it doubles that, in the mean over the survivors by their probability.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.diagnosis.discrepancy.score_test import Probes
from seatruth.diagnosis.experiment_design.candidates import MOST, Manoeuvre, Menu
from seatruth.diagnosis.experiment_design.discrimination import Rivals, Table
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.posterior import UNKNOWN

Say = Callable[[str], None]
_ENOUGH = 8.0
"""Factor beyond which more is not told: what it rests on is not known that well."""
_TWICE = 2.0
"""Factor from which a trial is worth its while."""
_UNSURE = 0.5
"""Deviation of a foretold factor's logarithm: sizes are fitted, and models bend."""
_UNSURER = 1.0
"""The same for a cause without a name: its formula is fitted to where the trials were, not where a further one is."""
_LONGER = 0.03
"""Chance of that factor which one manoeuvre more must bring."""
_ELSEWHERE = 0.01
"""The same of another course or speed to begin with."""
_KEPT = 3
"""Sequences that are carried on."""


def next_trial(
    search: Search, chances: Mapping[str, float], say: Say, unnamed: Probes | None = None
) -> dict[str, Any] | None:
    """The trial that tells the survivors best apart, and how others compare; None with fewer than two survivors.

    `chances` are the survivors' probabilities; with that of "unknown", `unnamed` says what is missing in the equations.
    """
    rivals = Rivals(search, chances, unnamed)
    if not rivals.before:
        return None
    menu = Menu(search.problem)
    rows: list[dict[str, Any]] = []

    def tried(names: Sequence[str], start: str) -> None:
        option = menu.trial(names, start)
        say(f"Next trial: {option.name}")
        try:
            after = rivals.after(option.trial)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError):
            return
        if after is not None:
            rows.append({"start": start, "phases": tuple(names), **_row(option, after, rivals)})

    kept: list[tuple[str, tuple[str, ...]]] = [(start, ()) for start in menu.starts()]
    for many in range(1, MOST + 1):
        for start, begun in kept:
            for name in menu.phases:
                tried((*begun, name), start)
        longest = sorted((row for row in rows if len(row["phases"]) == many), key=_worth)
        best_of = {row["phases"]: row for row in longest}
        leading = sorted(best_of.values(), key=_worth)[-_KEPT:]
        kept = [(row["start"], row["phases"]) for row in leading]
    if not rows:
        return None
    # A longer trial must be worth it.
    rows.sort(key=_worth, reverse=True)
    best = menu.named(rows[0]["manoeuvre"])
    before = _smallest(rivals.before)
    return {
        **{key: rows[0][key] for key in ("manoeuvre", "text")},
        "survivors": list(rivals.chances),
        "lambda_now": min(before.values()),
        "lambda_then": rows[0]["lambda"],
        **{key: rows[0][key] for key in ("gain", "gains")},
        "pairs_now": [{"pair": list(pair), "lambda": value} for pair, value in before.items()],
        "menu": [{key: row[key] for key in ("manoeuvre", "text", "lambda", "gain", "weakest")} for row in rows],
        "t": best.trial.t.tolist(),
        "inputs": {name: np.asarray(v).tolist() for name, v in best.trial.inputs.items()},
    }


def _row(option: Manoeuvre, after: Table, rivals: Rivals) -> dict[str, Any]:
    pairs = _smallest(after)
    pair = min(pairs, key=lambda key: pairs[key])
    gains = rivals.gains(after)
    return {
        "manoeuvre": option.name,
        "text": option.text,
        "lambda": pairs[pair],
        "weakest": list(pair),
        "gain": math.exp(rivals.mean({name: math.log(min(gain, _ENOUGH)) for name, gain in gains.items()})),
        "score": rivals.mean({name: _chance(gain, name) for name, gain in gains.items()}),
        "gains": gains,
    }


def _worth(row: Mapping[str, Any]) -> float:
    """What a trial is worth, less what it costs."""
    return float(row["score"]) - _LONGER * len(row["phases"]) - (_ELSEWHERE if row["start"] else 0.0)


def _chance(gain: float, name: str) -> float:
    """Chance that a trial which is foretold this factor brings twice."""
    unsure = _UNSURER if name == UNKNOWN else _UNSURE
    return 0.5 * math.erfc((math.log(_TWICE) - math.log(max(gain, 1e-9))) / (math.sqrt(2.0) * unsure))


def _smallest(table: Table) -> Table:
    """The smaller of both directions, by pair in alphabetical order; of what is no rival there is one only."""
    found: Table = {}
    for (s, r), value in table.items():
        pair = (min(s, r), max(s, r))
        found[pair] = min(value, found.get(pair, math.inf))
    return found
