"""What the experiment on Chen, Yan and Wang 2011 says of its runs: figures, tables, pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import chen2011_coupled as six_dof
import chen2011_design as design
import chen2011_figures as figures
import chen2011_runs as runs
import chen2011_system as system
import numpy as np
import pandas as pd
from chen2011_system import FREE
from common import Results

PROMISED = 7.0
"""[P] per cent: the largest relative error at 3 % noise."""


def bounds(results: Results, table: Mapping[str, Mapping[str, float]]) -> None:
    frame = pd.DataFrame(table).loc[list(FREE)]
    frame[frame >= 1e9] = math.inf
    results.add_table("bounds in per cent", frame.rename_axis("parameter"))
    neutral = table["no net weight"]["lambda_22"]
    note = f"with the net weight (5 % of the weight) known {table['benchmark']['lambda_22']:.2g} %"
    results.add_figure("bound of lambda_22 at 3 % noise without net weight", neutral, "%", note)
    lost = sum(math.isinf(value) for value in frame["no weight moment"])
    results.add_figure(
        "parameters without a bound where no weight moment acts (x_B = y_G = 0)", lost, f"of {len(FREE)}"
    )


def solvers(results: Results, found: Sequence[Mapping[str, Any]]) -> None:
    rows: Any = pd.DataFrame(found).sort_values("level", kind="stable")
    rows["worst error, %"] = [max(abs(e) for e in error.values()) for error in rows.error]
    results.add_table("solver runs", rows.drop(columns="error").set_index(["level", "solver", "run"]))
    bound = system.bounds(system.benchmark(), 0.01)
    lines = [
        "| noise | solver | reached | evaluations (median of those) | excess (median, worst) | rms error over bound |",
        "|---" * 6 + "|",
    ]
    table = []
    for (level, name), group in rows.groupby(["level", "solver"], sort=False):
        done = group[group.reached]
        size = runs.ratio(group.error.tolist(), {q: b * level / 0.01 for q, b in bound.items()}) if level else {}
        overall = math.sqrt(float(np.mean(np.square(list(size.values()))))) if size else math.nan
        table.append(
            {"level": level, "solver": name, "reached": len(done), "runs": len(group)}
            | {"evaluations": float(done.evaluations.median()), "most evaluations": int(group.evaluations.max())}
            | {"median excess": float(group.excess.median()), "worst excess": float(group.excess.max())}
            | {"rms error over bound": overall, "worst error, %": float(group["worst error, %"].max())}
        )
        spent = f"{done.evaluations.median():.0f}" if len(done) else "-"
        error = f"{overall:.2f}" if size else f"worst {group['worst error, %'].max():.2g} %"
        lines.append(
            f"| {100 * level:g} % | {name} | {len(done)} of {len(group)} | {spent} | "
            f"{group.excess.median():.2g}, {group.excess.max():.2g} | {error} |"
        )
    frame: Any = pd.DataFrame(table)
    results.add_table("solvers", frame.set_index(["level", "solver"]))
    most = int(max(rows.evaluations.tolist()))
    results.add_text(
        "Runs from random starts within 0.2 to 3 times the truth; run k has the same start and noise for every solver. "
        f"Reached: the best-known fit to {runs.REACHED:g} in chi-square units; it ends there or after {most} "
        "evaluations.\n\n" + "\n".join(lines)
    )
    swarm = frame[frame.solver == "differential_swarm"]
    enough = bool(swarm.runs.sum() >= 20)
    share = 100.0 * swarm.reached.sum() / swarm.runs.sum()
    note = f"all levels, {swarm.runs.sum()} runs; median {swarm.evaluations.median():.0f} evaluations"
    results.add_figure(
        "DS: runs that reach the optimum", share, "%", note, goal=">= 95", met=bool(share >= 95.0) if enough else None
    )
    rivals = frame[frame.solver.isin(["particle_swarm", "genetic", "simulated_annealing"])]
    spent = swarm.set_index("level")["most evaluations"]
    sooner = rivals[(rivals.reached > 0) & (rivals.evaluations <= rivals.level.map(spent))]
    results.add_figure(
        "PSO, GA and SA together: runs that reach it",
        int(rivals.reached.sum()),
        f"of {rivals.runs.sum()}",
        f"within {most} evaluations",
        goal="DS in fewer evaluations than any of them",
        met=bool(sooner.empty and share > 0) if enough else None,
    )
    results.add_picture("solvers", figures.solvers(rows, most))


def variants(results: Results, found: Sequence[Mapping[str, Any]]) -> None:
    rows: Any = pd.DataFrame(found)
    rows["worst error, %"] = [max(abs(e) for e in error.values()) for error in rows.error]
    lines = ["| variant | noise | reached | evaluations | excess (median, worst) |", "|---" * 5 + "|"]
    for (name, level), group in rows.groupby(["solver", "level"], sort=False):
        done = group[group.reached]
        spent = f"{done.evaluations.median():.0f}" if len(done) else "-"
        lines.append(
            f"| {name} | {100 * level:g} % | {len(done)} of {len(group)} | {spent} | "
            f"{group.excess.median():.2g}, {group.excess.max():.2g} |"
        )
    results.add_table("variants", rows.drop(columns="error").set_index(["solver", "level", "run"]))
    results.add_text("Readings of Differential Swarm [R], 50 particles unless stated.\n\n" + "\n".join(lines))


def fits(results: Results, fits: Sequence[Mapping[str, Any]], bound: Mapping[str, float]) -> None:
    rows: Any = pd.DataFrame(fits)
    table, everything, covered = {}, [], []
    for (level, free), group in rows.groupby(["level", "free_start"], sort=False):
        own = {q: b * level / 0.03 for q, b in bound.items()}
        size = runs.ratio(group.error.tolist(), own)
        inside = [value for row in group.inside for value in row.values()]
        overall = math.sqrt(float(np.mean(np.square(list(size.values())))))
        label = f"{100 * level:g} %{', first state estimated' if free else ''}"
        table[label] = {**size, "all": overall, "covered, %": 100.0 * float(np.mean(inside)), "runs": len(group)}
        if not free:
            everything.append(overall)
            covered += inside
    frame = pd.DataFrame(table)
    results.add_table("maximum likelihood, error over bound", frame.rename_axis("parameter"))
    worst, count = max(everything), len(rows) // len(table)
    single = float(frame.drop(index=["all", "covered, %", "runs"]).to_numpy().max())
    results.add_figure(
        "maximum likelihood: rms error over the Cramer-Rao bound",
        worst,
        "1",
        f"worst level, {count} records each; largest single parameter {single:.2f}",
        goal="<= 1.2",
        met=bool(worst <= 1.2) if count >= 20 else None,
    )
    part = 100.0 * float(np.mean(covered))
    results.add_figure(
        "maximum likelihood: coverage of 95 % intervals",
        part,
        "%",
        f"{len(covered)} intervals",
        goal="92 to 98",
        met=bool(92.0 <= part <= 98.0) if count >= 20 else None,
    )


def designs(
    results: Results,
    designs: Sequence[Mapping[str, Any]],
    fits: Sequence[Mapping[str, Any]],
    table: Mapping[str, Mapping[str, float]],
) -> None:
    before = [row for row in fits if row["level"] == design.LEVEL and not row["free_start"]]
    worst = {"benchmark, 60 s": _worst(before)} | {
        f"designed, {entry['seconds']:g} s": _worst(entry["fits"]) for entry in designs
    }
    bound = {"benchmark, 60 s": dict(table["benchmark"])} | {
        f"designed, {entry['seconds']:g} s": dict(entry["bound"]) for entry in designs
    }
    results.add_table("bounds of the designed trials", pd.DataFrame(bound).rename_axis("parameter"))
    kept = pd.DataFrame({f"{e['seconds']:g} s": e["settings"] for e in designs}).rename_axis("setting")
    results.add_table("settings of the designed trials", kept)
    for name, errors in worst.items():
        largest = max(bound[name].values())
        inside = 100.0 * float(np.mean(np.array(errors) <= PROMISED))
        last = name == list(worst)[-1] and len(errors) >= 20
        results.add_figure(
            f"{name}: records with no error above {PROMISED:g} %",
            inside,
            "%",
            f"3 % noise, {len(errors)} records; largest bound {largest:.3g} %; "
            f"worst error median {np.median(errors):.2g} %, 95th percentile {np.percentile(errors, 95):.2g} %",
            goal=">= 95" if last else "",
            met=bool(inside >= 95.0) if last else None,
        )
    for entry in designs:
        rows: Any = pd.DataFrame(entry["swarm"])
        swarm = rows[rows.solver == "differential_swarm"]
        hybrid = rows[rows.solver != "differential_swarm"]
        results.add_figure(
            f"designed, {entry['seconds']:g} s: DS at the optimum from random starts",
            int(swarm.reached.sum()),
            f"of {len(swarm)}",
            f"median {swarm.evaluations.median():.0f} evaluations; then least squares: {hybrid.reached.sum()} of "
            f"{len(hybrid)}, {hybrid.evaluations.median():.0f}",
        )
        trial = design.trial(np.asarray(entry["elevator"]))
        title = f"Designed trial, {entry['seconds']:g} s (synthetic)"
        results.add_picture(f"designed {entry['seconds']:g} s", figures.trial(trial, title))
    results.add_picture("promise", figures.promise(bound, worst, PROMISED))


def sensors(results: Results, same: Sequence[Mapping[str, Any]], designs: Sequence[Mapping[str, Any]]) -> None:
    sd = system.noise_of(system.benchmark(), design.LEVEL)
    for entry in designs:
        bound = system.bounds(design.trial(np.asarray(entry["elevator"])), design.LEVEL, noise=sd)
        results.add_figure(
            f"designed, {entry['seconds']:g} s: largest bound with the benchmark's sensors",
            max(bound.values()),
            "%",
            f"{max(entry['bound'].values()):.3g} % where noise is 3 % of its own peaks",
        )
    for entry in same:
        results.add_figure(
            f"designed for the benchmark's sensors, {entry['seconds']:g} s: largest bound",
            max(entry["bound"].values()),
            "%",
        )
    table = pd.DataFrame({f"{entry['seconds']:g} s": entry["bound"] for entry in same})
    results.add_table("bounds of trials designed for the benchmarks sensors", table.rename_axis("parameter"))


def _worst(fits: Sequence[Mapping[str, Any]]) -> list[float]:
    """The largest relative error of each fit, per cent."""
    return [max(abs(e) for e in row["error"].values()) for row in fits]


def coupled(results: Results, six: Mapping[str, Any]) -> None:
    rows: Any = pd.DataFrame(six["runs"])
    for name, group in rows.groupby("solver", sort=False):
        size = runs.ratio(group.error.tolist(), six["bound"])
        overall = math.sqrt(float(np.mean(np.square(list(size.values())))))
        results.add_figure(
            f"6-DOF, {len(six_dof.FREE)} parameters: {name} at the optimum",
            int(group.reached.sum()),
            f"of {len(group)}",
            f"3 % noise; median {group.evaluations.median():.0f} evaluations; rms error over bound {overall:.2f}",
        )
    table = pd.DataFrame({"bound, %": six["bound"]}).rename_axis("parameter")
    for name, group in rows.groupby("solver", sort=False):
        table[f"rms error over bound, {name}"] = pd.Series(runs.ratio(group.error.tolist(), six["bound"]))
    results.add_table("6-DOF", table)
