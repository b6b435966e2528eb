"""Does the wind that some runs give predict another run of that day? Each run in turn is left out of three fits.

The ship alone; the ship in a steady wind that is estimated with its coefficients; the ship in the wind that the
anemometer measured (which a forecast could not know). All have the same trials, priors, windows and solver; the run
left out is predicted over windows of 100 s, each from its first sample. Scoring does this, with the seal open.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seatruth import Study, Trials, identify
from seatruth.effects import with_effects
from withheld.records.anemometer import WIND, in_measured_wind
from withheld.records.plan import SOURCES
from withheld.records.ships import SEED, script, to_fit

CHANNELS = ("u", "v", "r", "psi", "x", "y")
VARIANTS = ("ship alone", "wind estimated", "wind measured")


def in_estimated_wind(study: Study) -> Study:
    """The study with a steady wind of unknown size and direction, under the effect's own priors."""
    model = with_effects(study.model, [WIND])
    told = {p.name: p for p in study.parameters}
    priors = {WIND.named(name): prior for name, prior in WIND.priors(study.model).items()}
    # At no wind its derivatives by its form vanish: the search begins beside it, with the form that is expected.
    start = {name: prior.mean for name, prior in priors.items()}
    start |= {WIND.named("north"): 0.1, WIND.named("east"): 0.1}
    parameters = tuple(
        p.replace(value=start[p.name], vary=True, prior=priors[p.name]) if p.name in priors else told.get(p.name, p)
        for p in model.parameters
    )
    return study.replace(model=model, parameters=parameters)


def studies(file: Path, source: str, data: Path) -> dict[str, Study]:
    """The three studies of a day, by variant, from the case's study file."""
    alone = to_fit(file, source, data)
    return dict(zip(VARIANTS, (alone, in_estimated_wind(alone), in_measured_wind(alone, data)), strict=True))


def left_out(file: Path, source: str, data: Path, threads: int | None = None) -> list[dict[str, Any]]:
    """By run: the errors of each variant that never saw it, the wind that the other runs gave, and its own."""
    found = studies(file, source, data)
    rows = []
    for run in SOURCES[source].runs:
        row: dict[str, Any] = {"run": run, "errors": {}}
        for variant, study in found.items():
            others = Trials([trial for trial in study.trials if trial.name != run])
            values, wind = _fitted(study.replace(trials=others), threads)
            row["errors"][variant] = _errors(study, values, run, threads)
            if wind is not None:
                row["wind_of_others"] = wind
        _, row["wind_of_itself"] = _fitted(
            found[VARIANTS[1]].replace(trials=Trials([found[VARIANTS[1]].trials[run]])), threads
        )
        rows.append(row)
    return rows


def _fitted(study: Study, threads: int | None) -> tuple[dict[str, float], dict[str, float] | None]:
    """All parameter values of a fit, and the wind among them (m/s, with standard errors) where it has one."""
    estimate = identify(study, seed=SEED, threads=threads)
    values = {p.name: p.value for p in study.parameters} | estimate.values
    table = estimate.parameters
    if WIND.named("north") not in table.index:
        return values, None
    wind = table.loc[[WIND.named("north"), WIND.named("east")], ["value", "stderr"]].to_numpy(dtype=np.float64)
    (x, dx), (y, dy) = wind.tolist()
    return values, {"x": x, "y": y, "dx": dx, "dy": dy, "speed": math.hypot(x, y), "towards": math.atan2(y, x)}


def _errors(study: Study, values: Mapping[str, float], run: str, threads: int | None) -> dict[str, float]:
    """Root mean square errors of the run left out by channel, over windows from their first samples."""
    predict = script("predict.py")
    pieces = predict.windows(study.trials[run])
    found: dict[str, float] = predict.rmse(pieces, predict.simulated(study, values, pieces, threads))
    return found


def relative(rows: Sequence[Mapping[str, Any]], variant: str) -> list[float]:
    """By run: error of a variant over that of the ship alone, the geometric mean over channels."""
    found = []
    for row in rows:
        mine, alone = row["errors"][variant], row["errors"][VARIANTS[0]]
        logs = [math.log(mine[name] / alone[name]) for name in CHANNELS if name in mine]
        found.append(math.exp(sum(logs) / len(logs)))
    return found
