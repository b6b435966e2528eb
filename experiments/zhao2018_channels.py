"""Studies of the experiment on Zhao, Xie and Qiao 2018: the four channels, and all of them at once.

What is known before the trials is a towing tank's or a panel code's answer [P: where the paper starts from]; here the
truth with the errors of `TANK` [S].
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from seatruth import Model, Parameter, Study
from seatruth.costs import cost_of
from seatruth.costs.options import TrajectoryOptions
from seatruth.models.torpedo import Torpedo
from seatruth.models.torpedo_channels import CHANNELS, FREE, channel
from seatruth.trials import Trial, Trials
from seatruth.trials.prepare import low_pass
from seatruth_optimizers.newton import Newton

Array = NDArray[np.float64]
TRUTH: dict[str, float] = Torpedo("T1").nominal()
TANK: Mapping[str, float] = {
    **{"C_x0": 0.75, "k_1": 1.4, "k_2": 0.8},
    **{"m_x_wx": 1.04, "lambda_44": 0.95},
    **{"C_z_beta": 0.70, "C_z_wy": 1.30, "C_z_dr": 0.75, "lambda_33": 0.9, "m_y_beta": 0.75, "m_y_wy": 1.3},
    **{"m_y_dr": 0.8, "C_y_alpha": 0.70, "C_y_wz": 1.30, "C_y_de": 0.75, "lambda_22": 0.9, "lambda_66": 0.9},
    **{"m_z_alpha": 0.75, "m_z_wz": 1.3, "m_z_de": 0.8, "lambda_26": 1.2},
}
"""[S] What the tank's answer is to the truth; roll is nearly right."""
SURGE_MASS = 0.03 * TRUTH["m"]
"""[S] The added mass in surge that is given, as the forward channel cannot tell it: 0.03 m."""
SEEN: Mapping[str, tuple[str, ...]] = {
    "forward": ("u",),
    "roll": ("p", "phi"),
    "lateral": ("r", "v"),
    "longitudinal": ("q", "w", "theta"),
}
"""Outputs that are fitted. Yaw rate and pitch rate are the paper's [P]; sideslip (the Doppler log's v) makes the forces
identifiable [V], and w and pitch do the same in the longitudinal channel [S]."""
JUDGED: Mapping[str, str] = {"forward": "u", "roll": "phi", "lateral": "r", "longitudinal": "q"}
"""The output whose disagreement decides [P, for roll S]."""
FULL_SEEN = ("u", "v", "w", "p", "q", "r", "phi", "theta", "psi")
SLOW: Mapping[str, float] = {"u": 0.3, "v": 1.0}
"""[S] Hz: recorded velocities that are inputs of a channel are smoothed further, as their noise would drive it."""
DISAGREES = 0.10
"""[S] Root mean square error of the open loop over the channel's own spread from which it needs identification."""
DAMPED, UNDAMPED = Newton(), Newton(damping="none", iterations=60)


def tank(names: Iterable[str]) -> dict[str, float]:
    """What is believed before the trials."""
    found = {name: TRUTH[name] * TANK.get(name, 1.0) for name in names}
    return found | ({"lambda_11": SURGE_MASS} if "lambda_11" in found else {})


def channel_parameters(
    name: str, free: Iterable[str], values: Mapping[str, float] | None = None, *, wide: bool = False
) -> tuple[Parameter, ...]:
    """All of a channel's parameters at these values (the tank's where None), some free; `wide` has no bounds."""
    return _set(channel(name), free, values, wide)


def full_parameters(
    free: Iterable[str], values: Mapping[str, float] | None = None, *, wide: bool = False
) -> tuple[Parameter, ...]:
    """The same for the coupled model."""
    return _set(Torpedo("T1"), free, values, wide)


def channel_trial(name: str, trial: Trial, outputs: Sequence[str] | None = None) -> Trial:
    """A prepared trial as the channel sees it: recorded motions of the others become inputs."""
    model = channel(name)
    for key, cutoff in SLOW.items():
        if key in {c.name for c in model.inputs}:
            trial = low_pass(trial, cutoff=cutoff, channels=[key])
    inputs = {c.name: trial.channel(c.name) for c in model.inputs}
    kept = SEEN[name] if outputs is None else outputs
    return replace(trial, inputs=inputs, outputs={key: trial.channel(key) for key in kept})


def full_trial(trial: Trial, outputs: Sequence[str] = FULL_SEEN) -> Trial:
    """A prepared trial for the coupled model."""
    return replace(trial, outputs={key: trial.outputs[key] for key in outputs})


def study(name: str, trials: Sequence[Trial], parameters: tuple[Parameter, ...], **changes: Any) -> Study:
    """One channel on its runs: maximum likelihood, the covariance of all outputs estimated [P], starts free."""
    fields: dict[str, Any] = {"cost": TrajectoryOptions(criterion="likelihood", initial="free"), **changes}
    return Study(f"zhao2018 {name}", channel(name), Trials(list(trials)), parameters=parameters, **fields)


def full_study(trials: Sequence[Trial], parameters: tuple[Parameter, ...], **changes: Any) -> Study:
    """The coupled model on all fitted runs."""
    fields: dict[str, Any] = {"cost": TrajectoryOptions(criterion="likelihood", initial="free"), **changes}
    return Study("zhao2018 all at once", Torpedo("T1"), Trials(list(trials)), parameters=parameters, **fields)


def open_loop(
    model: Model, values: Mapping[str, float], trials: Sequence[Trial], threads: int | None = None
) -> list[dict[str, Array]]:
    """Outputs of each run simulated under its recorded fins, from the state that fits its first fifth best [P]."""
    given = tuple(
        q.replace(value=float(values.get(q.name, q.value)), min=-math.inf, max=math.inf) for q in model.parameters
    )
    asked = Study("open loop", model, Trials(list(trials)), parameters=given, cost=TrajectoryOptions(initial="free"))
    cost = cost_of(asked, threads=threads)
    names = [c.name for c in model.outputs]
    with threadpool_limits(limits=1, user_api="blas"):  # its matrices are small
        return [dict(zip(names, y.T)) for y in cost.predict(cost.start, list(trials))]


def simulated(model: Model, values: Mapping[str, float], trial: Trial) -> dict[str, Array]:
    """Outputs of a run from its first samples, without looking at the rest."""
    run = Study("open loop", model, Trials([trial])).simulate(values, threads=1)[trial.name]
    return {str(name): run[name].to_numpy() for name in run}


def disagreement(simulated: Mapping[str, Array], trial: Trial, name: str) -> float:
    """Root mean square error of an output over its spread in the run."""
    measured = trial.outputs[name]
    ok = np.isfinite(measured)
    return float(np.sqrt(np.mean((measured - simulated[name])[ok] ** 2)) / np.std(measured[ok]))


def smallest_singular_value(asked: Study, threads: int | None = None) -> float:
    """Of the derivatives by each free parameter, each over its own length: 0 where some combination changes nothing."""
    cost = cost_of(asked, threads=threads)
    cost.reweight(cost.start)
    J = cost.jacobian(cost.start)[:, : len(asked.free)]
    return float(np.linalg.svd(J / np.linalg.norm(J, axis=0), compute_uv=False)[-1])


def _set(model: Model, free: Iterable[str], values: Mapping[str, float] | None, wide: bool) -> tuple[Parameter, ...]:
    chosen = set(free)
    known = tank(q.name for q in model.parameters) if values is None else dict(values)
    found = []
    for q in model.parameters:
        p = q.replace(value=float(known.get(q.name, q.value)), vary=q.name in chosen)
        found.append(p.replace(min=-math.inf, max=math.inf) if wide or not p.min <= p.value <= p.max else p)
    return tuple(found)


ALL_FREE = tuple(q for name in CHANNELS for q in FREE[name] if q != "lambda_11")
"""All that the four channels hold but the mass in surge."""
