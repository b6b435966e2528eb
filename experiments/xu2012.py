"""Xu, Zou et al. 2012: the diving plane of an underwater vehicle by LS-SVM, and what its trial can tell at all.

The trial is synthetic: the paper's plant is lost, a reconstruction [R] with public values [L] stands in for it. Tags
as in `xu2012_system.py`. "Expected" are the figures [V] that independent code computed for the same plant.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xu2012_system as system
from common import Options, Results, main
from xu2012_expected import Checks
from xu2012_report import (
    report_bounds,
    report_noise,
    report_reduced_model,
    report_regressions,
    report_solvers,
    report_trial,
)
from xu2012_system import COEFFICIENTS, DOMINANT, FINS, FORMS, FREE, KEPT, LEVEL, TRUTH, VISCOUS, percent

from seatruth import Budget, identify
from seatruth.costs import cost_of
from seatruth.costs.options import OPTIONS, Kind, RegressionOptions
from seatruth.optimizers import available, minimise
from seatruth.trials import Trial
from seatruth.uncertainty import prior_identifiability, sensitivity

SEED = 2012
ABOUT = """
Printed in the paper [P]: start at rest at 100 m, thrust 120 N, zigzag with 5 deg fin at 2.5 deg/s, 0.5 s, 120 s, LS-SVM
with C = 3e4, thrust as bias. Reconstructed [R]: the equations, the reversal at 5 deg pitch, the regressors, the
sensitivity. From other literature [L]: the plant, NPS AUV II. Chosen here [S]: its |w| and quadratic coefficients, Z_0,
the noise. All trials are synthetic. Not one figure here is the paper's own result: its tables are lost.
"""


def body(options: Options, results: Results) -> None:
    quick, threads = options.quick, options.workers
    results.expect(6)
    trial, strong = system.zigzag(), system.zigzag(15.0)
    checks = Checks(results)
    results.add_text(ABOUT)
    report_trial(checks, results, trial)
    forms = results.stage("regressions", {}, lambda: _regressions(trial, strong, threads))
    sense = results.stage("sensitivities", {}, lambda: _sensitivities(trial, strong, threads))
    reduced = results.stage("reduced model", {}, lambda: _reduced(trial, forms["trapezoid"], sense["5 deg"], threads))
    bounds = results.stage("bounds", {"level": LEVEL, "fins": FINS}, lambda: _bounds(trial, threads))
    setting = {"seed": SEED, "evaluations": 2_000 if quick else 60_000, "seeds": 1 if quick else 3}
    solvers = results.stage("solvers", setting, lambda: _solvers(trial, sense["5 deg"], threads=threads, **setting))
    noise: dict[str, Any] = {"seed": SEED, "levels": [0.003, 0.03] if quick else [0.001, 0.003, 0.01, 0.03, 0.1]}
    noise |= {"seeds": 4 if quick else 40}
    errors = results.stage("noise", noise, lambda: _noise(trial, threads=threads, **noise))

    report_regressions(checks, results, forms, sense)
    report_reduced_model(checks, results, trial, reduced)
    report_bounds(results, bounds)
    report_solvers(results, solvers)
    report_noise(results, errors, sense["5 deg"], bounds)
    checks.finish()


def _regressions(trial: Trial, strong: Trial, threads: int) -> dict[str, dict[str, float]]:
    """Coefficients by way of finding them."""
    found: dict[str, dict[str, float]] = {form: system.separate(trial, form) for form in FORMS}
    for weight in (30.0, 3e7):
        found[f"trapezoid, C={weight:g}"] = system.separate(trial, weight=weight)
    found["trapezoid, 15 deg"] = system.separate(strong)
    found["u[k+1] on u[k]"] = system.literal_surge(trial)
    for form in FORMS:
        cost = cost_of(system.study(trial, cost=RegressionOptions(form=form)), threads=threads)
        x = minimise(cost, "ls_svm", seed=SEED).x
        found[f"{form}, one cost"] = dict(zip(cost.names, x.tolist()))
    return found


def _sensitivities(trial: Trial, strong: Trial, threads: int) -> dict[str, dict[str, float]]:
    found = {}
    for name, run in (("5 deg", trial), ("15 deg", strong)):
        cost = cost_of(system.study(run, noise=system.noise_of(run, LEVEL)), threads=threads)
        found[name] = system.sensitivities(sensitivity(cost, cost.start))
    return found


def _reduced(trial: Trial, identified: Mapping[str, float], sense: Mapping[str, float], threads: int) -> dict[str, Any]:
    """The full and the reduced model, of the true and of the identified coefficients, under the same fin."""
    dropped = [name for name in VISCOUS if sense[name] < KEPT]
    found: dict[str, Any] = {"dropped": dropped, "kept": [name for name in VISCOUS if name not in dropped], "runs": {}}
    for name, base in (("true", {q: TRUTH[q] for q in FREE}), ("identified", dict(identified))):
        for kind, values in (("full", base), ("reduced", base | dict.fromkeys(dropped, 0.0))):
            y = system.simulated(trial, values, threads)
            found["runs"][f"{kind}, {name}"] = {channel: y[channel] for channel in ("theta", "z")}
    return found


def _bounds(trial: Trial, threads: int) -> dict[str, Any]:
    """Cramer-Rao bounds with the same noise in m/s, rad, m whatever the fin does."""
    sd = system.noise_of(trial, LEVEL)
    found: dict[str, Any] = {"sd": sd, "trials": {}}
    runs = {f"{fin:g} deg, 120 s": system.zigzag(fin) for fin in FINS} | {"5 deg, 600 s": system.zigzag(seconds=600.0)}
    for name, run in runs.items():
        frame = prior_identifiability(system.study(run, noise=sd), threads=threads)
        part = (100.0 * frame["crlb"] / frame["value"].abs()).to_dict()
        found["trials"][name] = {"crlb": part, "verdict": frame["verdict"].to_dict()}
    return found


def _solvers(
    trial: Trial, sense: Mapping[str, float], *, threads: int, seed: int, evaluations: int, seeds: int
) -> list[dict[str, Any]]:
    """Every installed solver, from half the truth and within the model's bounds, on both costs of the same record."""
    sd, rows = system.noise_of(trial, LEVEL), []
    some = [name for name in FREE if sense[name] > DOMINANT]
    kinds: tuple[tuple[Kind, Sequence[str]], ...] = (("regression", FREE), ("trajectory", FREE), ("trajectory", some))
    for kind, free in kinds:
        asked = system.study(trial, cost=OPTIONS[kind](), noise=sd, parameters=system.parameters(0.5, free))
        cost = cost_of(asked, threads=threads)
        best = minimise(cost, "least_squares", seed=seed)
        size = np.abs([TRUTH[name] for name in cost.names])
        dominant = np.array([sense[name] > DOMINANT for name in cost.names])
        order: list[tuple[str, str | Sequence[str]]] = [
            (name, name) for name, info in available().items() if not info.error and info.needs <= cost.gives
        ]
        order.append(("differential_swarm, then least_squares", ["differential_swarm", "least_squares"]))
        for name, solver in order:
            random = name not in ("ls_svm", "least_squares", "newton", "nelder_mead")
            for k in range(seeds if random else 1):
                out = minimise(cost, solver, seed=seed + k, budget=Budget(evaluations))
                away = 100.0 * np.abs(out.x - best.x) / size
                row: dict[str, Any] = {
                    "cost": f"{kind}, {len(free)} free",
                    "solver": name,
                    "seed": seed + k,
                    "ended": out.code,
                }
                row |= {"evaluations": out.evaluations, "seconds": out.wall_s}
                row |= {"cost above best": out.value - best.value, "dominant, % from best": away[dominant].max()}
                row |= {"all, % from best": away.max()}
                rows.append(row)
    return rows


def _noise(trial: Trial, *, threads: int, seed: int, levels: Sequence[float], seeds: int) -> list[dict[str, Any]]:
    """Errors in per cent of each coefficient, level and seed, by regression and by trajectory, with intervals."""
    names = COEFFICIENTS
    free = tuple(q.replace(min=-math.inf, max=math.inf) if q.vary else q for q in system.parameters(0.5))
    rows = []
    for place, level in enumerate(levels):
        sd = system.noise_of(trial, level)
        bound: Any = prior_identifiability(system.study(trial, noise=sd), threads=threads)["crlb"]
        for k in range(seeds):
            record = system.noisy(trial, sd, np.random.default_rng([seed, place, k]))
            machine = percent(system.separate(record))
            table: Any = identify(
                system.study(record, noise=sd, parameters=free), seed=seed, threads=threads
            ).parameters
            fitted = percent(table["value"].to_dict())
            for name in names:
                low, high = sorted((table.loc[name, "lower"], table.loc[name, "upper"]))
                rows.append(
                    {"level": level, "seed": k, "coefficient": name, "ls_svm": machine[name]}
                    | {"trajectory": fitted[name], "crlb": 100.0 * bound[name] / abs(TRUTH[name])}
                    | {"covered": bool(low <= TRUTH[name] <= high)}
                )
    return rows


if __name__ == "__main__":
    sys.exit(main("xu2012", str(__doc__).splitlines()[0], body, seeds={"solvers and noise": SEED}))
