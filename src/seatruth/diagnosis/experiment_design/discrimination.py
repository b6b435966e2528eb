"""What a further trial would add to the distances between surviving causes.

lambda of a true cause to a rival is the squared norm that a refit of the rival and all coefficients leaves of the
noise-free difference between the two fitted models, under the priors. That difference is of two simulations, about
points to which each hypothesis was refitted: what a refit has absorbed of a signature is out of it already, however the
model bends.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array, Flags
from seatruth.diagnosis.discrepancy.score_test import Probes
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.posterior import UNKNOWN
from seatruth.diagnosis.problem import WIDER
from seatruth.simulate import Simulator, simulator
from seatruth.trials.trial import Trial

Table = dict[tuple[str, str], float]
"""lambda by (true cause, what is fitted in its place)."""
_LEAST = 1e-3
_SIZE = 2.0
"""Whitened squared size below which a fitted effect is next to nothing, and its typical magnitude stands for it."""
_FREE = ("x", "y", "psi")
"""Outputs that grow with time, and that no motion depends on but by what is around."""
_BEYOND = 2.0
"""Widths of what was recorded by which the other outputs may leave it; depth by half of what it usually was, too."""


@dataclass(frozen=True)
class _Normal:
    """|e + S d|^2 with priors, as a quadratic of the step d of what all trials share: G (n, n), g (n,), c."""

    G: Array
    g: Array
    c: float

    def least(self) -> float:
        return max(0.0, self.c - float(self.g @ np.linalg.solve(self.G, self.g)))

    def plus(self, other: _Normal) -> _Normal:
        return _Normal(self.G + other.G, self.g + other.g, self.c + other.c)


@dataclass(frozen=True)
class _True:
    """A cause taken for the true one: x, terms that are missing in the equations beside it, whitened errors there."""

    x: Array
    errors: Array
    terms: Mapping[str, float]


class Rivals:
    """The survivors with their chances, and the distances of each pair on the recorded trials (`before`).

    `unnamed` are probes at the model without effects: their best formula stands for a cause that has no name. It can be
    the true one, but nothing can be fitted in place of another.
    """

    def __init__(self, search: Search, chances: Mapping[str, float], unnamed: Probes | None = None) -> None:
        self.search, self.problem, self.unnamed = search, search.problem, unnamed
        named = {n: p for n, p in chances.items() if (n,) in search.fits and np.isfinite(search.fits[(n,)].cost)}
        self.fits = {name: search.fits[(name,)] for name in named}
        self.true = {name: self._true(name) for name in named}
        self.chances = dict(named)
        formula = self._formula() if UNKNOWN in chances and unnamed is not None else None
        if formula is not None:
            self.true[UNKNOWN], self.chances[UNKNOWN] = formula, chances[UNKNOWN]
        part = self.problem.part(self.problem.active(list(named)))
        self.space, self.model = part.cost.space, part.cost.problem.model
        self.own = part.columns[: len(self.space.free)]
        self.shared = {name: np.setdiff1d(fit.active, self.problem.initial) for name, fit in self.fits.items()}
        self.ranges = self._ranges()
        self.old = {(s, r): self._old(s, r) for s in self.true for r in named if s != r}
        self.before = {pair: normal.least() for pair, normal in self.old.items()}

    def mean(self, values: Mapping[str, float]) -> float:
        """Mean over the survivors that have rivals, by their probability."""
        total = sum(self.chances[name] for name in values)
        return sum(self.chances[name] * value for name, value in values.items()) / total

    def gains(self, after: Table) -> dict[str, float]:
        """Factor by which lambda to the nearest rival grows, by the true cause."""
        found = {}
        for name in self.chances:
            before = [value for (s, _), value in self.before.items() if s == name]
            then = [value for (s, _), value in after.items() if s == name]
            if before:
                found[name] = max(min(then), _LEAST) / max(min(before), _LEAST)
        return found

    def after(self, trial: Trial) -> Table | None:
        """lambda with this trial added; None where the motion diverges or goes too far."""
        sim = simulator(
            self.model, [trial], free=self.space.varying, values=self.space.nominal(),
            hold=self.problem.options.hold, max_step=self.problem.options.max_step, threads=self.problem.threads,
        )  # fmt: skip
        hidden = self.model.hidden
        states = [c.name for c in self.model.states if c.name not in hidden and c.name not in self.model.follows]
        fitted, slopes, true = {}, {}, {}
        for name, fit in self.fits.items():
            found = sim.jacobian(self._theta(fit.x), sim.initial_states, states)
            if found.diverged.any() or not np.isfinite(found.dy).all() or not self._within(found.y):
                return None
            many = len(self.space.varying)
            chain = self.space.varying_jacobian(fit.x[self.own]) if self.space.has_ties else None
            by_own = found.dy[:, :, :many] if chain is None else found.dy[:, :, :many] @ chain
            columns = np.searchsorted(self.own, self.shared[name])
            dy = np.concatenate([by_own[:, :, columns], found.dy[:, :, many:]], axis=2)
            fitted[name] = self._whitened(trial, found.y[:, :, None])[:, 0]
            slopes[name] = self._whitened(trial, -dy)
        for name, one in self.true.items():
            if name in self.fits and one.x is self.fits[name].x:
                true[name] = fitted[name]
                continue
            y = self._answer(sim, trial, one)
            if not np.isfinite(y).all():
                return None
            true[name] = self._whitened(trial, y[:, :, None])[:, 0]
        table = {}
        for (s, r), old in self.old.items():
            table[(s, r)] = old.plus(_projected(true[s] - fitted[r], slopes[r], len(self.shared[r]))).least()
        return table

    def _theta(self, x: Array) -> Array:
        """An x of the problem as the simulator takes it."""
        return np.asarray(self.space.varying_values(x[None, self.own])[0])

    def _answer(self, sim: Simulator, trial: Trial, one: _True) -> Array:
        """Outputs (n, D) of a true cause."""
        if not one.terms or self.unnamed is None:
            return np.asarray(sim.outputs(self._theta(one.x)[None], sim.initial_states).y[0])
        space = self.unnamed.cost.space
        probed = simulator(
            self.unnamed.model, [trial], free=space.varying, values=space.nominal(),
            hold=self.problem.options.hold, max_step=self.problem.options.max_step, threads=self.problem.threads,
        )  # fmt: skip
        values = {**dict(zip(self.problem.names, one.x.tolist())), **one.terms}
        named = np.array([[values.get(parameter.name, 0.0) for parameter in space.free]])
        return np.asarray(probed.outputs(space.varying_values(named), probed.initial_states).y[0])

    def _true(self, name: str) -> _True:
        """A survivor at its fitted size; at its typical one where next to nothing was fitted."""
        search, problem, fit = self.search, self.problem, self.fits[name]
        base, columns = search.base, problem.columns[name]
        fitted = _True(fit.x, fit.linear.errors, {})
        if float(np.sum((fit.linear.errors - base.linear.errors) ** 2)) > _SIZE:
            return fitted
        x = base.x.copy()
        starts = [values for key, (values, _) in search.starts.items() if key.partition("@")[0] == name]
        x[columns] = starts[0] if starts else problem.mean[columns] + problem.sd[columns] / WIDER
        errors = problem.whitened(x, search.floor, problem.active([name]))
        return _True(x, errors, {}) if np.isfinite(errors).all() else fitted

    def _formula(self) -> _True | None:
        """The model without effects and the missing terms that the trials make most probable beside it."""
        probes = self.unnamed
        assert probes is not None
        asked = [probe for probe in probes.found if probe.kind == "terms"]
        if not asked:
            return None
        best = max(asked, key=lambda probe: probe.gain)
        values, _ = probes.posterior(best.label, best.size)
        names = [probes.terms[best.label][k].name for k in probes.kept[best.label]]
        terms = dict(zip(names, values.tolist()))
        errors = probes.errors(probes.at.x, terms)
        return _True(probes.at.x, errors, terms) if np.isfinite(errors).all() else None

    def _old(self, s: str, r: str) -> _Normal:
        """What the recorded trials say against r where s is true: noise-free, coefficients known as well as before."""
        problem, fit, active = self.problem, self.fits[r], self.fits[r].active
        centre, sd = self.true[s].x.copy(), problem.sd[active]
        centre[problem.columns[r]] = problem.mean[problem.columns[r]]
        e, S = fit.linear.errors - self.true[s].errors, fit.linear.slopes
        off = (fit.x - centre)[active] / sd
        G = S.T @ S + np.diag(1.0 / sd**2)
        return _reduced(G, S.T @ e + off / sd, float(e @ e + off @ off), np.isin(active, self.shared[r]))

    def _ranges(self) -> dict[int, tuple[float, float]]:
        """What each output may reach, by its column."""
        found = {}
        for k, name in enumerate(self.problem.outputs):
            values = [np.asarray(t.outputs[name]) for t in self.problem.trials if name in t.outputs]
            if name not in _FREE and values and np.isfinite(np.concatenate(values)).any():
                low, high = float(np.nanmin(np.concatenate(values))), float(np.nanmax(np.concatenate(values)))
                margin = _BEYOND * (high - low)
                if name == "z":
                    margin = max(margin, 0.5 * abs(float(np.nanmedian(np.concatenate(values)))))
                # Slower than ever is within, down to a stop.
                found[k] = (min(low - margin, 0.0 if name == "u" else low), high + margin)
        return found

    def _within(self, y: Array) -> bool:
        """Whether the motion stays near what was recorded: beyond that nobody knows the model, or dares."""
        return all(low <= y[:, k].min() and y[:, k].max() <= high for k, (low, high) in self.ranges.items())

    def _whitened(self, trial: Trial, columns: Array) -> Array:
        """Outputs' columns (n, D, k) where they count, by the noise of the nearest sampling step: (rows, k)."""
        parts = []
        for j, name in enumerate(self.problem.outputs):
            at = np.flatnonzero(np.isfinite(trial.outputs[name])) if name in trial.outputs else np.zeros(0, np.intp)
            known = [c for c in self.search.floor.channels if c.channel == name]
            if len(at) > 1 and known:
                step = float(np.median(np.diff(trial.t[at])))
                noise = min(known, key=lambda c: abs(math.log(c.step / step)))
                parts.append(noise.whiten(columns[at, j]))
        return np.concatenate(parts) if parts else np.zeros((0, columns.shape[2]))


def _projected(e: Array, S: Array, shared: int) -> _Normal:
    """The quadratic of a new trial, of whose columns the first ones are shared; the rest is its own first state."""
    G = S.T @ S
    inside = np.arange(S.shape[1]) < shared
    own = np.flatnonzero(~inside)
    G[own, own] = G[own, own] * (1.0 + 1e-9) + 1e-12
    return _reduced(G, S.T @ e, float(e @ e), inside)


def _reduced(G: Array, g: Array, c: float, inside: Flags) -> _Normal:
    """A quadratic at its minimum over the entries that are not inside."""
    a, b = np.flatnonzero(inside), np.flatnonzero(~inside)
    if not b.size:
        return _Normal(G, g, c)
    solved = np.linalg.solve(G[np.ix_(b, b)], np.column_stack([G[np.ix_(b, a)], g[b]]))
    cross = G[np.ix_(a, b)]
    least = c - float(g[b] @ solved[:, -1])
    return _Normal(G[np.ix_(a, a)] - cross @ solved[:, :-1], g[a] - cross @ solved[:, -1], least)
