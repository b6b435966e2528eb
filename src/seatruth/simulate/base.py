"""The Simulator protocol: what every backend computes, and the shapes in which it answers.

Shapes in this package: P candidates, K free parameters, T trials, N samples of all trials together, S states,
D outputs, F free initial states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, Protocol, get_args

from seatruth.arrays import Array, Flags
from seatruth.errors import BadInput, nearest
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

Backend = Literal["compiled", "reference"]
"""How a model's equations are run: compiled for populations, or step by step in plain Python."""


def check_backend(backend: str) -> None:
    """BadInput names the nearest backend where there is none of this name."""
    if backend not in get_args(Backend):
        raise BadInput(f"backend is {backend!r}", do=nearest(backend, get_args(Backend)))


class SquaredErrors(NamedTuple):
    """`sums` (P, T, D): sums of squared weighted errors, inf where diverged; `x_end` (P, T, S): last states;
    `diverged` (P, T).
    """

    sums: Array
    x_end: Array
    diverged: Flags


class Outputs(NamedTuple):
    """`y` (P, N, D): simulated outputs; `x_end` (P, T, S): last states; `diverged` (P, T).

    Where a candidate diverged, `y` holds numbers that are not finite from that sample on, at the latest.
    """

    y: Array
    x_end: Array
    diverged: Flags


class Jacobian(NamedTuple):
    """One candidate's outputs and last states with their derivatives.

    `y` (N, D), `dy` (N, D, K + F), `x_end` (T, S), `dx_end` (T, S, K + F), `diverged` (T,). Columns 0 to K - 1 are
    derivatives by the free parameters. Column K + j, in the rows of a trial, is the derivative by the j-th free
    initial state of that same trial.
    """

    y: Array
    dy: Array
    x_end: Array
    dx_end: Array
    diverged: Flags


class Simulator(Protocol):
    """A model bound to trials, ready to run; made by `simulator`.

    Every backend gives the same numbers up to rounding, and the same derivatives up to its stated accuracy;
    tests/simulate/test_simulate_reference.py holds them together.
    """

    @property
    def model(self) -> Model:
        """The model that is simulated."""

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that each candidate sets, in the order of theta's columns (K)."""

    @property
    def rows(self) -> list[slice]:
        """Samples of each trial among the N."""

    @property
    def measured(self) -> Array:
        """Recorded outputs (N, D); NaN where a sample is not valid or the channel was not recorded."""

    @property
    def initial_states(self) -> Array:
        """Initial states (T, S) from the trials' first valid samples."""

    @property
    def assumed_zero(self) -> tuple[tuple[str, str], ...]:
        """(trial, channel): outputs that were not recorded and count as zero in the initial state."""

    @property
    def steps(self) -> int:
        """Integration steps of one candidate through all trials."""

    def squared_errors(self, theta: Array, x0: Array, weights: Array) -> SquaredErrors:
        """Sums of squares of (measured - simulated) x weight over each trial, for a population.

        theta (P, K); x0 (T, S), or (P, T, S) where each candidate has its own; weights (N, D). Samples that are not
        valid do not count. Raises ValueError for a wrong shape.
        """

    def outputs(self, theta: Array, x0: Array) -> Outputs:
        """Simulated outputs of a population: theta (P, K), x0 (T, S) or (P, T, S)."""

    def states(self, theta: Array, x0: Array) -> Array:
        """States (N, S) of one candidate at every sample: theta (K,), x0 (T, S)."""

    def jacobian(
        self, theta: Array, x0: Array, free_states: Sequence[str] = (), *, last_states: bool = True
    ) -> Jacobian:
        """Derivatives of one candidate by the free parameters and the named initial states: theta (K,), x0 (T, S).

        A hidden state that the model declares to follow a free one (`Model.follows`) moves with it. Without
        `last_states` the derivatives of the outputs alone are wanted: `dx_end` is then empty, (T, 0, K + F), and many
        parameters, most of them at zero, take much less time. Raises BadInput for a state that the model does not have.
        """

    def rebind(
        self,
        *,
        free: Sequence[str] | None = None,
        values: Mapping[str, float] | None = None,
        trials: Sequence[Trial] | None = None,
    ) -> Simulator:
        """The same model with other free parameters, values or trials (None: as they are); nothing is compiled anew.

        `values` holds every parameter that is not free. Raises BadInput as `simulator` does.
        """

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """Root mean square change (D,) of one candidate's outputs when every step is halved: theta (K,), x0 (T, S).

        NaN where the candidate diverges, or where a simulator cannot say.
        """
