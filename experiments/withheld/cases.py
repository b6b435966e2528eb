"""Drawing a case: a vehicle that is off its nominal coefficients, its trials, its cause at a wanted lambda."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from withheld.names import NAMES
from withheld.oracle import oracle_closure
from withheld.reality.families import Family, design, families
from withheld.reality.manoeuvres import Trial
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array, View
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record, make
from withheld.reality.trim import level
from withheld.referee import PRIOR, TELLS_APART, Point, left_over, signatures
from withheld.refit import judged, pairs, refit

STRATA = ((9.0, 25.0), (25.0, 100.0), (100.0, 400.0), (400.0, 10000.0))
KINDS = ("single", "double", "none", "outside", "confounded")
LEAST_STABLE = 0.06
"""Largest growth rate of a straight run, over U / L, that a drawn vehicle may have."""
TRIES = 12
ROUNDS, GROWTHS = 3, 5
"""How often trials are made anew with causes of another size, and sizes looked at under the same inputs."""
CLOSE = 0.07
"""Of the logarithm of lambda to the wanted one."""
LOOKALIKES = {
    "ship": ("current", "heading_bias", "speed_bias", "speed_scale", "thrust", "drag", "wind", "rudder_offset",
             "propeller_walk", "compass_deviation", "tether"),
    "mariner": ("current", "heading_bias", "speed_bias", "speed_scale", "drag", "wind", "compass_deviation", "tether"),
    "auv": ("speed_bias", "speed_scale", "current", "thrust", "drag", "tether", "asymmetry", "rudder_offset", "trim"),
}  # fmt: skip
"""Causes that few trials on one heading confound with others."""
LOOKALIKES |= {"tanker": LOOKALIKES["ship"], "container": LOOKALIKES["ship"], "torpedo": LOOKALIKES["auv"]}


@dataclass(frozen=True)
class Plan:
    """What a case is to be."""

    family: str
    kind: str
    causes: tuple[str, ...]
    stratum: int
    seed: int


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
    truth: dict[str, Any] = field(default_factory=dict)


def draw(plan: Plan) -> Case:
    """The case of a plan: the same seed gives the same case."""
    family = families()[plan.family]
    for attempt in range(TRIES):
        rng = np.random.default_rng([plan.seed, attempt])
        try:
            case = _once(plan, family, rng, attempt)
        except np.linalg.LinAlgError:
            continue  # the refit of a vehicle that diverges cannot be solved: another is drawn
        if case is not None:
            return case
    raise RuntimeError(f"no such case could be drawn: {plan}")


def _once(plan: Plan, family: Family, rng: np.random.Generator, attempt: int) -> Case | None:
    coefficients = drawn_coefficients(family, rng)
    noise = drawn_noise(family, rng)
    causes = [family.mechanism(key) for key in plan.causes]
    ordered = any(one.orders for one in causes) or bool(rng.random() < 0.5)
    trials = design(family, rng, poor=plan.kind == "confounded")
    noise_seed = int(rng.integers(2**62))

    def recorded(acting: Sequence[Present]) -> list[Record]:
        return make(family, trials, coefficients, acting, noise, np.random.default_rng(noise_seed), ordered)

    # Gear that lies between order and record shows only where the order was recorded.
    usable = [one for one in family.mechanisms if ordered or not one.orders]
    offered = [one for one in usable if one.key not in plan.causes and one.kind == "force"]
    picked = [offered[k] for k in rng.permutation(len(offered))[:2]]
    present = [Present(one, one.draw(rng)) for one in [*causes, *picked]]
    plain = recorded(())
    alone = [(p.mechanism.key + "!", [p]) for p in present]
    gram = signatures(family, plain, coefficients, noise, alone).projected()
    wanted = _targets(plan, rng)
    aims = [*wanted, *(float(rng.uniform(0.2, 1.2)) for _ in picked)]
    present = [
        _grown(p, math.sqrt(aim / max(float(gram[k, k]), 1e-12)))
        for k, (p, aim) in enumerate(zip(present, aims, strict=True))
    ]
    count = len(causes)
    main, others = present[:count], present[count:]
    for _ in range(4):
        # lambda goes with the square of a size only where nothing bends, with its fourth power where a force does.
        gram = signatures(
            family, plain, coefficients, noise, [(p.mechanism.key + "?", [p]) for p in others]
        ).projected()
        others = [
            _grown(p, (aim / max(float(gram[k, k]), 1e-9)) ** (1 / 3))
            for k, (p, aim) in enumerate(zip(others, aims[count:], strict=True))
        ]
    starts: list[Point | None] = [None] * count
    for _ in range(ROUNDS):
        # Pilots steer otherwise when a cause grows, so that its size has to be looked at again.
        records = recorded([*main, *others])
        sized = _sized(family, records, coefficients, noise, main, wanted, starts)
        if sized is None:
            return None  # of such a case nobody could say how large its cause is
        grown, starts = sized
        if grown == main:
            break
        main = grown
    else:
        records = recorded([*main, *others])
    if any(not np.isfinite(r.clean[name]).all() for r in records for name in family.outputs):
        return None
    case = Case(plan, family, coefficients, noise, trials, ordered, main, [(p, 0.0) for p in others], records)
    return _judged(case, usable, attempt, starts)


def _sized(
    family: Family,
    records: Sequence[Record],
    coefficients: Mapping[str, float],
    noise: Mapping[str, Noise],
    main: list[Present],
    wanted: Sequence[float],
    starts: list[Point | None],
) -> tuple[list[Present], list[Point | None]] | None:
    """Causes grown until their lambdas under the inputs of these records are the wanted ones, and refits to them; None
    where a refit does not settle.
    """
    powers, before, steps = [2.0] * len(main), [0.0] * len(main), [0.0] * len(main)
    for _ in range(GROWTHS if main else 0):
        fits = [judged(family, records, coefficients, noise, main, k, starts[k]).fit for k in range(len(main))]
        if not all(fit.settled for fit in fits):
            return None
        starts, now = [fit.point for fit in fits], [max(fit.left, 1e-9) for fit in fits]
        if all(abs(math.log(aim / own)) < CLOSE for aim, own in zip(wanted, now, strict=True)):
            break
        grown = []
        for k, p in enumerate(main):
            if before[k]:
                powers[k] = min(6.0, max(1.0, math.log(now[k] / before[k]) / steps[k]))
            grown.append(_grown(p, min(5.0, max(0.2, (wanted[k] / now[k]) ** (1 / powers[k])))))
        if grown == main:
            break
        steps = [_growth(p, then) for p, then in zip(main, grown, strict=True)]
        before = [own if abs(step) > 0.01 else 0.0 for own, step in zip(now, steps, strict=True)]
        main = grown
    return main, starts


def _grown(present: Present, factor: float) -> Present:
    """The mechanism larger by a factor, within what is believable of its typical magnitude."""
    one = present.mechanism
    name = max(one.grows, key=lambda name: abs(present.values[name]))
    typical = max(abs(float(values.get(name, 0.0))) for values in one.spans) or abs(present.values[name])
    size = abs(present.values[name])
    limit = one.most * typical / max(size, 1e-300)
    limit = 1.0 if abs(limit - 1.0) < 1e-9 else limit
    # At its limit it stays as it is, to the last digit.
    return Present(one, one.scaled(present.values, min(factor, limit))) if min(factor, limit) != 1.0 else present


def _growth(before: Present, after: Present) -> float:
    """Logarithm of the factor between two sizes of a mechanism."""
    name = max(before.mechanism.grows, key=lambda name: abs(before.values[name]))
    return math.log(abs(after.values[name]) / abs(before.values[name]))


def _targets(plan: Plan, rng: np.random.Generator) -> list[float]:
    low, high = STRATA[plan.stratum]
    return [float(math.exp(rng.uniform(math.log(low * 1.05), math.log(high * 0.95)))) for _ in plan.causes]


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
    """True noise: near the data sheet's size, a third to two thirds of it coloured."""
    found = {}
    for name, sd in family.noise.items():
        size = sd * float(np.exp(rng.normal(0.0, 0.12)))
        share = float(rng.uniform(0.2, 0.5))
        found[name] = Noise(
            size * math.sqrt(1 - share), size * math.sqrt(share), float(rng.uniform(0.3, 2.0)) * family.time
        )
    return found


def _judged(case: Case, usable: Sequence[Mechanism], attempt: int, starts: Sequence[Point | None]) -> Case | None:
    """The case with the referee's findings; None where it is not of the kind that was wanted.

    `starts` are refits to the same causes at other sizes.
    """
    family, plan = case.family, case.plan
    names = NAMES[family.name]
    named = [one for one in usable if one.key in names]
    variants = [(p.mechanism.key + "!", [p]) for p in case.causes]
    variants += [(p.mechanism.key + "?", [p]) for p, _ in case.distractors]
    found = signatures(family, case.records, case.coefficients, case.noise, variants)
    count = len(case.causes)
    gram = found.projected()
    keys = [p.mechanism.key for p in case.causes]
    linear = [left_over(gram, k, [j for j in range(count) if j != k]) for k in range(count)]
    raw = found.grams.sum(axis=0)[found.coefficients :, found.coefficients :]
    seen = [
        judged(family, case.records, case.coefficients, case.noise, case.causes, k, starts[k]) for k in range(count)
    ]
    if not all(one.fit.settled for one in seen):
        return None
    each = [one.fit.left for one in seen]
    if plan.kind == "confounded" and each[0] < 25.0 and attempt < TRIES - 1:
        return None
    others = [one for one in named if one.key not in keys]
    apart = [pairs(one, others) for one in seen]
    lookalikes = sorted({name for of in apart for name, value in of.items() if value < TELLS_APART})
    if plan.kind == "confounded" and not lookalikes and attempt < TRIES - 1:
        return None
    case.distractors = [(p, float(gram[count + k, count + k])) for k, (p, _) in enumerate(case.distractors)]
    offset = _offset(case)
    oracle = None
    if count:
        # With two causes the baseline has to be refitted to both at once.
        alone = seen[0].fit if count == 1 else refit(replace(seen[0].rig, free=()), seen[0].aim)
        oracle = oracle_closure(found, alone, family, case.records, case.noise, range(count), offset)
    case.truth = {
        "lambda": dict(zip(keys, each, strict=True)),
        "lambda_linear": dict(zip(keys, linear, strict=True)),
        "share_left": {key: each[k] / max(float(raw[k, k]), 1e-300) for k, key in enumerate(keys)},
        "pairs": {key: {names[name]: value for name, value in of.items()} for key, of in zip(keys, apart, strict=True)},
        "lookalikes": [names[name] for name in lookalikes],
        "oracle": oracle,
    }
    return case


def _offset(case: Case) -> Array:
    """Truth less prior mean, in standard deviations of the prior."""
    nominal = case.family.coefficients
    return np.array([(case.coefficients[name] - value) / (PRIOR * abs(value)) for name, value in nominal.items()])
