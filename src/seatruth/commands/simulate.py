"""`seatruth simulate STUDY.toml`: the model as it stands against the trials, without a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from seatruth.commands.common import JsonFile, Result, StudyPath, console, say, table
from seatruth.commands.progress import load_study
from seatruth.text import listed

if TYPE_CHECKING:
    import pandas as pd

    from seatruth.study import Study

_ANGLES = ("psi", "theta", "phi")
_FAR = math.radians(30.0)
"""rad by which an angle is missed (root mean square over a trial) from which something is said of it. [S]"""


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
    rows = misses(loaded, runs)
    console().print(table(["trial", "channel", "RMSE", "unit"], [_line(row) for row in rows], numbers=("RMSE",)))
    diverged_trials = sorted({str(row["trial"]) for row in rows if row["diverged"]})
    for name in diverged_trials:
        say(_where_it_diverges(name, runs[name]))
    if diverged_trials:
        say(
            "Check units, signs, start values, and what the equations do there: a root of a negative speed, a division."
        )
    if missed := missed_angle(rows):
        say(
            f"{missed}. An error of the rate of turn adds up, and nothing has been fitted yet: `seatruth identify` "
            "says what is left with the coefficients that are free. If it still misses so much, look at signs, units "
            "and the form of the model before a diagnosis."
        )
    return Result({"fit": rows, "diverged": diverged_trials}, 1 if diverged_trials else 0)


def misses(study: Study, runs: Mapping[str, pd.DataFrame]) -> list[dict[str, Any]]:
    """Root mean square of what simulated runs miss, by trial and output; NaN where a run diverges."""
    rows = []
    for trial in (*study.trials, *study.holdout):
        run = runs[trial.name]
        diverged = not np.isfinite(run.to_numpy()).all()
        for channel in study.model.outputs:
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
    return rows


def _line(row: Mapping[str, Any]) -> list[str]:
    """A row of the table: angles in degrees."""
    from seatruth.report.numbers import shown

    channel = shown(str(row["channel"]), str(row["unit"]))
    size = f"{row['rmse'] * channel.factor:.4g}" if row["samples"] else "not recorded"
    return [str(row["trial"]), channel.name, "diverged" if row["diverged"] else size, channel.unit]


def missed_angle(rows: Sequence[Mapping[str, Any]]) -> str:
    """Which angle of `misses` is missed by far, in words; "" where none is."""
    missed = [row for row in rows if row["channel"] in _ANGLES and row["rmse"] > _FAR]
    if not missed:
        return ""
    worst = max(missed, key=lambda row: float(row["rmse"]))
    return f"{worst['channel']} is missed by {math.degrees(worst['rmse']):.0f} deg in {worst['trial']!r}"


def _where_it_diverges(name: str, run: pd.DataFrame) -> str:
    """From when on a trial's run (index t, s) is not finite, and what its outputs were just before."""
    lost = int(np.flatnonzero(~np.isfinite(run.to_numpy()).all(axis=1))[0])
    units = run.attrs["units"]
    if lost == 0:
        return f"The simulation of {name!r} diverges from its first sample on."
    last = [f"{channel} {run[channel].iloc[lost - 1]:.3g} {units[channel]}" for channel in run.columns]
    return f"The simulation of {name!r} diverges at t = {run.index[lost]:g} s, after {listed(last, len(last))}."
