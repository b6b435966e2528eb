"""One engine on one workload in a process of its own: `python -m engines.worker '{"task": ...}'` prints JSON.

A process each keeps the engines from sharing threads or memory, measures imports and compilation as a user meets them,
and lets a peer that is not installed, or that dies, cost only its own row. The clock runs around the call alone.
"""

from __future__ import annotations

import importlib.util
import json
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engines.workloads import workload

Array = NDArray[np.float64]
NEEDS = {"jax": ("jax",), "diffrax": ("jax", "diffrax"), "casadi": ("casadi",), "numba": ("numba",)}
CHECKED = 8
"""Candidates whose costs are compared between engines."""


def clocked(call: Callable[[], Any], seconds: float, least: int = 3) -> dict[str, float]:
    """Repeats a call (after one for warm-up) for about that long: shortest and median time, and how often.

    `processor_s` is the least processor time of a call, all threads together: what a busy machine disturbs least.
    """
    call()
    times: list[float] = []
    processor: list[float] = []
    while len(times) < least or (sum(times) < seconds and len(times) < 200):
        begin, busy = time.perf_counter(), time.process_time()
        call()
        times.append(time.perf_counter() - begin)
        processor.append(time.process_time() - busy)
    return {
        "min_s": min(times),
        "median_s": statistics.median(times),
        "processor_s": min(processor),
        "repeats": len(times),
    }


def measure(
    engine: str, name: str, sizes: list[int], seed: int, threads: int, seconds: float, quick: bool
) -> dict[str, Any]:
    """Costs of the first candidates, times for each population and form, and the Jacobian where there is one."""
    job = workload(name, seed)
    theta = job.population(max(*sizes, CHECKED), seed)
    with tempfile.TemporaryDirectory() as scratch:
        begin = time.perf_counter()
        subject, used, forms = _build(engine, job, threads, seed, Path(scratch))
        built = time.perf_counter() - begin
        forms, least = (forms[1:2] or forms, 1) if quick else (forms, 3)
        begin = time.perf_counter()
        costs = _caller(subject, forms[0])(theta[:CHECKED])
        first = time.perf_counter() - begin
        timings: dict[str, Any] = {}
        for size in sizes:
            tried = {}
            for form in forms if size >= threads else [f for f in forms if "split" not in f] or forms[:1]:
                tried[form] = clocked(partial(_caller(subject, form), theta[:size]), seconds, least)
            best = min(tried, key=lambda form: tried[form]["min_s"])
            timings[str(size)] = {**tried[best], "form": best}
        slopes = (
            clocked(lambda: subject.jacobian(job.nominal), seconds, least) if hasattr(subject, "jacobian") else None
        )
        values = subject.jacobian(job.nominal) if slopes else None
    return {
        "threads": used,
        "build_s": built,
        "first_call_s": first,
        "costs": costs.tolist(),
        "timings": timings,
        "jacobian": slopes,
        "slopes": None if values is None else values[:: max(1, len(values) // 20)].tolist(),
        "slopes_shape": None if values is None else list(values.shape),
    }


def several(name: str, sizes: list[int], seed: int, threads: int, seconds: float, trials: int) -> dict[str, Any]:
    """seatruth on several trials, each candidate with initial states of its own."""
    from engines.seatruth_engine import Seatruth

    subject = Seatruth(workload(name, seed), threads, seed, trials)
    theta = subject.job.population(max(sizes), seed)
    x0 = subject.initial_states(max(sizes), seed)
    return {str(n): clocked(partial(subject.costs_from, theta[:n], x0[:n]), seconds) for n in sizes}


def start(name: str, seed: int, threads: int) -> dict[str, float]:
    """Import, building the simulator, and the first call of values and of derivatives, in this process."""
    begin = time.perf_counter()
    import seatruth.simulate  # noqa: F401

    imported = time.perf_counter()
    from engines.seatruth_engine import Seatruth

    job = workload(name, seed)
    theta = job.population(8, seed)
    ready = time.perf_counter()
    subject = Seatruth(job, threads, seed)
    subject.costs(theta)
    valued = time.perf_counter()
    subject.jacobian(job.nominal)
    derived = time.perf_counter()
    return {"import_s": imported - begin, "values_s": valued - ready, "jacobian_s": derived - valued}


def bound(seed: int, threads: int, seconds: float) -> dict[str, Any]:
    """Counted operations of both workloads and the machine's measured peak."""
    from engines.flops import COSTS, count, matrix_peak, peak

    return {
        "operations": {name: count(workload(name, seed)) for name in ("A", "B")},
        "peak": max(peak(threads, seconds), matrix_peak(seconds)),
        "costs": COSTS,
    }


def equations(name: str, seed: int) -> float:
    """Largest relative difference between the peers' equations and seatruth's model."""
    from engines.seatruth_engine import difference_of_equations

    return difference_of_equations(workload(name, seed), seed)


def _build(engine: str, job: Any, threads: int, seed: int, scratch: Path) -> tuple[Any, int, list[str]]:
    if engine in ("scipy", "python", "numpy"):
        from engines.python_peers import NumPyPopulation, PlainPython, SciPy

        return {"scipy": SciPy, "python": PlainPython, "numpy": NumPyPopulation}[engine](job), 1, [""]
    if engine in ("jax", "diffrax"):
        from engines.jax_peers import Diffrax, Jax

        subject: Any = (Jax if engine == "jax" else Diffrax)(job, threads)
        return subject, threads, list(subject.forms)
    if engine == "numba":
        from engines.numba_peer import Numba

        subject = Numba(job, threads)
        return subject, threads, list(subject.forms)
    if engine == "casadi":
        from engines.casadi_peer import Casadi

        subject = Casadi(job, threads, scratch)
        return subject, threads, ["C code" if subject.compiler else "interpreted"]
    from engines.seatruth_engine import Seatruth

    return Seatruth(job, threads, seed), threads, [""]


def _caller(subject: Any, form: str) -> Callable[[Array], Array]:
    if hasattr(subject, "forms"):
        return lambda theta: np.asarray(subject.costs(theta, form))
    return lambda theta: np.asarray(subject.costs(theta))


TASKS: dict[str, Callable[..., Any]] = {
    "measure": measure,
    "several": several,
    "start": start,
    "bound": bound,
    "equations": equations,
}


def run(order: dict[str, Any]) -> dict[str, Any]:
    """Does one task; a peer that is not installed is an answer, not an error."""
    missing = [p for p in NEEDS.get(order.get("engine", ""), ()) if importlib.util.find_spec(p) is None]
    if missing:
        return {"absent": f"not installed: {', '.join(missing)}"}
    return {"outcome": TASKS[order.pop("task")](**order)}


if __name__ == "__main__":
    answer = run(json.loads(sys.argv[1]))
    Path(sys.argv[2]).write_text(json.dumps(answer), encoding="utf-8")
