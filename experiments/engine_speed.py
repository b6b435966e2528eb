"""How fast is the engine? seatruth against what people use today, and against what the machine could do at best.

    python experiments/engine_speed.py [--quick] [--workers THREADS]

Microseconds a candidate on workloads A (AUV diving plane) and B (KVLCC2 under MMG, rate-limited rudder) of
engines/workloads.py, for populations of 1, 50, 200 and 1000, each engine in a process of its own, in a fixed order.
The clock runs around the call alone, after one call for warm-up; the shortest of the repeats counts (the machine may be
shared), the median and the processor time of all threads stand beside it in the table. All engines with a fixed step
must give the same cost to 1e-10.
The peers are an optional extra (`pip install -e .[peers]`); one that is not installed is reported as such.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS, Options, Results, main, say
from provenance import machine, versions

from seatruth.errors import SeatruthError

SEED = 20260101
FIXED = ("python", "numpy", "numba", "jax", "casadi", "seatruth")
"""Engines with the same fixed step: their costs must agree."""
TITLES = {
    "scipy": "SciPy RK45, 1e-6",
    "python": "plain Python RK4",
    "numpy": "NumPy over the population",
    "numba": "Numba, prange over candidates",
    "jax": "JAX jit(vmap(scan))",
    "casadi": "CasADi",
    "diffrax": "diffrax Tsit5, 1e-6",
    "seatruth": "seatruth",
}
SERIAL = ("scipy", "python")
"""Engines that run one candidate after the other: one size is enough."""
WORKLOADS = ("A", "B")
BOUND_GOAL, SCIPY_GOAL, PEER_GOAL = {"A": 2.5, "B": 5.0}, 2000.0, 10.0
TRIALS = 5
AGREE, EQUATIONS_AGREE, SLOPES_AGREE = 1e-10, 1e-10, 1e-9


class WorkerFailed(SeatruthError):
    """An engine's process ended without an answer."""


def body(options: Options, results: Results) -> None:
    """All stages in order, then figures, tables and the picture."""
    sizes = [1, 200] if options.quick else [1, 50, 200, 1000]
    seconds = 0.1 if options.quick else 1.5
    threads = options.workers
    results.expect(4 + 2 * (len(TITLES) + 3))
    speed = _Speed(options, results, threads)
    limits = speed.task("bound", {"task": "bound", "seed": SEED, "threads": threads, "seconds": 2 * seconds})
    limit = {w: limits["operations"][w]["flops"] * 1200 / limits["peak"] * 1e6 for w in WORKLOADS}
    measured: dict[str, dict[str, Any]] = {w: {} for w in WORKLOADS}
    for name in WORKLOADS:
        _same_equations(speed, results, name)
        for engine in TITLES:
            order = {
                "task": "measure",
                "engine": engine,
                "name": name,
                "sizes": [1] if engine in SERIAL else sizes,
                "seed": SEED,
                "threads": threads,
                "seconds": seconds,
                "quick": options.quick,
            }
            measured[name][engine] = speed.task(f"{engine} {name}", order)
    several = speed.task(
        f"seatruth A, {TRIALS} trials",
        {"task": "several", "name": "A", "sizes": sizes[1:], "seed": SEED, "threads": threads, "seconds": seconds}
        | {"trials": TRIALS},
    )
    starts = {name: speed.starts(name, threads) for name in WORKLOADS}

    results.add_figure(
        "peak", limits["peak"] / 1e9, "Gflop/s", f"double precision, {threads} threads, fused multiply-add = 2 flops"
    )
    for name in WORKLOADS:
        flops = limits["operations"][name]["flops"]
        results.add_figure(f"{name}: bound", limit[name], "us/candidate", f"{flops} flops a step, 1200 steps")
        _agreement(results, name, measured[name])
        _speeds(results, name, measured[name], limit[name], sizes)
        _jacobians(results, name, measured[name])
        for key, figure in starts[name].items():
            results.add_figure(f"{name}: {key}", figure, "s")
    _several(results, several, limit["A"])
    table = _table(measured, limit)
    results.add_table("microseconds", table)
    results.add_table("operations", pd.DataFrame(limits["operations"]).rename_axis("operation").fillna(0).astype(int))
    results.add_table(
        "flops_of_functions", pd.Series(limits["costs"], name="flops").rename_axis("operation").to_frame()
    )
    results.add_picture("engine_speed", _picture(table, limit, threads))
    results.add_text(_markdown(table, limit, sizes, threads))


class _Speed:
    """Runs the engines' processes as stages; those that cannot run become a reason in words."""

    def __init__(self, options: Options, results: Results, threads: int) -> None:
        self.results = results
        self.setting = {
            "machine": {k: v for k, v in machine().items() if k in ("cpu", "cores")},
            "versions": versions(("numpy", "scipy", "numba", "jax", "diffrax", "casadi")),
            "threads": threads,
            "quick": options.quick,
        }

    def task(self, label: str, order: Mapping[str, Any]) -> Any:
        """One task in a fresh process; a mapping with "absent" says why there is no outcome."""
        peer = order.get("engine") not in (None, "seatruth")
        sources = ("experiments/engines",) if peer or order["task"] == "bound" else None
        try:
            answer = self.results.stage(label, {**order, **self.setting}, lambda: _run(order), sources=sources)
        except WorkerFailed as problem:
            say(f"  {label}: {problem.message}")
            if not peer:
                self.results.fail(f"{label}: {problem.message}")
            return {"absent": problem.message}
        return answer.get("outcome", answer)

    def starts(self, name: str, threads: int) -> dict[str, float]:
        """Compile time with an empty cache, then the same in fresh processes with the cache filled."""
        order = {"task": "start", "name": name, "seed": SEED, "threads": threads}

        def both() -> dict[str, float]:
            with tempfile.TemporaryDirectory() as empty:
                cold = _run(order, empty)["outcome"]
                warm = min((_run(order, empty)["outcome"] for _ in range(3)), key=lambda one: float(one["values_s"]))
            return {
                "import": warm["import_s"],
                "first values, cold": cold["values_s"],
                "first Jacobian, cold": cold["jacobian_s"],
                "first values, warm": warm["values_s"],
                "first Jacobian, warm": warm["jacobian_s"],
            }

        try:
            return dict(self.results.stage(f"start {name}", {**order, **self.setting}, both))
        except WorkerFailed as problem:
            self.results.fail(f"start {name}: {problem.message}")
            return {}


def _run(order: Mapping[str, Any], cache: str | None = None) -> dict[str, Any]:
    here = Path(__file__).resolve().parent
    paths = (str(here), os.environ.get("PYTHONPATH", ""))
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}
    if cache is not None:
        environment |= {"SEATRUTH_CACHE": cache, "XDG_CACHE_HOME": cache, "NUMBA_CACHE_DIR": cache}
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        command = [sys.executable, "-m", "engines.worker", json.dumps(order), str(answer)]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
        if done.returncode or not answer.exists():
            last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
            raise WorkerFailed(f"its process failed: {last.replace(str(here.parent), '')}")
        result: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
    return result


def _same_equations(speed: _Speed, results: Results, name: str) -> None:
    worst = speed.task(f"equations {name}", {"task": "equations", "name": name, "seed": SEED})
    if isinstance(worst, dict):
        results.add_figure(f"{name}: equations differ", None, "1", worst["absent"])
        return
    results.add_figure(
        f"{name}: equations differ",
        worst,
        "1",
        "peers' right-hand side against seatruth's model, largest relative difference",
        goal=f"<= {EQUATIONS_AGREE:g}",
        met=worst <= EQUATIONS_AGREE,
    )
    if worst > EQUATIONS_AGREE:
        raise SeatruthError(f"workload {name}: the peers' equations differ from seatruth's model by {worst:.1e}")


def _agreement(results: Results, name: str, outcomes: Mapping[str, Any]) -> None:
    reference = np.array(outcomes["python"]["costs"])
    for engine, outcome in outcomes.items():
        if "absent" in outcome or engine == "python":
            continue
        apart = float(np.max(np.abs(np.array(outcome["costs"]) / reference - 1.0)))
        note = "largest relative difference of 8 costs from plain Python RK4"
        if engine not in FIXED:
            results.add_figure(f"{name}: {engine} cost differs", apart, "1", note + " (its own adaptive steps)")
            continue
        results.add_figure(f"{name}: {engine} cost differs", apart, "1", note, goal=f"<= {AGREE:g}", met=apart <= AGREE)
        if not apart <= AGREE:
            raise SeatruthError(f"workload {name}: {engine} differs from plain Python in the cost by {apart:.1e}")


def _speeds(results: Results, name: str, outcomes: Mapping[str, Any], limit: float, sizes: list[int]) -> None:
    scipy = _microseconds(outcomes["scipy"], 1)
    for size in sizes:
        ours = _microseconds(outcomes["seatruth"], size)
        label, why = f"{name}, P={size}", outcomes["seatruth"].get("absent", "")
        results.add_figure(f"{label}: seatruth", ours, "us/candidate", why)
        peers = {e: _microseconds(o, size) for e, o in outcomes.items() if e not in ("seatruth", *SERIAL)}
        usable = {engine: us for engine, us in peers.items() if us is not None}
        if ours is None or size < 200:
            continue
        ratio = ours / limit
        goal = BOUND_GOAL[name]
        results.add_figure(f"{label}: over the bound", ratio, "x", goal=f"<= {goal:g}", met=ratio <= goal)
        if scipy is not None:
            gain = scipy / ours
            results.add_figure(f"{label}: scipy", gain, "x slower", goal=f">= {SCIPY_GOAL:g}", met=gain >= SCIPY_GOAL)
        best = min(usable, key=lambda e: usable[e])
        gain, absent = usable[best] / ours, [TITLES[e] for e, us in peers.items() if us is None]
        note = TITLES[best] + (f"; not measured: {', '.join(absent)}" if absent else "")
        results.add_figure(
            f"{label}: best peer",
            gain,
            "x slower",
            note,
            goal=f">= {PEER_GOAL:g}",
            met=None if absent else gain >= PEER_GOAL,
        )


def _jacobians(results: Results, name: str, outcomes: Mapping[str, Any]) -> None:
    with_slopes = {e: o for e, o in outcomes.items() if o.get("jacobian")}
    for engine, outcome in with_slopes.items():
        shape = " x ".join(map(str, outcome["slopes_shape"]))
        results.add_figure(f"{name}: Jacobian, {engine}", outcome["jacobian"]["min_s"] * 1e3, "ms", shape)
    if "seatruth" not in with_slopes:
        return
    ours = np.array(with_slopes["seatruth"]["slopes"])
    for engine in (e for e in with_slopes if e != "seatruth"):
        theirs = np.array(with_slopes[engine]["slopes"])
        apart = float(np.max(np.abs(ours - theirs).max(axis=(0, 1)) / np.abs(theirs).max(axis=(0, 1))))
        results.add_figure(
            f"{name}: Jacobian differs from {engine}",
            apart,
            "1",
            goal=f"<= {SLOPES_AGREE:g}",
            met=apart <= SLOPES_AGREE,
        )


def _several(results: Results, several: Mapping[str, Any], limit: float) -> None:
    if "absent" in several:
        results.add_figure(f"A, {TRIALS} trials: seatruth", None, "us/candidate-trial", several["absent"])
        return
    for size, clock in several.items():
        label, us = f"A, {TRIALS} trials, free initial states, P={size}", clock["min_s"] / int(size) / TRIALS * 1e6
        ratio, goal = us / limit, BOUND_GOAL["A"]
        results.add_figure(f"{label}: seatruth", us, "us/candidate-trial")
        results.add_figure(f"{label}: over the bound", ratio, "x", goal=f"<= {goal:g}", met=ratio <= goal)


def _microseconds(outcome: Mapping[str, Any], size: int, which: str = "min_s") -> float | None:
    clock = outcome.get("timings", {}).get(str(size))
    return None if clock is None else clock[which] / size * 1e6


def _table(measured: Mapping[str, Mapping[str, Any]], limit: Mapping[str, float]) -> pd.DataFrame:
    rows = []
    for name, outcomes in measured.items():
        for engine, outcome in outcomes.items():
            fixed = {"workload": name, "engine": engine, "threads": outcome.get("threads")}
            if "absent" in outcome:
                rows.append({**fixed, "note": outcome["absent"]})
            for size, clock in outcome.get("timings", {}).items():
                us = clock["min_s"] / int(size) * 1e6
                rows.append(
                    {
                        **fixed,
                        "P": int(size),
                        "us_min": us,
                        "us_median": clock["median_s"] / int(size) * 1e6,
                        "us_processor": clock["processor_s"] / int(size) * 1e6,
                        "repeats": clock["repeats"],
                        "over_bound": us / limit[name],
                        "note": clock["form"],
                    }
                )
    table = pd.DataFrame(rows)
    return table.astype({"P": "Int64", "threads": "Int64", "repeats": "Int64"})


def _picture(table: pd.DataFrame, limit: Mapping[str, float], threads: int) -> Any:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.6), sharey=True, layout="constrained")
    for axis, name in zip(axes, WORKLOADS):
        for engine, colour, marker in zip(TITLES, (*COLOURS[1:], COLOURS[0]), "osvPD^Xo"):
            rows = table[(table.workload == name) & (table.engine == engine) & table.P.notna()]
            if rows.empty:
                continue
            P, us = rows.P.to_numpy(dtype=float), rows.us_min.to_numpy(dtype=float)
            bold = 2.6 if engine == "seatruth" else 1.2
            axis.plot(P, us, marker=marker, color=colour, lw=bold, label=TITLES[engine])
            if engine in SERIAL:
                axis.axhline(us[0], color=colour, lw=0.8, ls=":")
        axis.axhline(limit[name], color="0.3", ls="--", lw=1.2, label="bound: counted flops over peak")
        axis.set(xscale="log", yscale="log", xlabel="candidates in one call", title=f"Workload {name}")
        axis.grid(True, which="major", alpha=0.3)
    axes[0].set_ylabel(f"time a candidate (us), {threads} threads")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _markdown(table: pd.DataFrame, limit: Mapping[str, float], sizes: list[int], threads: int) -> str:
    head = "| engine | threads | " + " | ".join(f"{w}: P={p}" for w in WORKLOADS for p in sizes) + " |"
    lines = [head, "|---" * (2 + 2 * len(sizes)) + "|"]
    for engine, title in TITLES.items():
        rows = table[table.engine == engine]
        cells = []
        for name in WORKLOADS:
            mine = rows[rows.workload == name]
            for size in sizes:
                hit = mine[size == mine.P]
                blank = "" if mine.P.notna().any() else str(mine.note.iloc[0]) if size == sizes[0] else ""
                cells.append(blank if hit.empty else f"{hit.us_min.iloc[0]:.3g}")
        used = rows.threads.dropna()
        lines.append(f"| {title} | {'' if used.empty else used.iloc[0]} | {' | '.join(cells)} |")
    bounds = [f"{limit[w]:.3g}" if p == sizes[0] else "" for w in WORKLOADS for p in sizes]
    lines.append(f"| bound: counted flops over measured peak | {threads} | {' | '.join(bounds)} |")
    return (
        "Microseconds a candidate, shortest of the repeats. SciPy and plain Python run one candidate after the other, "
        "so their figure holds for every P. Numba, JAX and diffrax: the best of their forms; CasADi: compiled C code "
        "where there is a compiler. What the bound counts stands at the top of `experiments/engines/flops.py`.\n\n"
        + "\n".join(lines)
    )


if __name__ == "__main__":
    sys.exit(main("engine_speed", str(__doc__).splitlines()[0], body, seeds={"workloads and candidates": SEED}))
