"""What is handed out of a case: the study file and the logs, with nothing in them that names the cause."""

from __future__ import annotations

import math

import numpy as np

from withheld.cases import Case
from withheld.reality.families import Family
from withheld.reality.simulate import Record
from withheld.referee import PRIOR

UNITS = {
    "x": "m", "y": "m", "z": "m", "psi": "rad", "theta": "rad", "u": "m/s", "v": "m/s", "w": "m/s", "r": "rad/s",
    "u_w": "m/s", "v_w": "m/s",
    "q": "rad/s", "delta": "rad", "delta_s": "rad", "n": "rev/s", "n_port": "rev/s", "n_starboard": "rev/s",
    **{f"n_{end}_{side}": "rev/s" for end in ("bow", "stern") for side in ("port", "starboard")},
}  # fmt: skip
KEPT = 0.05
"""Logs are rounded to about this share of a channel's noise."""


WIDE = 0.75
"""Bounds of a coefficient to either side, as a share of it, where the library has no set for the ship: five priors."""


def channels(family: Family) -> list[str]:
    """Columns of a log besides time: inputs, then outputs."""
    return [*family.inputs, *family.named_in_log.values()]


def log_text(family: Family, record: Record) -> str:
    """One trial as CSV: a line that says it is synthetic, a header with units, rounded numbers."""
    columns = channels(family)
    lines = [
        "# SYNTHETIC: simulated by experiments/withheld; no measurement",
        ",".join(["t [s]", *(f"{name} [{UNITS[name]}]" for name in columns)]),
    ]
    shown = family.named_in_log
    values = {**family.recorded(record.delta, record.n), **{shown[name]: y for name, y in record.outputs.items()}}
    places = {shown[name]: max(0, math.ceil(-math.log10(KEPT * sd))) for name, sd in family.noise.items()}
    places |= {name: 6 if UNITS[name] == "rad" else 4 for name in family.inputs}
    table = [[f"{t:.2f}" for t in record.t]]
    table += [[f"{value:.{places[name]}f}" for value in np.round(values[name], places[name]) + 0.0] for name in columns]
    return "\n".join([*lines, *(",".join(row) for row in zip(*table, strict=True))]) + "\n"


def _own(family: Family, value: float) -> str:
    """Value and bounds of one coefficient of a ship that the library has no set for; else nothing."""
    if not family.whole:
        return ""
    low, high = sorted((value * (1 - WIDE), value * (1 + WIDE)))
    return f"value = {value:.8g}, min = {low:.6g}, max = {high:.6g}, "


def study_text(case: Case, name: str) -> str:
    """The study file: the model at nominal values, priors on every coefficient; in half of the cases the white noise of
    the data sheet, in the others no word on noise."""
    family = case.family
    lines = [
        "# SYNTHETIC: a case of the withheld-effect benchmark (docs/withheld.md). The model may lack something.",
        "[study]",
        f'name = "{name}"',
        f'description = "Withheld-effect benchmark, case {name}. Synthetic."',
        "synthetic = true",
        "",
        "[model]",
        f'use = "{family.model}"',
        *([f'set = "{family.set}"'] if family.set else []),
        "",
        f"# Tank tests of a sister ship: each coefficient is known to {PRIOR:.0%}.",
        "[parameters]",
    ]
    for key, value in family.coefficients.items():
        prior = f"{{ mean = {value:.8g}, sd = {PRIOR * abs(value):.6g} }}"
        lines.append(f"{key} = {{ {_own(family, value)}vary = true, prior = {prior} }}")
    lines += [f"{key} = {{ value = {value:.8g} }}  # known" for key, value in family.measured.items()]
    lines += ["", "[channels]"]
    lines += [f'{key} = {{ column = "{key} [{UNITS[key]}]", unit = "{UNITS[key]}" }}' for key in channels(family)]
    lines += ["", "[time]", 'column = "t [s]"', 'unit = "s"', ""]
    for k, record in enumerate(case.records):
        steered = "autopilot" if record.trial.closed else "open loop"
        recorded = "revolutions" if family.thrusters else "order" if case.ordered else "actual angle"
        lines += [
            "[[trials]]",
            f'name = "t{k + 1}_{record.trial.name}"',
            f'file = "trial_{k + 1}.csv"',
            f'conditions = {{ manoeuvre = "{record.trial.name}", steering = "{steered}", recorded = "{recorded}", '
            f"heading_deg = {math.degrees(record.trial.heading) % 360:.1f}, synthetic = true }}",
            "",
        ]
    if case.plan.stated:
        lines += ["[noise]  # white noise of the sensors, by their data sheets"]
        lines += [f'{family.named_in_log[key]} = "{sd:.6g} {UNITS[key]}"' for key, sd in family.noise.items()]
        lines += [""]
    lines += ["[cost]", 'kind = "trajectory"', 'initial = "free"', ""]
    lines += ["[optimizer]", 'use = "least_squares"', "", "[budget]", "evaluations = 20000"]
    return "\n".join(lines) + "\n"
