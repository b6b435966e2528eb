"""Zhao, Xie and Qiao 2018: a torpedo-like vehicle in six degrees of freedom, identified channel by channel.

All trials are synthetic: the paper's vehicle and equations are lost; a reconstruction [R] with values from elsewhere
[L] and chosen here [S] stands in. "Expected" are figures [V] that independent code computed for the same sets.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import zhao2018_channels as system
import zhao2018_figures as figures
import zhao2018_sensors as sensors
import zhao2018_work as work
from common import Options, Results, main
from xu2012_expected import Checks
from zhao2018_channels import DISAGREES, JUDGED, SEEN, TRUTH
from zhao2018_runs import T1, T2, Run, plans, sail, saturation, truth

from seatruth.models.torpedo_channels import FREE

SEED = work.SEED
ABOUT = """
Printed in the paper [P]: the 6-DOF model of Yan 2005 and its four channels, closed-loop excitation by alternating
waypoints and depths, preparation, identification of the channels whose open loop disagrees, roll before lateral,
maximum likelihood by Newton-Raphson, open-loop validation on unfitted runs. Reconstructed [R]: the equations, the
channels' vectors. From other literature [L]: the vehicle T1, REMUS-100 class. Chosen here [S]: the vehicle T2, gains,
sensors, the tank's errors. All trials are synthetic, and not one figure here is the paper's own result.
"""


def body(options: Options, results: Results) -> None:
    quick, threads = options.quick, options.workers
    results.expect(9 if quick else 10)
    checks = Checks(results)
    results.add_text(ABOUT)
    _excitation(checks, results)
    facts = results.stage(
        "identifiability",
        {"seed": SEED},
        lambda: {"forward": work.forward_facts(threads), "lateral": work.lateral_facts(threads)},
    )
    ready = work.trials(list(plans(T1)), (SEED,))
    depth = results.stage("depth", {"seed": SEED}, lambda: work.depth_sources("depth steps", (SEED, 5)))
    held = results.stage("runs", {"seed": SEED}, lambda: work.excited(ready, threads))
    apart = results.stage("decision", {"seed": SEED}, lambda: work.decide(ready, threads))
    fits = results.stage("channels", {"seed": SEED}, lambda: work.fit_channels(ready, threads))
    whole = results.stage("all at once", {"seed": SEED}, lambda: work.fit_all(ready, threads))
    values = _sets(fits, whole)
    loops = results.stage("validation", {"seed": SEED}, lambda: work.validate(ready, values, threads))
    setting: dict[str, int] = {"count": 2 if quick else 20, "seed": SEED}
    tries = results.stage("starts", setting, lambda: work.starts(**setting))
    setting = {"count": 1 if quick else 40, "seed": SEED}
    errors = results.stage("seeds", setting, lambda: work.seeds(**setting, workers=options.workers))
    loose = None
    if not quick:
        setting = {"count": 12, "seed": SEED}
        loose = results.stage(
            "noisy fins", setting, lambda: work.seeds(**setting, workers=options.workers, fin_noise=sensors.LOOSE_FIN)
        )

    _report_facts(checks, results, facts)
    _report_preparation(results, ready, depth)
    _report_runs(results, held)
    _report_decision(results, apart)
    _report_fits(results, fits, whole)
    _report_validation(results, loops)
    _report_starts(results, tries)
    _report_seeds(results, errors, loose)
    checks.finish()


def _excitation(checks: Checks, results: Results) -> None:
    """The closed loop between waypoints against the reference figures."""
    rows = {}
    for vehicle, limit, least in ((T1, 24.0, 1.32), (T2, 15.0, 5.09)):
        trial = sail(Run("weave and depths", vehicle, 200.0, weave=True, depths=True))
        rows[vehicle.set] = found = saturation(trial)
        # gains of the depth loop and when a waypoint counts as reached are not on record
        checks.near(f"{vehicle.set}: rudder at its limit", found["rudder at its limit, %"], limit, 3.0, "%")
        checks.at_most(f"{vehicle.set}: planes at their limit", found["planes at their limit, %"], 1.0, "%")
        checks.near(f"{vehicle.set}: least speed", found["least speed, m/s"], least, 0.03, "m/s")
    results.add_table("closed loop", pd.DataFrame(rows).T.rename_axis("set"))
    results.add_picture("closed loop", figures.weave(truth("mixed 1"), (T1.leg, T1.offset)))


def _report_facts(checks: Checks, results: Results, facts: Mapping[str, Any]) -> None:
    forward, lateral = facts["forward"], facts["lateral"]
    four, three = forward["all four"], forward["lambda_11 given"]
    checks.at_most("forward, four free: smallest singular value", four["smallest singular value"], 2.5e-5, "1")
    checks.near("forward, lambda_11 given: the same", three["smallest singular value"], 0.13, 0.005, "1")
    for name, expected, within in (("C_x0", 0.2, 0.05), ("k_1", 4.4, 0.5), ("k_2", 0.6, 0.1)):
        checks.near(f"forward, lambda_11 given: bound of {name}", three["bound, %"][name], expected, within, "%")
    said = sorted({*four["verdict"].values(), *four["said after the fit"].values()})
    results.add_figure(
        "forward channel, four free: called not identifiable",
        sum(word == "not identifiable" for word in four["said after the fit"].values()),
        "of 4",
        f"verdicts before and after the fit: {', '.join(said)}; {' '.join(four['sentences'])}",
        goal="4",
        met=said == ["not identifiable"],
    )
    rows = []
    for vehicle, cases in lateral.items():
        for case, part in cases.items():
            rows.append({"set": vehicle, "recorded and free": case, **part})
    results.add_table("lateral bounds in per cent", pd.DataFrame(rows).set_index(["set", "recorded and free"]))
    one = lateral["T1"]
    for case, low, high in (
        ("yaw rate", 2.0, 80.0),
        ("yaw rate and sideslip", 1.2, 7.6),
        ("yaw rate, lambda_33 given", 1.2, 23.0),
    ):
        # the period of the reference's square wave is not on record
        checks.near(f"T1, {case}: least bound", min(one[case].values()), low, 0.2 * low, "%")
        checks.near(f"T1, {case}: largest bound", max(one[case].values()), high, 0.2 * high, "%")
    checks.at_least("T1: bound of lambda_35", one["yaw rate and sideslip, lambda_35 free"]["lambda_35"], 100.0, "%")
    moments = one["yaw rate and sideslip, lambda_55 free"]
    checks.at_least("T1, lambda_55 free: moment row", min(moments[q] for q in FREE["lateral"][4:]), 100.0, "%")
    two = lateral["T2"]
    forces = min(two["yaw rate"][q] for q in FREE["lateral"][:3])
    checks.at_least("T2, yaw rate: force coefficients", forces, 100.0, "%")
    largest = max(two["yaw rate and sideslip, lambda_33 given"].values())
    checks.at_most("T2, sideslip, lambda_33 given: largest bound", largest, 5.0, "%", 1.0)
    results.add_picture("lateral bounds", figures.lateral(lateral, FREE["lateral"]))


def _report_preparation(results: Results, ready: Mapping[str, Any], depth: Mapping[str, float]) -> None:
    true = truth("mixed 1")
    place = list(plans(T1)).index("mixed 1")
    log = sensors.logged(true, "T1", np.random.default_rng([SEED, place]))
    results.add_picture("preparation", figures.preparation(log, ready["mixed 1"], true))
    lines = [f"- {step.name}: {step.effect}" for step in ready["weave"].steps]
    results.add_text("Preparation of the run `weave`, as the trial itself records it:\n\n" + "\n".join(lines))
    best = min(value for name, value in depth.items() if name != "fused")
    results.add_figure(
        "depth: rms error after fusion",
        1e3 * depth["fused"],
        "mm",
        ", ".join(f"{name} {1e3 * value:.0f}" for name, value in depth.items() if name != "fused"),
        goal="below each source",
        met=depth["fused"] < best,
    )


def _report_runs(results: Results, held: Mapping[str, Mapping[str, float]]) -> None:
    """Which run tells which channel; None is a bound without limit."""
    table: Any = pd.DataFrame(
        {run: {c: math.inf if v is None else v for c, v in row.items()} for run, row in held.items()}
    )
    results.add_table("largest bound by run, per cent", table.T.rename_axis("run"))
    lines = ["| run | " + " | ".join(SEEN) + " |", "|---" * (len(SEEN) + 1) + "|"]
    lines += [
        f"| {run} | " + " | ".join(f"{table.loc[c, run]:.3g}" if table.loc[c, run] < 1e3 else "-" for c in SEEN) + " |"
        for run in table.columns
    ]
    results.add_text(
        "Largest Cramer-Rao bound among a channel's parameters (per cent of the tank's value, mass in surge given), by "
        "run; - is above 1000. Depth steps by a smooth controller do not tell the longitudinal channel, as the paper "
        "found; planes driven from side to side do.\n\n" + "\n".join(lines)
    )


def _report_decision(results: Results, apart: Mapping[str, Mapping[str, float]]) -> None:
    wanted = [name for name in apart if apart[name][JUDGED[name]] > DISAGREES]
    for name in apart:
        part = ", ".join(f"{output} {value:.3f}" for output, value in apart[name].items())
        said = "needs identification" if name in wanted else "agrees"
        results.add_figure(
            f"open loop of the {name} channel, tank's values",
            apart[name][JUDGED[name]],
            f"of the spread of {JUDGED[name]}",
            f"{said} (limit {DISAGREES:g} [S]); {part}",
        )


def _report_fits(results: Results, fits: Mapping[str, Any], whole: Mapping[str, Any]) -> None:
    rows = []
    for name, ways in fits.items():
        for way, found in ways.items():
            for q, value in found["value"].items():
                rows.append({"fit": f"{name}, {way}", "parameter": q, "truth": TRUTH[q], **_line(found, q, value)})
        damped, undamped = ways["damped"], ways["undamped"]
        results.add_figure(
            f"{name}: steps of damped Newton from the tank's values",
            damped["steps"],
            "steps",
            f"undamped as published: {undamped['code']} after {undamped['steps']} ({undamped['reason']})",
        )
    for q, value in whole["value"].items():
        rows.append({"fit": "all at once", "parameter": q, "truth": TRUTH[q], **_line(whole, q, value)})
    table = pd.DataFrame(rows).set_index(["fit", "parameter"])
    results.add_table("estimates", table)
    weak = [q for q, said in whole["verdict"].items() if said != "identified"]
    results.add_figure(
        "all at once: parameters called identified",
        len(whole["value"]) - len(weak),
        f"of {len(whole['value'])}",
        f"{whole['steps']} steps of damped Newton; not: "
        f"{', '.join(f'{q} (true value {TRUTH[q]:g})' for q in weak) or 'none'}",
    )


def _line(found: Mapping[str, Any], q: str, value: float) -> dict[str, Any]:
    error = 100.0 * (value / TRUTH[q] - 1.0) if TRUTH[q] else math.nan
    part = {key: found[key][q] for key in ("start", "stderr", "verdict")}
    return {"value": value, "error, %": error, **part}


def _report_validation(results: Results, loops: Mapping[str, Any]) -> None:
    rows: list[dict[str, Any]] = []
    for run, found in loops.items():
        for way in ("tank", "channels", "all at once"):
            row: dict[str, Any] = {"run": run, "values": way}
            for name in (*system.FULL_SEEN, "z"):
                gap = np.array(found[way][name], dtype=float) - np.array(found["measured"][name], dtype=float)
                row[name] = float(np.sqrt(np.nanmean(gap**2))) if np.isfinite(gap).any() else math.inf
            rows.append(row)
    run = next(iter(loops))
    results.add_picture("validation", figures.validation(run, loops[run]))
    table: Any = pd.DataFrame(rows).set_index(["run", "values"])
    results.add_table("validation", table)
    mean = (table**2).groupby("values").mean() ** 0.5
    for name, factor, unit in (
        ("u", 1.0, "m/s"), ("r", 1 / sensors.DEGREE, "deg/s"), ("psi", 1 / sensors.DEGREE, "deg"),
        ("theta", 1 / sensors.DEGREE, "deg"), ("z", 1.0, "m"),
    ):  # fmt: skip
        before, channels, after = (factor * float(mean.loc[way, name]) for way in ("tank", "channels", "all at once"))
        results.add_figure(
            f"unfitted runs: rms error of {name}, channel by channel",
            channels,
            unit,
            f"tank's values {before:.3g}, all at once {after:.3g}; measurement noise included",
            goal="below the tank's",
            met=channels < before,
        )


def _report_starts(results: Results, tries: Sequence[Mapping[str, Any]]) -> None:
    rows: Any = pd.DataFrame(tries)
    results.add_table("starts", rows.set_index(["channel", "start", "way"]))
    for name in SEEN:
        own = rows[rows.channel == name]
        damped, undamped = own[own.way == "damped"], own[own.way == "undamped"]
        results.add_figure(
            f"{name}: starts 20 to 40 % off that damped Newton brings home",
            int(damped.reached.sum()),
            f"of {len(damped)}",
            f"undamped {int(undamped.reached.sum())}; median steps {damped.steps.median():.0f} and "
            f"{undamped.steps.median():.0f}",
            goal="all",
            met=bool(damped.reached.all()),
        )


def _report_seeds(
    results: Results, errors: Sequence[Mapping[str, Any]], loose: Sequence[Mapping[str, Any]] | None
) -> None:
    rows = _judged(errors)
    results.add_table("noise runs", rows.set_index(["way", "parameter", "seed"]))
    table = rows.pivot_table(index="parameter", columns="kind", values="square", aggfunc="mean", sort=False) ** 0.5
    order = [q for name in FREE for q in FREE[name] if q in table.index]
    table = table.loc[order, ["own data", "channel by channel", "all at once"]]
    bound = rows.groupby(["kind", "parameter"])["bound"].first().unstack(0)
    full = table.join(bound.add_suffix(", bound")).assign(truth=pd.Series(TRUTH))
    results.add_table("error over bound", full.rename_axis("parameter"))
    results.add_picture("error over bound", figures.ratios(table))
    count = int(rows.seed.nunique())
    for kind in table.columns:
        part = rows[rows.kind == kind]
        ratio, covered = math.sqrt(float(part.square.mean())), 100.0 * float(part.covered.mean())
        judged, enough = kind != "channel by channel", count >= 20
        note = f"{count} seeds; largest single {table[kind].max():.2f} ({table[kind].idxmax()})"
        if not judged:
            note += "; its inputs are noisy recorded motions, and what couples the channels is left out"
        results.add_figure(
            f"{kind}: rms error over the Cramer-Rao bound", ratio, "1", note, goal="<= 1.2", met=bool(ratio <= 1.2)
        )
        results.add_figure(
            f"{kind}: coverage of 95 % intervals",
            covered,
            "%",
            f"{len(part)} intervals" + ("" if enough else "; too few seeds to judge"),
            goal="92 to 98",
            met=bool(92.0 <= covered <= 98.0) if enough else None,
        )
    if loose is not None:
        noisy = _judged(loose)
        part = noisy[noisy.kind == "all at once"]
        results.add_figure(
            f"all at once, fins read to {sensors.LOOSE_FIN / sensors.DEGREE:g} deg: the same ratio",
            math.sqrt(float(part.square.mean())),
            "1",
            f"{noisy.seed.nunique()} seeds; {sensors.FIN_NOISE / sensors.DEGREE:g} deg above; coverage "
            f"{100 * part.covered.mean():.0f} %: noise in the inputs is not in the bound",
        )


def _judged(errors: Sequence[Mapping[str, Any]]) -> Any:
    rows: Any = pd.DataFrame(errors)
    kinds = {"own": "own data", "channel": "channel by channel"}
    rows["kind"] = [kinds.get(way.split()[0], way) for way in rows.way]
    rows["square"] = (rows.error / rows.bound) ** 2
    return rows


def _sets(fits: Mapping[str, Any], whole: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Values of the coupled model: the tank's, with the channels' put in, with those found at once."""
    tank = {**TRUTH, **system.tank(TRUTH)}
    channels = dict(tank)
    for name in fits:
        channels |= fits[name]["damped"]["value"]
    return {"tank": tank, "channels": channels, "all at once": tank | whole["value"]}


if __name__ == "__main__":
    sys.exit(main("zhao2018", str(__doc__).splitlines()[0], body, seeds={"noise and starts": SEED}))
