"""The ways in which a mechanism can act, as the generator draws them: directions, signs, periods, phases, sizes.

Each way is one column or a mixture of two neighbours' (a direction between two that were run). A way has rungs: sizes
at which its signature was run, so that what bends with the size has its own shape at each. Sizes are told by lambda.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from withheld.cases import STRATA
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array
from withheld.reality.simulate import Present
from withheld.referee import Variant

SHARES = (0.05, 0.3, 1.0)
"""Rungs, in typical magnitudes; the last one is the largest believable size."""
SIDES, MIXED = 24, 4
"""Directions in which what is no plain vector is run; ways between two of them."""
QUARTERS = 4
"""Directions of a vector, which the others are sums of."""
SEEDS = 12
"""Phases of a sea: more than the ten that its five components have."""
PERIODS = 4
"""Of a current that rises."""
STEP = 0.5
"""Between sizes, in square roots of lambda: half of what a size is uncertain by."""


@dataclass(frozen=True)
class Way:
    """Labels of its columns by rung, one or two of them, and the weights of a mixture."""

    labels: tuple[str, ...]
    weights: tuple[float, ...]


@dataclass(frozen=True)
class Sizes:
    """A prior of lambda: grid (J,) and log-probabilities (J,)."""

    lambdas: Array
    logs: Array


def sizes(strata: Sequence[tuple[float, float]]) -> Sizes:
    """Each stratum as likely as another, even in the logarithm inside each: as the generator asks for them."""
    roots = np.arange(math.sqrt(strata[0][0]), math.sqrt(strata[-1][1]), STEP)
    lambdas = roots**2
    density = np.zeros(len(roots))
    for low, high in strata:
        inside = (lambdas >= low) & (lambdas < high)
        density[inside] = 1 / math.log(high / low) / roots[inside]
    return Sizes(lambdas, np.log(np.maximum(density, 1e-300) / density.sum()))


ANY, STRONG = sizes(STRATA), sizes(STRATA[1:])
LOOSE = sizes([(1.0, 1e6)])
"""Where a refit takes up nearly all of a signature: lambda to first order says little of the one that is left there."""


def rungs(one: Mechanism) -> tuple[float, ...]:
    """Sizes at which a mechanism is run, in typical magnitudes."""
    return (*SHARES, one.most)


def ways(one: Mechanism, true_direction: float | None = None) -> tuple[list[Way], list[Variant]]:
    """The ways of a mechanism and what has to be run for them; a label is that of a way at the size 1, "@" and a rung.

    The phases of a sea are summed over where it runs to a `direction`; the number of directions that its phases along a
    track tell apart is far too large to run them all. One is the true one, where there is one, and the others stand
    for all that are wrong.
    """
    rng = np.random.default_rng(0)
    drawn = one.draw(rng)
    found: list[Way] = []
    values: dict[str, dict[str, float]] = {}

    def around(names: tuple[str, str], size: float, tag: str, sides: int, **other: float) -> None:
        mixed = MIXED * SIDES // sides
        for k in range(sides):
            angle = 2 * math.pi * k / sides
            values[f"{one.key}{tag}{k}"] = {
                names[0]: size * math.cos(angle), names[1]: size * math.sin(angle), **other
            }  # fmt: skip
        width = 2 * math.pi / sides
        for k in range(sides):
            for j in range(mixed):
                part = (j + 0.5) / mixed * width
                pair = (math.sin(width - part) / math.sin(width), math.sin(part) / math.sin(width))
                found.append(Way((f"{one.key}{tag}{k}", f"{one.key}{tag}{(k + 1) % sides}"), pair))

    if "seed" in drawn:
        return _seas(one, drawn, true_direction)
    plane = next((names for names in (("north", "east"), ("A", "B")) if set(names) <= set(one.grows)), None)
    if plane:
        size = math.hypot(*(drawn[name] for name in plane))
        if "period" in drawn:
            periods = [one.draw(rng)["period"] for _ in range(400)]
            for j, period in enumerate(np.quantile(periods, (np.arange(PERIODS) + 0.5) / PERIODS)):
                around(plane, size, f"p{j}d", QUARTERS, period=float(period))
        else:
            around(plane, size, "d", SIDES if one.kind == "force" else QUARTERS)
    elif "direction" in drawn:
        for k in range(SIDES):
            values[f"{one.key}d{k}"] = {**drawn, "direction": 2 * math.pi * k / SIDES}
        for k in range(SIDES):
            for j in range(MIXED):
                part = (j + 0.5) / MIXED
                labels = (f"{one.key}d{k}", f"{one.key}d{(k + 1) % SIDES}")
                found.append(Way(labels, (1 - part, part)))
    else:
        each = {tuple(sorted(one.draw(rng).items())) for _ in range(64)}
        for k, items in enumerate(sorted(each)):
            values[f"{one.key}s{k}"] = dict(items)
            found.append(Way((f"{one.key}s{k}",), (1.0,)))
    return found, [
        (f"{label}@{r}", [Present(one, one.scaled(own, share))])
        for label, own in values.items()
        for r, share in enumerate(rungs(one))
    ]


def _seas(one: Mechanism, drawn: dict[str, float], true: float | None) -> tuple[list[Way], list[Variant]]:
    """Seas of several directions; a label stands for all phases of one."""
    angles = [2 * math.pi * (k + 0.37) / 4 for k in range(4)] + ([] if true is None else [true])
    ways = [Way((f"{one.key}d{k}",), (1.0,)) for k in range(len(angles))]
    variants: list[Variant] = [
        (f"{one.key}d{k}/{j}", [Present(one, {**drawn, "direction": angle, "seed": 17.0 * j + 3.0})])
        for k, angle in enumerate(angles)
        for j in range(SEEDS)
    ]
    return ways, variants
