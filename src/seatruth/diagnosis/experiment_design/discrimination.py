"""What a further trial would add to the noncentrality between surviving causes.

Take one survivor for the true cause, at the size that was fitted. The noncentrality to a rival is the squared norm, in
noise deviations, that a refit of the rival and all coefficients leaves of the noise-free difference between the two
fitted models: on the recorded trials, and with one more. This is T-optimal discrimination between models (Atkinson and
Fedorov 1975), with priors and with the initial state of each trial unknown. Many trials are compared by one linear step
of each rival; of those that are worth it, rivals are refitted step by step (`refitted`): what a craft does that spins
about one stopped propeller is far from linear, and a rival that follows it leaves next to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.equations import DEPTHS
from seatruth.diagnosis.fit import Fit, without_discrepancy
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Point
from seatruth.diagnosis.sizes import noise_shapes
from seatruth.diagnosis.steps import weighted_squares
from seatruth.models.black_box import RunFailed
from seatruth.statistics.state_space_noise import whiten
from seatruth.trials.trial import Trial

Table = dict[tuple[str, str], float]
"""Noncentrality by (true cause, rival that is fitted in its place)."""
LEAST = 1.0
"""Noncentrality that counts as none when ratios are taken: one noise deviation, which nobody sees. A trial that makes
0.6 of 0.06 tells nothing apart. [S]"""
_HARDLY = 2.0
"""Squared signature, in noise deviations, below which a fitted effect stands at its typical magnitude instead. [S]"""
_GROWING = ("x", "y", "psi")
"""Outputs that grow with time, and on which no motion depends but through the environment."""
_BEYOND = 2.0
"""Widths of what was recorded by which other outputs may leave it: beyond that nobody knows the model. [S]"""
_STEEPER = 0.5
"""The same of pitch and roll, at which a vehicle stalls, loops or capsizes. [S] Of an AUV that had pitched by 20 deg a
trial was suggested in which it pitched by 75."""
_STEPS = 8
"""Steps of a refit at most. [S]"""
_PARTS = (1.0, 0.5, 0.2, 0.05)
"""Parts of a step that are tried, the longest first. [S]"""
_ENOUGH = 0.1
"""Part of what is left, and noncentrality, by which another step would lower it, below which a refit ends. [S]"""
_LARGEST = 1e9
"""Whitened derivative from which a motion counts as unpredictable: its square would swamp double precision."""

_OVERFLOWS = 1e100
"""Derivative in SI units from which a run counts as diverged: below it, its square over the variance of any noise can
be summed in double precision, whose largest number is 1.8e308."""


@dataclass(frozen=True)
class _Quadratic:
    """|e + S d|^2 with priors, of the step d (n,) of what all trials share: G (n, n), g (n,), c."""

    G: Array
    g: Array
    c: float

    def step(self) -> Array:
        """The step to the least value."""
        return np.asarray(-np.linalg.solve(self.G, self.g))

    def least(self) -> float:
        return max(0.0, self.c + float(self.g @ self.step()))

    def plus(self, other: _Quadratic) -> _Quadratic:
        return _Quadratic(self.G + other.G, self.g + other.g, self.c + other.c)


class Rivals:
    """The surviving causes, with their noncentralities on the recorded trials (`before`).

    Survivors whose runs diverge without the forces that hold them near the record are left out.

    Args:
        search: fitted hypotheses; each survivor must be fitted alone.
        chances: probability of each survivor.
    """

    def __init__(self, search: Search, chances: Mapping[str, float]) -> None:
        self.search, self.problem = search, search.problem
        self.sizes = search.null.sizes.without_discrepancy()
        self.fits = {name: fit for name in chances if (fit := self._fitted(name)) is not None}
        self.chances = {name: chances[name] for name in self.fits}
        self.true = {name: self._true(name) for name in self.fits}
        self._columns = {name: self.problem.active((name,), discrepancy=False) for name in self.fits}
        self._ranges = self._recorded_ranges()
        self._errors: dict[str, Array] = {}
        pairs = ((s, r) for s in self.fits for r in self.fits if s != r)
        recorded = {(s, r): self._about(without_discrepancy(self.problem, self.fits[r].point), s, r) for s, r in pairs}
        self._recorded = {pair: one for pair, one in recorded.items() if one is not None}
        self.before = {pair: one.least() for pair, one in self._recorded.items()}

    @property
    def leader(self) -> str:
        """The most probable survivor."""
        return max(self.chances, key=lambda name: (self.chances[name], name))

    def gains(self, after: Table) -> dict[str, float]:
        """Factor by which the noncentrality to the nearest rival grows, by the true cause."""
        found = {}
        for name in self.chances:
            now = [value for (s, _), value in self.before.items() if s == name]
            then = [value for (s, _), value in after.items() if s == name]
            if now:
                found[name] = max(min(then), LEAST) / max(min(now), LEAST)
        return found

    def mean(self, values: Mapping[str, float]) -> float:
        """Mean over the survivors, by their probability."""
        total = sum(self.chances[name] for name in values)
        return sum(self.chances[name] * value for name, value in values.items()) / total

    def after(self, trial: Trial) -> Table | None:
        """Noncentralities with this trial added; None where the motion diverges or leaves what is known."""
        predicted, slopes = {}, {}
        for name, fit in self.fits.items():
            found = self._response(trial, name, without_discrepancy(self.problem, fit.point))
            if found is None:
                return None
            predicted[name], slopes[name] = found
        table = {}
        true = {name: self._outputs(trial, point) for name, point in self.true.items()}
        for (s, r), recorded in self._recorded.items():
            outputs = true[s]
            if outputs is None:
                return None
            difference = outputs - predicted[r]
            table[s, r] = recorded.plus(_projected(difference, slopes[r], len(self._columns[r]))).least()
        return table

    def refitted(self, s: str, trial: Trial | None) -> float | None:
        """Noncentrality of a true cause to the nearest of its rivals, each refitted step by step.

        On the recorded trials, and with one more where it is given. None where a motion diverges.
        """
        output = None if trial is None else self._outputs(trial, self.true[s])
        if trial is not None and output is None:
            return None
        left = [self._refit(s, r, trial, output) for r in self.fits if r != s]
        known = [value for value in left if value is not None]
        return min(known, default=None)

    def _refit(self, s: str, r: str, trial: Trial | None, output: Array | None) -> float | None:
        """What is left of s where r is refitted; first states are those that fit best at each step."""
        problem, columns = self.problem, self._columns[r]

        def about(shared: Array) -> _Quadratic | None:
            point = replace(start, shared=shared)
            found = self._about(point, s, r)
            if found is None or trial is None or output is None:
                return found
            new = self._response(trial, r, point, anywhere=True)
            return None if new is None else found.plus(_projected(output - new[0], new[1], len(columns)))

        start = without_discrepancy(problem, self.fits[r].point)
        shared = start.shared
        now = about(shared)
        if now is None:
            return None
        for _ in range(_STEPS):
            if now.c - now.least() < max(_ENOUGH * now.c, _ENOUGH):
                return now.least()
            for part in _PARTS:
                moved = shared.copy()
                moved[columns] += part * now.step()
                moved = np.clip(moved, problem.low, problem.high)
                there = about(moved)
                if there is not None and there.c < now.c:
                    shared, now = moved, there
                    break
            else:
                break
        return now.c

    def _fitted(self, name: str) -> Fit | None:
        problem = self.problem
        for discrepancy in (False, True):
            fit = self.search.fits.get(((name,), discrepancy))
            if fit is not None and _is_finite(
                problem.linearize(without_discrepancy(problem, fit.point), (name,), discrepancy=False)
            ):
                return fit
        return None

    def _true(self, name: str) -> Point:
        """A survivor at its fitted size, or at its typical one where next to nothing was fitted."""
        problem, fit = self.problem, self.fits[name]
        point = without_discrepancy(problem, fit.point)
        columns = problem.columns[name]
        absent = point.shared.copy()
        absent[columns] = problem.mean[columns]
        signature = problem.errors(replace(point, shared=absent)) - problem.errors(point)
        if np.isfinite(signature).all() and weighted_squares(problem, signature, self.sizes) > _HARDLY:
            return point
        effect = problem.effects[name]
        typical = effect.typical(problem.study.model)
        absent[columns] = [typical[q.name] for q in effect.parameters]
        return replace(point, shared=absent)

    def _about(self, point: Point, s: str, r: str) -> _Quadratic | None:
        """What the recorded trials say against r, about a point of it, where s is true, without noise.

        None where runs of either diverge, or are about to.
        """
        problem = self.problem
        at = problem.linearize(point, (r,), discrepancy=False)
        if s not in self._errors:
            self._errors[s] = problem.errors(self.true[s])
        difference = at.errors - self._errors[s]
        if not (np.isfinite(difference).all() and _is_finite(at)):
            return None
        # Coefficients are believed to be those of the true model; the rival's own parameters vanish at their null.
        centre = self.true[s].shared.copy()
        centre[problem.columns[r]] = problem.mean[problem.columns[r]]
        likelihood = Likelihood(problem, replace(at, errors=difference))
        try:
            gram = likelihood.quadratic(self.sizes)
        except np.linalg.LinAlgError:
            return None
        place = [1 + likelihood.place[int(c)] for c in self._columns[r]]
        sd = problem.sd[self._columns[r]]
        offset = (point.shared - centre)[self._columns[r]] / sd
        G = gram[np.ix_(place, place)] + np.diag(1.0 / sd**2)
        return _Quadratic(G, gram[place, 0] + offset / sd, float(gram[0, 0]) + float(offset @ offset))

    def _response(self, trial: Trial, name: str, point: Point, *, anywhere: bool = False) -> tuple[Array, Array] | None:
        """Whitened outputs (rows,) of a rival at a point, and their derivatives (rows, shared + initial states).

        None where they diverge or, but for `anywhere`, leave what was recorded.
        """
        problem = self.problem
        values = problem.named(point)
        free = [problem.unknowns[k].name for k in self._columns[name]]
        sim = problem.on_trial(trial, free, values)
        found = sim.jacobian(np.array([values[n] for n in free]), sim.initial_states, problem.initial_names)
        if found.diverged.any() or not np.isfinite(found.dy).all():
            return None
        if not anywhere and not self._within(found.y):
            return None
        slopes = self._whitened(trial, -found.dy)
        if np.abs(slopes).max(initial=0.0) > _LARGEST:
            return None
        return self._whitened(trial, found.y[:, :, None])[:, 0], slopes

    def _outputs(self, trial: Trial, point: Point) -> Array | None:
        """Whitened outputs (rows,) of a true cause; None where it diverges."""
        sim = self.problem.on_trial(trial, (), self.problem.named(point))
        try:
            y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
        except RunFailed:  # a simulator that gives up in a trial which nobody has sailed
            return None
        return self._whitened(trial, y[:, :, None])[:, 0] if np.isfinite(y).all() else None

    def _recorded_ranges(self) -> dict[int, tuple[float, float]]:
        """What each output may reach, by its number. No submerged vehicle comes out of the water."""
        found, model = {}, self.problem.study.model
        for k, name in enumerate(self.problem.outputs):
            parts = [np.asarray(t.outputs[name]) for t in self.problem.trials if name in t.outputs]
            values = np.concatenate(parts) if parts else np.zeros(0)
            values = values[np.isfinite(values)]
            standard, sign = model.standard_of(name)
            if name in _GROWING or not values.size:
                continue
            low, high = float(values.min()), float(values.max())
            margin = (_STEEPER if standard in ("theta", "phi") else _BEYOND) * (high - low)
            if standard in DEPTHS:
                margin = max(margin, 0.5 * abs(float(np.median(values))))
            # Slower than ever is within, down to a stop.
            least, most = min(low - margin, 0.0 if name == "u" else low), high + margin
            if standard in DEPTHS and model.kind in ("auv", "glider"):
                least, most = (max(least, min(low, 0.0)), most) if sign > 0 else (least, min(most, max(high, 0.0)))
            found[k] = least, most
        return found

    def _within(self, y: Array) -> bool:
        return all(low <= y[:, k].min() and y[:, k].max() <= high for k, (low, high) in self._ranges.items())

    def _whitened(self, trial: Trial, columns: Array) -> Array:
        """Outputs' columns (n, C, k) where they count, whitened: (rows, k)."""
        shapes, parts = noise_shapes(self.problem.settings), []
        for c, name in enumerate(self.problem.outputs):
            at = np.flatnonzero(np.isfinite(trial.outputs[name])) if name in trial.outputs else np.zeros(0, np.intp)
            if len(at) > 1:
                white, _ = whiten(columns[at, c], np.asarray(trial.t)[at], shapes[self.sizes.shape[c]])
                parts.append(white * math.exp(-float(self.sizes.white[c])))
        return np.concatenate(parts) if parts else np.zeros((0, columns.shape[2]))


def _is_finite(at: Linearization) -> bool:
    """Whether no run diverges, or is about to."""
    return all(bool((np.abs(rows) < _OVERFLOWS).all()) for rows in (at.errors, at.shared, at.local))


def _projected(e: Array, S: Array, shared: int) -> _Quadratic:
    """The quadratic of a new trial over the shared columns, its own initial state integrated out."""
    G, g = S.T @ S, S.T @ e
    a, b = np.arange(shared), np.arange(shared, S.shape[1])
    if not b.size:
        return _Quadratic(G, g, float(e @ e))
    inner = G[np.ix_(b, b)]
    inner[np.arange(b.size), np.arange(b.size)] = inner.diagonal() * (1.0 + 1e-9) + 1e-12
    solved = np.linalg.solve(inner, np.column_stack([G[np.ix_(b, a)], g[b]]))
    cross = G[np.ix_(a, b)]
    rest = float(e @ e) - float(g[b] @ solved[:, -1])
    return _Quadratic(G[np.ix_(a, a)] - cross @ solved[:, :-1], g[a] - cross @ solved[:, -1], rest)
