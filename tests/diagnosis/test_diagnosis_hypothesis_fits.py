"""Where the fit of one hypothesis begins."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis import hypothesis_fits, steps
from seatruth.diagnosis.fit import Fit, fit, fit_at
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.search import search
from seatruth.diagnosis.sizes import Sizes, noise_prior
from seatruth.trials.trial import Trial

WAVY = """
import math

from seatruth.effects import Effect
from seatruth.models import Parameter


class Wavy(Effect):
    name = "wavy"
    title = "a gyro whose error has valleys before its whole size"
    cause = "sensor"
    source = "chosen here"
    acts_on = ("sensor:r",)
    needs_outputs = ("r",)
    parameters = (Parameter("share", 1.0, "1", min=-0.5, max=1.5),)
    null = {"share": 0.0}
    likely = ({"share": 1.0},)

    @staticmethod
    def measured_outputs(y, s, i, q, e):
        return y._replace(r=y.r + 0.6 * (q.share + 0.25 * math.sin(4.0 * math.pi * q.share)) * s.r)
"""


def test_a_fit_starts_from_likely_values_too(ship_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the null the first fit ends in a valley on the way, over which a longer step would lead by luck."""
    monkeypatch.setattr(steps, "_LENGTHS", (1.0, 1.0))
    (ship_folder / "wavy.py").write_text(WAVY)
    runs = small.trials(ship_folder, {"wavy_share": 1.0}, specs=["wavy.py:Wavy"])
    problem = small.problem(ship_folder, runs, ["wavy.py:Wavy"])
    (column,) = problem.columns["wavy"]
    ends: dict[str, Fit] = {}
    whole = hypothesis_fits.fit_once

    def noted(found: Search, key: Key, discrepancy: bool, *given: object, **named: object) -> Fit | None:
        end = whole(found, key, discrepancy, *given, **named)
        if key and not discrepancy:
            ends[str(named.get("attempt", "first"))] = end
        return end

    monkeypatch.setattr(hypothesis_fits, "fit_once", noted)
    leader = search(problem, small.silent).leader
    assert ends["first"].point.shared[column] < 0.8
    assert ends["from likely value 0 of wavy"].evidence > ends["first"].evidence + 100.0
    assert leader.point.shared[column] == pytest.approx(1.0, abs=3.0 * leader.stderr(problem)[column])


def test_a_part_that_diverges_where_its_set_ended_is_begun_beside_the_model_alone(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of an AUV a scale of its speed sensor was never fitted without the cross-flow drag beside which it was found."""
    problem = small.problem(ship_folder, offset_runs)
    found, key = search(problem, small.silent), ("rudder_offset",)
    near, alone = found.fits[key, False], found.fits[(), False]
    begun: dict[str, Point] = {}

    def diverges_there(_: Search, key: Key, discrepancy: bool, start: Point, sizes: Sizes, attempt: str) -> Fit | None:
        begun[attempt] = start
        return near if "at its end" in attempt else None

    monkeypatch.setattr(hypothesis_fits, "fit_once", diverges_there)
    del found.fits[key, False]
    assert hypothesis_fits.ensure(found, key, near, "as a part") is near
    there, with_values, at_its_end = begun.values()
    assert next(iter(begun)) == "as a part"
    columns, rest = problem.columns["rudder_offset"], problem.coefficients
    np.testing.assert_array_equal(with_values.shared[columns], near.point.shared[columns])
    np.testing.assert_array_equal(with_values.shared[rest], alone.point.shared[rest])
    assert at_its_end is alone.point
    assert there is not with_values


def test_where_a_fit_stops_the_earlier_one_stands(ship_folder: Path, offset_runs: list[Trial]) -> None:
    found, key = search(small.problem(ship_folder, offset_runs), small.silent), ("rudder_offset",)
    known = found.fits[key, False]
    again = hypothesis_fits.fit_once(
        found, key, False, found.problem.start, known.sizes, attempt="a test", stop=lambda point: True
    )
    assert again is known
    assert found.fits[key, False] is known


def test_a_further_fit_ends_where_it_comes_to_a_known_optimum(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From afar it takes a few steps; the optimum of another value of the effect does not end it."""
    problem = small.problem(ship_folder, offset_runs)
    found, key = search(problem, small.silent), ("rudder_offset",)
    known = found.fits[key, False]
    ends: list[Fit] = []

    def noted(*given: Any, **named: Any) -> Fit:
        ends.append(fit(*given, **named))
        return ends[-1]

    monkeypatch.setattr(hypothesis_fits, "fit", noted)
    columns = problem.columns["rudder_offset"]
    shared = known.point.shared.copy()
    shared[columns] *= 1.5
    away = Point(shared, known.point.initial, known.point.forces)
    assert not known.leads_here(problem, away)
    stop = found.known_end(key, False)
    again = hypothesis_fits.fit_once(found, key, False, away, known.sizes, attempt="from afar", stop=stop)
    assert again is known
    assert not ends
    astray = fit_at(problem, key, away, known.sizes, found.known, discrepancy=False, settled=True)
    found.fits[key, False] = astray
    got = hypothesis_fits.fit_once(
        found, key, False, away, known.sizes, attempt="from the wrong end", stop=found.known_end(key, False)
    )
    assert got is not None
    assert got.point.shared[columns] == pytest.approx(known.point.shared[columns], rel=1e-3)
    assert found.known_end(("gyro_bias", "sway_bias"), True) is None


def test_a_fit_that_ends_far_from_what_it_promises_is_begun_under_the_sizes_it_was_given(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a boat with its antenna off its place, forces of no size left 370,000 nats ahead, and the antenna was last."""
    problem = small.problem(ship_folder, offset_runs)
    found, key = search(problem, small.silent), ("rudder_offset",)
    good, held = found.fits[key, True], list[bool]()
    bent = replace(good, evidence=good.evidence - 2e5, ahead=3e5, settled=False)

    def ends(*given: Any, **named: Any) -> Fit:
        held.append(named.get("held", False))
        return good if held[-1] else bent

    monkeypatch.setattr(hypothesis_fits, "fit", ends)
    del found.fits[key, True]
    got = hypothesis_fits.fit_once(found, key, True, good.point, good.sizes, attempt="a test")
    assert (got, held) == (good, [False, True])
    bent = replace(good, ahead=5.0)
    del found.fits[key, True], held[:]
    assert hypothesis_fits.fit_once(found, key, True, good.point, good.sizes, attempt="another") is bent
    assert held == [False]


def test_a_run_on_another_branch_is_not_at_the_known_optimum(ship_folder: Path, offset_runs: list[Trial]) -> None:
    problem = small.problem(ship_folder, offset_runs)
    known = search(problem, small.silent).fits[("rudder_offset",), False]
    turned = known.point.initial.copy()
    turned[:, problem.initial_names.index("psi")] += np.pi / 2
    assert known.leads_here(problem, known.point)
    assert not known.leads_here(problem, Point(known.point.shared, turned, known.point.forces))
    assert not replace(known, settled=False).leads_here(problem, known.point)


def test_the_fits_of_the_model_alone_are_told_one_by_one(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """Each may take minutes, and a log that stands still looks like a hang."""
    problem, told = small.problem(ship_folder, offset_runs), list[str]()
    hypothesis_fits.fit_null(Search(problem, noise_prior(problem)), told.append)
    with_forces, without, again = told
    assert "with missing forces" in with_forces
    assert "without missing forces" in without
    assert "from its end" in again
