"""One vehicle four ways: as built-in model, as a user's model file, as black box and as FMU, with the cost of each.

    python experiments/one_vehicle_four_ways.py [--quick] [--workers PROCESSES]

The ship is KVLCC2's model of 7 m under the MMG standard method (Yasukawa and Yoshimura 2015). Its trials are synthetic:
zigzags and turns of the built-in model with other coefficients and white noise. First five coefficients are identified
from trials on which nothing else acts; then trials with a current, of which the model knows nothing, are diagnosed with
the whole library of effects. All four ways are to give the same answer within the tolerances stated below. Built-in and
as black box it is diagnosed once more with two effects to choose from, of which none acts: unknown causes cost more.
The black box is plain Python that integrates by itself; the FMU is compiled from C (fmu_ship/), which holds the
equations a second time. Both run in processes of their own, take outside forces and a current through ports, and keep
no run on disk. How many evaluations an identification takes is measured for several solvers on the built-in model,
whose counts are those of any other.
"""

from __future__ import annotations

import dataclasses
import math
import os
import resource
import tempfile
import time
from collections import namedtuple
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import pandas as pd
from common import COLOURS, Options, Results, main
from fmu_ship.build import build

from seatruth import (
    BlackBox,
    Budget,
    IsolatedBlackBox,
    Model,
    Study,
    TrajectoryOptions,
    Trial,
    Trials,
    diagnose,
    identify,
    load_fmu,
    load_model,
    minimise,
    simulator,
)
from seatruth.costs import cost_of
from seatruth.effects import dimensions_of, load_effects, with_effects
from seatruth.models import Environment
from seatruth.models.mmg import motion

SEED = 20260401
WAYS = ("built-in", "user's file", "black box", "FMU")
FREE = ("R_0", "Y_v", "N_v", "Y_r", "N_r")
NOISE = {"x": 0.05, "y": 0.05, "psi": 0.003, "u": 0.01, "v": 0.005, "r": 0.0008}
"""m, rad, m/s, rad/s: GNSS with corrections, a gyro, a log. [S]"""
PORTS = {"force": ["X", "Y", "N"], "current": ["north", "east"]}
CURRENT = (0.10, -0.08)
"""m/s, north and east: a tenth of the ship's speed. [S]"""
SAME_ESTIMATE = 0.25
"""Largest difference of two estimates, in standard errors, that counts as the same. [S] Inputs that are held over a
step of the FMU differ from straight lines by that much."""
SAME_SIZE, SAME_COURSE = 0.02, 1.0
"""The same of the current's speed (part of it) and of its direction (deg). [S]"""
SOLVERS = ("secant", "least_squares", "nelder_mead", "cma_es")
ELSE = ("rudder_offset", "gyro_bias")
"""What a diagnosis may choose from where the cause is to be outside its library. [S]"""
CLOSE = 0.5
"""Cost (nats) above the best known at which a search has arrived: one standard error in one direction. [S]"""


def trials(free: Sequence[str], effects: Mapping[str, float], *, seconds: float, count: int) -> Trials:
    """Zigzags and turns of the true ship with noise, samples of 1 s."""
    ship = load_model("mmg")
    truth = {**ship.nominal(), **true_coefficients(free), **effects}
    model = with_effects(ship, load_effects(["current"])) if effects else ship
    rng, found = np.random.default_rng(SEED), []
    for number, (angle, period) in enumerate([(20.0, 40.0), (-12.0, 60.0), (30.0, 300.0), (15.0, 50.0)][:count]):
        t = np.arange(0.0, seconds, 1.0)
        delta = np.radians(angle) * np.clip(3.0 * np.sin(2.0 * np.pi * t / period), -1.0, 1.0)
        inputs = {"delta": delta, "n": np.full(t.size, 10.4)}
        bare = Trial(f"run {number + 1}", t, inputs, {"u": np.full(t.size, 1.0), "psi": np.full(t.size, 0.7 * number)})
        sim = simulator(model, [bare], values=truth)
        y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
        outputs = {c.name: y[:, k] + rng.normal(0.0, NOISE[c.name], t.size) for k, c in enumerate(ship.outputs)}
        found.append(dataclasses.replace(bare, outputs=outputs, synthetic=True))
    return Trials(found)


def true_coefficients(free: Sequence[str]) -> dict[str, float]:
    """Values that differ from the model's by up to 15 %, as estimates for a hull do. [S]"""
    rng, nominal = np.random.default_rng(SEED + 1), load_model("mmg").nominal()
    return {name: nominal[name] * (1.0 + 0.15 * float(rng.uniform(-1.0, 1.0))) for name in free}


def vehicle(way: str, folder: Path) -> Model:
    """The ship, one of four ways."""
    ship = load_model("mmg")
    if way == "built-in":
        return ship
    if way == "user's file":
        return load_model("one_vehicle_user_model.py:UserShip", Path(__file__).parent)
    if way == "black box":
        box = BlackBox(
            "python_ship",
            simulate,
            inputs=ship.inputs,
            outputs=ship.outputs,
            parameters=ship.parameters,
            states=ship.states,
            kind="ship",
            ports=PORTS,
            dimensions=dimensions_of(ship),
        )
        return IsolatedBlackBox(box)
    fmu = folder / "ship.fmu"
    return load_fmu(fmu if fmu.exists() else build(fmu), ports=PORTS, kind="ship", dimensions=dimensions_of(ship))


def simulate(trial: Trial, p: dict[str, float], first: dict[str, float], outside: Any) -> dict[str, Any]:
    """What a user's own simulator does: Runge-Kutta steps of half a second, plain Python."""
    states = [channel.name for channel in load_model("mmg").states]
    State = cast(Any, namedtuple("State", states))
    parameters = cast(Any, namedtuple("Parameters", list(p)))(**p)
    t, delta, n = trial.t.tolist(), trial.inputs["delta"].tolist(), trial.inputs["n"].tolist()

    def rates(time: float, k: int, share: float, x: Sequence[float]) -> tuple[float, ...]:
        s = State(*x)
        f = outside(time, s._asdict())
        north, east = f["north"], f["east"]
        u_c = north * math.cos(s.psi) + east * math.sin(s.psi)
        v_c = east * math.cos(s.psi) - north * math.sin(s.psi)
        e = Environment(
            u_c=u_c, v_c=v_c, du_c=s.r * v_c, dv_c=-s.r * u_c, X=f["X"], Y=f["Y"], N=f["N"]
        )  # a steady current turns in body axes with the ship
        rudder, revolutions = (a[k] + share * (a[k + 1] - a[k]) for a in (delta, n))
        return motion(s, rudder, revolutions, parameters, e)

    x = tuple(first[name] for name in states)
    rows = [x]
    for k in range(len(t) - 1):
        h = 0.5 * (t[k + 1] - t[k])
        for half in (0.0, 0.5):
            time = t[k] + 2.0 * half * h
            k1 = rates(time, k, half, x)
            k2 = rates(time + h / 2, k, half + 0.25, [a + h / 2 * b for a, b in zip(x, k1)])
            k3 = rates(time + h / 2, k, half + 0.25, [a + h / 2 * b for a, b in zip(x, k2)])
            k4 = rates(time + h, k, half + 0.5, [a + h * b for a, b in zip(x, k3)])
            x = tuple(a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(x, k1, k2, k3, k4))
        rows.append(x)
    return {name: np.array(rows)[:, column] for column, name in enumerate(states)}


def study(model: Model, runs: Trials, free: Sequence[str]) -> Study:
    """The study of one way: coefficients start at the model's values, between half and one and a half of them."""
    parameters = []
    for q in model.parameters:
        low, high = sorted((0.5 * q.value, 1.5 * q.value))
        parameters.append(dataclasses.replace(q, vary=True, min=low, max=high) if q.name in free else q)
    cost = TrajectoryOptions(initial="free")
    return Study("ship", model, runs, parameters=tuple(parameters), noise=NOISE, cost=cost, seed=SEED)


def cost_so_far(model: Model) -> dict[str, float]:
    """Processor seconds of this process and of the simulator's, and runs of the simulator."""
    box = model if isinstance(model, IsolatedBlackBox) else None
    own = resource.getrusage(resource.RUSAGE_SELF)
    spent = own.ru_utime + own.ru_stime
    return {
        "cpu_s": spent + (box.counts.cpu_s if box else 0.0),
        "runs": float(box.counts.simulated) if box else math.nan,
        "wall_s": time.perf_counter(),
    }


def spent(model: Model, before: Mapping[str, float]) -> dict[str, float]:
    """What was spent since."""
    now = cost_so_far(model)
    return {key: now[key] - before[key] for key in now}


def identified(way: str, folder: Path, runs: Trials, free: Sequence[str], workers: int) -> dict[str, Any]:
    """Estimates with standard errors, and what they cost."""
    model = vehicle(way, folder)
    before = cost_so_far(model)
    found = identify(study(model, runs, free), "secant", threads=workers)
    table = found.parameters
    return {
        "values": {name: float(table["value"][name]) for name in free},
        "stderr": {name: float(table["stderr"][name]) for name in free},
        "code": found.outcome["code"],
        "evaluations": found.outcome["evaluations"],
        **spent(model, before),
    }


def diagnosed(
    way: str, folder: Path, runs: Trials, free: Sequence[str], effects: Sequence[str] | None, workers: int
) -> dict[str, Any]:
    """The verdict, the current, and what they cost."""
    model = vehicle(way, folder)
    before = cost_so_far(model)
    found = diagnose(study(model, runs, free), effects, threads=workers, suggest=False, validate=False)
    size = {q.name: q.value for effect in found.effects if effect.name == "current" for q in effect.parameters}
    north, east = size.get("north", math.nan), size.get("east", math.nan)
    return {
        "kind": found.verdict.kind,
        "named": list(found.named) or list(found.verdict.members),
        "speed": math.hypot(north, east),
        "towards": math.degrees(math.atan2(east, north)),
        "best": [[list(key), probability] for key, probability in found.answers()[:3]],
        "effects": len(found.effects),
        "evaluations": found.outcome["evaluations"],
        **spent(model, before),
    }


def counted(count: int, initial: Literal["fixed", "free"], runs: Trials, seed: int) -> list[dict[str, Any]]:
    """Evaluations of each solver for the first `count` coefficients: until it ends, and until it is near the best."""
    free = (*FREE, "X_vr")[:count]
    one = study(load_model("mmg"), runs, free).replace(cost=TrajectoryOptions(initial=initial))
    found = {}
    for solver in SOLVERS if initial == "fixed" else SOLVERS[:2]:
        found[solver] = minimise(cost_of(one), solver, budget=Budget(4000), seed=seed)
    best = min(outcome.value for outcome in found.values())
    rows = []
    for solver, outcome in found.items():
        near = outcome.history.loc[outcome.history["best"] <= best + CLOSE, "evaluations"]
        rows.append(
            {
                "parameters": count,
                "initial states": initial,
                "solver": solver,
                "evaluations": outcome.evaluations,
                "until near": float(near.iloc[0]) if len(near) else math.nan,
                "end": outcome.code,
            }
        )
    return rows


def body(options: Options, results: Results) -> None:
    """Identification and diagnosis each way, and the solvers."""
    os.environ["SEATRUTH_CACHE"] = "off"  # every run is to be made, and counted
    seconds, count = (40.0, 2) if options.quick else (150.0, 3)
    free, effects = (FREE[:2], ["current", "rudder_offset"]) if options.quick else (FREE, None)
    workers = min(options.workers, 2)
    results.expect(2 * len(WAYS) + (1 if options.quick else 3))
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        calm = trials(free, {}, seconds=seconds, count=count)
        current = {"current_north": CURRENT[0], "current_east": CURRENT[1]}
        moved = trials(free[:3], current, seconds=seconds, count=count)
        what = {"seconds": seconds, "count": count, "free": free, "effects": effects, "seed": SEED, "workers": workers}
        estimates = {
            way: results.stage(f"identify {way}", what, partial(identified, way, folder, calm, free, workers))
            for way in WAYS
        }
        verdicts = {
            way: results.stage(
                f"diagnose {way}", what, partial(diagnosed, way, folder, moved, free[:3], effects, workers)
            )
            for way in WAYS
        }
        unknown = {
            way: results.stage(
                f"diagnose {way}, cause not in the library",
                {**what, "effects": ELSE},
                partial(diagnosed, way, folder, moved, free[:3], ELSE, workers),
            )
            for way in (() if options.quick else (WAYS[0], WAYS[2]))
        }
    sizes: tuple[tuple[int, Literal["fixed", "free"]], ...]
    sizes = ((4, "fixed"),) if options.quick else ((4, "fixed"), (5, "fixed"), (6, "fixed"), (5, "free"))
    rows = results.stage("solvers", what, lambda: [row for k, i in sizes for row in counted(k, i, calm, SEED)])
    report(results, estimates, verdicts, free)
    for way, found in unknown.items():
        said = found["kind"] == "unknown"
        note = f"{found['kind']}, {found['evaluations'] or 'no'} evaluations counted, {found['cpu_s']:.0f} s"
        results.add_figure(f"cause not in the library called so, {way}", float(said), "1", note, goal="yes", met=said)
    results.add_table("evaluations of solvers", pd.DataFrame(rows))
    for row in rows:
        name = f"{row['solver']}, {row['parameters']} parameters, initial states {row['initial states']}"
        results.add_figure(f"evaluations, {name}", row["evaluations"], "1", f"ended: {row['end']}")


def report(results: Results, estimates: Mapping[str, Any], verdicts: Mapping[str, Any], free: Sequence[str]) -> None:
    """Figures, tables and the picture."""
    first, rows = estimates[WAYS[0]], []
    truth = true_coefficients(free)
    for way in WAYS:
        found, verdict = estimates[way], verdicts[way]
        apart = max(abs(found["values"][n] - first["values"][n]) / first["stderr"][n] for n in free)
        off = max(abs(found["values"][n] - truth[n]) / found["stderr"][n] for n in free)
        goal = f"<= {SAME_ESTIMATE}"
        results.add_figure(f"estimates apart, {way}", apart, "standard errors", goal=goal, met=apart <= SAME_ESTIMATE)
        results.add_figure(f"farthest from the truth, {way}", off, "standard errors")
        base = verdicts[WAYS[0]]
        course = abs((verdict["towards"] - base["towards"] + 180.0) % 360.0 - 180.0)
        same = verdict["named"] == base["named"] and verdict["kind"] == base["kind"]
        near = abs(verdict["speed"] / base["speed"] - 1.0) <= SAME_SIZE and course <= SAME_COURSE
        results.add_figure(
            f"same diagnosis, {way}",
            float(same and near),
            "1",
            f"{verdict['kind']}: {', '.join(verdict['named'])}, {verdict['speed']:.4f} m/s towards "
            f"{verdict['towards']:.1f} deg (put in {math.hypot(*CURRENT):.4f} m/s towards "
            f"{math.degrees(math.atan2(CURRENT[1], CURRENT[0])):.1f} deg)",
            goal="the same cause, speed within 2 %, direction within 1 deg",
            met=same and near,
        )
        for what, entry in (("identify", found), ("diagnose", verdict)):
            rows.append(
                {"way": way, "stage": what, **{k: entry[k] for k in ("evaluations", "runs", "cpu_s", "wall_s")}}
            )
            results.add_figure(f"processor time, {what}, {way}", entry["cpu_s"], "s")
            if entry["evaluations"] is not None:
                results.add_figure(f"evaluations, {what}, {way}", entry["evaluations"], "1")
    table = pd.DataFrame(rows)
    results.add_table("cost of each way", table)
    results.add_table(
        "estimates",
        pd.DataFrame(
            [
                {
                    "way": way,
                    "parameter": n,
                    "value": estimates[way]["values"][n],
                    "stderr": estimates[way]["stderr"][n],
                }
                for way in WAYS
                for n in free
            ]
            + [{"way": "truth", "parameter": n, "value": truth[n], "stderr": math.nan} for n in free]
        ),
    )
    results.add_picture("one_vehicle_four_ways", picture(estimates, table, free))


def picture(estimates: Mapping[str, Any], table: pd.DataFrame, free: Sequence[str]) -> Any:
    """Errors of the estimates in standard errors, and processor seconds of each way."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    truth = true_coefficients(free)
    for place, way in enumerate(WAYS):
        found = estimates[way]
        errors = [(found["values"][n] - truth[n]) / found["stderr"][n] for n in free]
        at = np.arange(len(free)) + 0.16 * (place - 1.5)
        left.errorbar(at, errors, yerr=1.0, fmt="o", ms=4, color=COLOURS[place], label=way, capsize=2)
    left.axhline(0.0, color="black", lw=0.8)
    left.set_xticks(range(len(free)), free)
    left.set_ylabel("error [standard errors]")
    stages = ("identify", "diagnose")
    for place, way in enumerate(WAYS):
        own = table[table["way"] == way].set_index("stage")["cpu_s"]
        right.bar(np.arange(2) + 0.18 * (place - 1.5), [own[s] for s in stages], 0.17, color=COLOURS[place], label=way)
    right.set_xticks(range(2), stages)
    right.set_yscale("log")
    right.set_ylabel("processor time [s]")
    right.legend(fontsize=8, loc="upper left")
    figure.suptitle("One vehicle four ways (synthetic trials)", fontsize=10)
    return figure


if __name__ == "__main__":
    raise SystemExit(
        main(
            "one_vehicle_four_ways",
            "One vehicle as built-in model, user's file, black box and FMU: the same answers, and the cost of each.",
            body,
            seeds={"trials": SEED},
        )
    )
