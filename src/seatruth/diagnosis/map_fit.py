"""The most probable values of all unknowns of a hypothesis, and its evidence by Laplace's approximation there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.linear_problem import Linearization, Point, Problem
from seatruth.diagnosis.marginal_likelihood import SHAPES, Likelihood, Sizes, Solution, log_prior, maximised
from seatruth.statistics.state_space_noise import whiten

STEPS = 20


@dataclass(frozen=True)
class Fit:
    effects: tuple[str, ...]
    discrepancy: bool
    point: Point
    at: Linearization
    sizes: Sizes
    likelihood: Likelihood
    solution: Solution
    evidence: float
    settled: bool
    steps: int


@dataclass(frozen=True)
class Known:
    stated: Mapping[int, float]
    least: Mapping[int, float]


def objective(problem: Problem, point: Point, errors: Array, sizes: Sizes, effects: Sequence[str], lk: Likelihood, inflate: float) -> float:
    if not np.isfinite(errors).all() or np.abs(errors).max() > 1e8:
        return math.inf
    total = 0.0
    for one in problem.series:
        white, _ = whiten(errors[one.rows], one.t, SHAPES[sizes.shape[one.channel]])
        total += 0.5 * float(white @ white) * math.exp(-2.0 * sizes.white[one.channel]) / inflate**2
    at, root = lk.shared_root(sizes, effects)
    z = point.x[problem.shared[lk.shared[at]]] - problem.mean[problem.shared[lk.shared[at]]]
    total += 0.5 * _energy(root, z)
    if problem.discrepancy is not None and np.isfinite(sizes.forces).any():
        r = np.kron(lk._equation_root(sizes.forces, sizes.coupling), lk.time_root)
        for f in point.forces:
            total += 0.5 * _energy(r, f.reshape(-1))
    mean = problem.local_mean(point)
    count = problem.initial_columns.shape[1]
    total += 0.5 * float(((mean[:, :count] / problem.initial_sd()) ** 2).sum())
    return total


def _energy(root: Array, z: Array) -> float:
    if not len(z):
        return 0.0
    xi = np.linalg.lstsq(root, z, rcond=1e-10)[0]
    return float(xi @ xi)


def fit(problem: Problem, effects: Sequence[str], start: Point, sizes: Sizes, known: Known, *, discrepancy: bool, steps: int = STEPS, rival: float = -math.inf, log=None) -> Fit:
    effects = tuple(effects)
    channels = [c for c in range(len(problem.outputs)) if any(s.channel == c for s in problem.series)]
    point = start
    if not discrepancy:
        x = point.x.copy()
        x[problem.shared[problem.terms]] = 0.0
        point = Point(x, np.zeros_like(point.forces))
        sizes = replace(sizes, terms=np.full_like(sizes.terms, -math.inf), forces=np.full_like(sizes.forces, -math.inf))
    errors = problem.errors(point)
    if not np.isfinite(errors).all():
        point = Point(problem.start.x.copy(), np.zeros_like(point.forces))
    settled = False
    inflate = None
    looked = False
    last = -math.inf
    for number in range(steps):
        at = problem.linearize(point)
        lk = Likelihood(problem, at, effects)

        def f(s: Sizes, lk=lk) -> float:
            return lk.log_likelihood(s, effects) + log_prior(problem, s, known.stated, known.least)

        if inflate is None:
            white = np.exp(sizes.white)[problem.channel_of]
            inflate = max(1.0, float(np.median(np.abs(at.errors) / white)) / 3.0)
        if inflate <= 1.0:
            sizes, value = maximised(f, sizes, channels, discrepancy, sweeps=2 if not looked else 1, noise=not looked or number % 4 == 0)
            looked = True
            # far behind, and no longer coming nearer at a rate that could reach it
            if number >= 4 and value + 6.0 * max(value - last, 0.0) < rival - 30.0:
                break
            last = value
        loose = replace(sizes, white=sizes.white + math.log(inflate))
        solution = lk.solve(loose, effects)
        before = objective(problem, point, at.errors, sizes, effects, lk, inflate)
        moved = False
        for part in (1.0, 0.5, 0.2, 0.05, 0.01):
            trial = problem.moved(point, solution.shared, solution.local, part)
            after = objective(problem, trial, problem.errors(trial), sizes, effects, lk, inflate)
            if after < before:
                moved = True
                break
        if log:
            log(f"  {number} inflate {inflate:.3g} before {before:.2f} after {after:.2f} part {part} ev {f(sizes):.2f}")
        if moved:
            point = trial
        if inflate > 1.0:
            inflate = max(1.0, inflate / (4.0 if moved and part == 1.0 else 1.5)) if moved else max(1.0, inflate / 1.2)
            continue
        if not moved or before - after < 0.05:
            settled = True
            break
    at = problem.linearize(point)
    lk = Likelihood(problem, at, effects)

    def g(s: Sizes) -> float:
        return lk.log_likelihood(s, effects) + log_prior(problem, s, known.stated, known.least)

    sizes, evidence = maximised(g, sizes, channels, discrepancy, sweeps=3)
    return Fit(effects, discrepancy, point, at, sizes, lk, lk.solve(sizes, effects), evidence, settled, number + 1)
