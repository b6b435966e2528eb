"""The Esso Osaka model with the wind as an input: its study once the anemometer is open, and only then.

Nothing that diagnoses imports this file, and nothing else reads the anemometer.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from seatruth import BadInput, Channel, Parameter, Study, Trial, Trials
from seatruth.effects import available
from seatruth.models.mmg import MMGShipOrdered
from seatruth.models.vehicle import Body

WIND = available()["wind"]
FOLDER = "anemometer"


class _Wind(NamedTuple):
    """The wind effect's parameters, as inputs give them."""

    north: Any
    east: Any
    lever: Any


class InMeasuredWind(MMGShipOrdered):
    """The MMG ship under orders in measured wind; `wind_share` 1 is the force of the wind effect, 0 none."""

    name = "mmg_ordered_in_measured_wind"
    inputs: tuple[Channel, ...] = (
        *MMGShipOrdered.inputs,
        Channel("wind_x", "m/s", "the air goes towards +x of the pond"),
        Channel("wind_y", "m/s", "the air goes towards +y of the pond"),
    )

    def __init__(self, ship: str = "ESSO_OSAKA") -> None:
        super().__init__(ship)
        share = Parameter("wind_share", 0.0, "1", 0.0, 5.0, source="[S] chosen here: 1 is the effect's own force")
        lever = Parameter("wind_lever", 0.0, "1", -0.3, 0.3, source="[S] chosen here")
        self.parameters = (*self.parameters, share, lever)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        body = Body(*MMGShipOrdered.dimensions(p))
        blown: Any = WIND.surroundings
        with_wind = blown(e, s, i, p, _Wind(i.wind_x, i.wind_y, p.wind_lever), body)
        share = p.wind_share
        e = e._replace(
            X=e.X + share * (with_wind.X - e.X),
            Y=e.Y + share * (with_wind.Y - e.Y),
            N=e.N + share * (with_wind.N - e.N),
        )
        return MMGShipOrdered.rhs(s, i, p, e)


def measured(run: str, data: Path) -> pd.DataFrame:
    """The anemometer's record of a run: t s, and m/s towards which the air goes, `wind_x`, `wind_y`."""
    file = data / "esso_osaka" / FOLDER / f"{run}.csv"
    if not file.exists():
        raise BadInput(
            "there is no anemometer record", where=str(file), do="Give the folder of the real trials, --data."
        )
    table = pd.read_csv(file)
    speed, comes_from = table["wind_speed_true"].to_numpy(), table["wind_dir_true"].to_numpy()
    return pd.DataFrame(
        {"t": table["t"], "wind_x": -speed * np.cos(comes_from), "wind_y": -speed * np.sin(comes_from)}
    ).dropna()


def mean_wind(runs: list[str], data: Path) -> dict[str, float]:
    """Mean over runs: speed m/s and the direction in rad towards which the air goes, and the spread of run means."""
    means = np.array([measured(run, data)[["wind_x", "wind_y"]].mean().to_numpy() for run in runs])
    mean = means.mean(axis=0)
    return {
        "speed": float(np.hypot(*mean)),
        "towards": math.atan2(mean[1], mean[0]),
        "x": float(mean[0]),
        "y": float(mean[1]),
        "spread": float(np.sqrt(((means - mean) ** 2).sum(axis=1).mean())),
    }


def in_measured_wind(study: Study, data: Path, *, vary: bool) -> Study:
    """The study with the measured wind as an input; `vary` frees its share and lever, otherwise there is none."""

    def blown(trial: Trial) -> Trial:
        wind = measured(trial.name, data)
        t = trial.t - trial.t[0]
        found = {name: np.interp(t, wind["t"], wind[name]) for name in ("wind_x", "wind_y")}
        return replace(trial, inputs={**trial.inputs, **found})

    model = InMeasuredWind()
    told = {p.name: p for p in study.parameters}
    parameters = []
    for p in model.parameters:
        own = told.get(p.name, p)
        if p.name == "wind_share" and vary:
            own = p.but(value=1.0, vary=True)
        if p.name == "wind_lever" and vary:
            own = p.but(vary=True)
        parameters.append(own)
    return study.but(model=model, trials=Trials([blown(t) for t in study.trials]), parameters=tuple(parameters))
