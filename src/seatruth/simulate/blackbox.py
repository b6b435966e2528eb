"""The same interface for a user's own simulator."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from seatruth.arrays import Array
from seatruth.errors import PluginError
from seatruth.models.base import whole_name
from seatruth.models.black_box import BlackBox, RunFailed
from seatruth.models.isolated import isolated_in
from seatruth.simulate.meter import Meter
from seatruth.simulate.serial import RELATIVE_STEP, SerialSimulator
from seatruth.simulate.setup import Setup
from seatruth.trials.trial import Trial

_PROBE = 1e-10
"""Step over the size of a parameter with which the simulator's own noise is looked for: so small that a smooth
simulator shows nothing of its curvature there, 1e-20 of its outputs. [S]"""
_LEAST_NOISE = 1e-15
"""Noise over the size of the outputs that any sum of doubles has: a few roundings. [S]"""
_LARGEST_STEP = 1e-2
"""Largest step of a difference over the size of the parameter: beyond, it is no derivative any more. [S]"""


class BlackBoxSimulator(SerialSimulator):
    """Runs a BlackBox: one call of its function for each candidate and trial.

    A state is the output of the same name. `steps` counts the intervals between samples, as a black box does not say
    how it integrates. One that runs in processes of its own is expensive: it is run on `threads` processes at once, its
    derivatives are forward differences, and their step is chosen by the noise of its outputs.
    """

    def __init__(
        self,
        setup: Setup,
        model: BlackBox,
        threads: int = 1,
        meter: Meter | None = None,
        noise: float | None = None,
    ) -> None:
        super().__init__(setup, len(setup.measured) - len(setup.trials))
        self._box, self._threads, self._meter, self._noise = model, threads, meter, noise
        outputs = [channel.name for channel in model.outputs]
        self._states = [channel.name for channel in model.states]
        self._state_outputs = [outputs.index(name) for name in self._states]
        self._isolated = isolated_in(model)

    def rebind(
        self,
        *,
        free: Sequence[str] | None = None,
        values: Mapping[str, float] | None = None,
        trials: Sequence[Trial] | None = None,
    ) -> BlackBoxSimulator:
        """See `Simulator.rebind`."""
        setup = self._setup.changed(free, values, trials)
        return BlackBoxSimulator(setup, self._box, self._threads, self._meter, self._noise)

    def unmetered(self) -> BlackBoxSimulator:
        """The same, for what costs no run: effects on outputs of a run that is kept."""
        return BlackBoxSimulator(self._setup, self._box, self._threads, None, self._noise)

    def discretisation_error(self, theta: Array, x0: Array) -> Array:
        """Not known of a black box: NaN for every output, (D,)."""
        return np.full(self.measured.shape[1], math.nan)

    def _run(self, values: Array, trial: int, x0: Array) -> tuple[Array, Array]:
        parameters = dict(zip(self._setup.parameters.names, values.tolist()))
        first = dict(zip(self._states, x0.tolist())) if self._states else None
        try:
            y = self._box.run(self._setup.trials[trial], parameters, first)
        except RunFailed as problem:
            inner = self._box.innermost
            # One that never gave anything for a trial has a fault; one that gives up at some parameters has diverged.
            if self._isolated is not None or whole_name(self._setup.trials[trial].name) not in inner.succeeded:
                raise
            inner.failed = {**inner.failed, problem.what: inner.failed.get(problem.what, 0) + 1}
            y = np.full((len(self._setup.trials[trial]), len(self._box.outputs)), math.nan)
        return y, y[:, self._state_outputs]

    def _all(self, run: Callable[[tuple[int, int]], None], jobs: Sequence[tuple[int, int]]) -> None:
        if self._meter is not None:
            self._meter.spend(len(jobs))
        isolated = self._isolated
        if isolated is None:
            super()._all(run, jobs)
            return
        if self._threads == 1 or len(jobs) == 1:
            super()._all(run, jobs)
        else:
            with ThreadPoolExecutor(min(self._threads, len(jobs)), thread_name_prefix="simulator") as pool:
                futures = [pool.submit(run, job) for job in jobs]
                try:
                    for future in futures:
                        future.result()
                except BaseException:
                    pool.shutdown(wait=False, cancel_futures=True)
                    isolated.stop()
                    raise
        counts = isolated.counts
        if not counts.succeeded and counts.failures:
            reason, number = counts.failures.most_common(1)[0]
            raise PluginError(
                f"the simulator failed in each of its first {counts.simulated} runs: {number} times {reason}",
                where=f"model {self._box.name!r}",
                do="Run it by itself with the same inputs and parameters; if it is only slow, raise its time limit.",
            )

    def _signs(self) -> tuple[float, ...]:
        return super()._signs() if self._isolated is None else (1.0,)

    def _step(self, theta: Array, x0: Array, columns: Sequence[int], variable: int) -> Array:
        step = super()._step(theta, x0, columns, variable)
        if self._isolated is None:
            return step
        if self._noise is None:
            self._noise = self.noise(theta, x0)
        return np.asarray(step * (math.sqrt(self._noise) / RELATIVE_STEP))

    def noise(self, theta: Array, x0: Array) -> float:
        """Noise of the outputs over their spread: what a change of the parameters by nearly nothing changes in them.

        Second differences along a line, as in J. J. Moré and S. M. Wild, Estimating computational noise, SIAM J. Sci.
        Comput. 33 (2011) 1292: an integrator with a step control has noise of its tolerance, others of rounding. The
        step of a forward difference is then the root of that.
        """
        line = np.arange(3.0)
        sizes = np.array([abs(x) or abs(self.model.parameter(n).value) or 1.0 for x, n in zip(theta, self.free)])
        if len(theta):
            thetas, starts = theta + _PROBE * line[:, None] * sizes, np.stack([x0] * 3)
        else:
            thetas, starts = np.zeros((3, 0)), x0 * (1.0 + _PROBE * line[:, None, None])
        y = self.outputs(thetas, starts).y
        spread = np.ptp(y[0], axis=0)
        with np.errstate(all="ignore"):
            second = (y[0] - 2.0 * y[1] + y[2]) / math.sqrt(6.0)  # noise of unit size gives one of sqrt(1 + 4 + 1)
            noise = np.sqrt(np.mean(second**2, axis=0)) / np.maximum(spread, 1e-12 * np.abs(y[0]).max(axis=0))
        finite = noise[np.isfinite(noise)]
        return float(min(max(finite.max(initial=0.0), _LEAST_NOISE), _LARGEST_STEP**2))
