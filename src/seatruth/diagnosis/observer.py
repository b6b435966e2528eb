"""A model that is led along the recorded speeds, so that what it lacks is forgotten within seconds.

Where a model is wrong in ways that no effect describes, its runs stray from the record, and what an effect leaves
there is lost. Led, each recorded speed (u, v, r, ...) is drawn back to its record within a short time, as an observer
does it: a missing force then shows as a small error of that speed while it acts, and no further. Positions and angles
are not led. They follow from the speeds, whatever moves the vehicle, so that errors of sensors and currents keep their
trace.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.terms import EQUATIONS, KINEMATIC, equations
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.noise import NoiseFloor, noise_floor
from seatruth.diagnosis.problem import GapProblem
from seatruth.models.base import Equations, Model
from seatruth.models.black_box import BlackBox
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

STEPS = 10.0
"""Sampling steps within which a speed comes back to its record."""
ASTRAY = 4.0
"""Error of a whole run, in multiples of the noise that is possible, from which it strays."""
_ROUNDS = 2
_FULL_STEPS = 8
_ROUGH = 0.3


def gains(problem: GapProblem) -> dict[str, float]:
    """1/s by which each recorded speed of the model is led; empty where none can be."""
    model = problem.study.model
    if isinstance(model, BlackBox):
        return {}
    outputs = {channel.name for channel in model.outputs}
    step = max(float(np.median(np.diff(trial.t))) for trial in problem.trials)
    own = [state for state, label in equations(model).items() if state in outputs and label in EQUATIONS.values()]
    recorded = [name for name in own if all(name in trial.outputs for trial in problem.trials)]
    return dict.fromkeys(recorded, 1.0 / (STEPS * step))


@dataclasses.dataclass(frozen=True)
class Led:
    """Leads each model, with whatever effects, along the record of each trial."""

    gains: Mapping[str, float]

    def model(self, model: Model) -> Model:
        return LedModel(model, self.gains)

    def trial(self, trial: Trial) -> Trial:
        return with_record(trial, list(self.gains))


def led(problem: GapProblem) -> GapProblem | None:
    """The same problem with the model led along the recorded speeds; None where none are recorded."""
    found = gains(problem)
    if not found:
        return None
    return GapProblem(problem.study, list(problem.effects.values()), threads=problem.threads, lead=Led(found))


class LedModel(ModelWrapper):
    """A model whose states follow the inputs "seen_NAME" where "has_NAME" is 1; `gains` (1/s) by the state's name."""

    def __init__(self, base: Model, gains: Mapping[str, float]) -> None:
        self.gains = dict(gains)
        units = {channel.name: channel.unit for channel in base.outputs}
        seen = [Channel(name, unit) for n in gains for name, unit in ((f"seen_{n}", units[n]), (f"has_{n}", "1"))]
        super().__init__(base, inputs=seen)

    def make_rhs(self) -> Equations:
        return _rhs(self)


def with_record(trial: Trial, names: Sequence[str]) -> Trial:
    """The trial with its recorded speeds among the inputs; gaps are bridged there, and marked."""
    extra = {}
    for name in names:
        values = np.asarray(trial.outputs[name], dtype=np.float64)
        valid = np.isfinite(values)
        extra[f"seen_{name}"] = np.interp(trial.t, trial.t[valid], values[valid]) if valid.any() else 0.0 * trial.t
        extra[f"has_{name}"] = valid.astype(np.float64)
    return dataclasses.replace(trial, inputs={**trial.inputs, **extra})


def led_floor(problem: GapProblem, starts: Sequence[Array]) -> tuple[NoiseFloor, Fit, Fit] | None:
    """The noise of a led problem (what the model lacks is part of it), the fullest fit and the plain one; None where
    the model diverges even so.
    """
    active = problem.active(())
    floors = [(_floor(problem, x, active, 0), x) for x in starts if np.isfinite(problem.errors(x, active)).all()]
    if not floors:
        return None
    floor, x = min(floors, key=lambda entry: _size(entry[0]))
    plain = fit(problem, (), floor, x, steps=_FULL_STEPS, settled_at=_ROUGH)
    full = plain
    for _ in range(_ROUNDS):
        fits = [one for one in (plain, full) if np.isfinite(one.cost)]
        if not fits:
            return None
        floors = [(_floor(problem, one.x, one.active, len(one.active)), one.x) for one in fits]
        best = [min(same, key=lambda one: one.innovation) for same in zip(*(floor.channels for floor, _ in floors))]
        floor = dataclasses.replace(floor, channels=tuple(best))
        plain = fit(problem, (), floor, plain.x, steps=_FULL_STEPS, settled_at=_ROUGH)
        full = fit(problem, list(problem.effects), floor, fits[-1].x, steps=_FULL_STEPS, settled_at=_ROUGH)
    return floor, full, plain


def astray(problem: GapProblem, at: Fit) -> bool:
    """Whether runs of the model stray from positions or angles much further than noise can, where none is stated.

    Whatever moves the vehicle, they are integrals of its speeds: what is left of them in a led run is noise of both, if
    not more. Of a run that strays nothing else tells whether that is slow noise.
    """
    most = _most_noise(problem)
    errors = problem.errors(at.x, at.active)
    sizes = {
        name: float(np.sqrt(np.mean(errors[problem.channel_of == problem.outputs.index(name)] ** 2))) for name in most
    }
    return any(sizes[name] > ASTRAY * most[name] for name in most)


def _most_noise(problem: GapProblem) -> dict[str, float]:
    stated = {name for name, sd in problem.study.noise.items() if isinstance(sd, (int, float))}
    unstated = [name for name in problem.outputs if name not in stated]
    other = led(problem) if unstated else None
    begun = None if other is None else led_floor(other, [problem.start])
    if begun is None:
        return {}
    led_names = set(gains(problem))
    return {name: sd for name, sd in begun[0].sd.items() if name in unstated and name not in led_names}


def _floor(problem: GapProblem, x: Array, active: Any, taken: int) -> NoiseFloor:
    return noise_floor(problem.series, problem.errors(x, active), taken=taken)


def _size(floor: NoiseFloor) -> float:
    """Log of what the noise's past does not foretell, over all samples."""
    return sum(one.samples * math.log(max(one.innovation, 1e-300)) for one in floor.channels)


def _rhs(model: LedModel) -> Callable[..., tuple[Any, ...]]:
    base, recorded, split = model.base.rhs, _recorded(model), model.split_inputs()
    order, gains = [channel.name for channel in model.states], dict(model.gains)
    kinematic = [k for k, name in enumerate(order) if name in KINEMATIC]

    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        plain = split(i)[0]
        missed = _missed(i, recorded(s, plain, p, e), gains)
        rates = list(base(s, plain, p, e))
        for name, gain in gains.items():
            rates[order.index(name)] += gain * missed[name]
        # As the sensors have it: what a speed's error would leave there is taken off, to second order.
        near = _moved(s, missed)
        near = _moved(near, _missed(i, recorded(near, plain, p, e), gains))
        along = base(near, plain, p, e)
        for k in kinematic:
            rates[k] = along[k]
        return tuple(rates)

    return rhs


def _missed(i: Any, y: Mapping[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """By how much the record of each led speed is above what its sensor would show."""
    return {name: getattr(i, f"has_{name}") * (getattr(i, f"seen_{name}") - y[name]) for name in names}


def _moved(s: Any, by: Mapping[str, Any]) -> Any:
    return s._replace(**{name: getattr(s, name) + value for name, value in by.items()})


def _recorded(model: LedModel) -> Callable[..., dict[str, Any]]:
    """(s, i, p, e) to the led channels as the sensors would record them."""
    base, names = model.base.output, [channel.name for channel in model.outputs]

    def recorded(s: Any, i: Any, p: Any, e: Any) -> dict[str, Any]:
        if base is None:
            return {name: getattr(s, name) for name in names}
        return dict(zip(names, base(s, i, p, e)))

    return recorded
