"""An Estimate as `identify` gives it, made up: a Nomoto ship that turns, with every kind of verdict and finding."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from seatruth.estimate import Estimate
from seatruth.statistics.posterior_sample import Ensemble, Posterior, summarised
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Step

CHANNELS = {"x": "m", "y": "m", "psi": "rad", "u": "m/s", "v": "m/s", "r": "rad/s"}
NOISE = {"x": 0.1, "y": 0.1, "psi": 0.002, "u": 0.01, "v": 0.01, "r": 0.001}
EDGES = {"band_lower": -1.0, "band_upper": 1.0}
VERDICTS = ("identified", "identified", "weak", "identified", "not identifiable", "at bound", "from prior")
BASE = ("R_0", "X_vvvv", "Y_v", "Y_r", "Y_vvv", "Y_vrr", "N_v", "N_r", "N_vvr", "N_vrr", "a_H", "t_R")


def estimate(
    *, parameters: int = 12, trials: int = 4, samples: int = 900, synthetic: bool = True, seed: int = 1, **changes: Any
) -> Estimate:
    """A made-up estimate; `changes` replaces attributes."""
    rng = np.random.default_rng(seed)
    names = [BASE[i] if i < len(BASE) else f"Y_{i:02d}" for i in range(parameters)]
    runs = [f"zigzag_{10 + 5 * k}_{10 + 5 * k}" for k in range(trials)] + ["zigzag_20_10"]
    traces = _traces(runs, samples, rng)
    fit = _fit(traces)
    table = _parameters(names, rng)
    nuisances = _nuisances(runs[:-1], rng)
    everything = [*table.index, *nuisances.index]
    correlation = _correlation(everything, rng)
    sd = np.nan_to_num(pd.concat([table["stderr"], nuisances["stderr"]]).to_numpy(), nan=1.0)
    found: dict[str, Any] = {
        "study": "sample ship",
        "model": "mmg",
        "channels": CHANNELS,
        "synthetic": synthetic,
        "seed": 1,
        "optimizer": {"name": "least_squares", "options": {"loss": "linear", "xtol": 1e-10}},
        "cost": {
            "kind": "trajectory",
            "initial": "free",
            "segments": None,
            "noise": {name: {"sd": sd, "estimated": False} for name, sd in NOISE.items()},
        },
        "outcome": {
            "code": "converged",
            "reason": "the step and the gradient fell below their tolerances",
            "evaluations": 412,
            "wall_s": 3.217,
            "diverged": 2,
        },
        "parameters": table,
        "nuisances": nuisances,
        "covariance": correlation * np.outer(sd, sd),
        "correlation": correlation,
        "identifiability": {
            "singular_values": np.geomspace(30, 1e-3, len(names)).tolist(),
            "condition": 3.0e4,
            "weak": [
                {
                    "combination": {"Y_v": 0.71, "N_v": -0.69, "Y_r": 0.1},
                    "ratio": 0.38,
                    "sentence": "Y_v and N_v trade off: these trials alone leave their common direction uncertain by "
                    "38 % of what their priors or bounds do.",
                }
            ][: max(parameters - 1, 0)],
        },
        "sensitivity": pd.DataFrame(
            10 ** rng.uniform(-4, 0.3, (len(names), len(CHANNELS))), index=names, columns=list(CHANNELS)
        ),
        "fit": fit,
        "cross_validation": fit.loc[~fit["held_out"], ["trial", "channel", "noise"]].assign(
            rmse=fit["rmse"] * 1.4, rmse_fitted=fit["rmse"]
        ),
        "starts": _starts(names),
        "profile": {
            name: pd.DataFrame({"value": (v := np.linspace(-2, 2, 9)), "cost": 812.0 + 0.6 * v**2 + 0.1 * v**3})
            for name in names[:2]
        },
        "posterior": posterior(table, everything, sd),
        "ensemble": Ensemble("posterior", 200, 1),
        "history": pd.DataFrame(
            {
                "evaluations": np.arange(1, 400, 13),
                "best": 900 + 4e4 * np.exp(-np.arange(31) / 3),
                "seconds": np.linspace(0, 3.2, 31),
            }
        ),
        "discretisation": {c: {"error": 1e-5 * NOISE[c], "noise": NOISE[c], "ratio": 1e-5} for c in CHANNELS},
        "steps": [(runs[0], Step("unwrap", {"channels": ["psi"]}, "psi: 2 jumps of a full turn removed"))],
        "findings": [
            Finding("note", "speed-range", "The speed stays within 4 %.", "all trials", "Add a run.", channel="u"),
            Finding(
                "warning", "stuck", "r stands still for 12 samples.", "/home/me/a.csv, line 40", "Look.", runs[0], "r"
            ),
        ],
        "traces": traces,
        "provenance": {
            "seatruth": "0.1.0",
            "commit": "0123abc",
            "python": "3.11.9",
            "time_utc": "2026-01-02T03:04:05Z",
            "machine": {"cpu": "unknown", "cores": 4},
            "study_hash": "9f" * 16,
            "data": {f"{run}.csv": "ab" * 32 for run in runs},
        },
    }
    return Estimate(**(found | changes))


def empty(**changes: Any) -> Estimate:
    """An estimate with nothing in it: what the worst run could leave."""
    nothing = pd.DataFrame()
    outcome = {"code": "failed", "reason": "every candidate diverged", "evaluations": 40, "wall_s": 0.1, "diverged": 40}
    found: dict[str, Any] = dict.fromkeys(
        ("parameters", "nuisances", "covariance", "correlation", "sensitivity", "fit", "history", "traces"), nothing
    )
    found |= {"study": "s", "model": "m", "synthetic": False, "seed": 0, "optimizer": {}, "cost": {}, "steps": []}
    found |= {"outcome": outcome, "identifiability": {}, "discretisation": {}, "findings": [], "provenance": {}}
    found |= {"cross_validation": None, "starts": None, "profile": None, "channels": {}}
    found |= {"posterior": None, "ensemble": None}
    return Estimate(**(found | changes))


def posterior(table: pd.DataFrame, names: list[str], sd: np.ndarray) -> Posterior:
    """32 walkers over 300 steps: bent in the first two parameters, the first 40 steps on their way there."""
    rng = np.random.default_rng(6)
    walkers, steps = 32, 300
    z = rng.normal(size=(steps, walkers, len(names)))
    if len(names) > 1:
        z[..., 1] = 0.5 * z[..., 1] + z[..., 0] ** 2 - 1.0
    z += 6.0 * np.exp(-np.arange(steps) / 12.0)[:, None, None]
    centre = np.resize(table["value"].to_numpy(), len(names))
    places = centre + np.where(sd > 0, sd, 1.0) * z
    frame = pd.DataFrame(
        {"walker": np.tile(np.arange(1, walkers + 1), steps), "step": np.repeat(np.arange(1, steps + 1), walkers)}
    ).assign(log_probability=-0.5 * (z**2).sum(axis=2).ravel())
    values = pd.DataFrame(places.reshape(-1, len(names)), columns=[f"value {name}" for name in names])
    summary = summarised(names, places[40:], np.full(len(names), 2.0))
    return Posterior(pd.concat([frame, values], axis=1), summary, walkers, steps, 40, 0.27)


def _starts(names: list[str]) -> pd.DataFrame:
    """12 starts: 5 at the best optimum, 4 at another that is as good, 2 at a worse one, 1 without a finite cost."""
    rng = np.random.default_rng(5)
    optimum = np.array([2, 1, 1, 3, 2, 1, 2, 1, 0, 3, 1, 2])
    cost = np.array([np.inf, 812.0, 812.4, 9.3e3])[optimum] + 1e-4 * rng.random(12)
    ends = {f"end {name}": optimum + 0.001 * rng.normal(size=12) for name in names}
    frame = pd.DataFrame({"start": np.arange(1, 13), "cost": cost, "optimum": optimum, "code": "converged"})
    return pd.concat([frame.assign(reason="", evaluations=80), pd.DataFrame(ends)], axis=1)


def _traces(runs: list[str], samples: int, rng: np.random.Generator) -> pd.DataFrame:
    t = np.arange(samples) * 0.2
    parts = []
    for k, run in enumerate(runs):
        delta = np.deg2rad(10 + 5 * k) * np.sign(np.sin(2 * np.pi * t / 50))
        truth, fitted, start = (_ship(t, delta, gain) for gain in (1.0, 1.01, 1.25))
        for channel in CHANNELS:
            measured = truth[channel] + NOISE[channel] * rng.standard_normal(samples)
            if channel in ("x", "y"):
                measured[300:360] = np.nan
            frame = pd.DataFrame({"trial": run, "t": t, "channel": channel, "measured": measured})
            edges = {name: fitted[channel] + sign * NOISE[channel] for name, sign in EDGES.items()}
            parts.append(frame.assign(fitted=fitted[channel], start=start[channel], held_out=run == runs[-1], **edges))
    return pd.concat(parts, ignore_index=True)


def _ship(t: np.ndarray, delta: np.ndarray, gain: float) -> dict[str, np.ndarray]:
    step = t[1] - t[0]
    r = np.zeros_like(t)
    for i in range(1, len(t)):
        r[i] = r[i - 1] + step * (0.12 * gain * delta[i - 1] - r[i - 1]) / 4.0
    psi = np.cumsum(r) * step
    u, v = 1.18 - 9 * r**2 * gain, -2.0 * r * gain
    return {
        "x": np.cumsum(u * np.cos(psi) - v * np.sin(psi)) * step,
        "y": np.cumsum(u * np.sin(psi) + v * np.cos(psi)) * step,
        "psi": psi,
        "u": u,
        "v": v,
        "r": r,
    }


def _fit(traces: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for (trial, channel), part in traces.groupby(["trial", "channel"], sort=False):
        residual, before = part["measured"] - part["fitted"], part["measured"] - part["start"]
        rmse = float(np.sqrt(np.nanmean(residual**2)))
        rows.append(
            {
                "trial": trial,
                "channel": channel,
                "rmse": rmse,
                "noise": NOISE[str(channel)],
                "ratio": rmse / NOISE[str(channel)],
                "bias": float(residual.mean()),
                "n": int(residual.notna().sum()),
                "n_eff": float(residual.notna().sum()) / 7,
                "autocorrelation": float(residual.autocorr()),
                "held_out": bool(part["held_out"].iloc[0]),
                "rmse_start": float(np.sqrt(np.nanmean(before**2))),
            }
        )
    return pd.DataFrame(rows)


def _parameters(names: list[str], rng: np.random.Generator) -> pd.DataFrame:
    rows = []
    for i in range(len(names)):
        verdict = VERDICTS[i % len(VERDICTS)]
        start = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-2, 0))
        if i == 7:
            start = 0.0
        error = abs(start or 0.1) * {"identified": 0.02, "weak": 0.6, "not identifiable": 9.0}.get(verdict, 0.1)
        value = start + float(rng.standard_normal()) * max(error, 0.1 * abs(start))
        bounds = (start - 2 * abs(start) - 1e-3, start + 2 * abs(start) + 1e-3) if i % 3 else (-np.inf, np.inf)
        if verdict == "at bound":
            value, error, bounds = start * 1.5, np.nan, tuple(sorted((start * 0.5, start * 1.5)))
        rows.append(
            {
                "value": value,
                "unit": "1" if i else "N",
                "stderr": error,
                "lower": value - 1.96 * error,
                "upper": value + 1.96 * error,
                "crlb": error / 1.7,
                "start": start,
                "min": bounds[0],
                "max": bounds[1],
                "prior_mean": start if verdict == "from prior" else np.nan,
                "prior_sd": abs(start) / 10 if verdict == "from prior" else np.nan,
                "at_bound": verdict == "at bound",
                "verdict": verdict,
                "source": "[L] model tests",
                "description": "a coefficient of the hull",
            }
        )
    return pd.DataFrame(rows, index=pd.Index(names, name="name"))


def _nuisances(runs: list[str], rng: np.random.Generator) -> pd.DataFrame:
    names = [f"{run}: {channel}" for run in runs for channel in ("psi", "u", "v", "r")]
    out = _parameters(names, rng)
    out["unit"] = ["rad", "m/s", "m/s", "rad/s"] * len(runs)
    out["verdict"] = "identified"
    return out


def _correlation(names: list[str], rng: np.random.Generator) -> pd.DataFrame:
    factors = rng.standard_normal((len(names), 4))
    covariance = factors @ factors.T + np.eye(len(names))
    sd = np.sqrt(np.diag(covariance))
    return pd.DataFrame(covariance / np.outer(sd, sd), index=names, columns=names)


def brief(**changes: Any) -> Estimate:
    """A made-up estimate whose page has few figures, for tests of its words; `changes` replaces attributes."""
    made = estimate(
        parameters=2,
        trials=1,
        samples=40,
        **{**dict.fromkeys(("profile", "cross_validation", "starts", "posterior", "ensemble")), **changes},
    )
    made.traces = made.traces[made.traces["channel"] == "u"]
    made.fit = made.fit[made.fit["channel"] == "u"]
    return made
