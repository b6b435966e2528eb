"""Effects with a direction on the earth, each in the place of another one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import boat_case as boat
import numpy as np
import pytest

from seatruth.diagnosis import directions
from seatruth.diagnosis.directions import fit_along_waves, fit_directions
from seatruth.diagnosis.fit import fit_at, without_discrepancy
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.hypothesis_fits import fit_null, fit_once
from seatruth.diagnosis.initial_guess import moved_to
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import noise_prior
from seatruth.effects import load_effects
from seatruth.effects.environment import Current, with_current
from seatruth.models.parameter import Parameter, Prior


class Squall(Current):
    """A current that grows with the square of its size: like a wind, it has no slope at its null."""

    name = "squall"
    title = "squall"
    confused_with = ("current",)
    parameters = Current.parameters
    null: Mapping[str, float] = {"north": 0.0, "east": 0.0}

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        size = math.sqrt(q.north * q.north + q.east * q.east + 1e-12)
        return with_current(e, s, size * q.north, size * q.east)


class Sea(Current):
    """What a squall comes with, of a direction that is known; it hardly moves the boat itself."""

    name = "sea"
    title = "sea"
    comes_with = ("squall",)
    direction = ()
    parameters = (
        Parameter("a", 0.1, "m/s", -1.0, 1.0, source="test"),
        Parameter("towards", 2.6, "rad", -7.0, 7.0, prior=Prior(2.6, 0.05), source="test"),
    )
    null: Mapping[str, float] = {"a": 0.0}

    @staticmethod
    def current(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return with_current(e, s, 1e-3 * q.a * math.cos(q.towards), 1e-3 * q.a * math.sin(q.towards))


TRUE = {"squall_north": -0.5, "squall_east": 0.3}


@pytest.fixture(scope="module")
def found() -> Search:
    """A squall acts; the current that looks like it is fitted, and it is not."""
    squall, sea = Squall(), Sea()
    inputs = [{"delta": boat.zigzag(120, angle, 20.0)} for angle in (0.2, 0.1, 0.3)]
    runs = boat.trials(boat.Boat(), inputs, headings=(0.0, 1.5, 3.0), effects=TRUE, specs=[squall])
    problem = Problem(boat.study(boat.Boat(), runs), [*load_effects(["current"]), squall, sea], Settings(), threads=1)
    search = Search(problem, noise_prior(problem))
    fit_null(search)
    near = search.null
    for on in (True, False):
        at_current = moved_to(problem, near.point, "current", np.array([-0.25, 0.15]))
        fit_once(search, ("current",), on, at_current, near.sizes)
    return search


def test_what_comes_with_waves_begins_where_they_run_to(found: Search) -> None:
    """A set that ended elsewhere, here with no squall at all, is fitted anew along the sea that acts in it."""
    search, key = replace(found, fits=dict(found.fits), replaced={}), ("sea", "squall")
    beside = moved_to(search.problem, search.null.point, "sea", np.array([0.1, 2.6]))
    bare, sizes = without_discrepancy(search.problem, beside), search.null.sizes.without_discrepancy()
    elsewhere = fit_at(search.problem, key, bare, sizes, search.known, discrepancy=False, settled=True)
    search.fits[key, False] = elsewhere
    fit_directions(search, [elsewhere])
    columns = search.problem.columns["squall"]
    assert search.fits[key, False].point.shared[columns] == pytest.approx([-0.5, 0.3], abs=0.03)
    assert [n for *_, drift, n in search.replaced if drift == n] == ["squall"]
    # Along them already: nothing to begin anew.
    search.replaced.clear()
    fit_along_waves(search, search.fits[key, False])
    assert not search.replaced


def test_what_looks_alike_begins_along_the_direction_that_was_found(found: Search) -> None:
    assert not any("squall" in key for key, _ in found.fits)
    fit_directions(found, [found.fits[("current",), False], found.fits[("current",), True]])
    problem = found.problem
    for on in (False, True):
        fit, rival = found.fits[("squall",), on], found.fits[("current",), on]
        values = problem.named(fit.point)
        error = fit.stderr(problem)[problem.columns["squall"]]
        for (name, true), sd in zip(TRUE.items(), error, strict=True):
            assert values[name] == pytest.approx(true, abs=4.0 * sd)
        assert fit.evidence == pytest.approx(rival.evidence, abs=3.0), "the same force by another name"


def test_beside_others_it_also_begins_with_the_values_that_it_has_alone(
    found: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless it explains as much already."""
    search, problem, sets = replace(found, fits=dict(found.fits), replaced={}), found.problem, ("current", "sea")
    sizes, bare = search.null.sizes.without_discrepancy(), without_discrepancy(problem, search.null.point)
    for key, name, values in ((("squall",), "squall", TRUE.values()), (sets, "current", (-0.25, 0.15))):
        point = moved_to(problem, bare, name, np.array([*values]))
        search.fits[key, False] = fit_at(problem, key, point, sizes, search.known, discrepancy=False, settled=True)
    starts: dict[str, Any] = {}
    monkeypatch.setattr(directions, "fit_once", lambda *given, attempt, **_: starts.update({attempt: given[3]}))
    along, leader = "along the direction of current in current+sea", search.fits[sets, False]
    fit_directions(search, [leader])
    assert [*starts] == [along, f"{along}, with its own values"]
    shared = starts[f"{along}, with its own values"].shared
    assert shared[problem.columns["squall"]] == pytest.approx([*TRUE.values()], abs=0.01)
    assert shared[problem.columns["current"]].tolist() == [0.0, 0.0]
    starts.clear()
    search.replaced.clear()
    search.fits[("sea", "squall"), False] = replace(leader, evidence=leader.evidence - 1.0)
    fit_directions(search, [leader])
    assert [*starts] == [along]


def test_what_shows_no_direction_leads_nowhere(found: Search) -> None:
    fits = dict(found.fits)
    fit_directions(found, [fit for (key, _), fit in fits.items() if not key])
    assert found.fits == fits


def test_what_looks_alike_is_asked_again_only_once_a_set_has_risen(
    found: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    monkeypatch.setattr(directions, "fit_once", lambda *_, attempt, **__: asked.append(attempt))
    current = found.fits[("current",), False]
    found = replace(found, replaced={})
    fit_directions(found, [current])
    fit_directions(found, [replace(current, evidence=current.evidence + 0.5)])
    assert asked == ["along the direction of current in current"]
    fit_directions(found, [replace(current, evidence=current.evidence + 4.0)])
    assert asked[1:] == ["along the direction of current in current, 2"]
