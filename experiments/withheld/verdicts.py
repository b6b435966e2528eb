"""The verdict that every diagnosing process writes: one form, checked before it is hashed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

KINDS = ("effects", "no_gap", "underpowered", "inseparable", "unknown")
CAUSE_FIELDS = ("cause", "effects", "probability")
FIELDS = ("case", "verdict", "effects", "candidates", "set", "places", "parameters", "closure", "next_trial")


def problems(verdict: Mapping[str, Any]) -> list[str]:
    """What is wrong with a verdict; empty where nothing is."""
    found = [f"it has no {name!r}" for name in FIELDS if name not in verdict]
    if found:
        return found
    if verdict["verdict"] not in KINDS:
        found.append(f"{verdict['verdict']!r} is no kind of verdict")
    candidates = verdict["candidates"]
    chances = [float(candidate["probability"]) for candidate in candidates]
    if any(not (math.isfinite(p) and -1e-9 <= p <= 1 + 1e-9) for p in chances):
        found.append("a probability is not between 0 and 1")
    elif sum(chances) > 1 + 1e-6:
        found.append("the probabilities sum to more than 1")
    if any(a < b - 1e-12 for a, b in itertools.pairwise(chances)):
        found.append("the candidates are not sorted")
    if verdict["verdict"] == "effects" and not verdict["effects"]:
        found.append("effects are declared, but none is named")
    if any(not set(CAUSE_FIELDS) <= set(cause) for cause in verdict.get("causes", ())):
        found.append(f"a cause lacks one of {', '.join(CAUSE_FIELDS)}")
    closure = verdict["closure"]
    if closure is not None and not {"value", "lower", "upper"} <= set(closure):
        found.append("closure lacks value, lower or upper")
    return found


def verdict(
    case: str, candidates: list[tuple[list[str], float]], *, declared: bool = True, **more: Any
) -> dict[str, Any]:
    """A verdict from candidates (effects, probability): the likeliest is declared.

    `more` are further fields, as places; those not given are empty.
    """
    ranked = sorted(candidates, key=lambda one: -one[1])
    best = ranked[0][0] if ranked else []
    kind = "no_gap" if not best else "unknown" if best == ["unknown"] else "effects"
    if not declared:
        kind, best = "underpowered", []
    return {
        "case": case,
        "verdict": kind,
        "effects": [] if kind in ("unknown", "no_gap") else sorted(best),
        "candidates": [{"effects": sorted(effects), "probability": p} for effects, p in ranked],
        "set": [],
        "places": [],
        "parameters": {},
        "closure": None,
        "next_trial": None,
        **more,
    }
