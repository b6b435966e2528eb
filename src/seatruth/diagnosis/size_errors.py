"""Standard errors of sizes, where trials disagree about them more than noise allows.

Of a model of another form than the vehicle each trial asks for a size of its own, and the likelihood, which takes the
form for granted, is too sure of the size that serves all best. How far an estimate moves as a trial is left out says
so: if the model were right, the variance of that move would be the rise of the posterior variance (Hausman 1978,
Econometrica 46, 1251-1271). The root of what the moves are over what they should be multiplies the error, as where
measurements of one constant disagree (Birge 1932, Physical Review 40, 207-227).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr, stdtrit

from seatruth.arrays import Array
from seatruth.diagnosis.drift_in_turns import drift_error
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.sections import left_out_together
from seatruth.diagnosis.tempering import tempered_deviation
from seatruth.diagnosis.verdict import EffectParameter
from seatruth.effects.causes import is_within
from seatruth.effects.each_trial import follows_each_trial

_THROUGH_FORCES = ("actuator", "loading", "hydrodynamics", "environment.force_fixed_to_earth")
"""Causes that show by what the model makes of forces, not in the motion or in a sensor itself."""
_OF_FORCES = 0.05
"""Error of such a size, as a part of it, where the model also lacks something: what makes its forces of another form is
the same in all trials. [S] Of 17 sizes of strangers' seven vehicles the error had a root mean square of 0.053."""
_ROUNDING = 1e-9
"""Rise of the posterior variance, as a part of it, below which a trial says nothing of an unknown."""


def size_errors(problem: Problem, fit: Fit) -> Array:
    """Standard errors of the shared unknowns (S,), 0 for those that are fixed.

    What the trials say is divided by a temperature, and by the square of `disagreement` where that is larger.
    """
    temperature = np.fmax(problem.settings.size_temperature, disagreement(problem, fit) ** 2)
    return tempered_deviation(fit.stderr(problem), problem.sd, temperature)


def sizes_of(problem: Problem, fit: Fit, name: str, *, lacking: bool = False) -> tuple[EffectParameter, ...]:
    """The parameters of an effect as a fit has them, with these errors and what its form leaves open.

    `lacking` says whether the model also lacks something that no effect describes.
    """
    effect, errors, at = problem.effects[name], size_errors(problem, fit), fit.point.shared
    through = lacking and any(is_within(effect.cause, cause) for cause in _THROUGH_FORCES)
    forces = _OF_FORCES if through else 0.0
    found = list[EffectParameter]()
    part = math.hypot(_form_error(problem, name), drift_error(problem, fit, name), forces)
    for q, k in zip(effect.parameters, problem.columns[name]):
        value, null = float(at[k]), float(effect.null[q.name])
        systematic = part * abs(value - null) if q.name in effect.magnitudes else 0.0
        error = math.hypot(errors[k], systematic)
        ends = value - 1.96 * error, value + 1.96 * error
        believed = float(problem.believed_sd[k])
        found.append(EffectParameter(q.name, q.unit, value, error, *ends, null, believed, systematic))
    return tuple(found)


def beyond_belief(problem: Problem, fit: Fit | None, key: Key) -> list[str]:
    """Effects of a set, but for waves, whose size a fit puts beyond what is believed: nothing leans on a wave's."""
    most = problem.settings.implausible
    names = [name for name in key if not follows_each_trial(problem.effects[name])]
    return [name for name in names if fit is not None and fit.prior_deviations(problem, name) > most]


def _form_error(problem: Problem, name: str) -> float:
    """Error of the magnitudes, as a part of them, that a factor of the effect's form leaves however many the trials.

    Trials seem to tell a wind from the area that it blows on, by how its angle changes with the vehicle's own motion.
    But that goes by the published form of the force, and the area's factor stands for how far a vehicle is from it. Of
    a boat in a wind of 6 m/s the fit had 4.43 +- 0.25 m/s on twice the area.
    """
    effect = problem.effects[name]
    column = dict(zip((q.name for q in effect.parameters), problem.columns[name]))
    return math.hypot(*(power * problem.sd[column[factor]] for factor, power in effect.scaled_by.items()))


def is_sure(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether the size of an effect can be told from none, by its squared distance from it in standard errors (Wald).

    Beside missing forces each trial may ask for a size of its own: the errors are those of `size_errors` there. What a
    few trials say of their own disagreement is itself uncertain, so that the limit is that of Student's t for as many.
    An antenna was placed 2 m ahead of where it stands, at 2.9 errors from there, on a boat heavier than its model.

    What the model's drift in turns leaves open is the same in all trials, and no number of them makes it less.
    """
    least, wider = problem.settings.least_noncentrality, np.ones(len(problem.unknowns))
    if fit.discrepancy:
        wider = _wider(problem, fit)
        freedom = len(left_out_together(problem.trials)) - 1
        least = float(stdtrit(freedom, ndtr(-math.sqrt(least)))) ** 2 if freedom > 0 else least
    found = fit.significance(problem, name, wider)
    open_ = drift_error(problem, fit, name) ** 2
    return found >= least and found >= problem.settings.least_noncentrality * (1.0 + open_ * found)


def is_told(problem: Problem, fit: Fit, name: str) -> bool:
    """Whether the size of an effect can be told from none with the errors that are reported of it.

    Where trials agree it can, if it can at all: what evidence is divided by makes no difference. Of a boat whose
    simulator had another form, a yaw rate scale of -0.026 +- 0.033 was named, since one trial alone asked for it.
    """
    least = problem.settings.least_noncentrality / problem.settings.size_temperature
    return fit.significance(problem, name, _wider(problem, fit)) >= least


def _wider(problem: Problem, fit: Fit) -> Array:
    """The errors of the shared unknowns (S,) over those of the fit, 1 or more."""
    own, errors = fit.stderr(problem), size_errors(problem, fit)
    return np.fmax(np.divide(errors, own, out=np.ones(len(own)), where=own > 0.0), 1.0)


def disagreement(problem: Problem, fit: Fit) -> Array:
    """How far trials disagree about each shared unknown, over what noise explains (S,).

    The root of the sum over trials of the squared moves of the estimate as one is left out, over the sum of the rises
    of its posterior variance; 1 in the mean where the model is right, NaN for what no trial or a single one tells of.
    """
    groups, count = left_out_together(problem.trials), len(problem.unknowns)
    moved, risen, telling = np.zeros(count), np.zeros(count), np.zeros(count)
    whole = fit.stderr(problem) ** 2
    for group in groups if len(groups) > 1 else []:
        others = [trial for trial in range(len(problem.trials)) if trial not in group]
        try:
            step = fit.likelihood.shared_step(fit.sizes, fit.effects, others)
        except np.linalg.LinAlgError:
            continue
        variance = np.zeros(count)
        variance[step.free] = np.diag(step.covariance)
        rise = np.maximum(variance - whole, 0.0)
        tells = rise > _ROUNDING * whole
        moved += np.where(tells, step.shared**2, 0.0)
        risen += np.where(tells, rise, 0.0)
        telling += tells
    with np.errstate(all="ignore"):
        return np.where((telling > 1) & (risen > 0.0), np.sqrt(moved / risen), math.nan)
