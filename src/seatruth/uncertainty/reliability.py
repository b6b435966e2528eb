"""Signs that the answer as a whole is wrong, whatever its standard errors say.

A standard error holds at the minimum that the search ended at. It says nothing where that is the wrong minimum: there
the simulated runs leave the recorded ones altogether, or a free initial state ends far from what was first measured.
And it says nothing of a search that ended short of any minimum.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from seatruth.arrays import Array, Flags
from seatruth.costs.growth import too_far
from seatruth.costs.initial import InitialState
from seatruth.costs.study_cost import StudyCost
from seatruth.text import listed
from seatruth.trials.channel import Channel
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial

# Without a source these are chosen here [S].
_ABOVE_NOISE = 3.0
"""Noise that an error must exceed before its size is compared with the motion."""
_TURN = math.pi / 4.0
"""Root mean square error of an angle from which a run strays: an eighth of a turn."""
_QUIET = 0.1
"""Part of its usual motion below which a channel hardly moves: the depth of a level leg, or the rate of turn of a
straight one, whose record is noise, is no stray."""
_OUTLIER, _OUTLIER_OF_OTHERS = 30.0, 10.0
"""Error over noise of a run, and over that of the other runs, from which it is far beyond both."""
_FAR_PRIORS = 5.0
"""Prior standard deviations between an initial state and its first samples that are far."""
_FAR_NOISE, _FAR_MOTION = 10.0, 0.25
"""Noise, and part of the motion, between an initial state without prior and its first samples that are far."""
_SHORT = 0.1
"""What the cost could still fall by from which a search ended short: 0.45 standard errors along one direction."""
_ABOVE_STATED = 5.0
"""The same of positions and angles of stated noise, beside which a sensor may have slow errors of twice its size."""
_ABOVE_ROUGHNESS, _LEAST_ANGLE = 10.0, math.radians(1.0)
"""The same of angles whose noise nobody stated, and the least error of an angle that is said."""
_ROOM = 1e-300
"""Room that a solver of bounded problems needs between two bounds."""
_MOST_NAMED = 3


@dataclass(frozen=True)
class Stray:
    """A run whose simulation has left the record in one channel. `size` is what the error exceeds, in words."""

    trial: str
    channel: Channel
    rmse: float
    size: str

    def __str__(self) -> str:
        return f"{self.trial!r} ({self.channel.name} by {_shown(self.rmse, self.channel)}, {self.size})"


def stray_runs(cost: StudyCost, predicted: Sequence[Array]) -> list[Stray]:
    """Runs that stray, each with the channel in which it does so most plainly.

    A run strays where its root mean square error is beyond the noise and as large as the motion itself: an angle by an
    eighth of a turn, a position by the spread of the positions, anything else by the size of its like (all speeds
    together, all rates together). It also strays where it alone is missed by far more than its stated noise.

    Args:
        cost: The cost with its trials and its noise.
        predicted: Outputs (n, D) of each trial, simulated from its start.
    """
    channels = cost.problem.model.outputs
    ratios = _noise_ratios(cost, predicted)
    least = [
        _QUIET * float(np.nanmedian([motion(trial, channels, channel) for trial in cost.trials]))
        if any(channel.name in trial.outputs for trial in cost.trials)
        else 0.0
        for channel in channels
    ]
    found = []
    for number, (trial, y) in enumerate(zip(cost.trials, predicted)):
        worst: tuple[float, Stray] | None = None
        for column, channel in enumerate(channels):
            rmse = _rms(_errors(trial, channel, y[:, column]))
            if not rmse > _ABOVE_NOISE * _noise(cost, trial, channel):
                continue
            size = max(motion(trial, channels, channel), least[column])
            far = rmse / (_TURN if channel.angle else size)
            text = "an eighth of a turn or more" if channel.angle else f"its motion is {_shown(size, channel)}"
            others = np.delete(ratios[:, column], number)
            others = others[np.isfinite(others)]
            if far < 1.0 and others.size and ratios[number, column] > _OUTLIER:
                far = ratios[number, column] / max(_OUTLIER, _OUTLIER_OF_OTHERS * float(np.median(others)))
                text = f"{ratios[number, column]:.0f} times its noise, unlike the other runs"
            if far >= 1.0 and (worst is None or far > worst[0]):
                worst = far, Stray(trial.name, channel, rmse, text)
        if worst is not None:
            found.append(worst[1])
    return found


def stray_finding(strays: Sequence[Stray], cost: StudyCost) -> Finding:
    """The finding that says which runs of a cost stray; it advises what the cost does not do already."""
    more = f" and {len(strays) - _MOST_NAMED} more" if len(strays) > _MOST_NAMED else ""
    named = listed([str(stray) for stray in strays[:_MOST_NAMED]])
    grown = too_far(cost.problem)
    ways = [f"from segments (`segments = {f'{grown.seconds:.2g}' if grown else '...'}` in [cost])"]
    if not any(isinstance(parameter, InitialState) for parameter in cost.parameters):
        ways.append('with free initial states (`initial = "free"`)')
    ways.append("from more starts (`starts = 20` in [optimizer])")
    held = f" No run follows such trials whole: of this model {grown}." if grown else ""
    return Finding(
        "warning",
        "runs-stray",
        f"Simulated runs stray from the record ({len(strays)} of {len(cost.trials)}): {named}{more}. The search ended "
        "at a wrong optimum, or the data or the model are wrong; standard errors do not cover that." + held,
        "search",
        f"Check signs, units and the initial state; search {', or '.join(ways)}.",
        trial=strays[0].trial if len(strays) == 1 else "",
        channel=strays[0].channel.name if len(strays) == 1 else "",
    )


def far_initial_states(cost: StudyCost, x: Array) -> list[Finding]:
    """A finding for each free initial state of a trial that ended far from the first samples."""
    found = []
    outputs = {channel.name: channel for channel in cost.problem.model.outputs}
    for parameter, value in zip(cost.parameters, x):
        trial, channel = (
            _start_of(parameter, cost.trials, outputs) if isinstance(parameter, InitialState) else (None,) * 2
        )
        if trial is None or channel is None:
            continue
        away = abs(float(value) - parameter.value)
        if parameter.prior is not None:
            far = away > _FAR_PRIORS * parameter.prior.sd
            said = f", {away / parameter.prior.sd:.0f} of its prior deviations from it"
            do = (
                "What the model or the sensor has wrong pulls it so far: check the offset of the sensor, and whether "
                "[noise] holds what the model misses too, not the data sheet's part alone."
            )
        else:
            said = ""
            do = (
                'Keep it near them with initial_sd, or at them with initial = "fixed" in [cost]; check the offset of '
                "the sensor, and where [noise] states a data sheet's, leave it out: it must hold what the model misses."
            )
            size = motion(trial, list(outputs.values()), channel)
            far = away > max(_FAR_NOISE * _noise(cost, trial, channel), _TURN if channel.angle else _FAR_MOTION * size)
        if far:
            found.append(
                Finding(
                    "warning",
                    "initial-state-far",
                    f"The initial {channel.name} of {trial.name!r} was estimated as {_shown(float(value), channel)}; "
                    f"the first samples say {_shown(parameter.value, channel)}{said}.",
                    "search",
                    do,
                    trial=trial.name,
                    channel=channel.name,
                )
            )
    return found


def beyond_noise(cost: StudyCost, x: Array, *, starts_free: bool = False) -> Finding | None:
    """The finding that channels are missed by far more than the noise of their records; None where none is.

    Sensors of positions and angles have slow errors, which the roughness of a record does not show, and which a data
    sheet may leave out. So positions are judged by a stated noise alone, angles also where they are missed by
    degrees, and both by more of it.

    Args:
        cost: The cost with its trials and its noise.
        x: The answer.
        starts_free: whether the initial states were estimated already.
    """
    errors = cost.errors(x)
    found = []
    for column, channel in enumerate(cost.problem.model.outputs):
        mine = errors[:, column]
        missed = _rms(mine[np.isfinite(mine) & (mine != 0.0)])
        noise = [_noise_or_step(cost, trial, channel) for trial in cost.trials if channel.name in trial.outputs]
        usual = float(np.median([n for n in noise if math.isfinite(n)] or [math.nan]))
        if missed > _least_beyond(cost, channel) * usual > 0.0 and (not channel.angle or missed > _LEAST_ANGLE):
            found.append((missed / usual, f"{channel.name} by {_shown(missed, channel)} ({missed / usual:.2g} times)"))
    if not found:
        return None
    said = listed([text for _, text in sorted(found, reverse=True)[:_MOST_NAMED]])
    starts = "" if starts_free else "free the initial states, "
    estimated = all(name in cost.estimated for name in cost.sigma)
    stated = "" if estimated else "leave `[noise]` out, so that it is what the model misses, "
    return Finding(
        "warning",
        "beyond-noise",
        f"The fit misses what the records show by much more than their noise: {said}. Something is missing from the "
        "model, the initial states are wrong, or the sensors have slow errors beside the stated white noise. The "
        "parameters make up for it: true values can lie outside their intervals.",
        "search",
        f"Look at the residuals in the report, {starts}{stated}and let `seatruth diagnose` look for the cause.",
    )


def _least_beyond(cost: StudyCost, channel: Channel) -> float:
    """How many times its noise a channel must be missed by to be said."""
    if channel.unit in ("m/s", "rad/s"):
        return _ABOVE_NOISE
    if channel.name in cost.sigma and channel.name not in cost.estimated:
        return _ABOVE_STATED
    return _ABOVE_ROUGHNESS if channel.angle else math.inf


def _noise_or_step(cost: StudyCost, trial: Trial, channel: Channel) -> float:
    """The noise of a channel, not less than the rounding of its record."""
    values = trial.outputs[channel.name]
    steps = np.abs(np.diff(values[np.isfinite(values)]))
    steps = steps[steps > 0.0]
    return max(_noise(cost, trial, channel), float(steps.min()) / math.sqrt(12.0) if steps.size else math.inf)


def step_to_minimum(
    residuals: Array, jacobian: Array, free: Flags, room: tuple[Array, Array] | None = None
) -> tuple[Array, float]:
    """The Gauss-Newton step (K,) from an answer to the minimum, and by how much the cost would fall along it.

    Args:
        residuals: (M,), at the answer.
        jacobian: (M, K), their derivatives.
        free: (K,), parameters that no bound holds; the others do not move.
        room: how far each may move down and up, (K,) each, the first zero or less, the second zero or more; None for
            any distance.
    """
    J, step = jacobian[:, free], np.zeros(len(free))
    size = np.linalg.norm(J, axis=0)
    size[size == 0.0] = 1.0
    low, high = (np.full(len(free), -math.inf), np.full(len(free), math.inf)) if room is None else room
    low, high = low[free] * size, high[free] * size
    whole = np.linalg.lstsq(J / size, -residuals, rcond=1e-10)[0]
    if np.any((whole < low) | (whole > high)):
        # The triangular factor has the same minimum, and a row for each parameter in place of one for each sample.
        triangle = scipy.linalg.qr(np.column_stack((J / size, -residuals)), mode="r")[0]
        held = np.minimum(low, -_ROOM), np.maximum(high, _ROOM)
        whole = scipy.optimize.lsq_linear(triangle[:, :-1], triangle[:, -1], held, method="bvls").x
    step[free] = whole / size
    fall = 0.5 * (float(residuals @ residuals) - float(np.sum((residuals + jacobian @ step) ** 2)))
    return step, fall


def short_of_minimum(fall: float, code: str, *, misfit: float = 1.0, polished: bool = False) -> Finding | None:
    """The finding that a search ended short of a minimum; None where it did not.

    Args:
        fall: what the cost could still fall by.
        code: of the outcome.
        misfit: mean square of the weighted residuals. Where the model misses the trials by more than their noise, the
            cost falls by so much more for a step of one standard error.
        polished: whether the solver was one that ends at a minimum where it can.
    """
    if not fall > _SHORT * max(1.0, misfit):
        return None
    why = {"budget": "its budget was used up", "deadline": "its time was over", "stall": "the cost no longer fell"}
    more = {"budget": "Give it more evaluations", "deadline": "Give it more time"}
    if polished:
        do = (
            f"{more.get(code, 'Search from several starts (`starts = 5` in [optimizer])')}, or keep the initial states "
        )
        do += "near the first samples (`initial_sd` in [cost])."
    else:
        do = f"{more.get(code, 'Give it more evaluations')}, or add a local solver: a second [[optimizer]] table with "
        do += 'use = "least_squares".'
    return Finding(
        "warning",
        "not-at-minimum",
        f"The search ended short of a minimum{f' ({why[code]})' if code in why else ''}: the cost could fall by about "
        f"{fall:.2g} more, and standard errors hold at a minimum.",
        "search",
        do,
    )


def motion(trial: Trial, channels: Sequence[Channel], of: Channel) -> float:
    """How large the motion of a channel is in a trial, in its unit.

    Positions and angles have no natural zero: the largest standard deviation of those of its unit. Else the largest
    root mean square of the channels of its unit.
    """
    sizes = []
    for channel in channels:
        values = trial.outputs.get(channel.name)
        if values is not None and channel.unit == of.unit and channel.angle == of.angle:
            valid = values[np.isfinite(values)]
            placed = channel.angle or channel.unit == "m"
            sizes.append(_rms(valid - valid.mean() if placed and valid.size else valid))
    return max((size for size in sizes if math.isfinite(size)), default=math.nan)


def _start_of(
    parameter: InitialState, trials: Sequence[Trial], outputs: dict[str, Channel]
) -> tuple[Trial | None, Channel | None]:
    """The trial and the recorded channel whose first samples a free initial state begins at; None where none is."""
    for trial in trials:
        name = parameter.name.removeprefix(f"{trial.name}: ")
        if name != parameter.name and name in outputs and name in trial.outputs:
            return trial, outputs[name]
    return None, None


def _noise_ratios(cost: StudyCost, predicted: Sequence[Array]) -> Array:
    """Root mean square error over stated noise (trials, channels); NaN where it is estimated."""
    channels = cost.problem.model.outputs
    found = np.full((len(predicted), len(channels)), math.nan)
    for number, (trial, y) in enumerate(zip(cost.trials, predicted)):
        for column, channel in enumerate(channels):
            if channel.name in cost.sigma and channel.name not in cost.estimated:
                found[number, column] = _rms(_errors(trial, channel, y[:, column])) / cost.sigma[channel.name]
    return found


def _noise(cost: StudyCost, trial: Trial, channel: Channel) -> float:
    """The stated noise of a channel; where it is estimated from the residuals, what the record's roughness says.

    Infinite where the trial has too few samples of it, or none.
    """
    if channel.name in cost.sigma and channel.name not in cost.estimated:
        return cost.sigma[channel.name]
    values = trial.outputs.get(channel.name)
    if values is None:
        return math.inf
    valid = values[np.isfinite(values)]
    # White noise of standard deviation s has second differences of standard deviation sqrt(6) s.
    return _rms(np.diff(valid, 2)) / math.sqrt(6.0) if valid.size > 2 else math.inf


def _errors(trial: Trial, channel: Channel, y: Array) -> Array:
    measured = trial.outputs.get(channel.name)
    if measured is None:
        return np.zeros(0)
    return np.asarray((measured - y)[np.isfinite(measured)])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


def _shown(value: float, channel: Channel) -> str:
    """A value as messages have it: angles and their rates in degrees."""
    if channel.unit.startswith("rad"):
        return f"{math.degrees(value):.3g} {channel.unit.replace('rad', 'deg', 1)}"
    return f"{value:.3g} {'' if channel.unit == '1' else channel.unit}".strip()
