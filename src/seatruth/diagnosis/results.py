"""What `diagnose` found, as it is shown, saved and read again."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from seatruth.errors import BadInput
from seatruth.estimate import decoded, encoded
from seatruth.models.parameter import Prior
from seatruth.storage.atomic import write_files
from seatruth.trials.finding import Finding

FORMAT = 1
NAME = "diagnosis.json"
TRACES = "diagnosis_traces.parquet"
_PARTS = (
    *("study", "model", "synthetic", "seed", "trials", "effects", "left_out", "noise", "gap", "shares", "where"),
    *("candidates", "which", "verdict", "unnamed", "how_far", "next_trial", "augmented", "outcome", "provenance"),
)


@dataclass(eq=False)
class Diagnosis:
    """Where the simulator and the trials disagree, which effect causes it, how far it shrinks, how sure, what next.

    docs/diagnosis.md documents each part as `diagnosis.json` holds it.

    Attributes:
        study, model, seed: names, and the seed that was used.
        synthetic: whether a simulator made any of the trials.
        trials: name, samples, duration and step of each trial.
        effects, left_out: effects that took part, and why others did not.
        noise, gap, shares: measurement noise, errors against it, and the parts of the gap.
        where: place, time and operating region of the disagreement.
        candidates, which, verdict: the answers, the effects and what follows, with probabilities.
        unnamed: what an unnamed cause would look like.
        how_far: prediction of trials that were left out.
        next_trial: trials that would tell the open answers apart.
        augmented: the model with the named effects.
        outcome, findings, provenance: how it ended, what a user should read, and what made it.
        traces: trial, t (s), channel, measured, and the simulated before, refit and effect.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Diagnosis, diagnose
        >>> study = seatruth.sample.load("diagnose.toml")
        >>> short = study.replace(trials=study.trials[:2])
        >>> folder = diagnose(short, ["current"], left_out=False, suggest=False).save("diagnosis")
        >>> Diagnosis.load(folder).study
        'sample without its current'
    """

    study: str
    model: str
    synthetic: bool
    seed: int
    trials: list[dict[str, Any]]
    effects: list[dict[str, Any]]
    """Every effect that took part: name, number, title, family, acts_on, equation, unit and prior of its parameters."""
    left_out: dict[str, str]
    """Installed effects that cannot act on this model, with the reason."""
    noise: list[dict[str, Any]]
    gap: list[dict[str, Any]]
    """By trial and channel: errors before, refitted, with the effects; noise; multiples of it."""
    shares: dict[str, float]
    where: dict[str, Any]
    """ "places", "time", "region"."""
    candidates: list[dict[str, Any]]
    which: list[dict[str, Any]]
    """By effect: probability, parameters with intervals, lambda, smallest detectable magnitude, confused with."""
    verdict: dict[str, Any]
    unnamed: dict[str, Any] | None
    """What something unnamed would look like: place, function of time, formula."""
    how_far: dict[str, Any] | None
    next_trial: dict[str, Any] | None
    augmented: dict[str, Any]
    """The model with the named effects: parameters by name, to simulate with."""
    outcome: dict[str, Any]
    traces: pd.DataFrame
    findings: list[Finding] = field(default_factory=list)
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def named(self) -> tuple[str, ...]:
        """Effects that the verdict names."""
        return tuple(self.verdict["effects"])

    def as_verdict(self, case: str = "") -> dict[str, Any]:
        """The short form that a blind test hashes and scores."""
        by_name = {row["name"]: row for row in self.which}
        parameters = {
            f"{name}_{q['name']}": {key: q[key] for key in ("value", "lower", "upper", "unit")}
            for name in self.named
            for q in by_name[name]["parameters"]
        }
        closure = (self.how_far or {}).get("closure")
        suggested = self.next_trial
        return {
            "case": case or self.study,
            "verdict": self.verdict["kind"],
            "effects": list(self.named),
            "candidates": [{"effects": c["effects"], "probability": c["probability"]} for c in self.candidates],
            "set": list(self.verdict["set"]),
            "places": list(self.verdict["places"]),
            "parameters": parameters,
            "closure": closure,
            "next_trial": None
            if suggested is None
            else {"manoeuvre": suggested["manoeuvre"], "gain": suggested["gain"]},
        }

    @property
    def priors(self) -> dict[str, Prior]:
        """Of the parameters of the effects in `augmented`, by their names in the model."""
        return {
            f"{row['name']}_{q['name']}": Prior(q["null"], q["typical"])
            for row in self.effects
            if row["name"] in self.augmented["effects"]
            for q in row["parameters"]
        }

    def content(self) -> dict[str, Any]:
        """Everything but the traces, as diagnosis.json holds it."""
        parts = {name: getattr(self, name) for name in _PARTS}
        return {"format": FORMAT, **parts, "findings": [dict(vars(finding)) for finding in self.findings]}

    def save(self, folder: str | Path) -> Path:
        """Writes diagnosis.json and the traces (Parquet) into a folder; CannotWrite (a BadInput) where that fails."""
        place = Path(folder)
        text = json.dumps(encoded(self.content()), indent=1, ensure_ascii=False, allow_nan=False)
        buffer = io.BytesIO()
        self.traces.to_parquet(buffer, index=False)
        write_files(place, {TRACES: buffer.getvalue(), NAME: text.encode()})
        return place

    @classmethod
    def load(cls, folder: str | Path) -> Diagnosis:
        """Reads what `save` wrote; BadInput where it is missing, damaged or of another version."""
        place = Path(folder)
        path = place / NAME if place.is_dir() or place.suffix != ".json" else place
        try:
            content = decoded(json.loads(path.read_text(encoding="utf-8")))
        except FileNotFoundError:
            raise BadInput("there is no diagnosis", where=str(path), do="Name the folder of a diagnosis.") from None
        except (OSError, ValueError) as problem:
            raise BadInput(f"it cannot be read ({problem})", where=str(path), do="Diagnose again.") from None
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise BadInput("it is no diagnosis of this version of seatruth", where=str(path), do="Diagnose again.")
        try:
            traces = pd.read_parquet(path.parent / TRACES)
            findings = [Finding(**entry) for entry in content["findings"]]
            return cls(**{name: content[name] for name in _PARTS}, traces=traces, findings=findings)
        except (KeyError, TypeError, OSError, ValueError) as problem:
            raise BadInput(f"the diagnosis is damaged ({problem})", where=str(path), do="Diagnose again.") from None

    def __str__(self) -> str:
        label = "SYNTHETIC trials. " if self.synthetic else ""
        rows = [f"  {c['probability']:6.1%}  {answer(c['effects'])}" for c in self.candidates[:5]]
        return "\n".join([f"{label}{self.study}: {self.verdict['sentence']}", *rows])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from html import escape

        label = "<b>SYNTHETIC trials.</b> " if self.synthetic else ""
        rows = "".join(
            f"<tr><td>{c['probability']:.1%}</td><td>{escape(answer(c['effects']))}</td></tr>"
            for c in self.candidates[:8]
        )
        return (
            f"<p>{label}<b>{escape(self.study)}</b>: {escape(self.verdict['sentence'])}</p>"
            f"<table><tr><th>probability</th><th>answer</th></tr>{rows}</table>"
        )


def answer(effects: object) -> str:
    """A candidate in words."""
    names = list(effects) if isinstance(effects, (list, tuple)) else []
    if not names:
        return "no effect"
    return "something that is not in the library" if names == ["unknown"] else " and ".join(map(str, names))


def towards(values: Mapping[str, tuple[float, float]], unit: str = "m/s") -> str:
    """Components north and east with their deviations as size and direction: "0.21 +- 0.03 m/s towards 40 +- 8 deg"."""
    if set(values) < {"north", "east"} or not {"north", "east"} <= set(values):
        return ""
    (north, dn), (east, de) = values["north"], values["east"]
    size = math.hypot(north, east)
    if size == 0.0:
        return ""
    d_size = math.hypot(north * dn, east * de) / size
    d_angle = math.degrees(math.hypot(north * de, east * dn) / size**2)
    angle = math.degrees(math.atan2(east, north)) % 360.0
    return f"{size:.3g} +- {d_size:.2g} {unit} towards {angle:.0f} +- {d_angle:.2g} deg"
