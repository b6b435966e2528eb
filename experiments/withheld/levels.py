"""At which level of the tree of causes a verdict speaks, and whether it is right at that level."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

from seatruth.effects import available
from seatruth.effects.causes import CAUSES, ROOT, is_within
from withheld.same import twins

LEVELS = ("effect", "group", "family")
"""One effect; several effects under one node; a whole family of causes. In the order in which they get coarser."""


@functools.cache
def nodes() -> dict[str, frozenset[str]]:
    """Of each class of equivalent effects (`same.twins`), by its name, the nodes of all its members."""
    found: dict[str, set[str]] = {}
    for name, effect in available().items():
        found.setdefault(twins().get(name, name), set()).add(effect.cause)
    return {name: frozenset(of) for name, of in found.items()}


@functools.cache
def node_of(effect: str) -> str:
    """The node of an effect, or of the one of which it is the form on one actuator alone; "" of what is none."""
    whole = max((name for name in available() if effect == name or effect.startswith(f"{name}_")), key=len, default="")
    return available()[whole].cause if whole else ""


def _nodes_of(effect: str) -> frozenset[str]:
    return nodes().get(effect, frozenset({node_of(effect)} - {""}))


def named(verdict: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The causes that a verdict names: node, effects, probability. The root of the tree names nothing.

    Of a program that knows no tree, each effect that it declares is a cause at its own node, and a set that it declares
    instead is one cause at the finest node that holds all of it.
    """
    if verdict.get("failed"):
        return []
    if "causes" in verdict:
        return [dict(one) for one in verdict["causes"] if one["cause"] != ROOT and one["effects"]]
    best = float(verdict["candidates"][0]["probability"]) if verdict["candidates"] else 0.0
    if verdict["verdict"] == "effects":
        known = [name for name in verdict["effects"] if name in nodes()]
        return [{"cause": min(nodes()[name]), "effects": [name], "probability": best} for name in known]
    members = [name for name in verdict["set"] if name in nodes()]
    if verdict["verdict"] != "inseparable" or not members:
        return []
    holding = [node for node in CAUSES if all(any(is_within(n, node) for n in nodes()[name]) for name in members)]
    finest = max(holding, key=lambda node: node.count(".") + (node != ROOT))
    return [{"cause": finest, "effects": members, "probability": best}] if finest != ROOT else []


def level(cause: Mapping[str, Any]) -> str:
    """The level at which a cause is named."""
    if len(cause["effects"]) == 1:
        return "effect"
    return "group" if "." in cause["cause"] else "family"


def coarsest(causes: Sequence[Mapping[str, Any]]) -> str:
    """The level of a verdict: that of its coarsest cause; "" where it names none."""
    return max((level(cause) for cause in causes), key=LEVELS.index, default="")


def holds(cause: Mapping[str, Any], effects: Sequence[str]) -> bool:
    """Whether a named cause is right: some true effect lies at or below its node and is in its set."""
    return any(
        name in cause["effects"] and any(is_within(node, cause["cause"]) for node in _nodes_of(name))
        for name in effects
    )


def named_right(effects: Sequence[str], verdict: Mapping[str, Any]) -> bool:
    """Whether a verdict names something, and each cause that it names is right at the level at which it is named."""
    causes = named(verdict)
    return bool(causes) and all(holds(cause, effects) for cause in causes)
