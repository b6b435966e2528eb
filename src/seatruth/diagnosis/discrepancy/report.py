"""What the model's structure lacks beside the answer: sizes, functions of time, and a formula."""

from __future__ import annotations

import math

import numpy as np

from seatruth.diagnosis.discrepancy.equations import acceleration_unit
from seatruth.diagnosis.discrepancy.model import MissingForces
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.parts import Discrepancy, MissingForce, MissingTerm
from seatruth.diagnosis.problem import Problem

_SHOWN_TERMS = 8
"""Terms that a report lists. [S]"""
_CLEAR = 2.0
"""Standard errors from which a term is listed."""


def describe(search: Search, key: Key) -> Discrepancy | None:
    """Discrepancy beside a set of effects; None where the model cannot carry it or it was not fitted."""
    problem = search.problem
    found = search.fits.get((key, True))
    if found is None or problem.discrepancy is None:
        return None
    without = search.fits.get((key, False))
    gain = math.inf if without is None else found.evidence - without.evidence
    model, count = problem.discrepancy, len(problem.initial_names)
    knots = problem.settings.knots
    likelihood = Likelihood(problem, found.linearized(problem), held=found.likelihood.held)
    forces = []
    for number, trial in enumerate(problem.trials):
        known = np.sqrt(np.maximum(np.diag(likelihood.local_covariance(found.sizes, number)), 0.0))[count:]
        # Forces of no size are zero, with certainty, and have no covariance.
        deviation = known if known.size else np.zeros(len(model.equations) * knots)
        t = [k * model.spacing for k in range(knots) if k * model.spacing <= trial.duration + model.spacing]
        for e, (state, equation) in enumerate(model.equations.items()):
            unit = acceleration_unit(problem.study.model, state)
            rows = slice(e * knots, e * knots + len(t))
            value = found.point.forces[number, e, : len(t)]
            forces.append(
                MissingForce(
                    trial.name, equation, tuple(t), tuple(value.tolist()), tuple(deviation[rows].tolist()), unit
                )
            )
    return Discrepancy(
        sizes={equation: float(_size(found, e)) for e, equation in enumerate(model.equations.values())},
        forces=tuple(forces),
        terms=_terms(problem, model, found),
        log_evidence=gain,
    )


def _size(found: Fit, equation: int) -> float:
    return math.hypot(math.exp(float(found.sizes.terms[equation])), math.exp(float(found.sizes.forces[equation])))


def _terms(problem: Problem, model: MissingForces, found: Fit) -> tuple[MissingTerm, ...]:
    error = found.stderr(problem)
    rows = []
    for term, k in zip(model.terms, problem.terms):
        value, sd = float(found.point.shared[k]), float(error[k])
        if sd > 0.0 and abs(value) > _CLEAR * sd:
            text, size = term.written(model.scales)
            unit = acceleration_unit(problem.study.model, term.state)
            rows.append(MissingTerm(term.label, text, size * value, size * sd, unit))
    return tuple(
        sorted(rows, key=lambda row: (-abs(row.coefficient) / row.stderr, row.equation, row.term))[:_SHOWN_TERMS]
    )
