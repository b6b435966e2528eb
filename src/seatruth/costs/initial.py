"""Initial states of trials and pieces: taken from the data, or free, with what is known of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seatruth.arrays import Array, Indices
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.segments import Piece, spread_of
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import Simulator
from seatruth.trials.trial import Trial

_CLOSE = 1e-4
"""Standard deviation of a joint between pieces, as a part of how far the state moves. Small beside what data say of a
state, so that the joints hold (estimates move by a hundredth of their error); a tenth of it takes five times as many
steps, three times as much moves estimates by a tenth of their error."""


@dataclass(frozen=True)
class InitialState(Parameter):
    """A free initial state: a parameter whose name tells the trial and the state ("zz10: u")."""

    def __post_init__(self) -> None:
        """Nothing to check: it is made from data, and its name is no identifier."""


@dataclass(frozen=True)
class InitialStates:
    """Which initial states are free. `base` (T, S) are those taken from the data.

    `parameters` are the free ones; the k-th is state `states[k]` of piece `pieces[k]`, and `column_of` (T, S) its place
    (-1 where it is fixed). `names` are the states that are free in any piece, `kept` their numbers.
    """

    base: Array
    parameters: tuple[InitialState, ...]
    pieces: Indices
    states: Indices
    column_of: Indices
    names: tuple[str, ...]
    kept: Indices
    priors: Indices
    """Places among `parameters` of those with a prior."""
    prior_mean: Array
    prior_sd: Array
    along: tuple[tuple[int, int, float], ...] = ()
    """Fixed states (first) that move with another one (second), so much (third)."""

    def of(self, free: Array) -> Array:
        """Initial states of candidates: their free ones (P, F) -> (P, T, S); (T, S) where none is free."""
        if not len(self.parameters):
            return self.base
        found = np.repeat(self.base[None], len(free), axis=0)
        found[:, self.pieces, self.states] = free
        for own, state, sign in self.along:
            found[:, :, own] += sign * (found[:, :, state] - self.base[:, state])
        return found


def initial_states(
    problem: EstimationProblem,
    options: TrajectoryOptions,
    pieces: Sequence[Piece],
    simulator: Simulator,
    theta: Array,
    base: Array,
    trials: Sequence[Trial],
) -> InitialStates:
    """The initial states of a study's pieces; theta (K,) is where their effect on the outputs is looked at.

    A state that no recorded output feels is not freed.
    """
    model = problem.model
    names = [channel.name for channel in model.states]
    spread = spread_of(model, trials)
    found: list[tuple[int, int, InitialState]] = []
    wanted = [
        number
        for number, piece in enumerate(pieces)
        if options.initial == "free" or (options.multiple_shooting and not piece.first)
    ]
    felt = _felt(simulator, pieces, theta, base, spread) if wanted else np.zeros((len(pieces), len(names)), dtype=bool)
    for number in wanted:
        piece = pieces[number]
        told = options.initial_sd if piece.first or not options.multiple_shooting else {}
        for state, channel in enumerate(model.states):
            if felt[number, state] and channel.name not in model.hidden:
                value = float(base[number, state])
                known = problem.noise.get(channel.name)
                sd = told.get(channel.name)
                reach = _reach(spread[channel.name], value, known if isinstance(known, float) else None, sd)
                found.append(
                    (
                        number,
                        state,
                        InitialState(
                            f"{piece.label}: {channel.name}",
                            value,
                            channel.unit,
                            value - reach,
                            value + reach,
                            vary=True,
                            prior=None if sd is None else Prior(value, sd),
                            start=(value - 0.1 * reach, value + 0.1 * reach),
                            source="first samples",
                            description=f"initial {channel.description or channel.name}",
                        ),
                    )
                )
    column_of = np.full((len(pieces), len(names)), -1, dtype=np.intp)
    for k, (number, state, _) in enumerate(found):
        column_of[number, state] = k
    kept = np.flatnonzero((column_of >= 0).any(axis=0))
    parameters = tuple(parameter for _, _, parameter in found)
    with_prior = [k for k, parameter in enumerate(parameters) if parameter.prior is not None]
    told_priors = [parameter.prior for parameter in parameters if parameter.prior is not None]
    return InitialStates(
        base=base,
        parameters=parameters,
        pieces=np.array([number for number, _, _ in found], dtype=np.intp),
        states=np.array([state for _, state, _ in found], dtype=np.intp),
        column_of=column_of,
        names=tuple(names[k] for k in kept),
        kept=kept,
        priors=np.array(with_prior, dtype=np.intp),
        prior_mean=np.array([prior.mean for prior in told_priors]),
        prior_sd=np.array([prior.sd for prior in told_priors]),
        along=tuple((names.index(own), names.index(state), sign) for own, (state, sign) in model.follows.items()),
    )


def _reach(spread: float, value: float, noise: float | None, sd: float | None) -> float:
    """How far from the first sample a state is searched."""
    if sd is not None:
        return 8.0 * sd
    return max(spread, 10.0 * noise if noise is not None else 0.0, 1e-9 * abs(value))


def _felt(
    simulator: Simulator, pieces: Sequence[Piece], theta: Array, base: Array, spread: Mapping[str, float]
) -> NDArray[np.bool_]:
    """(T, S): whether a recorded output of the trial, or another state, feels the state at a piece's start.

    Looked at from two places, as a derivative may happen to vanish in one (a vehicle at rest).
    """
    names = [channel.name for channel in simulator.model.states]
    outputs = [channel.name for channel in simulator.model.outputs]
    size = len(theta)
    found = np.zeros((len(pieces), len(names)), dtype=np.bool_)
    valid = np.isfinite(simulator.measured)
    scale = np.array([spread[name] for name in names])
    for x0 in (base, base + 0.01 * scale):
        derivative = simulator.jacobian(theta, x0, names)
        for number, rows in enumerate(simulator.rows):
            if derivative.diverged[number]:
                # Nothing to go by: those that are recorded themselves.
                recorded = {outputs[k] for k in np.flatnonzero(np.isfinite(simulator.measured[rows]).any(axis=0))}
                found[number] |= np.array([name in recorded for name in names])
                continue
            dy = np.where(valid[rows][:, :, None], derivative.dy[rows][:, :, size:], 0.0)
            found[number] |= (dy != 0).any(axis=(0, 1))
            if len(pieces) > 1:
                moves = derivative.dend[number][:, size:] != 0
                np.fill_diagonal(moves, False)
                found[number] |= moves.any(axis=0) & found[number].any()
    # A state that matters in one piece of a trial matters in all of them: the pieces are one run.
    for parent in {piece.parent for piece in pieces}:
        own = [number for number, piece in enumerate(pieces) if piece.parent == parent]
        found[own] = found[own].any(axis=0)
    return found


@dataclass(frozen=True)
class Joints:
    """Where pieces of a run meet: the end of piece `before[k]` and the free state `states[k]` of piece `after[k]`."""

    before: Indices
    after: Indices
    states: Indices
    sd: Array

    @property
    def size(self) -> int:
        return len(self.sd)


def joints(
    problem: EstimationProblem,
    options: TrajectoryOptions,
    pieces: Sequence[Piece],
    initial: InitialStates,
    trials: Sequence[Trial],
) -> Joints:
    """The joints of multiple shooting; none otherwise. A state that is free in the later piece is joined."""
    found = []
    if options.multiple_shooting:
        spread = spread_of(problem.model, trials)
        for number, piece in enumerate(pieces):
            if not piece.first:
                found += [
                    (number - 1, number, state, _CLOSE * spread[channel.name])
                    for state, channel in enumerate(problem.model.states)
                    if initial.column_of[number, state] >= 0
                ]
    before, after, states = (np.array([row[k] for row in found], dtype=np.intp) for k in range(3))
    return Joints(before, after, states, np.array([row[3] for row in found], dtype=np.float64))
