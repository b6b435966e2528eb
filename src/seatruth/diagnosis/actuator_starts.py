"""Where an actuator stands when a trial begins, which no record shows.

Behind a servo what acts follows the order. A trial begins at some moment of an operation like the one that it records,
so at its start the actuator is about as far from its order as it usually is. Believed to stand anywhere among its
orders instead, it may begin a turn from them: what it does there is over within the servo's lag, the trials hardly tell
where it was, and thrust and side force bend so much with it that fits take ten times as long.

A log that was cut where an order was given begins far from it. Then the trials do tell, and the fit of the model alone
is made anew with actuators that may stand anywhere.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.steps import likelihood_at, objective, step

_STEPS = 3
"""Steps after which a start of the actuators is judged. [S] Where it was the right one, the first shows it."""
_TELLS = 20.0
"""nats by which actuators that may begin anywhere must lead further. [S] Of two turns recorded from their order on it
was 37 and 71; of a tug that began at its orders, with a pod 4 deg off, 12."""


def anywhere(found: Search) -> Problem | None:
    """The problem whose actuators may begin anywhere among their orders, where the trials ask for it; else None.

    A few steps of the model alone, from where its fit ended or from actuators at rest, must lead further with them. A
    gear of one rate that stands at its order has no slope there: only from elsewhere is it seen.
    """
    problem, fit = found.problem, found.fits.get(((), False))
    settings = problem.settings
    # A section begins under way, where nobody cut the record: its actuators are known to have followed their orders.
    if fit is None or not settings.near_orders or settings.sections > 1 or problem.few_runs is not None:
        return None
    servos = {servo.state for servo in problem.model.servos}
    places = [place for place, name in enumerate(problem.initial_names) if name in servos]
    if not places:
        return None
    wide = problem.with_settings(replace(settings, near_orders=False))
    begin = _after_steps(wide, fit, fit.point, 0)
    starts = [fit.point]
    for place in places:
        initial = fit.point.initial.copy()
        initial[:, place] = 0.0
        starts.append(replace(fit.point, initial=initial))
    return wide if any(_after_steps(wide, fit, start, _STEPS) < begin - _TELLS for start in starts) else None


def _after_steps(problem: Problem, fit: Fit, point: Point, steps: int) -> float:
    """Minus the log-posterior (nats) after so many steps of a fit from a point; inf where the model diverges."""
    taken = None
    for left in range(steps, -1, -1):
        at = problem.linearize(point, fit.effects, discrepancy=False)
        if not np.isfinite(at.errors).all():
            break
        likelihood = likelihood_at(problem, at, fit.sizes, fit.effects)
        if not left:
            return objective(problem, point, at.errors, fit.sizes, fit.effects, likelihood)
        taken = step(problem, at, fit.sizes, likelihood, taken)
        point = taken.point
    return math.inf
