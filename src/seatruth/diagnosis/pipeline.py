"""Study -> Diagnosis: the order in which everything in this package is asked."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from seatruth.diagnosis.cross_validation.retain_predictive import lasting
from seatruth.diagnosis.discrepancy.random_force import discrepant
from seatruth.diagnosis.discrepancy.score_test import Probes, probes
from seatruth.diagnosis.hypotheses import Say, Search, extended, floor_of, search
from seatruth.diagnosis.observer import astray, led, led_floor
from seatruth.diagnosis.posterior import (
    SURE,
    UNKNOWN,
    Candidate,
    Verdict,
    apart,
    beside_unnamed,
    candidates,
    detectable,
    in_common,
    inclusion,
    powerless,
    refused,
    undecided,
    unnamed,
    verdict,
)
from seatruth.diagnosis.problem import GapProblem, whole_trials
from seatruth.diagnosis.result_builder import Parts
from seatruth.diagnosis.results import Diagnosis
from seatruth.effects import Effect, available
from seatruth.errors import BadInput, SeatruthError
from seatruth.models.black_box import BlackBox
from seatruth.progress import Progress, ProgressEvent, silent
from seatruth.study import Study
from seatruth.trials.check import check_trials
from seatruth.trials.finding import Finding

_UNNAMED = 0.3
"""Probability of something unnamed from which named effects are looked for beside it."""


def diagnose(
    study: Study,
    effects: Sequence[Effect | str] | None = None,
    *,
    seed: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    left_out: bool = True,
    suggest: bool = True,
) -> Diagnosis:
    """Says where a study's model and its trials disagree, which effect causes it, and how far the gap shrinks.

    Args:
        study: a model and several trials of one vehicle. Its free coefficients are nuisances under their priors (20 %
            of the value where none is stated).
        effects: names or Effects that take part; None takes all installed ones that can act on the model.
        seed: seed of the permutation tests; None takes the study's.
        threads: threads of a simulation; None takes one per processor.
        progress: called with a `ProgressEvent` at every stage.
        left_out: predict each trial from the others.
        suggest: look for the next trial.

    Returns:
        The diagnosis. An interrupt after the model without effects is fitted returns what has been reached.

    Raises:
        BadInput: the study cannot be diagnosed.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import diagnose
        >>> study = seatruth.sample.load("diagnose.toml")
        >>> short = study.replace(trials=study.trials[:2])
        >>> found = diagnose(short, ["current"], left_out=False, suggest=False)
        >>> found.seed, [effect["name"] for effect in found.effects]
        (1, ['current'])
    """
    began = time.perf_counter()
    show = progress or silent

    def say(text: str) -> None:
        show(ProgressEvent(text, elapsed_s=time.perf_counter() - began))

    whole_trials(study)
    chosen, reasons = _effects(study, effects)
    with threadpool_limits(limits=1, user_api="blas"):
        problem = GapProblem(study, chosen, threads=threads)
        findings = [*check_trials(study.trials, study.model), *_doubts(study, problem)]
        floor, full, bare = floor_of(problem, say)
        found = search(problem, floor, full.x, bare.x, say)
        if not np.isfinite(found.base.cost):
            raise BadInput(
                "the model diverges on these trials wherever it was tried",
                where=f"study {study.name!r}",
                do="`seatruth simulate` shows from where; check units, signs and the first samples.",
            )
        say("What is not in the library")
        probed = _probed(problem, found, findings)
        answers = candidates(found, probed)
        plain = found
        if not found.cut:
            found, answers = _beside(problem, found, probed, answers, say)
        least = detectable(found)
        judged = verdict(answers, powerless(found, least), len(problem.effects), lambda a, b: apart(found, a, b))
        try:
            judged, answers = _helping(judged, found, answers)
        except KeyboardInterrupt:
            # What was not asked for on trials left out is not named.
            judged, found.cut = undecided(answers), True
        parts = Parts(
            study,
            problem,
            found,
            plain,
            probed,
            answers,
            judged,
            least,
            findings,
            say,
            study.seed if seed is None else seed,
        )
        extra: dict[str, Any] = {"how_far": None, "next_trial": None}
        cut = "stopped by the user; what is missing was not reached"
        code, reason = ("interrupted", cut) if found.cut else ("done", "everything was asked")
        try:
            if left_out and not found.cut:
                extra["how_far"] = parts.shrinkage()
            if suggest and not found.cut:
                extra["next_trial"] = parts.suggestion()
        except KeyboardInterrupt:
            code, reason = "interrupted", cut
        outcome = {"code": code, "reason": reason, "wall_s": time.perf_counter() - began, "fits": len(found.fits)}
        return parts.diagnosis(reasons, outcome, extra)


def _beside(
    problem: GapProblem, found: Search, probed: Sequence[Probes], answers: list[Candidate], say: Say
) -> tuple[Search, list[Candidate]]:
    """Looks for named effects anew where the model lacks something without a name: led along the recorded speeds, or
    beside missing forces as large as the trials ask for where no speed is recorded.
    """

    def more(text: str) -> None:
        say(f"Beside what has no name: {text}")

    try:
        best = max(found.fits.values(), key=lambda one: one.evidence)
        chance = 1.0 if astray(problem, best) else unnamed(answers)
        if chance <= _UNNAMED:
            return found, answers
        say("Beside what has no name")
        again = _led(problem, found, probed, more) or _pushed(problem, found, probed, more)
    except KeyboardInterrupt:
        found.cut = True
        return found, answers
    if again is None or not np.isfinite(again.base.cost):
        return found, answers
    again.beside = 1
    return again, beside_unnamed(answers, candidates(again, []), chance)


def _led(problem: GapProblem, found: Search, probed: Sequence[Probes], say: Say) -> Search | None:
    other = led(problem)
    if other is None:
        return None
    begun = led_floor(other, [found.base.x, *(one.at.x for one in probed), problem.start])
    if begun is None:
        return None
    floor, full, plain = begun
    again = search(other, floor, full.x, plain.x, say, largest=2)
    if np.isfinite(again.base.cost) and not again.cut:
        extended(again, say)
    return again


def _pushed(problem: GapProblem, found: Search, probed: Sequence[Probes], say: Say) -> Search | None:
    singles = [one for one in probed if len(one.at.effects) == 1]
    floor = discrepant(max(singles or probed, key=lambda one: one.at.evidence)) if probed else None
    if floor is None:
        return None
    near = max((one.at for one in singles or probed), key=lambda at: at.evidence)
    return search(problem, floor, near.x, found.base.x, say)


def _helping(judged: Verdict, found: Search, answers: list[Candidate]) -> tuple[Verdict, list[Candidate]]:
    """Of effects that are named beside something unnamed those that these trials can tell from what a model has wrong,
    and that help on trials left out; the others are no answer.

    On one course whatever keeps its direction on earth is a force ahead or abeam, as the model's own may lack one. And
    an effect can take up some of what is missing for a while.
    """
    problem = found.problem
    if not judged.beside or not judged.effects or len(problem.trials) < 2:
        return judged, answers
    if _on_one_course(problem):
        answers = refused(answers, [name for name, effect in problem.effects.items() if _points(effect)])
    # Each round refuses an effect at least, or has asked for all that may be named.
    while named := [c for c in answers if c.effects and c.effects != (UNKNOWN,)]:
        chances = inclusion(named, list(problem.effects))
        asked = {*named[0].effects, *(name for name, chance in chances.items() if chance >= SURE)}
        kept = lasting(found, tuple(sorted(asked)))
        if set(kept) == asked:
            break
        answers = refused(answers, [name for name in asked if name not in kept])
    common = in_common(answers)
    if common is not None:
        return common, answers
    rest = unnamed(answers)
    return (Verdict("unknown", (), (), rest) if rest >= SURE else undecided(answers)), answers


def _points(effect: Effect) -> bool:
    """Whether an effect keeps its direction on earth."""
    return effect.family == "environment" and "psi" in effect.needs_states


def _effects(study: Study, wanted: Sequence[Effect | str] | None) -> tuple[list[Effect], dict[str, str]]:
    """Effects that can act on the study's model, and why others cannot."""
    installed = available()
    if wanted is None:
        asked = list(installed.values())
    else:
        from seatruth.effects import effects_by_name

        asked = [e if isinstance(e, Effect) else effects_by_name([e], installed)[0] for e in wanted]
    own = {effect.name for effect in getattr(study.model, "effects", ())}
    found, reasons = [], {}
    for effect in asked:
        reason = "the model has it already" if effect.name in own else effect.missing(study.model)
        if not reason and not effect.dynamic:
            reason = "it is noise, which the noise floor takes up"
        if not reason and isinstance(study.model, BlackBox) and not effect.suits_black_box:
            reason = "it acts inside the model, and the model is a black box"
        if reason:
            reasons[effect.name] = reason
        else:
            found.append(effect)
    if not found:
        raise BadInput(
            "no effect can act on this model",
            where=f"study {study.name!r}",
            do="; ".join(f"{name}: {why}" for name, why in list(reasons.items())[:3]),
        )
    return found, reasons


def _doubts(study: Study, problem: GapProblem) -> list[Finding]:
    """What weakens any diagnosis of this study."""
    found = []
    where = f"study {study.name!r}"
    if len(study.trials) == 1:
        found.append(
            Finding("warning", "one-trial", "One trial alone cannot be predicted from others.", where, "Add trials.")
        )
    if not len(problem.coefficients):
        text = "No coefficient of the model is free: any error in one would be taken for an effect."
        found.append(Finding("warning", "no-coefficients", text, where, "Set `vary` for those that are uncertain."))
    plain = [p.name for p in study.parameters if p.vary and p.prior is None]
    if plain:
        text = f"{len(plain)} free coefficients state no prior; a deviation of 20 % of the value was taken for them."
        found.append(
            Finding("note", "prior-assumed", text, where, "State what is known of them: prior_mean, prior_sd.")
        )
    for k, one in enumerate(problem.trials):
        for other in list(problem.trials)[k + 1 :]:
            same = len(one) == len(other) and all(
                name in other.outputs and np.array_equal(values, other.outputs[name], equal_nan=True)
                for name, values in one.outputs.items()
            )
            if same:
                text = f"Trials {one.name!r} and {other.name!r} hold the same data: they count twice."
                found.append(Finding("error", "duplicate", text, where, "Leave one out.", one.name))
    if _on_one_course(problem):
        text = "All trials keep to one course: a current, a heading bias and a wind look alike there."
        found.append(Finding("warning", "one-course", text, where, "Add a reciprocal run or a full turn."))
    return found


def _on_one_course(problem: GapProblem) -> bool:
    known = [c for c in (_course(trial) for trial in problem.trials) if c is not None]
    alike = all(abs(np.angle(np.exp(1j * (c - known[0])))) < 0.5 for c in known)
    return bool(known) and alike and not _turns(problem)


def _course(trial: Any) -> float | None:
    psi = trial.outputs.get("psi")
    if psi is None or not np.isfinite(psi).any():
        return None
    return float(np.angle(np.nanmean(np.exp(1j * np.asarray(psi)))))


def _turns(problem: GapProblem) -> bool:
    """Whether any trial turns by half a circle or more."""
    for trial in problem.trials:
        psi = trial.outputs.get("psi")
        if psi is not None and np.isfinite(psi).any() and float(np.nanmax(psi) - np.nanmin(psi)) > np.pi:
            return True
    return False


def _probed(problem: GapProblem, found: Search, findings: list[Finding]) -> list[Probes]:
    """Probes at the model without effects and at the best hypothesis."""
    if isinstance(problem.study.model, BlackBox):
        return []
    at = [found.base, *found.leaders(1)]
    at += [one for one in found.leaders(20) if len(one.effects) == 1][:1]
    at = list({one.effects: one for one in at}.values())
    try:
        made = [probes(problem, found.floor, one) for one in at]
        # Where every push makes the run diverge, nothing unnamed can be asked after.
        return [one for one in made if {"place", "terms"} <= {probe.kind for probe in one.found}]
    except SeatruthError as trouble:
        findings.append(
            Finding("warning", "no-probes", f"Unnamed causes were not looked for: {trouble.message}", "model")
        )
        return []
