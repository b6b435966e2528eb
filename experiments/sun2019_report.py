"""What the experiment on Sun, Wang and Sang 2019 says of its runs: figures, tables, pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import sun2019_figures as figures
import sun2019_system as system
from common import Results, say
from sun2019_system import ADDED, CLIMB, CURRENT, DIVE, HYDRODYNAMIC, KNOWN, RUDDERS, TRUTH
from xu2012_expected import Checks

DNV_AREA = 0.0058
"""m2, as the reference sheet rounds it for its radii [V]; its own formula gives 0.0057."""


def report_runs(checks: Checks, results: Results, runs: Mapping[str, Any]) -> None:
    for trim, name, V, theta in ((DIVE, "dive", 0.579, -29.3), (CLIMB, "climb", 0.583, 29.7)):
        found = system.steady(trim)
        checks.near(f"{name}: speed", found["V"], V, 0.0005, "m/s")
        checks.near(f"{name}: pitch", math.degrees(found["theta"]), theta, 0.05, "deg")
    checks.near("dive: incidence", math.degrees(system.steady(DIVE)["alpha"]), 1.67, 0.005, "deg")
    saw = {name: np.array(values) for name, values in runs["sawtooth, still"].items()}
    change = np.diff(saw["z"])
    at = np.flatnonzero(change[1:] * change[:-1] < 0) + 1
    checks.near("sawtooth: lower inflection", float(saw["z"][at[0]]), 195.4, 0.05, "m")
    checks.near("sawtooth: upper inflection", float(saw["z"][at[1]]), 2.6, 0.05, "m")
    # the sheet's figures are rounded; a climb takes 668 s, a dive 676 s
    checks.near("sawtooth: half cycle", float(saw["t"][at[2]] - saw["t"][at[0]]) / 2, 670.0, 5.0, "s")
    checks.near("sawtooth: advance in a half cycle", float(saw["x"][at[2]] - saw["x"][at[0]]) / 2, 326.0, 0.5, "m")
    expected = {10.0: (24.1, 0.30, 2.4), 20.0: (12.0, 0.32, 4.7), 30.0: (8.0, 0.36, 7.0)}
    for rudder, (radius, sink, roll) in expected.items():
        found = system.steady(DIVE, math.radians(rudder))
        checks.near(f"spiral {rudder:g} deg: radius", found["radius"], radius, 0.06, "m")
        checks.near(f"spiral {rudder:g} deg: descent", found["sink"], sink, 0.005, "m/s")
        checks.near(f"spiral {rudder:g} deg: roll", math.degrees(found["phi"]), roll, 0.06, "deg")
    rows = []
    for name in ("sawtooth", *(f"spiral {rudder:g}" for rudder in RUDDERS)):
        still, moved = ({c: np.array(v) for c, v in runs[f"{name}, {water}"].items()} for water in ("still", "current"))
        size = min(len(still["t"]), len(moved["t"]))
        drift = {c: moved[c][:size] - still[c][:size] for c in ("x", "y", "z")}
        t = still["t"][:size]
        rows.append(
            {"run": name, "drift north, m": drift["x"][-1], "drift east, m": drift["y"][-1]}
            | {"current x time, north": CURRENT["current_north"] * t[-1]}
            | {"current x time, east": CURRENT["current_east"] * t[-1], "change of depth, m": np.abs(drift["z"]).max()}
        )
    table = pd.DataFrame(rows).set_index("run")
    results.add_table("drift in the current", table)
    apart = float((table["drift north, m"] - table["current x time, north"]).abs().max())
    results.add_figure(
        "current: largest drift that is not current times time", apart, "m", "uniform current, from the carried glide"
    )
    results.add_picture("runs", figures.runs(runs, CURRENT))


def report_controls(checks: Checks, results: Results, controls: Mapping[str, Any]) -> None:
    glides, turns = pd.DataFrame(controls["glides"]), pd.DataFrame(controls["turns"]).astype(float)
    glides = glides.astype(float)
    results.add_table("glide against controls", glides)
    results.add_table("turn against rudder", turns.assign(rudder=np.degrees(turns.rudder)).set_index("rudder"))
    best = math.sqrt(TRUTH["K_D0"] / TRUTH["K_D"])
    results.add_figure(
        "closed form: incidence of the best L/D", math.degrees(best), "deg", "sqrt(K_D0 / K_D), K_L0 = 0"
    )
    top = max(system.closed_glide(a, 0.5)["L/D"] for a in np.radians(np.linspace(1, 15, 2000)))
    results.add_figure("closed form: best L/D", top, "1", "sinking; unreachable in trim where pitch control stalls")
    settled = glides.dropna(subset=["simulated glide"])
    gap = np.degrees((settled["simulated glide"] - settled["glide"]).abs())
    results.add_figure(
        "glide angle: closed form against simulation", float(gap.max()), "deg at most",
        f"{len(settled)} of {len(glides)} trims settle within 10 min",
    )  # fmt: skip
    for rudder, expected in ((10.0, (7.6, 5.3)), (20.0, (5.5, 3.9)), (30.0, (4.8, 3.3))):
        angle = math.radians(rudder)
        for area, value in zip((DNV_AREA, 0.012), expected):
            checks.near(
                f"closed-form radius, {rudder:g} deg, {area:.4f} m2",
                system.closed_radius(angle, area),
                value,
                0.05,
                "m",
            )
        simulated = system.steady(DIVE, angle)["radius"]
        results.add_figure(
            f"turning radius at {rudder:g} deg, simulated", simulated, "m",
            f"closed form {system.closed_radius(angle, 0.012):.1f} m (rudder of 0.012 m2), "
            f"{system.closed_radius(angle, system.rudder_area()):.1f} m (DNV, 0.0057 m2): it has no sway",
        )  # fmt: skip
    results.add_picture("controls", figures.controls(glides, turns, system.closed_glide))


def report_bounds(results: Results, bounds: Mapping[str, Any]) -> None:
    columns, said = {}, {}
    for name, found in bounds.items():
        table = found["bounds"]
        columns[name] = {q: _percent(row["crlb"], KNOWN[q]) for q, row in table.items()}
        said[name] = {q: row["verdict"] for q, row in table.items()}
    order = [*HYDRODYNAMIC, *ADDED, *CURRENT]
    results.add_table("bounds in per cent", pd.DataFrame(columns).reindex(order).rename_axis("coefficient"))
    results.add_table("verdicts", pd.DataFrame(said).reindex(order).rename_axis("coefficient"))
    lines = [
        "What the runs can tell, as the software says (Cramer-Rao bounds at the truth, sensors [S]):",
        "| runs; sensors | identified | weak | not identifiable | trade off |\n|---|---|---|---|---|",
    ]
    for name, row in said.items():
        groups = {v: [q for q, x in row.items() if x == v] for v in ("identified", "weak", "not identifiable")}
        pairs = [sentence.split(" trade off")[0] for sentence in bounds[name]["trade-offs"]]
        cells = [f"{len(groups['identified'])} of {len(row)}", ", ".join(groups["weak"])]
        cells += [", ".join(groups["not identifiable"]), "; ".join(pairs)]
        lines[-1] += f"\n| {name} | {' | '.join(cells)} |"
        results.add_figure(
            f"{name}: coefficients identified", len(groups["identified"]), f"of {len(row)}",
            f"not identifiable: {cells[2] or 'none'}; weak: {cells[1] or 'none'}",
        )  # fmt: skip
    results.add_text("\n\n".join(lines))
    results.add_picture("bounds", figures.bounds(columns, order))


def report_noise(results: Results, rows: Sequence[Mapping[str, Any]]) -> None:
    table: Any = pd.DataFrame(rows)
    results.add_table("noise runs", table.set_index(["level", "coefficient", "seed"]))
    table["scaled"] = table.error / table.crlb
    groups = table.groupby(["level", "coefficient"], sort=False)
    summary = pd.DataFrame(
        {
            "truth": groups.coefficient.first().map(KNOWN),
            "mean error": groups.error.mean(),
            "rms error": groups.error.agg(_rms),
            "crlb": groups.crlb.first(),
            "rms error over crlb": groups.scaled.agg(_rms),
            "mean standard error over crlb": groups.stderr.mean() / groups.crlb.first(),
            "covered": groups.covered.mean(),
        }
    )
    results.add_table("noise", summary)
    for level, part in table.groupby("level"):
        seeds = part.seed.nunique()
        enough = seeds >= 20
        ratio, covered = _rms(part.scaled), 100.0 * float(part.covered.mean())
        each = summary.loc[level]
        worst = str(each["rms error over crlb"].idxmax())
        results.add_figure(
            f"noise x {level:g}: rms error over the Cramer-Rao bound", ratio, "1",
            f"13 coefficients and the current, {seeds} seeds; worst {worst} {each['rms error over crlb'].max():.2f}",
            goal="<= 1.2", met=ratio <= 1.2 if enough else None,
        )  # fmt: skip
        results.add_figure(
            f"noise x {level:g}: coverage of 95 % intervals", covered, "%",
            f"{len(part)} intervals" + ("" if enough else "; too few seeds to judge"),
            goal="92 to 98", met=92.0 <= covered <= 98.0 if enough else None,
        )  # fmt: skip
        ended = part.groupby("seed").ended.first()
        results.add_figure(
            f"noise x {level:g}: searches that converged", int((ended == "converged").sum()), f"of {len(ended)}",
            "least squares, from 0.5, 0.7 and 1.6 times the truth and no current",
        )  # fmt: skip
    results.add_picture("noise", figures.noise(summary))


def report_everything(results: Results, everything: Mapping[str, Any]) -> None:
    rows = pd.DataFrame.from_dict(everything["rows"], orient="index").rename_axis("coefficient")
    results.add_table("added masses too", rows)
    weak = [name for name, row in everything["rows"].items() if row["verdict"] != "identified"]
    results.add_figure(
        "added masses free too: identified in a fit", len(rows) - len(weak), f"of {len(rows)}",
        f"as the estimate says; not: {', '.join(weak) or 'none'}",
    )  # fmt: skip
    lines = "\n".join(f"- {sentence}" for sentence in everything["weak"]) or "- none"
    results.add_text(f"With the added masses free too, the estimate names these combinations:\n\n{lines}")
    for sentence in everything["weak"]:
        say(f"  {sentence}")


def _percent(sd: float | None, value: float) -> float:
    return math.inf if sd is None else 100.0 * sd / abs(value)


def _rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
