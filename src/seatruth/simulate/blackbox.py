"""The same interface for a user's own simulator."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from seatruth.arrays import Array
from seatruth.models.black_box import BlackBox
from seatruth.simulate.serial import SerialSimulator
from seatruth.simulate.setup import Setup
from seatruth.trials.trial import Trial


class BlackBoxSimulator(SerialSimulator):
    """Runs a BlackBox: one call of its function for each candidate and trial.

    A state is the output of the same name. `steps` counts the intervals between samples, as a black box does not say
    how it integrates.
    """

    def __init__(self, setup: Setup, model: BlackBox) -> None:
        super().__init__(setup, len(setup.measured) - len(setup.trials))
        self._box = model
        outputs = [channel.name for channel in model.outputs]
        self._states = [channel.name for channel in model.states]
        self._state_outputs = [outputs.index(name) for name in self._states]

    def rebind(
        self,
        *,
        free: Sequence[str] | None = None,
        values: Mapping[str, float] | None = None,
        trials: Sequence[Trial] | None = None,
    ) -> BlackBoxSimulator:
        """See `Simulator.rebind`."""
        return BlackBoxSimulator(self._setup.changed(free, values, trials), self._box)

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """Not known of a black box: NaN for every output, (D,)."""
        return np.full(self.measured.shape[1], math.nan)

    def _run(self, values: Array, trial: int, x0: Array) -> tuple[Array, Array]:
        parameters = dict(zip(self._setup.parameters.names, values.tolist()))
        first = dict(zip(self._states, x0.tolist())) if self._states else None
        y = self._box.run(self._setup.trials[trial], parameters, first)
        return y, y[:, self._state_outputs]
