"""A Slocum glider's recorded dives: lift and drag from the steady glide, and the water speed on casts left out.

Real data (not part of this repository). Measured and assumed: see `slocum_glide.py`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import slocum_figures as figures
import slocum_glide as glide
from common import Options, Results, digest, main, say
from slocum_glide import PARAMETERS, PUBLISHED, STEADY, UNSTEADY

from seatruth import Model, identify
from seatruth.costs import cost_of
from seatruth.trials import Trial
from seatruth.uncertainty import correlated_pairs, covariance, identifiability, strongly_correlated, verdict

SEED = 0
FILE = "slocum_glider/comet_2016-174.csv"
CHOSEN = ("m", "C_D0", "C_L")
"""Free in the main fit. What else could be is not told by this record (see "what the record tells")."""
MODELS: dict[str, Model] = {"steady": STEADY, "unsteady": UNSTEADY}
WAYS: dict[str, tuple[str, tuple[str, ...], bool]] = {
    "published, as they are": ("steady", (), False),
    "published, mass from depth": ("steady", ("m",), False),
    "mass and drag from depth": ("steady", ("m", "C_D0"), False),
    "mass, drag, lift from depth and speed": ("steady", CHOSEN, True),
    "and pitch offset": ("steady", (*CHOSEN, "theta_0"), True),
    "and compressibility": ("steady", (*CHOSEN, "epsilon"), True),
    "unsteady: published, mass from depth": ("unsteady", ("m",), False),
    "unsteady: mass and drag from depth": ("unsteady", ("m", "C_D0"), False),
    "unsteady: mass, drag, lift from depth and speed": ("unsteady", CHOSEN, True),
    "unsteady, and compressibility": ("unsteady", (*CHOSEN, "epsilon"), True),
}
"""How the speed of casts left out is predicted: model, what is fitted to the other casts, whether with their speed.
Those with compressibility were added after the residuals of all casts had been seen; the others were set before."""
QUICK = ("published, mass from depth", "mass and drag from depth", "mass, drag, lift from depth and speed")
MAIN = "mass, drag, lift from depth and speed"
ABOUT = """
4.1 h of a Slocum glider in the Baltic, 2016 (public record of Merckelbach et al. 2019, MIT licence): 18 dives and 18
climbs between 0 and 42 m, all at nearly one pitch (-22 and +22 deg) and full pump. Measured: depth, pitch, pumped
volume, density; on dives the speed of the water. Assumed: reference area 0.1 m2, volume 70/1004 m3, compressibility
5e-10 /Pa, induced drag 10.5, a hull that does not expand with temperature, and no vertical motion of the water on
average. The published constants come from data of which this record is a part: agreement is no independent proof.
"""


def body(options: Options, results: Results) -> None:
    file = options.trials(FILE) / FILE
    results.expect(4)
    results.add_text(ABOUT)
    casts = glide.read(file)
    dives = glide.dives(casts)
    suspect = [dive.name for dive in dives if abs(glide.implied_incidence(dive)) > glide.PLAUSIBLE]
    used = [cast for cast in casts if cast.name not in suspect]
    say(f"  {len(casts)} casts, {len(dives)} with a speed; implausible speed: {', '.join(suspect) or 'none'}")
    data = {"data": digest([[cast.name, cast.t, cast.inputs, cast.outputs] for cast in casts])}
    threads, quick = options.workers, options.quick
    fits = results.stage("fits", data, lambda: _fits(used, threads))
    told = results.stage("what the record tells", data, lambda: _told(used, fits["steady"]["values"], threads))
    ways = list(QUICK if quick else WAYS)
    groups = 3 if quick else 6
    setting = data | {"ways": ways, "groups": groups}
    predicted = results.stage(
        "casts left out", setting, lambda: _left_out(casts, suspect, ways, groups=groups, threads=threads)
    )
    extra = {"quick": quick}
    around = results.stage("how sure", data | extra, lambda: _how_sure(used, threads, quick=quick))

    _report_record(results, dives, suspect)
    _report_fits(results, fits, told, around)
    _report_left_out(results, predicted, suspect)
    results.add_picture("left out", figures.left_out(predicted, MAIN, suspect))
    results.add_picture("record", figures.record(casts, suspect))


def _fit(model: Model, casts: Sequence[Trial], free: Sequence[str], speed: bool, threads: int, **given: float) -> Any:
    kept = [cast if speed else glide.without_speed(cast) for cast in casts]
    return identify(glide.study(model, kept, free, PUBLISHED | given), seed=SEED, threads=threads)


def _values(model: Model, estimate: Any) -> dict[str, float]:
    found = {q.name: q.value for q in model.parameters}
    return found | {name: float(value) for name, value in estimate.parameters["value"].items()}


def _fits(casts: Sequence[Trial], threads: int) -> dict[str, Any]:
    """Fits of the chosen three to all casts; and of mass and drag to their depth alone."""
    found = {}
    for name, model in MODELS.items():
        for label, free, speed in ((name, CHOSEN, True), (f"{name}, depth only", ("m", "C_D0"), False)):
            estimate = _fit(model, casts, free, speed, threads)
            columns = ["value", "stderr", "lower", "upper", "verdict"]
            fit = estimate.fit.groupby("channel")[["rmse", "bias", "n", "n_eff"]]
            found[label] = {
                "values": _values(model, estimate),
                "table": estimate.parameters[columns].reset_index().to_dict("records"),
                "fit": fit.agg({"rmse": _rms, "bias": "mean", "n": "sum", "n_eff": "sum"}).to_dict("index"),
            }
    return found


def _told(casts: Sequence[Trial], values: Mapping[str, float], threads: int) -> dict[str, Any]:
    """Verdicts on the parameters of the steady glide, were they all free, and what cannot be told apart.

    Once with the reference area free, once with it known.
    """
    found = {}
    names = [q.name for q in PARAMETERS]
    for label, free in (("all eight", names), ("area known", [name for name in names if name != "S"])):
        cost = cost_of(glide.study(STEADY, casts, free, values), threads=threads)
        cost.reweight(cost.start)
        jacobian = cost.jacobian(cost.start)
        said = covariance(cost.residuals(cost.start), jacobian, cost.residual_blocks)
        related = strongly_correlated(said)
        table = {
            p.name: {"value": p.value, "stderr": float(said.stderr[k])}
            | {
                "verdict": verdict(
                    p, p.value, float(said.stderr[k]), False, bool(said.unidentifiable[k]), bool(related[k])
                )
            }
            for k, p in enumerate(cost.parameters)
        }
        weak = identifiability(jacobian, cost.parameters)["weak"]
        found[label] = {"table": table, "weak": [*weak, *correlated_pairs(said, cost.parameters)]}
    return found


def _left_out(
    casts: Sequence[Trial], suspect: Sequence[str], ways: Sequence[str], *, groups: int, threads: int
) -> list[dict[str, Any]]:
    """Rows of the dives, each predicted from fits to the casts of the other groups; groups are consecutive casts.

    Suspect dives train nothing; their prediction is kept apart.
    """
    rows: list[dict[str, Any]] = []
    edges = np.linspace(0, len(casts), groups + 1).round().astype(int)
    for group, (first, last) in enumerate(pairwise(edges)):
        inside, others = casts[first:last], [*casts[:first], *casts[last:]]
        others = [cast for cast in others if cast.name not in suspect]
        targets = [cast for cast in inside if np.isfinite(cast.outputs["U"]).any()]
        profile = _profile(glide.dives(others))
        for way in ways:
            kind, free, speed = WAYS[way]
            model = MODELS[kind]
            estimate = _fit(model, others, free, speed, threads) if free else None
            values = {q.name: q.value for q in model.parameters} if estimate is None else _values(model, estimate)
            noise = (
                math.nan if estimate is None or not speed else float(_rms(estimate.fit.query("channel == 'U'").rmse))
            )
            cost = cost_of(glide.study(model, targets, ["C_D0"], values), threads=threads)
            for dive, y in zip(targets, cost.predict(cost.start, targets)):
                rows += _rows(dive, way, group, y, noise)
        for dive in targets:
            made = np.column_stack([np.full(len(dive), math.nan), profile(dive.inputs["P"])])
            rows += _rows(dive, "mean profile of the other dives", group, made, math.nan)
    return rows


def _profile(dives: Sequence[Trial]) -> Any:
    """Mean speed against pressure: no model at all, but speeds on other dives of the same kind."""
    P = np.concatenate([dive.inputs["P"] for dive in dives])
    U = np.concatenate([dive.outputs["U"] for dive in dives])
    valid = np.isfinite(U)
    return np.polynomial.Polynomial.fit(P[valid], U[valid], 3)


def _rows(dive: Trial, way: str, group: int, y: Any, noise: float) -> list[dict[str, Any]]:
    return [
        {"way": way, "group": group, "dive": dive.name, "t": float(dive.t[k]), "P": float(dive.inputs["P"][k])}
        | {"U": float(dive.outputs["U"][k]), "predicted": float(y[k, 1]), "noise": noise}
        | {"sink": float(dive.outputs["sink"][k]), "predicted sink": float(y[k, 0])}
        for k in range(len(dive))
    ]


def _how_sure(casts: Sequence[Trial], threads: int, *, quick: bool) -> dict[str, Any]:
    """The fit with other assumptions, and without each cast in turn (jackknife)."""
    changes: dict[str, dict[str, float]] = {
        "C_D1 = 5": {"C_D1": 5.0},
        "C_D1 = 20": {"C_D1": 20.0},
        "epsilon = 0": {"epsilon": 0.0},
        "epsilon = 1e-9 /Pa": {"epsilon": 1e-9},
        "V_g 1 % smaller": {"V_g": 0.99 * PUBLISHED["V_g"], "m": 69.3},
        "V_g 1 % larger": {"V_g": 1.01 * PUBLISHED["V_g"], "m": 70.7},
        "pitch 0.01 rad higher": {"theta_0": 0.01},
        "S = 0.11 m2": {"S": 0.11},
    }
    rows = {}
    for label, given in list(changes.items())[: 2 if quick else None]:
        estimate = _fit(STEADY, casts, CHOSEN, True, threads, **given)
        rows[label] = {name: float(estimate.parameters["value"][name]) for name in CHOSEN}
        rows[label]["rmse U"] = float(_rms(estimate.fit.query("channel == 'U'").rmse))
    found: dict[str, Any] = {"assumptions": rows}
    if not quick:
        fit = partial(_fit, STEADY, free=CHOSEN, speed=True, threads=threads)
        values = np.array(
            [
                [fit(casts=[*casts[:k], *casts[k + 1 :]]).parameters["value"][name] for name in CHOSEN]
                for k in range(len(casts))
            ]
        )
        n = len(casts)
        spread = np.sqrt((n - 1) / n * ((values - values.mean(axis=0)) ** 2).sum(axis=0))
        found["jackknife"] = dict(zip(CHOSEN, spread.tolist()))
    return found


def _report_record(results: Results, dives: Sequence[Trial], suspect: Sequence[str]) -> None:
    implied = {dive.name: math.degrees(glide.implied_incidence(dive)) for dive in dives}
    table = pd.DataFrame({"incidence implied by depth rate, speed and pitch, deg": implied}).rename_axis("dive")
    results.add_table("implied incidence", table)
    good = [value for name, value in implied.items() if name not in suspect]
    results.add_figure(
        "implied incidence, median of dives", float(np.median(good)), "deg",
        f"from {min(good):.1f} to {max(good):.1f}; no model of forces. Left aside: "
        + (", ".join(f"{name} ({implied[name]:.1f} deg)" for name in suspect) or "none"),
    )  # fmt: skip


def _report_fits(results: Results, fits: Mapping[str, Any], told: Mapping[str, Any], around: Mapping[str, Any]) -> None:
    rows = [{"fit": name, **row} for name, fit in fits.items() for row in fit["table"]]
    results.add_table("fits", pd.DataFrame(rows).set_index(["fit", "name"]))
    units = {q.name: q.unit for q in (*PARAMETERS,)}
    spread = around.get("jackknife", {})
    for row in fits["steady"]["table"]:
        name = row["name"]
        note = f"95 % {row['lower']:.4g} to {row['upper']:.4g}; {row['verdict']}; published {PUBLISHED[name]:.4g}"
        note += f"; standard error {row['stderr']:.2g}"
        note += f", by leaving out casts {spread[name]:.2g}" if name in spread else ""
        results.add_figure(f"steady fit: {name}", row["value"], units[name], note)
    for name, fit in fits.items():
        said = ", ".join(
            f"{channel} {1e3 * row['rmse']:.1f} mm/s ({row['n']:.0f} rows, worth {row['n_eff']:.0f})"
            for channel, row in fit["fit"].items()
        )
        drag = next(row for row in fit["table"] if row["name"] == "C_D0")
        results.add_figure(
            f"{name}: C_D0", drag["value"], "1", f"standard error {drag['stderr']:.2g}; left over: {said}"
        )
    for label, part in told.items():
        table = pd.DataFrame.from_dict(part["table"], orient="index").rename_axis("parameter")
        results.add_table(f"what the record tells, {label}", table)
        lost = [name for name, row in part["table"].items() if row["verdict"] != "identified"]
        results.add_figure(
            f"{label} free: parameters identified", len(table) - len(lost), f"of {len(table)}",
            "not: " + ", ".join(f"{name} ({part['table'][name]['verdict']})" for name in lost),
        )  # fmt: skip
        lines = "\n".join(f"- {entry['sentence']}" for entry in part["weak"]) or "- nothing"
        results.add_text(f"Were all parameters of the steady glide free ({label}), the software says:\n\n{lines}")
    results.add_table("other assumptions", pd.DataFrame(around["assumptions"]).T.rename_axis("assumption"))


def _report_left_out(results: Results, rows: Sequence[Mapping[str, Any]], suspect: Sequence[str]) -> None:
    table: Any = pd.DataFrame(rows).astype({"predicted sink": float, "noise": float})
    results.add_table("casts left out", table.set_index(["way", "dive", "t"]))
    table["error"] = table.predicted - table.U
    good = table[~table.dive.isin(suspect)]
    lines = [
        f"Speed on dives left out in {good.group.nunique()} groups of consecutive casts, mm/s (mean speed "
        f"{1e3 * good.U.mean():.0f}):",
        "| way | rms error | median size | mean error | rms error of dive means | worst group |\n" + "|---" * 6 + "|",
    ]
    for way, part in good.groupby("way", sort=False):
        by_dive, by_group = part.groupby("dive").error.mean(), part.groupby("group").error.agg(_rms)
        figures_of = [_rms(part.error), part.error.abs().median(), part.error.mean(), _rms(by_dive), by_group.max()]
        lines[-1] += f"\n| {way} | " + " | ".join(f"{1e3 * value:.1f}" for value in figures_of) + " |"
        known = part.dropna(subset=["noise"])
        relative = 100.0 * _rms(part.error) / good.U.mean()
        note = f"mean {1e3 * part.error.mean():+.1f} mm/s; {relative:.1f} % of the mean speed"
        if len(known):
            inside = float((known.error.abs() <= 1.96 * known.noise).mean())
            note += f"; 95 % intervals of a row cover {100 * inside:.1f} %"
        results.add_figure(f"left out, {way}", 1e3 * _rms(part.error), "mm/s rms", note)
    base, ours = (_rms(good[good.way == way].error) for way in ("published, mass from depth", MAIN))
    deep = good[(good.way == MAIN) & (good.P > 3.5e5)].error.mean()
    results.add_figure(
        "left out: mean error below 3.5 bar", 1e3 * deep, "mm/s",
        "the deepest rows are faster than predicted: colder, denser water, or a hull that shrinks more than assumed",
    )  # fmt: skip
    squares = good.assign(square=good.error**2).groupby(["way", "dive"]).square.mean().unstack("way")
    gain = squares["published, mass from depth"] - squares[MAIN]
    results.add_figure(
        "left out: fitted against published", ours / base, "1",
        "rms error of speed over that of published constants with the mass from depth; better on "
        f"{int((gain > 0).sum())} of {len(gain)} dives, mean square less by {1e6 * gain.mean():.1f} "
        f"+- {1e6 * gain.std() / math.sqrt(len(gain)):.1f} (mm/s)2: "
        + ("a difference" if gain.mean() > 2 * gain.std() / math.sqrt(len(gain)) else "no difference that can be told"),
    )  # fmt: skip
    for name in suspect:
        part = table[(table.dive == name) & (table.way == MAIN)]
        results.add_figure(
            f"{name}, set aside: mean error of speed", 1e3 * float(part.error.mean()), "mm/s",
            f"while its sinking speed is predicted to {1e3 * _rms(part['predicted sink'] - part.sink):.1f} mm/s rms: "
            "the log, not the glide, was different",
        )  # fmt: skip
    results.add_text("\n\n".join(lines))


def _rms(values: Any) -> float:
    return float(np.sqrt(np.nanmean(np.square(np.asarray(values, dtype=float)))))


if __name__ == "__main__":
    sys.exit(main("slocum", str(__doc__).splitlines()[0], body, seeds={"search": SEED}))
