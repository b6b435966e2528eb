"""Verdicts and truths in the words in which they are scored.

Effects that the library declares equivalent to one another (`Effect.equivalent`) are one cause: no trial tells them
apart, so that naming either is the same answer. What they got as candidates is added up. A program that failed on a
case said nothing: what stands in for its verdict is no candidate.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from typing import Any

from seatruth.effects import available


def classes(equivalent: Mapping[str, Iterable[str]]) -> dict[str, str]:
    """Effect -> the first by name of all that are one with it, through others too; words that are no effect tie none.

    A coefficient that two effects name ties them neither: each may change more than that.
    """
    parent = {name: name for name in equivalent}

    def root(name: str) -> str:
        while parent[name] != name:
            name = parent[name]
        return name

    for name, others in equivalent.items():
        for other in others:
            if other in parent:
                a, b = sorted((root(name), root(other)))
                parent[b] = a
    return {name: root(name) for name in parent}


@functools.cache
def twins() -> dict[str, str]:
    """The classes of the installed effects."""
    return classes({name: effect.equivalent for name, effect in available().items()})


def one_name(effects: Iterable[str], twin: Mapping[str, str]) -> list[str]:
    """Names of a set of effects, each class by its first, sorted."""
    return sorted({twin.get(name, name) for name in effects})


def plain_truth(truth: Mapping[str, Any], twin: Mapping[str, str]) -> dict[str, Any]:
    """A truth in the words of the score; of pairwise lambdas to several of a class the smallest counts."""

    def least(values: Mapping[str, float], own: set[str]) -> dict[str, float]:
        found: dict[str, float] = {}
        for name, value in values.items():
            word = twin.get(name, name)
            if word not in own:
                found[word] = min(float(value), found.get(word, float("inf")))
        return found

    effects = one_name(truth["effects"], twin)
    own = set(effects)
    after = truth.get("next", {})
    # Of a verdict that suggests nothing there is one table for each trial that was tried instead.
    tables = any(isinstance(value, dict) for value in after.values())
    plain = {name: least(of, own) for name, of in after.items()} if tables else least(after, own)
    more = {"next": plain} if after else {}
    return {
        **truth,
        **more,
        "effects": effects,
        "set": one_name(truth["set"], twin),
        "pairs": {key: least(values, own) for key, values in truth["pairs"].items()},
    }


def plain_verdict(verdict: Mapping[str, Any], twin: Mapping[str, str]) -> dict[str, Any]:
    """A verdict in the words of the score."""
    chances: dict[tuple[str, ...], float] = {}
    if not verdict.get("failed"):
        for candidate in verdict["candidates"]:
            key = tuple(one_name(candidate["effects"], twin))
            chances[key] = chances.get(key, 0.0) + float(candidate["probability"])
    ranked = sorted(chances.items(), key=lambda one: -one[1])
    return {
        **verdict,
        "effects": one_name(verdict["effects"], twin),
        "set": one_name(verdict["set"], twin),
        **_causes(verdict, twin),
        "candidates": [{"effects": list(effects), "probability": chance} for effects, chance in ranked],
    }


def _causes(verdict: Mapping[str, Any], twin: Mapping[str, str]) -> dict[str, Any]:
    """The named causes, where a verdict lists them."""
    if "causes" not in verdict:
        return {}
    return {"causes": [{**cause, "effects": one_name(cause["effects"], twin)} for cause in verdict["causes"]]}
