"""A diagnosis made by hand, of every kind of verdict. SYNTHETIC: no trial and no simulation is behind its numbers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from seatruth.diagnosis.parts import (
    ChannelNoise,
    Coefficient,
    Discrepancy,
    Fold,
    MenuEntry,
    MissingForce,
    MissingTerm,
    NextTrial,
    Shares,
    Validation,
)
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import verdict_sentence
from seatruth.diagnosis.verdict import EffectParameter, EffectResult, Hypothesis, Kind, NamedCause, Verdict
from seatruth.trials.finding import Finding

KINDS = (
    *("effects", "two_causes", "with_discrepancy", "implausible", "not_predictive", "inseparable", "only_small"),
    *("no_gap", "underpowered", "unknown", "unknown_small", "one_trial", "interrupted"),
)
"""What `diagnosis` can make."""
TRIALS = ("zigzag_20_20", "turn_35_port", "straight_run")
CHANNELS = {"u": ("m/s", 0.02), "psi": ("rad", 0.002), "x": ("m", 0.5)}
CURRENT = "environment.moving_water.uniform_current"
FORCE = "environment.force_fixed_to_earth"
T = tuple(float(t) for t in range(0, 101, 2))


def diagnosis(kind: str = "effects") -> Diagnosis:
    """A whole diagnosis; what is not part of the kind is the same in all."""
    verdict_kind: Kind = {
        **{"no_gap": "no_gap", "underpowered": "underpowered", "unknown": "unknown", "unknown_small": "unknown"},
        "inseparable": "inseparable",
    }.get(kind, "effects")  # type: ignore[assignment]  # the literals above are kinds
    causes = _causes(kind)
    names = tuple(cause.effects[0] for cause in causes)
    shares = _shares(kind)
    validation = None if kind in ("one_trial", "interrupted") or not names else _validation(names, kind)
    discrepancy = kind == "with_discrepancy"
    p = {"no_gap": 0.62, "underpowered": 0.4, "unknown": 0.985, "unknown_small": 0.9}.get(kind, 0.97)
    trials = TRIALS[:1] if kind == "one_trial" else TRIALS
    sentence = verdict_sentence(verdict_kind, causes, p, discrepancy, shares, validation, one_trial=kind == "one_trial")
    effects = tuple(_effect(name, chance) for name, chance in sorted(_probabilities(kind), key=lambda entry: -entry[1]))
    named = [effect for effect in effects if effect.name in names]
    return Diagnosis(
        study="fake study",
        model="mmg",
        synthetic=True,
        seed=1,
        verdict=Verdict(
            kind=verdict_kind,
            causes=causes,
            probability=p,
            discrepancy=discrepancy,
            places=tuple(dict.fromkeys(place for effect in named for place in effect.acts_on)),
            sentence=sentence,
        ),
        effects=effects,
        hypotheses=_hypotheses(kind, p, names),
        causes=_nodes(kind),
        places=_places(kind),
        noise=_noise(),
        shares=shares,
        coefficients=(
            Coefficient("Y_v", "1", -0.315, 0.06, -0.331, 0.01),
            Coefficient("N_r", "1", -0.05, 0.01, -0.079, 0.002),
        ),
        gap=_gap(trials, kind),
        time=_time(trials, kind),
        region=_region(kind),
        discrepancy=_discrepancy(kind),
        validation=validation,
        next_trial=None if kind in ("one_trial", "interrupted") else _next(kind),
        augmented={
            "effects": list(names),
            "parameters": {f"{effect.name}_{q.name}": q.value for effect in named for q in effect.parameters},
        },
        unavailable={"pitch_gyro_bias": "the model has no output 'q'"},
        trials=[
            {
                "name": trial,
                "samples": 51,
                "duration_s": 100.0,
                "conditions": {"manoeuvre": trial.partition("_")[0]},
                "steps": [{"name": "unwrap", "effect": "1 jump of psi by 360 deg"}] if n == 0 else [],
            }
            for n, trial in enumerate(trials)
        ],
        outcome={
            "code": "interrupted" if kind == "interrupted" else "done",
            "reason": "stopped by the user" if kind == "interrupted" else "everything was asked",
            "wall_s": 12.5,
            "cpu_s": 20.0,
            "fits": 18,
        },
        traces=_traces(trials),
        findings=[Finding("warning", "few-headings", "All trials keep to one course.", "the study", "Sail another.")],
        provenance={"seatruth": "0.0.0", "time_utc": "2026-01-02T03:04:05Z"},
    )


def _nodes(kind: str) -> dict[str, float]:
    if kind in ("no_gap", "underpowered", "unknown", "unknown_small"):
        return {"environment": 0.02, "sensor": 0.01}
    moving, fixed = (0.03, 0.97) if kind == "inseparable" else (0.97, 0.03)
    found = {"environment": 0.98, "environment.moving_water": moving, CURRENT: moving, FORCE: fixed}
    return {**found, f"{FORCE}.wind": 0.6 * fixed, f"{FORCE}.wave_drift": 0.4 * fixed, "sensor": 0.02}


def _places(kind: str) -> dict[str, float]:
    if kind in ("no_gap", "underpowered"):
        return {"kinematics": 0.03, "surge": 0.03, "sensor:psi": 0.005}
    if kind == "inseparable" or kind.startswith("unknown"):
        return {"yaw": 0.97, "sway": 0.97, "surge": 0.97, "kinematics": 0.03, "sensor:psi": 0.005}
    bias = 0.95 if kind in ("two_causes", "only_small") else 0.005
    return {"kinematics": 0.97, "sensor:psi": bias, "surge": 0.04, "sway": 0.04, "actuator:delta": 1e-5}


def _noise() -> tuple[ChannelNoise, ...]:
    return tuple(
        ChannelNoise(name, unit, sd, sd if name == "x" else 0.0, 8.0, math.nan, 150)
        for name, (unit, sd) in CHANNELS.items()
    )


def _time(trials: Sequence[str], kind: str) -> pd.DataFrame:
    rows = []
    for n, trial in enumerate(trials):
        for k in range(4):
            row = {"trial": trial, "from_s": 25.0 * k, "to_s": 25.0 * (k + 1), "n": 36, "p": 0.5 if k == 0 else 1e-6}
            row |= {"misfit": 1.0 + 20.0 * k * (n == 1), "p_adjusted": row["p"]}
            rows.append(row | {"significant": n == 1 and k > 0 and kind != "no_gap"})
    return pd.DataFrame(rows)


def named(
    cause: str, title: str, effects: Sequence[str], in_words: str, *, share: float = 0.9, **flags: bool
) -> NamedCause:
    """A cause that a verdict names."""
    marks = {"small": False, "implausible": False, **flags}
    return NamedCause(cause, title, tuple(effects), 0.97, in_words, share, marks["small"], marks["implausible"])


def _causes(kind: str) -> tuple[NamedCause, ...]:
    current = named(CURRENT, "a uniform current", ["current"], "0.205 +- 0.02 m/s towards 40 +- 6 deg")
    offset = named(
        "sensor.bias_or_scale.angle", "an offset or a deviation of an angle sensor", ["heading_bias"],
        "angle 0.12 +- 0.023 deg", share=0.004, small=True,
    )  # fmt: skip
    if kind in ("no_gap", "underpowered", "unknown", "unknown_small"):
        return ()
    if kind == "two_causes":
        return (dataclasses.replace(current, share=0.85), offset)
    if kind == "only_small":
        return (offset,)
    if kind == "implausible":
        return (dataclasses.replace(current, implausible=True),)
    if kind == "inseparable":
        title = "a steady force fixed to the earth"
        return (named(FORCE, title, ["wind", "wave_drift"], "8.1 +- 1.2 m/s towards 323 +- 8 deg"),)
    return (current,)


def _probabilities(kind: str) -> list[tuple[str, float]]:
    if kind in ("no_gap", "underpowered", "unknown", "unknown_small"):
        return [("current", 0.03), ("wind", 0.02), ("wave_drift", 0.01), ("heading_bias", 0.005)]
    if kind == "inseparable":
        return [("wind", 0.6), ("wave_drift", 0.37), ("current", 0.03), ("heading_bias", 0.005)]
    bias = 0.95 if kind in ("two_causes", "only_small") else 0.005
    return [("current", 0.97), ("heading_bias", bias), ("wind", 0.02), ("wave_drift", 0.01)]


_EFFECTS: dict[str, dict[str, Any]] = {
    "current": {
        "title": "constant current", "cause": CURRENT, "acts_on": ("kinematics",), "equation": "v_r = v - R(psi) v_c",
        "parameters": {"north": ("m/s", 0.157, 0.02), "east": ("m/s", 0.132, 0.02)}, "typical": 0.3,
        "in_words": "0.205 +- 0.02 m/s towards 40 +- 6 deg", "confusable": {"wind": 40.0, "wave_drift": 35.0},
    },
    "wind": {
        "title": "steady wind", "cause": f"{FORCE}.wind", "acts_on": ("surge", "sway", "yaw"),
        "equation": "X = q A C_X",
        "parameters": {"north": ("m/s", 6.5, 1.2), "east": ("m/s", -4.9, 1.2)}, "typical": 8.0,
        "in_words": "8.1 +- 1.2 m/s towards 323 +- 8 deg", "confusable": {"wave_drift": 1.5, "current": 40.0},
    },
    "wave_drift": {
        "title": "mean wave drift", "cause": f"{FORCE}.wave_drift", "acts_on": ("surge", "sway", "yaw"),
        "equation": "X = d",
        "parameters": {"north": ("N", 210.0, 40.0), "east": ("N", -160.0, 40.0)}, "typical": 100.0,
        "in_words": "264 +- 40 N towards 323 +- 8 deg", "confusable": {"wind": 1.5},
    },
    "heading_bias": {
        "title": "heading offset", "cause": "sensor.bias_or_scale.angle", "acts_on": ("sensor:psi",),
        "equation": "psi + b", "parameters": {"angle": ("rad", 0.0021, 0.0004)}, "typical": 0.001,
        "in_words": "", "confusable": {},
    },
}  # fmt: skip


def _effect(name: str, probability: float) -> EffectResult:
    about = _EFFECTS[name]
    typical, likely = float(about["typical"]), probability > 0.3
    parameters = tuple(
        EffectParameter(q, unit, value, sd, value - 1.96 * sd, value + 1.96 * sd, 0.0, typical)
        for q, (unit, value, sd) in about["parameters"].items()
    )
    units = {q: unit for q, (unit, *_) in about["parameters"].items()}
    return EffectResult(
        name=name,
        title=about["title"],
        cause=about["cause"],
        acts_on=about["acts_on"],
        equation=about["equation"],
        probability=probability,
        log_evidence=60.0 if likely else -1.0,
        noncentrality=140.0 if likely else math.nan,
        parameters=parameters if likely else (),
        in_words=about["in_words"] if likely else "",
        detectable=dict.fromkeys(units, 2.0 * typical if name == "heading_bias" else 0.1 * typical),
        typical=dict.fromkeys(units, typical),
        units=units,
        confusable=about["confusable"],
        equivalent=("speed_bias",) if name == "current" else (),
        share=0.9 if likely else math.nan,
        predictive_gain=31.0 if likely else math.nan,
        predictive_gain_lower=12.0 if likely else math.nan,
        prior_deviations=0.7 if likely else math.nan,
    )


def _hypotheses(kind: str, p: float, names: tuple[str, ...]) -> tuple[Hypothesis, ...]:
    first = (names, kind == "with_discrepancy" or kind.startswith("unknown"))
    if kind == "underpowered":
        first = ((), False)
    rest = [(("wind",), False), (("wave_drift",), False), (("current", "heading_bias"), False), ((), False), ((), True)]
    others = [key for key in rest if key != first]
    if kind == "inseparable":
        others.remove((("wave_drift",), False))
        left = [0.6, 0.37, *[(1.0 - 0.97) / len(others)] * len(others)]
        keys = [first, (("wave_drift",), False), *others]
    else:
        left, keys = [p, *[(1.0 - p) / len(others)] * len(others)], [first, *others]
    return tuple(
        Hypothesis(key, extra, 60.0 - 10.0 * k, -1.6, chance, settled=k < 4)
        for k, ((key, extra), chance) in enumerate(zip(keys, left))
    )


def _shares(kind: str) -> Shares:
    if kind in ("no_gap", "unknown_small", "underpowered", "only_small"):
        return Shares(0.4, 0.58, 0.0, 0.02, 2.5, 1.05, 1.05)
    if kind == "unknown":
        return Shares(0.1, 0.2, 0.0, 0.7, 10.0, 8.0, 8.0)
    return Shares(0.1, 0.2, 0.65, 0.05, 10.0, 8.0, 1.5)


def _validation(names: tuple[str, ...], kind: str) -> Validation:
    poor = kind == "not_predictive"
    folds = tuple(Fold(trial, names, 2.8, 2.9 if poor else 1.1, 2.6, -0.5 if poor else 10.0) for trial in TRIALS)
    if poor:
        return Validation(folds, 0.08, -0.4, 0.56, 0.1)
    return Validation(folds, 0.93, 0.85, 1.0, 0.12)


def _gap(trials: Sequence[str], kind: str) -> pd.DataFrame:
    large = kind not in ("no_gap", "unknown_small", "underpowered", "only_small")
    multiples = {"before": 4.0, "refit": 3.0 if large else 1.02, "effects": 3.0 if kind == "unknown" else 1.01}
    rows = []
    for trial in trials:
        for channel, (unit, noise) in CHANNELS.items():
            row: dict[str, Any] = {"trial": trial, "channel": channel, "unit": unit, "n": 50, "noise": noise}
            row |= {f"rmse_{fit}": noise * m for fit, m in multiples.items()}
            rows.append(row | {f"multiple_{fit}": m for fit, m in multiples.items()})
    return pd.DataFrame(rows)


def _region(kind: str) -> pd.DataFrame:
    rows = []
    for k, cell in enumerate(("north", "east", "south", "west")):
        row = {"variable": "heading", "unit": "rad", "cell": cell, "from": k * math.pi / 2, "to": (k + 1) * math.pi / 2}
        rows.append(row | {"n": 40, "misfit": 1.0 + 5.0 * k})
    for k in range(2):
        row = {"variable": "speed", "unit": "m/s", "cell": "", "from": 0.5 * k, "to": 0.5 * (k + 1)}
        rows.append(row | {"n": 40, "misfit": 2.0})
    for row in rows:
        row["p"] = row["p_adjusted"] = 0.001 if row["misfit"] > 10.0 else 0.4
        row["significant"] = row["misfit"] > 10.0 and kind != "no_gap"
    return pd.DataFrame(rows)


def _discrepancy(kind: str) -> Discrepancy:
    grave = kind in ("with_discrepancy", "unknown")
    forces = tuple(
        MissingForce(trial, "yaw", T, tuple(0.001 * math.sin(t / 9.0) for t in T), (3e-4,) * len(T), "rad/s^2")
        for trial in TRIALS
    )
    terms = (
        MissingTerm("yaw", "v r / U^2", 0.25, 0.02, "rad/s^2"),
        MissingTerm("yaw", "1", -0.02, 0.004, "rad/s^2"),
    )
    sizes = {"yaw": 0.21, "sway": 0.03, "surge": 0.0} if grave else {"yaw": 0.002, "sway": 0.0, "surge": 0.0}
    return Discrepancy(sizes, forces if grave else (), terms if grave else (), 24.0 if grave else -3.0)


def _next(kind: str) -> NextTrial:
    helps = kind in ("inseparable", "effects", "underpowered")
    track = {"x": T, "y": tuple(10.0 * math.sin(t / 30.0) for t in T), "psi": tuple(t / 100.0 for t in T)}
    pair = ("wind", "wave_drift")
    menu = (
        MenuEntry(
            "turn by +delta", "rudder hard over to starboard", 100.0 if helps else 4.0, 8.0 if helps else 1.0, pair
        ),
        MenuEntry("zigzag 10/10", "rudder 10 deg to each side", 9.0 if helps else 4.0, 2.2 if helps else 1.0, pair),
    )
    none: dict[str, tuple[float, ...]] = {}
    return NextTrial(
        manoeuvre="turn by +delta" if helps else "",
        text="rudder hard over to starboard" if helps else "",
        survivors=("wind", "wave_drift", "unknown"),
        noncentrality_now=4.0,
        noncentrality_then=100.0 if helps else 4.0,
        gain=8.0 if helps else 1.0,
        menu=menu,
        t=T if helps else (),
        inputs={"delta": tuple(0.6 * (t > 10.0) for t in T)} if helps else none,
        motion=track if helps else none,
        units={"delta": "rad", "x": "m", "y": "m", "psi": "rad"},
    )


def _traces(trials: Sequence[str]) -> pd.DataFrame:
    rng = np.random.default_rng(0)
    parts = []
    for trial in trials:
        for channel, (_, noise) in CHANNELS.items():
            t = np.array(T)
            gap = 3.0 * noise * np.sin(t / 20.0)
            values = {
                "measured": gap + noise * rng.normal(size=t.size),
                "before": -gap,
                "refit": 0.0 * t,
                "effects": gap,
            }
            parts.append(pd.DataFrame({"trial": trial, "t": t, "channel": channel, **values}))
    return pd.concat(parts, ignore_index=True)
