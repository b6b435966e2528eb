"""Initial states of segments: fixed from the data, or free, with priors and continuity constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array, Indices
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.segments import Segment, spread_of
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import Simulator
from seatruth.trials.trial import Trial

_DEFECT_SD = 1e-4
"""Standard deviation of a defect (the gap between two segments), as a part of the state's spread.

Chosen here by trial [S]. It must be small against what the data say of a state, so that the segments join: estimates
then move by a hundredth of their standard error. A tenth of it takes five times as many steps of the solver; three
times it moves estimates by a tenth of their standard error.
"""
_RADIUS_SD = 8.0
"""Search radius of a free initial state in standard deviations of its prior (chosen here [S]: wider than any error)."""
_RADIUS_NOISE = 10.0
"""Smallest search radius of a free initial state in standard deviations of its noise (chosen here [S]: the same)."""
_PROBE = 0.01
"""Displacement of the second state for the test of observability, as a part of the spread (chosen here [S])."""


@dataclass(frozen=True)
class InitialState(Parameter):
    """A free initial state: a parameter whose name holds the trial and the state ("zz10: u")."""

    def __post_init__(self) -> None:
        """Checks nothing: it is made from data, and its name is no identifier."""


@dataclass(frozen=True)
class InitialStates:
    """Initial states of T segments of a model with S states, F of them free.

    `base` (T, S) are those taken from the data. `parameters` are the free ones; the k-th is state `states[k]` of
    segment `segments[k]`, and `column_of` (T, S) is its index among the free ones (-1 where the state is fixed).
    `names` are the states that are free in any segment, `kept` their indices.
    """

    base: Array
    parameters: tuple[InitialState, ...]
    segments: Indices
    states: Indices
    column_of: Indices
    names: tuple[str, ...]
    kept: Indices
    priors: Indices
    """Indices among `parameters` of those with a prior."""
    prior_mean: Array
    prior_sd: Array
    along: tuple[tuple[int, int, float], ...] = ()
    """(state, leader, factor): fixed states that start where another state does."""

    def of(self, free: Array) -> Array:
        """Initial states of candidates from their free ones: (P, F) -> (P, T, S), or (T, S) where none is free."""
        if not len(self.parameters):
            return self.base
        x0 = np.repeat(self.base[None], len(free), axis=0)
        x0[:, self.segments, self.states] = free
        for state, leader, factor in self.along:
            x0[:, :, state] += factor * (x0[:, :, leader] - self.base[:, leader])
        return x0


def initial_states(
    problem: EstimationProblem,
    options: TrajectoryOptions,
    segments: Sequence[Segment],
    simulator: Simulator,
    theta: Array,
    base: Array,
    trials: Sequence[Trial],
) -> InitialStates:
    """The initial states of the segments. Unobservable ones stay fixed; theta (K,) is where that is tested.

    An actuator behind a servo stands where its first order is, unless `initial_sd` states how well that is known: the
    record hardly shows where it stood, and a search creeps along what does not matter.
    """
    model = problem.model
    servos = {servo.state for servo in model.servos}
    names = [channel.name for channel in model.states]
    spread = spread_of(model, trials)
    free: list[tuple[int, int, InitialState]] = []
    wanted = [
        number
        for number, segment in enumerate(segments)
        if options.initial == "free" or (options.multiple_shooting and not segment.first)
    ]
    if wanted:
        observable = _observable(simulator, segments, theta, base, spread)
    else:
        observable = np.zeros((len(segments), len(names)), dtype=bool)
    for number in wanted:
        segment = segments[number]
        stated = options.initial_sd if segment.first or not options.multiple_shooting else {}
        for state, channel in enumerate(model.states):
            sd = stated.get(channel.name)
            stands = channel.name in servos and segment.first and sd is None
            if observable[number, state] and channel.name not in model.hidden and not stands:
                value = float(base[number, state])
                noise = problem.noise.get(channel.name)
                radius = _search_radius(spread[channel.name], value, noise if isinstance(noise, float) else None, sd)
                parameter = InitialState(
                    f"{segment.label}: {channel.name}",
                    value,
                    channel.unit,
                    value - radius,
                    value + radius,
                    vary=True,
                    prior=None if sd is None else Prior(value, sd),
                    start=(value - 0.1 * radius, value + 0.1 * radius),
                    source="first samples",
                    description=f"initial {channel.description or channel.name}",
                )
                free.append((number, state, parameter))
    column_of = np.full((len(segments), len(names)), -1, dtype=np.intp)
    for k, (number, state, _) in enumerate(free):
        column_of[number, state] = k
    kept = np.flatnonzero((column_of >= 0).any(axis=0))
    parameters = tuple(parameter for _, _, parameter in free)
    priors = [parameter.prior for parameter in parameters if parameter.prior is not None]
    return InitialStates(
        base=base,
        parameters=parameters,
        segments=np.array([number for number, _, _ in free], dtype=np.intp),
        states=np.array([state for _, state, _ in free], dtype=np.intp),
        column_of=column_of,
        names=tuple(names[k] for k in kept),
        kept=kept,
        priors=np.array([k for k, q in enumerate(parameters) if q.prior is not None], dtype=np.intp),
        prior_mean=np.array([prior.mean for prior in priors]),
        prior_sd=np.array([prior.sd for prior in priors]),
        along=tuple((names.index(name), names.index(leader), sign) for name, (leader, sign) in model.follows.items()),
    )


def _search_radius(spread: float, value: float, noise: float | None, sd: float | None) -> float:
    """Distance from the first sample within which a state is searched."""
    if sd is not None:
        return _RADIUS_SD * sd
    return max(spread, _RADIUS_NOISE * noise if noise is not None else 0.0, 1e-9 * abs(value))


def _observable(
    simulator: Simulator, segments: Sequence[Segment], theta: Array, base: Array, spread: Mapping[str, float]
) -> NDArray[np.bool_]:
    """(T, S): whether an initial state of a segment changes a recorded output of its trial, or another state.

    Tested at two states, as a derivative may happen to vanish at one (a vehicle at rest).
    """
    names = [channel.name for channel in simulator.model.states]
    outputs = [channel.name for channel in simulator.model.outputs]
    size = len(theta)
    observable = np.zeros((len(segments), len(names)), dtype=np.bool_)
    valid = np.isfinite(simulator.measured)
    scale = np.array([spread[name] for name in names])
    for x0 in (base, base + _PROBE * scale):
        derivative = simulator.jacobian(theta, x0, names)
        for number, rows in enumerate(simulator.rows):
            if derivative.diverged[number]:
                # The derivatives say nothing here; states that are recorded themselves are observable.
                recorded = {outputs[k] for k in np.flatnonzero(np.isfinite(simulator.measured[rows]).any(axis=0))}
                observable[number] |= np.array([name in recorded for name in names])
                continue
            dy = np.where(valid[rows][:, :, None], derivative.dy[rows][:, :, size:], 0.0)
            observable[number] |= (dy != 0).any(axis=(0, 1))
            if len(segments) > 1:
                moves = derivative.dx_end[number][:, size:] != 0
                np.fill_diagonal(moves, False)
                observable[number] |= moves.any(axis=0) & observable[number].any()
    # A state that is observable in one segment of a trial is so in all of them: they are one run.
    for parent in {segment.parent for segment in segments}:
        of_trial = [number for number, segment in enumerate(segments) if segment.parent == parent]
        observable[of_trial] = observable[of_trial].any(axis=0)
    return observable


@dataclass(frozen=True)
class Continuity:
    """Continuity constraints of multiple shooting, J of them.

    The end of segment `before[k]` and the free initial state `states[k]` of segment `after[k]` must agree to within
    `sd[k]`, in the state's unit; their difference is the defect.
    """

    before: Indices
    after: Indices
    states: Indices
    sd: Array

    @property
    def size(self) -> int:
        return len(self.sd)


def continuity(
    problem: EstimationProblem,
    options: TrajectoryOptions,
    segments: Sequence[Segment],
    initial: InitialStates,
    trials: Sequence[Trial],
) -> Continuity:
    """The continuity constraints: one for every free state of a segment that is not the first of its trial."""
    rows = []
    if options.multiple_shooting:
        spread = spread_of(problem.model, trials)
        for number, segment in enumerate(segments):
            if not segment.first:
                rows += [
                    (number - 1, number, state, _DEFECT_SD * spread[channel.name])
                    for state, channel in enumerate(problem.model.states)
                    if initial.column_of[number, state] >= 0
                ]
    before, after, states = (np.array([row[k] for row in rows], dtype=np.intp) for k in range(3))
    return Continuity(before, after, states, np.array([row[3] for row in rows], dtype=np.float64))
