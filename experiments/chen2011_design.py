"""A trial that holds what the benchmark of Chen, Yan and Wang 2011 does not: its elevator is the result of a search.

The elevator is that of the benchmark, with its ten settings free: a switching signal on top of pitch steps that are
held in closed loop, within the same limits of angle and rate. The design minimises the largest relative Cramer-Rao
bound of the 11 parameters, subject to limits of pitch and depth. It uses the true coefficients: it says what a trial
can hold at best; a vehicle that is not known yet would be steered after a first estimate. All [S].
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from chen2011_system import ANGLE, FIRST, FREE, OUTPUTS, PLANT, RATE, STEP, TRUTH, Array
from joblib import Parallel, delayed

from seatruth import Budget, Model, Parameter
from seatruth.costs import Cost
from seatruth.models import Channel
from seatruth.models.longitudinal_plane import LongitudinalPlane, motion
from seatruth.optimizers import Chain, make, minimise
from seatruth.simulate import simulator
from seatruth.trials import Trial

LEVEL = 0.03
"""Noise at which the bounds are computed; they are in proportion to it."""
PITCH, SHALLOWEST, DEEPEST = math.radians(45.0), 5.0, 115.0
"""Limits of the motion: rad, m, m."""
SETTINGS: tuple[Parameter, ...] = (
    Parameter("pitch", math.radians(25.0), "rad", 0.0, math.radians(45.0), vary=True, description="of the steps"),
    Parameter("period", 20.0, "s", 4.0, 60.0, vary=True, scale="log", description="of the steps"),
    Parameter("middle", 0.0, "rad", -0.4, 0.4, vary=True, description="pitch between the steps"),
    Parameter("k_theta", 2.0, "1", 0.01, 5.0, vary=True, scale="log", description="gain of the pitch error"),
    Parameter("k_q", 1.5, "s", 0.1, 30.0, vary=True, scale="log", description="gain of the pitch rate"),
    Parameter("dither", math.radians(8.0), "rad", 0.0, 2.0 * ANGLE, vary=True, description="size of the switching"),
    Parameter("period_1", 3.1, "s", 0.6, 12.0, vary=True, scale="log", description="of the switching"),
    Parameter("period_2", 1.7, "s", 0.6, 12.0, vary=True, scale="log", description="of the switching"),
    Parameter("share_2", 0.7, "1", 0.0, 2.0, vary=True, description="weight of the second period"),
    Parameter("phase_2", 0.0, "rad", -math.pi, math.pi, vary=True, description="of the second period"),
)
_LAG = 0.05
"""s: how fast the elevator follows its order below its fastest rate."""


class SteeredPlane(Model):
    """The plant with its elevator as a state, steered in closed loop: what a design tries many settings of at once."""

    name = "steered_plane"
    title = "Longitudinal plane under a pitch controller and a switching elevator"
    kind = "auv"
    source = "[S] chosen here"
    states = (*LongitudinalPlane.states, Channel("delta_s", "rad", "elevator angle"))
    outputs = states
    parameters = (*PLANT.parameters, *SETTINGS)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        turn = 2.0 * math.pi * e.t
        step = math.copysign(p.pitch, math.sin(turn / p.period))
        switch = math.sin(turn / p.period_1) + p.share_2 * math.sin(turn / p.period_2 + p.phase_2)
        order = -(p.k_theta * (p.middle + step - s.theta) - p.k_q * s.q) + math.copysign(p.dither, switch)
        order = max(-ANGLE, min(ANGLE, order))
        turning = max(-RATE, min(RATE, (order - s.delta_s) / _LAG))
        return (*motion(s, s.delta_s, p, e, 0.0), turning)


def steered(settings: Array, seconds: float, step: float = STEP) -> Array:
    """Elevator angles (P, n) that these settings (P, 10) give in a trial of `seconds`."""
    t = _times(seconds, step)
    model = SteeredPlane()
    bare = _trial("steered", t, {}, {channel.name: FIRST.get(channel.name, 0.0) for channel in model.outputs})
    free = tuple(setting.name for setting in SETTINGS)
    sim = simulator(model, [bare], free=free, values=model.nominal(), threads=1)
    return np.asarray(sim.outputs(settings, sim.initial_states).y[:, :, -1])


def trial(elevator: Array, step: float = STEP, name: str = "designed") -> Trial:
    """The record, without noise, of a run from the benchmark's start under this elevator (n,)."""
    t = _times((len(elevator) - 1) * step, step)
    bare = _trial(name, t, {"delta_s": elevator}, {q: FIRST.get(q, 0.0) for q in OUTPUTS})
    sim = simulator(PLANT, [bare], values=TRUTH, threads=1)
    y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
    return Trial(name, t, {"delta_s": elevator}, dict(zip(OUTPUTS, y.T)), synthetic=True)


class DesignCost(Cost):
    """Largest relative bound (per cent, at 3 % noise), and a steep penalty for motion outside the limits."""

    def __init__(self, seconds: float, workers: int) -> None:
        self.seconds, self.workers = seconds, workers
        self.parameters = SETTINGS
        self.gives = frozenset({"values"})
        self.description = {"design": seconds}

    def values(self, X: Array) -> Array:
        elevators = steered(np.asarray(X), self.seconds)
        parts = np.array_split(elevators, max(1, min(self.workers, len(X))))
        found = Parallel(self.workers, prefer="threads")(delayed(_worst)(part) for part in parts)
        return np.concatenate(found)


def _worst(elevators: Array) -> Array:
    """The cost of each elevator record: (P, n) -> (P,)."""
    t = _times((elevators.shape[1] - 1) * STEP, STEP)
    first = {q: FIRST.get(q, 0.0) for q in OUTPUTS}
    trials = [_trial(str(k), t, {"delta_s": angle}, first) for k, angle in enumerate(elevators)]
    truth = np.array([TRUTH[name] for name in FREE])
    sim = simulator(PLANT, trials, free=FREE, values=TRUTH, threads=1)
    run = sim.jacobian(truth, sim.initial_states)
    found = np.full(len(trials), np.inf)
    for k, rows in enumerate(sim.rows):
        y = run.y[rows]
        if run.diverged[k] or not np.isfinite(run.dy[rows]).all():
            continue
        sd = LEVEL * np.abs(y).max(axis=0)
        J = (run.dy[rows][1:] / sd[:, None]).reshape(-1, len(FREE)) * truth
        with np.errstate(all="ignore"):
            bound = 100.0 * np.sqrt(np.diag(np.linalg.pinv(J.T @ J, hermitian=True)))
        theta, depth = y[:, OUTPUTS.index("theta")], y[:, OUTPUTS.index("z")]
        beyond = max(0.0, float(np.abs(theta).max()) - PITCH) / math.radians(1.0)
        beyond += max(0.0, SHALLOWEST - float(depth.min()), float(depth.max()) - DEEPEST)
        found[k] = float(bound.max()) + 10.0 * beyond
    found[~np.isfinite(found)] = np.inf
    return found


def search(seconds: float, evaluations: int, seed: int, workers: int) -> tuple[dict[str, float], Trial]:
    """The settings found by Differential Swarm and then CMA-ES around its best, and the run without noise."""
    chain = Chain((make("differential_swarm", particles=40, omega=1.0), make("cma_es", sigma=0.05)))
    out = minimise(DesignCost(seconds, workers), chain, seed=seed, budget=Budget(evaluations))
    return dict(zip((q.name for q in SETTINGS), out.x.tolist())), trial(steered(out.x[None], seconds)[0])


def _times(seconds: float, step: float) -> Array:
    return np.arange(round(seconds / step) + 1, dtype=np.float64) * step


def _trial(name: str, t: Array, inputs: Mapping[str, Array], first: Mapping[str, float]) -> Trial:
    """A trial that says where a run starts and how it is steered."""
    return Trial(name, t, dict(inputs), {q: np.full(len(t), value) for q, value in first.items()}, synthetic=True)
