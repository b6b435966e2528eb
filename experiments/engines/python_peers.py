"""What people write today: SciPy's adaptive solver, plain Python, NumPy over the population."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from engines.equations import rk4
from engines.workloads import Workload

Array = NDArray[np.float64]

SCALAR = SimpleNamespace(
    sin=math.sin,
    cos=math.cos,
    exp=math.exp,
    sqrt=math.sqrt,
    arctan2=math.atan2,
    minimum=min,
    maximum=max,
    where=lambda test, yes, no: yes if test else no,
)


class PlainPython:
    """Scalar RK4 in plain Python, one candidate after the other."""

    def __init__(self, workload: Workload) -> None:
        self.workload = workload

    def costs(self, theta: Array) -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        return np.array([self._cost(row) for row in theta.tolist()])

    def outputs(self, theta: Array) -> Array:
        """Simulated outputs of one candidate; shape (N, D)."""
        rows: list[tuple[float, ...]] = []
        self._cost(theta.tolist(), rows)
        return np.array(rows)[:, self.workload.observed]

    def _cost(self, theta: list[float], rows: list[tuple[float, ...]] | None = None) -> float:
        job = self.workload
        k = job.constants(job.parameters(theta))
        s = tuple(job.x0.tolist())
        measured, inputs, weights = job.measured.tolist(), job.step_inputs.tolist(), job.weights.tolist()
        observed = list(zip(job.observed, weights))
        total = 0.0
        for n, target in enumerate(measured):
            if n:
                s = rk4(SCALAR, job.rhs, s, inputs[n - 1], k, job.h)
            if rows is not None:
                rows.append(s)
            total += sum((weight * (y - s[j])) ** 2 for (j, weight), y in zip(observed, target))
        return total


class SciPy:
    """`solve_ivp` RK45 to 1e-6 with an interpolated input: the usual script."""

    def __init__(self, workload: Workload) -> None:
        self.workload = workload

    def costs(self, theta: Array) -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        return np.array([self._cost(row) for row in theta.tolist()])

    def _cost(self, theta: list[float]) -> float:
        job = self.workload
        k = job.constants(job.parameters(theta))
        held, last = job.inputs.tolist(), len(job.t) - 1

        def rhs(t: float, s: Array) -> tuple[Any, ...]:
            place = t / job.h
            n = min(int(place), last - 1)
            if job.hold == "zoh":
                now = tuple(held[n])
            else:
                part = place - n
                now = tuple(a + part * (b - a) for a, b in zip(held[n], held[n + 1]))
            return job.rhs(SCALAR, tuple(s.tolist()), now, k)

        run = solve_ivp(rhs, (0.0, job.t[-1]), job.x0, method="RK45", rtol=1e-6, atol=1e-6, t_eval=job.t)
        errors = (job.measured - run.y[job.observed].T) * job.weights
        return float(np.sum(errors * errors))


class NumPyPopulation:
    """RK4 over arrays that hold the whole population."""

    def __init__(self, workload: Workload) -> None:
        self.workload = workload

    def costs(self, theta: Array) -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        job = self.workload
        k = job.constants(job.parameters(theta.T))
        s: tuple[Any, ...] = tuple(np.full(len(theta), x) for x in job.x0)
        total = np.zeros(len(theta))
        inputs = job.step_inputs.tolist()
        for n, target in enumerate(job.measured):
            if n:
                s = rk4(np, job.rhs, s, inputs[n - 1], k, job.h)
            for j, weight, y in zip(job.observed, job.weights, target):
                total += (weight * (y - s[j])) ** 2
        return total
