"""What does a diagnosis cost? Processor seconds, time and peak memory, each in a process of its own.

    python experiments/diagnosis_speed.py [--quick] [--workers N]

* The demo: everything that `seatruth demo` does (imports, identification, diagnosis, reports), on the embedded
  synthetic trials; once with no compiled kernels on disk, then as every later time.
* Eight trials of 600 samples each, synthetic: zigzags, turning circles and speed steps of the embedded sample's ship,
  whose rudder has an offset of half a degree. 12 coefficients are free, and the whole library of effects takes part.
  The same of two and of four of these trials, and of eight with three effects, show what the time grows with.
  `--quick` takes two trials of 120 samples and three effects, and runs the demo once.

Processor time counts all threads; the time on the clock is judged only where the machine had two free cores.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import psutil
from common import COLOURS, Options, Results, main
from provenance import ROOT, cores, machine

from seatruth import Study, diagnose
from seatruth.effects import load_effects, with_effects
from seatruth.errors import SeatruthError
from seatruth.manoeuvres import SpeedSteps, TurningCircle, Zigzag, add_noise, run_manoeuvre, self_propulsion
from seatruth.models import load_model
from seatruth.sample.make import MOVED, NOISE, RUDDER_RATE, SPEED, STEP, true_values
from seatruth.trials.trial import Trial, Trials

SEED = 20261122
OFFSET = math.radians(0.5)
CORES, GOAL_DEMO, GOAL_EIGHT, GOAL_MEMORY = 2, 10.0, 60.0, 600.0
TRIALS, SAMPLES = 8, 600
LOOK = 0.05
"""s between two looks at the memory of a process: a look takes some milliseconds. Chosen here."""
FEW = ("current", "rudder_offset", "rudder_gain")


def body(options: Options, results: Results) -> None:
    """The demo cold and warm, or cold alone, then the larger study; each figure with its goal."""
    kinds = ("no kernels on disk",) if options.quick else ("no kernels on disk", "kernels on disk")
    results.expect(len(kinds) + (1 if options.quick else 4))
    results.add_text(__doc__ or "")
    setting = {"machine": {k: v for k, v in machine().items() if k in ("cpu", "cores")}, "workers": options.workers}
    with tempfile.TemporaryDirectory() as cache:
        rows = {
            f"demo, {kind}": results.stage(f"demo, {kind}", setting, lambda: _measured("demo", {}, cache))
            for kind in kinds
        }
        small: dict[str, Any] = {"trials": 2, "samples": 120, "effects": FEW}
        whole: list[dict[str, Any]] = [{"trials": trials} for trials in (TRIALS // 4, TRIALS // 2, TRIALS)]
        for chosen in [small] if options.quick else [{"trials": TRIALS, "effects": FEW}, *whole]:
            order: dict[str, Any] = {"samples": SAMPLES, "effects": None, "workers": options.workers} | chosen
            label = f"{order['trials']} trials of {order['samples']} samples"
            label += f", {len(FEW)} effects" if order["effects"] else ""
            rows[label] = results.stage(label, setting | order, partial(_measured, "study", order, cache))
    results.add_picture("diagnosis_speed", picture(pd.DataFrame(rows).T, options.workers))
    for name, row in rows.items():
        goal = GOAL_DEMO if name.startswith("demo") else GOAL_EIGHT
        judged = goal == GOAL_DEMO or not options.quick
        free = cores() - row["load"] >= CORES
        note = row["said"] if free else f"the machine was busy (load {row['load']:.1f}), so the clock is not judged"
        results.add_figure(f"{name}: processor time", row["processor_s"], "s", row["said"])
        met = bool(row["wall_s"] <= goal) if free and judged else None
        results.add_figure(
            f"{name}: time", row["wall_s"], "s", note, goal=f"at most {goal:g} on {CORES} free cores", met=met
        )  # fmt: skip
        results.add_figure(
            f"{name}: peak memory", row["peak_MB"], "MB", "",
            goal=f"at most {GOAL_MEMORY:g}", met=bool(row["peak_MB"] <= GOAL_MEMORY),
        )  # fmt: skip
    results.add_table("diagnosis_speed", pd.DataFrame(rows).T.rename_axis("what"))


def picture(table: pd.DataFrame, workers: int) -> Any:
    """Processor time, time and peak memory of each task; dashed: what the time and the memory may be."""
    import matplotlib.pyplot as plt

    y = np.arange(len(table))
    size = (9.0, 0.42 * len(table) + 1.3)
    figure, (left, right) = plt.subplots(1, 2, figsize=size, sharey=True, layout="constrained", width_ratios=(3, 2))
    spent, wall, peak = (table[key].astype(float) for key in ("processor_s", "wall_s", "peak_MB"))
    left.barh(y - 0.19, spent, 0.36, color=COLOURS[0], label="processor time, all threads")
    left.barh(y + 0.19, wall, 0.36, color=COLOURS[1], label=f"time on the clock, {workers} workers")
    right.barh(y, peak, 0.5, color=COLOURS[2], hatch="//", edgecolor="white", linewidth=0.0)
    for k, name in enumerate(table.index):
        most = GOAL_DEMO if str(name).startswith("demo") else GOAL_EIGHT
        left.plot([most, most], [k - 0.45, k + 0.45], color="black", ls="--", lw=1.2)
    left.plot([], [], color="black", ls="--", lw=1.2, label=f"goal: of the time on {CORES} free cores, of the memory")
    right.axvline(GOAL_MEMORY, color="black", ls="--", lw=1.2)
    left.set_yticks(y, list(table.index), fontsize=8)
    left.invert_yaxis()
    left.set_xlabel("time (s)")
    right.set_xlabel("peak memory (MB)")
    for axes in (left, right):
        axes.grid(True, axis="x", alpha=0.3)
        axes.set_axisbelow(True)
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    return figure


def _measured(what: str, order: Mapping[str, Any], cache: str) -> dict[str, Any]:
    """One task in a fresh process: its processor time, its time, its peak memory, and what was said.

    A study takes a copy of the folder of kernels, so that none finds those that another has compiled.
    """
    if what == "study":
        with tempfile.TemporaryDirectory() as own:
            shutil.copytree(cache, own, dirs_exist_ok=True)
            return _timed(what, order, own)
    return _timed(what, order, cache)


def _timed(what: str, order: Mapping[str, Any], cache: str) -> dict[str, Any]:
    load, began = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0, time.perf_counter()
    command = [sys.executable, "-c", f"import diagnosis_speed as it; it.work({what!r}, {json.dumps(order)!r})"]
    setting = {**os.environ, "SEATRUTH_CACHE": cache, "OMP_NUM_THREADS": "1"}
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as complaint:
        with subprocess.Popen(
            command, cwd=ROOT / "experiments", env=setting, stdout=said, stderr=complaint, text=True
        ) as task:  # fmt: skip
            most = peak_memory(task)
        wall = time.perf_counter() - began
        said.seek(0)
        complaint.seek(0)
        if task.returncode:
            raise SeatruthError(f"{what} failed: {complaint.read().strip().splitlines()[-1:]}")
        return {"wall_s": wall, "load": load, "peak_MB": most, **json.loads(said.read().splitlines()[-1])}


def peak_memory(task: subprocess.Popen[str]) -> float:
    """Most memory (MB) that a process and those that it starts hold at one time, looked at until it ends.

    Not `ru_maxrss` of its children: a child starts with all that its parent held, though it copies none of it.
    """
    most = 0.0
    first = psutil.Process(task.pid)
    while task.poll() is None:
        held = 0
        with suppress(psutil.Error):
            for one in [first, *first.children(recursive=True)]:
                with suppress(psutil.Error):
                    # What two processes share counts once, where the system says so.
                    held += getattr(one.memory_full_info(), "pss", 0) or one.memory_info().rss
        most = max(most, held / 1024.0**2)
        time.sleep(LOOK)
    return most


def work(what: str, order: str) -> None:
    """In a process of its own: does the task and prints what it took."""
    if what == "demo":
        from seatruth.commands.demo import demo

        with tempfile.TemporaryDirectory() as out:
            said = str(demo(out=Path(out), threads=CORES, quiet=True).data["diagnosis"]["verdict"]["sentence"])
    else:
        given = json.loads(order)
        found = diagnose(
            study(given["trials"], given["samples"]), given["effects"], threads=CORES, workers=given["workers"],
            suggest=False,
        )  # fmt: skip
        said = found.verdict.sentence
    # With the process that the demo identifies in, which has ended by now.
    print(json.dumps({"processor_s": sum(os.times()[:4]), "said": said}))


def study(trials: int, samples: int) -> Study:
    """Synthetic trials of the embedded sample's ship with a rudder offset; the model does not know of it."""
    rng = np.random.default_rng(SEED)
    plain = load_model("mmg")
    ship = with_effects(plain, load_effects(["rudder_offset"]))
    values = true_values(rng)
    n = round(self_propulsion(plain, SPEED, values), 2)
    values["rudder_offset_angle"] = OFFSET
    angles = [math.radians(angle) for angle in (10, 20, 15, 35)]
    sides: tuple[Literal["starboard", "port"], ...] = ("starboard", "port", "starboard", "port")
    plans = [
        (
            Zigzag(a, a, side, approach=5),
            TurningCircle(a, math.radians(540), approach=5),
            SpeedSteps((n, 0.7 * n), 40.0),
        )
        for a, side in zip(angles, sides)
    ]
    made: list[Trial] = []
    for k in range(trials):
        run = run_manoeuvre(
            ship, plans[k % len(plans)][k // len(plans) % 3], values, dt=STEP, inputs={"n": n}, rudder_rate=RUDDER_RATE,
            first_state={"u": SPEED, "psi": float(k)}, limit=(samples - 1) * STEP, name=f"run {k + 1}",
        )  # fmt: skip
        made.append(add_noise(run, NOISE, rng))
    parameters = tuple(p.replace(vary=p.name in MOVED) for p in plain.parameters)
    return Study("eight trials", plain, Trials(made), parameters=parameters, seed=SEED)


if __name__ == "__main__":
    sys.exit(main("diagnosis_speed", str(__doc__).splitlines()[0], body, seeds={"trials": SEED}))
