"""Turning circles of the Esso Osaka model [real trials]: diameters, and formulas fitted to them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth import Study
from seatruth.costs import cost_of
from seatruth.costs.formula import FormulaCost
from seatruth.manoeuvres import turning_circle_figures
from seatruth.models import Parameter
from seatruth.optimizers import minimise
from seatruth.study import formula_study
from seatruth.trials import Trial
from seatruth.uncertainty import held_out_errors, prediction_intervals

Array = NDArray[np.float64]
LENGTH, DISPLACEMENT, RUDDER_AREA, GRAVITY = 3.0, 244.6, 0.0106, 9.81
"""m, kg, m2 of the model."""
LOBAS = (
    "diameter = 1.2 * 244.6 / 0.0106 * (c1*(speed/0.514444)**2 + c2*speed/0.514444 + c3)"
    " / (d1*(rudder*pi/180)**2 + d2*rudder*pi/180 + d3)"
)
EDA = "diameter = (a1*froude**3 + a2*froude**2 + a3*froude) / (a4*rudder + a5)"
FORMULAS: dict[str, tuple[str, dict[str, tuple[float, float, float]]]] = {
    "mean": ("diameter = m", {"m": (3, 0, 100)}),
    "rudder": ("diameter = 1 / (p*rudder + q)", {"p": (0.005, -1, 1), "q": (0.1, -1, 1)}),
    "rudder and side": (
        "diameter = (1 + s*side) / (p*rudder + q)",
        {"p": (0.005, -1, 1), "q": (0.1, -1, 1), "s": (0.0, -1, 1)},
    ),
    "M1, Lobas-type": (
        LOBAS,
        {"c1": (0.01, 0.0, 0.1)}
        | dict.fromkeys(("c2", "c3"), (0.01, 0.0, 1.0))
        | dict.fromkeys(("d1", "d2", "d3"), (5.0, 0.0, 10.0)),
    ),
    "M2, Eda-type": (
        EDA,
        {"a1": (0.05, 0, 0.1), "a2": (0.5, 0, 1), "a3": (0.5, 0, 1), "a4": (0.01, 0, 10), "a5": (0.1, 0, 10)},
    ),
}
"""One line each, with start and bounds of the parameters (those of M1 and M2 as printed [P])."""
FIGURES = ("steady", "tactical")


def measured(folder: Path) -> pd.DataFrame:
    """A row a run: rudder (deg, its size), side (1 starboard), revolutions, approach speed, and diameters over length.

    `steady` is that of the last full turn, `tactical` the tactical diameter, `between turns` the standard deviation of
    the steady diameter from one full turn of 360 deg to the next within the run, NaN with fewer than two.
    """
    rows = []
    for file in sorted(folder.glob("turn_*.csv")):
        run = _trial(file)
        found = turning_circle_figures(run)
        each = _each_turn(run, found.rudder, found.execute)
        speed = found.approach_speed
        rows.append(
            {
                "run": file.stem,
                "rudder": abs(math.degrees(found.rudder)),
                "side": math.copysign(1.0, found.rudder),
                "revolutions": float(np.interp(found.execute, run.t, run.inputs["n"])),
                "speed": speed,
                "froude": speed / math.sqrt(GRAVITY * LENGTH),
                "speed ratio": found.speed_ratio,
                "steady": found.steady_diameter / LENGTH,
                "tactical": found.tactical_diameter / LENGTH,
                "full turns": len(each),
                "between turns": float(np.std(each, ddof=1)) / LENGTH if len(each) > 1 else math.nan,
            }
        )
    return pd.DataFrame(rows)


def _trial(file: Path) -> Trial:
    """One run; positions that the receiver held are filled in, as the figures are read between samples."""
    table = pd.read_csv(file)
    table.loc[table["pos_hold"] == 1, ["x", "y"]] = np.nan
    outputs = {name: table[name].interpolate().bfill().to_numpy(float) for name in ("x", "y", "psi", "u", "v", "r")}
    return Trial(
        file.stem, table["t"].to_numpy(float), {name: table[name].to_numpy(float) for name in ("delta", "n")}, outputs
    )


def _each_turn(run: Trial, rudder: float, execute: float) -> list[float]:
    """Diameters (m) of the full turns after the first half one, while rudder and propeller are kept: 2 path / angle."""
    kept = np.interp(execute, run.t, run.inputs["n"])
    off = (np.abs(run.inputs["delta"] - rudder) > 0.15 * abs(rudder)) | (np.abs(run.inputs["n"] - kept) > 0.2 * kept)
    after = np.flatnonzero((run.t > execute + 5.0) & off)
    end = int(after[0]) if after.size else len(run)
    begin = int(np.searchsorted(run.t, execute))
    t, psi = run.t[begin:end], np.unwrap(run.outputs["psi"][begin:end])
    speed = np.hypot(run.outputs["u"], run.outputs["v"])[begin:end]
    path = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))])
    turned = np.abs(psi - psi[0])
    found, angle = [], math.pi
    while turned.max() >= angle + 2 * math.pi:
        ends = [int(np.argmax(turned >= a)) for a in (angle, angle + 2 * math.pi)]
        found.append(2 * float(path[ends[1]] - path[ends[0]]) / (2 * math.pi))
        angle += 2 * math.pi
    return found


def study_of(name: str, table: pd.DataFrame, figure: str) -> Study:
    """The study of one formula on one of the diameters."""
    text, told = FORMULAS[name]
    parameters = [Parameter(key, value, min=low, max=high, vary=True) for key, (value, low, high) in told.items()]
    columns = {key: table[key].to_numpy(float) for key in ("rudder", "side", "speed", "froude")}
    return formula_study(text, columns | {"diameter": table[figure].to_numpy(float)}, parameters, name=name)


def fitted(table: pd.DataFrame, figure: str) -> dict[str, Any]:
    """Every formula: its values, errors fitted and left out, and predictions with intervals over the rudder."""
    grid = pd.DataFrame([(d, s) for s in (-1.0, 1.0) for d in np.arange(18.0, 37.1, 1.0)], columns=["rudder", "side"])
    grid["speed"], grid["froude"], grid[figure] = table["speed"].mean(), table["froude"].mean(), 0.0
    found: dict[str, Any] = {}
    runs = [np.array([k], dtype=np.intp) for k in range(len(table))]
    for name in FORMULAS:
        study = study_of(name, table, figure)
        cost = cost_of(study, threads=1)
        assert isinstance(cost, FormulaCost)
        x = minimise(cost, "least_squares", seed=0).x
        (ahead,) = prediction_intervals(cost, x, [study_of(name, grid, figure).trials[0]])
        errors = held_out_errors(study, runs, dict(zip(cost.names, x.tolist())))
        found[name] = {
            "values": dict(zip(cost.names, x.tolist())),
            "fitted": cost.errors(x)[:, 0],
            "left out": errors,
            "value": ahead.value,
            "mean": ahead.mean_half_width,
            "half": ahead.half_width,
        }
    found["grid"] = {"rudder": grid["rudder"], "side": grid["side"]}
    return {
        key: {k: np.asarray(v).tolist() if not isinstance(v, dict) else v for k, v in part.items()}
        for key, part in found.items()
    }
