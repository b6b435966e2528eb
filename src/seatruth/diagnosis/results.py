"""What `diagnose` returns: typed results that are shown, saved as JSON, and loaded again.

`Diagnosis` and the classes of its fields (`verdict.py`, `parts.py`) are the layout of `diagnosis.json`; the table in
docs/diagnosis.md is generated from their docstrings. Numbers are in SI units, angles in rad; probabilities are between
0 and 1; log-evidence is in nats.
"""

from __future__ import annotations

import dataclasses
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_type_hints

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from seatruth.diagnosis.parts import ChannelNoise, Discrepancy, NextTrial, Shares, Validation
from seatruth.diagnosis.verdict import UNKNOWN, EffectResult, Hypothesis, Verdict, answer
from seatruth.errors import BadInput
from seatruth.estimate import decoded, encoded
from seatruth.storage.atomic import write_files
from seatruth.storage.checksum import checksum
from seatruth.storage.regular import read_regular
from seatruth.storage.sealed import OtherVersion, sealed, unsealed
from seatruth.trials.finding import Finding
from seatruth.uncertainty.moved_coefficients import Coefficient

FORMAT = 3
"""Version of the layout of diagnosis.json."""
NAME = "diagnosis.json"
TRACES = "diagnosis_traces.parquet"
_LARGEST = 1_000_000_000
"""Bytes of diagnosis.json. It has some 200 kB, and some MB with many trials and effects."""


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
    """How it ended: code ("done", "interrupted", "budget"), reason, wall_s, cpu_s, fits, settings, resumed, and the
    evaluations of a black box."""
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
            "set": list(self.verdict.members or self.verdict.possible),
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
            for name, kind in get_type_hints(cls).items():
                if name == "traces":
                    continue
                value = content[name]
                if kind is pd.DataFrame:
                    parts[name] = pd.DataFrame(value)
                elif name == "findings":
                    parts[name] = [Finding(**one) for one in value]
                else:
                    parts[name] = TypeAdapter(kind).validate_python(value)
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


def _plain(value: Any) -> Any:
    """Dataclasses as dictionaries, tuples as lists, at any depth."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {entry.name: _plain(getattr(value, entry.name)) for entry in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value
