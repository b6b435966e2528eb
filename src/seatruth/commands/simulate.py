"""`seatruth simulate STUDY.toml`: the model as it stands against the trials, without a fit."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, say, table
from seatruth.commands.progress import load_study


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
    if diverged_trials:
        say(f"The simulation diverged on {', '.join(diverged_trials)}: check units, signs and start values.")
    return Result({"fit": rows, "diverged": diverged_trials}, 1 if diverged_trials else 0)
