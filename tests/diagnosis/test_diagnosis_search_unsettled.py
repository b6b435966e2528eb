"""A search in which no fit converges beside missing forces, on the small ship."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import small_case as small

from seatruth.diagnosis import hypothesis_fits
from seatruth.diagnosis.fit import FEW_ROUNDS, ROUNDS, Fit, fit
from seatruth.diagnosis.hypotheses import comparable
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial


@pytest.mark.parametrize("settled", [True, False])
def test_where_no_leading_fit_converges_sets_are_not_tried(
    ship_folder: Path, plain_runs: list[Trial], settled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing tells sets apart then; a hopeless fit that converged is none of the leading ones."""
    problem = small.problem(ship_folder, plain_runs)
    rounds = dict[tuple[tuple[str, ...], bool], int]()

    def fitted(*arguments: Any, **options: Any) -> Fit:
        rounds[arguments[1], options["discrepancy"]] = options["rounds"]
        return replace(fit(*arguments, **options), settled=settled)

    monkeypatch.setattr(hypothesis_fits, "fit", fitted)
    found = search(problem, small.silent)
    assert comparable(found) == settled
    assert (("sets of several effects",) in found.failed) != settled
    beside = [number for (key, on), number in rounds.items() if key and on]
    assert beside
    assert {*beside} == {ROUNDS if settled else FEW_ROUNDS}
    assert rounds[(), True] == ROUNDS
