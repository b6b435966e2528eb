"""The stages of the experiment on Zhao, Xie and Qiao 2018. Each returns plain numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import zhao2018_channels as system
import zhao2018_sensors as sensors
from joblib import Parallel, delayed
from zhao2018_channels import ALL_FREE, DAMPED, SEEN, TRUTH, UNDAMPED
from zhao2018_runs import CHANNEL_RUNS, FITTED, LIMIT, STEP, T1, T2, UNFITTED, Run, sail, truth

from seatruth import Parameter, Study, identify
from seatruth.costs.options import TrajectoryOptions
from seatruth.manoeuvres import add_noise
from seatruth.models.torpedo import Torpedo
from seatruth.models.torpedo_channels import FREE, channel
from seatruth.trials import Trial, Trials
from seatruth.uncertainty import prior_identifiability

FREE_START = TrajectoryOptions(initial="free")
"""Least squares with known noise; initial states are estimated."""
SEED = 2018
DEGREE = sensors.DEGREE
SQUARE = {"T1": 24.0, "T2": 12.0}
"""[S] s: period of the square wave of the lateral reference figures, which is not on record: where they come out."""


def trials(names: Sequence[str], seed: Sequence[int], fin_noise: float = sensors.FIN_NOISE) -> dict[str, Trial]:
    """Prepared trials of noisy logs; only those for validation have a fused depth, which no fit uses."""
    return {
        name: sensors.prepared(
            sensors.logged(truth(name), "T1", np.random.default_rng([*seed, k]), fin_noise=fin_noise)
        )
        for k, name in enumerate(names)
    }


def depth_sources(run: str, seed: Sequence[int]) -> dict[str, float]:
    """Root mean square error in m of each depth and of the fused one."""
    true = truth(run)
    log = sensors.logged(true, "T1", np.random.default_rng(list(seed)))
    ready = sensors.prepared(log)
    z = np.interp(ready.t, true.t, true.outputs["z"])
    found = {"fused": _rms(ready.outputs["z"] - z)}
    start = float(log.t[sensors.IDLE])
    for name, label in (("z_ins", "inertial"), ("depth", "pressure gauge"), ("z_x", "tracker")):
        raw = log.outputs[name][sensors.IDLE :] - np.interp(log.t[sensors.IDLE :] - start, true.t, true.outputs["z"])
        found[label] = _rms(raw)
    return found


def forward_facts(threads: int) -> dict[str, Any]:
    """What the forward run holds of its four parameters, free or with the mass in surge given."""
    run = system.channel_trial("forward", truth("rpm steps"))
    noisy = add_noise(run, {"u": 0.02}, np.random.default_rng([SEED, 1]))
    found: dict[str, Any] = {}
    for label, free in (("all four", FREE["forward"]), ("lambda_11 given", FREE["forward"][:3])):
        values = {q.name: TRUTH[q.name] for q in channel("forward").parameters}
        parameters = system.channel_parameters("forward", free, values)
        asked = Study("forward", channel("forward"), Trials([run]), parameters=parameters, noise={"u": 0.02})
        table = prior_identifiability(asked, threads=threads)
        start = system.channel_parameters("forward", free, wide=True)
        fit = identify(
            asked.replace(trials=Trials([noisy]), parameters=start, cost=FREE_START), UNDAMPED, threads=threads
        )
        found[label] = {
            "smallest singular value": system.smallest_singular_value(asked, threads),
            "verdict": table["verdict"].to_dict(),
            "bound, %": (100.0 * table["crlb"] / table["value"].abs()).to_dict(),
            "error, %": {name: 100.0 * (value / TRUTH[name] - 1.0) for name, value in fit.values.items()},
            "said after the fit": fit.parameters["verdict"].to_dict(),
            "sentences": [entry["sentence"] for entry in fit.identifiability["weak"]],
            "steps": len(fit.history) - 1,
        }
    return found


def lateral_facts(threads: int) -> dict[str, dict[str, dict[str, float]]]:
    """Relative Cramer-Rao bounds (%) of the lateral parameters, by vehicle and by what is recorded and free.

    [V]: 60 s, 20 Hz, square wave of 15 deg, 0.2 deg/s and 0.2 deg. The coupled model, so that speed falls in turns.
    """
    found: dict[str, dict[str, dict[str, float]]] = {}
    for vehicle in (T1, T2):
        model = Torpedo(vehicle.set)
        run = _square(vehicle)
        V = float(np.mean(np.hypot(run.outputs["u"], run.outputs["v"])))
        noise = {"r": 0.2 * DEGREE, "v": 0.2 * DEGREE * V}
        seven, fixed = FREE["lateral"], tuple(q for q in FREE["lateral"] if q != "lambda_33")
        cases: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
            "yaw rate": (("r",), seven),
            "yaw rate and sideslip": (("r", "v"), seven),
            "yaw rate, lambda_33 given": (("r",), fixed),
            "yaw rate and sideslip, lambda_33 given": (("r", "v"), fixed),
            "yaw rate and sideslip, lambda_35 free": (("r", "v"), (*seven, "lambda_35")),
            "yaw rate and sideslip, lambda_55 free": (("r", "v"), (*seven, "lambda_55")),
        }
        found[vehicle.set] = {}
        for label, (seen, free) in cases.items():
            # an output that is not seen keeps its first sample alone, which the initial state is taken from
            first = np.arange(len(run)) == 0
            outputs = {c: y if c in seen else np.where(first, y, np.nan) for c, y in run.outputs.items()}
            parameters = tuple(q.replace(vary=q.name in free) for q in model.parameters)
            sd = dict.fromkeys(run.outputs, 1.0) | noise
            asked = Study(label, model, Trials([replace(run, outputs=outputs)]), parameters=parameters, noise=sd)
            table = prior_identifiability(asked, threads=threads)
            part = 100.0 * table["crlb"] / table["value"].abs()
            found[vehicle.set][label] = {str(name): float(value) for name, value in part.items()}
    return found


def excited(ready: Mapping[str, Trial], threads: int) -> dict[str, dict[str, float]]:
    """Largest relative bound (%) of each channel's parameters, by run: which run excites which channel.

    Of those that are not zero; the tank's values are all that is known beforehand.
    """
    found: dict[str, dict[str, float]] = {}
    for run, trial in ready.items():
        row: dict[str, float] = {}
        for name in SEEN:
            parameters = system.channel_parameters(name, _free(name))
            sd = sensors.bound_noise(SEEN[name])
            asked = system.study(name, [system.channel_trial(name, trial)], parameters, noise=sd, cost=FREE_START)
            table = prior_identifiability(asked, threads=threads)
            part = (100.0 * table["crlb"] / table["value"].abs())[table["value"] != 0.0]
            row[name] = float(part.max())
        found[run] = row
    return found


def decide(ready: Mapping[str, Trial], threads: int) -> dict[str, dict[str, float]]:
    """Disagreement of each channel's open loop at the tank's values, output by output [P]."""
    found = {}
    for name, runs in CHANNEL_RUNS.items():
        trial = system.channel_trial(name, ready[runs[0]])
        model = channel(name)
        (y,) = system.open_loop(model, system.tank(q.name for q in model.parameters), [trial], threads)
        found[name] = {output: system.disagreement(y, trial, output) for output in SEEN[name]}
    return found


def fit_channels(ready: Mapping[str, Trial], threads: int) -> dict[str, dict[str, Any]]:
    """Each channel by Newton-Raphson, undamped as published and damped, from the tank's values."""
    found = {}
    for name, runs in CHANNEL_RUNS.items():
        own = [system.channel_trial(name, ready[run]) for run in runs]
        ways = {}
        for label, solver in (("undamped", UNDAMPED), ("damped", DAMPED)):
            parameters = system.channel_parameters(name, _free(name), wide=True)
            ways[label] = _summary(identify(system.study(name, own, parameters), solver, seed=SEED, threads=threads))
        found[name] = ways
    return found


def fit_all(ready: Mapping[str, Trial], threads: int) -> dict[str, Any]:
    """The coupled model on the three runs at once, from the tank's values."""
    runs = [system.full_trial(ready[name]) for name in FITTED]
    parameters = system.full_parameters(ALL_FREE, wide=True)
    return _summary(identify(system.full_study(runs, parameters), DAMPED, seed=SEED, threads=threads))


def starts(count: int, seed: int) -> list[dict[str, Any]]:
    """Undamped and damped Newton from random starts 20 to 40 % off either way, on the channels' reference trials.

    Own data of each channel (no other error than white noise), so that only the solver is on trial.
    """
    rows: list[dict[str, Any]] = []
    for place, name in enumerate(SEEN):
        own = own_trials(name, np.random.default_rng([seed, place]))
        for k in range(count):
            rng = np.random.default_rng([seed, place, k])
            factors = {
                q: 1.0 + float(rng.uniform(0.2, 0.4)) * float(rng.choice([-1.0, 1.0])) for q in _free(name) if TRUTH[q]
            }
            base = {q.name: TRUTH[q.name] * factors.get(q.name, 1.0) for q in channel(name).parameters}
            parameters = system.channel_parameters(name, _free(name), base, wide=True)
            best = math.inf
            outcome = {}
            for label, solver in (("undamped", UNDAMPED), ("damped", DAMPED)):
                estimate = identify(_own_study(name, own, parameters), solver, seed=seed, threads=1)
                outcome[label] = (estimate.outcome["value"], estimate.outcome["code"], len(estimate.history) - 1)
                best = min(best, estimate.outcome["value"])
            truth_value = _value_at_truth(name, own)
            for label, (value, code, steps) in outcome.items():
                reached = math.isfinite(value) and value < truth_value + 0.1
                rows.append(
                    {"channel": name, "start": k, "way": label, "reached": reached, "steps": steps, "code": code}
                )
    return rows


def own_trials(name: str, rng: np.random.Generator) -> list[Trial]:
    """A channel's own synthetic trials: its model under the inputs of its runs, white noise at the logger's rate."""
    return [add_noise(run, {key: sensors.NOISE[key] for key in SEEN[name]}, rng) for run in _clean(name)]


@cache
def _clean(name: str) -> tuple[Trial, ...]:
    model, found = channel(name), []
    values = {q.name: TRUTH[q.name] for q in model.parameters}
    for run in CHANNEL_RUNS[name]:
        true, change = truth(run), _accelerations(run)
        y = true.outputs
        a_x = change["u"] + y["q"] * y["w"] - y["r"] * y["v"]
        a_y = change["v"] + y["r"] * y["u"] - y["p"] * y["w"]
        own = system.channel_trial(name, replace(true, outputs={**y, "a_x": a_x, "a_y": a_y}))
        made = system.simulated(model, values, own)
        found.append(replace(own, outputs={key: made[key] for key in SEEN[name]}))
    return tuple(found)


def seeds(count: int, seed: int, workers: int, fin_noise: float | None = None) -> list[dict[str, Any]]:
    """Errors over bounds and coverage of all ways, over noise seeds."""
    bound = _bounds()
    jobs = (delayed(_one_seed)(seed, k, fin_noise, bound) for k in range(count))
    # a few are done before other processes have started
    return [row for rows in Parallel(n_jobs=workers if count > 4 else 1)(jobs) for row in rows]


def validate(
    ready: Mapping[str, Trial], values: Mapping[str, Mapping[str, float]], threads: int
) -> dict[str, dict[str, dict[str, list[float]]]]:
    """Open loop of the coupled model on the unfitted runs with several sets of values, and what was measured."""
    runs = [system.full_trial(ready[name]) for name in UNFITTED]
    found: dict[str, Any] = {name: {} for name in UNFITTED}
    for trial in runs:
        found[trial.name]["measured"] = {
            **{key: y.tolist() for key, y in trial.outputs.items()},
            "z": ready[trial.name].outputs["z"].tolist(),
            "t": trial.t.tolist(),
        }
    for label, given in values.items():
        for trial, y in zip(runs, system.open_loop(Torpedo("T1"), given, runs, threads)):
            found[trial.name][label] = {key: y[key].tolist() for key in (*system.FULL_SEEN, "x", "y", "z")}
    return found


@cache
def _accelerations(run: str) -> dict[str, Any]:
    return dict(sensors.rates_of(truth(run), "T1"))


def _one_seed(
    seed: int, k: int, fin_noise: float | None, bounds: Mapping[str, Mapping[str, float]]
) -> list[dict[str, Any]]:
    ready = trials(FITTED, (seed, k), sensors.FIN_NOISE if fin_noise is None else fin_noise)
    rows: list[dict[str, Any]] = []

    def add(way: str, estimate: Any, bound: Mapping[str, float]) -> None:
        for name, line in estimate.parameters.iterrows():
            true = TRUTH[name]
            rows.append(
                {
                    **{"seed": k, "way": way, "parameter": name, "error": float(line["value"]) - true},
                    **{"bound": bound[name], "stderr": float(line["stderr"])},
                    "covered": bool(line["lower"] <= true <= line["upper"]),
                }
            )

    for name, runs in CHANNEL_RUNS.items():
        parameters = system.channel_parameters(name, _free(name), wide=True)
        seen = [system.channel_trial(name, ready[run]) for run in runs]
        add(f"channel {name}", identify(system.study(name, seen, parameters), DAMPED, threads=1), bounds[name])
        if fin_noise is None:
            own = own_trials(name, np.random.default_rng([seed, k, 100]))
            add(f"own {name}", identify(_own_study(name, own, parameters), DAMPED, threads=1), bounds[name])
    fitted = [system.full_trial(ready[name]) for name in FITTED]
    full = system.full_study(fitted, system.full_parameters(ALL_FREE, wide=True))
    add("all at once", identify(full, DAMPED, threads=1), bounds["all at once"])
    return rows


def _bounds() -> dict[str, dict[str, float]]:
    """Cramer-Rao bounds of each way at the truth, from the white noise of the raw samples: nothing prepared."""
    found = {}
    for name in SEEN:
        found[name] = _crlb(_own_study(name, _clean(name), _at_truth(name)))
    sd = {key: sensors.NOISE[key] for key in system.FULL_SEEN}
    values = dict(TRUTH)
    parameters = system.full_parameters(ALL_FREE, values, wide=True)
    runs = [system.full_trial(truth(name)) for name in FITTED]
    found["all at once"] = _crlb(system.full_study(runs, parameters, noise=sd, cost=FREE_START))
    return found


def _crlb(asked: Study) -> dict[str, float]:
    table = prior_identifiability(asked, threads=1)
    return {str(name): float(value) for name, value in table["crlb"].items()}


def _at_truth(name: str) -> tuple[Parameter, ...]:
    values = {q.name: TRUTH[q.name] for q in channel(name).parameters}
    return system.channel_parameters(name, _free(name), values, wide=True)


def _own_study(name: str, own: Sequence[Trial], parameters: tuple[Parameter, ...]) -> Study:
    sd = {key: sensors.NOISE[key] for key in SEEN[name]}
    given = tuple(q.replace(value=TRUTH[q.name]) if q.name == "lambda_11" else q for q in parameters)
    return system.study(name, own, given, noise=sd, cost=FREE_START)


def _value_at_truth(name: str, own: Sequence[Trial]) -> float:
    """Least cost near the truth: damped Newton from the truth itself."""
    estimate = identify(_own_study(name, own, _at_truth(name)), DAMPED, threads=1)
    return float(estimate.outcome["value"])


def _free(name: str) -> tuple[str, ...]:
    return tuple(q for q in FREE[name] if q != "lambda_11")


def _square(vehicle: Any) -> Trial:
    """The lateral reference trial: the rudder from limit to limit."""

    class Wave(Run):
        def helm(self) -> Any:
            steer = super().helm()

            def helm(t: float, y: Mapping[str, float]) -> Mapping[str, float] | None:
                orders = steer(t, y)
                side = 1.0 if (t // (0.5 * SQUARE[vehicle.set])) % 2 == 0 else -1.0
                return None if orders is None else {**orders, "delta": side * LIMIT}

            return helm

    return sail(Wave("square wave", vehicle, 60.0 + STEP))


def _summary(estimate: Any) -> dict[str, Any]:
    table = estimate.parameters
    return {
        **{"code": estimate.outcome["code"], "reason": estimate.outcome["reason"]},
        **{"steps": len(estimate.history) - 1, "evaluations": estimate.outcome["evaluations"]},
        **{key: table[key].to_dict() for key in ("value", "stderr", "start", "lower", "upper", "verdict")},
        "sentences": [entry["sentence"] for entry in estimate.identifiability["weak"]],
        "fit": estimate.fit[["trial", "channel", "rmse", "rmse_start", "noise"]].to_dict("records"),
    }


def _rms(error: Any) -> float:
    return float(np.sqrt(np.nanmean(np.asarray(error) ** 2)))
