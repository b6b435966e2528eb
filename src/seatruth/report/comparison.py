"""The report of a comparison: one HTML page that stands alone, and its tables as CSV and LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from seatruth.comparison.text import condition_label
from seatruth.report.blocks import Block, Column, Heading, Notes, Section, Text, table
from seatruth.report.numbers import listed
from seatruth.report.page import page
from seatruth.report.sections import comparison as sections
from seatruth.report.sections.anytime import anytime
from seatruth.report.sections.pictures import Album
from seatruth.report.sections.run import provenance_rows
from seatruth.storage.atomic import write_file

if TYPE_CHECKING:
    from seatruth.comparison.results import Results

_MOST_FAILURES = 30


def write_comparison_report(results: Results, path: str | Path) -> None:
    """Writes the report of a comparison as one HTML file; whole or not at all."""
    write_file(path, render_comparison(results))


def write_tables(results: Results, folder: str | Path) -> list[Path]:
    """Writes all tables as CSV (full precision) and, but for the long ones, as LaTeX; returns the files."""
    where = Path(folder)
    written = []
    for name, frame in results.tables().items():
        safe = "".join(c if c.isalnum() else "_" for c in name)
        written.append(where / f"{safe}.csv")
        write_file(written[-1], frame.to_csv(index=False, lineterminator="\n"))
        if name in ("overall", "accuracy", "success") or name.startswith(("ranking", "tests")):
            written.append(where / f"{safe}.tex")
            write_file(written[-1], _latex(frame))
    return written


def render_comparison(results: Results) -> str:
    """The report as HTML text."""
    album = Album()
    found = [
        section
        for build in (
            _summary,
            sections.accuracy,
            anytime,
            sections.estimation,
            sections.ranks,
            sections.reaching,
            sections.against_time,
            _failures,
            _setting,
            _provenance,
        )
        if (section := build(results, album)) is not None
    ]
    return page("Comparison", results.comparison.name, _facts(results), found, synthetic=_synthetic(results))


def _synthetic(results: Results) -> str:
    problems = results.comparison.problems
    made = [problem.name for problem in problems if problem.synthetic]
    if not made:
        return (
            "" if not any(noise.level for noise in results.comparison.noise) else "Noise was added to recorded trials."
        )
    if len(made) == len(problems):
        return "All trials were simulated, with noise added. Nothing here was measured at sea."
    rest = [problem.name for problem in problems if not problem.synthetic]
    return (
        f"The trials of {listed(made, 20)} were simulated; those of {listed(rest, 20)} were recorded. Noise was added."
    )


def _facts(results: Results) -> list[tuple[str, str]]:
    comparison = results.comparison
    noise = list(dict.fromkeys(condition_label(n.label, n.level) for n in comparison.noise))
    facts = [
        ("Problems", str(len(comparison.problems))),
        ("Solvers", str(len(comparison.solver))),
        ("Noise", listed(noise, 6)),
        ("Realisations of each", str(comparison.seeds)),
        ("Runs", f"{len(results.runs)}" + (f", {results.left} to go" if results.left else "")),
        ("Failed", str(len(results.failures)) if len(results.failures) else ""),
    ]
    return [(name, value) for name, value in facts if value]


def _summary(results: Results, album: Album) -> Section:
    blocks: list[Block] = [Text(results.comparison.description)] if results.comparison.description else []
    titles = {"optimisation": "Optimisation: finding the best fit", "estimation": "Estimation: finding the truth"}
    for about, title in (*titles.items(), ("caution", "Limits of this comparison")):
        said = [(said.text, "", said.grave) for said in results.conclusions if said.about == about]
        if said:
            blocks += [Heading(title), Notes(said)]
    return Section("summary", "In short", blocks)


def _failures(results: Results, album: Album) -> Section | None:
    found = results.failures
    if not len(found):
        return None
    groups = found.groupby(["problem", "cost", "solver", "error"], sort=False).size().reset_index(name="runs")
    rows = [[str(row[name]) for name in groups.columns] for row in groups.head(_MOST_FAILURES).to_dict("records")]
    columns = [Column("problem"), Column("cost"), Column("solver"), Column("why", "long"), Column("runs", "number")]
    return Section("failures", "Runs that failed", [table(f"Failed runs ({len(found)})", columns, rows)])


def _setting(results: Results, album: Album) -> Section:
    """What was compared."""
    comparison = results.comparison
    rows = []
    for problem in comparison.problems:
        fit = problem.study
        trials = f"{len(fit.trials)}" + (f", {len(fit.holdout)} held out" if len(fit.holdout) else "")
        kind = "simulated at stated parameters" if problem.truth is not None else "recorded"
        rows.append(
            [problem.name, fit.model.name, kind, trials, str(len(fit.free)), listed(list(comparison.costs_of(problem)))]
        )
        rows[-1] += [problem.start, ", ".join(str(b) for b in comparison.budgets_of(problem)), fit.content_hash[:12]]
    columns = [Column("problem"), Column("model"), Column("trials are"), Column("trials"), Column("free", "number")]
    columns += [Column("costs"), Column("start"), Column("evaluations"), Column("study hash")]
    blocks: list[Block] = [table("Problems", columns, rows)]
    options = [[label, _options(solver.describe())] for label, solver in comparison.solver.items()]
    blocks.append(table("Solvers", [Column("solver"), Column("options", "long")], options))
    unfit = [
        [problem.name, cost, listed([s for s in comparison.solver if s not in fitting], 20)]
        for (name, cost), fitting in comparison.fitting.items()
        for problem in comparison.problems
        if problem.name == name and len(fitting) < len(comparison.solver)
    ]
    if unfit:
        columns = [Column("problem"), Column("cost"), Column("solvers that do not fit", "long")]
        blocks.append(table("Left out: the cost does not give what they need", columns, unfit))
    return Section("setting", "What was compared", blocks)


def _options(described: dict[str, Any]) -> str:
    stages = described.get("stages") or [described]
    parts = []
    for stage in stages:
        options = ", ".join(f"{key} = {value}" for key, value in stage.get("options", {}).items())
        parts.append(f"{stage.get('name')} ({options})" if options else str(stage.get("name")))
    return "; then ".join(parts)


def _provenance(results: Results, album: Album) -> Section:
    rows: list[list[str]] = [["seed", str(results.comparison.seed)]]
    for source in results.sources:
        rows += provenance_rows(source)
    return Section(
        "provenance", "Provenance", [table("What made these runs", [Column("what"), Column("is", "long")], rows)]
    )


def _latex(frame: pd.DataFrame) -> str:
    """A table as LaTeX (booktabs), numbers to four digits."""
    shown = frame.rename(columns=lambda name: str(name).replace("_", " "))
    return str(
        shown.to_latex(index=False, escape=True, float_format=lambda value: f"{value:.4g}", longtable=len(frame) > 40)
    )


__all__: Sequence[str] = ["render_comparison", "write_comparison_report", "write_tables"]
