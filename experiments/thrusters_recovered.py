"""Are errors of thrusters named for what they are, with the size that was put in?

    python experiments/thrusters_recovered.py [--quick] [--few] [--workers THREADS]

The boat with two thrusters (`twin_thruster`) and the underwater vehicle with eight (`bluerov2_heavy`) run synthetic
trials: steps of single thrusters and of all, ahead and astern, with noise and with coefficients that differ from the
model's. One effect on thrusters at a time acts in them, at a size that such trials show well. Each study is diagnosed
with the whole library of effects, with some coefficients and all initial states free. On the boat the effects act on
both thrusters alike and on the port one alone; on the vehicle with eight in those forms that a diagnosis tries there,
and in one that it tries only where another fault of the same thruster leads. `--few` takes four effects
on the boat, `--quick` two of them, in short trials and among the effects on thrusters alone.

What is said of each:

- "right": it alone is named, or with what no trial can tell from it.
- "among look-alikes": it stands in a set of effects that these trials cannot tell apart.
- "right, and others": it is named, and further causes beside it.
- "another": something else is named.
- "unknown", "nothing", "undecided": no effect is named; a cause outside the library, no gap, too few data.
"""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from common import COLOURS, Options, Results, main

from seatruth import Diagnosis, Model, Study, TrajectoryOptions, Trial, Trials, diagnose, load_model, simulator
from seatruth.effects import Effect, available, load_effects, with_effects
from seatruth.manoeuvres import thruster_layout

SEED = 20261123
NOISE = {
    **dict.fromkeys("xyz", 0.1),
    **dict.fromkeys("uvw", 0.01),
    **dict.fromkeys(("phi", "theta", "psi"), math.radians(0.1)),
    **dict.fromkeys("pqr", math.radians(0.05)),
}
"""SI units, white: a basin's positions, a log, an inertial unit. [S]"""
OFF = 0.15
"""Largest relative difference of the true coefficients from the model's, as estimates for a hull have. [S]"""
MAX_STEP = 0.1
"""s, of the integration, in trials as in fits [S]. Water damps the boat's yaw within 0.1 s in a tight turn. One step a
sample (0.25 s) differs by up to nine standard deviations of the yaw rate from the shorter ones that the library takes,
and the diagnosis of such trials errs by five standard errors in the size."""
SIZES: Mapping[str, float] = {"battery_discharge": 3e-4}
"""Put in where it is not the typical size of the effect: in trials of a minute that of a discharge hardly shows."""
SECONDS, QUICK_SECONDS = 60.0, 24.0
FEW = ("thruster_gain_port", "thruster_dead_band", "thruster_lag_port", "thrusters_exchanged_port_starboard")
RIGHT, AMONG, BESIDE, ANOTHER = "right", "among look-alikes", "right, and others", "another"
NONE_NAMED = {"unknown": "unknown", "no_gap": "nothing", "underpowered": "undecided"}


@dataclasses.dataclass(frozen=True)
class Vehicle:
    """A vehicle: its trials' inputs, the outputs at their start, its free coefficients, and forms that are put in.

    `inputs(seconds)` gives time (s) and inputs by name of each trial. `single` names thrusters on which effects act
    alone, `pairs` those whose orders are exchanged, `further` forms that are tried only after others.
    """

    model: str
    inputs: Callable[[float], list[tuple[np.ndarray, dict[str, np.ndarray]]]]
    first: tuple[Mapping[str, float], ...]
    free: tuple[str, ...]
    single: tuple[str, ...]
    pairs: tuple[str, ...] = ()
    further: tuple[str, ...] = ()


def steps(t: np.ndarray, levels: Sequence[float], every: float) -> np.ndarray:
    """Levels held one after another, for `every` seconds each."""
    held: np.ndarray = np.take(np.asarray(levels), (t // every).astype(int) % len(levels))
    return held


def boat_inputs(seconds: float) -> list[tuple[np.ndarray, dict[str, np.ndarray]]]:
    """Revolutions of both propellers (rev/s) in steps, small and large, ahead and astern."""
    t = np.arange(0.0, seconds, 0.25)
    runs = (
        ((10.0, 6.0, 12.0, 3.0, 8.0), (10.0, 12.0, 4.0, 9.0)),
        ((9.0, -7.0, 1.5, -1.0, 13.0, 0.0), (7.0, 1.0, -1.2, 12.0, -9.0)),
        ((8.0, 8.0, 14.0, 14.0, 8.0, -4.0), (8.0, 5.0, 8.0, 14.0)),
    )
    return [(t, {"n_port": steps(t, port, 4.0), "n_starboard": steps(t, other, 5.0)}) for port, other in runs]


def rov_inputs(seconds: float) -> list[tuple[np.ndarray, dict[str, np.ndarray]]]:
    """Commands of eight thrusters: steps along the axes, each thruster alone for two seconds; a falling voltage."""
    layout = thruster_layout(load_model("bluerov2_heavy"), {"voltage": 16.0}, dead_band=0.07)
    t = np.arange(0.0, seconds, 0.1)
    runs = (
        {"surge": (0.1, 0.2, 0.05, -0.1, 0.15), "yaw": (0.01, -0.015, 0.0, 0.005), "heave": (0.05, -0.05, 0.0)},
        {"surge": (0.05, 0.15), "sway": (0.03, -0.05, 0.02), "heave": (0.08, -0.08), "yaw": (0.0, 0.01, -0.005)},
        {"surge": (0.2, -0.1, 0.1), "heave": (-0.05, 0.08, 0.0), "yaw": (-0.01, 0.01), "sway": (0.0, 0.05)},
    )
    found = []
    for number, axes in enumerate(runs):
        held = {axis: steps(t, levels, 3.0 + k) for k, (axis, levels) in enumerate(axes.items())}
        orders = [layout.orders({axis: float(levels[j]) for axis, levels in held.items()}) for j in range(t.size)]
        inputs = {name: np.array([row[name] for row in orders]) for name in layout.full}
        for k, name in enumerate(inputs):
            inputs[name] = inputs[name] + 0.1 * ((t > 2.0 + 4.5 * k) & (t < 4.0 + 4.5 * k))
        found.append((t, {**inputs, "voltage": 16.0 - 0.02 * t - 0.5 * number}))
    return found


BOAT = Vehicle(
    "twin_thruster",
    boat_inputs,
    ({"psi": 0.3, "u": 0.8}, {"psi": 2.4, "u": 0.3}, {"psi": 4.0, "u": 1.5}),
    free=("X_u", "N_r", "N_rr", "C_d"),
    single=("port",),
    pairs=("thrusters_exchanged_port_starboard",),
)
ROV = Vehicle(
    "bluerov2_heavy",
    rov_inputs,
    ({"psi": 0.3, "u": 0.2, "z": 3.0}, {"psi": 2.4, "u": 0.2, "z": 8.0}, {"psi": 4.0, "u": 0.2, "z": 15.0}),
    free=("X_uu", "Y_vv", "Z_ww", "N_rr"),
    single=("front_port", "up_rear_starboard"),
    pairs=("thrusters_exchanged_front_starboard_front_port",),
    further=("thruster_lag_front_port",),
)


def forms(vehicle: Vehicle) -> list[Effect]:
    """The effects that are put in: on all thrusters alike, on single ones, on pairs."""
    model = load_model(vehicle.model)
    tried = [
        form
        for effect in available().values()
        if effect.actuator == "thruster"
        for form in effect.candidates(model)
        if not form.missing(model)
        and (not form.which or form.name in vehicle.pairs or form.which in {(name,) for name in vehicle.single})
    ]
    return [*tried, *load_effects(vehicle.further, model=model)]


def size(effect: Effect, model: Model) -> float:
    """What is put in of an effect's only parameter."""
    (parameter,) = effect.parameters
    return SIZES.get(effect.name, effect.typical(model)[parameter.name])


def true_coefficients(vehicle: Vehicle) -> dict[str, float]:
    """Values of the free coefficients that the trials have."""
    rng, nominal = np.random.default_rng(SEED), load_model(vehicle.model).nominal()
    return {name: nominal[name] * (1.0 + OFF * float(rng.uniform(-1.0, 1.0))) for name in vehicle.free}


def trials(vehicle: Vehicle, effect: Effect, seconds: float) -> Trials:
    """The vehicle's runs with one effect and noise; the noise is the same with every effect."""
    plain = load_model(vehicle.model)
    model = with_effects(plain, [effect])
    (parameter,) = effect.parameters
    truth = model.nominal() | true_coefficients(vehicle) | {effect.named(parameter.name): size(effect, plain)}
    rng, found = np.random.default_rng(SEED + 1), []
    for number, ((t, inputs), first) in enumerate(zip(vehicle.inputs(seconds), vehicle.first), 1):
        started = {c.name: np.full(t.size, first.get(c.name, 0.0)) for c in plain.outputs}
        bare = Trial(f"run {number}", t, inputs, started, synthetic=True)
        sim = simulator(model, [bare], values=truth, max_step=MAX_STEP)
        y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
        noisy = {c.name: y[:, k] + rng.normal(0.0, NOISE[c.name], t.size) for k, c in enumerate(plain.outputs)}
        found.append(dataclasses.replace(bare, outputs=noisy))
    return Trials(found)


def case(vehicle: Vehicle, name: str, seconds: float, library: Sequence[str] | None, threads: int) -> dict[str, Any]:
    """One row: what was put in, what was named, the size found, and the processor's time."""
    model = load_model(vehicle.model)
    (effect,) = load_effects([name], model=model)
    free = tuple(q.replace(vary=q.name in vehicle.free) for q in model.parameters)
    noise = {channel.name: NOISE[channel.name] for channel in model.outputs}
    cost = TrajectoryOptions(initial="free", max_step=MAX_STEP)
    runs = trials(vehicle, effect, seconds)
    study = Study(vehicle.model, model, runs, parameters=free, noise=noise, cost=cost, seed=SEED)
    began = time.process_time()
    found = diagnose(study, library, threads=threads, suggest=False)
    spent = time.process_time() - began
    named = [" or ".join(cause.effects) for cause in found.verdict.causes]
    tried = [one for one in found.effects if one.name == name and one.parameters]
    value, lower, upper = (
        (getattr(tried[0].parameters[0], field) if tried else math.nan) for field in ("value", "lower", "upper")
    )
    return {
        "effect": name,
        "tried": name in {one.name for one in found.effects},
        "put in": size(effect, model),
        "unit": effect.parameters[0].unit,
        "said": said(found, effect),
        "named": ", ".join(named),
        "probability": found.verdict.probability,
        "found": value,
        "lower": lower,
        "upper": upper,
        "cpu_s": spent,
    }


def said(found: Diagnosis, effect: Effect) -> str:
    """What a diagnosis says of the effect that acts, in the words of this experiment."""
    causes = [set(cause.effects) for cause in found.verdict.causes]
    if not causes:
        return NONE_NAMED.get(found.verdict.kind, found.verdict.kind)
    same = {effect.name} | (set() if effect.which else set(effect.equivalent))
    if not any(cause & same for cause in causes):
        return ANOTHER
    if len(causes) > 1:
        return BESIDE
    return RIGHT if causes[0] <= same else AMONG


def picture(table: pd.DataFrame) -> Any:
    """How far each size that was found is from the one put in, with its 95 % interval; and twenty times closer."""
    import matplotlib.pyplot as plt

    named = table["said"] == RIGHT
    off, below, above = (
        100.0 * (table[key].astype(float) / table["put in"] - 1.0) for key in ("found", "lower", "upper")
    )
    most = 1.1 * max(1.0, float(np.nanmax(np.abs([below, above]))) if below.notna().any() else 1.0)
    size = (9.0, 0.19 * len(table) + 1.3)
    figure, panels = plt.subplots(1, 2, figsize=size, sharey=True, layout="constrained")
    vehicles = list(dict.fromkeys(table["vehicle"]))
    for axes, widest in zip(panels, (most, most / 20.0), strict=True):
        axes.axvline(0.0, color="black", lw=1, ls="--", zorder=1)
        for k in range(len(table)):
            at = vehicles.index(table["vehicle"].iloc[k])
            colour, marker = COLOURS[(0, 3)[at % 2]], "oD"[at % 2]
            ends = sorted((below.iloc[k], above.iloc[k]))
            axes.plot(ends, [k, k], color=colour, lw=1.6, zorder=2)
            fill = colour if named.iloc[k] else "white"
            axes.plot([off.iloc[k]], [k], marker, color=colour, mfc=fill, ms=4.5, zorder=3)
        axes.set_xlim(-widest, widest)
        axes.set_xlabel("size found, less that put in (% of it)")
        axes.grid(True, alpha=0.3)
    panels[1].set_title("the same, twenty times closer", fontsize=9)
    panels[0].set_yticks(range(len(table)), [str(name).replace("_", " ") for name in table["effect"]], fontsize=8)
    panels[0].set_ylim(len(table) - 0.4, -0.6)
    for at, vehicle in enumerate(vehicles):
        label = f"{vehicle}: named alone, 95 % interval"
        panels[0].plot([], [], f"{'oD'[at % 2]}-", color=COLOURS[(0, 3)[at % 2]], ms=5, label=label)
    if not named.all():
        panels[0].plot([], [], "o", color="0.3", mfc="white", ms=5, label="anything else was said")
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False, title="Synthetic trials")
    return figure


def body(options: Options, results: Results) -> None:
    """Every effect on every vehicle; a table, and how many are right."""
    results.add_text(str(__doc__))
    few = options.quick or options.asked("few")
    seconds = QUICK_SECONDS if options.quick else SECONDS
    chosen = [(BOAT, name) for name in (FEW[:2] if options.quick else FEW)]
    if not few:
        chosen = [(vehicle, form.name) for vehicle in (BOAT, ROV) for form in forms(vehicle)]
    library = [form.name for form in forms(BOAT)] if options.quick else None
    results.expect(len(chosen))
    rows = []
    for vehicle, name in chosen:
        setting = {"vehicle": vehicle.model, "effect": name, "seconds": seconds, "library": library, "seed": SEED}
        work = partial(case, vehicle, name, seconds, library, options.workers)
        rows.append({"vehicle": vehicle.model, **results.stage(f"{vehicle.model} {name}", setting, work)})
    table = pd.DataFrame(rows)
    results.add_table("thrusters_recovered", table)
    results.add_picture("sizes", picture(table))
    for model, own in table.groupby("vehicle", sort=False):
        for words in dict.fromkeys((RIGHT, AMONG, BESIDE, ANOTHER, *NONE_NAMED.values(), *own["said"])):
            results.add_figure(f"{model}: {words}", int((own["said"] == words).sum()), "1", f"of {len(own)} effects")
        fitted = own[np.isfinite(own["lower"].astype(float))]
        inside = (fitted["lower"] <= fitted["put in"]) & (fitted["put in"] <= fitted["upper"])
        results.add_figure(f"{model}: 95 % intervals that hold the size", int(inside.sum()), "1", f"of {len(fitted)}")
    for row in rows:
        note = f"{row['said']}: {row['named'] or 'no effect'}"
        results.add_figure(f"{row['vehicle']}, {row['effect']}: size found", row["found"], row["unit"], note)


if __name__ == "__main__":
    sys.exit(
        main(
            "thrusters_recovered",
            str(__doc__).splitlines()[0],
            body,
            seeds={"coefficients": SEED, "noise": SEED + 1},
            switches={"few": "four effects on the boat alone"},
        )
    )
