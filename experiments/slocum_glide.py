"""The steady and the unsteady glide of a Slocum glider as seatruth models, and its record in casts.

Model: [L] Merckelbach, Berger, Krahmann, Dengler and Carpenter 2019, J. Atmos. Oceanic Technol. 36 (2), whose
constants are the "published" ones here. Measured are: pressure, pitch, pumped volume, density (from conductivity and
temperature) and, on dives, the speed of the water past the glider (Doppler log). Assumed: reference area, volume,
compressibility, no thermal expansion of the hull, water that does not move up or down on average. The pitch of the
public record was scaled (0.86) and shifted (-0.004 rad) by its authors; the speed went through their Kalman filter.
The published lift slope is the hull's 3.8 per rad and that of the wings, which their formula gives: 7.53 together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import find_peaks

from seatruth import BlackBox, Channel, Model, Parameter, Study
from seatruth.costs.options import TrajectoryOptions
from seatruth.trials import Trial, Trials
from seatruth.trials.trial import Step

Array = NDArray[np.float64]
G = 9.81
SHALLOW, DEEP = 12.0, 38.0
"""m: below the wave zone, above the turn."""
BIN = 10.0
"""s; a row of the table."""
FEWEST = 6
"""Samples of a bin."""
PLAUSIBLE = math.radians(10.0)
"""Largest median incidence of a dive that its own depth rate, speed and pitch may imply: wings stall beyond."""
_LIFT_WINGS = 2 * math.pi * 7.0 / (2 + math.sqrt(49.0 * (1 + math.tan(math.radians(43.0)) ** 2) + 4))
_SOURCE = "[L] Merckelbach et al. 2019"

INPUTS = (
    Channel("theta", "rad", "pitch, positive nose up", angle=True),
    Channel("V_b", "m3", "pumped volume"),
    Channel("rho", "kg/m3", "density of the water in situ"),
    Channel("P", "Pa", "pressure above that at the surface"),
)
OUTPUTS = (
    Channel("sink", "m/s", "sinking speed, from depth"),
    Channel("U", "m/s", "speed of the water past the glider"),
)
PARAMETERS = (
    Parameter("C_D0", 0.15, "1", 0.02, 0.6, source=_SOURCE, description="drag at zero incidence"),
    Parameter("C_D1", 10.5, "1/rad2", 0.0, 60.0, source=_SOURCE, description="drag by incidence squared"),
    Parameter("C_L", 3.8 + _LIFT_WINGS, "1/rad", 1.0, 30.0, source=f"{_SOURCE}: hull 3.8, wings by their formula 3.73"),
    Parameter("m", 70.0, "kg", 69.0, 71.0, source=f"{_SOURCE}, about", description="mass of the glider"),
    Parameter("V_g", 70.0 / 1004.0, "m3", 0.0687, 0.0707, source=f"{_SOURCE}, about", description="its volume"),
    Parameter("epsilon", 5e-10, "1/Pa", 0.0, 5e-9, source=_SOURCE, description="compressibility of the hull"),
    Parameter("S", 0.1, "m2", 0.05, 0.2, source=_SOURCE, description="reference area"),
    Parameter(
        "theta_0", 0.0, "rad", -0.1, 0.1, source="[S] the record's pitch is taken as it is", description="pitch offset"
    ),
)
PUBLISHED = {q.name: q.value for q in PARAMETERS}


def lift_up(rho: Any, V_b: Any, P: Any, p: Any) -> Any:
    """Buoyancy less weight, N."""
    return G * (rho * (p.V_g * (1.0 - p.epsilon * P) + V_b) - p.m)


def incidence(steep: Any, p: Any) -> Any:
    """Size a of the steady incidence, rad, at the size of the pitch: C_D0 + C_D1 a^2 = C_L a tan(steep + a); Newton."""
    a = p.C_D0 / (p.C_L * steep + 1e-3)
    for _ in range(8):
        t = np.tan(steep + a)
        error = p.C_D0 + p.C_D1 * a * a - p.C_L * a * t
        slope = 2.0 * p.C_D1 * a - p.C_L * (t + a * (1.0 + t * t))
        a = a - error / slope
    return a


class _Values:
    """Parameters by attribute."""

    def __init__(self, values: Mapping[str, float]) -> None:
        self.__dict__.update(values)


def steady_run(trial: Trial, parameters: dict[str, float], first: dict[str, float] | None) -> dict[str, Array]:
    """Sinking speed and speed through the water of the steady glide at every row."""
    p: Any = _Values(parameters)
    theta = np.asarray(trial.inputs["theta"]) + p.theta_0
    rho, V_b, P = (np.asarray(trial.inputs[name]) for name in ("rho", "V_b", "P"))
    up = lift_up(rho, V_b, P, p)
    a = incidence(np.abs(theta), p)
    glide = np.sign(theta) * (np.abs(theta) + a)
    force = np.maximum(up * np.sin(glide), 0.0)  # a heavy glider with its nose up does not glide
    U = np.sqrt(2.0 * force / (rho * p.S * (p.C_D0 + p.C_D1 * a * a)))
    return {"sink": -U * np.sin(glide), "U": U}


STEADY = BlackBox(
    "slocum_steady",
    steady_run,
    inputs=INPUTS,
    outputs=OUTPUTS,
    parameters=PARAMETERS,
    kind="glider",
    title="Slocum glider, steady glide at the measured pitch",
    source=_SOURCE,
)


class SlocumUnsteady(Model):
    """The same forces with inertia: in stratified water a glider is always slowing down or speeding up."""

    name = "slocum_unsteady"
    title = "Slocum glider, unsteady glide at the measured pitch"
    kind = "glider"
    source = _SOURCE
    states = (
        Channel("ahead", "m/s", "horizontal speed through the water"),
        Channel("down", "m/s", "sinking speed through the water"),
    )
    inputs = INPUTS
    outputs = OUTPUTS
    parameters = (
        *PARAMETERS,
        Parameter("k_1", 0.2, "1", 0.0, 1.0, source=_SOURCE, description="added mass along the hull, over the mass"),
        Parameter("k_2", 0.92, "1", 0.0, 2.0, source=_SOURCE, description="added mass across the hull, over the mass"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        U2 = s.ahead * s.ahead + s.down * s.down + 1e-12
        U = math.sqrt(U2)
        theta = i.theta + p.theta_0
        alpha = theta + math.atan2(s.down, s.ahead)
        q = 0.5 * i.rho * p.S * U2
        drag, lift = q * (p.C_D0 + p.C_D1 * alpha * alpha), q * p.C_L * alpha
        c, d = s.ahead / U, s.down / U
        X = -drag * c + lift * d
        Z = -drag * d - lift * c - lift_up(i.rho, i.V_b, i.P, p)
        # added mass along and across the hull, turned by the pitch into earth axes
        a, b = math.cos(theta), math.sin(theta)
        xx = p.m * (1.0 + p.k_1 * a * a + p.k_2 * b * b)
        zz = p.m * (1.0 + p.k_1 * b * b + p.k_2 * a * a)
        xz = p.m * (p.k_2 - p.k_1) * a * b
        determinant = xx * zz - xz * xz
        return (zz * X - xz * Z) / determinant, (xx * Z - xz * X) / determinant

    @staticmethod
    def output(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return s.down, math.sqrt(s.ahead * s.ahead + s.down * s.down + 1e-12)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        glide = abs(i.theta) + 0.055
        return abs(y.sink) / math.tan(glide), y.sink


UNSTEADY = SlocumUnsteady()


def read(file: Path) -> list[Trial]:
    """The record in casts between `SHALLOW` and `DEEP`, each a trial of rows of 10 s.

    In a row: depth by a straight line, whose slope is the sinking speed; means of pitch, volume, density and pressure;
    the median of the speed.
    """
    data = pd.read_csv(file)
    t, depth = data.t.to_numpy(), data.depth.to_numpy()
    smooth = pd.Series(depth).rolling(31, center=True, min_periods=1).mean().to_numpy()
    turns = [*find_peaks(smooth, prominence=5.0)[0], *find_peaks(-smooth, prominence=5.0)[0]]
    edges = sorted([0, *(int(k) for k in turns), len(t) - 1])
    casts: list[Trial] = []
    for first, last in pairwise(edges):
        inside = np.arange(first, last)
        inside = inside[(depth[inside] > SHALLOW) & (depth[inside] < DEEP)]
        rows = _rows(data, inside) if inside.size > 5 * FEWEST else []
        if len(rows) >= 5:
            kind = "dive" if depth[last] > depth[first] else "climb"
            casts.append(_trial(f"{kind} {len(casts) + 1:02d}", pd.DataFrame(rows), inside.size))
    return casts


def _rows(data: pd.DataFrame, inside: NDArray[np.intp]) -> list[dict[str, float]]:
    t = data.t.to_numpy()
    place = ((t[inside] - t[inside[0]]) // BIN).astype(int)
    rows = []
    for k in np.unique(place):
        part = data.iloc[inside[place == k]]
        if len(part) < FEWEST:
            continue
        middle = float(part.t.mean())
        slope = float(np.polyfit(part.t - middle, part.depth, 1)[0])
        rows.append(
            {
                "t": middle,
                "sink": slope,
                "U": float(part.U_adcp.median()) if part.U_adcp.notna().sum() >= FEWEST else math.nan,
            }
            | {"theta": float(part.pitch.mean()), "V_b": 1e-6 * float(part.buoyancy_cc.mean())}
            | {"rho": float(part.rho.mean()), "P": 1e5 * float(part.pressure_bar.mean())}
        )
    return rows


def _trial(name: str, rows: pd.DataFrame, samples: int) -> Trial:
    return Trial(
        name,
        rows.t.to_numpy(),
        {channel.name: rows[channel.name].to_numpy() for channel in INPUTS},
        {channel.name: rows[channel.name].to_numpy() for channel in OUTPUTS},
        steps=(
            Step("rows of 10 s", {"depth": f"{SHALLOW:g} to {DEEP:g} m"}, f"{samples} samples in {len(rows)} rows"),
        ),
        source="Slocum glider comet, Baltic 2016",
    )


def implied_incidence(dive: Trial) -> float:
    """Median incidence, rad, that depth rate, speed and pitch imply together, without any model of forces."""
    valid = np.isfinite(dive.outputs["U"])
    sine = np.clip(dive.outputs["sink"][valid] / dive.outputs["U"][valid], -1.0, 1.0)
    return float(np.median(np.arcsin(sine) - np.abs(dive.inputs["theta"][valid])))


def dives(casts: Sequence[Trial]) -> list[Trial]:
    """Casts with a measured speed."""
    return [cast for cast in casts if np.isfinite(cast.outputs["U"]).sum() >= 5]


def without_speed(cast: Trial) -> Trial:
    """A cast whose speed is not used."""
    return replace(cast, outputs={"sink": cast.outputs["sink"]})


def study(
    model: Model, casts: Sequence[Trial], free: Sequence[str], values: Mapping[str, float] | None = None
) -> Study:
    """A study of casts: these parameters free, the others at these values (published where not given)."""
    given = values or {}
    return Study(
        model.name,
        model,
        Trials(list(casts)),
        parameters=tuple(q.replace(vary=q.name in free, value=given.get(q.name, q.value)) for q in model.parameters),
        cost=TrajectoryOptions(max_step=None if isinstance(model, BlackBox) else 1.0),
    )
