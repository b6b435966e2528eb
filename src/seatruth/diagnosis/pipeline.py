"""Study -> Diagnosis: hypotheses are fitted, weighed, decided on, checked on trials left out, and reported."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from seatruth.analysis import failed_runs
from seatruth.costs.stepped_orders import without_stale_notes
from seatruth.costs.sway_signs import turned_sway
from seatruth.diagnosis.assembly import Assembly
from seatruth.diagnosis.few_runs import expected_evaluations
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.odd_trial import odd_trials
from seatruth.diagnosis.preconditions import (
    require_trials,
    turned_round,
    unseen,
    untried_forms,
    usable_effects,
    weaknesses,
)
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.results import Diagnosis
from seatruth.diagnosis.search import search
from seatruth.diagnosis.sections import finding as in_sections_finding
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.stage import AGAIN, Stage
from seatruth.effects import Effect
from seatruth.errors import DEBUG, BadInput, SeatruthError
from seatruth.models.isolated import failures_of, isolated_in
from seatruth.processes import require_workers
from seatruth.progress import Progress, silent
from seatruth.provenance import commit
from seatruth.simulate import OutOfRuns
from seatruth.storage.checkpoint import Checkpoint
from seatruth.study import Study
from seatruth.trials.check import check_trials
from seatruth.trials.finding import Finding
from seatruth.uncertainty.moved_coefficients import Coefficient, moved_coefficients

_CUT = "stopped by the user; what is missing was not reached"
_SPENT = "the budget of evaluations is used up; what is missing was not reached"


def diagnose(
    study: Study,
    effects: Sequence[Effect | str] | None = None,
    *,
    seed: int | None = None,
    threads: int | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    validate: bool = True,
    suggest: bool = True,
    settings: Settings | None = None,
    evaluations: int | None = None,
) -> Diagnosis:
    """Says where a study's model and its trials disagree, which effect causes it, and how far the gap shrinks.

    Args:
        study: a model and several trials of one vehicle. Its free coefficients are nuisances under their priors (20 %
            of the value where none is stated).
        effects: names or Effects that take part; None takes all installed ones that can act on the model.
        seed: seed of the permutation tests; None takes the study's.
        threads: threads of a simulation; None takes one per processor.
        workers: how many effects are fitted at once; it changes no result.
        progress: called with a `ProgressEvent` at every stage.
        checkpoint: file in which finished fits are kept: the same call goes on where a killed one stopped, and ends
            with the same diagnosis.
        validate: predict each trial from the others.
        suggest: look for the next trial.
        settings: numbers that the diagnosis rests on; None takes the defaults.
        evaluations: simulations of all trials that a black box may cost; None takes the study's. Equations are
            simulated too fast for a limit to matter.

    Returns:
        The diagnosis. An interrupt, or the end of the budget, after the model alone is fitted returns what has been
        reached.

    Raises:
        BadInput: the study cannot be diagnosed.

    Example:
        >>> import seatruth.sample
        >>> from seatruth import diagnose
        >>> study = seatruth.sample.load("diagnose.toml")
        >>> short = study.replace(trials=study.trials[:2])
        >>> found = diagnose(short, ["current"], validate=False, suggest=False)
        >>> found.seed, [effect.name for effect in found.effects]
        (1, ['current'])
    """
    commit()  # as the code is read, wherever the checkout is at the end
    began, cpu = time.perf_counter(), time.process_time()
    show, settings = progress or silent, settings or Settings()
    seed = study.seed if seed is None else seed

    def say(stage: str, again: float = 0.0) -> Stage:
        return Stage(stage, show, began, again)

    require_workers(workers)
    evaluations = study.diagnosis_budget if evaluations is None else evaluations
    if evaluations is not None and evaluations < 1:
        raise BadInput(f"{evaluations} evaluations are not possible", do="Ask for 1 or more.")
    require_trials(study)
    chosen, reasons = usable_effects(study, effects)
    # One thread for linear algebra: its matrices are small, and more would change the last digits of the result.
    with threadpool_limits(limits=1, user_api="blas"):
        problem = Problem(study, chosen, settings, threads=threads, evaluations=evaluations)
        of_trials = without_stale_notes(check_trials(study.trials, study.model), study, study.trials)
        findings = [
            *of_trials,
            *turned_sway(study, of_trials),
            *turned_round(study, threads),
            *weaknesses(study, problem),
        ]
        box = isolated_in(study.model)
        # Runs that are kept on disk make a search again as it was; finished fits would leave out what others learn.
        again = checkpoint if box is None or box.identity is None else None
        with Checkpoint(again, _work(study, chosen, settings)) as store:
            resumed = len(store)
            try:
                # The fits of a black box share derivatives, and its runs go on at once within each of them.
                many = workers if problem.few_runs is None else 1
                found = search(problem, say("Hypotheses", AGAIN), store, many, widen=effects is None, may_cut=True)
            except OutOfRuns:
                raise BadInput(
                    f"{evaluations} evaluations are too few to fit the model alone",
                    where=f"study {study.name!r}",
                    do=f"A diagnosis takes about {expected_evaluations(study, chosen, settings)}.",
                ) from None
            except np.linalg.LinAlgError as trouble:
                raise BadInput(
                    f"the model alone cannot be fitted to these trials ({trouble})",
                    where=f"study {study.name!r}",
                    do="`seatruth simulate` shows from where it diverges; check units, signs and the first samples.",
                ) from None
        problem = found.problem
        if problem.settings.sections > 1:
            findings.append(in_sections_finding(study.trials, problem.settings.sections))
        findings += _set_aside(found)
        if not found.interrupted:
            with _set_aside_where_it_fails("the comparison of each trial with the others", study, findings):
                findings += odd_trials(found, say("Trials against each other"))
        findings += unseen(study, reasons)
        assembly = Assembly(study, found, seed)
        code, reason = "done", "everything was asked"
        if found.interrupted:
            code, reason = ("budget", _SPENT) if found.spent else ("interrupted", _CUT)
        validation = suggestion = None
        try:
            if validate and not found.interrupted:
                with _set_aside_where_it_fails("the prediction of trials left out", study, findings):
                    validation = assembly.validation(say("Trials left out"))
            if suggest and not found.interrupted:
                with _set_aside_where_it_fails("the search for the next trial", study, findings):
                    suggestion = assembly.suggestion(say("Next trial"))
        except KeyboardInterrupt:
            code, reason = "interrupted", _CUT
        except OutOfRuns:
            code, reason = "budget", _SPENT
        problem.meter.limit = None  # what is left only puts together what was found
        if code == "budget":
            text = (
                f"The budget of {evaluations} evaluations is used up; what was not reached is weighed by linearization."
            )
            do = "Give it a larger budget: --evaluations, or `diagnosis` in [budget]."
            findings.append(Finding("warning", "budget-spent", text, f"study {study.name!r}", do))
        outcome = {
            "code": code,
            "reason": reason,
            "fits": len(found.fits),
            "resumed": resumed,
            "evaluations": None if problem.few_runs is None else -(-problem.meter.spent // len(problem.trials)),
            "wall_s": time.perf_counter() - began,
            "cpu_s": time.process_time() - cpu,
            "settings": {
                name: list(v) if isinstance(v, tuple) else v for name, v in asdict(found.problem.settings).items()
            },
        }
        failed = failures_of(study.model)
        if failed:
            findings.append(failed_runs(failed))
        try:
            if effects is None:
                named = [name for cluster in assembly.decision.clusters for name in cluster.effects]
                findings += untried_forms(study, found.problem.effects, named)
            findings += _moved(study, assembly.coefficients, beside_forces=assembly.gap.shown.discrepancy)
            return assembly.diagnosis(reasons, findings, validation, suggestion, outcome)
        except (np.linalg.LinAlgError, ArithmeticError) as trouble:
            raise SeatruthError(
                f"the hypotheses were fitted, but what they say cannot be computed ({trouble})",
                where=f"study {study.name!r}",
                do="Look for wild values in the trials (`seatruth check`), or leave effects out with --effects.",
            ) from None


_FAULTS = (LookupError, TypeError, ValueError, AttributeError, AssertionError)
"""What a fault of a program raises; a progress callback that ends a run raises something of its own."""


@contextmanager
def _set_aside_where_it_fails(what: str, study: Study, findings: list[Finding]) -> Iterator[None]:
    """A part of the diagnosis that fails is left out, and a finding says so: minutes of fits would be lost with it."""
    try:
        yield
    except SeatruthError:  # says itself what is wrong
        raise
    except (np.linalg.LinAlgError, ArithmeticError) as trouble:
        text = f"Left out: {what}, because its algebra failed ({trouble})."
        do = "Look for wild values in the trials (`seatruth check`)."
        findings.append(Finding("warning", "part-missing", text, f"study {study.name!r}", do))
    except _FAULTS as fault:
        if os.environ.get(DEBUG):
            raise
        text = f"Left out: {what}, because of a fault in seatruth ({type(fault).__name__}: {fault})."
        do = f"Please report it with the output of the same command with {DEBUG}=1 set."
        findings.append(Finding("warning", "part-missing", text, f"study {study.name!r}", do))


def _work(study: Study, effects: Sequence[Effect], settings: Settings) -> str:
    """What decides the fits: another study, library or setting begins anew."""
    names = ",".join(f"{effect.name}:{type(effect).__module__}" for effect in effects)
    return hashlib.sha256(f"{study.content_hash}|{names}|{settings!r}".encode()).hexdigest()


def _moved(study: Study, coefficients: Sequence[Coefficient], *, beside_forces: bool) -> list[Finding]:
    """Coefficients that the refit surely moved far from what the study states of them: often the cause itself."""
    stated = {p.name for p in study.parameters if p.vary and p.prior is not None}
    return moved_coefficients(stated, coefficients, beside_forces=beside_forces)


def _set_aside(found: Search) -> list[Finding]:
    """Hypotheses that could not be fitted, in one finding."""
    fitted = {key for key, _ in found.fits}
    failed = sorted(
        (" and ".join(key) or "the model alone", why) for key, why in found.failed.items() if key not in fitted
    )
    if not failed:
        return []
    names = [name for name, _ in failed]
    shown = "; ".join(f"{name}: {why}" for name, why in failed[:3])
    text = f"{len(names)} hypotheses could not be fitted and were set aside ({shown})."
    do = "They have no probability. Mend what the reason names, or leave these effects out (`--effects`)."
    return [Finding("note", "hypothesis-set-aside", text, f"study {found.problem.study.name!r}", do)]
