"""Numba: the same RK4 steps compiled by LLVM from Python source, candidates over all cores.

Two forms, of which the faster one counts: "scalar" (one candidate after the other, `prange` over candidates) and
"lanes" (blocks of eight candidates whose innermost loop LLVM may turn into vector instructions; it does so only where
Intel's SVML library, package icc_rt, gives it vector forms of sine and exponential). The step is written out state by
state, as Numba compiles tuples best that way; the equations themselves are those of every peer. Parameters become
dimensional coefficients by NumPy over the whole population, before the compiled call. Numba has no derivatives.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from engines.workloads import Workload

Array = NDArray[np.float64]
LANES = 8

_SOURCE = """
def step(s, a, b, c, k, h):
    k1 = rhs(xp, s, a, k)
    k2 = rhs(xp, ({half_1}), b, k)
    k3 = rhs(xp, ({half_2}), b, k)
    k4 = rhs(xp, ({full_3}), c, k)
    return ({total})

step = njit(step)

def scalar(table, x0, inputs, measured, weights, h):
    costs = np.zeros(len(table))
    for row in prange(len(table)):
        k = K({constants_of_row})
        s = ({initial})
        cost = {error_0}
        for n in range(1, len(measured)):
            s = step(s, {stages}, k, h)
            cost += {error_n}
        costs[row] = cost
    return costs

def lanes(table, x0, inputs, measured, weights, h):
    costs = np.zeros((len(table), {lanes}))
    for block in prange(len(table)):
        x = np.empty(({size}, {lanes}))
        for lane in range({lanes}):
            s = ({initial})
            costs[block, lane] = {error_0}
            {store}
        for n in range(1, len(measured)):
            for lane in range({lanes}):
                k = K({constants_of_lane})
                s = step(({load}), {stages}, k, h)
                costs[block, lane] += {error_n}
                {store}
    return costs
"""


class Numba:
    """RK4 by Numba; see the module for the forms."""

    forms = ("lanes", "scalar")

    def __init__(self, workload: Workload, threads: int) -> None:
        numba.set_num_threads(threads)
        self.workload = workload
        job = workload
        self._calls = _compiled(job, vars(job.constants(job.parameters(job.nominal))))
        self._rest = (job.x0, job.step_inputs, job.measured, job.weights, job.h)

    def costs(self, theta: Array, form: str = "scalar") -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        table = self._table(theta)
        if form == "scalar":
            return np.asarray(self._calls[form](table, *self._rest))
        pad = -len(table) % LANES
        whole = np.concatenate([table, table[:1].repeat(pad, axis=0)])
        blocks = np.ascontiguousarray(whole.reshape(-1, LANES, table.shape[1]).transpose(0, 2, 1))
        return np.asarray(self._calls[form](blocks, *self._rest)).ravel()[: len(theta)]

    def _table(self, theta: Array) -> Array:
        """Dimensional coefficients of every candidate; shape (P, coefficients)."""
        job = self.workload
        constants = vars(job.constants(job.parameters(theta.T)))
        columns = [x for value in constants.values() for x in (value if isinstance(value, tuple) else (value,))]
        return np.stack([np.broadcast_to(np.asarray(x, dtype=np.float64), len(theta)) for x in columns], axis=1)


def _functions(options: dict[str, Any]) -> ModuleType:
    """The functions of the equations on numbers. NumPy's own `where`, `minimum` and `maximum` make arrays of them."""
    xp = ModuleType("xp")
    vars(xp).update(sin=math.sin, cos=math.cos, exp=math.exp, sqrt=math.sqrt, arctan2=math.atan2)
    for name, function in (
        ("minimum", lambda a, b: min(a, b)),
        ("maximum", lambda a, b: max(a, b)),
        ("where", lambda test, yes, no: yes if test else no),
    ):
        setattr(xp, name, numba.njit(function, **options))
    return xp


def _compiled(job: Workload, constants: dict[str, Any]) -> dict[str, Callable[..., Any]]:
    size, inputs = len(job.x0), job.inputs.shape[1]

    def per_state(pattern: str) -> str:
        return ", ".join(pattern.format(j=j) for j in range(size)) + ","

    def rebuilt(pattern: str) -> str:
        """The coefficients from one row of the table, nested as `constants` has them."""
        parts, column = [], 0
        for value in constants.values():
            width = len(value) if isinstance(value, tuple) else 1
            items = [pattern.format(n=column + n) for n in range(width)]
            parts.append(f"({', '.join(items)},)" if isinstance(value, tuple) else items[0])
            column += width
        return ", ".join(parts)

    def error(row: str) -> str:
        return " + ".join(f"(weights[{d}] * (measured[{row}, {d}] - s[{j}])) ** 2" for d, j in enumerate(job.observed))

    stages = ", ".join(f"({', '.join(f'inputs[n - 1, {q}, {i}]' for i in range(inputs))},)" for q in range(3))
    source = _SOURCE.format(
        half_1=per_state("s[{j}] + 0.5 * h * k1[{j}]"),
        half_2=per_state("s[{j}] + 0.5 * h * k2[{j}]"),
        full_3=per_state("s[{j}] + h * k3[{j}]"),
        total=per_state("s[{j}] + (h / 6.0) * (k1[{j}] + 2.0 * (k2[{j}] + k3[{j}]) + k4[{j}])"),
        constants_of_row=rebuilt("table[row, {n}]"),
        constants_of_lane=rebuilt("table[block, {n}, lane]"),
        initial=per_state("x0[{j}]"),
        load=per_state("x[{j}, lane]"),
        store="; ".join(f"x[{j}, lane] = s[{j}]" for j in range(size)),
        error_0=error("0"),
        error_n=error("n"),
        stages=stages,
        size=size,
        lanes=LANES,
    )
    options: dict[str, Any] = {"fastmath": True, "error_model": "numpy"}
    names: dict[str, Any] = {
        "np": np,
        "xp": _functions(options),
        "prange": numba.prange,
        "njit": numba.njit(forceinline=True, **options),
        "rhs": numba.njit(job.rhs, forceinline=True, **options),
        "K": namedtuple("K", list(constants)),
    }
    exec(source, names)
    return {form: numba.njit(names[form], parallel=True, **options) for form in Numba.forms}
