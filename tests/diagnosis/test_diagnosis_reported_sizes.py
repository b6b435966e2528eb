"""The fit of an answer without forces, with its effects as large as they are reported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import small_case as small

from seatruth.diagnosis.fit import Fit
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.reported_sizes import reported_fit, with_reported_sizes
from seatruth.diagnosis.search import search
from seatruth.diagnosis.verdict import Hypothesis
from seatruth.trials.trial import Trial

KEY = ("rudder_offset",)


def reporting(found: Search, size: float, *, forces: bool = True) -> tuple[Any, Fit]:
    """The search where the best fit of the offset has another size, by so many standard errors, and that fit."""
    bare = found.fits[KEY, False]
    columns = found.problem.columns[KEY[0]]
    shared = bare.point.shared.copy()
    shared[columns] += size * bare.stderr(found.problem)[columns]
    reported = replace(bare, point=replace(bare.point, shared=shared), discrepancy=forces)
    fits = {**found.fits, (KEY, forces): reported} if forces else found.fits
    best = {KEY: reported}.get
    proxy = SimpleNamespace(problem=found.problem, known=found.known, fits=fits, null=found.null, best=best)
    return proxy, reported


def test_effects_are_simulated_as_large_as_they_are_reported(ship_folder: Path, offset_runs: list[Trial]) -> None:
    problem = small.problem(ship_folder, offset_runs)
    found = search(problem, small.silent)
    bare, columns = found.fits[KEY, False], problem.columns[KEY[0]]
    near, _ = reporting(found, 2.0)
    assert with_reported_sizes(near, KEY, near.best(KEY)) is bare, "two standard errors are no other size"
    far, reported = reporting(found, 12.0)
    got = with_reported_sizes(far, KEY, far.best(KEY))
    assert not got.discrepancy
    error = reported.stderr(problem)[columns]
    assert (np.abs(got.point.shared - reported.point.shared)[columns] < error).all()
    others = problem.coefficients
    assert (got.point.shared[others] != bare.point.shared[others]).any(), "all else is fitted beside them"
    # The problem itself, by which all else is measured, keeps its priors.
    assert problem.mean[columns].tolist() == [0.0]
    alone, _ = reporting(found, 12.0, forces=False)
    assert with_reported_sizes(cast(Search, alone), KEY, alone.best(KEY)) is bare, "that is the fit without forces"


def test_an_effect_is_as_large_as_in_the_most_probable_set_that_holds_it() -> None:
    """Rudders of a ferry: 95 % beside another cross-flow drag, for which its term stands."""
    fits = {("cross_flow", "rudder_gain"): "both", ("rudder_gain",): "alone", ("current",): "current"}
    found = SimpleNamespace(
        fits={(key, True): fit for key, fit in fits.items()},
        beside=lambda key, others: f"answer {key} beside {others}",
    )

    def of(name: str, *sets: tuple[tuple[str, ...], tuple[str, ...]], shown: tuple[str, ...] = ()) -> Any:
        rows = [Hypothesis(key, True, 0.0, 0.0, 0.5, True, True, like) for key, like in sets]
        return reported_fit(cast(Search, found), rows, name, shown, ("waves",))

    assert of("rudder_gain", (("rudder_gain",), ("cross_flow",)), (("rudder_gain",), ())) == "both"
    assert of("rudder_gain", (("current",), ()), (("rudder_gain",), ())) == "alone"
    # Where that set was not fitted as it counts, one that was says nothing of it.
    assert of("rudder_gain", (("current", "rudder_gain"), ()), (("rudder_gain",), ())) is None
    assert of("current", (("current",), ()), shown=("current",)) == "answer ('current',) beside ('waves',)"
    assert of("wind", (("current",), ())) is None
