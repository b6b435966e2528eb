"""How far the gap shrinks on trials left out: selection and fit on the others, prediction of the one.

Each trial in turn is left out of everything but the noise floor. The hypothesis that the remaining trials favour is
taken (so that choosing it is part of what is tested), and the trial left out is predicted in the open loop from the
initial state that its first fifth gives. Errors are in multiples of the noise, over all channels; closure is

    (E_refit - E_effect) / (E_refit - E_floor),

with the *refitted* model as its start, since tuning must not be credited to the diagnosis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import t as student

from seatruth.arrays import Array
from seatruth.costs.trajectory import TrajectoryCost
from seatruth.diagnosis.discrepancy.score_test import Probes
from seatruth.diagnosis.discrepancy.terms import ProbedModel
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.noise import white_floor
from seatruth.diagnosis.posterior import handicap
from seatruth.diagnosis.problem import GapProblem
from seatruth.models.parameter import Parameter
from seatruth.trials.trial import Trial, Trials

Say = Callable[[str], None]
RIVALS = 4
"""Hypotheses between which each fold chooses, beside none."""
_STEPS = 8
_PARTS_OF_STEP = (1.0, 0.5, 0.25, 0.1, 0.0)
_FLOOR = 1.0


@dataclass(frozen=True)
class Fold:
    """One trial left out: errors in multiples of the noise."""

    trial: str
    manoeuvre: str
    chosen: tuple[str, ...]
    before: float
    refit: float
    effect: float
    flexible: float


def how_far(
    search: Search, plain: Search, flexible: Probes | None, rivals: Sequence[tuple[str, ...]], say: Say
) -> dict[str, Any]:
    """Folds, and closure with its interval (jackknife over trials).

    `search` says which hypotheses the other trials favour. Where its runs are led, they are fitted anew to whole runs,
    as `plain` has them, before they predict.
    """
    problem = search.problem
    if len(problem.trials) < 2:
        return {"folds": [], "closure": None, "why": "One trial alone: nothing can be left out."}
    folds, least = [], handicap(search)
    for number, trial in enumerate(problem.trials):
        say(f"Left out: {trial.name} ({number + 1} of {len(problem.trials)})")
        folds.append(_fold(search, plain, flexible, rivals, least, number, trial))
    return {"folds": [_row(fold) for fold in folds], **_closure(folds)}


def _fold(
    search: Search,
    plain: Search,
    flexible: Probes | None,
    rivals: Sequence[tuple[str, ...]],
    least: Callable[[tuple[str, ...]], float],
    number: int,
    trial: Trial,
) -> Fold:
    problem, floor = search.problem, search.floor

    def refitted(effects: Sequence[str]) -> Fit:
        return fit(problem, effects, floor, search.fits[tuple(sorted(effects))].x, steps=_STEPS, without=number)

    base = refitted(())
    ahead, best = 0.0, base
    for effects in rivals[:RIVALS]:
        found = refitted(effects)
        gain = found.evidence - base.evidence - least(found.effects)
        if gain > ahead:
            ahead, best = gain, found
    if problem.lead is not None:
        led, base = best, in_whole_runs(search, plain, base, None, number, _STEPS)
        best = in_whole_runs(search, plain, led, base, number, _STEPS) if led.effects else base
    predictor = _Predictor(plain.problem, plain.problem.trials[number], dict(floor.sd))
    before = predictor.error(problem.start)
    errors = predictor.error(base.x)
    return Fold(
        trial=trial.name,
        manoeuvre=str(trial.conditions.get("manoeuvre", "")),
        chosen=best.effects,
        before=before,
        refit=errors,
        effect=errors if best is base else predictor.error(best.x),
        flexible=_flexible(flexible, base, number, predictor) if flexible is not None else math.nan,
    )


def in_whole_runs(
    search: Search, plain: Search, led: Fit, base: Fit | None = None, without: int | None = None, steps: int = 25
) -> Fit:
    """The hypothesis of a led fit, fitted to whole runs: what leaves the least squares in multiples of the noise.

    Runs that stray have many valleys. So it begins from several points, and against the noise as whole runs show it as
    well. `base` is such a fit of the model without effects: what an effect adds begins there, too.
    """
    problem = plain.problem
    floor = white_floor(problem.series, search.floor.sd)
    starts = [plain.base.x, led.x]
    if base is not None and led.effects:
        mixed = base.x.copy()
        own = np.concatenate([problem.columns[name] for name in led.effects])
        mixed[own] = led.x[own]
        starts = [base.x, mixed, led.x]
    found = [
        fit(problem, led.effects, at, x, steps=steps, without=without) for at in (plain.floor, floor) for x in starts
    ]

    def missed(one: Fit) -> float:
        errors = problem.whitened(one.x, floor, one.active, without)
        return float(errors @ errors) if np.isfinite(errors).all() else np.inf

    return min(found, key=missed)


class _Predictor:
    """Predicts one trial from the parameters of x, from the initial state that its first fifth gives."""

    def __init__(self, problem: GapProblem, trial: Trial, sd: dict[str, float]) -> None:
        self.problem, self.trial, self.sd = problem, trial, sd

    def error(self, x: Array, probed: ProbedModel | None = None, terms: Mapping[str, float] | None = None) -> float:
        """Root mean square error over channels, in multiples of the noise; `terms` are values of a probed model's."""
        problem = self.problem
        values = {**dict(zip(problem.names, x)), **(terms or {})}
        model = problem.model if probed is None else probed
        known = {p.name: p for p in problem.parameters}
        fixed = tuple(_fixed(known.get(p.name, p), values) for p in model.parameters)
        study = problem.cost.problem.replace(
            model=model, parameters=fixed, trials=Trials([self.trial]), noise=dict(self.sd)
        )
        cost = TrajectoryCost(study, threads=problem.threads)
        y = cost.predict(cost.start, [self.trial])[0]
        parts = []
        for k, name in enumerate(problem.outputs):
            if name in self.trial.outputs and name in self.sd:
                error = np.asarray(self.trial.outputs[name]) - y[:, k]
                error = error[np.isfinite(np.asarray(self.trial.outputs[name]))]
                if error.size:
                    parts.append(float(np.mean(error**2)) / self.sd[name] ** 2)
        found = math.sqrt(float(np.mean(parts))) if parts else math.nan
        return found if math.isfinite(found) else math.inf


def _fixed(parameter: Parameter, values: Mapping[str, float]) -> Parameter:
    if parameter.expr is not None:
        return parameter
    value = float(values.get(parameter.name, parameter.value))
    return parameter.replace(
        value=value, vary=False, prior=None, start=None, scale="linear", min=-math.inf, max=math.inf
    )


def _flexible(probes: Probes, base: Fit, number: int, predictor: _Predictor) -> float:
    """The refitted model with the terms of all equations, fitted to the other trials to first order about the fit.

    A control that could stand for any force, without a name.
    """
    problem = probes.problem
    labels = [label for label in probes.terms if label in probes.screens]
    if not labels:
        return math.nan
    names = [probes.terms[label][k].name for label in labels for k in probes.kept[label]]
    block = np.concatenate([probes.blocks[label] for label in labels], axis=1)
    sizes = np.concatenate(
        [next(p.size for p in probes.found if p.label == label) * probes.scales[label] for label in labels]
    )
    active = base.active
    learnt = problem.trial_of != number
    A = np.concatenate([probes.at.linear.slopes, block], axis=1)[learnt]
    weight = np.concatenate([1.0 / problem.sd[active] ** 2, 1.0 / sizes**2])
    pull = np.concatenate(
        [(probes.at.x[active] - problem.mean[active]) / problem.sd[active] ** 2, np.zeros(len(names))]
    )
    slope = A.T @ probes.at.linear.errors[learnt] + pull
    moved = -np.linalg.solve(A.T @ A + np.diag(weight), slope)
    # A large gap is not linear in these: the part of the step that serves the trials learnt from is taken.
    tried = []
    for part in _PARTS_OF_STEP:
        x = probes.at.x.copy()
        x[active] = np.clip(x[active] + part * moved[: len(active)], problem.low[active], problem.high[active])
        terms = dict(zip(names, (part * moved[len(active) :]).tolist()))
        errors = probes.errors(x, terms)
        if np.isfinite(errors).all():
            tried.append((float((errors[learnt] ** 2).sum()), part, x, terms))
    if not tried:
        return math.nan
    _, _, x, terms = min(tried, key=lambda one: one[:2])
    return predictor.error(x, probes.model, terms)


def _closure(folds: Sequence[Fold]) -> dict[str, Any]:
    refit = np.array([f.refit for f in folds])
    effect = np.array([f.effect for f in folds])
    value = _ratio(refit, effect)
    # Drawing so few trials anew gives too narrow an interval; Student's t on the jackknife knows how few they are.
    without = ~np.eye(len(folds), dtype=bool)
    found = np.array([_ratio(refit[others], effect[others]) for others in without])
    spread = math.sqrt((len(folds) - 1) / len(folds) * float(((found - found.mean()) ** 2).sum()))
    half = float(student.ppf(0.975, len(folds) - 1)) * spread
    interval = (value - half, value + half)
    kinds = sorted({f.manoeuvre for f in folds if f.manoeuvre})
    return {
        "closure": {"value": value, "lower": float(interval[0]), "upper": float(interval[1])},
        "errors": {
            "before": float(np.mean([f.before for f in folds])),
            "refit": float(refit.mean()),
            "effect": float(effect.mean()),
            "flexible": float(np.mean([f.flexible for f in folds])),
            "floor": _FLOOR,
        },
        "by_manoeuvre": [
            {
                "manoeuvre": kind,
                "refit": float(np.mean([f.refit for f in folds if f.manoeuvre == kind])),
                "effect": float(np.mean([f.effect for f in folds if f.manoeuvre == kind])),
            }
            for kind in kinds
        ],
        "why": "",
    }


def _ratio(refit: Array, effect: Array) -> float:
    gap = float(refit.mean()) - _FLOOR
    return (float(refit.mean()) - float(effect.mean())) / gap if gap > 0.05 else math.nan


def _row(fold: Fold) -> dict[str, Any]:
    return {**vars(fold), "chosen": list(fold.chosen)}
