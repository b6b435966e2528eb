"""How large a cause has to be for a wanted lambda: it is grown and judged again until it comes near."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from withheld.reality.families import Family
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present, Record
from withheld.referee import Point
from withheld.refit import Judged, judged

GROWTHS = 3
"""How often sizes are looked at under the same inputs."""
LADDER = tuple(4.0**k for k in range(-5, 3))
"""Sizes at which a distractor is looked at, in multiples of the typical one."""
CLOSE = 0.3
"""Of the logarithm of lambda to the wanted one: what is sealed is the lambda that came out, so that hitting the wanted
one closely would only cost refits."""


def grown_to(
    family: Family,
    records: Sequence[Record],
    coefficients: Mapping[str, float],
    noise: Mapping[str, Noise],
    main: list[Present],
    wanted: Sequence[float],
    starts: list[Point | None],
) -> tuple[list[Present], list[Judged]] | None:
    """Causes grown until their lambdas under the inputs of these records are the wanted ones, and the last judgement
    of them, which is of their final size where nothing grew; None where a refit does not settle.
    """
    seen: list[Judged] = []
    powers, before, steps = [2.0] * len(main), [0.0] * len(main), [0.0] * len(main)
    for _ in range(GROWTHS if main else 0):
        seen = [judged(family, records, coefficients, noise, main, k, starts[k]) for k in range(len(main))]
        if not all(one.fit.settled for one in seen):
            return None
        now = [max(one.fit.left, 1e-9) for one in seen]
        if all(abs(math.log(aim / own)) < CLOSE for aim, own in zip(wanted, now, strict=True)):
            break
        grown = []
        for k, p in enumerate(main):
            if before[k]:
                powers[k] = min(6.0, max(1.0, math.log(now[k] / before[k]) / steps[k]))
            grown.append(grown_by(p, min(5.0, max(0.2, (wanted[k] / now[k]) ** (1 / powers[k])))))
        starts = [_ahead(one, p, then) for one, p, then in zip(seen, main, grown, strict=True)]
        if grown == main:
            break
        steps = [_growth(p, then) for p, then in zip(main, grown, strict=True)]
        before = [own if abs(step) > 0.01 else 0.0 for own, step in zip(now, steps, strict=True)]
        main = grown
    return main, seen


def at_lambda(present: Present, lambdas: Array, aim: float) -> Present:
    """A distractor at the size of the ladder (between its rungs) at which its lambda is the one aimed at."""
    size = math.exp(float(np.interp(math.log(aim), np.log(np.maximum.accumulate(lambdas) + 1e-12), np.log(LADDER))))
    return Present(present.mechanism, present.mechanism.scaled(present.values, size))


def grown_by(present: Present, factor: float) -> Present:
    """The mechanism larger by a factor, within what is believable of its typical magnitude."""
    one = present.mechanism
    name = max(one.grows, key=lambda name: abs(present.values[name]))
    typical = max(abs(float(values.get(name, 0.0))) for values in one.spans) or abs(present.values[name])
    size = abs(present.values[name])
    limit = one.most * typical / max(size, 1e-300)
    limit = 1.0 if abs(limit - 1.0) < 1e-9 else limit
    # At its limit it stays as it is, to the last digit.
    return Present(one, one.scaled(present.values, min(factor, limit))) if min(factor, limit) != 1.0 else present


def _ahead(seen: Judged, before: Present, after: Present) -> Point:
    """Where the refit of a cause of another size will end, to first order."""
    share, true, found = math.exp(_growth(before, after)), seen.rig.truth(), seen.fit.point
    return Point(share * found.moved, true.sizes + share * (found.sizes - true.sizes), share * found.firsts)


def _growth(before: Present, after: Present) -> float:
    """Logarithm of the factor between two sizes of a mechanism."""
    name = max(before.mechanism.grows, key=lambda name: abs(before.values[name]))
    return math.log(abs(after.values[name]) / abs(before.values[name]))
