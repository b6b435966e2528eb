"""Sections of a comparison's report that show what its runs give: accuracy, ranks, the way to the best fit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pandas as pd

from seatruth.comparison.noise import KINDS
from seatruth.comparison.ranks import SCORES, Ranking
from seatruth.comparison.text import condition_label
from seatruth.report.blocks import Block, Column, Heading, Pictures, Section, Text, table
from seatruth.report.figures import comparison as figures
from seatruth.report.numbers import count, listed, number, percent, seconds
from seatruth.report.sections.pictures import Album

if TYPE_CHECKING:
    from seatruth.comparison.results import Results

_MOST_ROWS = 300


def accuracy(results: Results, album: Album) -> Section | None:
    """The central figure, and each problem's parameters."""
    if not len(results.runs):
        return None
    blocks: list[Block] = [
        Text(
            "Error against noise with the largest budget of each problem: the median over the parameters of their root "
            "mean square errors, in per cent of the truth (of the prediction of trials held out, in per cent of the "
            "range, where the truth is not known). The dotted line is the Cramer-Rao bound, which no unbiased method "
            "can beat: it is that of white noise of this size, on whatever was recorded. (Bounds of the search "
            "and priors are knowledge too: with them an error may lie below.) A hollow marker stands where fewer than "
            "half of the searches converged: that error says nothing of the data."
        )
    ]
    levels = results.runs.groupby("noise", sort=False)["level"].nunique()
    for noise in (str(name) for name, many in levels.items() if many > 1 or len(levels) == 1):
        picture = album.picture(
            figures.accuracy(results, noise), f"Error of each solver against the level of {noise} noise."
        )
        blocks += [Heading(f"{noise} noise", _kind_note(noise)), Pictures([picture], wide=True)]
    shared = results.runs.groupby("level")["noise"].nunique()
    for level in (float(found) for found in shared.index[shared > 1]):
        alt = f"Error of each solver under the kinds of noise of {100 * level:g} %."
        note = "filled: the first kind of cost" if results.runs["cost"].nunique() > 1 else ""
        blocks += [Heading(f"Kinds of noise at {100 * level:g} %", note)]
        blocks.append(Pictures([album.picture(figures.kinds(results, level), alt)], wide=True))
    first = str(results.runs["noise"].iloc[0])
    for problem in results.comparison.problems:
        if problem.truth is None or not (results.accuracy["problem"] == problem.name).any():
            continue
        picture = album.picture(
            figures.by_parameter(results, problem.name, first), f"Error of each parameter of {problem.name}."
        )
        blocks += [Heading(f"{problem.name}, parameter by parameter", f"{first} noise"), Pictures([picture], wide=True)]
    return Section("accuracy", "Accuracy against noise", blocks)


def _kind_note(label: str) -> str:
    kind = KINDS.get(label.split(" ")[0])
    return kind.title if kind else ""


def estimation(results: Results, album: Album) -> Section | None:
    """Tables of estimation: overall, and by parameter."""
    if not len(results.overall):
        return None
    rows = [
        [
            str(r["problem"]),
            str(r["cost"]),
            str(r["solver"]),
            condition_label(str(r["noise"]), float(r["level"])),
            str(r["budget"]),
            number(r["error_percent"], 3),
            number(r["efficiency"], 3),
            percent(r["coverage"], 3),
            percent(r["held_out"], 3),
            number(_floored(r["excess"]), 3),
            f"{r['failed']} of {r['runs']}" if r["failed"] else "",
        ]
        for r in results.overall.to_dict("records")
    ]
    columns = [
        Column("problem"),
        Column("cost"),
        Column("solver"),
        Column("noise"),
        Column("budget", "number", "evaluations"),
        Column("error, %", "number", "median over the parameters of their rms errors, in per cent of the truth"),
        Column("RMSE / √CRLB", "number", "median over the parameters; 1 is the best that is possible without bias"),
        Column("coverage", "number", "of the 95 % intervals"),
        Column("held out", "number", "error of prediction, of the range"),
        Column("excess", "number", "median excess over the best known fit, chi-square units"),
        Column("failed"),
    ]
    blocks: list[Block] = [table("Estimation, all parameters together", columns, rows, folded=len(rows) > 40)]
    rows = [
        [
            str(r["problem"]),
            str(r["cost"]),
            str(r["solver"]),
            condition_label(str(r["noise"]), float(r["level"])),
            str(r["budget"]),
            str(r["parameter"]),
            number(r["truth"], 4),
            number(r["bias"], 2),
            number(r["bias_se"], 2),
            number(r["rmse"], 3),
            number(r["crlb"], 3),
            number(r["efficiency"], 3),
            percent(r["coverage"], 3),
        ]
        for r in _largest(results, results.accuracy).to_dict("records")
        if math.isfinite(r["truth"])
    ]
    columns = [*columns[:5], Column("parameter"), Column("truth", "number"), Column("bias", "number")]
    columns += [Column("its std. error", "number"), Column("RMSE", "number"), Column("√CRLB", "number")]
    columns += [Column("RMSE / √CRLB", "number"), Column("coverage", "number")]
    if len(rows) > _MOST_ROWS:
        blocks.append(
            Text(f"The {len(rows)} rows of the parameters are in tables/accuracy.csv; the first {_MOST_ROWS} are here.")
        )
    if rows:
        blocks.append(table("Estimation, parameter by parameter", columns, rows[:_MOST_ROWS], folded=True))
    return Section("estimation", "Estimation", blocks)


def ranks(results: Results, album: Album) -> Section | None:
    blocks: list[Block] = []
    for cost in dict.fromkeys(results.runs["cost"]):
        for by, what in SCORES.items():
            made = results.ranking(by, cost=cost)
            if made is not None:
                blocks += _ranking(made, f"By {what}", f"{cost} cost", album)
    if results.runs["cost"].nunique() > 1:
        made = results.ranking_across_costs()
        if made is not None:
            blocks += _ranking(made, f"By {SCORES['accuracy']}", "solvers on each cost as rivals", album)
    if not blocks:
        return None
    note = (
        "Mean ranks over the blocks named (1 is best). A bar joins solvers that Wilcoxon's signed-rank tests, with "
        "Holm's correction, do not tell apart (5 %). Scores within about 1 % are ties; a failed run ranks last. The "
        "tables add probabilities of the Bayesian signed-rank test (Benavoli and others 2017): that the first solver "
        f"is better, alike or worse in practice, where a ratio within {results.comparison.rope:g} is alike."
    )
    return Section("ranks", "Ranks", [Text(note), *blocks])


def _ranking(made: Ranking, title: str, note: str, album: Album) -> list[Block]:
    caption = f"{count(made.blocks, made.block_kind)}; Friedman: p = {number(made.p_friedman, 2)}."
    if made.incomplete:
        caption += f" Not in it, as they fit only some of the problems: {listed(list(made.incomplete))}."
    order = ", ".join(f"{name} {rank:.2f}" for name, rank in zip(made.order, made.table["mean_rank"]))
    picture = album.picture(figures.ranks(made), f"Mean ranks: {order}.", caption)
    columns = [Column("pair"), Column("wins", "number"), Column("losses", "number"), Column("ties", "number")]
    columns += [Column("ratio", "number", "median ratio of the scores, first over second")]
    columns += [Column("effect", "number", "matched rank-biserial correlation; below 0 the first is better")]
    columns += [Column("p", "number", "Wilcoxon"), Column("p (Holm)", "number")]
    columns += [Column("better", "number", "probability that the first is better in practice: Bayesian signed ranks")]
    columns += [Column("alike", "number", "probability that they are alike in practice"), Column("worse", "number")]
    rows = [
        [
            f"{r['first']} – {r['second']}",
            str(r["wins"]),
            str(r["losses"]),
            str(r["ties"]),
            number(r["ratio"], 2) if 1e-9 < r["ratio"] < 1e9 else "never" if r["ratio"] else "",
            number(r["effect"], 2),
            number(r["p"], 2),
            number(r["p_holm"], 2),
            *(f"{r[name]:.2f}" for name in ("p_better", "p_alike", "p_worse")),
        ]
        for r in made.pairs.to_dict("records")
    ]
    return [
        Heading(title, note),
        Pictures([picture]),
        table(f"Pairs ({title.lower()}, {note})", columns, rows, folded=True),
    ]


def reaching(results: Results, album: Album) -> Section | None:
    """Success, expected running time, distributions, profiles."""
    if not len(results.success):
        return None
    dense = results.comparison.dense_targets
    text = (
        "Nearness is the excess over the best known fit of the same realisation, in units of chi-square (twice the "
        f"cost): {results.comparison.success:g} is one standard error. Left: share of the targets "
        f"({len(dense)} from an excess of {max(dense):g} to {min(dense):g}) reached. Right: Dolan and More's profiles: "
        "share of realisations solved within a factor of the fastest solver's evaluations."
    )
    blocks: list[Block] = [Text(text)]
    for cost in dict.fromkeys(results.runs["cost"]):
        both = [
            album.picture(figures.reached(results, str(cost), what), f"{alt}, {cost} cost.")
            for what, alt in (("ecdf", "Distribution of evaluations to targets"), ("profiles", "Performance profiles"))
        ]
        blocks += [Heading(f"{cost} cost"), Pictures(both)]
    chosen = results.success[results.success["target"] == results.comparison.success]
    rows = [
        [
            str(r["problem"]),
            str(r["cost"]),
            str(r["solver"]),
            condition_label(str(r["noise"]), float(r["level"])),
            str(r["budget"]),
            percent(r["success_rate"], 3) or "0 %",
            number(r["ert"], 3),
            seconds(r["ert_s"]) if math.isfinite(r["ert_s"]) else number(r["ert_s"]),
        ]
        for r in chosen.to_dict("records")
    ]
    columns = [Column("problem"), Column("cost"), Column("solver"), Column("noise"), Column("budget", "number")]
    columns += [Column("success", "number"), Column("evaluations a success", "number", "expected running time")]
    columns += [Column("time a success", "number")]
    caption = f"Success (excess at most {results.comparison.success:g}) and expected running time"
    blocks.append(table(caption, columns, rows, folded=len(rows) > 40))
    return Section("reaching", "Reaching the best fit", blocks)


def against_time(results: Results, album: Album) -> Section | None:
    if not len(results.wall_time):
        return None
    picture = album.picture(figures.against_time(results), "Median excess over the best known fit against search time.")
    text = (
        "Median over all realisations of the excess of the best so far, against the time of the search alone (scoring, "
        "loading and compiling are not in it), on one core a run. Dashed: the headline target."
    )
    return Section("time", "Cost against time", [Text(text), Pictures([picture], wide=True)])


def _largest(results: Results, frame: pd.DataFrame) -> pd.DataFrame:
    if not len(frame):
        return frame
    largest = {p.name: max(results.comparison.budgets_of(p)) for p in results.comparison.problems}
    return frame[frame["budget"] == frame["problem"].map(largest)]


def _floored(value: float) -> float:
    return 0.0 if value < 1e-4 else value
