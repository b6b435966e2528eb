"""Which formula predicts better, how sure that is, and whether prediction intervals hold: fits to many tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed
from liu_planing_system import study_of, turns
from numpy.typing import NDArray

from seatruth import Study
from seatruth.costs import cost_of
from seatruth.costs.formula import FormulaCost
from seatruth.optimizers import minimise
from seatruth.trials import Trial, Trials
from seatruth.uncertainty import ModelComparison, compare_models, held_out_errors, prediction_intervals, repeated_folds

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
NAMES = ("M1", "M2")
PARTS = 10
CLOSE = 0.1
"""[P] "within 10 per cent" of the measured diameter."""


def fit(study: Study) -> tuple[FormulaCost, Array]:
    """The least-squares fit of a formula."""
    cost = cost_of(study, threads=1)
    assert isinstance(cost, FormulaCost)
    return cost, minimise(cost, "least_squares", seed=0).x


def conditions(table: pd.DataFrame, columns: Sequence[str]) -> list[Rows]:
    """Rows with the same draft, or the same draft and voltage."""
    groups = table.groupby(list(columns), sort=False).indices
    return [np.sort(np.asarray(rows, dtype=np.intp)) for rows in groups.values()]


def left_out(name: str, table: pd.DataFrame, parts: Sequence[Rows]) -> Array:
    """Errors of a formula on rows left out, each fit beginning where the fit to all rows ended."""
    study = study_of(name, table)
    cost, x = fit(study)
    return held_out_errors(study, parts, dict(zip(cost.names, x.tolist())))


def squared(errors: Array, parts: Sequence[Rows]) -> Array:
    """Mean squared error of each part."""
    return np.array([float(np.mean(errors[rows] ** 2)) for rows in parts])


def by_folds(table: pd.DataFrame, repeats: int, seed: int, workers: int) -> dict[str, Any]:
    """Both formulas on the same repeated folds: errors by name (repeats, n), and the preference for M2."""
    cut = repeated_folds(len(table), PARTS, repeats, np.random.default_rng(seed))
    jobs = [(name, parts) for name in NAMES for parts in cut]
    found = Parallel(n_jobs=workers)(delayed(left_out)(name, table, parts) for name, parts in jobs)
    errors = {name: np.array(found[k * repeats : (k + 1) * repeats]) for k, name in enumerate(NAMES)}
    scores = {name: np.concatenate([squared(e, parts) for e, parts in zip(errors[name], cut)]) for name in NAMES}
    return {"errors": errors, "preference": vars(compare_models(scores["M2"], scores["M1"], 1 / (PARTS - 1)))}


def by_condition(table: pd.DataFrame, columns: Sequence[str]) -> dict[str, Any]:
    """Both formulas with each condition left out in turn: errors by name (n,), and the preference for M2."""
    parts = conditions(table, columns)
    errors = {name: left_out(name, table, parts) for name in NAMES}
    found: ModelComparison = compare_models(squared(errors["M2"], parts), squared(errors["M1"], parts))
    return {"errors": errors, "preference": vars(found), "parts": [rows.tolist() for rows in parts]}


def one_table(seed: int, truth: str) -> dict[str, Any]:
    """What cross-validation says on one table that comes from a known formula."""
    table = turns(seed, truth)
    row: dict[str, Any] = {"truth": truth, "seed": seed}
    ways = {"folds": by_folds(table, 1, seed, 1), "conditions": by_condition(table, ("draft", "voltage"))}
    for way, found in ways.items():
        said = found["preference"]
        row |= {f"{way}: M2 less M1": said["difference"], f"{way}: p": said["p"]}
    return row


def power(seeds: Sequence[int], workers: int) -> list[dict[str, Any]]:
    """`one_table` for tables of both truths."""
    return list(Parallel(n_jobs=workers)(delayed(one_table)(seed, truth) for truth in NAMES for seed in seeds))


def coverage_of(name: str, seed: int) -> list[dict[str, Any]]:
    """Whether 95 % prediction intervals hold new measurements, at drafts that were fitted and at drafts left out."""
    table, new = turns(seed), turns(seed + 100_000)
    study = study_of(name, table)
    cost, x = fit(study)
    rows = [
        {"formula": name, "seed": seed, "draft": draft, "fitted": True, "inside": inside}
        for draft, inside in zip(table["draft"], _inside(cost, x, study_of(name, new).trials[0]))
    ]
    for part in conditions(table, ("draft",)):
        kept = np.setdiff1d(np.arange(len(table)), part)
        without = study.replace(trials=Trials([study.trials[0].samples(kept)]))
        cost, x = fit(without)
        inside = _inside(cost, x, study.trials[0].samples(part))
        rows += [
            {"formula": name, "seed": seed, "draft": draft, "fitted": False, "inside": hit}
            for draft, hit in zip(table["draft"].iloc[part], inside)
        ]
    return rows


def coverage(seeds: Sequence[int], workers: int) -> list[dict[str, Any]]:
    """Coverage counted: rows (formula, draft, fitted, inside, n)."""
    found = Parallel(n_jobs=workers)(delayed(coverage_of)(name, seed) for name in NAMES for seed in seeds)
    frame = pd.DataFrame([row for rows in found for row in rows])
    counted = frame.groupby(["formula", "draft", "fitted"])["inside"].agg(["sum", "count"]).reset_index()
    return [{str(key): value for key, value in row.items()} for row in counted.to_dict("records")]


def _inside(cost: FormulaCost, x: Array, trial: Trial) -> list[bool]:
    (found,) = prediction_intervals(cost, x, [trial])
    return [bool(hit) for hit in np.abs(trial.outputs["diameter"] - found.value) <= found.half_width]
