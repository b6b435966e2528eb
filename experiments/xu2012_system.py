"""The diving-plane zigzag of Xu, Zou et al. 2012: its trial, its separate regressions, its studies.

Tags: [P] printed in the paper, [R] reconstructed, [L] other literature, [S] chosen here, [V] by independent code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from seatruth import Parameter, Study
from seatruth.costs import cost_of
from seatruth.manoeuvres import PitchZigzag, add_noise, run_manoeuvre
from seatruth.models.diving_plane import DivingPlane
from seatruth.trials import Trial, Trials
from seatruth_optimizers.ls_svm import LSSVR

Array = NDArray[np.float64]
Form = Literal["euler", "central", "trapezoid"]
FORMS: tuple[Form, ...] = ("euler", "central", "trapezoid")
PLANT = DivingPlane()
TRUTH: dict[str, float] = PLANT.nominal()
C = 3e4
"""[P] printed as "C=3.0x10" with a stray 4."""
STEP = 0.5
"""[P] s."""

SURGE = ("X_uu", "X_wq", "X_qq")
HEAVE = ("Z_0", "Z_w", "Z_aw", "Z_waw", "Z_q", "Z_qaq", "Z_ds")
PITCH = ("M_w", "M_aw", "M_waw", "M_q", "M_qaq", "M_ds", "z_B")
COEFFICIENTS = (*SURGE, *HEAVE, *PITCH)
"""What the regressions identify; the thrust X_T is their bias."""
FREE = ("X_T", *COEFFICIENTS)
VISCOUS = (*HEAVE, *PITCH[:-1])
"""Those of heave and pitch, whose sensitivities decide which make the reduced model."""
LEVEL = 0.01
"""[S] Noise of the bounds, as a part of each output's largest departure from its first value."""
KEPT = 0.05
"""[S] Least sensitivity of a coefficient of the reduced model; the paper does not state its own."""
DOMINANT = 0.1
"""[V] Sensitivity above which every coefficient is recovered within 1.5 %."""
FINS = (2.5, 5.0, 7.5, 10.0, 15.0, 20.0)
"""deg, of the trials whose bounds are compared."""

_HALF = 0.5 * TRUTH["rho"]
_SCALES = tuple(_HALF * TRUTH["L"] ** n for n in (2, 3, 4, 5))
"""Half the density times powers of the length: what makes the coefficients forces and moments."""
OUTPUTS = tuple(channel.name for channel in PLANT.outputs)


def zigzag(fin: float = 5.0, pitch: float | None = None, seconds: float = 120.0) -> Trial:
    """The published trial, simulated: from rest [P] at 100 m [P] under 120 N [P], fin in deg [P: 5] at 2.5 deg/s [P],
    reversed when the pitch reaches `pitch` deg [R: 5; as the fin where None]."""
    plan = PitchZigzag(math.radians(fin), math.radians(fin if pitch is None else pitch))
    rate = math.radians(2.5)
    return run_manoeuvre(PLANT, plan, dt=STEP, first_state={"z": 100.0}, rudder_rate=rate, limit=seconds)


def noise_of(trial: Trial, part: float) -> dict[str, float]:
    """[S] Standard deviation of each output: this part of its largest departure from its first value."""
    return {name: part * float(np.ptp([trial.outputs[name][0], *_extremes(trial, name)])) for name in OUTPUTS}


def noisy(trial: Trial, sd: Mapping[str, float], rng: np.random.Generator) -> Trial:
    """White noise on all outputs but for the first sample: the start, at rest at 100 m [P], is known."""
    made = add_noise(trial, sd, rng)
    outputs = {name: np.concatenate([trial.outputs[name][:1], y[1:]]) for name, y in made.outputs.items()}
    return replace(made, outputs=outputs)


def parameters(start: float = 1.0, free: Iterable[str] = FREE) -> tuple[Parameter, ...]:
    """The plant's parameters with these free within the model's own bounds, starting at `start` times the truth."""
    chosen = set(free)
    return tuple(
        q.replace(vary=True, value=float(np.clip(start * q.value, q.min, q.max))) if q.name in chosen else q
        for q in PLANT.parameters
    )


def study(trial: Trial, **changes: Any) -> Study:
    """A study of one trial with the published coefficients free."""
    fields: dict[str, Any] = {"name": "xu2012", "parameters": parameters(), **changes}
    return Study(model=PLANT, trials=Trials([trial]), **fields)


def percent(found: Mapping[str, float]) -> dict[str, float]:
    """Relative errors in per cent."""
    return {name: 100.0 * (value / TRUTH[name] - 1.0) for name, value in found.items()}


def separate(trial: Trial, form: Form = "trapezoid", weight: float = C) -> dict[str, float]:
    """[R] Three LS-SVM regressions, one an equation before the inertia matrix is inverted; inertias are known [P].

    Each has a bias; that of surge is the thrust X_T [P]. The others' have nothing to find and are not returned.
    """
    p, (r2, r3, r4, r5) = TRUTH, _SCALES
    u, w, q, theta, fin = _record(trial)
    rate, at = _discretised(form, np.asarray(trial.t))
    du, dw, dq = rate(u), rate(w), rate(q)

    def solve(names: tuple[str, ...], target: Array, regressors: list[Array]) -> float:
        machine = LSSVR(C=weight).fit(np.column_stack(regressors), target)
        found.update(zip(names, machine.coef_.tolist()))
        return float(machine.intercept_)

    found: dict[str, float] = {}
    target = (p["m"] - r3 * p["X_du"]) * du + p["m"] * at(w * q)
    found["X_T"] = solve(SURGE, target, [r2 * at(u * abs(u)), r3 * at(w * q), r4 * at(q * q)])
    incidence = [at(u * w), at(u * abs(w)), at(w * abs(w))]
    target = (p["m"] - r3 * p["Z_dw"]) * dw - r4 * p["Z_dq"] * dq - p["m"] * at(u * q)
    rest = [r3 * at(u * q), r4 * at(q * abs(q)), r2 * at(u * u * fin)]
    solve(HEAVE, target, [r2 * at(u * u), *(r2 * column for column in incidence), *rest])
    target = (p["I_y"] - r5 * p["M_dq"]) * dq - r4 * p["M_dw"] * dw
    rest = [r4 * at(u * q), r5 * at(q * abs(q)), r3 * at(u * u * fin), p["B"] * at(np.sin(theta))]
    solve(PITCH, target, [*(r3 * column for column in incidence), *rest])
    return found


def literal_surge(trial: Trial, weight: float = C) -> dict[str, float]:
    """[P] Surge as the text has it: u[k+1] on u[k], whose coefficient C_u, known to be 1, is found as a check; the
    other regressors of the trapezoid form [R]."""
    p, (r2, r3, r4, _) = TRUTH, _SCALES
    u, w, q, _, _ = _record(trial)
    _, at = _discretised("trapezoid", np.asarray(trial.t))
    step = STEP / (p["m"] - r3 * p["X_du"])
    target = u[1:] + step * p["m"] * at(w * q)
    rest = [r2 * at(u * abs(u)), r3 * at(w * q), r4 * at(q * q)]
    machine = LSSVR(C=weight).fit(np.column_stack([u[:-1], *(step * column for column in rest)]), target)
    return dict(zip(("C_u", *SURGE, "X_T"), [*machine.coef_.tolist(), float(machine.intercept_) / step]))


def _record(trial: Trial) -> tuple[Array, ...]:
    """u, w, q, pitch and fin."""
    states = (np.asarray(trial.outputs[name]) for name in ("u", "w", "q", "theta"))
    return (*states, np.asarray(trial.inputs["delta_s"]))


def _discretised(form: Form, t: Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """How this form takes a rate out of a record, and the regressors that go with it."""
    h = float(t[1] - t[0])
    if form == "euler":
        return (lambda x: np.diff(x) / h), (lambda x: x[:-1])
    if form == "central":
        return (lambda x: (x[2:] - x[:-2]) / (2 * h)), (lambda x: x[1:-1])
    return (lambda x: np.diff(x) / h), (lambda x: 0.5 * (x[1:] + x[:-1]))


def simulated(trial: Trial, values: Mapping[str, float], threads: int | None = None) -> dict[str, Array]:
    """Outputs of the open-loop run with these coefficients under the trial's fin record."""
    given = tuple(q.replace(value=values.get(q.name, q.value), min=-math.inf, max=math.inf) for q in parameters())
    cost = cost_of(study(trial, parameters=given, noise=dict.fromkeys(OUTPUTS, 1.0)), threads=threads)
    (y,) = cost.predict(cost.start)
    return dict(zip(OUTPUTS, y.T))


def sensitivities(frame: pd.DataFrame) -> dict[str, float]:
    """[R] S of each coefficient: the largest over w, q and pitch."""
    largest = frame[["w", "q", "theta"]].to_numpy(dtype=float).max(axis=1)
    return dict(zip(frame.index.astype(str), largest.tolist()))


def _extremes(trial: Trial, name: str) -> tuple[float, float]:
    y = trial.outputs[name]
    return float(np.min(y)), float(np.max(y))
