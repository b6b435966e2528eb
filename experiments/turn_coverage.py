"""Do intervals of a 35 deg turn, predicted from zigzags alone, hold the true turn as often as they say?

    python experiments/turn_coverage.py [--quick]

Each case is a ship of its own, drawn from the priors of experiments/real_ships (KVLCC2, 7 m). It sails zigzags of 10
and 20 deg, with noise; a model with the same priors is fitted to them, and predicts the turning circle of 35 deg with
95 % intervals. The true turn is known exactly. Three sets of cases:

- "same form": the ship is one of the model's family. Intervals should hold 95 % of the figures.
- "other form": coefficients that the fit takes as known (wake, thrust deduction, added masses, rudder's lift, the
  propeller's inflow in a turn) are off by 10 % each, so that the model lacks something that noise hides.
  `seatruth.prediction.FORM_ERROR`, the error of the model's form that all intervals hold, was chosen on them.
- "fresh ships": the same with other ships, which took no part in that.
"""

from __future__ import annotations

import math
import sys
from functools import partial
from pathlib import Path
from typing import Any, Literal

import joblib
import numpy as np
import pandas as pd

from seatruth import Budget, Study, TrajectoryOptions, Trials, identify, predict
from seatruth.errors import SeatruthError
from seatruth.manoeuvres import (
    TurningCircle,
    Zigzag,
    add_noise,
    run_manoeuvre,
    self_propulsion,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.models import Prior, load_model
from seatruth.prediction import FORM_ERROR
from seatruth.prediction.intervals import widened

sys.path[:0] = [str(Path(__file__).resolve().parent)]

from common import COLOURS, Options, Results, main  # noqa: E402

SEED = 20261
CASES, QUICK = 16, 2
DRAWS = 200
SPEED = 1.18
RUDDER_RATE = math.radians(15.8)
NOISE = {
    **dict.fromkeys(("x", "y"), 0.05),
    "psi": math.radians(0.2),
    **dict.fromkeys(("u", "v"), 0.01),
    "r": math.radians(0.1),
}
"""Standard deviations, white: of positions by a basin's camera system or RTK, of a good inertial unit. [S]"""
PRIORS = {
    **{"R_0": (0.022, 0.006), "X_vv": (-0.04, 0.08), "X_vr": (0.002, 0.04), "X_rr": (0.011, 0.02)},
    **{"Y_v": (-0.315, 0.0945), "Y_r": (0.083, 0.0332), "Y_vvv": (-1.607, 0.8), "Y_vvr": (0.379, 0.4)},
    **{"Y_vrr": (-0.391, 0.3), "N_v": (-0.137, 0.0343), "N_r": (-0.049, 0.0123), "N_vvv": (-0.03, 0.1)},
    **{"N_vvr": (-0.294, 0.15), "N_vrr": (0.055, 0.06), "N_rrr": (-0.013, 0.01), "t_R": (0.387, 0.0968)},
    **{"a_H": (0.312, 0.078), "l_R": (-0.71, 0.106), "gamma_R_minus": (0.395, 0.0988), "gamma_R_plus": (0.64, 0.16)},
}
"""Mean and standard deviation, as in experiments/real_ships/kvlcc2_hsva.toml."""
TAKEN_AS_KNOWN = ("w_P0", "t_P", "m_y", "J_z", "f_alpha", "C_1", "C_2_plus", "C_2_minus", "epsilon", "X_vvvv")
OFF = 0.1
"""Standard deviation, relative, of what the model takes as known in the cases of another form. [S]"""
FIGURES = ("advance", "transfer", "tactical_diameter", "steady_diameter", "drift_angle", "rate", "speed_loss")
SIDES: tuple[Literal["starboard", "port"], ...] = ("starboard", "port")
FORMS = ("same form", "other form", "fresh ships")
TRIED = np.arange(0.0, 0.1, 0.0005)
"""Relative errors of the form that are tried."""


def ship(number: int, form: str) -> dict[str, float]:
    """Parameters of the true ship of a case, inside the model's bounds."""
    rng = np.random.default_rng([SEED + (form == FORMS[2]), number])
    model = load_model("mmg")
    values = {}
    for name, (mean, sd) in PRIORS.items():
        parameter = model.parameter(name)
        value = math.nan
        while not parameter.min < value < parameter.max:
            value = float(rng.normal(mean, sd))
        values[name] = value
    if form != FORMS[0]:
        values |= {name: model.parameter(name).value * (1 + OFF * rng.standard_normal()) for name in TAKEN_AS_KNOWN}
    return values


def case(form: str, number: int) -> list[dict[str, Any]]:
    """One row for each figure of the 35 deg turn to starboard: true, predicted, the interval; none for a ship that
    cannot sail its zigzags (the priors hold ships that are so unstable that no rudder of 10 deg checks them).
    """
    model, truth = load_model("mmg"), ship(number, form)
    rng = np.random.default_rng([SEED, number, 1])
    try:
        n = self_propulsion(model, SPEED, truth)
        sail = partial(
            run_manoeuvre,
            model,
            values=truth,
            dt=0.25,
            first_state={"u": SPEED},
            inputs={"n": n},
            rudder_rate=RUDDER_RATE,
            limit=300.0,
        )
        plans = [
            Zigzag(math.radians(angle), math.radians(angle), side, executes=4) for angle in (10, 20) for side in SIDES
        ]
        runs = [sail(plan) for plan in plans]
        if min(len(zigzag_figures(run).executes) for run in runs) < 4:
            return []
        turn = turning_circle_figures(sail(TurningCircle(math.radians(35))))
    except SeatruthError:
        return []
    study = Study(
        f"case {number}",
        model,
        Trials([add_noise(run, NOISE, rng) for run in runs]),
        parameters=tuple(
            p.replace(value=PRIORS[p.name][0], vary=True, prior=Prior(*PRIORS[p.name])) if p.name in PRIORS else p
            for p in model.parameters
        ),
        noise=NOISE,
        cost=TrajectoryOptions(initial="free"),
        budget=Budget(evaluations=4000),
        seed=number,
    )
    try:
        found = predict(
            study,
            identify(study, threads=1),
            [TurningCircle(math.radians(35))],
            speed=SPEED,
            inputs={"n": n},
            rudder_rate_limit=RUDDER_RATE,
            draws=DRAWS,
            limit=600.0,
            dt=0.25,
            form_error=0.0,
            threads=1,
        )
    except SeatruthError as problem:
        return [{"form": form, "case": number, "figure": "none", "failed": problem.message}]
    rows = []
    for row in found.figures.to_dict("records"):
        true = float(getattr(turn, row["figure"])) if row["figure"] in FIGURES else math.nan
        if math.isfinite(true):
            rows.append(
                {"form": form, "case": number, "figure": row["figure"], "true": true, "predicted": row["value"]}
                | {name: row[name] for name in ("lower", "upper", "prior_share", "missing")}
                | {"model_error": found.model_error, "lack_of_fit": found.lack_of_fit, "failed": ""}
            )
    return rows


def body(options: Options, results: Results) -> None:
    count = QUICK if options.quick else CASES
    results.expect(len(FORMS))
    parts = []
    for form in FORMS:
        definition = {"seed": SEED, "cases": count, "draws": DRAWS, "form": form}
        parts += results.stage(form, definition, partial(_all, form, count, options.workers))
    table = pd.DataFrame(parts)
    results.add_table("cases", table)
    known = table[table.failed == ""].copy()
    known["by parameters alone"] = _inside(known, 0.0)
    known["inside"] = _inside(known, FORM_ERROR)
    known[["lower", "upper"]] = widened(known, "predicted", FORM_ERROR, 0.95)[["lower", "upper"]]
    known["half width, %"] = 50 * (known.upper - known.lower) / known.predicted.abs()
    known["error, %"] = 100 * (known.predicted / known.true - 1).abs()
    summary = known.groupby(["form", "figure"], sort=False).agg(
        cases=("inside", "size"),
        coverage=("inside", "mean"),
        alone=("by parameters alone", "mean"),
        error=("error, %", "median"),
        half_width=("half width, %", "median"),
        prior_share=("prior_share", "median"),
    )
    results.add_table("coverage", summary.reset_index())
    for form in FORMS:
        own = known[known.form == form]
        detail, share = f"{own.case.nunique()} ships, {len(own)} figures", float(own["by parameters alone"].mean())
        results.add_figure(
            f"{form}: figures inside their 95 % intervals", 100 * float(own.inside.mean()), "%", detail,
            goal="", met=None,
        )  # fmt: skip
        results.add_figure(
            f"{form}: the same without the error of the model's form", 100 * share, "%", detail,
            goal="93 to 99 %" if form == FORMS[0] else "", met=0.93 <= share <= 0.99 if form == FORMS[0] else None,
        )  # fmt: skip
    own = known[known.form == FORMS[1]].drop(columns=["lower", "upper"]).join(table[["lower", "upper"]])
    enough = [error for error in TRIED if _inside(own, error).mean() >= 0.95]
    if enough:
        results.add_figure("error of the form with which 95 % lie inside", 100 * enough[0], "%", FORMS[1])
    lines = ["| form | figure | ships | inside, % | without form error, % | median error, % | half width, % | priors |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    lines += [
        f"| {row['form']} | {row['figure']} | {row['cases']} | {100 * row['coverage']:.0f} "
        f"| {100 * row['alone']:.0f} | {row['error']:.1f} "
        f"| {row['half_width']:.1f} | {100 * row['prior_share']:.0f} % |"
        for row in summary.reset_index().to_dict("records")
    ]
    results.add_text("\n".join(lines))
    results.add_picture("coverage", _picture(known))


def _inside(known: pd.DataFrame, error: float) -> pd.Series[bool]:
    """Whether figures lie inside their intervals, with this relative error of the model's form."""
    wide = widened(known, "predicted", error, 0.95)
    return (wide.lower <= known.true) & (known.true <= wide.upper)


def _all(form: str, count: int, workers: int) -> list[dict[str, Any]]:
    """All cases of a form; as many ships as were asked for, less those that cannot sail a zigzag."""
    found = joblib.Parallel(n_jobs=workers)(joblib.delayed(case)(form, number) for number in range(count))
    return [row for rows in found for row in rows]


def _picture(known: pd.DataFrame) -> Any:
    """True figures over their predictions, with the intervals, in per cent of the prediction."""
    import matplotlib.pyplot as plt

    shown = ("advance", "tactical_diameter", "steady_diameter")
    figure, axes = plt.subplots(
        len(FORMS), len(shown), figsize=(10, 2.8 * len(FORMS)), layout="constrained", squeeze=False
    )
    most = 10.0  # what lies beyond is drawn at the edge
    for row, form in zip(axes, FORMS, strict=True):
        for axis, name in zip(row, shown, strict=True):
            own = known[(known.form == form) & (known.figure == name)].sort_values("case").reset_index(drop=True)
            low, high, true = (
                np.clip(100 * (own[column] / own.predicted - 1), -most, most) for column in ("lower", "upper", "true")
            )
            axis.vlines(own.index, low, high, color="#a6a6a6", linewidth=2, label="95 % interval")
            for inside, colour, marker in ((True, COLOURS[0], "o"), (False, COLOURS[3], "X")):
                chosen = own.inside == inside
                label = "true, inside" if inside else "true, outside"
                axis.plot(own.index[chosen], true[chosen], marker, color=colour, markersize=4, label=label)
            axis.set_title(f"{form}: {name.replace('_', ' ')}, {100 * own.inside.mean():.0f} % inside", fontsize=9)
            axis.set_xlabel("ship")
            axis.set_ylim(-1.05 * most, 1.05 * most)
        row[0].set_ylabel("true less predicted (%)")
    axes[0][0].legend(fontsize=7)
    return figure


if __name__ == "__main__":
    sys.exit(main("turn_coverage", (__doc__ or "").splitlines()[0], body, seeds={"cases": SEED}))
