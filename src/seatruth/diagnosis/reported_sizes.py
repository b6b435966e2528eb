"""The fit of an answer without forces that hold runs near their records, its effects as large as they are reported.

What is simulated, drawn, and tried on trials left out is the model with the named effects and no forces. Where it also
lacks something, its fit without forces may end at other sizes than that with them, which are those that are reported:
the effects make up for what is missing. Then they are held about the reported sizes, and all else is fitted.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.hypothesis_fits import without_forces
from seatruth.diagnosis.initial_guess import moved_to
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.size_errors import size_errors
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.uncertainty.moved_coefficients import Coefficient

_ELSEWHERE = 3.0
"""Standard errors by which an effect's value without forces may differ from the reported one. Convention."""
_HELD = 0.25
"""Standard errors within which it is held otherwise: four of these are the widest prior of a magnitude. [S]"""


def reported_fit(search: Search, found: Sequence[Hypothesis], name: str, shown: Key, beside: Key) -> Fit | None:
    """The fit whose size of an effect is reported; None where it was not fitted.

    That is the fit of the answer `shown`, beside those of `beside`, or of the most probable set that holds the effect,
    with what stands there for another form: of a ferry whose thruster drew air the rudders' effectiveness had 95 %, all
    of it beside another cross-flow drag, and was told as large as in a fit without that. Where that set was only
    linearized beside missing forces, a fit without these is no measure of it: of a river vessel on which nothing acted
    a play of 0.50 +- 0.08 deg stood beside an evidence of -1.8 nats.
    """
    if name in shown:
        return search.beside(shown, beside)
    likely = next((one for one in found if name in one.effects), None)
    key = () if likely is None else tuple(sorted({*likely.effects, *likely.like}))
    return None if likely is None else search.fits.get((key, likely.discrepancy))


def with_reported_sizes(search: Search, key: Key, reported: Fit | None) -> Fit:
    """The fit of a set without forces, with effects of about the sizes that are `reported`.

    Of an AUV a speed sensor that was 6.3 +- 0.3 % off was simulated as 0.9 % the other way, and seemed to close
    nothing.
    """
    problem, bare = search.problem, without_forces(search, key)
    same = reported is None or (reported.effects == bare.effects and not reported.discrepancy)
    if reported is None or same or bare.discrepancy:
        return bare
    columns = [k for name in key for k in problem.columns[name]]
    values, error = reported.point.shared[columns], reported.stderr(problem)[columns]
    if not (np.abs(bare.point.shared[columns] - values) > _ELSEWHERE * error).any():
        return bare
    held = copy.copy(problem)
    held.mean, held.sd = held.mean.copy(), held.sd.copy()
    held.mean[columns], held.sd[columns] = values, np.maximum(_HELD * error, np.finfo(np.float64).tiny)
    start = bare.point
    for name in key:
        start = moved_to(held, start, name, reported.point.shared[held.columns[name]])
    try:
        return fit(held, key, start, bare.sizes, search.known, discrepancy=False)
    except np.linalg.LinAlgError:
        return bare


def refitted_coefficients(problem: Problem, fit: Fit) -> tuple[Coefficient, ...]:
    """The model's free coefficients as a fit has them, which is that of the answer."""
    at, errors = fit.point.shared, size_errors(problem, fit)
    ends = (at <= problem.low) | (at >= problem.high)
    return tuple(
        Coefficient(q.name, q.unit, q.value, float(problem.sd[k]), float(at[k]), float(errors[k]), bool(ends[k]))
        for k, q in ((k, problem.unknowns[k]) for k in problem.coefficients)
    )
