"""The next trial: which manoeuvre of a menu would tell best apart what these trials cannot.

The menu is made from what the trials themselves used: each input's range, the speeds and the length of the trials.
Each manoeuvre is simulated with the surviving causes; its gain is the smallest pairwise lambda over the pairs of
survivors with the new trial added, over that without it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from seatruth.gap.problem import Array, GapProblem, Indices
from seatruth.gap.search import Search
from seatruth.trials.trial import Trial, Trials

Say = Callable[[str], None]
_SURVIVORS = 4
_LEAST = 1e-3
_BEHIND = 12.0


@dataclass(frozen=True)
class Manoeuvre:
    """One entry of the menu: inputs over time from an initial state, in words."""

    name: str
    text: str
    trial: Trial


def menu(problem: GapProblem) -> list[Manoeuvre]:
    """Manoeuvres within what the recorded trials did: zigzags, turns both ways, steps of speed, a stop, all courses."""
    pattern = max(problem.trials, key=lambda trial: trial.duration)
    step = float(np.median(np.diff(pattern.t)))
    t = np.arange(0.0, pattern.duration + 0.5 * step, step)
    inputs = [channel.name for channel in problem.model.inputs]
    values = {name: np.concatenate([np.asarray(tr.inputs[name]) for tr in problem.trials]) for name in inputs}
    usual = {name: float(np.median(v)) for name, v in values.items()}
    drives = [n for n in inputs if abs(usual[n]) > 2.0 * float(np.std(values[n])) or n in ("n", "rpm")]
    steers = [n for n in inputs if n not in drives]
    full = {name: max(float(np.abs(v - usual[name]).max()), 1e-9) for name, v in values.items()}
    period = pattern.duration / 4.0
    wave = np.where(np.sin(2.0 * math.pi * t / period) >= 0.0, 1.0, -1.0)
    short = np.where(np.sin(2.0 * math.pi * t / (period / 2.5)) >= 0.0, 1.0, -1.0)
    plans: list[tuple[str, str, dict[str, Array]]] = []
    constant = {name: np.full(t.shape, usual[name]) for name in inputs}
    for name in steers:
        about = 0.0 if abs(usual[name]) < 0.2 * full[name] else usual[name]
        plans += [
            (
                f"zigzag of {name}",
                f"{name} hard over, alternating every {period / 2:.3g} s",
                {name: about + full[name] * wave},
            ),
            (
                f"small zigzag of {name}",
                f"{name} at a quarter, every {period / 5:.3g} s",
                {name: about + full[name] / 4 * short},
            ),
            (f"turn by +{name}", f"{name} hard over and held", {name: np.full(t.shape, about + full[name])}),
            (
                f"turn by -{name}",
                f"{name} hard over to the other side and held",
                {name: np.full(t.shape, about - full[name])},
            ),
        ]
    for name in drives:
        ramp = np.where(t < t[-1] / 3, 1.0, np.where(t < 2 * t[-1] / 3, 0.6, 1.0))
        stop = np.where(t < t[-1] / 4, 1.0, 0.0)
        plans += [
            (f"steps of {name}", f"{name} to 60 % and back, straight", {name: usual[name] * ramp}),
            (f"coast-down ({name} to zero)", f"{name} to zero after a quarter of the time", {name: usual[name] * stop}),
        ]
        for other in steers:
            slow = {name: np.full(t.shape, 0.6 * usual[name]), other: full[other] * wave}
            plans.append((f"slow zigzag of {other}", f"{name} at 60 %, {other} hard over, alternating", slow))
    plans.append(("straight run", "inputs held", {}))
    found = []
    for title, text, changed in plans:
        for turned, course in ((0.0, ""), (math.pi / 2, "beam course: "), (math.pi, "reciprocal course: ")):
            if turned and "psi" not in problem.outputs:
                continue
            found.append(_made(problem, pattern, t, {**constant, **changed}, f"{course}{title}", text, turned))
    return found


def _made(
    problem: GapProblem, pattern: Trial, t: Array, inputs: Mapping[str, Array], name: str, text: str, turned: float
) -> Manoeuvre:
    """A trial that begins as the pattern did, on a course turned by so much."""
    outputs = {}
    for output, series in pattern.outputs.items():
        finite = np.asarray(series)[np.isfinite(np.asarray(series))]
        first = float(finite[0]) if finite.size else 0.0
        if output == "psi":
            first += turned
        if output in ("v", "r", "p", "q", "phi"):
            first = 0.0
        outputs[output] = np.full(t.shape, first)
    return Manoeuvre(name, text, Trial(name, t, dict(inputs), outputs, synthetic=True))


def next_trial(search: Search, survivors: Sequence[str], say: Say) -> dict[str, Any] | None:
    """The manoeuvre with the largest gain, and how all of the menu compare; None with fewer than two survivors."""
    known = [name for name in dict.fromkeys(survivors) if (name,) in search.fits]
    top = max((search.fits[(name,)].evidence for name in known), default=0.0)
    # One that lies far behind has not survived; the two leaders are compared in any case.
    names = [n for k, n in enumerate(known) if k < 2 or search.fits[(n,)].evidence > top - _BEHIND][:_SURVIVORS]
    if len(names) < 2:
        return None
    problem = search.problem
    now = _information(search, problem, search.base.x, None)
    sizes = {n: search.fits[(n,)].x[problem.columns[n]] - problem.mean[problem.columns[n]] for n in names}
    before = _pairwise(problem, now, sizes)
    least = min(before.values())
    rows: list[dict[str, Any]] = []
    options = menu(problem)
    for k, option in enumerate(options):
        say(f"Next trial: {option.name} ({k + 1} of {len(options)})")
        try:
            more = _information(search, problem, search.base.x, option)
        except (ArithmeticError, ValueError):
            continue
        if more is None or now is None:
            continue
        after = _pairwise(problem, now + more, sizes)
        value = min(after.values())
        pair = min(after, key=lambda key: after[key])
        rows.append({"manoeuvre": option.name, "text": option.text, "lambda": value, "weakest": list(pair)})
    if not rows:
        return None
    rows.sort(key=lambda row: -row["lambda"])
    best = next(option for option in options if option.name == rows[0]["manoeuvre"])
    return {
        "manoeuvre": rows[0]["manoeuvre"],
        "text": rows[0]["text"],
        "survivors": names,
        "lambda_now": least,
        "lambda_then": rows[0]["lambda"],
        "gain": rows[0]["lambda"] / max(least, _LEAST),
        "pairs_now": [{"pair": list(pair), "lambda": value} for pair, value in before.items()],
        "menu": rows,
        "t": best.trial.t.tolist(),
        "inputs": {name: np.asarray(v).tolist() for name, v in best.trial.inputs.items()},
    }


def _information(search: Search, problem: GapProblem, x: Array, option: Manoeuvre | None) -> Array | None:
    """Information on coefficients and effects, initial states projected out, of the trials or of one more."""
    shared = _shared(problem)
    if option is None:
        A = problem.whole(search.base.x, search.floor)
        own: Array = A[:, problem.initial]
        return _projected(A[:, shared], own, problem.sd[problem.initial])
    values = dict(zip(problem.names, x))
    cost = problem.cost_of(problem.model, (), values, Trials([option.trial]))
    start = np.array([values.get(name, value) for name, value in zip(cost.names, cost.start)])
    derivatives = cost.jacobian(start)
    rows = max(int(group.rows.max()) for group in cost.groups if group.kind == "data") + 1
    derivatives = derivatives[:rows]
    if not np.isfinite(derivatives).all():
        return None
    step = float(np.median(np.diff(option.trial.t)))
    for group in cost.groups:
        if group.kind == "data":
            options = [c for c in search.floor.channels if c.channel == group.channel]
            if not options:
                derivatives[group.rows] = 0.0
                continue
            noise = min(options, key=lambda c: abs(math.log(c.step / step)))
            derivatives[group.rows] = noise.whiten(derivatives[group.rows])
    count = len(shared)
    order = [cost.names.index(problem.names[k]) for k in shared]
    own = np.delete(derivatives, order, axis=1)
    sd = np.full(own.shape[1], 1e3)
    found = _projected(derivatives[:, order], own, sd)
    assert found.shape == (count, count)
    return found


def _shared(problem: GapProblem) -> Indices:
    """Columns that all trials share: coefficients and effects."""
    return np.setdiff1d(np.arange(problem.size), problem.initial)


def _projected(A: Array, own: Array, sd: Array) -> Array:
    G = own.T @ own + np.diag(1.0 / sd**2)
    cross = own.T @ A
    return np.asarray(A.T @ A - cross.T @ np.linalg.solve(G, cross))


def _pairwise(
    problem: GapProblem, information: Array | None, sizes: Mapping[str, Array]
) -> dict[tuple[str, str], float]:
    """Smaller lambda of both directions for each pair, under the priors of coefficients and of the other effect."""
    assert information is not None
    shared = _shared(problem).tolist()
    at = {name: [shared.index(k) for k in problem.columns[name]] for name in sizes}
    held = [shared.index(k) for k in problem.coefficients]
    sd = problem.sd[shared]
    found = {}
    for a, b in itertools.combinations(sizes, 2):
        both = []
        for one, other in ((a, b), (b, a)):
            out = [*held, *at[other]]
            G = information[np.ix_(out, out)] + np.diag(1.0 / sd[out] ** 2)
            cross = information[np.ix_(out, at[one])]
            left = information[np.ix_(at[one], at[one])] - cross.T @ np.linalg.solve(G, cross)
            both.append(float(sizes[one] @ left @ sizes[one]))
        found[(a, b)] = min(both)
    return found
