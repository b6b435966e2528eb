"""Sun, Wang and Sang 2019: the Petrel-II glider, its sawteeth and spirals, and what they tell of its coefficients.

All trials are synthetic. Tags as in `sun2019_system.py`. "Expected" are the figures [V] that independent code computed.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sun2019_system as system
from common import Options, Results, main
from joblib import Parallel, delayed
from sun2019_report import report_bounds, report_controls, report_everything, report_noise, report_runs
from sun2019_system import ADDED, CLIMB, CURRENT, DESIGNS, DIVE, HYDRODYNAMIC, KNOWN, RUDDERS, SUITES
from xu2012_expected import Checks

from seatruth import identify
from seatruth.manoeuvres import GlideSpiral, Sawtooth, Trim
from seatruth.trials import Trial

SEED = 2019
SUITE = "and fixes at both ends"
"""[S] Sensors of the noise study."""
ABOUT = """
Printed in the paper [P]: a glider with several point masses, buoyancy drive, sliding mass and tail rudder; sawtooth and
spiral runs (30 deg of rudder); current as a disturbance; Runge-Kutta. Reconstructed [R]: the equations and the closed
forms of the turn. From other literature [L]: the Sea-Wing glider's values. Chosen here [S]: what a rudder-steered
vehicle must have otherwise, the controls, the sensors, the current. All trials are synthetic. Not one figure here is
the paper's own: its tables are lost. "Closed form" is a formula of the steady motion, "simulated" the 6-DOF model.
"""


def body(options: Options, results: Results) -> None:
    quick, threads = options.quick, options.workers
    results.expect(5)
    results.add_text(ABOUT)
    checks = Checks(results)
    hold = 150.0 if quick else 400.0
    runs = results.stage("runs", {"current": CURRENT, "hold": hold}, lambda: _runs(hold))
    grid: dict[str, Any] = {"m_b": [0.5] if quick else [0.3, 0.4, 0.5], "points": 2 if quick else 9}
    grid |= {"rudders": [10.0, 30.0] if quick else [3.0, 5.0, 7.5, 10.0, 15.0, 20.0, 25.0, 30.0]}
    controls = results.stage("controls", grid, lambda: _controls(**grid))
    suites = {name: SUITES[name] for name in (SUITES if not quick else ("on board", SUITE))}
    bounds = results.stage("bounds", {"suites": suites}, lambda: _bounds(suites, threads))
    asked: dict[str, Any] = {"seed": SEED, "seeds": {"1": 2} if quick else {"0.3": 40, "1": 120, "3": 120}}
    noise = results.stage("noise", asked, lambda: _noise(workers=threads, **asked))
    everything = results.stage("added masses too", {"seed": SEED}, lambda: _everything(SEED, threads))

    report_runs(checks, results, runs)
    report_controls(checks, results, controls)
    report_bounds(results, bounds)
    report_noise(results, noise)
    report_everything(results, everything)
    checks.finish()


def _runs(hold: float) -> dict[str, Any]:
    """Sawtooth and spirals, in still water and in the current."""
    found = {}
    for water, current in (("still", None), ("current", CURRENT)):
        plans: dict[str, Sawtooth | GlideSpiral] = {"sawtooth": Sawtooth(DIVE, CLIMB, halves=4)}
        spirals = {
            f"spiral {rudder:g}": GlideSpiral(DIVE, (math.radians(rudder),), hold=hold, approach=20.0)
            for rudder in RUDDERS
        }
        plans.update(spirals)
        for name, plan in plans.items():
            run = system.run(plan, current)
            each = slice(None, None, 4)
            channels = ("x", "y", "z", "phi", "theta", "psi")
            found[f"{name}, {water}"] = {"t": run.t[each], **{c: run.outputs[c][each] for c in channels}}
    return found


def _controls(m_b: Sequence[float], points: int, rudders: Sequence[float]) -> dict[str, list[dict[str, float]]]:
    """L/D, glide angle and speed against the sliding mass, turning radius against the rudder; both ways."""
    glides: list[dict[str, float]] = []
    for net in m_b:
        for alpha in np.radians(np.geomspace(0.8, 8.0, points)):
            for sign in (1.0, -1.0):
                closed = system.closed_glide(sign * float(alpha), sign * net)
                trim = Trim(sign * net, closed["x_p"])
                glides.append({"m_b": trim.m_b, "alpha": sign * alpha, **closed, **_settled(trim)})
    turns = []
    for rudder in np.radians(rudders):
        row = {"rudder": float(rudder), **_settled(DIVE, float(rudder), closed_area=system.rudder_area())}
        turns.append(row | {"closed, drawn rudder": system.closed_radius(float(rudder), 0.012)})
    return {"glides": glides, "turns": turns}


def _settled(trim: Trim, rudder: float = 0.0, closed_area: float | None = None) -> dict[str, float]:
    """Figures of the last second of a run of 10 min under held controls; NaN where it does not settle."""
    plan = GlideSpiral(trim, (rudder,), hold=600.0, approach=20.0)
    nothing = {f"simulated {name}": math.nan for name in ("glide", "V", "L/D", "radius", "theta")}
    if not math.isfinite(system.steady(trim)["V"]):
        return nothing
    run = system.run(plan)
    rate = {name: float(np.diff(run.outputs[name][-5:]).mean() / system.DT) for name in ("x", "y", "z", "psi")}
    across = math.hypot(rate["x"], rate["y"])
    late = {name: float(run.outputs[name][-1]) for name in ("u", "v", "w", "theta")}
    if abs(late["theta"] - float(run.outputs["theta"][-400])) > math.radians(0.1):
        return nothing
    glide = -math.atan2(rate["z"], across)
    found = {
        "simulated glide": glide,
        "simulated V": math.sqrt(late["u"] ** 2 + late["v"] ** 2 + late["w"] ** 2),
        "simulated L/D": 1.0 / math.tan(-glide),
        "simulated theta": late["theta"],
    }
    if closed_area is not None:
        # chord of a circle against its arc: the positions of one second subtend a small angle
        found["simulated radius"] = across / abs(rate["psi"])
        found["closed, DNV rudder"] = system.closed_radius(rudder, closed_area)
    return found


def _bounds(suites: Mapping[str, Sequence[str]], threads: int) -> dict[str, Any]:
    """Bounds by design, sensors and whether the added masses are free too."""
    found = {}
    for design in DESIGNS:
        runs = system.trials_of(design.plans, threads)
        for suite, channels in suites.items():
            for free, names in (("", HYDRODYNAMIC), (", added masses free", (*HYDRODYNAMIC, *ADDED))):
                found[f"{design.name}; {suite}{free}"] = system.bound(runs, channels, names, threads)
    return found


def _noisy(runs: Sequence[Trial], seed: Sequence[int], level: float) -> list[Trial]:
    rngs = [np.random.default_rng([*seed, k]) for k in range(len(runs))]
    return [system.recorded(run, SUITES[SUITE], rng, level) for run, rng in zip(runs, rngs)]


def _noise(*, workers: int, seed: int, seeds: Mapping[str, int]) -> list[dict[str, Any]]:
    """Estimates of all coefficients and the current from sawteeth and spirals, by level and seed."""
    runs = system.trials_of(DESIGNS[-1].plans, workers)
    jobs = [(place, float(level), k) for place, (level, count) in enumerate(seeds.items()) for k in range(count)]
    some = [jobs[k::workers] for k in range(workers)] if len(jobs) > 10 else [jobs]
    parts = Parallel(n_jobs=len(some))(delayed(_estimates)(runs, part, seed) for part in some)
    rows: list[dict[str, Any]] = [row for part in parts for row in part]
    return sorted(rows, key=lambda row: (row["level"], row["seed"]))


def _estimates(runs: Sequence[Trial], jobs: Sequence[tuple[int, float, int]], seed: int) -> list[dict[str, Any]]:
    """One fit a job (place of the level, level, number of the seed), each with one thread."""
    rows: list[dict[str, Any]] = []
    for place, level, k in jobs:
        start = (0.5, 0.7, 1.6)[k % 3]
        asked = system.study(_noisy(runs, (seed, place, k), level), HYDRODYNAMIC, start_at=start, level=level)
        estimate = identify(asked, seed=seed, threads=1)
        limit = system.bound(runs, SUITES[SUITE], HYDRODYNAMIC, 1, level)["bounds"]
        table: Any = estimate.parameters
        rows.extend(
            {"level": level, "seed": k, "start": start, "coefficient": name, "ended": estimate.outcome["code"]}
            | {"error": float(table.value[name]) - KNOWN[name], "crlb": limit[name]["crlb"]}
            | {"stderr": float(table.stderr[name])}
            | {"covered": bool(table.lower[name] <= KNOWN[name] <= table.upper[name])}
            | {"verdict": table.verdict[name]}
            for name in table.index
        )
    return rows


def _everything(seed: int, threads: int) -> dict[str, Any]:
    """One fit with the added masses free too: verdicts and combinations as the software reports them."""
    runs = _noisy(system.trials_of(DESIGNS[-1].plans, threads), (seed, 99), 1.0)
    estimate = identify(system.study(runs, (*HYDRODYNAMIC, *ADDED), start_at=0.7), seed=seed, threads=threads)
    table: Any = estimate.parameters
    rows = {
        name: {"error, %": 100.0 * (table.value[name] / KNOWN[name] - 1.0), "verdict": table.verdict[name]}
        | {"standard error, %": 100.0 * table.stderr[name] / abs(KNOWN[name])}
        for name in table.index
    }
    return {"rows": rows, "weak": [entry["sentence"] for entry in estimate.identifiability["weak"]]}


if __name__ == "__main__":
    sys.exit(main("sun2019", str(__doc__).splitlines()[0], body, seeds={"noise": SEED}))
