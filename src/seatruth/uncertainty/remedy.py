"""What is tried once where the runs stray: other ways into the same problem.

First the trials are cut into segments that start from the record, so that no run can leave it for long; the cost then
has fewer local minima (Bock 1983 starts multiple shooting in the same way). Where that search ends, the search of the
whole runs starts again, with initial states from the first samples. Where runs still stray, a few other starts follow.
The answer stays the one that the study asks for; a finding says what the other ways gave.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from seatruth.arrays import Array
from seatruth.costs.options import TrajectoryOptions
from seatruth.costs.problem import EstimationProblem
from seatruth.costs.registry import cost_of
from seatruth.costs.study_cost import StudyCost
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.optimizers import Budget, Outcome, minimise, starting_points
from seatruth.trials.finding import Finding
from seatruth.uncertainty.optima import indistinguishable
from seatruth.uncertainty.reliability import Stray, stray_runs

_PARTS = 8
"""Segments into which the longest trial is cut. Chosen here [S]: within one, few runs can go astray."""
_FEWEST_SAMPLES = 20
"""Samples of a segment at least. Chosen here [S]."""
_STARTS = 4
"""Other starts that are tried. Chosen here [S]: few, as a user can ask for more."""
_STEPS = 30
"""Steps of least squares that each search may take at least. Chosen here [S]."""


@dataclass(frozen=True)
class Remedy:
    """What another way gave: the way in words, its best outcome, the evaluations of all ways, and the runs that still
    stray."""

    way: str
    outcome: Outcome
    evaluations: int
    strays: Sequence[Stray]


def other_ways(study: EstimationProblem, outcome: Outcome, *, more_starts: bool, threads: int | None) -> Remedy | None:
    """The best that other ways give, up to the first that leaves no run astray; None where there is no other way.

    Each search is one of least squares. It may use as many evaluations as the search of the study has used. A black box
    may take seconds for each: there nothing is tried.

    Args:
        study: The study.
        outcome: How its search ended.
        more_starts: Whether other starts are tried as well.
        threads: Threads of a simulation; None for all processors.

    Raises:
        SeatruthError: The model cannot be simulated there.
        KeyboardInterrupt: The user stopped it.
    """
    if isinstance(study.model, BlackBox) or not isinstance(study.cost, TrajectoryOptions):
        return None
    best: Remedy | None = None
    spent = 0
    for way, found, evaluations in _ways(study, study.cost, outcome, more_starts, threads):
        spent += evaluations
        cost = cost_of(study, threads=threads)
        if np.isfinite(found.value) and (best is None or found.value < best.outcome.value):
            cost.reweight(found.x)
            best = Remedy(way, found, spent, stray_runs(cost, cost.predict(found.x)))
        if best is not None and not best.strays:
            break
    return None if best is None else replace(best, evaluations=spent)


def _ways(
    study: EstimationProblem, options: TrajectoryOptions, outcome: Outcome, more_starts: bool, threads: int | None
) -> Iterator[tuple[str, Outcome, int]]:
    """Each way in words, where its search of the whole runs ended, and the evaluations that it took."""
    cost = cost_of(study, threads=threads)
    budget = Budget(evaluations=max(outcome.evaluations, _STEPS * (len(cost.parameters) + 1)))
    seconds = _segments(study)
    if options.segments is None and seconds is not None:
        pieces = study.replace(cost=options.replace(segments=seconds, initial="fixed", initial_sd={}))
        first = _search(cost_of(pieces, threads=threads), budget)
        start = np.clip(np.concatenate([first.x, cost.start[len(first.x) :]]), *cost.bounds)
        second = _search(cost, budget, start)
        yield f"by way of segments of {seconds:g} s", second, first.evaluations + second.evaluations
    if more_starts:
        for number, start in enumerate(starting_points(cost, _STARTS + 1, outcome.seed)[1:], 1):
            found = _search(cost_of(study, threads=threads), budget, start)
            yield f"from the {_ORDER[number - 1]} of {_STARTS} other starts", found, found.evaluations


_ORDER = ("first", "second", "third", "last")


def _segments(study: EstimationProblem) -> float | None:
    """The length of segments, s; None where the trials are too short to cut."""
    longest = max(study.trials, key=lambda trial: trial.duration)
    parts = min(_PARTS, len(longest) // _FEWEST_SAMPLES)
    return float(f"{longest.duration / parts:.2g}") if parts > 1 else None


def remedy_finding(remedy: Remedy, value: float, inflation: float, parameters: Sequence[Parameter]) -> Finding:
    """The finding that says whether another way leads to a better optimum than the answer, whose cost is `value`.

    Args:
        remedy: What was tried.
        value: The cost of the answer.
        inflation: Standard errors over those that white noise of the stated size gives.
        parameters: The free parameters, without initial states.
    """
    lower = value - remedy.outcome.value
    count = len(remedy.strays)
    left = f"{count} run{'s' if count > 1 else ''} still stray{'' if count > 1 else 's'}" if count else "no run strays"
    # A fit from which no run strays is judged by the noise, not by the residuals of one from which runs do.
    if lower > indistinguishable(inflation if count else 1.0):
        # All of them: half a set of start values leads nowhere.
        values = [f"{p.name} = {x:.4g}" for p, x in zip(parameters, remedy.outcome.x)]
        return Finding(
            "warning",
            "better-optimum",
            f"There is a better optimum: {remedy.way}, a search ends at a cost lower by {lower:.3g}, and {left} "
            f"({', '.join(values)}). The answer here is "
            "the one that the study asks for.",
            "search",
            "Take these as start values, or search from more starts (`starts = 20` in [optimizer]).",
        )
    return Finding(
        "note",
        "no-better-optimum",
        f"Other ways were tried in {remedy.evaluations} evaluations (segments of the trials, other starts): none ends "
        f"at a better optimum, and {left}.",
        "search",
        "Search from more starts (`starts = 20` in [optimizer]), and check signs, units and what the model leaves out.",
    )


def untried_finding(reason: str) -> Finding:
    """The finding that no other way could be tried."""
    do = "Search from more starts (`starts = 20` in [optimizer]) or from segments (`segments = 20` in [cost])."
    return Finding("note", "other-ways-failed", f"No other way into the problem could be tried: {reason}", "search", do)


def _search(cost: StudyCost, budget: Budget, start: Array | None = None) -> Outcome:
    outcome = minimise(cost, "least_squares", budget=budget, start=start)
    if outcome.code == "interrupted":
        raise KeyboardInterrupt
    return outcome
