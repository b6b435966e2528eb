"""The limit: the verdict of the best possible program, which knows reality's forms, noise and priors, not the cause.

It reads the sealed part of a case: true coefficients and noise, and reality's own simulation. So it is scored beside
the diagnosing programs and is none of them. All mechanisms of the catalogue, those outside the library and the other
forms are compared by their evidence, with

- the true covariance of the noise (white and slow parts) and all first states projected out,
- the coefficients marginalised under the priors that the study hands out, and the distractors under theirs,
- sizes, directions and signs as the generator draws them (`ways.py`): lambda even in the logarithm over the strata of
  the kind of case, up to the largest believable size,
- kinds of cases as probable as the generator makes them.

Signatures are those of whole changes of several sizes; what the coefficients take up is linear. All is run about two
points: the refit of reality's own baseline, where the coefficients stand of one who holds that nothing acts, and the
true coefficients, where those of one stand who knows what does. "Nothing" is judged at the first, where its optimum is;
of every other answer the higher evidence counts, as its optimum lies near one of both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from seatruth.effects.causes import ROOT, ancestors
from withheld.cases import FORM_BESIDE, LOOKALIKES
from withheld.levels import node_of
from withheld.names import NAMES, UNKNOWN
from withheld.next_trial import read, sealed_family
from withheld.programs.common import Rows
from withheld.programs.evidence import NOTHING, Menu, alone, both, evidence, log_sum, other_ways
from withheld.programs.ways import ANY, SEEDS, STRONG, Way, rungs, sizes, ways
from withheld.reality.families import Family
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present
from withheld.referee import PRIOR, Rig, Signatures, Variant, marginal
from withheld.refit import ABSORBED, refit
from withheld.verdicts import verdict

POOR = 4
"""Trials of a case whose causes are confounded on purpose; others have more."""
DISTRACTION = 0.7
"""Mean lambda of a distractor; two act in every case."""
SAYS = 0.8
"""Probability from which a node of the tree is named [S]: a verdict says the finest that reaches it."""
SHARES = {"single": 0.33, "double": 0.08, "none": 0.09, "outside": 0.09, "form": 0.14, "form+single": 0.19}
"""Prior probabilities of the kinds, where the trials are not poor: the generator's shares."""
SEA_FOUND = -6.0
"""Log-probability that a sea runs within what its phases along a track tell of the true direction: over the whole
circle some 0.005 rad, for tracks of five lengths and waves of one to two at lambda 100 [S]."""
BESIDE = sizes([FORM_BESIDE])


def limit(truth: Mapping[str, Any], public: Path) -> dict[str, Any]:
    """The verdict of the best possible program on one case; `truth` is the sealed part."""
    family = sealed_family(truth)
    usable = [one for one in family.mechanisms if truth["ordered"] or not one.orders]
    poor = len(truth["trials"]) == POOR and len({trial["heading"] for trial in truth["trials"]}) == 1
    named = [one for one in usable if one.key in NAMES[family.name]]
    if poor:
        named = [one for one in named if one.key in LOOKALIKES[family.name]]
    outside = [one for one in usable if one.number is None]
    menus = _menus(family, truth, public, [*named, *outside, *family.forms])
    logs = [_log_posteriors(menu, len(named), len(outside), poor) for menu in menus]
    log = {key: max(menu.nothing + of[key] for menu, of in zip(menus, logs, strict=True)) for key in logs[0]}
    if () in log:
        log[()] = menus[0].nothing + logs[0][()]
    return _said(truth["case"], log, [NAMES[family.name][one.key] for one in named])


def _menus(family: Family, truth: Mapping[str, Any], public: Path, menu: Sequence[Mechanism]) -> list[Menu]:
    """All that could have acted, run about the refit of the baseline to what did, and about the truth."""
    records = read(family, truth, public)
    noise = {name: Noise(*values) for name, values in truth["noise"].items()}
    acting = [*truth["causes"], *truth["distractors"], *([truth["form"]] if truth["form"] else [])]
    present = [Present(family.mechanism(one["key"]), one["values"]) for one in acting]
    rig = Rig(family, records, truth["coefficients"], noise)
    aim = rig.outputs(present)
    for k, record in enumerate(records):
        record.clean.update({name: aim[: len(record.t), j, k] for j, name in enumerate(family.outputs)})
    towards = {one["key"]: one["values"].get("direction") for one in truth["causes"]}
    found = [ways(one, towards.get(one.key)) for one in menu]
    variants: list[Variant] = [variant for _, more in found for variant in more]
    nominal = family.coefficients
    off = np.array([(truth["coefficients"][name] - value) / (PRIOR * abs(value)) for name, value in nominal.items()])
    result = []
    for point in (refit(rig, aim).point, rig.truth()):
        here = rig.look(point, variants, aim)
        result.append(_about(here, off + point.moved, menu, [of for of, _ in found]))
    return result


def _about(here: Signatures, off: Array, menu: Sequence[Mechanism], found: Sequence[Sequence[Way]]) -> Menu:
    """The menu about one point, which lies `off` (K,) the nominal coefficients in deviations of their priors."""
    size, last = here.coefficients, here.whitened[0].shape[1] - 1
    gram = here.grams.sum(axis=0)
    for whitened, drawn in zip(here.whitened, here.noise, strict=True):
        cross = whitened.T @ drawn
        gram[:, last] += cross
        gram[last, :] += cross
        gram[last, last] += float(drawn @ drawn)
    # What is known of the coefficients: rows of their own under the data, about the study's nominal values.
    gram[:size, last] -= off
    gram[last, :size] -= off
    gram[last, last] += float(off @ off)
    raw = np.diag(gram)[size:].copy()
    gram = marginal(gram, size)
    at = {label: k for k, label in enumerate(here.labels)}
    forces = [at[f"{label}@1"] for one, of in zip(menu, found, strict=True) if one.kind == "force"
              for label in dict.fromkeys(way.labels[0] for way in of) if f"{label}@1" in at]  # fmt: skip
    first = [of[0].labels[0] for of in found]
    typical = [at[f"{label}@2"] if f"{label}@2" in at else at[f"{label}/0"] for label in first]
    loose = [bool(gram[k, k] < ABSORBED * raw[k]) for k in typical]
    gram = _without_distractors(gram, forces)
    return _candidates(gram, at, menu, found, loose)


def _without_distractors(gram: Array, forces: Sequence[int]) -> Array:
    """A Gram matrix after small sizes of all forces are marginalised, as two of them act unseen in every case."""
    sd = np.sqrt(2 * DISTRACTION / len(forces) / np.maximum(np.diag(gram)[forces], NOTHING))
    own = gram[np.ix_(forces, forces)] * np.outer(sd, sd) + np.eye(len(forces))
    cross = gram[forces] * sd[:, None]
    return np.asarray(gram - cross.T @ np.linalg.solve(own, cross))


def _candidates(
    gram: Array, at: Mapping[str, int], menu: Sequence[Mechanism], found: Sequence[Sequence[Way]], loose: list[bool]
) -> Menu:
    """Ways and rungs as combinations of the columns that were run."""
    last = len(gram) - 1
    columns: list[Array] = []
    shapes: list[Rows] = []
    logs: list[Array] = []
    for one, of in zip(menu, found, strict=True):
        seas = f"{of[0].labels[0]}/0" in at
        begin = len(columns)
        for way in of:
            for r in range(1 if seas else len(rungs(one))):
                column = np.zeros(len(gram))
                if seas:
                    own = [at[f"{way.labels[0]}/{j}"] for j in range(SEEDS)]
                    column[own] = _sea(gram, own)
                else:
                    for label, weight in zip(way.labels, way.weights, strict=True):
                        column[at[f"{label}@{r}"]] += weight
                columns.append(column)
        shapes.append(np.arange(begin, len(columns)).reshape(len(of), -1))
        chances = np.full(len(of), -math.log(len(of)))
        if seas and len(of) > 4:
            chances = np.array([-math.log(4)] * 4 + [SEA_FOUND])
        if seas:
            chances = chances + _phases(gram, [[at[f"{way.labels[0]}/{j}"] for j in range(SEEDS)] for way in of])
        logs.append(chances)
    C = np.stack(columns, axis=1)
    crossed = gram @ C
    return Menu(C.T @ crossed, crossed[last], shapes, logs, loose, -0.5 * float(gram[last, last]))


def _sea(gram: Array, own: Sequence[int]) -> Array:
    """The combination of phases that fits the data best, of the strength that is most likely."""
    a = gram[np.ix_(own, own)]
    return np.asarray(np.linalg.solve(a + 0.05 * np.trace(a) / len(own) * np.eye(len(own)), gram[own, -1]))


def _phases(gram: Array, ways: Sequence[Sequence[int]]) -> Array:
    """What the choice of the best phases is charged with, (ways,): log-evidence of normal ones less the best's."""
    charged = []
    for own in ways:
        a, b = gram[np.ix_(own, own)], gram[own, -1]
        scale = max(float(np.trace(a)) / len(own), NOTHING)
        best = _sea(gram, own)
        top = float(best @ b - 0.5 * best @ a @ best)
        lambdas = ANY.lambdas[::6]
        sds = np.sqrt(lambdas / scale / len(own))
        normal = evidence(gram, list(own), np.repeat(sds[:, None], len(own), axis=1))
        charged.append(min(0.0, float(np.logaddexp.reduce(normal + ANY.logs[::6] - log_sum(ANY.logs[::6]))) - top))
    return np.array(charged)


def _log_posteriors(menu: Menu, named: int, outside: int, poor: bool) -> dict[tuple[int, ...], float]:
    """Log posterior (not normalised) of every answer: numbers of named mechanisms; (-1,) is outside the library."""
    if poor:
        return {(k,): log_sum(alone(menu, k, STRONG)) for k in range(named)}
    share = {kind: math.log(value) for kind, value in SHARES.items()}
    forms = range(named + outside, len(menu.shapes))
    beyond = [other_ways(menu, k, STRONG) for k in range(len(menu.shapes))]
    found: dict[tuple[int, ...], float] = {(): share["none"]}
    of_outside = [share["outside"] - math.log(outside) + log_sum(alone(menu, k, ANY)) for k in range(named, forms[0])]
    of_forms = [share["form"] - math.log(len(forms)) + log_sum(alone(menu, k, STRONG)) for k in forms]
    found[-1,] = log_sum(np.array([*of_outside, *of_forms]))
    for i in range(named):
        with_forms = log_sum(np.array([both(menu, (i, k), (STRONG, BESIDE), beyond) for k in forms]))
        of_it = [
            share["single"] + log_sum(alone(menu, i, ANY)),
            share["form+single"] - math.log(len(forms)) + with_forms,
        ]
        found[i,] = log_sum(np.array(of_it)) - math.log(named)
        for j in range(i):
            pair = both(menu, (j, i), (STRONG, STRONG), beyond)
            found[j, i] = share["double"] - math.log(named * (named - 1) / 2) + pair
    return found


def _said(case: str, log: Mapping[tuple[int, ...], float], names: Sequence[str]) -> dict[str, Any]:
    """The verdict: all answers with their probabilities, and of the likeliest the finest nodes that are sure enough."""
    keys = list(log)
    value = np.array([log[key] for key in keys])
    weight = np.exp(value - value.max())
    chance = weight / weight.sum()
    candidates = [
        ([UNKNOWN] if key == (-1,) else sorted(names[k] for k in key), float(p))
        for key, p in zip(keys, chance, strict=True)
    ]
    candidates.sort(key=lambda one: -one[1])
    best = [name for name in candidates[0][0] if name != UNKNOWN]
    causes = [cause for cause in (finest(name, candidates) for name in best) if cause]
    kinds = {"effects": all(len(c["effects"]) == 1 for c in causes)}
    declared = "effects" if causes and kinds["effects"] else "inseparable" if causes else ""
    said = verdict(case, candidates, causes=causes)
    if declared:
        single = [c["effects"][0] for c in causes if len(c["effects"]) == 1]
        sets = sorted({name for c in causes if len(c["effects"]) > 1 for name in c["effects"]})
        said |= {"verdict": declared, "effects": single if declared == "effects" else [], "set": sets}
    elif best:
        said |= {"verdict": "underpowered", "effects": []}
    return said


def finest(effect: str, candidates: Sequence[tuple[Sequence[str], float]], says: float = SAYS) -> dict[str, Any] | None:
    """The finest node above an effect that reaches the probability `says`, with its effects, likeliest first."""
    chances: dict[str, float] = {}
    for effects, p in candidates:
        for name in effects:
            chances[name] = chances.get(name, 0.0) + p
    if chances[effect] >= says:
        return {"cause": node_of(effect), "effects": [effect], "probability": min(1.0, chances[effect])}
    for node in ancestors(node_of(effect)):
        if node == ROOT:
            break
        members = [name for name in chances if name != UNKNOWN and node in ancestors(node_of(name))]
        p = min(1.0, sum(p for effects, p in candidates if set(effects) & set(members)))
        if p >= says:
            members.sort(key=lambda name: -chances[name])
            return {"cause": node, "effects": _enough(members, chances, says), "probability": p}
    return None


def _enough(members: Sequence[str], chances: Mapping[str, float], says: float) -> list[str]:
    """The likeliest members that together hold the share `says` of their probability."""
    total, held, kept = sum(chances[name] for name in members), 0.0, []
    for name in members:
        kept.append(name)
        held += chances[name]
        if held >= max(says, 0.95) * total:
            break
    return kept
