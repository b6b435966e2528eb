"""What one kernel integrates: equations, with or without their derivatives along a direction; and the directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from seatruth.arrays import Array, Indices
from seatruth.simulate.compiler.derivatives import directional_derivatives
from seatruth.simulate.compiler.kernels import servo_values
from seatruth.simulate.compiler.node import BOTH, LANE, Node
from seatruth.simulate.compiler.trace import Driven, Equations


class System(NamedTuple):
    """Equations that one kernel integrates: its states, what they follow, and what a candidate sets."""

    states: tuple[Node, ...]
    rates: tuple[Node, ...]
    outputs: tuple[Node, ...]
    parameters: tuple[Node, ...]
    driven: tuple[Driven, ...]


class Directions(NamedTuple):
    """Directions of K parameters and F initial states, in which a run is differentiated.

    `columns` (K,) and `free_states` (F,) are places among the parameters and the states. `following`: states that move
    with a free one, as (place in `free_states`, state, sign).
    """

    columns: Indices
    free_states: Sequence[int]
    following: Sequence[tuple[int, int, float]]

    @property
    def size(self) -> int:
        """K + F."""
        return len(self.columns) + len(self.free_states)

    def first_states(self, states: int) -> Array:
        """How so many states move at the start of a trial (K + F, S)."""
        moves = np.zeros((self.size, states))
        moves[len(self.columns) + np.arange(len(self.free_states)), np.array(self.free_states, dtype=np.intp)] = 1.0
        for leader, follower, sign in self.following:
            moves[len(self.columns) + leader, follower] = sign
        return moves


def differentiated(e: Equations, groups: int = 1) -> System:
    """The equations, followed by their derivatives along so many directions in parameters and states.

    A lane has one direction of each group, and the values that all of them need once.
    """
    parts = [_along(e, group) for group in range(groups)]
    return System(
        (*e.states, *(node for part in parts for node in part.states)),
        (*e.rates, *(node for part in parts for node in part.rates)),
        (*e.outputs, *(node for part in parts for node in part.outputs)),
        (*e.parameters, *(node for part in parts for node in part.parameters)),
        (*e.driven, *(servo for part in parts for servo in part.driven)),
    )


def _along(e: Equations, group: int) -> System:
    """The derivatives along one direction."""
    sizes = len(e.parameters), len(e.states), len(e.driven)
    dp = [e.graph.leaf("parameter direction", group * sizes[0] + k, LANE) for k in range(sizes[0])]
    dx = [e.graph.leaf("state direction", group * sizes[1] + k, BOTH) for k in range(sizes[1])]
    da = [e.graph.leaf("acting direction", group * sizes[2] + k, BOTH) for k in range(sizes[2])]
    acting = [servo.acting for servo in e.driven]
    directions = {id(leaf): d for leaf, d in (*zip(e.parameters, dp), *zip(e.states, dx), *zip(acting, da))}
    derivatives = directional_derivatives([*e.rates, *e.outputs], directions)
    size = len(e.rates)
    moves = directional_derivatives(servo_values(e.driven), directions)
    along = {id(state): direction for state, direction in zip(e.states, dx)}
    driven = tuple(Driven(along[id(e.driven[k].state)], da[k], *moves[3 * k : 3 * k + 3]) for k in range(len(da)))
    return System(tuple(dx), tuple(derivatives[:size]), tuple(derivatives[size:]), tuple(dp), driven)


def differentiated_rates(e: Equations) -> System:
    """The derivatives of the rates alone, along a direction in parameters."""
    dp = [e.graph.leaf("parameter direction", k, LANE) for k in range(len(e.parameters))]
    directions = {id(leaf): d for leaf, d in zip(e.parameters, dp)}
    return System(e.states, tuple(directional_derivatives(e.rates, directions)), (), (*e.parameters, *dp), ())
