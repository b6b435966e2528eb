"""Late positions, and the drift in turns that they may be taken for."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis import late_or_drifting
from seatruth.diagnosis.fit import Fit, fit
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.late_or_drifting import drifting
from seatruth.diagnosis.problem import Point, Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import first_sizes, noise_prior
from seatruth.effects import load_effects

LATE: Key = ("position_delay",)
ARM: Key = ("position_lever_arm",)


def found(*effects: str, discrepancy: bool = True) -> Search:
    """Positions 0.08 s late at 2 m/s, 0.16 m, of a boat that slides outward by 2 m for each radian of its turn."""
    rudders = [{"delta": boat.zigzag(120, angle, 20.0)} for angle in (0.2, -0.1)]
    runs = boat.trials(
        boat.Boat(), rudders, headings=(0.0, 1.0), specs=LATE, effects={"position_delay_tau": 0.08},
        noise={**boat.NOISE, "x": 0.005, "y": 0.005},
    )  # fmt: skip
    problem = Problem(boat.study(boat.Boat(), runs), load_effects(effects), Settings(knots=5))
    known = noise_prior(problem)
    sizes = first_sizes(problem, known)
    fits = {
        (key, on): fit(problem, key, problem.start, sizes, known, discrepancy=on)
        for key in ((), LATE)
        for on in {False, discrepancy}
    }
    return Search(problem, known, fits=fits)


@pytest.fixture(scope="module")
def search() -> Search:
    return found(*LATE, *ARM)


def test_at_an_even_speed_a_late_position_looks_like_another_drift(search: Search) -> None:
    """A receiver as far ahead as the positions are late is fitted in the place of the delay, and explains as much."""
    late = search.fits[LATE, True]
    assert drifting(search, late, LATE) == [*LATE]
    ahead = search.fits[ARM, True]
    assert ahead.evidence == pytest.approx(late.evidence, abs=5.0)
    forward = float(ahead.point.shared[search.problem.columns[ARM[0]]][0])
    assert forward == pytest.approx(-0.16, abs=0.05)
    assert drifting(search, None, LATE) == []


@pytest.mark.parametrize(("behind", "like"), [(2.0, True), (40.0, False)])
def test_it_is_late_where_no_place_explains_nearly_as_much(
    search: Search, behind: float, like: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a ferry whose receiver was 0.8 s late any place ahead was 38 nats behind the delay."""
    late, begun = search.fits[LATE, True], list[Any]()

    def fitted(found: Search, key: Key, discrepancy: bool, start: Point, *_: Any, **__: Any) -> Fit:
        begun.append((key, discrepancy, start.shared[found.problem.columns[ARM[0]]]))
        return replace(late, effects=key, evidence=late.evidence - behind)

    monkeypatch.setattr(late_or_drifting, "fit_once", fitted)
    assert drifting(search, late, LATE) == ([*LATE] if like else [])
    ((key, discrepancy, place),) = begun
    assert (key, discrepancy) == (ARM, True)
    assert place == pytest.approx(np.array([-0.16, 0.0]), abs=0.03)  # where it moves the positions alike


def test_it_is_not_told_apart_where_the_usual_error_of_a_drift_covers_it(
    search: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a river vessel of 110 m that records no sway, 1.1 s are 5 m: a twentieth of its length."""
    monkeypatch.setattr(late_or_drifting, "fit_once", None)  # nothing is fitted
    monkeypatch.setattr(late_or_drifting, "drift_error", lambda problem, at, name: 0.4)
    assert drifting(search, search.fits[LATE, True], LATE) == [*LATE]


def test_where_no_place_is_tried_a_small_delay_looks_like_drift() -> None:
    alone = found(*LATE)
    assert drifting(alone, alone.fits[LATE, True], LATE) == [*LATE]
    # Where nothing is missing nobody asks, and a set that has the place already has no other.
    plain = found(*LATE, *ARM, discrepancy=False)
    assert drifting(plain, plain.fits[LATE, False], LATE) == [*LATE]
    beside = replace(plain.fits[LATE, False], effects=(*LATE, *ARM), discrepancy=True)
    assert drifting(plain, beside, LATE) == [*LATE]
    assert (ARM, True) not in plain.fits
