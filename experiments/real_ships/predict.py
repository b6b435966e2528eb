"""Open-loop predictions of recorded runs, their errors, and the manoeuvre figures of both."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth import Study, simulator
from seatruth.costs.options import as_trajectory
from seatruth.errors import BadInput
from seatruth.manoeuvres import Zigzag, run_manoeuvre, turning_circle_figures, zigzag_figures
from seatruth.trials import Trial

Array = NDArray[np.float64]
WINDOW = 100.0
"""s; open-loop windows are this long, one after the other; a last one shorter than half of it is not used."""
HELM_RATE = math.radians(15.8)
"""rad/s, of the KVLCC2 models' steering gear."""


def windows(trial: Trial, seconds: float = WINDOW) -> list[Trial]:
    """Consecutive pieces of a run; a run shorter than `seconds` is one piece."""
    starts = np.arange(trial.t[0], trial.t[-1], seconds)
    pieces = []
    for k, start in enumerate(starts):
        first = int(np.searchsorted(trial.t, start - 1e-9))
        stop = int(np.searchsorted(trial.t, start + seconds - 1e-9))
        if k == 0 or trial.t[min(stop, len(trial)) - 1] - trial.t[first] >= 0.5 * seconds:
            pieces.append(trial.section(first, stop))
    return pieces


def simulated(study: Study, values: Mapping[str, float], trials: Sequence[Trial], threads: int | None) -> list[Trial]:
    """The trials with their outputs replaced by the model's, under the recorded inputs, from each one's first sample.

    Nothing of a trial but its inputs and its first sample is used. A run that diverges has NaN outputs.
    """
    options = as_trajectory(study.cost)
    engine = simulator(study.model, trials, (), values, options.hold, options.max_step, threads)
    found = engine.outputs(np.zeros((1, 0)), engine.initial_states)
    names = [channel.name for channel in study.model.outputs]
    made = []
    for k, trial in enumerate(trials):
        y = np.where(found.diverged[0, k], np.nan, found.y[0, engine.rows[k]])
        made.append(replace(trial, outputs={name: y[:, j] for j, name in enumerate(names)}, synthetic=True))
    return made


def integrated(trial: Trial) -> Trial:
    """Position and heading as the recorded u, v, r give them from the first sample: how far channels agree."""
    u, v, r = (_filled(trial.t, trial.outputs[name]) for name in ("u", "v", "r"))
    psi = _filled(trial.t, trial.outputs["psi"])
    rates = {"x": u * np.cos(psi) - v * np.sin(psi), "y": u * np.sin(psi) + v * np.cos(psi), "psi": r}
    outputs = {}
    for name, rate in rates.items():
        path = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(trial.t))])
        measured = _filled(trial.t, trial.outputs[name])
        outputs[name] = path + measured[0]
    return replace(trial, outputs={**trial.outputs, **outputs})


def rmse(measured: Sequence[Trial], predicted: Sequence[Trial]) -> dict[str, float]:
    """Root mean square difference by channel over all samples of these runs (SI units, rad); infinite if diverged."""
    result = {}
    for name in measured[0].outputs:
        gaps = []
        for real, model in zip(measured, predicted, strict=True):
            gap = (model.outputs[name] - real.outputs[name])[np.isfinite(real.outputs[name])]
            gaps.append(np.where(np.isfinite(gap), gap, np.inf))
        result[name] = float(np.sqrt(np.mean(np.concatenate(gaps) ** 2)))
    return result


def errors(
    study: Study, models: Mapping[str, Mapping[str, float]], trials: Mapping[str, Sequence[Trial]], threads: int | None
) -> pd.DataFrame:
    """Rows (set, trial, over, model) with the RMSE of each channel; `trials` by set ("fitted", "left out").

    Trial "all" pools the set. Model "channels" is no model: it integrates the recorded velocities.
    """
    rows = []
    for group, runs in trials.items():
        for over in ("100 s", "whole run"):
            pieces = {run.name: windows(run) if over == "100 s" else [run] for run in runs}
            flat = [piece for run in pieces.values() for piece in run]
            guesses = {name: simulated(study, values, flat, threads) for name, values in models.items()}
            guesses["channels"] = [integrated(piece) for piece in flat]
            for model, guess in guesses.items():
                where = {"set": group, "over": over, "model": model}
                rows.append({**where, "trial": "all", "pieces": len(flat), **rmse(flat, guess)})
                begin = 0
                for name, own in pieces.items():
                    mine = slice(begin, begin + len(own))
                    rows.append({**where, "trial": name, "pieces": len(own), **rmse(flat[mine], guess[mine])})
                    begin += len(own)
    return pd.DataFrame(rows)


def manoeuvre_figures(
    study: Study, models: Mapping[str, Mapping[str, float]], trials: Mapping[str, Sequence[Trial]]
) -> pd.DataFrame:
    """Rows (set, trial, model, figure) with value measured and predicted, and the difference.

    Zigzags of a ship whose rudder was recorded are sailed anew in closed loop: the model's own heading reverses the
    rudder, from the speeds and yaw rate measured when the rudder was first moved. Turns are
    replayed under the recorded orders from 20 s before the rudder is laid. Angles in deg, lengths in m. A row without
    figures says why there are none.
    """
    rows: list[dict[str, Any]] = []
    for group, runs in trials.items():
        for run in runs:
            made = _turn if "turn" in run.name else _zigzag
            try:
                measured, predicted = made(study, models, run)
            except BadInput as problem:
                rows.append({"set": group, "trial": run.name, "why": problem.message})
                continue
            for model, figures in predicted.items():
                for name, value in figures.items():
                    true = measured.get(name, math.nan)
                    rows.append(
                        {"set": group, "trial": run.name, "model": model, "figure": name, "measured": true}
                        | {"predicted": value, "difference": value - true, "why": ""}
                    )
    return pd.DataFrame(rows)


Made = tuple[dict[str, float], dict[str, dict[str, float]]]


def _zigzag(study: Study, models: Mapping[str, Mapping[str, float]], run: Trial) -> Made:
    if study.model.servos:
        # The run-up was steered by hand and orders were changed by hand: there is no rule to sail anew, and under the
        # recorded orders the times of reversal are given, not predicted.
        raise BadInput("only orders were recorded: no figures of a zigzag", where=run.name)
    helm = _filled_outputs(run)
    found = zigzag_figures(helm)
    # The heading at which the rudder was reversed: nominal angles are whole degrees, switches are noisy.
    nominal = math.radians(round(math.degrees(float(np.median(found.switch_angles[:3])))))
    measured = _overshoots(found)
    near = np.abs(run.t - found.executes[0]) <= 0.5
    start = {name: float(np.mean(helm.outputs[name][near])) for name in ("u", "v", "r")}
    revolutions = float(np.median(run.inputs["n"]))
    plan = Zigzag(
        rudder=found.rudder,
        heading=nominal,
        first="port" if found.first == "port" else "starboard",
        executes=len(found.executes),
        approach=0.0,
    )
    predicted = {}
    for name, values in models.items():
        try:
            sailed = run_manoeuvre(
                study.model,
                plan,
                values,
                dt=0.1,
                first_state=start,
                inputs={"n": revolutions},
                rudder_rate=HELM_RATE,
                limit=2 * run.duration,
            )
            predicted[name] = _overshoots(zigzag_figures(sailed))
        except BadInput:
            predicted[name] = dict.fromkeys(measured, math.nan)
    return measured, predicted


def _turn(study: Study, models: Mapping[str, Mapping[str, float]], run: Trial) -> Made:
    helm = _filled_outputs(run)
    execute = turning_circle_figures(helm).execute
    part = run.section(int(np.searchsorted(run.t, execute - 20.0)), len(run))
    measured = _circle(_filled_outputs(part))
    return measured, {name: _circle(_filled_outputs(simulated(study, v, [part], 1)[0])) for name, v in models.items()}


def _overshoots(found: Any) -> dict[str, float]:
    angles = {f"overshoot {k + 1}, deg": math.degrees(a) for k, a in enumerate(found.overshoots[:2])}
    return {**angles, "initial turning time, s": found.initial_turning_time}


def _circle(trial: Trial) -> dict[str, float]:
    found = turning_circle_figures(trial)
    names = ("advance", "transfer", "tactical_diameter", "steady_diameter")
    return {f"{name.replace('_', ' ')}, m": getattr(found, name) for name in names}


def _filled_outputs(run: Trial) -> Trial:
    """The run with the gaps of its outputs filled."""
    return replace(run, outputs={name: _filled(run.t, values) for name, values in run.outputs.items()})


def _filled(t: Array, values: Array) -> Array:
    good = np.isfinite(values)
    return np.interp(t, t[good], values[good]) if good.any() else values
