"""A diagnosis made by hand, of every kind of verdict. SYNTHETIC: no trial and no simulation is behind its numbers."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import fake_parts

from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.sentences import verdict_sentence
from seatruth.diagnosis.verdict import EffectParameter, EffectResult, Hypothesis, Kind, NamedCause, Verdict
from seatruth.trials.finding import Finding
from seatruth.uncertainty.moved_coefficients import Coefficient

KINDS = (
    *("effects", "two_causes", "with_discrepancy", "implausible", "not_predictive", "inseparable", "only_small"),
    *("no_gap", "underpowered", "unknown", "unknown_small", "one_trial", "interrupted"),
)
"""What `diagnosis` can make."""
CURRENT = "environment.moving_water.uniform_current"
FORCE = "environment.force_fixed_to_earth"


def diagnosis(kind: str = "effects") -> Diagnosis:
    """A whole diagnosis; what is not part of the kind is the same in all."""
    verdict_kind: Kind = {
        **{"no_gap": "no_gap", "underpowered": "underpowered", "unknown": "unknown", "unknown_small": "unknown"},
        "inseparable": "inseparable",
    }.get(kind, "effects")
    causes = _causes(kind)
    names = tuple(cause.effects[0] for cause in causes)
    shares = fake_parts.shares(kind)
    validation = None if kind in ("one_trial", "interrupted") or not names else fake_parts.validation(names, kind)
    discrepancy = kind == "with_discrepancy"
    p = {"no_gap": 0.62, "underpowered": 0.4, "unknown": 0.985, "unknown_small": 0.9}.get(kind, 0.97)
    trials = fake_parts.TRIALS[:1] if kind == "one_trial" else fake_parts.TRIALS
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
        noise=fake_parts.noise(),
        shares=shares,
        coefficients=(
            Coefficient("Y_v", "1", -0.315, 0.06, -0.331, 0.01),
            Coefficient("N_r", "1", -0.05, 0.01, -0.079, 0.002),
        ),
        gap=fake_parts.gap_table(trials, kind),
        time=fake_parts.time_table(trials, kind),
        region=fake_parts.region_table(kind),
        discrepancy=fake_parts.discrepancy(kind),
        validation=validation,
        next_trial=None if kind in ("one_trial", "interrupted") else fake_parts.next_trial(kind),
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
        traces=fake_parts.traces(trials),
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
