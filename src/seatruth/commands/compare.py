"""`seatruth compare COMPARISON.toml`: solvers on problems under noise, stored, resumed, reported."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from seatruth.commands.common import JsonFile, Result, console, note, result_folder, say, table
from seatruth.commands.progress import ProgressLine
from seatruth.errors import BadInput
from seatruth.report.numbers import count

if TYPE_CHECKING:
    from seatruth.comparison import Comparison, Results


def compare(
    comparison: Annotated[Path, typer.Argument(metavar="COMPARISON.toml", help="The comparison file.")],
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder of store and report.")] = None,
    workers: Annotated[int, typer.Option("--workers", min=0, help="Runs at once; 0 for one a processor.")] = 0,
    fresh: Annotated[bool, typer.Option("--fresh", help="Repeat all runs.")] = False,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Repeat the runs that failed.")] = False,
    ranking: Annotated[
        bool, typer.Option("--ranking", help="Only show the ranking so far, also while the comparison runs elsewhere.")
    ] = False,
    part: Annotated[
        str, typer.Option("--part", metavar="K/N", help="Only part K of N of the realisations; see --merge.")
    ] = "1/1",
    merge: Annotated[
        list[Path] | None,
        typer.Option("--merge", metavar="DIR", help="First take the runs of another folder, as of another machine."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option("--dask", metavar="ADDRESS", help="Run on the workers of this dask scheduler.")
    ] = None,
    forecast: Annotated[
        bool, typer.Option("--forecast", help="Only say how long the missing runs will take at most.")
    ] = False,
    ioh: Annotated[bool, typer.Option("--ioh", help="Also write the searches for IOHprofiler.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Compare solvers on problems under noise. The same command continues an interrupted comparison."""
    from seatruth.comparison import compare as run
    from seatruth.comparison import merge as merged
    from seatruth.comparison import standing
    from seatruth.comparison.file import read_comparison
    from seatruth.simulate import thread_count

    with ProgressLine(quiet=quiet) as line:
        made, folder = read_comparison(comparison, progress=line)
    folder = result_folder(out, folder, comparison)
    if merge:
        say(f"{merged(folder, merge)} runs and fits taken from other folders")
    if ranking:
        results = standing(made, folder)
        show(results)
        return Result(summary(results, folder))
    workers = workers or thread_count(None)
    if forecast:
        return _forecast(made, folder, workers, quiet)
    if not quiet:
        note(f"{len(made.runs)} runs: {_size(made)}")
    with _cluster(scheduler), ProgressLine(quiet=quiet) as line:
        results = run(
            made,
            folder,
            workers=workers,
            backend="dask" if scheduler else "loky",
            fresh=fresh,
            retry_failed=retry_failed,
            part=_part(part),
            progress=line,
        )
        line.show("Writing the report", now=False)
        report = write(results, folder)
    show(results)
    say(f"Store: {folder / 'comparison.sqlite'}", whole=True)
    say(f"Report: {report}", whole=True)
    if ioh:
        from seatruth.comparison.export import write_ioh

        write_ioh(results, folder / "ioh")
        say(f"IOHprofiler: {folder / 'ioh'}", whole=True)
    return Result({**summary(results, folder), "report": str(report)})


def _part(text: str) -> tuple[int, int]:
    first, _, every = text.partition("/")
    if not (first.isdigit() and every.isdigit()):
        raise BadInput(f"{text!r} is no part", where="--part", do="Write K/N, as 1/4.")
    return int(first), int(every)


def _forecast(made: Comparison, folder: Path, workers: int, quiet: bool) -> Result:
    """How long it will take, by solver."""
    from seatruth.comparison import forecast
    from seatruth.report.numbers import seconds

    with ProgressLine(quiet=quiet) as line:
        found = forecast(made, folder, progress=line)
    by_solver = found.groupby("solver", sort=False)[["searches", "seconds"]].sum()
    rows = [[str(name), f"{row['searches']:.0f}", seconds(row["seconds"])] for name, row in by_solver.iterrows()]
    console().print(table(["solver", "searches", "at most"], rows, numbers=["searches", "at most"]))
    total = float(found["seconds"].sum())
    say(f"At most {seconds(total / workers)} with {workers} worker{'' if workers == 1 else 's'}.")
    return Result({"seconds": total, "workers": workers, "by_solver": found})


def write(results: Results, folder: Path) -> Path:
    """Writes the report and the tables; returns the report's place."""
    from seatruth.report.comparison import write_comparison_report, write_tables

    path = folder / "report.html"
    write_comparison_report(results, path)
    write_tables(results, folder / "tables")
    return path


def summary(results: Results, folder: Path) -> dict[str, Any]:
    """What `--json` gives."""
    rankings = {}
    for cost in dict.fromkeys(results.runs["cost"]):
        for by in ("effort", "fit", "accuracy"):
            made = results.ranking(by, cost=cost)
            if made is not None:
                rankings[f"{by}, {cost}"] = {
                    "blocks": made.blocks,
                    "block_kind": made.block_kind,
                    "p_friedman": made.p_friedman,
                    "ranks": made.table,
                    "pairs": made.pairs,
                }
    return {
        "comparison": results.comparison.name,
        "folder": str(folder),
        "runs": len(results.runs),
        "failed": len(results.failures),
        "left": results.left,
        "conclusions": [{"about": said.about, "text": said.text} for said in results.conclusions],
        "rankings": rankings,
        "overall": results.overall,
        "success": results.success,
        "provenance": list(results.sources),
    }


def show(results: Results) -> None:
    """The rankings and what they mean, in the terminal."""
    failed = f", {len(results.failures)} failed" if len(results.failures) else ""
    say(f"{results.comparison.name}: {len(results.runs)} runs{failed}, {results.left} left\n", style="bold")
    for cost in dict.fromkeys(results.runs["cost"]):
        made = {by: results.ranking(by, cost=cost) for by in ("effort", "fit", "accuracy")}
        found = {by: ranking for by, ranking in made.items() if ranking is not None}
        if not found:
            continue
        ranks = {
            by: dict(zip(ranking.table["solver"], ranking.table["mean_rank"].astype(float)))
            for by, ranking in found.items()
        }
        rows = [
            [solver, *(f"{ranks[by][solver]:.2f}" if solver in ranks[by] else "" for by in found)]
            for solver in next(iter(found.values())).order
        ]
        say(f"Mean ranks, {cost} cost (1 is best)")
        console().print(table(["solver", *found], rows, numbers=list(found)))
        say("")
    for said in results.conclusions:
        say(f"{'! ' if said.grave else '- '}{said.text}", style="yellow" if said.grave else "")
    say("")


def _size(made: Comparison) -> str:
    parts = [count(len(made.problems), "problem"), count(len(made.solver), "solver")]
    parts += [
        count(len(made.noise), "level of noise", "levels of noise"),
        f"{count(made.seeds, 'realisation')} of each",
    ]
    return ", ".join(parts)


def _cluster(scheduler: str | None) -> Any:
    """A client of the scheduler, or nothing."""
    from contextlib import nullcontext

    if scheduler is None:
        return nullcontext()
    try:
        import distributed
    except ImportError:
        raise BadInput("dask is not installed", where="--dask", do="pip install 'seatruth[dask]'.") from None
    try:
        client: Any = distributed.Client
        return client(scheduler, timeout=10)
    except (OSError, ValueError, TimeoutError) as problem:
        raise BadInput(
            f"the scheduler does not answer ({type(problem).__name__})",
            where=f"--dask {scheduler}",
            do="Start one with `dask scheduler`, and workers with `dask worker ADDRESS`.",
        ) from None
