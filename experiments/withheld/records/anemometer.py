"""The measured wind, and the ship's model with it as an input. Nothing that diagnoses imports this file.

Directions are towards which the air goes, clockwise from the pond's x axis, as the wind effect has them; the record
says where it comes from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from seatruth import BadInput, Channel, Parameter, Study, Trial, Trials
from seatruth.effects import available
from seatruth.effects.kinematics import to_body_axes
from seatruth.effects.weather import WindShape, wind_force
from seatruth.models.geometry import Vehicle
from seatruth.models.mmg import MMGShip
from seatruth.models.with_servos import WithServos

WIND = available()["wind"]
FOLDER = "esso_osaka/anemometer"


class InMeasuredWind(MMGShip):
    """The MMG ship in measured wind; `wind_share` 1 is the force of the wind effect, 0 none."""

    name = "mmg_in_measured_wind"
    inputs: tuple[Channel, ...] = (
        *MMGShip.inputs,
        Channel("wind_x", "m/s", "the air goes towards +x of the pond"),
        Channel("wind_y", "m/s", "the air goes towards +y of the pond"),
    )

    def __init__(self, ship: str = "ESSO_OSAKA") -> None:
        super().__init__(ship)
        share = Parameter("wind_share", 1.0, "1", 0.0, 5.0, source="[S] chosen here: 1 is the effect's own force")
        lever = Parameter("wind_lever", 0.0, "1", -0.3, 0.3, source="[S] chosen here")
        self.parameters = (*self.parameters, share, lever)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        body = Vehicle(*MMGShip.dimensions(p))
        along, across, _ = to_body_axes(i.wind_x, i.wind_y, s)
        X, Y, N = wind_force(s.u - along, s.v - across, WindShape(p.wind_lever), body)
        X_0, Y_0, N_0 = wind_force(s.u, s.v, WindShape(p.wind_lever), body)
        share = p.wind_share
        e = e._replace(X=e.X + share * (X - X_0), Y=e.Y + share * (Y - Y_0), N=e.N + share * (N - N_0))
        return MMGShip.rhs(s, i, p, e)


def measured(run: str, data: Path) -> pd.DataFrame:
    """The anemometer's record of a run: t s, and m/s towards which the air goes, `wind_x`, `wind_y`."""
    file = data / FOLDER / f"{run}.csv"
    if not file.exists():
        raise BadInput(
            "there is no anemometer record", where=str(file), do="Give the folder of the real trials, --data."
        )
    table = pd.read_csv(file)
    speed, comes_from = table["wind_speed_true"].to_numpy(), table["wind_dir_true"].to_numpy()
    return pd.DataFrame(
        {"t": table["t"], "wind_x": -speed * np.cos(comes_from), "wind_y": -speed * np.sin(comes_from)}
    ).dropna()


def of_run(run: str, data: Path) -> dict[str, float]:
    """Mean wind of a run: components x, y and speed (m/s), direction (rad), and its deviation in time (m/s)."""
    table = measured(run, data)[["wind_x", "wind_y"]].to_numpy()
    mean = table.mean(axis=0)
    gusts = float(np.sqrt(((table - mean) ** 2).sum(axis=1).mean()))
    return {**_polar(mean), "gusts": gusts, "mean_speed": float(np.hypot(*table.T).mean())}


def of_day(winds: Sequence[dict[str, float]]) -> dict[str, float]:
    """Mean over runs, and how far they lie from it (m/s, root mean square)."""
    means = np.array([[wind["x"], wind["y"]] for wind in winds])
    mean = means.mean(axis=0)
    return {**_polar(mean), "spread": float(np.sqrt(((means - mean) ** 2).sum(axis=1).mean()))}


def _polar(mean: Any) -> dict[str, float]:
    x, y = float(mean[0]), float(mean[1])
    return {"x": x, "y": y, "speed": math.hypot(x, y), "towards": math.atan2(y, x)}


def in_measured_wind(study: Study, data: Path) -> Study:
    """The study with the measured wind as an input; its lever is free, as that of an estimated wind is."""

    def blown(trial: Trial) -> Trial:
        wind = measured(trial.name, data)
        found = {name: np.interp(trial.t - trial.t[0], wind["t"], wind[name]) for name in ("wind_x", "wind_y")}
        return replace(trial, inputs={**trial.inputs, **found})

    assert isinstance(study.model, WithServos), "the pond's runs hold orders"
    model = WithServos(InMeasuredWind(), study.model.orders)
    told = {p.name: p for p in study.parameters}
    lever = WIND.priors(study.model)["lever"]
    parameters = tuple(
        p.replace(vary=True, prior=lever) if p.name == "wind_lever" else told.get(p.name, p) for p in model.parameters
    )
    return study.replace(model=model, trials=Trials([blown(t) for t in study.trials]), parameters=parameters)
