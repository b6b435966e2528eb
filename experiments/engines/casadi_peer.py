"""CasADi: the whole simulation as one function, compiled to C where there is a compiler, mapped over threads."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engines.equations import rk4
from engines.workloads import Workload

Array = NDArray[np.float64]


class Casadi:
    """RK4 step in scalar expressions (SX), folded over the samples, as C code (gcc -O3 -march=native -ffast-math)."""

    def __init__(self, workload: Workload, threads: int, folder: Path) -> None:
        import casadi

        self.ca, self.workload, self.threads, self.folder = casadi, workload, threads, folder
        self.compiler = shutil.which("gcc") or shutil.which("clang") or shutil.which("cc")
        self._xp = SimpleNamespace(
            sin=casadi.sin,
            cos=casadi.cos,
            exp=casadi.exp,
            sqrt=casadi.sqrt,
            arctan2=casadi.atan2,
            minimum=casadi.fmin,
            maximum=casadi.fmax,
            where=casadi.if_else,
        )
        self._one = self._compiled(self._cost_function())
        self._mapped: dict[int, Any] = {}
        self._slopes: Any = None

    def costs(self, theta: Array) -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        size = len(theta)
        if size not in self._mapped:
            self._mapped[size] = self._one if size == 1 else self._one.map(size, "thread", min(self.threads, size))
        return np.asarray(self._mapped[size](theta.T)).ravel()

    def jacobian(self, theta: Array) -> Array:
        """Derivatives of all outputs; shape (N - 1, D, K)."""
        if self._slopes is None:
            self._slopes = self._compiled(self._slope_function())
        job = self.workload
        flat = np.asarray(self._slopes(theta))
        return flat.T.reshape(len(job.t) - 1, len(theta), len(job.observed)).transpose(0, 2, 1)

    def _step(self) -> tuple[Any, Any, Any, Any]:
        """Symbols of state, parameters and inputs (start, middle, end), and the state after one step."""
        ca, job = self.ca, self.workload
        s, theta = ca.SX.sym("s", len(job.x0)), ca.SX.sym("theta", len(job.free))
        width = job.inputs.shape[1]
        given = ca.SX.sym("i", 3 * width)
        stages = [tuple(given[stage * width + n] for n in range(width)) for stage in range(3)]
        k = job.constants(job.parameters([theta[n] for n in range(len(job.free))]))
        states = tuple(s[n] for n in range(len(job.x0)))
        after = rk4(self._xp, job.rhs, states, (stages[0], stages[1], stages[2]), k, job.h)
        return s, theta, given, ca.vertcat(*after)

    def _cost_function(self) -> Any:
        ca, job = self.ca, self.workload
        s, theta, given, after = self._step()
        total, y = ca.SX.sym("total"), ca.SX.sym("y", len(job.observed))
        error = sum((w * (y[n] - after[j])) ** 2 for n, (j, w) in enumerate(zip(job.observed, job.weights)))
        one = ca.Function(
            "step",
            [ca.vertcat(s, total), theta, given, y],
            [ca.vertcat(after, total + error)],
            {"cse": True},
        )
        steps = len(job.t) - 1
        free = ca.MX.sym("theta", len(job.free))
        start = float(np.sum(((job.measured[0] - job.x0[job.observed]) * job.weights) ** 2))
        first = ca.DM([*job.x0.tolist(), start])
        end = one.fold(steps)(first, ca.repmat(free, 1, steps), self._inputs(), ca.DM(job.measured[1:].T))
        return ca.Function("cost", [free], [end[-1]])

    def _slope_function(self) -> Any:
        """Outputs' derivatives through the step's own derivatives (variational equations of the RK4 map)."""
        ca, job = self.ca, self.workload
        s, theta, given, after = self._step()
        slope = ca.SX.sym("slope", len(job.x0), len(job.free))
        along = ca.mtimes(ca.jacobian(after, s), slope) + ca.jacobian(after, theta)
        both = ca.SX.sym("both", len(job.x0) * (1 + len(job.free)))
        parts = [both[: len(job.x0)], ca.reshape(both[len(job.x0) :], *slope.shape)]
        new = ca.substitute([ca.vertcat(after, ca.vec(along))], [s, slope], parts)[0]
        observed = ca.vec(along[list(job.observed), :])
        seen = ca.substitute([observed], [s, slope], parts)[0]
        one = ca.Function("step", [both, theta, given], [new, seen], {"cse": True})
        steps = len(job.t) - 1
        free = ca.MX.sym("theta", len(job.free))
        first = ca.DM(job.x0.tolist() + [0.0] * (len(job.x0) * len(job.free)))
        _, rows = one.mapaccum(steps)(first, ca.repmat(free, 1, steps), self._inputs())
        return ca.Function("slopes", [free], [rows])

    def _inputs(self) -> Any:
        stages = self.workload.step_inputs
        return self.ca.DM(stages.reshape(len(stages), -1).T)

    def _compiled(self, function: Any) -> Any:
        if self.compiler is None:
            return function
        name = function.name()
        source, library = self.folder / f"{name}.c", self.folder / f"{name}.so"
        generator = self.ca.CodeGenerator(source.name)
        generator.add(function)
        generator.generate(f"{self.folder}/")
        flags = ["-O3", "-march=native", "-ffast-math", "-fPIC", "-shared"]
        subprocess.run([self.compiler, *flags, str(source), "-o", str(library), "-lm"], check=True, capture_output=True)
        return self.ca.external(name, str(library))
