"""The Petrel-II glider of Sun, Wang and Sang 2019: its runs, its closed forms, its studies.

Tags: [P] printed in the paper, [R] reconstructed, [L] other literature, [S] chosen here, [V] by independent code.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root

from seatruth import Parameter, Study, simulator
from seatruth.costs import cost_of
from seatruth.costs.options import TrajectoryOptions
from seatruth.effects import available as effects
from seatruth.effects import with_effects
from seatruth.manoeuvres import GlideSpiral, Sawtooth, Stepper, Trim, add_noise, run_manoeuvre, steady_current
from seatruth.models.glider import Glider
from seatruth.trials import Trial, Trials
from seatruth.uncertainty import correlated_pairs, covariance, strongly_correlated, verdict

Array = NDArray[np.float64]
PLANT = Glider()
TRUTH: dict[str, float] = PLANT.nominal()
IN_CURRENT = with_effects(PLANT, [effects()["current"]])
RUDDERS = (10.0, 20.0, 30.0)
"""deg, of the spirals."""
DIVE, CLIMB = Trim(0.5, 0.402), Trim(-0.5, 0.403)
DT = 0.25
"""s, steps of the simulations; the fastest mode decays at 5.1 /s."""
CURRENT = {"current_north": 0.10, "current_east": 0.15}
"""[S] m/s."""
KNOWN = TRUTH | CURRENT
MOVING = ("u", "v", "w", "p", "q", "r", "phi", "theta")

LONGITUDINAL = ("K_D0", "K_D", "K_L0", "K_alpha", "K_M0", "K_M", "K_q")
LATERAL = ("K_beta", "K_MR", "K_p", "K_MY", "K_r", "Y_delta")
HYDRODYNAMIC = (*LONGITUDINAL, *LATERAL)
"""Coefficients to identify; x_delta is geometry."""
ADDED = ("A_11", "A_22", "A_33", "A_44", "A_55", "A_66", "A_26")

NOISE = {
    **dict.fromkeys(("x", "y"), 5.0),
    "z": 0.05,
    **dict.fromkeys(("phi", "theta"), math.radians(0.2)),
    "psi": math.radians(0.5),
    **dict.fromkeys(("p", "q", "r"), math.radians(0.1)),
    **dict.fromkeys(("u", "v", "w"), 0.01),
}
"""[S] Standard deviations of the sensors: fixes, pressure, attitude, gyroscopes, bottom-tracking log."""
SUITES: dict[str, tuple[str, ...]] = {
    "on board": ("z", "phi", "theta", "psi", "p", "q", "r"),
    "and fixes at both ends": ("x", "y", "z", "phi", "theta", "psi", "p", "q", "r"),
    "and velocity over ground": tuple(NOISE),
}
"""[S] What is recorded. Fixes are had at the surface only: the first and the last 20 s of a run."""
FIXES = 20.0
GUESS = {"u": 0.5, "v": 0.0, "w": 0.0}
"""[S] First velocities, m/s, where none are recorded: a guess, known to 0.3 m/s."""
GUESS_SD = 0.3


def steady(trim: Trim, rudder: float = 0.0) -> dict[str, float]:
    """The steady motion of the 6-DOF model under held controls: states, and V, alpha, beta, glide angle, radius."""
    stepper, sign = Stepper(PLANT), math.copysign(1.0, trim.m_b)
    inputs = {"m_b": trim.m_b, "x_p": trim.x_p, "delta": rudder}

    def rate(x: Array) -> dict[str, float]:
        state = stepper.first(dict(zip(MOVING, x.tolist())))
        return dict(zip((s.name for s in PLANT.states), stepper.rate(0.0, state, inputs)))

    guess = {"u": 0.5, "w": 0.01 * sign, "theta": -0.5 * sign, "r": 0.1 * rudder, "phi": 0.1 * rudder}

    def unsteady(x: Array) -> list[float]:
        found = rate(x)
        return [found[name] for name in MOVING]

    found: Any = root(unsteady, np.array([guess.get(name, 0.0) for name in MOVING]), tol=1e-13)
    if not found.success:
        return dict.fromkeys((*MOVING, "V", "alpha", "beta", "glide", "radius", "sink"), math.nan)
    state, moved = dict(zip(MOVING, found.x.tolist())), rate(found.x)
    V = math.sqrt(sum(state[name] ** 2 for name in ("u", "v", "w")))
    across = math.hypot(moved["x"], moved["y"])
    return {
        **state,
        "V": V,
        "alpha": math.atan2(state["w"], state["u"]),
        "beta": math.asin(state["v"] / V),
        "glide": -math.atan2(moved["z"], across),
        "radius": across / abs(moved["psi"]) if abs(moved["psi"]) > 1e-9 else math.inf,
        "sink": moved["z"],
    }


def closed_glide(alpha: float, m_b: float) -> dict[str, float]:
    """[R] Steady glide in closed form from the incidence (rad) and the net buoyancy (kg): no rudder, no current.

    L/D and the glide angle follow from the incidence, the speed from the weight along the path, and the place of the
    sliding mass from the balance of the pitch moments.
    """
    p = TRUTH
    lift, drag = p["K_L0"] + p["K_alpha"] * alpha, p["K_D0"] + p["K_D"] * alpha**2
    glide = math.atan2(-drag * math.copysign(1.0, lift), abs(lift))
    net = p["m_h"] + p["m_p"] + m_b - p["m_disp"]
    V2 = abs(net) * p["g"] * abs(math.sin(glide)) / drag
    theta = glide + alpha
    munk = (p["A_33"] - p["A_11"]) * math.sin(alpha) * math.cos(alpha)
    moment = V2 * (p["K_M0"] + p["K_M"] * alpha + munk) / (p["g"] * math.cos(theta))
    below = p["m_h"] * p["z_h"] + p["m_p"] * p["z_p"]
    x_p = (moment - below * math.tan(theta) - p["m_h"] * p["x_h"] - m_b * p["x_b"]) / p["m_p"]
    return {"x_p": x_p, "L/D": lift / drag, "glide": glide, "V": math.sqrt(V2), "theta": theta}


def closed_radius(rudder: float, area: float) -> float:
    """[R] Turning radius, m: rudder moment (Fujii) against rotation drag; no sway, no centripetal balance."""
    length, diameter, aspect, arm, drag = 2.0, 0.22, 1.2, 0.9, 1.0
    slope = 6.13 * aspect / (aspect + 2.25)
    force = 32.0 * area * slope * math.sin(rudder) * math.cos(rudder) * arm
    return math.sqrt(drag * diameter * length**4 / force)


def rudder_area() -> float:
    """[R] DNV's rudder area, m2, of a hull of 2 m, 0.22 m wide and deep."""
    length, draught, breadth = 2.0, 0.22, 0.22
    return length * draught / 100.0 * (1.0 + 25.0 * (breadth / length) ** 2)


def start(trim: Trim, current: Mapping[str, float] | None = None, **more: float) -> dict[str, float]:
    """First state of a run: the steady glide, carried by the current, heading north."""
    found = {name: steady(trim)[name] for name in MOVING} | more
    north, east = (current or {}).get("current_north", 0.0), (current or {}).get("current_east", 0.0)
    found["u"] += north * math.cos(found["theta"])
    found["w"] += north * math.sin(found["theta"])
    found["v"] += east
    return found


def run(plan: Sawtooth | GlideSpiral, current: Mapping[str, float] | None = None, limit: float = 4000.0) -> Trial:
    """A run without noise from the steady glide, at 4 Hz."""
    trim, depth = (plan.dive, plan.shallow) if isinstance(plan, Sawtooth) else (plan.trim, 10.0)
    depth = depth if trim.m_b > 0 else 150.0
    given = current or {"current_north": 0.0, "current_east": 0.0}
    flow = complex(given["current_north"], given["current_east"])
    environment = steady_current(abs(flow), math.atan2(flow.imag, flow.real))
    inputs = {"m_b": trim.m_b, "x_p": trim.x_p}
    first = start(trim, given, z=depth)
    return run_manoeuvre(PLANT, plan, dt=DT, first_state=first, inputs=inputs, limit=limit, environment=environment)


@dataclass(frozen=True)
class Design:
    """[S] Which runs are identified from."""

    name: str
    plans: tuple[Sawtooth | GlideSpiral, ...]


def _turn(*angles: float) -> tuple[float, ...]:
    return tuple(math.radians(angle) for angle in angles)


SAWTEETH = (
    Sawtooth(DIVE, CLIMB, deep=50.0, shallow=10.0, halves=2),
    Sawtooth(Trim(0.3, 0.425), Trim(-0.3, 0.385), deep=35.0, shallow=10.0, halves=2),
)
SPIRALS = (
    GlideSpiral(DIVE, _turn(10, -20, 30), hold=100.0, approach=20.0),
    GlideSpiral(CLIMB, _turn(-30, 15, -10), hold=100.0, approach=20.0),
)
DESIGNS = (Design("sawteeth", SAWTEETH), Design("spirals", SPIRALS), Design("sawteeth and spirals", SAWTEETH + SPIRALS))


def trials_of(plans: Sequence[Sawtooth | GlideSpiral], threads: int | None = None) -> tuple[Trial, ...]:
    """The runs in the current, recorded each second, without noise: simulated anew with the recorded controls."""
    found = []
    for number, plan in enumerate(plans):
        fine = run(plan, CURRENT)
        each = round(1.0 / DT)
        coarse = replace(
            fine,
            name=f"{number + 1} {plan.label}",
            t=fine.t[::each],
            inputs={name: values[::each] for name, values in fine.inputs.items()},
            outputs={name: values[::each] for name, values in fine.outputs.items()},
        )
        engine = simulator(IN_CURRENT, [coarse], (), IN_CURRENT.nominal() | CURRENT, max_step=DT, threads=threads)
        y = engine.outputs(np.zeros((1, 0)), engine.initial_states).y[0]
        names = [channel.name for channel in IN_CURRENT.outputs]
        found.append(replace(coarse, outputs=dict(zip(names, y.T))))
    return tuple(found)


def noise_of(level: float) -> dict[str, float]:
    """Standard deviations of all sensors, times a level."""
    return {name: level * sd for name, sd in NOISE.items()}


def recorded(trial: Trial, suite: Sequence[str], rng: np.random.Generator | None = None, level: float = 1.0) -> Trial:
    """What these sensors record of a run: with noise unless rng is None, fixes only near its ends."""
    noisy = trial if rng is None else add_noise(trial, noise_of(level), rng)
    outputs = {name: np.array(noisy.outputs[name]) for name in suite}
    below = (trial.t - trial.t[0] > FIXES) & (trial.t[-1] - trial.t > FIXES)
    for name in ("x", "y"):
        if name in outputs:
            outputs[name][below] = np.nan
    for name, guess in GUESS.items():
        if name not in outputs:
            outputs[name] = np.full(len(trial), np.nan)
            outputs[name][0] = guess
    return replace(noisy, outputs=outputs)


def study(trials: Sequence[Trial], free: Sequence[str], *, start_at: float = 1.0, level: float = 1.0) -> Study:
    """A study with these coefficients and the current free, started at `start_at` times the truth and at no current.

    The first states, which noise hides, are free too.
    """
    chosen = {*free, *CURRENT}
    parameters: list[Parameter] = []
    for q in IN_CURRENT.parameters:
        if q.name not in chosen:
            parameters.append(q)
            continue
        value = q.value if q.name in CURRENT else float(np.clip(start_at * TRUTH[q.name], q.min, q.max))
        parameters.append(q.replace(vary=True, value=value))
    guessed = [name for name in GUESS if np.isfinite(trials[0].outputs[name]).sum() == 1]
    return Study(
        "sun2019",
        IN_CURRENT,
        Trials(list(trials)),
        parameters=tuple(parameters),
        noise={name: sd for name, sd in noise_of(level).items() if name in trials[0].outputs},
        cost=TrajectoryOptions(initial="free", initial_sd=dict.fromkeys(guessed, GUESS_SD), max_step=DT),
    )


def bound(
    runs: Sequence[Trial], suite: Sequence[str], free: Sequence[str], threads: int | None = None, level: float = 1.0
) -> dict[str, Any]:
    """Cramer-Rao bound and verdict of each free parameter at the truth, and what trades off there."""
    asked = study([recorded(run, suite) for run in runs], free, level=level)
    cost = cost_of(asked, threads=threads)
    x = np.array([_true(parameter, runs) for parameter in cost.parameters])
    residuals, jacobian = cost.residuals(x), cost.jacobian(x)
    found = covariance(residuals, jacobian, cost.residual_blocks, white=True)
    related = strongly_correlated(found)
    table = {}
    for k, parameter in enumerate(cost.parameters):
        if parameter.name not in cost.nuisances:
            sd = float(found.crlb[k])
            said = verdict(parameter, float(x[k]), sd, False, bool(found.unidentifiable[k]), bool(related[k]))
            table[parameter.name] = {"crlb": sd, "verdict": said}
    pairs = correlated_pairs(found, cost.parameters)
    unseen = {name for name, row in table.items() if row["verdict"] == "not identifiable"} | {*cost.nuisances}
    sentences = [pair["sentence"] for pair in pairs if not {*pair["combination"]} & unseen]
    return {"bounds": table, "trade-offs": sentences}


def _true(parameter: Parameter, runs: Sequence[Trial]) -> float:
    """True value of a free parameter or of a first state ("RUN: state")."""
    for run in runs:
        if parameter.name.startswith(f"{run.name}: "):
            return float(run.outputs[parameter.name.removeprefix(f"{run.name}: ")][0])
    return (TRUTH | CURRENT)[parameter.name]
