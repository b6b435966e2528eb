"""Chen, Yan and Wang 2011: Differential Swarm on the longitudinal plane, and a trial that holds what it promises.

All trials are synthetic: the paper's equations, values and trajectory are lost. Tags as in `chen2011_system.py`.
"Expected" are the figures [V] that independent code computed for the same benchmark.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import chen2011_coupled as coupled
import chen2011_design as design
import chen2011_figures as figures
import chen2011_runs as runs
import chen2011_system as system
import numpy as np
import pandas as pd
from chen2011_runs import SEED, in_parallel
from chen2011_system import FREE
from common import Options, Results, main
from xu2012_expected import Checks

from seatruth.models.longitudinal_plane import LongitudinalPlane, LongitudinalPlaneExplicit

ABOUT = """
Printed in the paper [P]: the model's outline, 11 free parameters with added masses among them, the criterion over six
outputs, noise of 1 and 3 % of their peaks, errors of at most 7 %, the symbols of Differential Swarm. Reconstructed [R]:
equations and the swarm's update, of which variant A is the preferred reading. Chosen here [S]: vehicle, trial, bounds
of 0.2 to 3 times the truth. All trials are synthetic. Not one figure here is the paper's own result.
"""
PROMISED = 7.0
"""[P] per cent: the largest relative error at 3 % noise."""
SWARM: runs.Solver = (("differential_swarm", {}),)
OTHERS: Mapping[str, runs.Solver] = {
    "particle_swarm": (("particle_swarm", {}),),
    "genetic": (("genetic", {"population": 100}),),
    # Its schedule is made long enough to last to the budget.
    "simulated_annealing": (("simulated_annealing", {"iterations": 20_000}),),
    "differential_evolution": (("differential_evolution", {}),),
    "cma_es": (("cma_es", {}),),
    "nelder_mead": (("nelder_mead", {}),),
    "newton": (("newton", {}),),
    "DS, then least_squares": (("differential_swarm", {}), ("least_squares", {})),
}
VARIANTS: Mapping[str, Mapping[str, Any]] = {
    **{name: {"variant": name} for name in ("A", "A_prime", "B_component", "B_scalar", "C", "D")},
    "A, i1 = i2 possible": {"distinct": False},
    "A, 40 particles": {"particles": 40},
    "A, 30 particles": {"particles": 30},
}
LENGTHS = (60.0, 120.0)
"""s"""
_SOURCES = (
    *("src", "optimizers"),
    *(f"experiments/chen2011_{part}.py" for part in ("runs", "system", "design", "coupled")),
)
"""What the outcome of a stage depends on; this file only says which runs and shows them."""


def body(options: Options, results: Results) -> None:
    quick, workers = options.quick, options.workers
    levels = {0.03: (1, 1)} if quick else {0.03: (20, 5), 0.0: (20, 4), 0.01: (10, 1), 0.1: (10, 1)}
    lengths = LENGTHS[:1] if quick else LENGTHS
    results.expect(4 + len(levels) + len(lengths))
    results.add_text(ABOUT)
    stage = partial(results.stage, sources=_SOURCES)
    checks = Checks(results)
    _benchmark(checks, results)
    table = stage("bounds", {}, _bounds)
    setting: dict[str, Any] = {"evaluations": 2_000 if quick else 100_000, "seed": SEED}
    own: dict[str, Any] = {"levels": [0.03] if quick else [0.01, 0.03, 0.1], "runs": 4 if quick else 60, "seed": SEED}
    fits = stage("maximum likelihood", own, partial(_fits, own, workers))
    designs = []
    for seconds in lengths:
        own = {"seconds": seconds, "design": 100 if quick else 4_000, "runs": 2 if quick else 100}
        own |= {"swarm": 1 if quick else 6, **setting}
        designs.append(stage(f"designed trial, {seconds:g} s", own, partial(_designed, own, workers)))
    found = []
    for level, (swarm, others) in levels.items():
        own = {"level": level, "swarm": swarm, "others": others, "solvers": OTHERS, **setting}
        found += stage(f"solvers, {100 * level:g} % noise", own, partial(_solvers, own, workers))
    own = {"runs": 1 if quick else 5, "hybrid": 3_000 if quick else 20_000, **setting}
    six = stage("6-DOF", own, partial(_coupled, own, workers))
    own = {"runs": 1 if quick else 2, "variants": VARIANTS, **setting}
    variants = stage("variants", own, partial(_variants, own, (0.03,), workers))

    _report_bounds(results, table)
    _report_solvers(results, found)
    _report_variants(results, variants)
    _report_fits(results, fits, table["benchmark"])
    _report_designs(results, designs, fits, table)
    _report_coupled(results, six)
    checks.finish()


def _benchmark(checks: Checks, results: Results) -> None:
    trial = system.benchmark()
    theta, u = np.degrees(trial.outputs["theta"]), trial.outputs["u"]
    bound = system.bounds(trial, 0.03)
    checks.near("least pitch", float(theta.min()), -32.0, 0.5, "deg")
    checks.near("largest pitch", float(theta.max()), 25.0, 0.5, "deg")
    checks.near("least speed", float(u.min()), 2.9, 0.05, "m/s")
    checks.near("largest speed", float(u.max()), 4.8, 0.05, "m/s")
    checks.near("largest incidence", float(np.degrees(np.arctan(abs(trial.outputs["w"]) / u)).max()), 9.5, 0.1, "deg")
    for name, expected in (("lambda_22", 2.9), ("lambda_26", 12.6), ("lambda_66", 8.3), ("C_x0", 0.6)):
        checks.near(f"bound of {name} at 3 %", bound[name], expected, 0.05, "%")
    checks.near("bound of C_x_alpha at 3 %", bound["C_x_alpha"], 3.4, 0.05, "%")
    lift = [bound[name] for name in ("C_y_alpha", "C_y_wz", "C_y_de")]
    moment = [bound[name] for name in ("m_z_alpha", "m_z_wz", "m_z_de")]
    checks.near("least bound of a C_y", min(lift), 1.9, 0.06, "%")
    checks.near("largest bound of a C_y", max(lift), 3.7, 0.06, "%")
    checks.near("least bound of an m_z", min(moment), 2.6, 0.07, "%")
    checks.near("largest bound of an m_z", max(moment), 2.8, 0.06, "%")
    results.add_picture("benchmark", figures.trial(trial, "Benchmark trial (synthetic)"))


def _bounds() -> dict[str, dict[str, float]]:
    """Cramer-Rao bounds in per cent at 3 % noise, with and without what anchors them."""
    plain, apart = LongitudinalPlane(), LongitudinalPlaneExplicit()
    weight = plain.nominal()["m"] * plain.nominal()["g"]
    cases: dict[str, tuple[Any, dict[str, float]]] = {
        "benchmark": (plain, {}),
        "net weight +5 %": (plain, {"dG": 0.05 * weight}),
        "no net weight": (plain, {"dG": 0.0}),
        "no weight moment": (plain, {"y_G": 0.0}),
        "neither": (plain, {"dG": 0.0, "y_G": 0.0}),
        "couplings apart": (apart, {}),
        "couplings apart, no net weight": (apart, {"dG": 0.0}),
    }
    found = {}
    for name, (model, values) in cases.items():
        trial = system.benchmark(model, values)
        bound = system.bounds(trial, 0.03, model=model, values=values)
        found[name] = {q: value if math.isfinite(value) else 1e9 for q, value in bound.items()}
    return found


def _solvers(own: Mapping[str, Any], workers: int) -> list[dict[str, Any]]:
    solvers = {"differential_swarm": SWARM, **OTHERS}
    jobs = [
        {"level": own["level"], "label": name, "solver": parts, "k": k, "evaluations": own["evaluations"]}
        for name, parts in solvers.items()
        for k in range(own["swarm"] if name == "differential_swarm" else own["others"])
    ]
    return in_parallel(runs.search, jobs, workers)


def _variants(own: Mapping[str, Any], levels: Sequence[float], workers: int) -> list[dict[str, Any]]:
    jobs = [
        {"level": level, "label": name, "solver": (("differential_swarm", dict(given)),), "k": k}
        | {"evaluations": own["evaluations"]}
        for level in levels
        for name, given in VARIANTS.items()
        for k in range(own["runs"])
    ]
    return in_parallel(runs.search, jobs, workers)


def _fits(own: Mapping[str, Any], workers: int) -> list[dict[str, Any]]:
    cases = [(level, False) for level in own["levels"]] + [(0.03, True)]
    jobs = [{"level": level, "k": k, "free_start": free} for level, free in cases for k in range(own["runs"])]
    out = in_parallel(runs.fit, jobs, workers)
    return [{"level": job["level"], "free_start": job["free_start"], **row} for job, row in zip(jobs, out)]


def _designed(own: Mapping[str, Any], workers: int) -> dict[str, Any]:
    """The trial that was found, its bounds, fits of many noisy records, and Differential Swarm on some of them."""
    settings, trial = design.search(own["seconds"], own["design"], SEED, workers)
    elevator = trial.inputs["delta_s"].tolist()
    jobs = [{"level": design.LEVEL, "k": k, "elevator": elevator, "start": 1.0} for k in range(own["runs"])]
    fits = in_parallel(runs.fit, jobs, workers)
    search: dict[str, Any] = {"level": design.LEVEL, "elevator": elevator, "evaluations": own["evaluations"]}
    hybrid = {"label": "DS, then least_squares", "solver": OTHERS["DS, then least_squares"]}
    swarm = {"label": "differential_swarm", "solver": SWARM}
    many = [{**search, **kind, "k": k} for kind in (swarm, hybrid) for k in range(own["swarm"])]
    return {
        **{"seconds": own["seconds"], "settings": settings, "elevator": elevator, "fits": fits},
        **{"bound": system.bounds(trial, design.LEVEL), "swarm": in_parallel(runs.search, many, workers)},
    }


def _coupled(own: Mapping[str, Any], workers: int) -> dict[str, Any]:
    level, solvers = design.LEVEL, (("differential_swarm", SWARM, own["evaluations"]),)
    hybrid = ("DS, then least_squares", OTHERS["DS, then least_squares"], own["hybrid"])
    jobs = [
        {"label": label, "solver": parts, "k": k, "level": level, "evaluations": evaluations}
        for label, parts, evaluations in (*solvers, hybrid)
        for k in range(own["runs"])
    ]
    return {"bound": coupled.bounds(level), "runs": in_parallel(coupled.search, jobs, workers)}


def _report_bounds(results: Results, table: Mapping[str, Mapping[str, float]]) -> None:
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


def _report_solvers(results: Results, found: Sequence[Mapping[str, Any]]) -> None:
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


def _report_variants(results: Results, found: Sequence[Mapping[str, Any]]) -> None:
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


def _report_fits(results: Results, fits: Sequence[Mapping[str, Any]], bound: Mapping[str, float]) -> None:
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


def _report_designs(
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


def _worst(fits: Sequence[Mapping[str, Any]]) -> list[float]:
    """The largest relative error of each fit, per cent."""
    return [max(abs(e) for e in row["error"].values()) for row in fits]


def _report_coupled(results: Results, six: Mapping[str, Any]) -> None:
    rows: Any = pd.DataFrame(six["runs"])
    for name, group in rows.groupby("solver", sort=False):
        size = runs.ratio(group.error.tolist(), six["bound"])
        overall = math.sqrt(float(np.mean(np.square(list(size.values())))))
        results.add_figure(
            f"6-DOF, {len(coupled.FREE)} parameters: {name} at the optimum",
            int(group.reached.sum()),
            f"of {len(group)}",
            f"3 % noise; median {group.evaluations.median():.0f} evaluations; rms error over bound {overall:.2f}",
        )
    table = pd.DataFrame({"bound, %": six["bound"]}).rename_axis("parameter")
    for name, group in rows.groupby("solver", sort=False):
        table[f"rms error over bound, {name}"] = pd.Series(runs.ratio(group.error.tolist(), six["bound"]))
    results.add_table("6-DOF", table)


if __name__ == "__main__":
    sys.exit(main("chen2011", str(__doc__).splitlines()[0], body, seeds={"starts, noise and solvers": SEED}))
