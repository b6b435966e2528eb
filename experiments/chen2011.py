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
import chen2011_report as report
import chen2011_runs as runs
import chen2011_sensors as sensors
import chen2011_system as system
import numpy as np
from chen2011_runs import SEED, in_parallel
from common import Options, Results, main
from xu2012_expected import Checks

from seatruth.models.longitudinal_plane import LongitudinalPlane, LongitudinalPlaneExplicit

ABOUT = """
Printed in the paper [P]: the model's outline, 11 free parameters with added masses among them, the criterion over six
outputs, noise of 1 and 3 % of their peaks, errors of at most 7 %, the symbols of Differential Swarm. Reconstructed [R]:
equations and the swarm's update, of which variant A is the preferred reading. Chosen here [S]: vehicle, trial, bounds
of 0.2 to 3 times the truth. All trials are synthetic. Not one figure here is the paper's own result.
"""
PUBLISHED: Mapping[str, Any] = {"particles": 50, "omega": 1.0, "distinct": True}
"""The swarm: omega [P], its size [S], i1 and i2 different [R]."""
SWARM: runs.Solver = (("differential_swarm", PUBLISHED),)
OTHERS: Mapping[str, runs.Solver] = {
    # Clerc and Kennedy (2002), Deb and Agrawal (1995), SciPy's: settings of the literature, not seatruth's tuned ones.
    "particle_swarm": (
        ("particle_swarm", {"draw": "component", "topology": "star", "boundary": "nearest", "inertia": 0.7298}),
    ),
    "genetic": (("genetic", {"crossing": "sbx", "population": 100, "crossover": 0.8, "mutation": 0.15}),),
    # Its schedule is made long enough to last to the budget.
    "simulated_annealing": (("simulated_annealing", {"iterations": 20_000, "precision": 2.2e-9}),),
    "differential_evolution": (
        ("differential_evolution", {"strategy": "best1bin", "recombination": 0.7, "population": 50}),
    ),
    "cma_es": (("cma_es", {}),),
    "nelder_mead": (("nelder_mead", {}),),
    "newton": (("newton", {}),),
    "DS, then least_squares": (("differential_swarm", PUBLISHED), ("least_squares", {})),
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
    results.expect(5 + len(levels) + len(lengths))
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
    jobs = [{"seconds": 60.0, "evaluations": 60, "seed": SEED}]
    if not quick:
        jobs = [{**jobs[0], "evaluations": 1_500}, {**jobs[0], "seconds": 120.0, "evaluations": 1_000}]
    same = stage(
        "designed trials, sensors of the benchmark",
        {"jobs": jobs},
        partial(in_parallel, sensors.search, jobs, workers),
        sources=(*_SOURCES, "experiments/chen2011_sensors.py"),
    )
    found = []
    for level, (swarm, others) in levels.items():
        own = {"level": level, "swarm": swarm, "others": others, "solvers": OTHERS, **setting}
        found += stage(f"solvers, {100 * level:g} % noise", own, partial(_solvers, own, workers))
    own = {"runs": 1 if quick else 5, "hybrid": 3_000 if quick else 20_000, **setting}
    six = stage("6-DOF", own, partial(_coupled, own, workers))
    own = {"runs": 1 if quick else 2, "variants": VARIANTS, **setting}
    variants = stage("variants", own, partial(_variants, own, (0.03,), workers))

    report.bounds(results, table)
    report.solvers(results, found)
    report.variants(results, variants)
    report.fits(results, fits, table["benchmark"])
    report.designs(results, designs, fits, table)
    report.sensors(results, same, designs)
    report.coupled(results, six)
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
        {"level": level, "label": name, "solver": (("differential_swarm", {**PUBLISHED, **given}),), "k": k}
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


if __name__ == "__main__":
    sys.exit(main("chen2011", str(__doc__).splitlines()[0], body, seeds={"starts, noise and solvers": SEED}))
