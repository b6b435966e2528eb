"""The most probable values of all unknowns of a hypothesis, and its evidence there.

Gauss-Newton steps, damped where runs bend, on the whitened errors and the priors, the sizes of noise and discrepancy
set anew at each point by restricted maximum likelihood. While errors are many times the noise, the noise of each
channel is inflated to their size: a long run that strays from its record is drawn near it before it is fitted closely.
The evidence is Laplace's approximation at the optimum (MacKay 2003, Information Theory, Inference, and Learning
Algorithms, chapter 27).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.approach import LEAST_RISE, approached, stepped_under
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Linearization, Point, Problem
from seatruth.diagnosis.shared_likelihood import KeptLikelihood
from seatruth.diagnosis.size_search import OfSizes, maximise
from seatruth.diagnosis.sizes import (
    NoisePrior,
    Sizes,
    log_prior,
    price_of_sizes,
    proposed_shapes,
)
from seatruth.diagnosis.steps import Step, likelihood_at, linear_errors, objective, step, weighted_squares
from seatruth.diagnosis.unknowns import SharedStep
from seatruth.trials.finding import Finding

_NOISE_STEPS, _SHAPE_STEP = (0, 1, 3, 7), 1
"""Steps near the record at which the sizes, and the shapes, of noise are set anew; at the end they are set again."""
_FIRST = 4
"""Steps after which a hopeless fit may be broken off."""
_AHEAD = 6.0
"""Further gains like the last one that a fit is granted before it counts as hopeless."""
ROUNDS = 10
"""Most times that steps and sizes take turns; one or two are usual."""
FEW_ROUNDS = 2
"""The same for a set beside a model alone whose fit did not converge in `ROUNDS` of them. [S] Of an AUV whose tail is
turned by 10 deg each fit took 40 s, and none of 32 converged."""
_STILL = 4
"""Steps without such a rise after which a point is taken, though it still moves along what decides nothing. [S]"""
_KEPT_PROMISE = 0.1
"""Part of what derivatives lent from another point promise below which they are computed anew. [S]"""
_WORTH_IT, _LAST_STEPS = 0.3, 12
"""Part of its promise that a step under the final sizes must keep for another one, and most of them. [S]"""
_PROPOSALS = 2
"""Times that the shapes of noise are proposed anew from what is left at the end of a fit. [S]"""
_SWEEPS = 8
"""Most sweeps over all sizes at the end of a fit; two or three are usual."""
_THERE = 1.0
"""Posterior deviations from an optimum within which a fit from elsewhere ends there too. [S] Of 24 that were let go on,
in eight studies, all ended within 0.6 deviations; two had 4 and 5 nats more there, the others 2 at most."""
_AHEAD_OF_IT = 10.0
"""nats ahead of a fit from which it did not converge. [S] Below, the temperature leaves less than a nat of them."""


class Stopped(Exception):
    """A fit came to a point from which it is known where it ends."""


@dataclass(frozen=True)
class Fit:
    """One fitted hypothesis.

    `evidence` (nats) includes the prior density of its sizes; those of discrepancy are integrated out, which cost
    `price` (nats).
    """

    effects: tuple[str, ...]
    discrepancy: bool
    point: Point
    sizes: Sizes
    likelihood: KeptLikelihood
    """At its optimum, for these sizes."""
    solution: SharedStep
    """The most probable step from there, and its covariance, with nothing held at a bound."""
    evidence: float
    price: float
    settled: bool
    ahead: float
    """nats by which the objective would still fall, were the model linear about the point: what the fit did not reach
    because long runs bend. The evidence is that of the point that was reached, and as uncertain as this is large."""

    @property
    def promised(self) -> float:
        """Evidence (nats) that it would have, were the model linear about its point: a bound for what further steps
        bring."""
        return self.evidence + max(self.ahead, 0.0)

    def linearized(self, problem: Problem) -> Linearization:
        """Errors and derivatives at its optimum. They are computed anew: kept, they would take most of the memory."""
        return problem.linearize(self.point, self.effects, discrepancy=self.discrepancy)

    def stderr(self, problem: Problem) -> Array:
        """Posterior standard deviation of every shared unknown (S,); 0 for those that are fixed."""
        found = np.zeros(len(problem.unknowns))
        found[self.solution.free] = np.sqrt(np.maximum(np.diag(self.solution.covariance), 0.0))
        return found

    def prior_deviations(self, problem: Problem, name: str) -> float:
        """Largest distance of an effect's parameters from their null, in deviations of what is believed of them."""
        effect, columns = problem.effects[name], problem.columns[name]
        null = np.array([effect.null[q.name] for q in effect.parameters])
        return float(np.max(np.abs(self.point.shared[columns] - null) / problem.believed_sd[columns], initial=0.0))

    def is_whole(self, problem: Problem) -> bool:
        """Whether its effects that act wholly or not at all are nearer to the whole than to nothing."""
        return all(problem.nearly_whole(name, self.point.shared[problem.columns[name]], 0.5) for name in self.effects)

    def leads_here(self, problem: Problem, point: Point) -> bool:
        """Whether a fit that came to this point from elsewhere would end at this optimum.

        Its shared unknowns are near those of the optimum, and its runs as near as noise: a run may follow its record on
        another branch, held there by forces of its own. Of a launch a third of the time went to such fits.
        """
        sd, free = self.stderr(problem), self.solution.free
        if not self.settled or (np.abs(point.shared - self.point.shared)[free] > _THERE * sd[free]).any():
            return False
        apart = problem.errors(point) - problem.errors(self.point)
        return bool(np.isfinite(apart).all()) and weighted_squares(problem, apart, self.sizes) < len(apart)

    def significance(self, problem: Problem, name: str, wider: Array | None = None) -> float:
        """Squared distance of an effect's magnitudes from their null in posterior deviations (Wald's statistic).

        `wider` (S,) multiplies the deviation of each shared unknown.
        """
        effect, free = problem.effects[name], self.solution.free.tolist()
        columns = [
            k for k, q in zip(problem.columns[name], effect.parameters, strict=True) if q.name in effect.magnitudes
        ]
        place = [free.index(k) for k in columns]
        covariance = self.solution.covariance[np.ix_(place, place)]
        distance = (self.point.shared - problem.mean)[columns]
        if wider is not None:
            distance = distance / wider[columns]
        return float(distance @ np.linalg.pinv(covariance, hermitian=True) @ distance)


def fit(
    problem: Problem,
    effects: Sequence[str],
    start: Point,
    sizes: Sizes,
    known: NoisePrior,
    *,
    discrepancy: bool,
    rival: float = -math.inf,
    rounds: int = ROUNDS,
    stop: Callable[[Point], bool] | None = None,
    held: bool = False,
) -> Fit:
    """Fits a hypothesis from a point.

    `rival` is the evidence of the best hypothesis so far: a fit that cannot come near it is broken off. In `rounds`
    steps and sizes take turns; with `held` it first steps as far as the given sizes lead. Raises LinAlgError where the
    linear algebra fails at the end; its evidence is -inf where the model diverges. Raises Stopped where it steps to a
    point at which `stop` holds.
    """
    settings, effects = problem.settings, tuple(effects)
    channels = sorted({series.channel for series in problem.series})
    point = start
    if not discrepancy:
        point, sizes = without_discrepancy(problem, point), sizes.without_discrepancy()

    point, sizes = approached(problem, effects, point, sizes)
    if held:
        point = stepped_under(problem, effects, point, sizes, discrepancy)
    best, reached, last_value = (-math.inf, point, sizes, False), -math.inf, -math.inf
    for round_ in range(rounds):
        last, settled, highest, still = -math.inf, False, -math.inf, 0
        taken: Step | None = None
        for number in range(settings.fit_steps):
            at = problem.linearize(point, effects, discrepancy=discrepancy)
            if not np.isfinite(at.errors).all():
                break
            likelihood = likelihood_at(problem, at, sizes, effects)
            sizes, value = maximise(
                OfSizes(likelihood, effects, known), sizes, settings, channels=channels,
                noise=number in (_NOISE_STEPS if round_ == 0 else (0,)),
                shapes=round_ == 0 and number == _SHAPE_STEP, sweeps=1,
            )  # fmt: skip
            if number >= _FIRST and _is_hopeless(problem, value, last, rival):
                # The noise was set further from the record, and what is near it looks hopeless for that.
                sizes, value = _with_new_shapes(problem, at, likelihood, sizes, effects, known, channels)
                if _is_hopeless(problem, value, last, rival):
                    break
            last = value
            still = 0 if value > highest + LEAST_RISE else still + 1
            highest = max(highest, value)
            if still >= _STILL:
                settled = True
                break
            taken = step(problem, at, sizes, likelihood, taken)
            point = taken.point
            if stop is not None and stop(point):
                raise Stopped
            # Derivatives of another point may lead astray; those of runs that bend hold for tiny steps only.
            astray = problem.lent and _kept_promise(problem, at, sizes, likelihood, taken.fall) < _KEPT_PROMISE
            del at, likelihood  # of the largest arrays, not two at a time
            if astray:
                problem.renew()
                continue
            if taken.fall < settings.settled:
                settled = True
                break
        sizes, value, gain, left = _final_sizes(problem, effects, point, sizes, known, channels, discrepancy, rival)
        if not value > rival - settings.hopeless:  # nor where the algebra fails: the likelihood is -inf then
            best = value, point, sizes, settled
            break
        if left >= LEAST_RISE and problem.few_runs is None:
            point, value, left = _under_them(problem, effects, point, sizes, known, discrepancy, value, left)
        # New sizes ask for a new point, as long as that brings something. What is only promised is nothing: where runs
        # bend, sizes and promises may grow together without end.
        credited = value - max(left, 0.0)
        if credited > best[0]:
            best = credited, point, sizes, settled
        brought = gain if round_ == 0 else value - last_value
        if max(brought, left) < LEAST_RISE or credited < reached + LEAST_RISE:
            break
        reached, last_value = credited, value
    _, point, sizes, settled = best
    return fit_at(problem, effects, point, sizes, known, discrepancy=discrepancy, settled=settled)


def _is_hopeless(problem: Problem, value: float, last: float, rival: float) -> bool:
    """Whether a fit that gains (nats) as in its last step comes nowhere near the best hypothesis so far."""
    return value + _AHEAD * max(value - last, 0.0) < rival - problem.settings.hopeless


def _ahead(problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood) -> float:
    """What the objective (nats) would still fall by from a linearization, were the model linear."""
    here = objective(problem, at.point, at.errors, sizes, at.effects, likelihood)
    return here - likelihood.least(sizes, at.effects)


def _kept_promise(problem: Problem, at: Linearization, sizes: Sizes, likelihood: Likelihood, fall: float) -> float:
    """Part that a step brought of what the derivatives promised; 1 where they promised too little to count."""
    promised = _ahead(problem, at, sizes, likelihood)
    return fall / promised if promised > LEAST_RISE else 1.0


def _final_sizes(
    problem: Problem,
    effects: tuple[str, ...],
    point: Point,
    sizes: Sizes,
    known: NoisePrior,
    channels: Sequence[int],
    discrepancy: bool,
    rival: float,
) -> tuple[Sizes, float, float, float]:
    """The most probable sizes at the end of the steps, their objective, its rise, and what is still ahead (nats).

    Raises LinAlgError where the model diverges.
    """
    at = problem.linearize(point, effects, discrepancy=discrepancy)
    if not np.isfinite(at.errors).all():
        raise np.linalg.LinAlgError("the model diverges")
    likelihood = likelihood_at(problem, at, sizes, effects)
    evidence = OfSizes(likelihood, effects, known)
    before = evidence(sizes)
    for number in range(_PROPOSALS):
        sizes, value = _with_new_shapes(problem, at, likelihood, sizes, effects, known, channels)
        # What is far behind needs no exact sizes; between near rivals a nat counts.
        if number == 0 and not value > rival - problem.settings.hopeless:
            return sizes, value, value - before if math.isfinite(value) else 0.0, 0.0
    sizes, value = maximise(evidence, sizes, problem.settings, channels=channels, sweeps=_SWEEPS)
    ahead = _ahead(problem, at, sizes, likelihood)
    return sizes, value, value - before, ahead


def _under_them(
    problem: Problem,
    effects: tuple[str, ...],
    point: Point,
    sizes: Sizes,
    known: NoisePrior,
    discrepancy: bool,
    value: float,
    left: float,
) -> tuple[Point, float, float]:
    """Where steps under the final sizes lead, the objective of these there, and what is still ahead (nats).

    Sizes belong to the linear optimum. Where those of forces fall to almost nothing there, the little that the point
    still holds of them costs hundreds of nats, which no new sizes and one step take away. It ends where a step keeps
    too little of its promise. The point stays, with the value and what is ahead of it, where that comes to more.
    """
    best, there = (point, value, left), point
    taken: Step | None = None
    for _ in range(_LAST_STEPS):
        at = problem.linearize(there, effects, discrepancy=discrepancy)
        if not np.isfinite(at.errors).all():
            break
        likelihood = likelihood_at(problem, at, sizes, effects)
        ahead = _ahead(problem, at, sizes, likelihood)
        reached = OfSizes(likelihood, effects, known)(sizes)
        if reached - max(ahead, 0.0) > best[1] - max(best[2], 0.0):
            best = there, reached, ahead
        taken = step(problem, at, sizes, likelihood, taken) if ahead >= LEAST_RISE else None
        if taken is None or taken.fall < _WORTH_IT * ahead:
            break
        there = taken.point
    return best


def _with_new_shapes(
    problem: Problem,
    at: Linearization,
    likelihood: Likelihood,
    sizes: Sizes,
    effects: tuple[str, ...],
    known: NoisePrior,
    channels: Sequence[int],
) -> tuple[Sizes, float]:
    """The best sizes, with shapes of noise that what is left at the linear optimum proposes, and their objective.

    Of a torpedo whose planes lag, a pitch rate had the noise of earlier steps, and the fit was 140 nats behind that of
    a dead time; with its own it is 25 behind.
    """
    try:
        optimum = likelihood.solve(sizes, effects)
    except np.linalg.LinAlgError:
        return sizes, -math.inf
    residuals = linear_errors(problem, at, optimum.shared, optimum.local)
    return maximise(
        OfSizes(likelihood, effects, known), sizes, problem.settings, channels=channels, shapes=False, sweeps=1,
        proposals=proposed_shapes(problem, residuals),
    )  # fmt: skip


def fit_at(
    problem: Problem,
    effects: Sequence[str],
    point: Point,
    sizes: Sizes,
    known: NoisePrior,
    *,
    discrepancy: bool,
    settled: bool,
) -> Fit:
    """The fit whose optimum is at this point, with these sizes."""
    effects = tuple(effects)
    at = problem.linearize(point, effects, discrepancy=discrepancy)
    likelihood = likelihood_at(problem, at, sizes, effects)
    evidence = likelihood.evidence(sizes, effects) + log_prior(problem.settings, sizes, known)
    price = price_of_sizes(lambda one: likelihood.log_likelihood(one, effects), sizes, problem.settings)
    # What stands at its bound is known no better for that.
    free = likelihood.holding(()) if likelihood.held else likelihood
    solution = free.shared_step(sizes, effects)
    ahead = _ahead(problem, at, sizes, likelihood)
    settled = settled and ahead < _AHEAD_OF_IT
    kept = KeptLikelihood(likelihood, sizes)
    # What a fit did not reach is not credited to it: where long runs bend, a linear model promises anything.
    evidence -= price + max(ahead, 0.0)
    return Fit(effects, discrepancy, point, sizes, kept, solution, evidence, price, settled, ahead)


def without_discrepancy(problem: Problem, point: Point) -> Point:
    """The point with nothing missing."""
    shared = point.shared.copy()
    shared[problem.terms] = 0.0
    return Point(shared, point.initial, np.zeros_like(point.forces))


def not_converged(fits: Mapping[str, Fit], where: str) -> list[Finding]:
    """A finding on those fits, by what they are of, that did not converge."""
    names = [name for name, fit in fits.items() if not fit.settled]
    if not names:
        return []
    text = f"The fit of {' and of '.join(names)} did not converge: sizes and probabilities are rough."
    do = "Cut the trials into shorter ones, or begin from better coefficients (`seatruth identify`)."
    return [Finding("warning", "not-converged", text, where, do)]
