"""How far runs of a model grow apart along the recorded motion.

Where a pilot or an autopilot holds a course that the vehicle alone would not, its orders are those of another run than
the model's: the smallest error grows, and over a long trial no coefficients lead the model back to its record. What
decides that is not how far the model strays, but how fast runs beside the record part. So the trials are cut into short
pieces, each begun where the record stands, and the changes of their ends by their starts are multiplied along each
trial.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.segments import Segment, cut, spread_of, state_at
from seatruth.models.black_box import BlackBox
from seatruth.simulate import Simulator, simulator
from seatruth.trials.trial import Trial

TOO_FAR = 1000.0
"""Growth over a trial that no run follows: an error of a thousandth of the range, that of a good sensor, is then as
large as the motion. [S] Of recorded ships on ponds and in basins, which whole trials served, it was 6 to 124; of a
small vehicle underwater whose pilot held the heading, 1e13 and more."""
FEWEST = 25
"""Samples of a section at least. [S] Of six channels, 150 numbers."""
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

    Errors are measured in the spread of each state over the trials. Hidden states and those of actuators take no part.
    """

    def __init__(
        self,
        run: Simulator,
        theta: Array,
        trials: Sequence[Trial],
        values: Mapping[str, float],
        states: Sequence[str],
    ) -> None:
        """`run` is bound to the trials, `theta` (K,) sets its free parameters, `values` all parameters of its model.

        `states` are those that may be free at the start of a trial.
        """
        self._trials = list(trials)
        self._longest = max(trial.duration for trial in trials)
        coarsest = max(trial.duration / len(trial) for trial in trials)
        self._pieces = cut(self._trials, max(_SAMPLES * coarsest, self._longest / _PIECES))
        servos = {servo.state for servo in run.model.servos}
        moving = [name for name in states if name not in servos]
        self._slopes = _slopes(run, theta, self._trials, self._pieces, values, moving)

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
        """Whether errors grow too far over a whole trial, and trials are long enough to be cut."""
        return bool((self.over(1) > TOO_FAR).any()) and self.sections > 1

    def __str__(self) -> str:
        """Along which trial errors grow most, and by how much."""
        whole = self.over(1)
        most = float(whole.max())
        times = "over a million times" if most > 1e6 else f"{float(f'{most:.2g}'):,.0f} times"
        return f"a small error grows {times} along {self._trials[int(whole.argmax())].name!r}"

    @property
    def sections(self) -> int:
        """Fewest sections of the longest trial over most of which a fit follows; as many as samples allow, at most."""
        most = max(len(trial) for trial in self._trials) // FEWEST
        allowed = [count for count in _COUNTS if count <= most]
        followed = (count for count in allowed if float(np.median(self.over(count))) <= _FOLLOWED)
        return next(followed, max(allowed, default=1))

    @property
    def seconds(self) -> float:
        """Length of those sections, s."""
        return self._longest / self.sections


def too_far(problem: EstimationProblem) -> Growth | None:
    """The growth along trials that no run of the model follows, at the values with which the problem begins.

    None where errors grow less, where the options are not of runs, and of a black box, each run of which has its price.
    """
    model, options = problem.model, problem.cost
    if not isinstance(options, TrajectoryOptions) or isinstance(model, BlackBox) or not len(problem.trials):
        return None
    values = problem.space.nominal()
    run = simulator(model, problem.trials, (), values, options.hold, options.max_step, 1)
    states = [channel.name for channel in model.states if channel.name not in {*model.hidden, *model.follows}]
    found = Growth(run, np.zeros(0), problem.trials, values, states)
    return found if found.is_too_far else None


def _slopes(
    whole: Simulator,
    theta: Array,
    trials: Sequence[Trial],
    pieces: Sequence[Segment],
    values: Mapping[str, float],
    moving: Sequence[str],
) -> Array:
    """Change of the last state of each piece by its first, both in spreads of states (pieces, moving, moving)."""
    model, names = whole.model, [channel.name for channel in whole.model.states]
    places, spreads = [names.index(name) for name in moving], spread_of(whole.model, trials)
    spread = np.array([spreads[name] for name in moving])
    begin = np.array([state_at(model, trials[one.parent], one.start, values, {}) for one in pieces])
    run = whole.rebind(trials=[one.trial for one in pieces])

    def ends(x0: Array) -> Array:
        states = run.states(theta, x0)
        return np.array([states[rows.stop - 1, places] for rows in run.rows])

    with np.errstate(all="ignore"):
        before, found = ends(begin), np.zeros((len(pieces), len(moving), len(moving)))
        for column, (place, size) in enumerate(zip(places, spread)):
            moved = begin.copy()
            moved[:, place] += _PART * size
            found[:, :, column] = (ends(moved) - before) / (_PART * spread)
    # Of a piece that diverges nothing is known; that the others part says enough.
    found[~np.isfinite(found).all(axis=(1, 2))] = np.eye(len(moving))
    return found
