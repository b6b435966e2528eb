"""Estimate -> figures of manoeuvres with intervals: `predict`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.arrays import Array
from seatruth.costs.options import FormulaOptions
from seatruth.errors import BadInput
from seatruth.estimate import Estimate
from seatruth.manoeuvres import Manoeuvre, TurningCircle, Zigzag
from seatruth.manoeuvres.steering import Steering, limited_inputs, steering_of
from seatruth.prediction.conditions import (
    approach_speed,
    calm_water,
    propulsion,
    rudder_rate,
    time_limit,
    time_step,
)
from seatruth.prediction.findings import findings
from seatruth.prediction.intervals import FORM_ERROR, Interval, interval, model_error, widened
from seatruth.prediction.measured import measured_rows
from seatruth.prediction.parameter_draws import ParameterDraws, parameter_draws
from seatruth.prediction.population import Fleet, Sailing
from seatruth.prediction.quantities import QUANTITIES, figures_of, kind_of
from seatruth.prediction.results import FIGURE_COLUMNS, MEASURED_COLUMNS, TRACK_COLUMNS, Predictions, table_of
from seatruth.progress import Progress, ProgressEvent, silent
from seatruth.provenance import provenance
from seatruth.study.study import Study
from seatruth.trials.prepare import full_scale
from seatruth.trials.prepare.full_scale import FROUDE
from seatruth.trials.trial import Trial

DRAWS = 400
"""Parameter draws: their 2.5 % quantile then has a standard error of a tenth of the half width. Chosen here [S]."""
_FEWEST_DRAWS = 40
"""Fewer draws hold no 95 % interval."""
_MOST_DRAWS = 100_000
_SHOWN = 40
"""Drawn ships whose tracks are kept."""
_POINTS = 400
"""Samples of a kept track."""
IMO: tuple[Manoeuvre, ...] = (
    TurningCircle(math.radians(35.0)),
    TurningCircle(math.radians(-35.0)),
    Zigzag(math.radians(10.0), math.radians(10.0)),
    Zigzag(math.radians(20.0), math.radians(20.0)),
)
"""The turning circles and zigzags of IMO's MSC.137(76)."""
BY_THRUST: tuple[Manoeuvre, ...] = (
    TurningCircle(0.2, by="thrust"),
    TurningCircle(-0.2, by="thrust"),
    Zigzag(0.1, math.radians(10.0), by="thrust"),
    Zigzag(0.2, math.radians(20.0), by="thrust"),
)
"""The same where thrusters steer. No standard says by how much: shares of full thrust chosen here [S]."""


def predict(
    study: Study,
    estimate: Estimate,
    manoeuvres: Sequence[Manoeuvre] | None = None,
    *,
    speed: float | None = None,
    inputs: Mapping[str, float] | None = None,
    rudder_rate_limit: float | None = None,
    level: float = 0.95,
    draws: int = DRAWS,
    seed: int | None = None,
    scale: float = 1.0,
    calm: bool = True,
    measured: bool = True,
    form_error: float = FORM_ERROR,
    dt: float | None = None,
    limit: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Predictions:
    """Predicts figures of manoeuvres, with intervals from what the estimate leaves open.

    Parameters are drawn from the estimate: the trials' part of its covariance, widened where trials disagree by more
    than their residuals let expect, and the priors' part (`seatruth.prediction.parameter_draws`). Each draw sails
    each manoeuvre; the interval lies between quantiles of its figures. Where the figures of the fitted trials miss
    their predictions by more than that, all intervals hold this relative error as well. What the model lacks beyond
    the trials is in the intervals of `manoeuvres` as it is usual (`form_error`); it may be more.

    Args:
        study: the study that was identified, with trajectory or regression cost.
        estimate: its estimate.
        manoeuvres: plans, `TurningCircle`, `Zigzag`, `CrashStop` or `Spiral`, of a vehicle that thrusters steer
            `by="thrust"`, or `AxisSteps` in yaw. Default: IMO's turns and zigzags; by thrust those of 20 and 10 %.
        speed: approach speed, m/s, negative astern; default: the median of those of the trials'
            manoeuvres.
        inputs: values of inputs that no manoeuvre orders; default: revolutions at which each ship keeps the speed.
        rudder_rate_limit: rad/s; default: that of the trials' rudders. A model with a servo has its own.
        level: probability of the intervals.
        draws: number of draws of the parameters.
        seed: seed of the draws; default: the study's.
        scale: length of the ship over that of the model; above 1, figures are of the full-scale ship (Froude).
        calm: take away the effects of the environment that the study's model has, as a current.
        measured: also predict the manoeuvres that the study's trials hold; without them no interval is widened.
        form_error: relative error (standard deviation) of the model's form beyond the trials, 0 for none.
        dt: step, s; default: that of the trials.
        limit: time after which a manoeuvre ends, s; default: five times the longest trial.
        threads: threads of the simulation of recorded runs. They do not change the result.
        progress: called with a `ProgressEvent` at each manoeuvre.

    Returns:
        The figures, the measured ones beside the predicted ones, and the tracks of some draws.

    Raises:
        BadInput: the study has a formula cost, the estimate is another study's, or a manoeuvre cannot be sailed.

    Source:
        Definitions of the figures: ITTC 7.5-02-06-01 and 7.5-04-02-01, IMO MSC.137(76).

    Example:
        >>> import math
        >>> import seatruth.sample
        >>> from seatruth import Budget, identify, predict
        >>> from seatruth.manoeuvres import TurningCircle
        >>> study = seatruth.sample.load()
        >>> estimate = identify(study, budget=Budget(evaluations=40))
        >>> found = predict(study, estimate, [TurningCircle(math.radians(20))], draws=60, measured=False)
        >>> turn = found.figures.set_index("figure")
        >>> bool(turn.lower["advance"] < turn.value["advance"] < turn.upper["advance"])
        True
    """
    _check(study, level, draws, scale, form_error)
    show = progress or silent
    show(ProgressEvent("Uncertainty of the estimate"))
    seed = study.seed if seed is None else seed
    drawn = parameter_draws(study, estimate, draws, seed, threads)
    space = study.space
    steering = steering_of(study.model)
    if manoeuvres is None:
        manoeuvres = BY_THRUST if steering is not None and steering.by == "thrust" else IMO
    values = space.values(np.concatenate([drawn.center[None], drawn.X]))
    trials = list(study.trials)
    rudders = limited_inputs(steering)
    how = Sailing(
        time_step(study.model, trials, dt), rudder_rate(trials, rudder_rate_limit, rudders), time_limit(trials, limit)
    )
    rows: list[dict[str, Any]] = []
    tracks: list[pd.DataFrame] = []
    conditions: dict[str, Any] = {}
    if manoeuvres:
        kinds = [kind_of(plan) for plan in manoeuvres]
        ahead = approach_speed(study.model, trials, speed)
        still = calm_water(study.model) if calm else {}
        sailing = values.copy()
        for name, value in still.items():
            sailing[:, [p.name for p in study.model.parameters].index(name)] = value
        fleet = Fleet(study.model, sailing)
        drive = propulsion(study.model, sailing, ahead, inputs or {})
        units = {channel.name: channel.unit for channel in study.model.inputs}
        stated = {name: float(column[0]) * scale ** FROUDE.get(units[name], 0.0) for name, column in drive.items()}
        conditions = {
            "speed": ahead * math.sqrt(scale),
            "inputs": stated,
            "units": {name: units[name] for name in stated},
            **({"rudder_rate": how.rudder_rate / math.sqrt(scale)} if {*rudders} & set(units) else {}),
            "dt": how.dt * math.sqrt(scale),
            "limit": how.limit * math.sqrt(scale),
            "without": sorted(still),
        }
        for number, (plan, kind) in enumerate(zip(manoeuvres, kinds)):
            show(ProgressEvent("Prediction", number, len(manoeuvres), "manoeuvres", message=plan.label))
            runs = fleet.sail(plan, how, first={"u": ahead}, inputs=drive)
            rows += _rows(plan.label, kind, runs, steering, drawn, level, scale, how.dt)
            tracks.append(_tracks(plan.label, runs, steering, scale))
    beside: list[dict[str, Any]] = []
    if measured:
        show(ProgressEvent("Manoeuvres of the trials"))
        beside = [
            _scaled(row, scale, ("measured", "predicted", "lower", "upper", "resolution"))
            for row in measured_rows(study, values, drawn, level, how, threads)
        ]
    figures, compared = table_of(rows, FIGURE_COLUMNS), table_of(beside, MEASURED_COLUMNS)
    error = model_error(compared, level)
    figures, compared = (
        widened(figures, "value", math.hypot(error, form_error), level),
        widened(compared, "predicted", error, level),
    )
    compared["inside"] = (compared.lower <= compared.measured) & (compared.measured <= compared.upper)
    return Predictions(
        study=study.name,
        model=study.model.name,
        synthetic=study.synthetic,
        figures=figures,
        measured=compared,
        tracks=pd.concat(tracks, ignore_index=True) if tracks else pd.DataFrame(columns=list(TRACK_COLUMNS)),
        level=level,
        draws=draws,
        seed=seed,
        scale=scale,
        conditions=conditions,
        lack_of_fit=drawn.lack_of_fit,
        model_error=error,
        form_error=form_error,
        findings=findings(figures, compared, drawn, level, error),
        provenance={**provenance(), "study_hash": study.content_hash, "estimate": _behind(estimate), "scale": scale},
    )


def _check(study: Study, level: float, draws: int, scale: float, form_error: float) -> None:
    where = "predict"
    if isinstance(study.cost, FormulaOptions):
        raise BadInput("a formula makes no manoeuvres", where=where, do="Give a study of a vehicle's motion.")
    if not 0.5 <= level < 1.0:
        raise BadInput(f"a level of {level} is no probability of an interval", where=where, do="Give 0.5 to 0.999.")
    if not _FEWEST_DRAWS <= draws <= _MOST_DRAWS:
        raise BadInput(f"{draws} draws", where=where, do=f"Give {_FEWEST_DRAWS} to {_MOST_DRAWS}.")
    if not 0.0 <= form_error < 1.0:
        raise BadInput(f"a form error of {form_error}", where=where, do="Give a part of each figure, 0 to 0.99.")
    if not (math.isfinite(scale) and scale > 0):
        raise BadInput(f"a scale of {scale}", where=where, do="Give the length of the ship over that of the model.")


def _behind(estimate: Estimate) -> dict[str, Any]:
    kept = ("commit", "time_utc", "study_hash")
    return {
        "outcome": estimate.outcome.get("code", ""),
        **{key: estimate.provenance[key] for key in kept if key in estimate.provenance},
    }


def _rows(
    label: str,
    kind: str,
    runs: Sequence[Trial | str],
    steering: Steering | None,
    drawn: ParameterDraws,
    level: float,
    scale: float,
    dt: float,
) -> list[dict[str, Any]]:
    """One row a figure; runs are those of the estimate and of each draw."""
    read = [figures_of(kind, run, steering) for run in runs]
    rows = []
    for quantity in QUANTITIES[kind]:
        values: Array = np.array([values[quantity.name] for values, _ in read])
        ends: Interval = interval(values[1:], drawn, level)
        # Helmsmen act at steps: the times of a zigzag are known to half of one.
        late = 0.5 * dt if kind == "zigzag" and quantity.unit == "s" else 0.0
        row: dict[str, Any] = {
            "manoeuvre": label,
            "kind": kind,
            "figure": quantity.name,
            "title": quantity.title,
            "unit": quantity.unit,
            "value": float(values[0]),
            "lower": ends.lower - late,
            "upper": ends.upper + late,
            "held_by": ends.held_by,
            "prior_share": ends.prior_share,
            "missing": ends.missing,
            "why": read[0][1].get(quantity.name, ""),
        }
        rows.append(_scaled(row, scale, ("value", "lower", "upper")))
    return rows


def _scaled(row: dict[str, Any], scale: float, columns: Sequence[str]) -> dict[str, Any]:
    """The row at full scale."""
    if scale == 1.0:
        return row
    power = next(quantity.power for quantity in QUANTITIES[row["kind"]] if quantity.name == row["figure"])
    return {**row, **{column: row[column] * scale**power for column in columns}}


def _tracks(label: str, runs: Sequence[Trial | str], steering: Steering | None, scale: float) -> pd.DataFrame:
    """Tracks of the estimate (ship 0) and of the first draws, thinned."""
    parts = []
    for ship, run in enumerate(runs[: _SHOWN + 1]):
        if isinstance(run, str):
            continue
        whole = full_scale(run, scale=scale, powers=_other_powers(run)) if scale != 1.0 else run
        rows = np.unique(np.linspace(0, len(whole) - 1, _POINTS).astype(np.intp))
        part = {name: whole.outputs[name][rows] for name in ("x", "y", "psi") if name in whole.outputs}
        known = run.inputs if steering is None else steering.recorded(run).inputs
        delta = known.get("delta" if steering is None else steering.channel, np.zeros(len(whole)))
        parts.append(pd.DataFrame({"manoeuvre": label, "ship": ship, "t": whole.t[rows], **part, "delta": delta[rows]}))
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame(columns=list(TRACK_COLUMNS))


def _other_powers(run: Trial) -> dict[str, float]:
    """Channels that a track does not show need no scaling."""
    shown = {"x", "y", "psi", "delta"}
    return {name: 0.0 for name in (*run.inputs, *run.outputs) if name not in shown}
