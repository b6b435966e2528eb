"""Fits the few constants of the decision to development cases: `experiments/withheld calibrate`.

Input is one table of hypotheses for each case, as the diagnosis wrote it beside its verdict: effects, whether the model
also lacks something that no effect describes (discrepancy), log-evidence, log-prior. Nothing else of the diagnosis is
used. The posterior of a hypothesis with n effects is proportional to

    exp(tempered log_evidence + log_prior + kind[n] + discrepancy (log_odds - occam [n > 0])),

where `seatruth.diagnosis.tempering` divides the evidence: by `temperature` for what it leaves out (an approximate
noise model overstates it), `model_form` for what it leaves out the more of, the more nats the best hypothesis
explains, `form_beside` for the part of that which a further effect is asked for, and `unseen_form` for what of it
missing forces do not show. `kind` is for the shares of answers with no, one, two or more effects, `log_odds` for a
discrepancy, `occam` for one beside effects. The constants maximise the mean log probability of the truth; how well that
holds on other cases is said by cross-validation over cases. The naming threshold is the lowest probability from which
the named answers are wrong in at most `WRONG`. `settings` are the same constants as the diagnosis takes them
(`seatruth.diagnosis.Settings`).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit, logit

from seatruth.diagnosis import Settings
from seatruth.diagnosis.posterior import currents, errors_of_sensors, on_board, rivals
from seatruth.diagnosis.tempering import beyond_the_form, errors_beside_forces, form_limit, sensors_alone, tempered
from seatruth.effects import Effect, available
from seatruth.errors import BadInput
from withheld.names import UNKNOWN
from withheld.same import one_name, twins
from withheld.score import LIBRARY, opened, said
from withheld.seal import commit, log, write

FOLDS = 5
WRONG = 0.02
"""Share of the named answers that may be wrong."""
START = 0.003
"""Where the search for `model_form` begins: a form that is 5 % off leaves 0.05^2 of its signature to its rivals."""
UNSEEN = 12.5
"""nats, where that for `unseen_form` begins: half a noncentrality of 25, from which a wrong form is easily seen."""
WIDTH = 2.0
"""Standard deviation (nats) of the weak normal prior that keeps constants of which few cases tell near 0."""
FLOOR = 1e-6
"""Probability that a truth keeps which is among no hypotheses: the diagnosis left it out, which no constant mends."""
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Constants:
    """The constants of the decision; all but the first three are in nats."""

    temperature: float = 1.0
    model_form: float = 0.0
    """Added to the temperature for each nat that the best hypothesis explains."""
    form_beside: float = 1.0
    """Part of what fewer effects explain that is counted so for a further effect."""
    unseen_form: float = math.inf
    """Of a wrong form that missing forces do not show."""
    log_odds: float = 0.0
    """Of a discrepancy."""
    occam: float = 0.0
    """Taken off a discrepancy beside effects."""
    none: float = 0.0
    two: float = 0.0
    more: float = 0.0
    """Of answers with so many effects, over those with one."""


@dataclass(frozen=True)
class Case:
    """The hypotheses of one case: (h,) arrays, and which of them are the truth."""

    name: str
    log_evidence: Array
    log_prior: Array
    discrepancy: Array
    count: NDArray[np.intp]
    answer: NDArray[np.intp]
    """Number of the answer that each hypothesis belongs to."""
    named: NDArray[np.bool_]
    """Whether an answer (by number) names an effect."""
    right: NDArray[np.bool_]
    """Whether an answer is the truth."""
    explained: float = 0.0
    """Log-evidence (nats) of the best hypothesis over the one without effects that has its discrepancy."""
    apart: NDArray[np.bool_] | None = None
    """Whether a hypothesis lacks all causes of the best one; None where no forces were fitted beside its effects."""
    against: NDArray[np.intp] | None = None
    """Place of the hypothesis with which each of those is compared."""
    forces: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """nats: what the best one explains, what forces alone explain of it, and what they add to it."""
    by_sensors: tuple[Array, NDArray[np.intp]] | None = None
    """What errors of sensors among the effects of each hypothesis explain by themselves, and how many they are."""
    keys: tuple[tuple[str, ...], ...] = ()
    """The effects of each hypothesis, as they were fitted."""


def calibrate(
    folders: Sequence[Path], *, seed: int = 0, keep_temperature: bool = False, keep_priors: bool = False
) -> dict[str, Any]:
    """Fits the constants to diagnosed sets; writes calibration.json into the first one's folder, returns its content.

    Test sets that were opened judge nothing any more. With `keep_temperature` the temperature and its growth stay as
    they were: few cases decide them, those in which something wrong is much more probable than the truth. With
    `keep_priors` only they, and what a further effect is asked for, are fitted, about their earlier values: sets that
    have few cases of a kind say little of its share.
    """
    cases: list[Case] = []
    verdicts: list[Mapping[str, Any]] = []
    for out in folders:
        if _drawn(out)["set"] != "dev" and ("score", "end") not in [(line["step"], line["what"]) for line in log(out)]:
            what = "constants are fitted to a test set only once it is opened"
            raise BadInput(what, where=str(out), do="Score it first.")
        truths, own = opened(out), said(out, LIBRARY)
        cases += [table(truths[name], one) for name, one in own.items() if one.get("hypotheses")]
        verdicts += own.values()
    if len(cases) < FOLDS:
        raise BadInput(f"only {len(cases)} verdicts hold hypotheses", where=str(folders[0]), do="Diagnose more cases.")
    before = _settings(verdicts, folders[0])
    kept = (before.temperature, before.model_form) if keep_temperature else None
    diagnosed = Constants(before.temperature, before.model_form, before.form_beside, before.unseen_form)
    how = kept, diagnosed if keep_priors else None
    constants, left_out = fit(cases, *how), cross_validated(cases, seed, *how)
    content = {
        "constants": asdict(constants),
        "settings": as_settings(constants, before),
        "threshold": threshold([one for case in cases for one in named_answers(case, constants)]),
        "cases": len(cases),
        "sets": [_origin(out) for out in folders],
        "commit": commit(),
        "folds_seed": seed,
        "log_score": {
            "as_diagnosed": float(np.mean([log_score(case, diagnosed) for case in cases])),
            "fitted": float(np.mean([log_score(case, constants) for case in cases])),
            "cross_validated": float(np.mean(left_out)),
            "standard_error": float(np.std(left_out, ddof=1) / math.sqrt(len(left_out))),
        },
        "truth_among_hypotheses": float(np.mean([bool(case.right.any()) for case in cases])),
    }
    write(folders[0] / "calibration.json", json.dumps(content, indent=1) + "\n")
    return content


def _drawn(out: Path) -> dict[str, Any]:
    """Which set it is, "dev" or "test", and its seed."""
    stated = json.loads((out / "sealed" / "_set.json").read_text(encoding="utf-8"))
    return {"set": stated["set"], "seed": stated["seed"]}


def _origin(out: Path) -> dict[str, Any]:
    """Where the cases of a set come from, the commit that diagnosed it, and a hash of it all."""
    by = [line["commit"] for line in log(out) if line["step"] == "diagnose"]
    return _drawn(out) | {"diagnosed": by[-1], "hash": _hash(out)}


def table(truth: Mapping[str, Any], verdict: Mapping[str, Any]) -> Case:
    """A case's hypotheses as arrays. No effect with a discrepancy is the answer "unknown"; with effects a discrepancy
    does not change the answer. Where terms of another form stand for a discrepancy (`like`), the evidence is that of
    the fit with these terms, and so is the discrepancy."""
    twin = twins()
    stated = [row for row in verdict["hypotheses"] if math.isfinite(row["log_evidence"])]
    keys = [tuple(one_name(row["effects"], twin)) or ((UNKNOWN,) if row["discrepancy"] else ()) for row in stated]
    rows = _as_fitted(stated)
    fitted = [tuple(one_name(row["effects"], twin)) or key for row, key in zip(rows, keys, strict=True)]
    answers = sorted(set(keys))
    true = tuple(one_name(truth["effects"], twin))
    accepted = {true, ()} if truth["kind"] == "form" else {true}
    return Case(
        str(truth["case"]),
        np.array([float(row["log_evidence"]) for row in rows]),
        np.array([float(row["log_prior"]) for row in rows]),
        np.array([float(row["discrepancy"]) for row in rows]),
        np.array([len(row["effects"]) for row in rows], dtype=np.intp),
        np.array([answers.index(key) for key in keys], dtype=np.intp),
        np.array([bool(key) and key != (UNKNOWN,) for key in answers]),
        np.array([key in accepted for key in answers]),
        _explained(rows),
        *_beside_forces(rows, fitted),
        sensors_alone(
            np.array([float(row["log_evidence"]) for row in rows]),
            [tuple(row["effects"]) for row in rows],
            _of_sensors(),
        ),
        tuple(tuple(row["effects"]) for row in rows),
    )


def _as_fitted(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The rows with the effects and the discrepancy of the fits that their evidence is of."""

    def fit_of(row: Mapping[str, Any]) -> tuple[frozenset[str], float]:
        return frozenset((*row["effects"], *row.get("like", ()))), float(row["log_evidence"])

    own = {fit_of(row): bool(row["discrepancy"]) for row in rows if not row.get("like")}
    return [
        {**row, "effects": sorted(fit_of(row)[0]), "discrepancy": own.get(fit_of(row), row["discrepancy"])}
        for row in rows
    ]


def _explained(rows: Sequence[Mapping[str, Any]]) -> float:
    best = max(rows, key=lambda row: float(row["log_evidence"]))
    alone = [row for row in rows if not row["effects"]]
    same = [row for row in alone if row["discrepancy"] == best["discrepancy"]] or alone
    return max(0.0, float(best["log_evidence"]) - min(float(row["log_evidence"]) for row in same)) if same else 0.0


def _beside_forces(
    rows: Sequence[Mapping[str, Any]], keys: Sequence[tuple[str, ...]]
) -> tuple[NDArray[np.bool_] | None, NDArray[np.intp] | None, tuple[float, float, float]]:
    """Which hypotheses lack all causes of the best one, with what they are compared, and what forces explain.

    That is what the best one, forces, and forces beside it explain.
    """
    best = max(range(len(rows)), key=lambda k: float(rows[k]["log_evidence"]))
    leader = {*keys[best]} - {UNKNOWN}
    value = [float(row["log_evidence"]) for row in rows]
    on = [bool(row["discrepancy"]) for row in rows]
    forces = [value[k] for k, row in enumerate(rows) if not row["effects"] and on[k]]
    beside = [value[k] for k, key in enumerate(keys) if on[k] and rows[k]["effects"] and {*key} <= leader]
    if not leader or not forces or not beside:
        return None, None, (0.0, 0.0, 0.0)
    null = min(value[k] for k, row in enumerate(rows) if not row["effects"])
    alone = max((value[k] for k, key in enumerate(keys) if not on[k] and {*key} == leader), default=null)
    names = {name for key in keys for name in key} - {UNKNOWN}
    apart, against = rivals(
        tuple(sorted(leader)),
        [tuple(name for name in key if name != UNKNOWN) for key in keys],
        np.array(value),
        {name: _effect(name) for name in names},
    )
    return apart, against, (value[best] - null, forces[0] - null, max(beside) - alone)


def _effect(name: str) -> Effect:
    """The installed effect of a name, which may be its form on one of several actuators: "thruster_gain_port"."""
    known = available()
    return known.get(name) or known[max((other for other in known if name.startswith(other)), key=len)]


@cache
def _of_sensors() -> dict[str, frozenset[str]]:
    """As `errors_of_sensors`, of what is installed. Looked up once: a search asks for a posterior 100,000 times."""
    return errors_of_sensors(available())


@cache
def _currents_and_on_board() -> tuple[frozenset[str], frozenset[str]]:
    """The installed effects by which water moves, and those that turn with the vehicle."""
    return frozenset(currents(available())), frozenset(on_board(available()))


def posterior(case: Case, constants: Constants) -> Array:
    """Probability of each answer, (answers,)."""
    kind = np.array([constants.none, 0.0, constants.two, constants.more])[np.minimum(case.count, 3)]
    beside = constants.log_odds - constants.occam * (case.count > 0)
    counts = tempered(
        case.log_evidence,
        case.count,
        float(case.log_evidence.max()) - case.explained,
        temperature=constants.temperature,
        model_form=constants.model_form,
        beside=constants.form_beside,
        by_sensors=case.by_sensors,
    )
    if case.apart is not None:
        limit = form_limit(*case.forces, constants.unseen_form)
        counts = beyond_the_form(counts, case.log_evidence, case.apart, limit, constants.temperature, case.against)
    if case.keys:
        on = case.discrepancy > 0.0
        heat = constants.unseen_form, constants.temperature, constants.model_form
        # Trials of the development cases turn to all sides.
        water, turning = _currents_and_on_board()
        counts = errors_beside_forces(
            counts, case.log_evidence, case.keys, on.tolist(), _of_sensors(), *heat, on_board=turning, currents=water
        )
    log = counts + case.log_prior + kind + case.discrepancy * beside
    weight = np.exp(log - log.max())
    return np.asarray(np.bincount(case.answer, weight, len(case.right)) / weight.sum())


def log_score(case: Case, constants: Constants) -> float:
    """Log probability of the truth."""
    p = float(posterior(case, constants)[case.right].sum())
    return math.log(FLOOR + (1 - FLOOR) * p)


def fit(cases: Sequence[Case], kept: tuple[float, float] | None = None, about: Constants | None = None) -> Constants:
    """The constants of the largest mean log score, with a weak prior about no change.

    `kept` are a temperature and its growth that stay. With `about`, earlier constants, the prior is about these, and
    those in nats stay. No temperature is below 1: evidence says no more than its model does.
    """
    centre = np.zeros(9)
    if about is not None:
        centre = np.array(
            [
                np.log(about.temperature),
                np.log(about.model_form / START),
                logit(about.form_beside),
                np.log(about.unseen_form / UNSEEN),
            ]
        )

    def constants(x: Array) -> Constants:
        free = max(1.0, float(np.exp(x[0]))), START * float(np.exp(x[1]))
        unseen = UNSEEN * float(np.exp(x[3]))
        nats = (float(value) for value in x[4:])
        return Constants(*(free if kept is None else kept), float(expit(x[2])), unseen, *nats)

    def loss(x: Array) -> float:
        return (
            -sum(log_score(case, constants(x)) for case in cases) + 0.5 * float((x - centre) @ (x - centre)) / WIDTH**2
        )

    found = minimize(loss, centre, method="Powell", options={"xtol": 1e-3, "ftol": 1e-6})
    return constants(np.asarray(found.x, dtype=np.float64))


def _settings(verdicts: Sequence[Mapping[str, Any]], out: Path) -> Settings:
    """The settings with which the tables were made; BadInput where they differ between cases."""
    used = [json.dumps(own["settings"], sort_keys=True) for own in verdicts if own.get("settings")]
    if len(set(used)) > 1:
        raise BadInput("its cases were diagnosed with several settings", where=str(out), do="Diagnose it anew.")
    given: dict[str, Any] = json.loads(used[0]) if used else {}
    if "prior_sets" in given:
        given["prior_sets"] = tuple(given["prior_sets"])
    return Settings(**given)


def as_settings(constants: Constants, before: Settings) -> dict[str, Any]:
    """The constants as the diagnosis takes them, where the tables were made with the settings `before`."""
    off = 1.0 - before.prior_discrepancy
    on = before.prior_discrepancy * math.exp(constants.log_odds - constants.occam)
    kind = [0.0, constants.two, constants.more]
    sets = [share * math.exp(more) * (off + on) for share, more in zip(before.prior_sets, kind, strict=True)]
    none = before.prior_none * math.exp(constants.none)
    unknown = before.prior_unknown * math.exp(constants.log_odds + constants.none)
    total = none + unknown + sum(sets)
    return {
        "temperature": constants.temperature,
        "model_form": constants.model_form,
        "form_beside": constants.form_beside,
        "unseen_form": constants.unseen_form,
        "prior_none": none / total,
        "prior_unknown": unknown / total,
        "prior_sets": [share / total for share in sets],
        "prior_discrepancy": on / (off + on),
    }


def cross_validated(
    cases: Sequence[Case], seed: int, kept: tuple[float, float] | None = None, about: Constants | None = None
) -> list[float]:
    """Log score of each case by constants fitted to the cases of the other folds."""
    order = np.random.default_rng(seed).permutation(len(cases))
    scores = [0.0] * len(cases)
    for k in range(FOLDS):
        held = set(order[k::FOLDS].tolist())
        constants = fit([case for n, case in enumerate(cases) if n not in held], kept, about)
        for n in held:
            scores[n] = log_score(cases[n], constants)
    return scores


def named_answers(case: Case, constants: Constants) -> list[tuple[float, bool]]:
    """The likeliest answer of a case, where it names an effect: its probability, and whether it is right."""
    chance = posterior(case, constants)
    best = int(np.argmax(chance))
    return [(float(chance[best]), bool(case.right[best]))] if case.named[best] else []


def threshold(answers: Sequence[tuple[float, bool]]) -> float:
    """Lowest probability from which at most a share `WRONG` of the answers above it is wrong; 1 where there is none."""
    ranked = sorted(answers, key=lambda one: -one[0])
    best, wrong = 1.0, 0
    for n, (chance, hit) in enumerate(ranked, 1):
        wrong += not hit
        if wrong <= WRONG * n:
            best = chance
    return best


def _hash(out: Path) -> str:
    """SHA-256 over the sealed truths and the verdicts that the constants were fitted to."""
    digest = hashlib.sha256()
    for file in sorted([*(out / "sealed").glob("c*.json"), *(out / "verdicts" / LIBRARY).glob("c*.json")]):
        digest.update(file.name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
