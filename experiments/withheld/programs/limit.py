"""The limit: the verdict of the best possible program, which knows reality's forms, noise and priors, not the cause.

It reads the sealed part of a case: true coefficients and noise, and reality's own simulation. So it is scored beside
the diagnosing programs and is none of them. All mechanisms of the catalogue, those outside the library and the other
forms are compared by their evidence, with

- the true covariance of the noise (white and slow parts) and all first states projected out,
- the coefficients marginalised under the priors that the study hands out, and the distractors under theirs,
- sizes under the generator's own priors: normal, of deviations such that lambda spreads over the strata as
  `cases.STRATA` has it, up to the largest believable size, every direction as likely as any other,
- kinds of cases as probable as the generator makes them.

Signatures are taken about the refit of reality's own baseline, where one stands who does not know the cause: at typical
magnitudes, or at small ones where a refit takes up nearly all of a signature. Sizes are linear from there, so that this
is the limit to first order. Two causes have the sizes that each would have alone, and the directions that each would
have alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seatruth.effects import available
from seatruth.effects.causes import ROOT, ancestors
from withheld.cases import FORM_BESIDE, LOOKALIKES, STRATA
from withheld.names import NAMES, UNKNOWN
from withheld.next_trial import read
from withheld.reality.families import Family, families
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import Array
from withheld.reality.sensors import Noise
from withheld.reality.simulate import Present
from withheld.referee import PRIOR, Rig, marginal, spans
from withheld.refit import ABSORBED, SMALL, refit
from withheld.verdicts import verdict

POOR = 4
"""Trials of a case whose causes are confounded on purpose; others have more."""
DISTRACTION = 0.7
"""Mean lambda of a distractor; two act in every case."""
SAYS = 0.8
"""Probability from which a node of the tree is named [S]: a verdict says the finest that reaches it."""
SHARES = {"single": 0.33, "double": 0.08, "none": 0.09, "outside": 0.09, "form": 0.14, "form+single": 0.19}
"""Prior probabilities of the kinds, where the trials are not poor: the generator's shares."""


@dataclass(frozen=True)
class Option:
    """One way in which a mechanism can act: columns of its signatures, standard deviations (scales,) of their sizes,
    and the lambdas (scales,) that these stand for."""

    columns: list[int]
    sds: Array
    lambdas: Array


def limit(truth: Mapping[str, Any], public: Path) -> dict[str, Any]:
    """The verdict of the best possible program on one case; `truth` is the sealed part."""
    family = families()[truth["family"]]
    usable = [one for one in family.mechanisms if truth["ordered"] or not one.orders]
    poor = len(truth["trials"]) == POOR and len({trial["heading"] for trial in truth["trials"]}) == 1
    named = [one for one in usable if one.key in NAMES[family.name]]
    if poor:
        named = [one for one in named if one.key in LOOKALIKES[family.name]]
    outside = [one for one in usable if one.number is None]
    menu = [*named, *outside, *family.forms]
    gram, columns, absorbed = _gram(family, truth, public, menu)
    options = [_options(gram, columns, one, one.key in absorbed) for one in menu]
    log = _log_posteriors(gram, options, len(named), len(outside), poor)
    return _said(truth["case"], log, [NAMES[family.name][one.key] for one in named])


def _gram(
    family: Family, truth: Mapping[str, Any], public: Path, menu: Sequence[Mechanism]
) -> tuple[Array, dict[str, list[int]], set[str]]:
    """Gram matrix of all signatures and, last, of the data, after coefficients and distractors are marginalised; the
    columns of each mechanism; the mechanisms whose signature is nearly all taken up by a refit."""
    records = read(family, truth, public)
    noise = {name: Noise(*values) for name, values in truth["noise"].items()}
    present = [
        Present(family.mechanism(one["key"]), one["values"]) for one in (*truth["causes"], *truth["distractors"])
    ]
    if truth["form"]:
        present.append(Present(family.mechanism(truth["form"]["key"]), truth["form"]["values"]))
    rig = Rig(family, records, truth["coefficients"], noise)
    aim = rig.outputs(present)
    for k, record in enumerate(records):
        record.clean.update({name: aim[: len(record.t), j, k] for j, name in enumerate(family.outputs)})
    point = refit(rig, aim).point
    flexible = [one for one in menu if one.kind != "gear"]
    signed = [one for one in menu if not _one_sided(one)]
    variants = [*spans(menu), *((f"{key}-", acting) for key, acting in spans(signed, -1.0))]
    variants += [(f"{key}~", acting) for key, acting in spans(flexible, SMALL)]
    here = rig.look(point, variants, aim)
    size, last = len(point.moved), here.whitened[0].shape[1] - 1
    gram = here.grams.sum(axis=0)
    for whitened, drawn in zip(here.whitened, here.noise, strict=True):
        cross = whitened.T @ drawn
        gram[:, last] += cross
        gram[last, :] += cross
        gram[last, last] += float(drawn @ drawn)
    # What is known of the coefficients: rows of their own under the data, about the study's nominal values.
    nominal = family.coefficients
    off = np.array([(truth["coefficients"][name] - value) / (PRIOR * abs(value)) for name, value in nominal.items()])
    off = off + point.moved
    gram[:size, last] -= off
    gram[last, :size] -= off
    gram[last, last] += float(off @ off)
    forces = [k for one in menu if one.kind == "force" for k in here.columns(one.key)]
    raw = np.diag(gram)[size:].copy()
    gram = marginal(gram, size)
    gram = _without_distractors(gram, forces)
    columns = {label: here.columns(label) for label in here.labels}
    absorbed = {
        one.key for one in flexible if max(gram[k, k] / max(float(raw[k]), 1e-300) for k in columns[one.key]) < ABSORBED
    }
    return gram, columns, absorbed


def _without_distractors(gram: Array, forces: Sequence[int]) -> Array:
    """A Gram matrix after small sizes of all forces are marginalised, as two of them act unseen in every case."""
    sd = np.sqrt(2 * DISTRACTION / len(forces) / np.maximum(np.diag(gram)[forces], 1e-12))
    own = gram[np.ix_(forces, forces)] * np.outer(sd, sd) + np.eye(len(forces))
    cross = gram[forces] * sd[:, None]
    return np.asarray(gram - cross.T @ np.linalg.solve(own, cross))


def _options(gram: Array, columns: Mapping[str, Sequence[int]], one: Mechanism, small: bool) -> list[Option]:
    """The ways in which a mechanism can act: signatures whose sizes are normal, at a few standard deviations.

    The deviations make the mean of lambda what the generator asks for, two of them in each stratum.
    """
    of = list(columns[f"{one.key}~" if small else one.key])
    if len(of) == 4:  # towards the four sides: a direction between two of them takes a part of both
        groups = [[of[k], of[(k + 1) % 4]] for k in range(4)]
    elif len(one.grows) == len(of) > 1:
        groups = [of]
    else:  # what acts otherwise the other way round has a signature for either sign
        groups = [[k] for k in (of if small else [*of, *columns.get(f"{one.key}-", ())])]
    low, high = (np.log([stratum[end] for stratum in STRATA]) for end in (0, 1))
    lambdas = np.exp(np.concatenate([low + share * (high - low) for share in (0.25, 0.75)]))
    most = one.most / (SMALL if small else 1.0)
    return [
        Option(group, np.minimum(np.sqrt(lambdas / max(float(np.diag(gram)[group].mean()), 1e-12)), most), lambdas)
        for group in groups
    ]


def _one_sided(one: Mechanism) -> bool:
    """Whether a mechanism is drawn with one sign only, or has a direction."""
    rng, name = np.random.default_rng(0), one.grows[0]
    return len(one.grows) > 1 or len({float(np.sign(one.draw(rng)[name])) for _ in range(16)}) == 1


def _evidence(gram: Array, columns: Sequence[int], sds: Array) -> Array:
    """Log-evidence (cases,), over nothing, of signatures with normal sizes of deviations `sds` (cases, columns)."""
    data = len(gram) - 1
    scaled = gram[np.ix_(columns, columns)] * sds[:, :, None] * sds[:, None, :] + np.eye(len(columns))
    pull = gram[columns, data] * sds
    lower = np.linalg.cholesky(scaled)
    solved = np.linalg.solve(scaled, pull[:, :, None])[:, :, 0]
    log_det = 2 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray(0.5 * (pull * solved).sum(axis=1) - 0.5 * log_det)


def _mean(logs: Array) -> float:
    """Logarithm of the mean of exponentials."""
    return float(np.logaddexp.reduce(logs) - math.log(len(logs)))


def _log_posteriors(
    gram: Array, options: Sequence[Sequence[Option]], named: int, outside: int, poor: bool
) -> dict[tuple[int, ...], float]:
    """Log posterior (not normalised) of every answer: numbers of named mechanisms; (-1,) is outside the library."""
    each = [
        [_evidence(gram, o.columns, np.repeat(o.sds[:, None], len(o.columns), axis=1)) for o in of] for of in options
    ]
    alone = [_mean(np.concatenate(of)) for of in each]
    if poor:
        return {(k,): alone[k] for k in range(named)}
    # In pairs each mechanism has the direction that it prefers alone.
    best = [of[int(np.argmax([_mean(log) for log in logs]))] for of, logs in zip(options, each, strict=True)]
    forms = range(named + outside, len(options))

    def both(i: int, j: int) -> float:
        first, second = best[i].sds, best[j].sds
        if j in forms:
            middling = (best[j].lambdas >= FORM_BESIDE[0]) & (best[j].lambdas <= FORM_BESIDE[1])
            second = second[middling]
        a, b = (grid.ravel() for grid in np.meshgrid(first, second))
        sizes = [len(best[i].columns), len(best[j].columns)]
        sds = np.concatenate([np.repeat(x[:, None], n, axis=1) for x, n in zip((a, b), sizes, strict=True)], axis=1)
        return _mean(_evidence(gram, [*best[i].columns, *best[j].columns], sds))

    share = {kind: math.log(value) for kind, value in SHARES.items()}
    found: dict[tuple[int, ...], float] = {(): share["none"]}
    of_outside = [share["outside"] - math.log(outside) + alone[k] for k in range(named, named + outside)]
    of_forms = [share["form"] - math.log(len(forms)) + alone[k] for k in forms]
    found[-1,] = float(np.logaddexp.reduce([*of_outside, *of_forms]))
    for i in range(named):
        with_forms = _mean(np.array([both(i, k) for k in forms]))
        of_it = [share["single"] + alone[i], share["form+single"] + with_forms]
        found[i,] = float(np.logaddexp.reduce(of_it)) - math.log(named)
        for j in range(i):
            found[j, i] = share["double"] - math.log(named * (named - 1) / 2) + both(i, j)
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
        return {"cause": _node(effect), "effects": [effect], "probability": min(1.0, chances[effect])}
    for node in ancestors(_node(effect)):
        if node == ROOT:
            break
        members = [name for name in chances if name != UNKNOWN and node in ancestors(_node(name))]
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


def _node(effect: str) -> str:
    return available()[effect].cause
