"""How wide the priors should be: each fitted run is left out in turn and predicted from the others, at several widths.

The means are the published values of this very ship, the standard deviations those of a spread among full tankers:
nearer runs may want them narrower. Runs that a study leaves out take no part.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from seatruth import Study, Trials, identify
from seatruth.models import Parameter

WIDTHS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.18)
"""Factors on all standard deviations of a study's priors. Chosen here [S]: steps of about the square root of 2."""
QUICK_WIDTHS = (1.0, 0.35)


def narrowed(study: Study, width: float) -> Study:
    """The study with the standard deviation of every prior times a factor."""
    return study.replace(parameters=tuple(_narrowed(p, width) for p in study.parameters))


def errors_left_out(study: Study, width: float, seed: int, threads: int | None) -> list[float]:
    """Mean logarithm of the errors of each fitted run, over its channels, predicted from the other fitted runs.

    Errors are root mean squares in SI units, so only differences between widths mean anything.
    """
    found = []
    for left in study.trials:
        others = Trials([run for run in study.trials if run.name != left.name])
        one = narrowed(study, width).replace(trials=others, holdout=Trials([left]))
        fit = identify(one, seed=seed, threads=threads).fit
        found.append(float(np.log(fit.rmse[fit.held_out].to_numpy(dtype=np.float64)).mean()))
    return found


def _narrowed(parameter: Parameter, width: float) -> Parameter:
    prior = parameter.prior
    return parameter if prior is None else replace(parameter, prior=replace(prior, sd=width * prior.sd))
