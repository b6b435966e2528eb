"""The lower bound that engines are held against: counted floating-point operations over the machine's measured peak.

What is counted. One RK4 step and its cost update are run on numbers that record every operation (`count`). Counted is
only what must be done for each candidate at each step: operations on parameters alone (once a candidate) and on inputs
or records alone (once for all candidates) are left out, and an expression met twice within a step counts once. A
multiply and an add are one flop each, so a fused multiply-add is two, as in the peak. Functions cost the flops of their
shortest branch-free double-precision evaluation (`COSTS`): seeds and Newton steps for division and square root,
argument reduction plus polynomial for the others. Loads, stores and sign changes are free. The bound is
flops x steps / peak, the peak being the fused multiply-adds a second that all cores sustain together (`peak`).
"""

from __future__ import annotations

import math
import time
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np

from engines.equations import rk4
from engines.workloads import Workload

COSTS: dict[str, int] = {
    "add": 1,
    "mul": 1,
    "neg": 0,  # a sign folds into the next multiply-add
    "abs": 1,
    "compare": 1,
    "select": 1,
    "min or max": 1,
    "div": 13,  # estimate, two Newton steps of two FMA, quotient, residual FMA, correction FMA
    "sqrt": 14,  # estimate, two Newton steps of five, one correction of four
    "reduce": 8,  # multiple of pi/2: multiply, round, three FMA; shared by sine and cosine of one angle
    "sin": 16,  # polynomial to degree 13 (square, six FMA, product), quadrant select and sign
    "cos": 16,
    "exp": 29,  # multiply, round, two FMA, polynomial to degree 11 (eleven FMA), scale
    "atan2": 50,  # division, polynomial of sixteen FMA, five for the octants
}
_CANDIDATE, _TIME = 1, 2


class Number:
    """A float that records what is done with it on its tape."""

    def __init__(self, tape: Tape, value: float, varies: int, key: int) -> None:
        self.tape, self.value, self.varies, self.key = tape, value, varies, key

    def __add__(self, other: Any) -> Number:
        return self.tape.do("add", lambda a, b: a + b, self, other, commutes=True)

    def __sub__(self, other: Any) -> Number:
        return self.tape.do("add", lambda a, b: a - b, self, other, tag="sub")

    def __rsub__(self, other: Any) -> Number:
        return self.tape.do("add", lambda a, b: b - a, self, other, tag="rsub")

    def __mul__(self, other: Any) -> Number:
        return self.tape.do("mul", lambda a, b: a * b, self, other, commutes=True)

    def __truediv__(self, other: Any) -> Number:
        return self.tape.do("div", lambda a, b: a / b, self, other)

    def __rtruediv__(self, other: Any) -> Number:
        return self.tape.do("div", lambda a, b: b / a, self, other, tag="rdiv")

    def __pow__(self, power: int) -> Number:
        result = self
        for _ in range(power - 1):
            result = result * self
        return result

    def __neg__(self) -> Number:
        return self.tape.do("neg", lambda a: -a, self)

    def __abs__(self) -> Number:
        return self.tape.do("abs", abs, self)

    def __gt__(self, other: Any) -> Number:
        return self.tape.do("compare", lambda a, b: float(a > b), self, other)

    __radd__, __rmul__ = __add__, __mul__


class Tape:
    """Counts operations by kind, each distinct expression once."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._known: dict[tuple[Any, ...], Number] = {}
        self._next = 0
        self.xp = SimpleNamespace(
            sin=lambda a: self._turned("sin", math.sin, a),
            cos=lambda a: self._turned("cos", math.cos, a),
            exp=lambda a: self.do("exp", math.exp, a),
            sqrt=lambda a: self.do("sqrt", math.sqrt, a),
            arctan2=lambda a, b: self.do("atan2", math.atan2, a, b),
            minimum=lambda a, b: self.do("min or max", min, a, b, tag="min"),
            maximum=lambda a, b: self.do("min or max", max, a, b, tag="max"),
            where=lambda test, yes, no: self.do("select", lambda t, a, b: a if t else b, test, yes, no),
        )

    def number(self, value: float, varies: int) -> Number:
        """A new independent number that varies with the candidate, with time, or with both."""
        self._next += 1
        return Number(self, value, varies, self._next)

    def do(self, kind: str, function: Any, *given: Any, commutes: bool = False, tag: str = "") -> Number:
        """Applies an operation and counts it, unless it was done before or can be hoisted."""
        values = [g.value if isinstance(g, Number) else float(g) for g in given]
        keys = [g.key if isinstance(g, Number) else ("constant", float(g)) for g in given]
        place = (tag or kind, *(sorted(keys, key=repr) if commutes else keys))
        if place not in self._known:
            varies = 0
            for g in given:
                varies |= g.varies if isinstance(g, Number) else 0
            self._known[place] = self.number(function(*values), varies)
            if varies == _CANDIDATE | _TIME:
                self.counts[kind] += 1
        return self._known[place]

    def _turned(self, kind: str, function: Any, angle: Any) -> Number:
        self.do("reduce", lambda a: a, angle)
        return self.do(kind, function, angle)


def count(job: Workload) -> dict[str, int]:
    """Operations of one RK4 step and its cost update, by kind; "flops" is their sum at `COSTS`."""
    tape = Tape()

    def constant(value: Any) -> Any:
        return tuple(map(constant, value)) if isinstance(value, tuple) else tape.number(float(value), _CANDIDATE)

    k = job.constants(job.parameters(job.nominal.tolist()))
    k = SimpleNamespace(**{name: constant(value) for name, value in vars(k).items()})
    middle = len(job.t) // 2 + 7
    s = tuple(tape.number(float(x) + 0.01, _CANDIDATE | _TIME) for x in job.x0)
    stages = job.step_inputs[middle]
    now: list[tuple[Number, ...]] = []
    for n, stage in enumerate(stages):
        same = [m for m in range(n) if np.array_equal(stages[m], stage)]
        now.append(now[same[0]] if same else tuple(tape.number(float(x), _TIME) for x in stage))
    s = rk4(tape.xp, job.rhs, s, (now[0], now[1], now[2]), k, job.h)
    total = tape.number(0.0, _CANDIDATE | _TIME)
    for j, weight, y in zip(job.observed, job.weights, job.measured[middle]):
        error = (tape.number(float(y), _TIME) - s[j]) * float(weight)
        total = total + error * error
    flops = sum(COSTS[kind] * times for kind, times in tape.counts.items())
    return {**dict(sorted(tape.counts.items())), "flops": flops}


@numba.njit(fastmath=True, parallel=True)
def _multiply_add(data: Any, rounds: int) -> None:
    for core in numba.prange(data.shape[0]):
        row = data[core]
        for _ in range(rounds):
            for n in range(row.shape[0]):
                x = row[n]
                y = x
                for _ in range(32):  # a chain; independent elements overlap in the pipeline
                    y = y * x + 0.5
                row[n] = y * 1e-3


def peak(threads: int, seconds: float = 1.0) -> float:
    """Flops a second of fused multiply-adds in double precision on `threads` cores together; the best of the runs."""
    numba.set_num_threads(threads)
    data, rounds = np.full((threads, 1024), 0.3), 300
    _multiply_add(data, 1)
    best, begin = math.inf, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        start = time.perf_counter()
        _multiply_add(data, rounds)
        best = min(best, time.perf_counter() - start)
    return data.size * rounds * 65 / best


def matrix_peak(seconds: float = 1.0) -> float:
    """Flops a second of NumPy's matrix product, the other way to find a machine's peak."""
    a = np.random.default_rng(0).normal(size=(1536, 1536))
    best, begin = math.inf, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        start = time.perf_counter()
        a @ a
        best = min(best, time.perf_counter() - start)
    return 2.0 * 1536**3 / best
