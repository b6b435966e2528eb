"""The section of a comparison's report on what solvers reach with which budget."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from seatruth.comparison.text import condition_label
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Text, table
from seatruth.report.figures import comparison_anytime as figures
from seatruth.report.numbers import number, percent
from seatruth.report.sections.pictures import Album

if TYPE_CHECKING:
    from seatruth.comparison.results import Results


def anytime(results: Results, album: Album) -> Section | None:
    """Targets over evaluations, expected running time, and accuracy at each budget."""
    if not len(results.runs):
        return None
    blocks: list[Block] = [
        Text(
            f"A run has converged where its excess over the best known fit is at most {results.comparison.success:g} "
            "chi-square. Its error is then the error that the data leave; before, it is the search's own, and says "
            "nothing of the data."
        )
    ]
    for cost in (str(cost) for cost in dict.fromkeys(results.runs["cost"])):
        alts = ("Expected running time of each solver on each problem.", "Share of targets reached, by problem.")
        captions = (
            "Evaluations of all runs over the number of successes; the share of runs that succeed. Hollow: none did.",
            f"Over {len(results.comparison.dense_targets)} targets, from an excess of "
            f"{max(results.comparison.dense_targets):g} to {min(results.comparison.dense_targets):g}.",
        )
        drawn = (figures.expected(results, cost), figures.reached_by_problem(results, cost))
        pictures = [album.picture(*parts) for parts in zip(drawn, alts, captions)]
        blocks += [Heading(f"{cost} cost"), *(Pictures([picture], wide=True) for picture in pictures)]
    blocks += _over_budgets(results, album)
    rows = _stood(results)
    if rows:
        columns = [Column("problem"), Column("cost"), Column("solver"), Column("noise")]
        columns += [Column("converged", "number", "share of the runs"), Column("error, %", "number")]
        columns += [Column("the data leave, %", "number", "error of the best known fits")]
        columns += [Column("the error is")]
        blocks.append(table("Is it the search or the data?", columns, rows, folded=len(rows) > 40))
    return Section("anytime", "At any budget", blocks)


def _over_budgets(results: Results, album: Album) -> list[Block]:
    blocks: list[Block] = []
    noise = str(results.runs["noise"].iloc[0])
    for problem in results.comparison.problems:
        if problem.truth is None or len(results.comparison.budgets_of(problem)) < 2:
            continue
        alt = f"Error of each solver on {problem.name} against noise, one panel a budget."
        caption = (
            "Dotted: the Cramer-Rao bound. Dashed: error of the best known fits. Hollow: fewer than half of the runs "
            "have converged."
        )
        picture = album.picture(figures.accuracy_over_budgets(results, noise, problem.name), alt, caption)
        blocks += [Heading(problem.name, f"{noise} noise"), Pictures([picture], wide=True)]
    return blocks


_MOSTLY = 0.9
"""Share of runs that must converge for the error to be called the data's. Chosen here [S]."""


def _whose(converged: float) -> str:
    """Whose error it is where this share of the runs converged."""
    if converged >= _MOSTLY:
        return "the data's"
    return "the search's" if converged <= 1 - _MOSTLY else "the search's and the data's"


def _stood(results: Results) -> list[list[str]]:
    """By condition and solver, with the largest budget: whether the search or the data make the error."""
    overall = results.overall
    largest = {p.name: max(results.comparison.budgets_of(p)) for p in results.comparison.problems}
    overall = overall[overall["budget"] == overall["problem"].map(largest)].dropna(subset=["error_percent"])
    return [
        [
            str(r["problem"]),
            str(r["cost"]),
            str(r["solver"]),
            condition_label(str(r["noise"]), float(r["level"])),
            percent(r["converged"], 3) or "0 %",
            number(r["error_percent"], 3),
            number(r["left_percent"], 3) if math.isfinite(r["left_percent"]) else "",
            _whose(r["converged"]),
        ]
        for r in overall.to_dict("records")
    ]
