"""The results of a comparison: its runs as tables, and every measure made from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from seatruth.comparison import estimation, optimisation, ranks
from seatruth.comparison.optimisation import CONDITION
from seatruth.comparison.spec import Comparison
from seatruth.comparison.text import Conclusion, conclusions
from seatruth.storage.parsing import parsed

if TYPE_CHECKING:
    from seatruth.comparison.store import Store


@dataclass(frozen=True, eq=False)
class Results:
    """All runs of a comparison that are in its store.

    Attributes:
        comparison: What was compared.
        runs: One row a search (problem, cost, solver, noise, level, seed, budget, status, value, evaluations, ...) with
            `excess`, twice the cost above the best known fit of its realisation.
        estimates: One row a run and parameter, with truth and Cramer-Rao bound.
        fits: One row an instance: the fit that its runs are measured against.
        best_fits: The parameters of the best known fit of each instance, by any run or the reference, with truth and
            bound: their error is what the data leave to a search that has converged.
        histories: By run three arrays: evaluations, best values, seconds.
        sources: Versions, commit and machine of each program that made runs.
        left: Runs that are not done yet.
    """

    comparison: Comparison
    runs: pd.DataFrame
    estimates: pd.DataFrame
    fits: pd.DataFrame
    best_fits: pd.DataFrame
    histories: Mapping[str, tuple[Any, Any, Any]]
    sources: tuple[Mapping[str, Any], ...]
    left: int

    @classmethod
    def of(cls, comparison: Comparison, store: Store) -> Results:
        """The runs of this comparison in a store; rows of other definitions are ignored."""
        labels = {run.key: run for run in comparison.runs}
        references = {run.key: run for run in comparison.references}
        runs, fits = store.frame("runs"), store.frame("fits")
        runs, fits = runs[runs["key"].isin(labels)], fits[fits["key"].isin(references)]
        runs = runs.assign(
            solver=[labels[key].solver for key in runs["key"]], noise=[labels[key].noise.label for key in runs["key"]]
        )
        fits = fits.assign(noise=[references[key].noise.label for key in fits["key"]])
        histories = {key: _history(stored) for key, stored in zip(runs["key"], runs["history"])}
        best = _best(runs, fits)
        value = pd.to_numeric(runs["value"], errors="coerce")
        runs = runs.assign(best=runs["instance"].map(best).astype(float), value=value)
        excess = 2.0 * (runs["value"] - runs["best"])
        runs["excess"] = excess.where(np.isfinite(excess), math.inf).clip(lower=0.0)
        runs["dimension"] = runs["instance"].map(fits.set_index("instance")["dimension"].to_dict())
        order = {run.key: k for k, run in enumerate(comparison.runs)}
        runs = runs.drop(columns="history").sort_values("key", key=lambda keys: keys.map(order), ignore_index=True)
        estimates = _with_truth(store, runs, fits)
        used = set(runs["source"]) | set(fits["source"])
        sources = store.frame("sources")
        used_sources = [parsed(stored) for stored in sources.loc[sources["id"].isin(used), "provenance"]]
        left = len(comparison.runs) - len(runs)
        best_fits = _best_fits(store, runs, estimates, fits)
        fits = fits.reset_index(drop=True)
        return cls(comparison, runs, estimates, fits, best_fits, histories, tuple(used_sources), left)

    @cached_property
    def final(self) -> pd.DataFrame:
        """Runs of each problem's largest budget."""
        return self.runs[self.runs["budget"] == self.runs["problem"].map(self._largest)].reset_index(drop=True)

    @cached_property
    def _largest(self) -> dict[str, int]:
        return {p.name: max(self.comparison.budgets_of(p)) for p in self.comparison.problems}

    @property
    def targets(self) -> tuple[float, ...]:
        return tuple(self.comparison.targets)

    @property
    def solvers(self) -> list[str]:
        """Labels of the solvers, in the comparison's order."""
        return [label for label in self.comparison.solver if (self.runs["solver"] == label).any()]

    @property
    def failures(self) -> pd.DataFrame:
        """Runs that failed, with their reasons."""
        failed = self.runs[self.runs["status"] == "failed"]
        return failed[["problem", "cost", "solver", "noise", "level", "seed", "budget", "error"]].reset_index(drop=True)

    @cached_property
    def success(self) -> pd.DataFrame:
        """Success rate and expected running time by condition, solver, budget and target."""
        return optimisation.success(self.runs, self.histories, self.targets)

    @cached_property
    def ecdf(self) -> pd.DataFrame:
        """Share of (realisation, target) pairs reached, by solver, against evaluations per dimension."""
        return optimisation.ecdf(self.final, self.histories, self.comparison.dense_targets)

    @cached_property
    def ecdf_by_problem(self) -> dict[str, pd.DataFrame]:
        """The same for each problem."""
        parts = self.final.groupby("problem", sort=False)
        targets = self.comparison.dense_targets
        return {str(name): optimisation.ecdf(part, self.histories, targets) for name, part in parts}

    @cached_property
    def expected(self) -> pd.DataFrame:
        """Success rate and running time by problem, cost and solver over all noise, with the largest budget."""
        return optimisation.success(self.final, self.histories, (self.comparison.success,), ["problem", "cost"])

    @cached_property
    def profiles(self) -> pd.DataFrame:
        """Dolan-More performance profiles: share of realisations within a factor of the fastest, by solver."""
        return optimisation.profiles(self.final, self.histories, self.comparison.success)

    @cached_property
    def wall_time(self) -> pd.DataFrame:
        """Median excess against search time, by problem, cost and solver."""
        return optimisation.against_time(self.final, self.histories)

    @cached_property
    def accuracy(self) -> pd.DataFrame:
        """Bias, error, bound and coverage by condition, solver, budget and parameter."""
        return estimation.by_parameter(self.runs, self.estimates)

    @cached_property
    def overall(self) -> pd.DataFrame:
        """The same over all parameters, with the error of prediction of the trials held out."""
        return estimation.overall(self.runs, self.accuracy, self.best_fits, self.comparison.success)

    @cached_property
    def scores(self) -> pd.DataFrame:
        """What solvers are ranked by, one row a run of the largest budgets: fit, effort, accuracy (small is good)."""
        return ranks.scores(self.final, self.estimates, self.histories, self.comparison.success)

    def ranking(self, by: str = "accuracy", **where: Any) -> ranks.Ranking | None:
        """Solvers ranked by "fit", "effort" or "accuracy" over all conditions, or those with given values:
        cost="trajectory", level=0.01.

        None where fewer than two solvers ran on the same realisations.
        """
        key = (by, tuple(sorted(where.items())))
        if key not in self._rankings:
            self._rankings[key] = ranks.rank_solvers(self.scores, by, where, self.solvers, self.comparison.rope)
        return self._rankings[key]

    @cached_property
    def _rankings(self) -> dict[Any, ranks.Ranking | None]:
        return {}

    def ranking_across_costs(self) -> ranks.Ranking | None:
        """Ranking by accuracy with each solver on each cost as a rival of all others: what estimates best."""
        frame = ranks.across_costs(self.scores)
        return ranks.rank_solvers(frame, "accuracy", {}, list(dict.fromkeys(frame["solver"])), self.comparison.rope)

    @cached_property
    def conclusions(self) -> list[Conclusion]:
        """The results in sentences, the most important first."""
        return conclusions(self)

    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables by name."""
        tables = {
            "runs": self.runs.drop(columns=["source"]),
            "success": self.success,
            "accuracy": self.accuracy,
            "overall": self.overall,
            "expected": self.expected,
            "ecdf": self.ecdf,
            "profiles": self.profiles,
            "failures": self.failures,
        }
        for by in ranks.SCORES:
            for cost in dict.fromkeys(self.runs["cost"]):
                ranking = self.ranking(by, cost=cost)
                if ranking is not None:
                    tables[f"ranking by {by}, {cost}"] = ranking.table
                    tables[f"tests by {by}, {cost}"] = ranking.pairs
        return {name: frame for name, frame in tables.items() if len(frame)}

    def _repr_html_(self) -> str:
        import html

        items = "".join(f"<li>{html.escape(conclusion.text)}</li>" for conclusion in self.conclusions)
        head = f"<b>{html.escape(self.comparison.name)}</b>: {len(self.runs)} runs, {self.left} left"
        return f"<p>{head}</p><ul>{items}</ul>"


def _history(stored: str) -> tuple[Any, Any, Any]:
    """Evaluations, best values and seconds as arrays."""
    columns = parsed(stored) if stored else []
    lists = columns if len(columns) == 3 else [[], [], []]
    return np.array(lists[0], dtype=float), np.array(lists[1], dtype=float), np.array(lists[2], dtype=float)


def _best(runs: pd.DataFrame, fits: pd.DataFrame) -> dict[str, float]:
    """The lowest known cost of each instance."""
    both = pd.concat([runs[["instance", "value"]], fits[["instance", "value"]]])
    both = both.assign(value=pd.to_numeric(both["value"], errors="coerce"))
    return {str(k): float(v) for k, v in both.groupby("instance")["value"].min().items()}


def _with_truth(store: Store, runs: pd.DataFrame, fits: pd.DataFrame) -> pd.DataFrame:
    """Estimates of these runs with condition, truth and bound."""
    estimates, known = store.frame("estimates"), store.frame("fit_parameters")
    estimates = estimates[estimates["key"].isin(set(runs["key"]))]
    known = known.merge(fits[["key", "instance"]], on="key").drop(columns=["key", "value"])
    condition = runs[["key", "instance", *CONDITION, "solver", "seed", "budget"]]
    merged = condition.merge(estimates, on="key").merge(known, on=["instance", "parameter"], how="left")
    for name in ("value", "stderr", "lower", "upper", "truth", "crlb"):
        merged[name] = pd.to_numeric(merged[name], errors="coerce").astype(float)
    return merged


def _best_fits(store: Store, runs: pd.DataFrame, estimates: pd.DataFrame, fits: pd.DataFrame) -> pd.DataFrame:
    """By instance the parameters of the lowest cost that is known, the reference fit's or a run's."""
    names = ["instance", *CONDITION, "parameter", "value", "truth", "crlb"]
    if not len(fits):
        return pd.DataFrame(columns=names)
    reference = store.frame("fit_parameters").merge(fits[["key", "instance", *CONDITION]], on="key")
    for name in ("value", "truth", "crlb"):
        reference[name] = pd.to_numeric(reference[name], errors="coerce").astype(float)
    of_fits = dict(zip(fits["instance"], pd.to_numeric(fits["value"], errors="coerce").fillna(math.inf)))
    done = runs[(runs["status"] == "done") & np.isfinite(runs["value"])]
    lowest = done.loc[done.groupby("instance")["value"].idxmin()] if len(done) else done
    lower = lowest[lowest["value"] < lowest["instance"].map(of_fits)]
    kept = reference[~reference["instance"].isin(set(lower["instance"]))]
    return pd.concat([kept[names], estimates[estimates["key"].isin(set(lower["key"]))][names]], ignore_index=True)
