"""What `diagnose` returns: typed results that are shown, saved as JSON, and loaded again.

The classes below are the layout of `diagnosis.json`; the table in docs/diagnosis.md is generated from their docstrings.
Numbers are in SI units, angles in rad; probabilities are between 0 and 1; log-evidence is in nats.
"""

from __future__ import annotations

import dataclasses
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from seatruth.errors import BadInput
from seatruth.estimate import decoded, encoded
from seatruth.storage.atomic import write_files
from seatruth.storage.checksum import checksum
from seatruth.storage.regular import read_regular
from seatruth.storage.sealed import OtherVersion, sealed, unsealed
from seatruth.trials.finding import Finding

FORMAT = 3
"""Version of the layout of diagnosis.json."""
NAME = "diagnosis.json"
TRACES = "diagnosis_traces.parquet"
_LARGEST = 1_000_000_000
"""Bytes of diagnosis.json. It has some 200 kB, and some MB with many trials and effects."""
UNKNOWN = "unknown"
"""Stands among effects for a cause that is not in the library."""

Kind = Literal["effects", "inseparable", "no_gap", "underpowered", "unknown"]


@dataclass(frozen=True)
class EffectParameter:
    """One parameter of an effect as the trials give it, with its 95 % interval."""

    name: str
    """Of the parameter, as the effect names it."""
    unit: str
    """Its unit."""
    value: float
    """Fitted together with the verdict's effects, or alone."""
    stderr: float
    """Standard error; coefficients, initial states, noise and discrepancy are marginalised."""
    lower: float
    """Lower end of the 95 % interval."""
    upper: float
    """Upper end of it."""
    null: float
    """Value at which the effect vanishes."""
    prior_sd: float
    """Standard deviation of what is believed of it before the trials."""


@dataclass(frozen=True)
class EffectResult:
    """One effect of the library: how probable, how large, and what it can be confused with."""

    name: str
    """As study files and `--effects` name it."""
    title: str
    """In words."""
    cause: str
    """Its node in the tree of causes, "environment.force_fixed_to_earth.wind"."""
    acts_on: tuple[str, ...]
    """Equations ("surge"), "kinematics", "actuator:INPUT", "sensor:OUTPUT"."""
    equation: str
    """As text."""
    probability: float
    """Posterior inclusion probability: that it acts, alone or with others."""
    log_evidence: float
    """Of the effect alone over the model without effects; linearized where it was not fitted."""
    noncentrality: float
    """Lambda: squared size of its signature in standard deviations, once all else is refitted; NaN if unfitted."""
    parameters: tuple[EffectParameter, ...]
    """Empty where it was not fitted."""
    in_words: str
    """Size and direction in words, where it has a direction."""
    detectable: Mapping[str, float]
    """Smallest magnitude of each parameter that these trials show with power 0.8 in a test at 0.05."""
    typical: Mapping[str, float]
    """Typical distance of each magnitude from its null on such a vehicle; shape parameters have none."""
    units: Mapping[str, str]
    """Unit of each parameter."""
    confusable: Mapping[str, float]
    """Pairwise noncentrality to effects that it is easily taken for."""
    equivalent: tuple[str, ...]
    """Effects and parameters from which no trial can tell it."""
    share: float
    """Part of the gap (misfit above noise after the refit) that it closes; NaN where it is not in the verdict."""
    predictive_gain: float
    """Log predictive density of trials left out, with it less without it, summed (nats); NaN where not asked."""
    predictive_gain_lower: float
    """One-sided 95 % bound of the same: an effect is named only where this is positive."""
    prior_deviations: float
    """Largest distance of a parameter from its null in prior standard deviations."""


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, with or without model discrepancy beside it."""

    effects: tuple[str, ...]
    """Names of its effects."""
    discrepancy: bool
    """Whether model discrepancy acts beside them."""
    log_evidence: float
    """Laplace approximation of the log marginal likelihood, over that of the model without effects and discrepancy."""
    log_prior: float
    """Logarithm of its prior probability."""
    probability: float
    """Posterior probability; all hypotheses sum to 1."""
    settled: bool
    """Whether its fit converged."""


@dataclass(frozen=True)
class NamedCause:
    """One cause at the finest level that reaches its probability."""

    cause: str
    """Node of the tree of causes."""
    title: str
    """The node in words."""
    effects: tuple[str, ...]
    """The effects that these trials cannot tell apart, the most probable first; one where the cause is an effect."""
    probability: float
    """Of the cause at this level."""
    in_words: str
    """Size with its uncertainty, of the most probable effect."""
    share: float
    """Part of the gap that it closes."""
    small: bool
    """Significant, but of no practical size."""
    implausible: bool
    """Its size is beyond what is believed of the vehicle: it looks like this cause, it need not be it."""


@dataclass(frozen=True)
class Verdict:
    """What is said, no surer than its weakest assumption."""

    kind: Kind
    """ "effects": each cause is one effect; "inseparable": some cause is a set of effects that look alike; "no_gap";
    "underpowered": these trials cannot decide; "unknown": something acts that is not in the library."""
    causes: tuple[NamedCause, ...]
    """What is named, the largest share of the gap first."""
    probability: float
    """Of the verdict."""
    discrepancy: bool
    """Whether the model also lacks something that no effect describes."""
    places: tuple[str, ...]
    """Where the causes act."""
    sentence: str
    """The headline."""

    @property
    def effects(self) -> tuple[str, ...]:
        """The most probable effect of each named cause."""
        return tuple(cause.effects[0] for cause in self.causes)

    @property
    def members(self) -> tuple[str, ...]:
        """All effects of causes that are sets."""
        return tuple(name for cause in self.causes if len(cause.effects) > 1 for name in cause.effects)


@dataclass(frozen=True)
class Fold:
    """One trial predicted from the others. Errors are root mean square, in standard deviations of the noise."""

    trial: str
    """The trial left out."""
    effects: tuple[str, ...]
    """Effects that the other trials alone select among the leading hypotheses."""
    error_refit: float
    """Coefficients refitted to the other trials, no effect."""
    error_effects: float
    """The effects of the verdict as well, refitted to the other trials."""
    error_discrepancy: float
    """Control: discrepancy terms refitted to the other trials instead of effects."""
    predictive_gain: float
    """Log predictive density with the effects less without (nats)."""


@dataclass(frozen=True)
class Validation:
    """Leave-one-trial-out cross-validation of the named effects."""

    folds: tuple[Fold, ...]
    """One per trial."""
    gap_explained: float
    """(refit - effects) / (refit - noise) of mean errors of the trials left out; NaN where there is no gap."""
    lower: float
    """Lower end of its 95 % interval over trials, after Fieller; infinite where the trials do not bound it."""
    upper: float
    """Upper end of it."""
    control: float
    """The same for the control."""


@dataclass(frozen=True)
class MenuEntry:
    """One candidate trial."""

    manoeuvre: str
    """Its name."""
    text: str
    """What the crew does."""
    noncentrality: float
    """Smallest pairwise noncentrality between the surviving causes, with this trial added."""
    gain: float
    """Factor by which it grows, clipped at 8."""
    weakest: tuple[str, ...]
    """The pair that stays closest."""


@dataclass(frozen=True)
class NextTrial:
    """The trial that best separates the causes that are left; `manoeuvre` is empty where none of the menu helps."""

    manoeuvre: str
    """Name of the suggested trial."""
    text: str
    """What the crew does."""
    survivors: tuple[str, ...]
    """Causes that it is to separate: effects, or "unknown"."""
    noncentrality_now: float
    """Smallest pairwise noncentrality between them on the recorded trials."""
    noncentrality_then: float
    """The same with the suggested trial added."""
    gain: float
    """Factor by which it grows, clipped at 8."""
    menu: tuple[MenuEntry, ...]
    """All candidates, the best first."""
    t: tuple[float, ...]
    """s."""
    inputs: Mapping[str, tuple[float, ...]]
    """Inputs to apply over `t`."""
    motion: Mapping[str, tuple[float, ...]]
    """Expected outputs over `t`."""
    units: Mapping[str, str]
    """Unit of each input and output."""


@dataclass(frozen=True)
class MissingForce:
    """The missing acceleration of one equation in one trial: the discrepancy as a function of time."""

    trial: str
    """A trial."""
    equation: str
    """An equation of motion."""
    t: tuple[float, ...]
    """s."""
    value: tuple[float, ...]
    """Missing acceleration."""
    stderr: tuple[float, ...]
    """Its standard error."""
    unit: str
    """Of the acceleration."""


@dataclass(frozen=True)
class MissingTerm:
    """One term of the formula of what is missing in an equation: coefficient times a dimensionless function."""

    equation: str
    """The equation to which it is added."""
    term: str
    """Dimensionless function of motion and inputs; 1 for a constant."""
    coefficient: float
    """Acceleration where the function is 1."""
    stderr: float
    """Its standard error."""
    unit: str
    """Unit of the coefficient."""


@dataclass(frozen=True)
class Discrepancy:
    """What the model's structure lacks, beside the verdict's effects."""

    sizes: Mapping[str, float]
    """By equation: size of the missing acceleration as a part of the usual one."""
    forces: tuple[MissingForce, ...]
    """The missing acceleration over time, by trial and equation."""
    terms: tuple[MissingTerm, ...]
    """The terms that stand out, the clearest first."""
    log_evidence: float
    """Of discrepancy beside the verdict's effects, over none."""


@dataclass(frozen=True)
class Coefficient:
    """A free coefficient of the model, refitted together with the verdict's effects."""

    name: str
    """Of the coefficient."""
    unit: str
    """Its unit."""
    declared: float
    """Value in the study."""
    prior_sd: float
    """Standard deviation of its prior, whose mean is the declared value."""
    value: float
    """Refitted."""
    stderr: float
    """Its standard error."""


@dataclass(frozen=True)
class ChannelNoise:
    """Measurement noise of one channel: white, and slow (Ornstein-Uhlenbeck)."""

    channel: str
    """An output."""
    unit: str
    """Its unit."""
    white: float
    """Standard deviation."""
    slow: float
    """Standard deviation; 0 where there is none."""
    tau: float
    """s, correlation time of the slow part."""
    declared: float
    """White standard deviation that the study states; NaN where it states none."""
    samples: int
    """Of all trials together."""


@dataclass(frozen=True)
class Shares:
    """The misfit of the model as it was declared, split; the parts sum to 1."""

    noise: float
    """Measurement noise."""
    parameters: float
    """Removed by refitting coefficients."""
    effects: float
    """Removed by the verdict's effects."""
    left: float
    """What nothing explains."""
    misfit_before: float
    """Mean squared error in multiples of the noise variance, before the refit."""
    misfit_refit: float
    """The same after the refit."""
    misfit_effects: float
    """The same with the verdict's effects."""


@dataclass(eq=False)
class Diagnosis:
    """Where a simulator and trials disagree, which effect causes it, how far the gap shrinks, how sure, what next.

    Tables are DataFrames; `traces` holds the time histories. `save` writes a folder, `load` reads it.

    Attributes:
        `study`, `model`, `synthetic`, `seed`: what was diagnosed. `verdict`: what is said. `effects`, `hypotheses`,
        `causes`, `places`: how probable each is. `noise`, `shares`, `coefficients`, `gap`, `time`, `region`,
        `discrepancy`: where and what is left. `validation`: trials left out. `next_trial`: what to try. `augmented`:
        the model with the named effects. `unavailable`, `trials`, `outcome`, `traces`, `findings`, `provenance`: the
        record.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import diagnose
        >>> study = seatruth.sample.load("diagnose.toml")
        >>> short = study.replace(trials=study.trials[:2])
        >>> found = diagnose(short, ["current", "heading_bias"], validate=False, suggest=False)
        >>> found.named, found.effect("current").cause
        (('current',), 'environment.moving_water.uniform_current')
    """

    study: str
    """Name of the study."""
    model: str
    """Name of the model."""
    synthetic: bool
    """Whether a simulator made any of the trials."""
    seed: int
    """The seed that was used."""
    verdict: Verdict
    """What is said, and how sure it is."""
    effects: tuple[EffectResult, ...]
    """Every effect that took part, the most probable first."""
    hypotheses: tuple[Hypothesis, ...]
    """Every hypothesis that was fitted, the most probable first."""
    causes: Mapping[str, float]
    """Probability that something acts, by node of the tree of causes."""
    places: Mapping[str, float]
    """Probability that something acts there: equations, kinematics, actuators, sensors."""
    noise: tuple[ChannelNoise, ...]
    """Measurement noise of each channel."""
    shares: Shares
    """The split of the misfit."""
    coefficients: tuple[Coefficient, ...]
    """Free coefficients of the model."""
    gap: pd.DataFrame
    """By trial and channel: trial, channel, unit, n, rmse_before, rmse_refit, rmse_effects, noise, multiple_before,
    multiple_refit, multiple_effects."""
    time: pd.DataFrame
    """Misfit in equal parts of each trial: trial, from_s, to_s, n, misfit (mean squared error over the noise variance),
    p, p_adjusted (for the number of parts), significant (false discovery rate 5 %)."""
    region: pd.DataFrame
    """Misfit over cells of the motion and of the inputs: variable, unit, cell, from, to, n, misfit, p, p_adjusted,
    significant."""
    discrepancy: Discrepancy | None
    """What the model's structure lacks; null where it cannot be estimated."""
    validation: Validation | None
    """Null where no trial was left out."""
    next_trial: NextTrial | None
    """Null where it was not asked for."""
    augmented: dict[str, Any]
    """The model with the named effects at their reported values: "effects", "parameters" by name."""
    unavailable: Mapping[str, str]
    """Installed effects that cannot act on this model, with the reason."""
    trials: list[dict[str, Any]]
    """Name, samples, duration_s, conditions and steps (what was done to the data) of each trial."""
    outcome: dict[str, Any]
    """How it ended: code ("done", "interrupted"), reason, wall_s, cpu_s, fits, settings, resumed."""
    traces: pd.DataFrame
    """trial, t, channel, measured, before, refit, effects."""
    findings: list[Finding] = field(default_factory=list)
    """What a user should read: severity, code, message, where, do, trial, channel."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Versions, files and hashes, settings."""

    @property
    def named(self) -> tuple[str, ...]:
        """The most probable effect of each cause that the verdict names."""
        return self.verdict.effects

    def effect(self, name: str) -> EffectResult:
        """One effect's result; BadInput where it took no part."""
        for one in self.effects:
            if one.name == name:
                return one
        raise BadInput(f"the effect {name!r} took no part in this diagnosis", do="See `unavailable` for the reason.")

    def answers(self) -> list[tuple[tuple[str, ...], float]]:
        """Probability of each answer: a set of effects, () for no gap, ("unknown",); the most probable first."""
        found: dict[tuple[str, ...], float] = {}
        for one in self.hypotheses:
            key = one.effects if one.effects or not one.discrepancy else (UNKNOWN,)
            found[key] = found.get(key, 0.0) + one.probability
        return sorted(found.items(), key=lambda entry: (-entry[1], entry[0]))

    def as_verdict(self, case: str = "") -> dict[str, Any]:
        """The short form that a blind test hashes and scores."""
        suggested, validation = self.next_trial, self.validation
        return {
            "case": case or self.study,
            "verdict": self.verdict.kind,
            "effects": list(self.named) if self.verdict.kind == "effects" else [],
            "candidates": [{"effects": list(key), "probability": p} for key, p in self.answers()],
            "set": list(self.verdict.members),
            "causes": [
                {"cause": c.cause, "effects": list(c.effects), "probability": c.probability}
                for c in self.verdict.causes
            ],
            "places": list(self.verdict.places),
            "parameters": {
                f"{name}_{q.name}": {"value": q.value, "lower": q.lower, "upper": q.upper, "unit": q.unit}
                for name in self.named
                for q in self.effect(name).parameters
            },
            "closure": None
            if validation is None or not math.isfinite(validation.gap_explained)
            else {"value": validation.gap_explained, "lower": validation.lower, "upper": validation.upper},
            "next_trial": None if suggested is None else {"manoeuvre": suggested.manoeuvre, "gain": suggested.gain},
        }

    def content(self) -> dict[str, Any]:
        """Everything but the traces, as diagnosis.json holds it."""
        found: dict[str, Any] = {}
        for entry in dataclasses.fields(self):
            value = getattr(self, entry.name)
            if entry.name == "traces":
                continue
            if isinstance(value, pd.DataFrame):
                value = value.to_dict(orient="list")
            elif entry.name == "findings":
                value = [dict(vars(finding)) for finding in value]
            else:
                value = _plain(value)
            found[entry.name] = value
        return found

    def save(self, folder: str | Path) -> Path:
        """Writes diagnosis.json and the traces (Parquet) into a folder; OSError where they cannot be written."""
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        buffer = io.BytesIO()
        self.traces.to_parquet(buffer, index=False)
        traces = buffer.getvalue()
        text = sealed({**encoded(self.content()), "traces_checksum": checksum(traces)}, FORMAT)
        write_files(place, {TRACES: traces, NAME: text})
        return place

    @classmethod
    def load(cls, folder: str | Path) -> Diagnosis:
        """Reads what `save` wrote; BadInput where it is missing, damaged or of another version."""
        place = Path(folder)
        path = place / NAME if place.is_dir() or place.suffix != ".json" else place
        try:
            content = decoded(unsealed(read_regular(path, _LARGEST), FORMAT))
        except FileNotFoundError:
            raise BadInput("there is no diagnosis", where=str(path), do="Name the folder of a diagnosis.") from None
        except BadInput:
            raise
        except OtherVersion:
            what = "it is no diagnosis of this version of seatruth"
            raise BadInput(what, where=str(path), do="Diagnose again.") from None
        except (OSError, ValueError, RecursionError) as problem:
            raise BadInput(f"it cannot be read ({problem})", where=str(path), do="Diagnose again.") from None
        try:
            data = read_regular(path.parent / TRACES)
            if checksum(data) != content["traces_checksum"]:
                raise ValueError(f"{TRACES} has changed")
            traces = pd.read_parquet(io.BytesIO(data))
            parts: dict[str, Any] = {"traces": traces}
            for entry in dataclasses.fields(cls):
                if entry.name == "traces":
                    continue
                value = content[entry.name]
                if entry.name in ("gap", "time", "region"):
                    parts[entry.name] = pd.DataFrame(value)
                elif entry.name == "findings":
                    parts[entry.name] = [Finding(**one) for one in value]
                else:
                    parts[entry.name] = TypeAdapter(_TYPES[entry.name]).validate_python(value)
            return cls(**parts)
        except (KeyError, TypeError, OSError, ValueError, ValidationError) as problem:
            raise BadInput(f"the diagnosis is damaged ({problem})", where=str(path), do="Diagnose again.") from None

    def __str__(self) -> str:
        label = "SYNTHETIC trials. " if self.synthetic else ""
        rows = [f"  {p:6.1%}  {answer(effects)}" for effects, p in self.answers()[:5]]
        return "\n".join([f"{label}{self.study}: {self.verdict.sentence}", *rows])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from html import escape

        label = "<b>SYNTHETIC trials.</b> " if self.synthetic else ""
        rows = "".join(
            f"<tr><td>{p:.1%}</td><td>{escape(answer(effects))}</td></tr>" for effects, p in self.answers()[:8]
        )
        return (
            f"<p>{label}<b>{escape(self.study)}</b>: {escape(self.verdict.sentence)}</p>"
            f"<table><tr><th>probability</th><th>answer</th></tr>{rows}</table>"
        )


_TYPES: dict[str, Any] = {
    "study": str,
    "model": str,
    "synthetic": bool,
    "seed": int,
    "verdict": Verdict,
    "effects": tuple[EffectResult, ...],
    "hypotheses": tuple[Hypothesis, ...],
    "causes": dict[str, float],
    "places": dict[str, float],
    "noise": tuple[ChannelNoise, ...],
    "shares": Shares,
    "coefficients": tuple[Coefficient, ...],
    "discrepancy": Discrepancy | None,
    "validation": Validation | None,
    "next_trial": NextTrial | None,
    "augmented": dict[str, Any],
    "unavailable": dict[str, str],
    "trials": list[dict[str, Any]],
    "outcome": dict[str, Any],
    "provenance": dict[str, Any],
}


def _plain(value: Any) -> Any:
    """Dataclasses as dictionaries, tuples as lists, at any depth."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {entry.name: _plain(getattr(value, entry.name)) for entry in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value


def answer(effects: tuple[str, ...]) -> str:
    """A set of effects in words."""
    if not effects:
        return "no effect"
    return "a cause that is not in the library" if effects == (UNKNOWN,) else " and ".join(effects)


def towards(values: Mapping[str, tuple[float, float]], unit: str = "m/s") -> str:
    """Components north and east with their deviations as size and direction: "0.21 +- 0.03 m/s towards 40 +- 8 deg"."""
    if not {"north", "east"} <= set(values):
        return ""
    (north, dn), (east, de) = values["north"], values["east"]
    size = math.hypot(north, east)
    if size == 0.0:
        return ""
    d_size = math.hypot(north * dn, east * de) / size
    d_angle = math.degrees(math.hypot(north * de, east * dn) / size**2)
    angle = math.degrees(math.atan2(east, north)) % 360.0
    return f"{size:.3g} +- {d_size:.2g} {unit} towards {angle:.0f} +- {d_angle:.2g} deg"
