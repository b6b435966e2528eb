"""Where fits begin: those of runs that stray with the forces that the recorded motion asks for.

A model that lacks much runs so far from its record that a fit of whole runs ends anywhere. The equations of motion at
the recorded states need no simulation: over short blocks, the change of each recorded speed minus what the model's
equations give is linear in coefficients, discrepancy terms and forces (equation error, Klein and Morelli 2006, chapter
5). It is biased by sensor noise, but it is near, and the fit starts from it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from seatruth.arrays import Array, Flags
from seatruth.diagnosis.compensation import compensated, compensating
from seatruth.diagnosis.discrepancy.model import hats
from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.sizes import Sizes
from seatruth.models.black_box import BlackBox
from seatruth.models.motion_records import motion
from seatruth.simulate import evaluate_rhs, evaluate_rhs_jacobian
from seatruth.trials.trial import Trial

_BLOCKS = 6
"""Blocks between two knots over which rates are averaged. [S]"""
_ACCURACY = 0.05
"""Accuracy of an averaged rate, as a part of the usual one. [S]"""
_SIZE = 0.5
"""Prior size of discrepancy, as a part of the usual rate: wide, since the fit starts where something is missing. [S]"""


def from_equation_error(problem: Problem) -> Point | None:
    """The point whose coefficients, terms and forces meet the recorded rates.

    None where the record shows no speed, and for a black box, which has no equations. A speed that is not recorded is
    taken from positions, velocity over ground and angles.
    """
    model = problem.discrepancy
    if model is None or isinstance(model, BlackBox):
        return None
    order = [channel.name for channel in model.states]
    shown = [_shown(problem, trial, order) for trial in problem.trials]
    recorded = {name for states in shown for name, y in states.items() if np.isfinite(y).any()}
    known = [(e, name) for e, name in enumerate(problem.equations) if name in recorded]
    if not known:
        return None
    rows, targets = [], []
    columns = [*problem.coefficients, *problem.terms]
    names = [problem.unknowns[k].name for k in columns]
    values = {**problem.space.nominal(), **problem.named(problem.start)}
    theta = np.array([values[name] for name in names])
    knots, count = problem.settings.knots, len(problem.equations)
    for number, trial in enumerate(problem.trials):
        states = np.repeat(problem.base_states[number][None], len(trial), axis=0)
        valid = np.ones(len(trial), dtype=np.bool_)
        for k, name in enumerate(order):
            if name in shown[number]:
                states[:, k] = shown[number][name]
                valid &= np.isfinite(states[:, k])
        if valid.sum() < 3:
            return None
        t = np.asarray(trial.t)[valid]
        inputs = np.stack([np.asarray(trial.inputs[c.name])[valid] for c in model.inputs], axis=1)
        own = np.full(t.size, model.number_of(trial.name))
        for servo in model.servos:  # as if it were in time
            order_column = [channel.name for channel in model.inputs].index(servo.input)
            states[valid, order.index(servo.state)] = inputs[:, order_column]
        rates = evaluate_rhs(model, theta, names, values, states[valid], inputs, t, trial=own)
        slopes = evaluate_rhs_jacobian(model, theta, names, values, states[valid], inputs, t, trial=own)
        basis = hats(t - float(trial.t[0]), model.spacing, knots)
        blocks = max(2, round(trial.duration / model.spacing * _BLOCKS))
        edges = np.unique(np.linspace(0, len(t) - 1, blocks + 1).astype(int))
        for a, b in itertools.pairwise(edges):
            for e, name in known:
                k, scale = order.index(name), _ACCURACY * problem.usual[e]
                change = (states[valid][b, k] - states[valid][a, k]) / (t[b] - t[a])
                row = np.zeros(len(columns) + len(problem.trials) * count * knots)
                row[: len(columns)] = slopes[a : b + 1, k].mean(axis=0)
                at = len(columns) + (number * count + e) * knots
                row[at : at + knots] = basis[a : b + 1].mean(axis=0)
                rows.append(row / scale)
                targets.append((change - rates[a : b + 1, k].mean()) / scale)
    A, target = np.array(rows), np.array(targets)
    finite = np.isfinite(A).all(axis=1) & np.isfinite(target)
    options: list[tuple[float, int, Point]] = []
    for with_terms, with_coefficients in ((True, True), (False, True), (False, False)):
        kept = np.ones(A.shape[1], dtype=np.bool_)
        kept[: len(problem.coefficients)] = with_coefficients
        kept[len(problem.coefficients) : len(columns)] = with_terms
        step = _solved(problem, A[finite], target[finite], kept)
        shared = problem.start.shared.copy()
        shared[columns] = np.clip(shared[columns] + step[: len(columns)], problem.low[columns], problem.high[columns])
        point = Point(shared, problem.start.initial.copy(), step[len(columns) :].reshape(problem.start.forces.shape))
        errors = problem.errors(point)
        if np.isfinite(errors).all():
            channels = np.unique(problem.channel_of)
            scale = np.array([max(float(np.std(errors[problem.channel_of == c])), 1e-12) for c in channels])
            options.append((float((np.log(scale)).sum()), len(options), point))
    return min(options)[2] if options else None


def _shown(problem: Problem, trial: Trial, states: Sequence[str]) -> dict[str, Array]:
    """The states that a trial records, by name, and the motions that follow from other channels of its record."""
    found = {name: np.asarray(trial.outputs[name]) for name in states if name in trial.outputs}
    for name in problem.equations:
        series = None if name in found else motion(problem.study.model, trial, name)
        if series is not None:
            found[name] = np.interp(trial.t, *series)
    return found


def moved_to(problem: Problem, point: Point, name: str, values: Array) -> Point:
    """The point with an effect's parameters at other values, as far as their bounds allow.

    The state at the start to which it is added, if it is, moves the other way: what is recorded first stays met.
    """
    shared, initial = point.shared.copy(), point.initial
    columns = problem.columns[name]
    shared[columns] = np.clip(values, problem.low[columns], problem.high[columns])
    effect, change = problem.effects[name], (shared - point.shared)[columns]
    if effect.start and effect.start in problem.initial_names:
        own = [int(problem.model.number_of(trial.name)) for trial in problem.trials]
        initial = initial.copy()
        initial[:, problem.initial_names.index(effect.start)] -= change[own] if effect.each_trial else change.sum()
    return Point(shared, initial, point.forces)


def likely_values(problem: Problem, name: str, *, shown: bool = False) -> list[Array]:
    """Values (n,) of an effect's parameters at which it likely stands if it acts, or, with `shown`, that records show.

    The first of both are those that records show.
    """
    effect = problem.effects[name]
    found = [*effect.gross_values(list(problem.trials)), *(() if shown else effect.likely)]
    return [np.array([values.get(q.name, effect.null[q.name]) for q in effect.parameters]) for values in found]


def without_effects(problem: Problem, point: Point, names: Sequence[str]) -> Point:
    """The point with these effects at their prior means, where they vanish."""
    for name in names:
        point = moved_to(problem, point, name, problem.mean[problem.columns[name]])
    return point


def forces_instead(problem: Problem, point: Point, names: Sequence[str]) -> Point:
    """The point with these effects at their prior means, and each trial's own missing forces in their place.

    Where they only vanish, a long run that they held near its record strays or diverges.
    """
    bare = without_effects(problem, point, names)
    return Point(bare.shared, bare.initial, compensated(problem, point, bare.shared).forces)


def started(problem: Problem, near: Fit, name: str, values: Array) -> Point:
    """The point of a near fit with an effect at these values, its force taken from each trial's own missing ones.

    Where missing forces hold a run near its record, an effect added to them drives it away; in their place it does not.
    """
    return starting(problem, near)(name, values)


def starting(problem: Problem, near: Fit) -> Callable[[str, Array], Point]:
    """The same for any effect and values; the motion of the near fit is simulated once."""
    point = near.point
    if not near.discrepancy:
        return lambda name, values: moved_to(problem, point, name, values)
    instead = compensating(problem, point)

    def begin(name: str, values: Array) -> Point:
        moved = moved_to(problem, point, name, values)
        return Point(moved.shared, moved.initial, instead(moved.shared).forces)

    return begin


def stepped(problem: Problem, likelihood: Likelihood, sizes: Sizes, key: Sequence[str], start: Point) -> Point:
    """Where one full step from a point leads; the point itself where the model diverges there."""
    try:
        step = likelihood.solve(sizes, key)
    except np.linalg.LinAlgError:
        return start
    point = problem.moved(start, step.shared, step.local)
    return point if np.isfinite(problem.errors(point)).all() else start


def in_each_trial(problem: Problem, point: Point, name: str, own: str) -> Point:
    """The point with an effect's values in each trial's own ones, and the effect itself at its null."""
    like = problem.effects[name]
    values = dict(zip((q.name for q in like.parameters), point.shared[problem.columns[name]]))
    repeated = []
    for q in problem.effects[own].parameters:
        same = q.name if q.name in values else next(m for m in like.magnitudes if q.name.startswith(f"{m}_"))
        repeated.append(values[same])
    return moved_to(problem, without_effects(problem, point, [name]), own, np.array(repeated))


def in_all_trials(problem: Problem, point: Point, own: str, name: str) -> Point:
    """The point with the mean of each trial's own values of an effect in all trials, and those at their null."""
    order, values = [q.name for q in problem.effects[own].parameters], point.shared[problem.columns[own]]
    like = problem.effects[name]
    same = {m: [k for k, q in enumerate(order) if q.startswith(f"{m}_")] for m in like.magnitudes}
    means = [values[same.get(q.name) or [order.index(q.name)]].mean() for q in like.parameters]
    return moved_to(problem, without_effects(problem, point, [own]), name, np.array(means))


def _solved(problem: Problem, A: Array, target: Array, kept: Flags) -> Array:
    """Ridge regression under the priors of coefficients and wide ones of discrepancy; zero for what is not kept."""
    sd = np.concatenate(
        [
            problem.sd[problem.coefficients],
            _SIZE * problem.usual[problem.term_equation],
            np.tile(np.repeat(_SIZE * problem.usual, problem.settings.knots), len(problem.trials)),
        ]
    )
    scaled = (A * sd)[:, kept]
    step = np.zeros(A.shape[1])
    step[kept] = sd[kept] * np.linalg.solve(scaled.T @ scaled + np.eye(int(kept.sum())), scaled.T @ target)
    return step
