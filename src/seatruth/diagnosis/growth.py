"""How far runs of the model grow apart along the recorded motion.

Where a pilot or an autopilot holds a course that the vehicle alone would not, its orders are those of another run than
the model's: the smallest error grows, and over a long trial no coefficients and no forces between a dozen knots lead
the model back to its record. What decides that is not how far the model strays, but how fast runs beside the record
part. So the trials are cut into short pieces, each begun where the record stands, and the changes of their ends by
their starts are multiplied along each trial.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.segments import Segment, cut, spread_of, state_at
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.sections import FEWEST
from seatruth.trials.trial import Trial

TOO_FAR = 1000.0
"""Growth over a trial from which it is cut without being fitted whole: an error of a thousandth of the range, that of a
good sensor, is then as large as the motion. [S] Of recorded ships on ponds and in basins, which whole trials served, it
was 6 to 124; of a small vehicle underwater whose pilot held the heading, 1e13 and more."""
_FOLLOWED = 100.0
"""Growth over most sections that a fit follows. [S] Of that vehicle a current was unknown in sections over which it was
700, and found to 1 % in those of 40; ships with 60 in the median were found in whole trials."""
_COUNTS = (2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Sections of the longest trial that are considered. [S]"""
_SAMPLES, _PIECES = 5, 100
"""Samples of a piece at least, and pieces of the longest trial at most. [S] A run of a second stays near the record
from which it begins; of what does not grow, pieces of 5, 10 and 20 samples say the same to a tenth."""
_PART = 1e-6
"""Part of a state's spread by which it is moved: differences of doubles keep nine digits by it."""


class Growth:
    """What one run of all pieces says: by how much errors grow over trials, or over sections of any length.

    At the values with which the study begins, with no missing force. Errors are measured in the spread of each state
    over the trials; those of actuators, and hidden states, take no part.
    """

    def __init__(self, problem: Problem) -> None:
        self._trials = trials = list(problem.trials)
        self._longest = max(trial.duration for trial in trials)
        coarsest = max(trial.duration / len(trial) for trial in trials)
        self._pieces = cut(trials, max(_SAMPLES * coarsest, self._longest / _PIECES))
        self._slopes = _slopes(problem, trials, self._pieces)

    def over(self, sections: int) -> Array:
        """Largest factor by which small errors at the start of each section have grown anywhere along it.

        The longest trial has so many `sections`, others those of the same length. Infinite beyond what doubles hold.
        """
        length, at, along = self._longest / sections, (-1, -1), np.zeros((0, 0))
        found: list[float] = []
        with np.errstate(all="ignore"):
            for piece, slope in zip(self._pieces, self._slopes):
                since = float(piece.trial.t[0] - self._trials[piece.parent].t[0])
                section = piece.parent, int((since + 0.5 * piece.trial.duration) / length)
                along = slope @ along if section == at else slope
                size = float(np.linalg.norm(along, ord=2)) if np.isfinite(along).all() else np.inf
                if section == at:
                    found[-1] = max(found[-1], size)
                else:
                    found.append(max(1.0, size))
                at = section
        return np.array(found)

    @property
    def is_too_far(self) -> bool:
        """Whether errors grow too far over a whole trial."""
        return bool((self.over(1) > TOO_FAR).any())

    @property
    def sections(self) -> int:
        """Fewest sections of the longest trial over most of which a fit follows; as many as samples allow, at most."""
        most = max(len(trial) for trial in self._trials) // FEWEST
        allowed = [count for count in _COUNTS if count <= most]
        followed = (count for count in allowed if float(np.median(self.over(count))) <= _FOLLOWED)
        return next(followed, max(allowed, default=1))


def _slopes(problem: Problem, trials: Sequence[Trial], pieces: Sequence[Segment]) -> Array:
    """Change of the last state of each piece by its first, both in spreads of states (pieces, moving, moving)."""
    model, theta = problem.model, problem.theta(problem.start)
    servos, names = {servo.state for servo in model.servos}, [channel.name for channel in model.states]
    moving = [k for k, name in enumerate(names) if name in problem.initial_names and name not in servos]
    spreads = spread_of(model, trials)
    spread = np.array([spreads[names[k]] for k in moving])
    values = problem.space.nominal()
    begin = np.array([state_at(model, trials[one.parent], one.start, values, {}) for one in pieces])
    run = problem.bound(problem.start, problem.space.varying).rebind(trials=[one.trial for one in pieces])

    def ends(x0: Array) -> Array:
        states = run.states(theta, x0)
        return np.array([states[rows.stop - 1, moving] for rows in run.rows])

    with np.errstate(all="ignore"):
        before, found = ends(begin), np.zeros((len(pieces), len(moving), len(moving)))
        for column, (place, size) in enumerate(zip(moving, spread)):
            moved = begin.copy()
            moved[:, place] += _PART * size
            found[:, :, column] = (ends(moved) - before) / (_PART * spread)
    # Of a piece that diverges nothing is known; that the others part says enough.
    found[~np.isfinite(found).all(axis=(1, 2))] = np.eye(len(moving))
    return found
