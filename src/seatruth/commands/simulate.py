"""`seatruth simulate STUDY.toml`: the model as it stands against the trials, without a fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, say, table
from seatruth.commands.progress import load_study
from seatruth.text import listed

if TYPE_CHECKING:
    import pandas as pd


def simulate(
    study: StudyPath,
    threads: Annotated[
        int | None, typer.Option("--threads", min=1, help="Threads of the simulation [all cores].")
    ] = None,
    json_file: JsonFile = None,
) -> Result:
    """Simulate the model against the trials, without a fit."""
    loaded = load_study(study)
    runs = loaded.simulate(threads=threads)
    rows = []
    for trial in (*loaded.trials, *loaded.holdout):
        run = runs[trial.name]
        diverged = not np.isfinite(run.to_numpy()).all()
        for channel in loaded.model.outputs:
            measured = trial.outputs.get(channel.name, np.full(len(trial), np.nan))
            difference = measured - run[channel.name].to_numpy()
            valid = difference[np.isfinite(difference)]
            rmse = float(np.sqrt(np.mean(valid**2))) if valid.size and not diverged else float("nan")
            rows.append(
                {
                    "trial": trial.name,
                    "channel": channel.name,
                    "rmse": rmse,
                    "unit": channel.unit,
                    "samples": int(valid.size),
                    "diverged": diverged,
                }
            )
    shown = [
        [
            str(row["trial"]),
            str(row["channel"]),
            "diverged" if row["diverged"] else f"{row['rmse']:.4g}" if row["samples"] else "not recorded",
            str(row["unit"]),
        ]
        for row in rows
    ]
    console().print(table(["trial", "channel", "RMSE", "unit"], shown, numbers=("RMSE",)))
    diverged_trials = sorted({str(row["trial"]) for row in rows if row["diverged"]})
    for name in diverged_trials:
        say(_where_it_diverges(name, runs[name]))
    if diverged_trials:
        say(
            "Check units, signs, start values, and what the equations do there: a root of a negative speed, a division."
        )
    return Result({"fit": rows, "diverged": diverged_trials}, 1 if diverged_trials else 0)


def _where_it_diverges(name: str, run: pd.DataFrame) -> str:
    """From when on a trial's run (index t, s) is not finite, and what its outputs were just before."""
    lost = int(np.flatnonzero(~np.isfinite(run.to_numpy()).all(axis=1))[0])
    units = run.attrs["units"]
    if lost == 0:
        return f"The simulation of {name!r} diverges from its first sample on."
    last = [f"{channel} {run[channel].iloc[lost - 1]:.3g} {units[channel]}" for channel in run.columns]
    return f"The simulation of {name!r} diverges at t = {run.index[lost]:g} s, after {listed(last, len(last))}."
