"""The manoeuvres that the trials hold: their figures as measured, beside those that drawn ships predict.

A turn and a stop are sailed under the recorded inputs, from the first samples of the manoeuvre on. A zigzag is sailed
anew: the ship's own heading reverses its rudder, where the recorded one was reversed, from the motion measured at the
first execute. Under the recorded rudder the reversals would be given, and not predicted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import as_trajectory
from seatruth.errors import BadInput
from seatruth.manoeuvres import Manoeuvre, zigzag_figures
from seatruth.manoeuvres.plans import BY_RUDDER, BY_THRUST, Helm, Orders
from seatruth.manoeuvres.recognise import recognise
from seatruth.manoeuvres.recording import noise
from seatruth.manoeuvres.steering import RudderSteering, Steering, steering_of
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.prediction.first_motion import first_motion
from seatruth.prediction.intervals import interval
from seatruth.prediction.parameter_draws import ParameterDraws
from seatruth.prediction.population import Fleet, Sailing
from seatruth.prediction.quantities import QUANTITIES, Quantity, figures_of
from seatruth.simulate import simulator
from seatruth.study.study import Study
from seatruth.trials.prepare.base import bridged
from seatruth.trials.trial import Trial

_KINDS = {"turning circle": "turn", "zigzag": "zigzag", "stop": "stop"}
_MOTION = ("x", "y", "psi", "u", "v", "r")
"""What a zigzag that is sailed anew begins with."""
_AT_EXECUTE = 0.5
"""s to either side of the first execute over which the measured motion is averaged; chosen here [S]."""
_SIGMAS = 2.0
"""Standard deviations of a channel's white noise to which a figure read from it is known; about 95 %."""
_SIGMAS_ANGLE = 4.0
"""The same for overshoots: two readings, of which one is the highest of many samples."""


def measured_rows(
    study: Study, values: Array, drawn: ParameterDraws, level: float, how: Sailing, threads: int | None
) -> list[dict[str, Any]]:
    """One row for each figure of each manoeuvre in the study's trials; values (P, n_parameters), the estimate first."""
    rows: list[dict[str, Any]] = []
    steering = steering_of(study.model) or RudderSteering()
    for role, trials in (("fit", study.trials), ("holdout", study.holdout)):
        for trial in trials:
            for label, kind, run in manoeuvres_of(study.model, trial):
                measured, why = figures_of(kind, run, steering)
                try:
                    found = _predicted(study, kind, run, values, how, steering, threads)
                except BadInput as problem:
                    found = [problem.what] * len(values)
                read = [figures_of(kind, one, steering) for one in found]
                reversals = _reversal_noise(steering.recorded(run)) if kind == "zigzag" else 0.0
                for quantity in QUANTITIES[kind]:
                    name = quantity.name
                    if name in why and all(math.isnan(one[0][name]) for one in read):
                        continue
                    ends = interval(np.array([one[0][name] for one in read[1:]]), drawn, level)
                    true = measured[name]
                    late = _resolution(quantity, run, how) + (reversals * abs(true) if math.isfinite(true) else 0.0)
                    rows.append(
                        {
                            "trial": trial.name,
                            "role": role,
                            "manoeuvre": label,
                            "kind": kind,
                            "figure": name,
                            "title": quantity.title,
                            "unit": quantity.unit,
                            "measured": true,
                            "predicted": read[0][0][name],
                            "lower": ends.lower,
                            "upper": ends.upper,
                            "resolution": late,
                            "inside": False,  # until the intervals have their final width
                            "held_by": ends.held_by,
                            "prior_share": ends.prior_share,
                            "missing": ends.missing,
                            "why": why.get(name, read[0][1].get(name, "")),
                        }
                    )
    return rows


def _resolution(quantity: Quantity, run: Trial, how: Sailing) -> float:
    """How well a figure of a record is known: by the steps of time between which helmsmen act, and by its noise."""
    step = max(how.dt, float(np.median(np.diff(run.t))))
    x, y, psi = (run.outputs.get(name) for name in ("x", "y", "psi"))
    speed = 0.0 if x is None or y is None else float(np.median(np.hypot(np.diff(x), np.diff(y)) / np.diff(run.t)))
    if quantity.unit == "s":
        return step
    if quantity.unit == "m" and x is not None:
        return step * speed + _SIGMAS * noise(x)
    if quantity.unit == "rad" and psi is not None:
        return _SIGMAS_ANGLE * noise(psi)
    if quantity.unit == "1" and "u" in run.outputs and speed > 0:
        return _SIGMAS * noise(run.outputs["u"]) / speed
    return 0.0


def _reversal_noise(run: Trial) -> float:
    """How well the headings of a zigzag's reversals are known, as a part of them: each is one sample less the first."""
    try:
        switches = zigzag_figures(run).switch_angles
    except BadInput:
        return 0.0
    return _SIGMAS * math.sqrt(2.0) * noise(run.outputs["psi"]) / float(np.median(switches)) if switches else 0.0


def manoeuvres_of(model: Model, trial: Trial) -> list[tuple[str, str, Trial]]:
    """(label, kind, record without gaps) of the turns, zigzags and stops in a trial of a model."""
    found = []
    for stretch in recognise(trial, model=model):
        kind = _KINDS.get(stretch.kind)
        if kind is None or stretch.label.startswith("pitch"):
            continue
        first, stop = (int(np.searchsorted(trial.t, at)) for at in (stretch.start, stretch.end + 1e-9))
        found.append((stretch.label, kind, _bridged(trial.section(first, stop))))
    return found


def _bridged(trial: Trial) -> Trial:
    outputs = {}
    for name, values in trial.outputs.items():
        known = np.isfinite(values)
        whole = np.array(values)
        if name == "psi":
            whole[known] = np.unwrap(whole[known])
        outputs[name] = bridged(trial.t, whole)
    return replace(trial, outputs=outputs)


def _predicted(
    study: Study, kind: str, run: Trial, values: Array, how: Sailing, steering: Steering, threads: int | None
) -> Sequence[Trial | str]:
    if kind == "zigzag" and not isinstance(study.model, BlackBox):
        return _sailed_anew(study, run, values, how, steering)
    if kind == "zigzag":
        raise BadInput(
            "a black box cannot be steered by its heading, and a replay gives the reversals, not predicts them",
            do="Write the model's equations where its zigzags are to be predicted.",
        )
    return replayed(study, run, values, threads)


def replayed(study: Study, run: Trial, values: Array, threads: int | None) -> list[Trial | str]:
    """The run under its recorded inputs, from its first samples, by each of these ships (P, n_parameters)."""
    options, model = as_trajectory(study.cost), study.model
    names = [parameter.name for parameter in model.parameters]
    first = dict(zip(names, values[0].tolist()))
    own = np.flatnonzero(np.ptp(values, axis=0) > 0)
    engine = simulator(model, [run], tuple(names[k] for k in own), first, options.hold, options.max_step, threads)
    found = engine.outputs(np.ascontiguousarray(values[:, own]), engine.initial_states)
    channels = [channel.name for channel in model.outputs]
    made: list[Trial | str] = []
    for ship in range(len(values)):
        if found.diverged[ship, 0] or not np.isfinite(found.y[ship]).all():
            made.append("the motion diverges")
            continue
        outputs = {name: found.y[ship][:, k] for k, name in enumerate(channels)}
        made.append(replace(run, outputs=outputs, synthetic=True))
    return made


def _sailed_anew(study: Study, run: Trial, values: Array, how: Sailing, steering: Steering) -> list[Trial | str]:
    found = zigzag_figures(steering.recorded(run))
    if not found.switch_angles:
        do = "Give a record that goes on beyond the first overshoot."
        raise BadInput("the record ends before the first overshoot", where=f"trial {run.name!r}", do=do)
    near = np.abs(run.t - found.executes[0]) <= _AT_EXECUTE
    if not near.any():
        near[np.argmin(np.abs(run.t - found.executes[0]))] = True
    # Place and heading as well: a current and waves have a direction.
    motion = first_motion(study.model, run, np.flatnonzero(near))
    first = {name: value for name, value in motion.items() if name in _MOTION}
    own = {channel.name for channel in study.model.inputs}
    inputs = {name: np.full(len(values), usual) for name, usual in steering.straight(run).items() if name in own}
    side = -1.0 if found.first == "port" else 1.0
    control = BY_THRUST if steering.by == "thrust" else BY_RUDDER
    plan = _AsSailed(control, side * found.rudder, found.switch_angles, len(found.executes))
    return Fleet(study.model, values).sail(plan, replace(how, limit=2.0 * run.duration), first=first, inputs=inputs)


@dataclass(frozen=True)
class _AsSailed(Manoeuvre):
    """A zigzag whose rudder is reversed where the recorded one was: helmsmen are late, and never twice the same.

    `headings`: change of heading at each reversal, its size; the last one holds for those that follow.
    """

    control: str
    rudder: float
    headings: tuple[float, ...]
    executes: int

    @property
    def label(self) -> str:
        return "zigzag as it was sailed"

    def helm(self) -> Helm:
        now = {"order": self.rudder, "done": 1.0, "base": math.nan}

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            if math.isnan(now["base"]):
                now["base"] = y["psi"]
            gone = (y["psi"] - now["base"]) * math.copysign(1.0, now["order"])
            done = int(now["done"])
            if done < self.executes:
                if gone >= self.headings[min(done, len(self.headings)) - 1]:
                    now.update(order=-now["order"], done=done + 1.0)
            elif gone >= 0:
                return None
            return {self.control: now["order"]}

        return helm
