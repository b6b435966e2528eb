"""`seatruth identify STUDY.toml`: from a study to parameters with error bars, saved and reported."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import pandas as pd
import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, result_folder, say, table
from seatruth.commands.cost_notice import say_cost
from seatruth.commands.progress import load_study
from seatruth.commands.resumable import resumable
from seatruth.storage.atomic import CannotWrite
from seatruth.study import Study
from seatruth.study.load import profile_names

if TYPE_CHECKING:
    from seatruth.estimate import Estimate
    from seatruth.optimizers import Budget
    from seatruth.trials.finding import Finding

CHECKPOINT = "checkpoint.journal"
_MOST_NOTES = 6
_MOST_STARTS = 12


def identify(
    study: StudyPath,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder of the result.")] = None,
    seed: Annotated[int | None, typer.Option("--seed", min=0, help="Replaces the study's seed.")] = None,
    evaluations: Annotated[
        int | None, typer.Option("--evaluations", min=1, help="Replaces the study's budget of evaluations.")
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option("--starts", min=1, metavar="N", help="Search from N starts, and compare the optima they end at."),
    ] = None,
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    workers: Annotated[
        int, typer.Option("--workers", min=1, help="Starts, profile points or left-out trials that run at once.")
    ] = 1,
    profile: Annotated[
        str | None, typer.Option("--profile", metavar="NAMES", help="Profile these, comma-separated; * is a wildcard.")
    ] = None,
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Sample the posterior of the parameters (needs emcee).")
    ] = False,
    posterior_steps: Annotated[
        int | None, typer.Option("--posterior-steps", min=1, metavar="N", help="Steps of that sample at most.")
    ] = None,
    cross_validate: Annotated[
        bool, typer.Option("--cross-validate", help="Leave out each trial in turn and predict it.")
    ] = False,
    estimate_noise: Annotated[
        bool, typer.Option("--estimate-noise", help="Estimate the noise of each channel, whatever [noise] states.")
    ] = False,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Start again instead of continuing an interrupted run.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
    json_file: JsonFile = None,
) -> Result:
    """Identify a study's parameters and write a report."""
    loaded = load_study(study, quiet=quiet)
    if estimate_noise:
        loaded = loaded.replace(noise={})
    patterns = names(profile)
    return run(
        loaded,
        out,
        seed=seed,
        starts=starts,
        budget=None if evaluations is None else dataclasses.replace(loaded.budget, evaluations=evaluations),
        cross_validate=cross_validate or None,
        profile=profile_names(patterns, loaded) if patterns else None,
        posterior=posterior or (posterior_steps is not None) or None,
        posterior_steps=posterior_steps,
        threads=threads,
        workers=workers,
        fresh=fresh,
        quiet=quiet,
    )


def run(study: Study, folder: Path | None = None, *, quiet: bool = False, **options: Any) -> Result:
    """Identifies, saves, reports and shows a study; goes on with an interrupted run of the same study.

    `options` are those of `carried_out`. What is None is what the study says.
    """
    return told(*carried_out(study, folder, quiet=quiet, **options))


def carried_out(
    study: Study,
    folder: Path | None = None,
    *,
    seed: int | None = None,
    starts: int | None = None,
    budget: Budget | None = None,
    cross_validate: bool | None = None,
    profile: Sequence[str] | None = None,
    posterior: bool | None = None,
    posterior_steps: int | None = None,
    threads: int | None = None,
    workers: int = 1,
    fresh: bool = False,
    quiet: bool = False,
) -> tuple[Estimate, Path, Path | None]:
    """Identifies, saves and reports a study: the estimate, the folder of its files, and its report."""
    from seatruth.identification import identify as identify_study
    from seatruth.storage.checkpoint import jobs_file, starts_file

    folder = result_folder(folder, study.output.folder or Path(f"{study.name}-result"), study.source)
    checkpoint = folder / CHECKPOINT
    kept = (checkpoint, starts_file(checkpoint), jobs_file(checkpoint))
    if not quiet:
        asked = study.replace(
            budget=budget or study.budget,
            starts=study.starts if starts is None else starts,
            output=dataclasses.replace(
                study.output, cross_validate=bool(cross_validate or study.output.cross_validate)
            ),
        )
        say_cost(asked, None, "identify", threads=threads)
    with resumable(folder, kept, fresh=fresh, quiet=quiet) as progress:
        estimate = identify_study(
            study,
            starts=starts,
            budget=budget,
            seed=seed,
            checkpoint=checkpoint,
            progress=progress,
            cross_validate=cross_validate,
            profile=profile,
            posterior=posterior,
            posterior_steps=posterior_steps,
            threads=threads,
            workers=workers,
        )
        progress.show("Writing the result", now=False)
        try:
            estimate.save(folder)
            report = _report(estimate, study, folder)
        except CannotWrite:
            # What was found is on the screen at least; the same command makes the rest again from the checkpoint.
            progress.__exit__(None, None, None)
            show(estimate)
            raise
        if estimate.outcome["code"] != "interrupted":
            for path in kept:
                path.unlink(missing_ok=True)
    return estimate, folder, report


def told(estimate: Estimate, folder: Path, report: Path | None) -> Result:
    """Shows an identification and where its files are."""
    show(estimate)
    where = [f"Result: {folder}"] + ([f"Report: {report}"] if report else [])
    for line in where:
        say(line, whole=True)
    code = str(estimate.outcome["code"])
    if code == "interrupted":
        say("Interrupted: this is the best so far. Run the same command again to go on.", style="yellow")
    data = {**summary(estimate), "folder": str(folder), "report": str(report) if report else None}
    return Result(data, {"interrupted": 130, "failed": 1}.get(code, 0))


def _report(estimate: Estimate, study: Study, folder: Path) -> Path | None:
    if not study.output.report:
        return None
    from seatruth.report import write_report

    path = folder / "report.html"
    write_report(estimate, path)
    return path


def summary(estimate: Estimate) -> dict[str, Any]:
    """The estimate as `--json` gives it."""
    return {
        "study": estimate.study,
        "model": estimate.model,
        "synthetic": estimate.synthetic,
        "seed": estimate.seed,
        "optimizer": estimate.optimizer,
        "cost": estimate.cost,
        "outcome": estimate.outcome,
        "parameters": estimate.parameters,
        "nuisances": estimate.nuisances,
        "identifiability": estimate.identifiability,
        "fit": estimate.fit,
        "cross_validation": estimate.cross_validation,
        "starts": estimate.starts,
        "posterior": None if estimate.posterior is None else estimate.posterior.summary,
        "findings": [vars(finding) for finding in estimate.findings],
        "discretisation": estimate.discretisation,
        "provenance": estimate.provenance,
    }


def show(estimate: Estimate) -> None:
    """Prints the result: parameters, inseparable combinations, the fit, the reason for the end."""
    if estimate.synthetic:
        say("SYNTHETIC: these trials were made by a simulator.", style="bold yellow")
    outcome = estimate.outcome
    short = any(finding.code == "not-at-minimum" for finding in estimate.findings)
    but = ", but short of a minimum" if short and outcome["code"] == "converged" else ""
    say(f"{outcome['code']}: {outcome['reason']}{but}", style="bold" if outcome["code"] != "failed" else "bold red")
    diverged = f", {outcome['diverged']} diverged" if outcome.get("diverged") else ""
    say(f"{outcome['evaluations']} evaluations in {outcome['wall_s']:.1f} s{diverged}\n")
    console().print(_parameters(estimate))
    for weak in estimate.identifiability.get("weak", [])[:_MOST_NOTES]:
        say(f"! {weak['sentence']}", style="yellow")
    say("")
    console().print(_fit(estimate.fit))
    if estimate.starts is not None:
        say("\nWhere the starts ended:")
        console().print(_optima(estimate.starts))
    if estimate.cross_validation is not None:
        say("\nLeft out in turn and predicted:")
        console().print(_cross_validation(estimate.cross_validation))
    grave = [finding for wanted in ("error", "warning") for finding in estimate.findings if finding.severity == wanted]
    # What is wrong with the answer comes before what is wrong with the data, which `check` lists as well.
    grave.sort(key=lambda finding: (finding.severity != "error", finding.where != "search"))
    for finding in grave[:_MOST_NOTES]:
        say(str(finding), style="yellow")
    if len(grave) > _MOST_NOTES:
        say(more_findings(grave[_MOST_NOTES:]))
    say("")


def more_findings(left: Sequence[Finding]) -> str:
    """Where findings are that are not printed: `seatruth check` knows those of the data, not those of the search."""
    of_data = any(finding.where != "search" for finding in left)
    also = "; those of the data `seatruth check` lists as well" if of_data else ""
    return f"and {len(left)} more finding{'s' * (len(left) > 1)}: see the report{also}."


def _parameters(estimate: Estimate) -> Any:
    rows = [
        [
            str(name),
            _value(row["value"], row["stderr"]),
            _number(row["stderr"], 2),
            _interval(dict(row)),
            "" if row["unit"] == "1" else str(row["unit"]),
            str(row["verdict"]),
        ]
        for name, row in estimate.parameters.iterrows()
    ]
    columns = ["parameter", "value", "std. error", "95 % interval", "unit", "verdict"]
    if estimate.posterior is not None:
        columns.insert(4, "by posterior")
        for row in rows:
            row.insert(4, _interval(dict(estimate.posterior.summary.loc[row[0]])))
    return table(columns, rows, numbers=("value", "std. error"))


def _fit(frame: pd.DataFrame) -> Any:
    shown = frame.reset_index() if frame.index.name or frame.index.nlevels > 1 else frame
    rows = [
        [
            str(row["trial"]) + (" (held out)" if row["held_out"] else ""),
            str(row["channel"]),
            _number(row["rmse"], 3),
            _number(row["noise"], 3),
            _number(row["ratio"], 3),
            _number(row["rmse_start"], 3),
        ]
        for _, row in shown.iterrows()
    ]
    columns = ["trial", "channel", "RMSE", "noise", "ratio", "before"]
    return table(columns, rows, numbers=columns[2:])


def _optima(frame: pd.DataFrame) -> Any:
    rows = [
        [
            str(optimum) if optimum else "none",
            str(len(ends)),
            _number(ends["cost"].min(), 6),
            _number(ends["cost"].min() - frame["cost"].min(), 3),
            " ".join(str(start) for start in ends["start"][:_MOST_STARTS])
            + (" ..." if len(ends) > _MOST_STARTS else ""),
        ]
        for optimum, ends in sorted(frame.groupby("optimum"), key=lambda group: (group[0] == 0, group[0]))
    ]
    columns = ["optimum", "starts", "lowest cost", "above the best", "which"]
    return table(columns, rows, numbers=columns[:4])


def _cross_validation(frame: pd.DataFrame) -> Any:
    shown = frame.reset_index() if frame.index.name or frame.index.nlevels > 1 else frame
    numbers = [column for column in shown.columns if column not in ("trial", "channel")]
    rows = [
        [str(row["trial"]), str(row["channel"]), *(_number(row[c], 3) for c in numbers)] for _, row in shown.iterrows()
    ]
    return table(["trial", "channel", *map(str, numbers)], rows, numbers=list(map(str, numbers)))


def _interval(row: Mapping[Any, Any]) -> str:
    """Its ends, to as many digits as tell them apart."""
    lower, upper = row["lower"], row["upper"]
    error = 0.25 * (upper - lower)  # of two standard errors to each side
    return f"{_value(lower, error)} to {_value(upper, error)}" if math.isfinite(lower) else ""


def _value(value: float, error: float) -> str:
    """A value with the digits that its standard error leaves it."""
    if not (math.isfinite(error) and error > 0 and math.isfinite(value) and value != 0):
        return _number(value)
    digits = math.ceil(math.log10(abs(value) / error)) + 2 if abs(value) > error else 2
    return _number(value, min(max(digits, 2), 10))


def _number(value: float, digits: int = 4) -> str:
    return "" if value is None or not math.isfinite(value) else f"{value:.{digits}g}"


def names(text: str | None) -> list[str]:
    """The names in a comma-separated list."""
    return [part.strip() for part in (text or "").split(",") if part.strip()]
