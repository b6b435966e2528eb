"""Effects far larger than is believed, which their own prior would hold back: it is widened, and the search repeated.

A rate gyro that nobody calibrated is off by a hundred times what one that works is. The prior, made for what works,
then weighs as much as the trials: a bias of 5 deg/s was reported as 3.42 +- 0.14, and the slow noise of the gyro took
up the rest. What is believed stays as it is: such an effect looks like a cause, and is not said to be it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.prior_widths import magnitude_columns
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects.each_trial import follows_each_trial

_TIMES = 3
"""Times that a search is repeated so. [S] Each time the size comes nearer to what the trials alone say."""
_PULL = 1.0
"""Posterior deviations by which a prior moves a size from which it is widened. [S] Less is within the error."""
_SURELY = 5.0
"""Errors of a size, as the trials alone say it, by which it must differ from none. [S] Beyond what chance, or a wrong
form of the noise, makes of what does not act."""
_TYPICAL, _MOST = 2.0, 64.0
"""Deviations of its widened prior at which the size that the trials say stands, and the most by which one is widened at
once. [S] The evidence averages over parts of a prior down to a 64th (`Settings.scales`)."""
_ROUNDING = 1e-6
"""Part of a size that a prior leaves at least: rounding."""


def held_back(found: Search) -> dict[str, float]:
    """Effects of the leading set that their priors hold back, and the factor by which each prior is to be wider.

    A prior of deviation sd leaves of the size that the trials alone say the part 1 - s^2 / sd^2, where the posterior
    has the deviation s. Noise that took up the rest makes the trials seem to say little: a gyro 3 deg/s off had 0.3
    deg/s beside slow noise of 2 deg/s, with the error of its prior.
    """
    problem, leader = found.problem, found.leader
    stderr, factors = leader.stderr(problem), dict[str, float]()
    for name in leader.effects:
        if follows_each_trial(problem.effects[name]):
            continue  # nothing leans on the size of a wave
        columns = magnitude_columns(problem.effects[name], problem.columns[name])
        distance = np.abs(leader.point.shared - problem.mean)[columns]
        error, sd = stderr[columns], problem.sd[columns]
        left = np.maximum(1.0 - (error / sd) ** 2, _ROUNDING)
        alone = distance / left
        far = alone > problem.settings.implausible * problem.believed_sd[columns]
        sure = alone * np.sqrt(left) > _SURELY * error
        back = alone - distance > _PULL * error
        if (far & sure & back).any():
            factors[name] = min(_MOST, float((alone / sd).max()) / _TYPICAL)
    return {name: factor for name, factor in factors.items() if factor > 1.0}


def with_gross_sizes(found: Search, problem: Problem, again: Callable[[Problem], Search]) -> Search:
    """A search, begun `again` with wider priors of what they hold back; as it is where there is nothing of the kind.

    `problem` is that with which it began. What was reached before an interrupt, or a failure of the algebra, stands.
    """
    for _ in range(_TIMES):
        factors = {} if found.interrupted or problem.few_runs is not None else held_back(found)
        if not factors:
            break
        problem = problem.with_settings(_with_wider(problem.settings, factors))
        try:
            wider = again(problem)
        except np.linalg.LinAlgError:
            break
        if wider.interrupted:
            found.interrupted = True
            break
        found = wider
    return found


def _with_wider(settings: Settings, factors: Mapping[str, float]) -> Settings:
    """The settings with priors wider by these factors than they are."""
    before = dict(settings.wider)
    after = before | {name: before.get(name, 1.0) * factor for name, factor in factors.items()}
    return replace(settings, wider=tuple(sorted(after.items())))
