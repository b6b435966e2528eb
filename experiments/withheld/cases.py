"""Drawing a case: a vehicle that is off its nominal coefficients, its trials, its cause at a wanted lambda."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from withheld.names import NAMES
from withheld.oracle import oracle_closure
from withheld.reality.families import Family, design, family_of
from withheld.reality.manoeuvres import Trial
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array, View
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record, make
from withheld.reality.trim import level
from withheld.referee import PRIOR, TELLS_APART, Point, Signatures, left_over, signatures, spans
from withheld.refit import Judged, judged, pairs, refit
from withheld.sizing import LADDER, at_lambda, grown_by, grown_to

STRATA = ((9.0, 25.0), (25.0, 100.0), (100.0, 400.0), (400.0, 10000.0))
KINDS = ("single", "double", "none", "outside", "confounded", "form", "form+single")
FORM_KINDS = ("form", "form+single")
"""Kinds in which the vehicle has another form than its model: nothing else acts, or one effect on top."""
LEAST_STABLE = 0.06
"""Largest growth rate of a straight run, over U / L, that a drawn vehicle may have."""
TRIES = 12
FORM_STEP = 0.1
"""Of a form's typical size, at which it is compared with effects: small, so that hardly anything bends."""
FORM_BESIDE = (25.0, 400.0)
"""lambda of another form beside an effect."""
ROUNDS = 2
"""How often trials are made anew with causes of another size."""
LOOKALIKES = {
    "ship": ("current", "heading_bias", "speed_bias", "speed_scale", "thrust", "drag", "wind", "rudder_offset",
             "propeller_walk", "compass_deviation", "tether"),
    "mariner": ("current", "heading_bias", "speed_bias", "speed_scale", "drag", "wind", "compass_deviation", "tether"),
    "auv": ("speed_bias", "speed_scale", "current", "thrust", "drag", "tether", "asymmetry", "rudder_offset", "trim"),
}  # fmt: skip
"""Causes that few trials on one heading confound with others."""
LOOKALIKES |= {"tanker": LOOKALIKES["ship"], "container": LOOKALIKES["ship"], "torpedo": LOOKALIKES["auv"]}
LOOKALIKES["twin"] = ("current", "heading_bias", "speed_bias", "speed_scale", "thrust", "drag", "wind", "tether",
                      "compass_deviation")  # fmt: skip
LOOKALIKES["frame"] = tuple(key for key in LOOKALIKES["twin"] if key != "wind")


@dataclass(frozen=True)
class Plan:
    """What a case is to be."""

    family: str
    kind: str
    causes: tuple[str, ...]
    stratum: int
    seed: int
    form: str = ""
    """Key of the other form that the vehicle has."""
    stated: bool = True
    """Whether the study states the data sheet's white noise."""
    water_log: bool = False
    """Whether the velocities are those through the water."""


@dataclass
class Case:
    """A case and everything that is to be sealed of it."""

    plan: Plan
    family: Family
    coefficients: dict[str, float]
    noise: dict[str, Noise]
    trials: list[Trial]
    ordered: bool
    causes: list[Present]
    distractors: list[tuple[Present, float]]
    records: list[Record]
    form: Present | None = None
    truth: dict[str, Any] = field(default_factory=dict)


class NotDrawn(Exception):
    """No case of a plan could be drawn."""


def draw(plan: Plan) -> Case:
    """The case of a plan: the same seed gives the same case. Raises NotDrawn."""
    family = family_of(plan.family, water_log=plan.water_log)
    for attempt in range(TRIES):
        rng = np.random.default_rng([plan.seed, attempt])
        try:
            # A vehicle that runs away while its cause is sized is told by its lambda, not by a warning.
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                case = _once(plan, family, rng, attempt)
        except np.linalg.LinAlgError:
            continue  # the refit of a vehicle that diverges cannot be solved: another is drawn
        if case is not None:
            return case
    raise NotDrawn(f"in {TRIES} tries no such case came out: {plan.family}, {plan.kind}, {', '.join(plan.causes)}")


def _once(plan: Plan, family: Family, rng: np.random.Generator, attempt: int) -> Case | None:
    coefficients = drawn_coefficients(family, rng)
    noise = drawn_noise(family, rng)
    acting = [family.mechanism(key) for key in plan.causes]
    if plan.form:
        keys = [one.key for one in family.forms]
        # A form that an effect mimics on these trials is left for the next.
        acting.append(family.forms[(keys.index(plan.form) + attempt) % len(keys)])
    ordered = any(one.orders for one in acting) or bool(rng.random() < 0.5)
    trials = design(family, rng, poor=plan.kind == "confounded")
    noise_seed = int(rng.integers(2**62))

    def recorded(acting: Sequence[Present]) -> list[Record]:
        return make(family, trials, coefficients, acting, noise, np.random.default_rng(noise_seed), ordered)

    # Gear that lies between order and record shows only where the order was recorded.
    usable = [one for one in family.mechanisms if ordered or not one.orders]
    offered = [one for one in usable if one.key not in plan.causes and one.kind == "force"]
    picked = [offered[k] for k in rng.permutation(len(offered))[:2]]
    present = [Present(one, one.draw(rng)) for one in [*acting, *picked]]
    plain = recorded(())
    if _ran_away(family, plain):
        return None
    count, wanted = len(acting), _targets(plan, rng)
    # One look at everything: the causes as drawn, each distractor on a ladder of sizes, what a form could be taken for.
    named = [one for one in usable if one.key in NAMES[family.name] and one.key not in plan.causes]
    variants = [(p.mechanism.key + "!", [p]) for p in present[:count]]
    rungs = [[Present(p.mechanism, p.mechanism.scaled(p.values, rung)) for rung in LADDER] for p in present[count:]]
    variants += [(f"{k}?", [p]) for k, ladder in enumerate(rungs) for p in ladder]
    checked = bool(plan.form) and attempt < TRIES - 1
    if plan.form:
        # At its typical size a form may send a vehicle round: a small one is looked at.
        present[count - 1] = Present(acting[-1], acting[-1].scaled(present[count - 1].values, FORM_STEP))
        variants[count - 1] = ("form", [present[count - 1]])
        variants += spans(named) if checked else []
    here = signatures(family, plain, coefficients, noise, variants)
    gram = here.projected()
    if checked and wanted[-1] * _share_unlike(here, gram, named) < TELLS_APART:
        return None  # an effect describes what this form does here: naming it would be no mistake
    main = [
        grown_by(p, math.sqrt(aim / max(float(gram[k, k]), 1e-12)))
        for k, (p, aim) in enumerate(zip(present[:count], wanted, strict=True))
    ]
    others = [
        at_lambda(p, np.diag(gram)[here.columns(f"{k}?")], float(rng.uniform(0.2, 1.2)))
        for k, p in enumerate(present[count:])
    ]
    starts: list[Point | None] = [None] * count
    seen: list[Judged] = []
    for _ in range(ROUNDS):
        # Pilots steer otherwise when a cause grows, so that its size has to be looked at again.
        records = recorded([*main, *others])
        if _ran_away(family, records):
            return None
        sized = grown_to(family, records, coefficients, noise, main, wanted, starts)
        if sized is None:
            return None  # of such a case nobody could say how large its cause is
        grown, seen = sized
        starts = [one.fit.point for one in seen]
        if grown == main:
            break
        main, seen = grown, []
    else:
        records = recorded([*main, *others])
    if _ran_away(family, records):
        return None
    seen = seen or [judged(family, records, coefficients, noise, main, k, starts[k]) for k in range(count)]
    if not all(one.fit.settled for one in seen):
        return None
    form = main.pop() if plan.form else None
    case = Case(plan, family, coefficients, noise, trials, ordered, main, [(p, 0.0) for p in others], records, form)
    return _judged(case, usable, attempt, seen)


def _ran_away(family: Family, records: Sequence[Record]) -> bool:
    return any(not np.isfinite(r.clean[name]).all() for r in records for name in family.outputs)


def _share_unlike(here: Signatures, gram: Array, effects: Sequence[Mechanism]) -> float:
    """Share of a form's lambda that is left when the most similar effect acts in its place, to first order."""
    form = here.columns("form")[0]
    left = min(left_over(gram, form, here.columns(one.key)) for one in effects)
    return left / max(float(gram[form, form]), 1e-300)


def _targets(plan: Plan, rng: np.random.Generator) -> list[float]:
    def one(low: float, high: float) -> float:
        return float(math.exp(rng.uniform(math.log(low * 1.05), math.log(high * 0.95))))

    wanted = [one(*STRATA[plan.stratum]) for _ in plan.causes]
    # Beside a cause a form is of middling strength: one that buries the cause asks nothing of a diagnosis.
    between = STRATA[plan.stratum] if plan.kind == "form" else FORM_BESIDE
    return [*wanted, one(*between)] if plan.form else wanted


def drawn_coefficients(family: Family, rng: np.random.Generator) -> dict[str, float]:
    """Every coefficient 10 to 20 % off, to either side; vehicles that run away from a straight course are not drawn."""
    while True:
        off = rng.choice((-1.0, 1.0), len(family.coefficients)) * rng.uniform(0.10, 0.20, len(family.coefficients))
        found = {
            name: value * (1 + float(d)) for (name, value), d in zip(family.coefficients.items(), off, strict=True)
        }
        if growth(family, found) * family.time < LEAST_STABLE:
            return found


def growth(family: Family, coefficients: Mapping[str, float]) -> float:
    """Largest real part of the eigenvalues of straight, level motion (1/s), positions left out."""
    p = {name: np.full(7, value) for name, value in {**family.sizes, **coefficients}.items()}
    steady = level(family, coefficients)
    s = np.zeros((6, 7))
    s[0], s[1], s[5] = steady.u, steady.w, steady.angle
    rows = [0, 1, 2] if family.vehicle.earth_current else [0, 1, 2, 5]
    step = np.zeros((6, 7))
    for k, row in enumerate(rows):
        step[row, k + 1] = 1e-5
    s = s + step
    none = np.zeros(7)
    view = View(
        0.0, s[0], s[1], s[2], s[3], s[4], s[5], np.zeros((4, 7)), none, none, none, none,
        none + steady.delta, np.full(7, family.revolutions),
    )  # fmt: skip
    rates = np.stack(family.vehicle.rates(view, p, none, none, none))
    jacobian = np.stack([(rates[rows, k + 1] - rates[rows, 0]) / 1e-5 for k in range(len(rows))], axis=1)
    return float(np.linalg.eigvals(jacobian).real.max())


def drawn_noise(family: Family, rng: np.random.Generator) -> dict[str, Noise]:
    """True noise of every channel: white as the data sheet has it, nearly, and a slow error that no sheet states."""
    return {name: Noise.drawn(rng, sd) for name, sd in family.noise.items()}


def _judged(case: Case, usable: Sequence[Mechanism], attempt: int, seen: Sequence[Judged]) -> Case | None:
    """The case with the referee's findings; None where it is not of the kind that was wanted.

    `seen` are the refits to each of what acts.
    """
    family, plan = case.family, case.plan
    names = NAMES[family.name]
    named = [one for one in usable if one.key in names]
    acting = [*case.causes, *([case.form] if case.form else [])]
    variants = [(p.mechanism.key + "!", [p]) for p in acting]
    variants += [(p.mechanism.key + "?", [p]) for p, _ in case.distractors]
    found = signatures(family, case.records, case.coefficients, case.noise, variants)
    count, causes = len(acting), len(case.causes)
    gram = found.projected()
    keys = [p.mechanism.key for p in acting]
    linear = [left_over(gram, k, [j for j in range(count) if j != k]) for k in range(count)]
    raw = found.grams.sum(axis=0)[found.coefficients :, found.coefficients :]
    each = [one.fit.left for one in seen]
    last = attempt == TRIES - 1
    if plan.kind == "confounded" and each[0] < 25.0 and not last:
        return None
    others = [one for one in named if one.key not in keys]
    apart = [pairs(one, others) for one in seen[:causes]]
    lookalikes = sorted({name for of in apart for name, value in of.items() if value < TELLS_APART})
    if plan.kind == "confounded" and not lookalikes and not last:
        return None
    case.distractors = [(p, float(gram[count + k, count + k])) for k, (p, _) in enumerate(case.distractors)]
    oracle = None
    if causes:
        # With more than one thing acting the baseline has to be refitted to all at once.
        alone = seen[0].fit if count == 1 else refit(replace(seen[0].rig, free=()), seen[0].aim)
        oracle = oracle_closure(
            found, alone, case.records, case.noise, range(count), _offset(case), known=range(causes)
        )
    case.truth = {
        "lambda": dict(zip(keys[:causes], each, strict=False)),
        "lambda_linear": dict(zip(keys[:causes], linear, strict=False)),
        "share_left": {key: each[k] / max(float(raw[k, k]), 1e-300) for k, key in enumerate(keys[:causes])},
        "pairs": {
            key: {names[name]: value for name, value in of.items()}
            for key, of in zip(keys[:causes], apart, strict=True)
        },
        "lookalikes": [names[name] for name in lookalikes],
        "form": {"key": keys[-1], "values": dict(case.form.values), "lambda": each[-1]} if case.form else None,
        "oracle": oracle,
    }
    return case


def _offset(case: Case) -> Array:
    """Truth less prior mean, in standard deviations of the prior."""
    nominal = case.family.coefficients
    return np.array([(case.coefficients[name] - value) / (PRIOR * abs(value)) for name, value in nominal.items()])
