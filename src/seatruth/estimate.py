"""The result of an identification: parameters with their uncertainty, the fit, how it ended, and where it came from."""

from __future__ import annotations

import hashlib
import html
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import TypeAdapter

from seatruth.errors import BadInput
from seatruth.statistics.posterior_sample import CHAIN_COLUMNS, SUMMARY_COLUMNS, Ensemble, Posterior
from seatruth.storage.atomic import write_files
from seatruth.storage.regular import read_regular
from seatruth.storage.sealed import OtherVersion, sealed, unsealed
from seatruth.text import listed
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Step

FORMAT = 3
NAME = "estimate.json"
_FRAMES = (
    *("parameters", "nuisances", "covariance", "correlation", "sensitivity"),
    *("fit", "cross_validation", "starts", "history", "traces"),
)
_OPTIONAL = ("cross_validation", "starts", "posterior_chain", "posterior_summary")
"""Tables that an estimate may be without."""
_SPECIAL = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}
PARAMETER_COLUMNS = (
    *("value", "unit", "stderr", "lower", "upper", "crlb", "start", "min", "max", "prior_mean", "prior_sd"),
    *("at_bound", "verdict", "source", "description"),
)


@dataclass(frozen=True)
class _Chain:
    """What estimate.json holds of a posterior beside its tables."""

    walkers: int
    steps: int
    burn_in: int
    acceptance: float


_LARGEST = 200_000_000
"""Bytes of estimate.json. It has some 20 kB, and a few MB with thousands of trials."""
_TYPES: Mapping[str, Any] = {
    **dict.fromkeys(("study", "model"), str),
    **dict.fromkeys(("optimizer", "cost", "identifiability", "outcome", "provenance"), dict[str, Any]),
    "seed": int,
    "synthetic": bool,
    "channels": dict[str, str],
    "discretisation": dict[str, dict[str, float]],
    "profile": list[str] | None,
    "posterior": _Chain | None,
    "ensemble": Ensemble | None,
    "findings": list[Finding],
}
"""What the entries of estimate.json are."""
_NUMBERS: Mapping[str, Sequence[str]] = {
    **dict.fromkeys(("parameters", "nuisances"), ("value", "stderr", "lower", "upper", "start", "min", "max")),
    "fit": ("rmse", "rmse_start", "noise", "ratio", "bias", "n"),
    "cross_validation": ("rmse", "noise"),
    "starts": ("start", "cost", "optimum", "evaluations"),
    "history": ("evaluations", "best", "seconds"),
    "traces": ("t", "measured", "fitted", "start"),
    "posterior_chain": CHAIN_COLUMNS,
    "posterior_summary": SUMMARY_COLUMNS,
}
"""Columns of its tables that hold numbers."""


@dataclass(eq=False)
class Estimate:
    """The result of `identify`.

    Attributes:
        study, model: names.
        optimizer, cost: what was used, with all options.
        seed: the seed that was used.
        synthetic: whether a simulator made any of the trials.
        channels: unit of each output.
        parameters: table with index name: value, unit, stderr, lower and upper (95 %), crlb, start, min, max,
            prior_mean, prior_sd, at_bound, verdict ("identified", "weak", "not identifiable", "at bound", "from
            prior", "doubtful"), source, description. Values are in `unit`.
        nuisances: the same table of the free initial states.
        covariance, correlation: tables (P, P) over parameters and nuisances.
        identifiability: singular_values, condition, weak (combination, ratio, sentence).
        sensitivity: table (parameters, outputs).
        fit: one row per trial and channel: rmse, rmse_start, noise, ratio, bias, n, n_eff, autocorrelation, held_out.
        history: evaluations, best, seconds.
        outcome: code, reason, value, evaluations, diverged, clipped, wall_s.
        discretisation: channel -> error, noise, ratio.
        traces: trial, t (s), channel, measured, fitted, start, held_out; for a formula also lower and upper (95 %
            prediction interval) and its columns as "input NAME"; with an ensemble also band_lower and band_upper.
        cross_validation: trial, channel, rmse when left out, rmse_fitted, noise; or None.
        starts: one row per start of a multi-start: start, cost, optimum (1 is the best), code, reason, evaluations,
            "start NAME" and "end NAME" of each free parameter; or None.
        profile: name -> table (value, cost); or None.
        posterior: sample of the posterior (`Posterior`), or None.
        ensemble: what the bands of the traces are made of (`Ensemble`), or None.
        steps: (trial, preparation step) in their order.
        findings: what a user should read.
        provenance: versions, files and hashes, and `settings`: where every setting of the run came from.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import Budget, Estimate, identify
        >>> estimate = identify(seatruth.sample.load(), budget=Budget(evaluations=40))
        >>> folder = estimate.save("result")
        >>> Estimate.load(folder).values == estimate.values
        True
    """

    study: str
    model: str
    optimizer: dict[str, Any]
    cost: dict[str, Any]
    seed: int
    synthetic: bool
    channels: dict[str, str]
    """Unit of each output."""
    parameters: pd.DataFrame
    nuisances: pd.DataFrame
    covariance: pd.DataFrame
    correlation: pd.DataFrame
    identifiability: dict[str, Any]
    sensitivity: pd.DataFrame
    fit: pd.DataFrame
    history: pd.DataFrame
    outcome: dict[str, Any]
    discretisation: dict[str, dict[str, float]]
    traces: pd.DataFrame
    cross_validation: pd.DataFrame | None = None
    starts: pd.DataFrame | None = None
    profile: dict[str, pd.DataFrame] | None = None
    posterior: Posterior | None = None
    ensemble: Ensemble | None = None
    steps: list[tuple[str, Step]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    provenance: dict[str, Any] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float]:
        """Estimated parameters by name."""
        return {str(name): float(value) for name, value in self.parameters["value"].items()}

    def save(self, folder: str | Path) -> Path:
        """Writes the estimate into a folder: estimate.json and Parquet tables.

        An estimate that stood there is replaced only once all files of this one are on the disk. Raises CannotWrite
        (a BadInput; DiskFull where no space is left) where they cannot be written; nothing has changed then.
        """
        place = Path(folder)
        tables: dict[str, dict[str, Any]] = {}
        files: dict[str, bytes] = {}
        for name, frame in self._frames().items():
            buffer = io.BytesIO()
            plain, layout = _flat(frame)
            plain.to_parquet(buffer, index=False)
            data = buffer.getvalue()
            files[f"{name}.parquet"] = data
            tables[name] = {"sha256": hashlib.sha256(data).hexdigest(), **layout}
        content = {
            "tables": tables,
            **{name: getattr(self, name) for name in ("study", "model", "optimizer", "cost", "seed", "synthetic")},
            **{name: getattr(self, name) for name in ("channels", "identifiability", "outcome", "discretisation")},
            "profile": None if self.profile is None else list(self.profile),
            "posterior": None
            if self.posterior is None
            else {entry.name: getattr(self.posterior, entry.name) for entry in fields_of(_Chain)},
            "ensemble": None if self.ensemble is None else asdict(self.ensemble),
            "steps": [{"trial": trial, **asdict(step)} for trial, step in self.steps],
            "findings": [asdict(finding) for finding in self.findings],
            "provenance": self.provenance,
        }
        # The JSON file last: it names the others' contents, so a stop in between is noticed.
        write_files(place, {**files, NAME: sealed(encoded(content), FORMAT)})
        for path in (*(place / f"{name}.parquet" for name in _OPTIONAL), *place.glob("profile_*.parquet")):
            if path.name not in files:
                path.unlink(missing_ok=True)  # of the estimate that stood there
        return place

    @classmethod
    def load(cls, folder: str | Path) -> Estimate:
        """Reads what `save` wrote, exactly; BadInput where it is missing, damaged or of another version."""
        place = Path(folder)
        path = place / NAME if place.is_dir() or place.suffix != ".json" else place
        where = str(path)
        try:
            content = decoded(unsealed(read_regular(path, _LARGEST), FORMAT))
        except FileNotFoundError:
            raise BadInput("there is no estimate", where=where, do="Name the folder of a result.") from None
        except BadInput:
            raise
        except OtherVersion:
            what = "it is no estimate of this version of seatruth"
            raise BadInput(what, where=where, do="Identify again.") from None
        except (OSError, ValueError, RecursionError) as problem:
            raise BadInput(f"the estimate cannot be read ({problem})", where=where, do="Identify again.") from None
        try:
            names = [f"profile_{k}" for k in range(len(content["profile"] or ()))]
            tables = {
                name: _read(path.parent / f"{name}.parquet", content["tables"][name])
                for name in (*_FRAMES, *_OPTIONAL[2:], *names)
                if name not in _OPTIONAL or name in content["tables"]
            }
            steps = [(entry.pop("trial"), Step(**entry)) for entry in content["steps"]]
            fields: dict[str, Any] = {
                name: TypeAdapter(kind).validate_python(content[name]) for name, kind in _TYPES.items()
            }
            if fields["posterior"] is not None:
                fields["posterior"] = Posterior(
                    tables["posterior_chain"], tables["posterior_summary"], **asdict(fields["posterior"])
                )
        except (KeyError, TypeError, AttributeError, ValueError) as problem:
            raise BadInput(f"the estimate is damaged ({problem})", where=where, do="Identify again.") from None
        profile = fields.pop("profile")
        fields |= {name: tables.get(name) for name in _FRAMES}
        return cls(
            **fields,
            profile=None if profile is None else dict(zip(profile, (tables[name] for name in names))),
            steps=steps,
        )

    def _frames(self) -> dict[str, pd.DataFrame]:
        found = {name: getattr(self, name) for name in _FRAMES if getattr(self, name) is not None}
        for k, curve in enumerate((self.profile or {}).values()):
            found[f"profile_{k}"] = curve
        if self.posterior is not None:
            found |= {"posterior_chain": self.posterior.chain, "posterior_summary": self.posterior.summary}
        return found

    def __str__(self) -> str:
        head = f"{self.study}: {self.model}, {self.outcome.get('code', '')}: {self.outcome.get('reason', '')}"
        label = "SYNTHETIC trials\n" if self.synthetic else ""
        shown = self.parameters[["value", "stderr", "lower", "upper", "unit", "verdict"]]
        weak = "\n".join(entry["sentence"] for entry in self.identifiability.get("weak", []))
        return f"{label}{head}\n{shown.to_string(float_format=lambda v: f'{v:.5g}')}\n{weak}".rstrip()

    __repr__ = __str__

    def _repr_html_(self) -> str:
        label = "<b>SYNTHETIC trials.</b> " if self.synthetic else ""
        head = html.escape(f"{self.study} ({self.model}): {self.outcome.get('code')}: {self.outcome.get('reason')}")
        shown = self.parameters[["value", "stderr", "lower", "upper", "unit", "verdict"]].to_html(float_format=_short)
        weak = "".join(f"<li>{html.escape(entry['sentence'])}</li>" for entry in self.identifiability.get("weak", []))
        fit = self.fit.to_html(index=False, float_format=_short)
        return f"<p>{label}{head}</p>{shown}<ul>{weak}</ul>{fit}"


def _short(value: float) -> str:
    return f"{value:.4g}"


def encoded(value: Any) -> Any:
    """A value as strict JSON: numbers that JSON does not know become {"number": "inf"}."""
    if isinstance(value, Mapping):
        return {str(key): encoded(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [encoded(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return encoded(value.tolist())
    if isinstance(value, np.generic):
        return encoded(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return {"number": "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"}
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)


def decoded(value: Any) -> Any:
    """What `encoded` encoded."""
    if isinstance(value, dict):
        if set(value) == {"number"} and value["number"] in _SPECIAL:
            return _SPECIAL[value["number"]]
        return {key: decoded(entry) for key, entry in value.items()}
    return [decoded(entry) for entry in value] if isinstance(value, list) else value


def _flat(frame: pd.DataFrame) -> tuple[pd.DataFrame, dict[str, Any]]:
    """A table whose index and columns Parquet keeps: the index as a first column."""
    named = frame.index.name
    simple = isinstance(frame.index, pd.RangeIndex) and named is None
    plain = frame if simple else frame.reset_index(names="index of the table")
    return plain, {"index": None if simple else {"name": named}, "rows": len(frame)}


def _read(path: Path, layout: Mapping[str, Any]) -> pd.DataFrame:
    try:
        data = read_regular(path)
    except OSError as problem:
        raise BadInput(f"a table of the estimate cannot be read ({problem.strerror})", where=str(path)) from None
    if hashlib.sha256(data).hexdigest() != layout["sha256"]:
        raise BadInput("a table of the estimate is damaged", where=str(path), do="Identify again.")
    frame = pd.read_parquet(io.BytesIO(data))
    if layout["index"] is not None:
        frame = frame.set_index("index of the table")
        frame.index.name = layout["index"]["name"]
    # A column of missing numbers alone, of a model that diverged, comes back without a type.
    wrong = [
        name
        for name in _NUMBERS.get(path.stem, ())
        if name not in frame or not (frame[name].dtype.kind in "fiub" or frame[name].isna().all())
    ]
    if wrong and len(frame):
        raise BadInput(f"the table has no numbers in {listed(wrong)}", where=str(path), do="Identify again.")
    return frame
