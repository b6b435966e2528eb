"""The problems of the standard comparison: published systems, simulated, and recorded runs of two ship models.

Tags: [P] printed in the paper, [R] reconstructed, [L] other literature, [S] chosen here. All trials but the ships' are
synthetic. The bounds of the searches and the trials held out are [S]; so are all noise levels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import chen2011_system
import numpy as np
import pandas as pd
import xu2012_system

from seatruth import Model, Parameter, Study, Trials
from seatruth.comparison import Problem
from seatruth.manoeuvres import Manoeuvre, Sawtooth, Trim, run_manoeuvre
from seatruth.models.glider import Glider
from seatruth.models.torpedo import Torpedo
from seatruth.study import build, formula_study, parse, read_text
from seatruth.trials import Trial

SHIPS = Path(__file__).resolve().parent / "real_ships"
USUAL = "../../../shared/data"
"""The folder of real trials as the ships' study files name it."""
LOW, HIGH = 0.3, 2.5
"""[S] Bounds of the searches in multiples of the truth."""
XU_FREE = ("X_T", "X_uu", "Z_0", "Z_w", "Z_q", "Z_ds", "M_w", "M_q", "M_ds", "z_B")
"""Those that the trial holds well [V]."""
TORPEDO_FREE = (
    *("C_x0", "C_z_beta", "C_z_dr", "m_y_beta", "m_y_wy", "m_y_dr"),
    *("C_y_alpha", "C_y_de", "m_z_alpha", "m_z_wz", "m_z_de"),
)
GLIDER_FREE = ("K_D0", "K_D", "K_L0", "K_alpha", "K_M0", "K_M", "K_q")
PLANING = {"a1": 0.058386, "a2": 0.147272, "a3": 0.836367, "a4": 0.00102, "a5": 0.017654}
"""[P] Eda-type formula of a planing craft's turning diameter (Liu, Yue and Yu)."""
EXPRESSION = "D = (a1*Fr**3 + a2*Fr**2 + a3*Fr) / (a4*rudder + a5)"


@dataclass(frozen=True)
class Weave(Manoeuvre):
    """[S] Rudder and stern planes in sines of their own periods (s), revolutions in steps."""

    rudder: float = math.radians(12.0)
    plane: float = math.radians(6.0)
    period: float = 11.0
    other: float = 7.0

    @property
    def label(self) -> str:
        return f"weave, periods {self.period:g} s and {self.other:g} s"

    def helm(self) -> Any:
        def helm(t: float, y: Mapping[str, float]) -> Mapping[str, float]:
            turn, dive = (math.sin(2.0 * math.pi * t / period) for period in (self.period, self.other))
            return {"delta": self.rudder * turn, "delta_s": self.plane * dive, "n": 25.4 if t % 40.0 < 20.0 else 20.0}

        return helm


def within(model: Model, free: Iterable[str]) -> tuple[Parameter, ...]:
    """The model's parameters at their values, these free within `LOW` to `HIGH` times them."""
    chosen = set(free)
    return tuple(
        q.replace(vary=True, min=min(LOW * q.value, HIGH * q.value), max=max(LOW * q.value, HIGH * q.value))
        if q.name in chosen
        else q.replace(vary=False)
        for q in model.parameters
    )


def made(name: str, model: Model, free: Iterable[str], fit: list[Trial], held: list[Trial], **more: Any) -> Problem:
    """A problem whose truth is the model's own values."""
    study = Study(name, model, Trials(fit), holdout=Trials(held), parameters=within(model, free))
    return Problem(name, study, {q.name: q.value for q in study.free}, **more)


def diving_plane() -> Problem:
    """Xu and others 2012: zigzags in the diving plane, 15 deg fin; 10 deg held out."""
    fit, held = xu2012_system.zigzag(15.0), xu2012_system.zigzag(10.0)
    costs = ("trajectory", "regression")
    return made("xu2012 diving plane", xu2012_system.PLANT, XU_FREE, [fit], [held], costs=costs)


def longitudinal_plane() -> Problem:
    """Chen and others 2011: pitch steps with a switching elevator; smaller steps held out."""
    plan = chen2011_system.PitchSteps(pitch=math.radians(15.0))
    fit, held = chen2011_system.benchmark(), chen2011_system.benchmark(plan=plan)
    return made("chen2011 longitudinal", chen2011_system.PLANT, chen2011_system.FREE, [fit], [held])


def torpedo() -> Problem:
    """Zhao and others 2018: the coupled vehicle weaving sideways and up and down."""
    model = Torpedo()
    first = {"u": 1.5}
    runs = [
        run_manoeuvre(model, plan, dt=0.1, first_state=first, rudder_rate=math.radians(30.0), limit=40.0)
        for plan in (Weave(), Weave(period=17.0, other=9.0, rudder=math.radians(9.0)))
    ]
    return made("zhao2018 torpedo", model, TORPEDO_FREE, runs[:1], runs[1:])


def glider() -> Problem:
    """Sun and others 2019: a sawtooth of the Petrel-II; a steeper one held out."""
    model = Glider()
    first = {"u": 0.5, "theta": -0.6, "z": 10.0}
    plans = (
        Sawtooth(Trim(0.5, 0.402), Trim(-0.5, 0.403), deep=30.0, shallow=10.0, halves=2),
        Sawtooth(Trim(0.6, 0.404), Trim(-0.4, 0.401), deep=30.0, shallow=10.0, halves=2),
    )
    runs = [
        run_manoeuvre(model, plan, dt=0.5, first_state=first, inputs={"m_b": plan.dive.m_b, "x_p": plan.dive.x_p},
                      limit=300.0, name=f"sawtooth {k}")
        for k, plan in enumerate(plans, 1)
    ]  # fmt: skip
    return made("sun2019 glider", model, GLIDER_FREE, runs[:1], runs[1:])


def planing() -> Problem:
    """Liu, Yue and Yu: the Eda-type formula [P] on speeds and rudder angles [S]; other speeds held out.

    Numerator and denominator can be scaled together: a5 is held at its value, so that the others can be told.
    """
    parameters = [
        Parameter(name, value, min=LOW * value, max=HIGH * value, vary=name != "a5") for name, value in PLANING.items()
    ]
    fit = formula_study(EXPRESSION, _turns(0.25, 0.70, 8), parameters, name="turns", synthetic=True)
    held = formula_study(EXPRESSION, _turns(0.28, 0.66, 5), parameters, name="other turns", synthetic=True)
    study = fit.replace(name="liu planing craft", holdout=held.trials)
    return Problem("liu planing craft", study, {q.name: q.value for q in study.free})


def _turns(low: float, high: float, speeds: int) -> pd.DataFrame:
    Fr, rudder = (grid.ravel() for grid in np.meshgrid(np.linspace(low, high, speeds), np.linspace(15.0, 35.0, 5)))
    return pd.DataFrame({"Fr": Fr, "rudder": rudder, "D": np.zeros(Fr.size)})


def ship(name: str, data: Path, title: str, fit: int = 1, held: int = 1, budget: int = 2000) -> Problem:
    """A recorded ship model: noise comes on top of what was measured, and the truth is not known.

    [S] Of its runs only the first of every `fit` are fitted, of those held out the first of every `held`.
    """
    source = SHIPS / f"{name}.toml"
    text = read_text(source)
    if data.resolve() != (SHIPS / USUAL).resolve():
        text = text.replace(USUAL, data.resolve().as_posix())
    file, problems = parse(text, str(source))
    study = build.study(file, source, name, problems)
    problems.stop()
    assert study is not None  # otherwise there was a problem
    study = study.replace(trials=study.trials[::fit], holdout=study.holdout[::held])
    return Problem(title, study, budgets=(budget,))


SYNTHETIC: dict[str, Callable[[], Problem]] = {
    "xu2012": diving_plane,
    "chen2011": longitudinal_plane,
    "zhao2018": torpedo,
    "sun2019": glider,
    "liu": planing,
}


def problems(data: Path | None, quick: bool) -> list[Problem]:
    """All problems; the quick ones only, or without the ships where `data` is None."""
    if quick:
        return [SYNTHETIC[name]() for name in ("xu2012", "liu")]
    found = [make() for make in SYNTHETIC.values()]
    if data is not None:
        found.append(ship("kvlcc2_marin", data, "KVLCC2, recorded"))
        found.append(ship("esso_osaka", data, "Esso Osaka, recorded", fit=8, held=4, budget=1000))
    return found
