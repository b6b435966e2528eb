"""Decisions on probabilities made by hand."""

from __future__ import annotations

import math
from collections.abc import Callable

from seatruth.diagnosis.decision import Decision, decide
from seatruth.diagnosis.hypotheses import Key
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.effects import available

SETTINGS = Settings()
EFFECTS = available()


def hypotheses(*entries: tuple[Key, float] | tuple[Key, float, bool]) -> list[Hypothesis]:
    found = [
        Hypothesis(entry[0], len(entry) == 3, 0.0, 0.0, entry[1], True) for entry in entries
    ]  # evidence and priors play no part in the decision
    return sorted(found, key=lambda one: -one.probability)


def decided(
    *entries: tuple[Key, float] | tuple[Key, float, bool],
    near: dict[frozenset[str], float] | None = None,
    refused: tuple[str, ...] = (),
    underpowered: bool = False,
    helps: Callable[[str, Key], bool] | None = None,
) -> Decision:
    distances = near or {}
    return decide(
        hypotheses(*entries),
        EFFECTS,
        SETTINGS,
        near=lambda a, b: distances.get(frozenset((a, b)), math.inf),
        helps=helps or (lambda name, key: name not in refused),
        underpowered=underpowered,
    )
