"""What the report reads of an Estimate: tables with the columns that it needs, whatever is missing left empty."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from seatruth.report.numbers import Shown, as_float, shown
from seatruth.statistics.posterior_sample import Ensemble, Posterior
from seatruth.trials.standard_channels import STANDARD_CHANNELS

if TYPE_CHECKING:
    from seatruth.estimate import Estimate

PARAMETER_NUMBERS = (*("value", "stderr", "lower", "upper", "crlb", "start", "min", "max", "prior_mean", "prior_sd"),)
FIT_NUMBERS = ("rmse", "noise", "ratio", "bias", "n", "n_eff", "autocorrelation", "rmse_start")
INPUT = "input "
EDGES = ("lower", "upper", "band_lower", "band_upper")
TRACE_COLUMNS = ("trial", "t", "channel", "measured", "fitted", "start", "held_out")


@dataclass(frozen=True)
class View:
    """An Estimate's tables with every column present and typed. Built once; sections and figures only read it."""

    estimate: Any
    parameters: pd.DataFrame
    nuisances: pd.DataFrame
    fit: pd.DataFrame
    traces: pd.DataFrame
    correlation: pd.DataFrame
    sensitivity: pd.DataFrame
    cross_validation: pd.DataFrame
    starts: pd.DataFrame
    """One row per start of a multi-start: start, cost, optimum, evaluations, code."""
    history: pd.DataFrame
    discretisation: pd.DataFrame
    profile: dict[str, pd.DataFrame]
    weak: list[dict[str, Any]]
    outcome: dict[str, Any]
    channels: dict[str, Shown]
    series: dict[tuple[str, str], pd.DataFrame]
    """Rows of the traces of each (trial, channel)."""
    posterior: Posterior | None
    ensemble: Ensemble | None

    @property
    def draws(self) -> pd.DataFrame:
        """Draws of the posterior: a column for each parameter and nuisance; empty without a sample."""
        return pd.DataFrame() if self.posterior is None else self.posterior.draws

    @property
    def chain(self) -> pd.DataFrame:
        """The chain of the posterior with its beginning; empty without a sample."""
        return pd.DataFrame() if self.posterior is None else self.posterior.chain

    @property
    def burn_in(self) -> int:
        """Steps of the chain that are left out."""
        return 0 if self.posterior is None else self.posterior.burn_in

    def channel(self, name: str) -> Shown:
        """How a channel is shown."""
        return self.channels.get(name) or shown(name, "")

    @property
    def is_table(self) -> bool:
        """Whether a formula was fitted to tables: rows have no time."""
        return str((getattr(self.estimate, "cost", None) or {}).get("kind", "")) == "formula"

    @property
    def fitted(self) -> pd.DataFrame:
        """Rows of the fit of the trials that were fitted to."""
        return self.fit[~self.fit["held_out"]]

    @property
    def held_out(self) -> pd.DataFrame:
        """Rows of the fit of the trials that were only predicted."""
        return self.fit[self.fit["held_out"]]

    @property
    def trial_names(self) -> list[str]:
        """Trials with time histories, in the order of the study; those held out last."""
        names = list(dict.fromkeys(trial for trial, _ in self.series))
        return sorted(names, key=self.is_held_out)

    def is_held_out(self, trial: str) -> bool:
        """Whether a trial was only predicted."""
        for (name, _), rows in self.series.items():
            if name == trial:
                return bool(rows["held_out"].iloc[0])
        return bool(self.fit.loc[self.fit["trial"] == trial, "held_out"].any())

    def trace(self, trial: str, channel: str) -> pd.DataFrame:
        """Time history of one channel of one trial in the units of the page: t, measured, fitted, start.

        Of a table also lower and upper, and its columns as "input NAME"; with an ensemble band_lower and band_upper.
        """
        rows = self.series.get((trial, channel), self.traces.iloc[:0])
        factor = self.channel(channel).factor
        sizes = [name for name in ("measured", "fitted", "start", *EDGES) if name in rows]
        data = {name: rows[name].to_numpy(dtype=float) * factor for name in sizes}
        data |= {str(name): rows[name].to_numpy(dtype=float) for name in rows if str(name).startswith(INPUT)}
        return pd.DataFrame({"t": rows["t"].to_numpy(dtype=float), **data})

    def channels_of(self, trial: str) -> list[str]:
        """Channels of a trial's time histories, in the order of the model's outputs."""
        return [channel for name, channel in self.series if name == trial]

    def noise(self, trial: str, channel: str) -> float:
        """Noise of a channel in the unit of the page; NaN where it is not known."""
        rows = self.fit[(self.fit["trial"] == trial) & (self.fit["channel"] == channel)]
        return float(rows["noise"].iloc[0]) * self.channel(channel).factor if len(rows) else math.nan


def view(estimate: Estimate | View) -> View:
    """The view of an estimate; a view is given back as it is."""
    if isinstance(estimate, View):
        return estimate
    fit = _fit(_frame(estimate, "fit"))
    traces = _traces(_frame(estimate, "traces"))
    identifiability = getattr(estimate, "identifiability", None) or {}
    return View(
        estimate=estimate,
        parameters=_parameters(_frame(estimate, "parameters")),
        nuisances=_parameters(_frame(estimate, "nuisances")),
        fit=fit,
        traces=traces,
        correlation=_square(_frame(estimate, "correlation")),
        # The last column repeats the largest of the others.
        sensitivity=_numeric(_frame(estimate, "sensitivity")).drop(columns="largest", errors="ignore"),
        cross_validation=_cross_validation(_frame(estimate, "cross_validation"), fit),
        starts=_starts(_frame(estimate, "starts")),
        history=_history(_frame(estimate, "history")),
        discretisation=_discretisation(getattr(estimate, "discretisation", None)),
        profile=_profile(getattr(estimate, "profile", None)),
        weak=[dict(item) for item in identifiability.get("weak", None) or []],
        outcome=dict(getattr(estimate, "outcome", None) or {}),
        channels=_channels(estimate, fit, traces),
        series={
            (str(trial), str(channel)): rows
            for (trial, channel), rows in traces.groupby(["trial", "channel"], sort=False, observed=True)
        },
        posterior=getattr(estimate, "posterior", None),
        ensemble=getattr(estimate, "ensemble", None),
    )


def _frame(estimate: Any, name: str) -> pd.DataFrame:
    found = getattr(estimate, name, None)
    if found is None:
        return pd.DataFrame()
    frame = found if isinstance(found, pd.DataFrame) else pd.DataFrame(found)
    return frame.copy()


def _column(frame: pd.DataFrame, name: str, missing: float = math.nan) -> pd.Series[float]:
    if name not in frame:
        return pd.Series(missing, index=frame.index, dtype=float)
    return pd.to_numeric(frame[name], errors="coerce").astype(float)


def _texts(frame: pd.DataFrame, name: str) -> list[str]:
    if name not in frame:
        return [""] * len(frame)
    return ["" if value is None or value is pd.NA or value != value else str(value) for value in frame[name]]


def _flags(frame: pd.DataFrame, name: str) -> list[bool]:
    return (
        [value is True or value is np.True_ or value == 1 for value in frame[name]]
        if name in frame
        else [False] * len(frame)
    )


def _parameters(frame: pd.DataFrame) -> pd.DataFrame:
    if "name" in frame and frame.index.name is None:
        frame = frame.set_index("name")
    out = pd.DataFrame({name: _column(frame, name) for name in PARAMETER_NUMBERS}, index=frame.index)
    for name in ("unit", "verdict", "source", "description"):
        out[name] = _texts(frame, name)
    out["at_bound"] = _flags(frame, "at_bound")
    out.index = pd.Index([str(name) for name in frame.index], name="name", dtype=object)
    return out


def _rows(frame: pd.DataFrame) -> pd.DataFrame:
    """Trial and channel as columns, also where they are the index."""
    return frame.reset_index() if {"trial", "channel"} & set(frame.index.names) else frame.reset_index(drop=True)


def _fit(frame: pd.DataFrame) -> pd.DataFrame:
    frame = _rows(frame)
    out = pd.DataFrame({name: _column(frame, name) for name in FIT_NUMBERS}, index=frame.index)
    for name in ("trial", "channel"):
        out[name] = pd.Series(_texts(frame, name), index=frame.index, dtype=object)
    out["held_out"] = pd.Series(_flags(frame, "held_out"), index=frame.index, dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        out["ratio_start"] = out["rmse_start"] / out["noise"].where(out["noise"] > 0)
    return out


def _traces(frame: pd.DataFrame) -> pd.DataFrame:
    frame = _rows(frame)
    out = pd.DataFrame({name: _column(frame, name) for name in ("t", "measured", "fitted", "start")}, index=frame.index)
    for name in ("trial", "channel"):
        out[name] = pd.Series(frame[name].astype(str) if name in frame else [], index=frame.index, dtype=object)
    flags = frame["held_out"].fillna(False).astype(bool) if "held_out" in frame else False
    out["held_out"] = pd.Series(flags, index=frame.index, dtype=bool)
    more = [str(name) for name in frame if name in EDGES or str(name).startswith(INPUT)]
    for name in more:
        out[name] = _column(frame, name)
    return out[[*TRACE_COLUMNS, *more]]


def _square(frame: pd.DataFrame) -> pd.DataFrame:
    frame = _numeric(frame)
    frame.columns = [str(name) for name in frame.columns]
    square = frame.shape[0] == frame.shape[1]
    return frame if square else pd.DataFrame()


def _numeric(frame: pd.DataFrame) -> pd.DataFrame:
    out = frame.apply(pd.to_numeric, errors="coerce").astype(float) if frame.size else pd.DataFrame()
    out.index = pd.Index([str(name) for name in out.index], dtype=object)
    return out


def _cross_validation(frame: pd.DataFrame, fit: pd.DataFrame) -> pd.DataFrame:
    """trial, channel, predicted, fitted, noise."""
    frame = _rows(frame)
    if not len(frame):
        return pd.DataFrame(columns=["trial", "channel", "predicted", "fitted", "noise"])
    out = pd.DataFrame({name: _texts(frame, name) for name in ("trial", "channel")})
    for name, others in {
        "predicted": ("predicted", "rmse_predicted", "rmse"),
        "fitted": ("fitted", "rmse_fitted"),
        "noise": ("noise",),
    }.items():
        known = [other for other in others if other in frame]
        out[name] = _column(frame, known[0]).to_numpy() if known else math.nan
    return out


def _starts(frame: pd.DataFrame) -> pd.DataFrame:
    out = pd.DataFrame({name: _column(frame, name) for name in ("start", "cost", "optimum", "evaluations")})
    out["optimum"] = out["optimum"].fillna(0)
    out["code"] = pd.Series(_texts(frame, "code"), index=frame.index, dtype=object)
    for name in frame:
        if str(name).startswith("end "):
            out[str(name)] = _column(frame, str(name))
    return out


def _history(frame: pd.DataFrame) -> pd.DataFrame:
    out = pd.DataFrame({name: _column(frame, name) for name in ("evaluations", "best", "seconds")})
    known = np.isfinite(out["best"]) & np.isfinite(out["evaluations"])
    kept: pd.DataFrame = out.loc[known].reset_index(drop=True)
    return kept


def _discretisation(found: Any) -> pd.DataFrame:
    """channel -> error, noise, ratio; from a table or a mapping."""
    if found is None:
        frame = pd.DataFrame()
    elif isinstance(found, pd.DataFrame):
        frame = found.set_index("channel") if "channel" in found else found
    else:
        rows = {str(k): v if isinstance(v, Mapping) else {"error": v} for k, v in dict(found).items()}
        frame = pd.DataFrame.from_dict(rows, orient="index")
    out = pd.DataFrame({name: _column(frame, name) for name in ("error", "noise", "ratio")}, index=frame.index)
    out.index = pd.Index([str(name) for name in out.index], dtype=object)
    return out


def _profile(found: Any) -> dict[str, pd.DataFrame]:
    out = {}
    for name, curve in dict(found or {}).items():
        frame = pd.DataFrame(curve)
        points = pd.DataFrame({key: _column(frame, key) for key in ("value", "cost")})
        known = np.isfinite(points["value"]) & np.isfinite(points["cost"])
        points = points.loc[known].sort_values(by="value").reset_index(drop=True)
        if len(points) > 1:
            out[str(name)] = points
    return out


def _channels(estimate: Any, fit: pd.DataFrame, traces: pd.DataFrame) -> dict[str, Shown]:
    """Units from the estimate where it gives them, otherwise those of the standard channels."""
    units: dict[str, str] = {name: channel.unit for name, channel in STANDARD_CHANNELS.items()}
    given = getattr(estimate, "channels", None)
    if isinstance(given, Mapping):
        units |= {str(name): str(getattr(unit, "unit", unit)) for name, unit in given.items()}
    elif isinstance(given, Sequence):
        units |= {str(channel.name): str(channel.unit) for channel in given}
    names = [*fit["channel"].unique(), *traces["channel"].unique()]
    return {str(name): shown(str(name), units.get(str(name), "")) for name in dict.fromkeys(names)}


def finite(*values: Any) -> bool:
    """Whether all are finite numbers."""
    return all(math.isfinite(as_float(value)) for value in values)
