"""seatruth's own engine on the workloads, through its public interface."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from engines.python_peers import SCALAR
from engines.workloads import Workload, workload
from seatruth.errors import SeatruthError
from seatruth.models.base import Environment, Model, record
from seatruth.trials.trial import Trial

Array = NDArray[np.float64]


def model_of(job: Workload) -> Model:
    """seatruth's model of a workload, with the workload's own choice of outputs checked."""
    if job.name == "A":
        from seatruth.models.diving_plane import DivingPlane

        return DivingPlane()
    from engines.ordered_ship import OrderedShip

    return OrderedShip()


def trial_of(job: Workload, model: Model, name: str) -> Trial:
    """The workload's record as a Trial; outputs of the model that the workload does not weigh are not valid."""
    nothing = np.full(len(job.t), math.nan)
    measured = dict(zip(job.outputs, job.measured.T))
    return Trial(
        name=name,
        t=job.t,
        inputs=dict(zip(job.input_names, job.inputs.T)),
        outputs={channel.name: measured.get(channel.name, nothing) for channel in model.outputs},
        synthetic=True,
    )


class Seatruth:
    """`Simulator.squared_errors` over one or several trials of a workload."""

    def __init__(self, job: Workload, threads: int, seed: int, trials: int = 1) -> None:
        from seatruth.simulate import simulator

        self.job, self.model = job, model_of(job)
        jobs = [job] + [workload(job.name, seed, programme=n) for n in range(1, trials)]
        records = [trial_of(one, self.model, f"trial {n + 1}") for n, one in enumerate(jobs)]
        self.simulator = simulator(
            self.model, records, free=job.free, values=values_of(job, self.model), hold=job.hold, threads=threads
        )
        want = (len(job.t) - 1) * trials
        if self.simulator.steps != want:
            raise SeatruthError(f"the engine takes {self.simulator.steps} steps, the peers take {want}")
        order = [job.states.index(channel.name) for channel in self.model.states]
        self.x0 = np.tile(job.x0[order], (trials, 1))
        weigh = dict(zip(job.outputs, job.weights))
        row = np.array([weigh.get(channel.name, 0.0) for channel in self.model.outputs])
        self.weights = np.tile(row, (len(job.t) * trials, 1))
        self.weights.setflags(write=False)  # as a cost gives them: they are put onto the measurements once

    def costs(self, theta: Array) -> Array:
        """Squared-error cost of each candidate; shape (P,)."""
        return np.asarray(self.simulator.squared_errors(theta, self.x0, self.weights).sums.sum(axis=(1, 2)))

    def costs_from(self, theta: Array, x0: Array) -> Array:
        """The same with the candidates' own initial states, x0 (P, T, S)."""
        return np.asarray(self.simulator.squared_errors(theta, x0, self.weights).sums.sum(axis=(1, 2)))

    def initial_states(self, size: int, seed: int) -> Array:
        """Initial states spread about the record's, one a candidate and trial; shape (P, T, S)."""
        spread = np.random.default_rng(seed).normal(size=(size, *self.x0.shape))
        return np.asarray(self.x0 + 0.01 * spread)

    def jacobian(self, theta: Array) -> Array:
        """Derivatives of the workload's outputs; shape (N - 1, D, K)."""
        names = [channel.name for channel in self.model.outputs]
        dy = self.simulator.jacobian(theta, self.x0).dy
        return np.asarray(dy[1:][:, [names.index(name) for name in self.job.outputs]])


def values_of(job: Workload, model: Model) -> dict[str, float]:
    """The workload's values of all the model's parameters (the model's own for those the workload does not have)."""
    unknown = sorted(set(job.values) - set(model.nominal()))
    if unknown:
        raise SeatruthError(f"workload {job.name} names {unknown}, which model {model.name!r} does not have")
    return {**model.nominal(), **job.values}


def difference_of_equations(job: Workload, seed: int) -> float:
    """Largest relative difference of the peers' right-hand side from seatruth's model, around the record's states."""
    model = model_of(job)
    p = record("Parameters", model.parameters)(**values_of(job, model))
    k = job.constants(job.parameters(job.nominal.tolist()))
    state, inputs = record("States", model.states), record("Inputs", model.inputs)
    rng, worst = np.random.default_rng(seed), 0.0
    for _ in range(50):
        s = tuple((job.x0 + rng.normal(size=len(job.x0)) * 0.1).tolist())
        i = tuple((job.inputs[rng.integers(len(job.inputs))]).tolist())
        theirs = dict(zip(job.states, job.rhs(SCALAR, s, i, k)))
        arguments = [state(**dict(zip(job.states, s))), inputs(**dict(zip(job.input_names, i))), p, Environment()]
        ours = dict(zip((c.name for c in model.states), model.rhs(*arguments)))
        scale = max(abs(v) for v in ours.values())
        worst = max(worst, *(abs(ours[n] - theirs[n]) / max(abs(ours[n]), 1e-3 * scale) for n in job.states))
    return worst
