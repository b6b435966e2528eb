"""Errors of sensors beside the leading set, though it may have as many effects as a set can have.

Where the model's hull has another form, effects that stand for it take all places of a set. An error of a sensor moves
what that sensor says and not the vehicle, so that it is not in their place, and counts at a temperature of its own
(`tempering.errors_beside_forces`). Of an ROV whose compass was 5 deg off, and whose damping its model has otherwise,
cross-flow drag, a tether and a falling voltage led; the compass, worth 100 nats beside them, was never fitted.
"""

from __future__ import annotations

import math

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import ensure, fit_both
from seatruth.diagnosis.other_forms import forms_in
from seatruth.diagnosis.posterior import causes_in, errors_of_sensors, log_prior
from seatruth.diagnosis.screening import beside

_TURNS = 2
"""Errors of sensors that are added, one after the other. [S]"""
_TRIED = 2
"""Errors that are fitted in each turn, the first as linearized. [S] What looks alike is asked for later."""


def fit_sensor_errors(found: Search) -> None:
    """Fits the leading set with forces with errors of further sensors, where what they promise could be probable.

    Those that join it are fitted beside what stands for another form of the model alone, too: whether they act must not
    hang on effects that are no causes.
    """
    first = found.leader
    _add(found)
    at, effects = found.leader, found.problem.effects
    forms = forms_in(at.effects, effects)
    for name in errors_of_sensors(effects):
        if name in at.effects and name not in first.effects:
            ensure(found, tuple(sorted({name, *forms})), at, attempt="beside other forms alone")


def _add(found: Search) -> None:
    for _ in range(_TURNS):
        at = found.leader
        if not at.effects or not at.discrepancy or found.bare:
            return
        effects = found.problem.effects
        names = [name for name in errors_of_sensors(effects) if name not in at.effects and not effects[name].each_trial]
        promised = beside(found, at, names)
        worth = [name for name in names if promised.get(name, -math.inf) - at.evidence > _least(found, at)]
        for name in sorted(worth, key=lambda name: -promised[name])[:_TRIED]:
            key = tuple(sorted((*at.effects, name)))
            if (key, True) not in found.fits:
                found.rival = found.leader.evidence
                fit_both(found, key, at)
        if found.leader.effects == at.effects:
            return


def _least(found: Search, at: Fit) -> float:
    """nats that an error of a sensor must explain beside a set for it to be as probable as none."""
    settings, many = found.problem.settings, len(found.problem.effects)
    causes = causes_in(at.effects, found.problem.effects)
    price = log_prior(causes, True, many, settings) - log_prior(causes + 1, True, many, settings)
    # (gain - unseen) / (temperature + form * gain) is the price.
    rest = 1.0 - settings.model_form * price
    return (settings.unseen_form + settings.temperature * price) / rest if rest > 0.0 else math.inf
