"""The planing craft of Liu, Yue and Yu: two formulas of its turning diameter, and a table to fit them to.

Tags: [P] printed in the paper, [R] reconstructed (its equations and tables are lost), [S] synthetic, chosen here, [V]
computed for the reference sheet by other code. The two formulas are one line each in `liu_planing/model_1.toml` and
`model_2.toml`, with the bounds as printed; here they are again as plain functions, to check those lines against.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth import Study, load_study
from seatruth.models.formula import Formula
from seatruth.study import formula_study

Array = NDArray[np.float64]
HERE = Path(__file__).resolve().parent / "liu_planing"
LENGTH, DISPLACEMENT, RUDDER_AREA, LOBAS = 1.5, 50.0, 0.0264, 1.2
"""[P] m, kg, m2; C of the Lobas-type formula for rudders of aspect ratio above 1."""
KNOT, GRAVITY = 1852.0 / 3600.0, 9.81
PRINTED = {
    "M1": {"c1": 0.000262, "c2": 0.00763, "c3": 0.010995, "d1": 9.954833, "d2": 9.459438, "d3": 3.256805},
    "M2": {"a1": 0.058386, "a2": 0.147272, "a3": 0.836367, "a4": 0.00102, "a5": 0.017654},
}
"""[P] Coefficients that the paper's genetic algorithm found."""
TITLES = {"M1": "Lobas-type", "M2": "Eda-type"}
SHEET = {
    "M1": {
        1.0: (9.5, 7.8, 6.6, 5.6, 4.8),
        1.3: (11.3, 9.3, 7.8, 6.6, 5.7),
        1.6: (13.2, 10.9, 9.1, 7.7, 6.6),
        2.0: (15.8, 13.0, 10.9, 9.3, 8.0),
        2.57: (19.7, 16.3, 13.6, 11.6, 9.9),
    },
    "M2": {
        1.0: (7.0, 6.0, 5.3, 4.7, 4.3),
        1.3: (9.2, 8.0, 7.0, 6.3, 5.7),
        1.6: (11.5, 10.0, 8.8, 7.8, 7.1),
        2.0: (14.7, 12.7, 11.2, 10.0, 9.1),
        2.57: (19.5, 16.9, 14.9, 13.3, 12.1),
    },
}
"""[V] D/L by speed (m/s) at the rudder angles of ANGLES, with the printed coefficients."""
ANGLES = (15.0, 20.0, 25.0, 30.0, 35.0)
DRAFTS = {0.13: (50.0, 1.00), 0.14: (55.5, 1.12), 0.145: (58.3, 1.04)}
"""[S] Displacement (kg) and factor on the diameter by draft (m, [P]): it rises to 0.14 m and falls to 0.145 m."""
VOLTAGES = {1.8: 1.35, 2.0: 1.55}
"""[S] Turning speed (m/s) at the light draft by voltage ([P])."""
SCATTER = 0.04
"""[S] Standard deviation of a diameter, relative."""
SEED = 5
"""[S] Of the table that `liu_planing/synthetic_turns.csv` holds."""


def model_1(
    speed: Array, rudder: Array, displacement: Array | float = DISPLACEMENT, scale: float | None = None
) -> Array:
    """[R] D/L of the Lobas-type formula, printed coefficients: speed m/s, rudder deg, displacement kg.

    `scale` replaces C times displacement over rudder area.
    """
    c, V, delta = PRINTED["M1"], speed / KNOT, np.radians(rudder)
    factor = LOBAS * displacement / RUDDER_AREA if scale is None else scale
    found = factor * (c["c1"] * V**2 + c["c2"] * V + c["c3"]) / (c["d1"] * delta**2 + c["d2"] * delta + c["d3"])
    return np.asarray(found)


def model_2(speed: Array, rudder: Array) -> Array:
    """[R] D/L of the Eda-type formula, printed coefficients: speed m/s, rudder deg."""
    a, Fr = PRINTED["M2"], froude(speed)
    return np.asarray((a["a1"] * Fr**3 + a["a2"] * Fr**2 + a["a3"] * Fr) / (a["a4"] * rudder + a["a5"]))


def froude(speed: Array) -> Array:
    """Froude number of the 1.5 m craft."""
    return np.asarray(speed / np.sqrt(GRAVITY * LENGTH))


def turns(seed: int, truth: str = "M2") -> pd.DataFrame:
    """[S] Thirty turns: 3 drafts, 2 voltages, 5 rudder angles; `truth` is the formula that they come from."""
    rows = [(u, d, delta) for d in DRAFTS for u in VOLTAGES for delta in ANGLES]
    voltage, draft, rudder = (np.array(column) for column in zip(*rows))
    displacement, factor = (np.array([DRAFTS[d][k] for d in draft]) for k in (0, 1))
    speed = np.array([VOLTAGES[u] for u in voltage]) * np.sqrt(DISPLACEMENT / displacement)
    right = model_2(speed, rudder) if truth == "M2" else model_1(speed, rudder, displacement)
    diameter = right * factor * (1.0 + SCATTER * np.random.default_rng(seed).standard_normal(len(rows)))
    columns = {"voltage": voltage, "draft": draft, "displacement": displacement, "speed": speed.round(6)}
    return pd.DataFrame(columns | {"froude": froude(speed).round(6), "rudder": rudder, "diameter": diameter.round(6)})


def study(name: str) -> Study:
    """The study of a formula as its TOML file has it: `seatruth identify` on that file does the same."""
    return load_study(HERE / f"{name.replace('M', 'model_')}.toml")


def formula(name: str) -> Formula:
    """The formula of that study."""
    model = study(name).model
    assert isinstance(model, Formula)
    return model


def study_of(name: str, table: pd.DataFrame) -> Study:
    """The same formula and bounds for another table."""
    return formula_study(formula(name).text, table, study(name).parameters, name=name, synthetic=True)
