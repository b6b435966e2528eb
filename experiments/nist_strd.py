"""The nonlinear problems of NIST's Statistical Reference Datasets, as formula studies, from both starts.

    python experiments/nist_strd.py --data FOLDER

FOLDER holds NIST's files as they are (https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml: Bennett5.dat and 26
more). Each of the 54 runs must give at least 6 digits of every certified value and 4 of every certified standard error,
or say that it did not: that the search did not converge, that a parameter is not identifiable, or that the residuals
are rounding. The digits are -log10 of the largest relative error (McCullough 1998).
"""

from __future__ import annotations

import dataclasses
import math
import re
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS, Options, Results, main, say

from seatruth import Budget, Parameter, identify
from seatruth.errors import BadInput
from seatruth.study import formula_study

DIGITS, DIGITS_OF_ERRORS = 6.0, 4.0
_MOST_DIGITS = 11.0
"""Digits of NIST's certified values."""
_PI = "3.141592653589793"
_LANCZOS = "y = b1*exp(-b2*x) + b3*exp(-b4*x) + b5*exp(-b6*x)"
_GAUSS = "y = b1*exp(-b2*x) + b3*exp(-(x - b4)**2/b5**2) + b6*exp(-(x - b7)**2/b8**2)"
_CUBIC = "y = (b1 + b2*x + b3*x**2 + b4*x**3)/(1 + b5*x + b6*x**2 + b7*x**3)"
_CHWIRUT = "y = exp(-b1*x)/(b2 + b3*x)"
_YEAR = f"2*{_PI}*x"
FORMULAS = {
    "Misra1a": "y = b1*(1 - exp(-b2*x))",
    "Misra1b": "y = b1*(1 - (1 + b2*x/2)**(-2))",
    "Misra1c": "y = b1*(1 - (1 + 2*b2*x)**(-0.5))",
    "Misra1d": "y = b1*b2*x/(1 + b2*x)",
    "Chwirut1": _CHWIRUT,
    "Chwirut2": _CHWIRUT,
    "Lanczos1": _LANCZOS,
    "Lanczos2": _LANCZOS,
    "Lanczos3": _LANCZOS,
    "Gauss1": _GAUSS,
    "Gauss2": _GAUSS,
    "Gauss3": _GAUSS,
    "DanWood": "y = b1*x**b2",
    "Kirby2": "y = (b1 + b2*x + b3*x**2)/(1 + b4*x + b5*x**2)",
    "Hahn1": _CUBIC,
    "Thurber": _CUBIC,
    "Nelson": "y = b1 - b2*x1*exp(-b3*x2)",
    "MGH17": "y = b1 + b2*exp(-x*b4) + b3*exp(-x*b5)",
    "MGH09": "y = b1*(x**2 + x*b2)/(x**2 + x*b3 + b4)",
    "MGH10": "y = b1*exp(b2/(x + b3))",
    "Roszman1": f"y = b1 - b2*x - atan(b3/(x - b4))/{_PI}",
    "ENSO": f"y = b1 + b2*cos({_YEAR}/12) + b3*sin({_YEAR}/12) + b5*cos({_YEAR}/b4) + b6*sin({_YEAR}/b4)"
    f" + b8*cos({_YEAR}/b7) + b9*sin({_YEAR}/b7)",
    "BoxBOD": "y = b1*(1 - exp(-b2*x))",
    "Rat42": "y = b1/(1 + exp(b2 - b3*x))",
    "Rat43": "y = b1/(1 + exp(b2 - b3*x))**(1/b4)",
    "Eckerle4": "y = b1/b2*exp(-0.5*((x - b3)/b2)**2)",
    "Bennett5": "y = b1*(b2 + x)**(-1/b3)",
}


@dataclass(frozen=True)
class Certified:
    """One data set.

    Attributes:
        table: Columns y and x, or x1 and x2.
        starts: (2, K).
        values, errors: (K,), certified.
    """

    table: pd.DataFrame
    starts: np.ndarray
    values: np.ndarray
    errors: np.ndarray


def read(path: Path) -> Certified:
    """A file of NIST."""
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError):
        raise BadInput("the data set is not there", where=path.name, do="Give the folder with --data.") from None
    rows = [line.split("=", 1)[1].split() for line in lines if re.match(r"\s*b\d+ =", line)]
    numbers = np.array([[float(word) for word in row] for row in rows])
    first = next(k for k, line in enumerate(lines) if re.match(r"Data:\s+y\s+x", line))
    names = lines[first].split()[1:]
    body = [[float(word) for word in line.split()] for line in lines[first + 1 :] if line.strip()]
    table = pd.DataFrame(body, columns=names)
    if path.stem == "Nelson":
        table["y"] = np.log(table["y"])
    return Certified(table, numbers[:, :2].T, numbers[:, 2], numbers[:, 3])


def digits(found: Any, certified: Any) -> float:
    """Digits in which all of these numbers agree with the certified ones."""
    error = np.abs(np.asarray(found, dtype=float) / np.asarray(certified, dtype=float) - 1.0)
    worst = float(np.max(np.where(np.isfinite(error), error, np.inf)))
    return float(np.clip(-math.log10(max(worst, 10**-_MOST_DIGITS)), 0.0, _MOST_DIGITS))


def run(name: str, known: Certified, start: int) -> dict[str, Any]:
    """One run: its digits, and how it says that it ended."""
    parameters = [Parameter(f"b{k + 1}", float(v), vary=True) for k, v in enumerate(known.starts[start])]
    study = formula_study(FORMULAS[name], known.table, parameters, noise="estimate", name=name)
    found = identify(study, budget=Budget(50_000), threads=1)
    table = found.parameters.loc[[q.name for q in parameters]]
    row: dict[str, Any] = {"data set": name, "start": start + 1, "digits": digits(table["value"], known.values)}
    row |= {"digits of errors": digits(table["stderr"], known.errors), "code": found.outcome["code"]}
    row |= {"evaluations": found.outcome["evaluations"], "reason": found.outcome["reason"]}
    row["verdicts"] = ", ".join(sorted(set(table["verdict"])))
    right = row["digits"] >= DIGITS and row["digits of errors"] >= DIGITS_OF_ERRORS
    row["right"] = right
    row["findings"] = ", ".join(sorted({finding.code for finding in found.findings if finding.severity != "note"}))
    doubtful = found.outcome["code"] != "converged" or set(table["verdict"]) != {"identified"}
    row["says so"] = right or doubtful or "residuals-of-rounding" in row["findings"]
    return row


def picture(table: pd.DataFrame) -> Any:
    """Digits of the values and of their standard errors, of each problem from both starts, beside what is wanted."""
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(table["data set"]))
    size = (8.5, 0.2 * len(names) + 1.4)
    figure, panels = plt.subplots(1, 2, figsize=size, sharex=True, sharey=True, layout="constrained")
    labels = {"digits": "certified values", "digits of errors": "certified standard errors"}
    for axes, (column, label), wanted in zip(panels, labels.items(), (DIGITS, DIGITS_OF_ERRORS), strict=True):
        for start, colour, marker in ((1, COLOURS[3], "o"), (2, COLOURS[0], "D")):
            for reached, fill in ((True, colour), (False, "white")):
                part = table[(table["start"] == start) & ((table[column] >= wanted) == reached)]
                y = [names.index(name) + 0.36 * (start - 1.5) for name in part["data set"]]
                axes.plot(part[column], y, marker, color=colour, mfc=fill, ms=4.5, ls="none", zorder=3)
        axes.axvline(wanted, color="black", ls="--", lw=1)
        axes.set_xlabel(f"digits of the {label} (1)")
        axes.set_xlim(-0.2, _MOST_DIGITS + 0.2)
        axes.grid(True, alpha=0.3)
    panels[0].set_yticks(range(len(names)), names, fontsize=8)
    panels[0].set_ylim(len(names) - 0.4, -0.6)
    for text, look in (
        ("NIST's far start", {"marker": "o", "color": COLOURS[3]}),
        ("near start", {"marker": "D", "color": COLOURS[0]}),
        ("fewer than wanted", {"marker": "o", "color": "0.3", "mfc": "white"}),
    ):
        panels[0].plot([], [], ls="none", ms=5, label=text, **look)
    panels[0].plot([], [], color="black", ls="--", lw=1, label="wanted")
    figure.legend(loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure


def body(options: Options, results: Results) -> None:
    if not (options.data / "Misra1a.dat").exists():
        note = "NIST's files are not in the folder of --data"
        results.add_figure("right", None, "runs", note)
        say(note)
        return
    names = list(FORMULAS)[:3] if options.quick else list(FORMULAS)
    rows = []
    for name in names:
        known = read(options.data / f"{name}.dat")
        for start in range(2):
            content = {"formula": FORMULAS[name], "data": [part.tolist() for part in dataclasses.astuple(known)[1:]]}
            rows.append(
                results.stage(f"{name} {start + 1}", content | {"start": start}, partial(run, name, known, start))
            )
            say(f"  {rows[-1]['digits']:.1f} digits, {rows[-1]['digits of errors']:.1f} of the standard errors")
    table = pd.DataFrame(rows)
    results.add_text(__doc__ or "")
    results.add_table("runs", table.set_index(["data set", "start"]))
    results.add_picture("digits", picture(table))
    right, honest = int(table["right"].sum()), int((table["right"] | table["says so"]).sum())
    results.add_figure("right", right, "runs", f"of {len(table)}", goal=f"{len(table)}", met=right == len(table))
    results.add_figure(
        "right or said to be doubtful",
        honest,
        "runs",
        f"of {len(table)}",
        goal=f"{len(table)}",
        met=honest == len(table),
    )


if __name__ == "__main__":
    sys.exit(main("nist_strd", str(__doc__).splitlines()[0], body))
