"""Where the fit of a run that strays begins: with what short pieces of the trials say.

A vehicle that is unstable on its course, or turns in long circles, runs so far from its record at the believed
coefficients that a fit of whole trials ends anywhere. Pieces that start anew from the data cannot stray: their fit
brings the coefficients near enough.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.trajectory import TrajectoryCost
from seatruth.diagnosis.problem import GapProblem
from seatruth.errors import SeatruthError
from seatruth.models.black_box import BlackBox
from seatruth.optimizers import minimise
from seatruth.trials.trial import Trials

STRAYED = 4.0
"""Mean square of the whitened errors above which a first fit may have ended anywhere."""
PIECES = 12
"""Into which the longest trial is cut."""


def from_pieces(problem: GapProblem, sizes: Mapping[str, float]) -> Array | None:
    """x with the coefficients (not the effects) that fit pieces of the trials; `sizes` are deviations of the channels'
    noise. None where the model cannot be started from the data, and for a black box.
    """
    study = problem.study
    if isinstance(study.model, BlackBox):
        return None  # each piece would be a run of somebody's program
    own = {parameter.name for parameter in study.model.parameters}
    try:
        cost = TrajectoryCost(
            study.replace(
                parameters=tuple(p for p in problem.parameters if p.name in own),
                trials=problem.trials,
                holdout=Trials([]),
                cost=problem.options.replace(
                    initial="fixed", segments=max(trial.duration for trial in problem.trials) / PIECES
                ),
                noise=dict(sizes),
                constraints=(),
            ),
            threads=problem.threads,
        )
        found = minimise(cost, "least_squares").x
    except SeatruthError:
        return None
    x = problem.start.copy()
    place = {name: k for k, name in enumerate(problem.names)}
    for name, value in zip(cost.names, found):
        x[place[name]] = value
    return x if np.isfinite(x).all() else None
