"""Which hypotheses are fitted, on the small ship: the effect that acts leads, and a stopped search goes on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis import hypothesis_fits, noise_sharing
from seatruth.diagnosis import search as search_module
from seatruth.diagnosis.fit import Fit, fit_at
from seatruth.diagnosis.hypotheses import HOPE, Key, Search
from seatruth.diagnosis.problem import Point
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.sizes import Sizes, noise_prior
from seatruth.storage.checkpoint import Checkpoint
from seatruth.trials.trial import Trial

Said = list[tuple[str, int, int]]


@pytest.fixture(scope="module")
def searched(ship_folder: Path, offset_runs: list[Trial]) -> tuple[Search, Said, Checkpoint]:
    """One search, what it said of its progress, and what it stored."""
    said: Said = []
    store = Checkpoint(None, "test")
    problem = small.problem(ship_folder, offset_runs)
    return search(problem, lambda text, done, total: said.append((text, done, total)), store), said, store


@pytest.fixture(scope="module")
def found(searched: tuple[Search, Said, Checkpoint]) -> Search:
    return searched[0]


ACTING: Mapping[str, tuple[str, float]] = {
    "rudder_gain": ("rudder_gain_k", 0.6),
    "gyro_bias": ("gyro_bias_b", 0.003),
    "heading_bias": ("heading_bias_b", 0.05),
}


def test_the_effect_that_acts_has_the_highest_evidence(found: Search) -> None:
    assert found.leader.effects == ("rudder_offset",)
    assert found.evidence(("rudder_offset",)) > found.fits[(), False].evidence + 20.0
    assert found.evidence(("rudder_offset",)) > found.null.evidence
    assert not found.failed
    assert not found.interrupted


@pytest.mark.parametrize("name", [pytest.param("rudder_gain", marks=pytest.mark.slow), "gyro_bias"])
def test_other_effects_too(ship_folder: Path, name: str) -> None:
    parameter, value = ACTING[name]
    runs = small.trials(ship_folder, {parameter: value}, specs=[name])
    other = search(small.problem(ship_folder, runs), small.silent)
    assert other.leader.effects == (name,)


def test_all_singles_and_the_model_alone_are_fitted_both_ways(found: Search) -> None:
    assert {(), *((name,) for name in small.EFFECTS)} <= {key for key, _ in found.fits}
    assert ((), False) in found.fits
    assert ((), True) in found.fits
    for (key, on), one in found.fits.items():
        assert one.effects == key
        assert one.discrepancy is on is one.sizes.discrepancy
        assert math.isfinite(one.evidence)
        assert key == tuple(sorted(key))


def test_the_best_fit_of_a_set_is_the_better_of_two(found: Search) -> None:
    both = [found.fits[(), on].evidence for on in (False, True)]
    best = found.best(())
    assert best is not None
    assert best.evidence == max(both) == found.null.evidence
    assert found.best(("gyro_bias", "heading_bias", "rudder_gain")) is None
    assert found.evidence(("nothing",)) == -math.inf


def test_the_linearized_evidence_predicts_that_of_the_fit(found: Search) -> None:
    """Each effect alone, of this ship: within a few nats."""
    for name in small.EFFECTS:
        best = found.best((name,))
        assert best is not None
        if best.evidence > found.null.evidence:
            assert found.expected((name,)) == pytest.approx(best.evidence, abs=5.0)


def test_a_size_is_measured_by_what_is_believed_of_it(found: Search) -> None:
    fit, (column,) = found.fits[("rudder_offset",), False], found.problem.columns["rudder_offset"]
    expected = abs(fit.point.shared[column]) / found.problem.sd[column]
    assert fit.prior_deviations(found.problem, "rudder_offset") == pytest.approx(expected)
    # Of an effect that does not act nothing is away from its null.
    assert found.fits[(), False].prior_deviations(found.problem, "rudder_offset") == 0.0


def test_two_effects_that_act_are_found_together(ship_folder: Path) -> None:
    runs = small.trials(
        ship_folder, {"rudder_offset_angle": 0.02, "gyro_bias_b": 0.003}, specs=["rudder_offset", "gyro_bias"]
    )
    both = search(small.problem(ship_folder, runs), small.silent)
    assert both.leader.effects == ("gyro_bias", "rudder_offset")


def test_the_setting_bounds_the_size_of_a_set(ship_folder: Path) -> None:
    runs = small.trials(
        ship_folder, {"rudder_offset_angle": 0.02, "gyro_bias_b": 0.003}, specs=["rudder_offset", "gyro_bias"]
    )
    single = search(small.problem(ship_folder, runs, settings=Settings(most_effects=1, singles=2)), small.silent)
    assert max(len(key) for key, _ in single.fits) == 1
    assert len({key for key, _ in single.fits if key}) == 2


def test_progress_counts_up_to_what_is_expected(searched: tuple[Search, Said, Checkpoint]) -> None:
    said = searched[1]
    assert said[0][0] == "the model alone"
    assert [done for _, done, _ in said] == sorted(done for _, done, _ in said)
    assert all(done <= total for _, done, total in said)


def test_a_stored_search_is_the_same(
    ship_folder: Path, offset_runs: list[Trial], searched: tuple[Search, Said, Checkpoint]
) -> None:
    found, _, store = searched
    count = len(store)
    again = search(small.problem(ship_folder, offset_runs), small.silent, store)
    assert count == len(store)
    assert again.fits.keys() == found.fits.keys()
    assert again.screened == found.screened
    for place, one in found.fits.items():
        assert again.fits[place].evidence == one.evidence
        np.testing.assert_array_equal(again.fits[place].point.shared, one.point.shared)


@pytest.mark.slow
def test_a_search_without_a_store_is_the_same(ship_folder: Path, offset_runs: list[Trial], found: Search) -> None:
    other = search(small.problem(ship_folder, offset_runs), small.silent)
    assert {place: fit.evidence for place, fit in other.fits.items()} == {
        place: fit.evidence for place, fit in found.fits.items()
    }


def test_an_interrupt_leaves_what_was_reached(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(text: str, done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    cut = search(small.problem(ship_folder, offset_runs), stop)
    assert cut.interrupted
    assert 1 <= len({key for key, _ in cut.fits if key}) < len(small.EFFECTS)


def test_an_interrupt_before_anything_is_fitted_is_one(ship_folder: Path, offset_runs: list[Trial]) -> None:
    def stop(text: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search(small.problem(ship_folder, offset_runs), stop)


EXPLODES = """
from seatruth.effects import Effect
from seatruth.models import Parameter


class Explodes(Effect):
    name = "explodes"
    title = "a rudder that runs away"
    cause = "actuator.steering.gain"
    needs_inputs = ("delta",)
    needs_states = ("r",)
    acts_on = ("actuator:delta",)
    parameters = (Parameter("k", 1e3, "1"),)
    null = {"k": 0.0}
    starts = ({"k": 1e4},)

    @staticmethod
    def true_inputs(i, s, q, e):
        return i._replace(delta=i.delta + q.k * s.r * (1.0 + 1e6 * s.r * s.r))
"""


def test_an_effect_that_makes_the_model_diverge_does_not_win(ship_folder: Path, offset_runs: list[Trial]) -> None:
    (ship_folder / "explodes.py").write_text(EXPLODES)
    problem = small.problem(ship_folder, offset_runs, ["explodes.py:Explodes", *small.EFFECTS])
    other = search(problem, small.silent)
    assert "explodes" not in other.leader.effects
    assert "rudder_offset" in other.leader.effects


def test_a_hypothesis_whose_algebra_fails_is_set_aside(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("not positive definite")

    monkeypatch.setattr(hypothesis_fits, "_fit_forward", fails)
    monkeypatch.setattr(found, "failed", {})
    fits = dict(found.fits)
    hypothesis_fits.fit_both(found, ("gyro_bias",), found.null)
    assert found.failed == {("gyro_bias",): "not positive definite"}
    assert found.fits == fits


def test_no_two_attempts_at_a_hypothesis_are_stored_under_one_name(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the model alone is fitted again as often as it may be: the later one would not be made."""
    begun: dict[str, set[bytes]] = {}
    real = hypothesis_fits.fit_once

    def watched(
        found: Search, key: Key, on: bool, start: Point, sizes: Sizes, attempt: str = "first", **more: Any
    ) -> Fit | None:
        begun.setdefault(f"{key} {on} {attempt}", set()).add(start.shared.tobytes() + sizes.white.tobytes())
        return real(found, key, on, start, sizes, attempt=attempt, **more)

    monkeypatch.setattr(hypothesis_fits, "_NOT_AGAIN", -math.inf)
    for module in (hypothesis_fits, search_module, noise_sharing):
        monkeypatch.setattr(module, "fit_once", watched)
    search(
        small.problem(ship_folder, small.shortened(offset_runs[:2], 30), ["rudder_offset", "gyro_bias"]), small.silent
    )
    assert {"() False from its end, 3", "() False from the end of rudder_offset, 0"} <= begun.keys()
    assert all(len(starts) == 1 for starts in begun.values())


def test_discrepancy_that_went_astray_is_fitted_again_from_the_model_without_it(
    ship_folder: Path, offset_runs: list[Trial], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An unstable ship: the fit with discrepancy was 434 nats behind the one that it contains."""
    problem = small.problem(ship_folder, offset_runs)
    fit_once, lost = hypothesis_fits.fit_once, -1e7

    def astray(found: Search, key: Key, on: bool, start: Point, sizes: Sizes, attempt: str = "first") -> Fit | None:
        before = found.fits.get((key, on))
        got = fit_once(found, key, on, start, sizes, attempt)
        if on and got is not None and attempt != REPEATED and (before is None or before.evidence == lost):
            got = found.fits[key, on] = replace(got, evidence=lost)
        return got

    monkeypatch.setattr(hypothesis_fits, "fit_once", astray)
    again = Search(problem, noise_prior(problem))
    hypothesis_fits.fit_null(again)
    assert again.fits[(), True].evidence > again.fits[(), False].evidence - 8.0


REPEATED = "from its fit without discrepancy"


def short_of_its_end(found: Search, key: Key, part: float) -> Fit:
    """The fit of one effect where its magnitude is only this part of the best one."""
    good, problem = found.fits[key, False], found.problem
    shared = good.point.shared.copy()
    shared[problem.columns[key[0]]] *= part
    point = Point(shared, good.point.initial, good.point.forces)
    return fit_at(problem, key, point, good.sizes, found.known, discrepancy=False, settled=True)


def test_a_set_that_stopped_short_is_fitted_to_its_end(found: Search) -> None:
    """A part of the offset is left, as where steps bring nothing in a curved valley."""
    key: Key = ("rudder_offset",)
    good, short = found.fits[key, False], short_of_its_end(found, key, 0.996)
    assert short.ahead > 1.0
    assert short.evidence == pytest.approx(good.evidence - short.ahead, abs=0.5), "what is ahead is not credited"
    others = {place: fit for place, fit in found.fits.items() if place[0] != key}
    spoilt = Search(found.problem, found.known, fits={**others, (key, False): short})
    search_module._fit_to_the_end(spoilt, 1)
    assert spoilt.fits[key, False].evidence == pytest.approx(good.evidence, abs=0.5)
    assert spoilt.fits[key, False].ahead < 0.5


def test_what_ends_where_it_stopped_is_not_taken_up_again(found: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    key: Key = ("rudder_offset",)
    others = {place: fit for place, fit in found.fits.items() if place[0] != key}
    short, begun = short_of_its_end(found, key, 0.996), list[Key]()
    monkeypatch.setattr(search_module, "fit_once", lambda _, key, *given, **more: begun.append(key))
    spoilt = Search(found.problem, found.known, fits={**others, (key, False): short})
    for turn in (1, 2):
        search_module._fit_to_the_end(spoilt, turn)
    assert begun.count(key) == 1


def test_a_set_that_is_far_behind_but_promises_the_lead_is_not_given_up(found: Search) -> None:
    """A foreign boat's constant current stopped 995 nats short: one that changes with time was named in its place."""
    key: Key = ("rudder_offset",)
    good, short = found.fits[key, False], short_of_its_end(found, key, 0.8)
    rival = replace(found.fits[("gyro_bias",), False], evidence=good.evidence - 10.0)
    assert short.evidence < rival.evidence - found.problem.settings.hopeless
    assert short.promised > rival.evidence
    others = {place: fit for place, fit in found.fits.items() if place[0] != key}
    fits = {**others, (("gyro_bias",), False): rival, (key, False): short}
    spoilt = Search(found.problem, found.known, fits=fits)
    search_module._fit_to_the_end(spoilt, 1)
    assert spoilt.leader.effects == key


def test_where_runs_stray_forces_alone_are_fitted_from_the_end_of_the_leader(
    found: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the rival of all effects, an unknown cause, may stand at a worse optimum than they."""
    key: Key = ("rudder_offset",)
    begun: list[tuple[Key, bool]] = []

    def watched(found: Search, key: Key, on: bool, start: Point, sizes: Sizes, attempt: str, **more: Any) -> None:
        assert not on or sizes.discrepancy
        begun.append((key, on))

    monkeypatch.setattr(search_module, "fit_once", watched)
    for behind, on in ((0.0, False), (1e4, True)):
        begun.clear()
        nothing = found.fits[(), True].evidence
        leading = replace(found.fits[key, False], evidence=nothing + 500.0)
        plain = replace(found.fits[(), False], evidence=nothing - behind)
        fits = {**found.fits, (key, False): leading, ((), False): plain}
        search_module._refit_parts(Search(found.problem, found.known, fits=fits))
        assert (((), True) in begun) == on


def test_a_set_is_tried_without_forces_from_where_they_held_the_runs(
    found: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a lost thruster: a fit of runs that stray ended elsewhere, 1700 nats behind, and a sensor was blamed."""
    key: Key = ("rudder_offset",)
    bare, loose = found.fits[key, False], found.fits[key, True]
    begun: list[tuple[bool, str, float]] = []

    def watched(
        found: Search, key: Key, on: bool, start: Point, sizes: Sizes, attempt: str = "first", rival: float = -math.inf
    ) -> Fit:
        begun.append((on, attempt, rival))
        return loose if on else replace(bare, evidence=loose.evidence - 2000.0)

    monkeypatch.setattr(hypothesis_fits, "fit_once", watched)
    near = found.fits[(), True]
    again = Search(found.problem, found.known, fits={((), True): near, ((), False): found.fits[(), False]})
    again.rival = near.evidence
    monkeypatch.setattr(hypothesis_fits, "_fit_bare", lambda *_: (bare.point, replace(bare, evidence=-1e6)))
    hypothesis_fits._fit_forward(again, key, near)
    # It is broken off where it comes nowhere near what leads.
    assert begun[-1] == (False, "from its fit with discrepancy", near.evidence - HOPE)


def test_runs_that_are_simulated_are_fitted_without_the_forces_that_held_them(found: Search) -> None:
    key: Key = ("rudder_offset",)
    loose, plain = found.fits[key, True], found.fits[(), False]
    again = Search(found.problem, found.known, fits={(key, True): loose, ((), False): plain, ((), True): found.null})
    got = hypothesis_fits.without_forces(again, key)
    assert not got.discrepancy
    assert got.evidence == pytest.approx(found.fits[key, False].evidence, abs=0.5)
    # What is fitted already stays as it is, and the model alone is part of every set.
    assert hypothesis_fits.without_forces(found, key) is found.fits[key, False]
    behind = replace(found.fits[key, False], evidence=plain.evidence - 100.0)
    better = hypothesis_fits.without_forces(replace(found, fits={**found.fits, (key, False): behind}), key)
    assert better.evidence > plain.evidence


def test_a_set_whose_effect_has_another_value_than_alone_is_fitted_from_there(
    found: Search, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A log's lever arm was 2.46 m beside a rudder's gain and 2.79 m alone: two optima, of which one was reported."""
    part, problem = found.fits[("rudder_offset",), False], found.problem
    key: Key = ("gyro_bias", "rudder_offset")
    shared = part.point.shared.copy()
    shared[problem.columns["rudder_offset"]] *= 1.5
    astray = fit_at(
        problem, key, replace(part.point, shared=shared), part.sizes, found.known, discrepancy=False, settled=True
    )
    leading = replace(astray, evidence=part.evidence + 20.0)
    assert search_module._elsewhere(problem, part, leading)
    assert not search_module._elsewhere(problem, part, part)
    begun: list[tuple[Key, str]] = []

    def watched(found: Search, key: Key, on: bool, start: Point, sizes: Sizes, attempt: str, **more: Any) -> None:
        begun.append((key, attempt))

    monkeypatch.setattr(search_module, "fit_once", watched)
    search_module._refit_parts(Search(problem, found.known, fits={**found.fits, (key, False): leading}))
    assert (key, "from the end of rudder_offset, 0") in begun


def test_the_parts_of_a_probable_set_are_fitted_though_they_looked_hopeless(found: Search) -> None:
    """A log's lever arm, linearized at a ninth of its evidence, led beside a rudder's gain and was never fitted."""
    part, problem = found.fits[("rudder_offset",), False], found.problem
    shared = part.point.shared.copy()
    shared[problem.columns["gyro_bias"]] = 1e-5
    both = fit_at(
        problem, ("gyro_bias", "rudder_offset"), replace(part.point, shared=shared), part.sizes, found.known,
        discrepancy=False, settled=True,
    )  # fmt: skip
    left = {place: fit for place, fit in found.fits.items() if not place[0]}
    again = Search(problem, found.known, fits={**left, (both.effects, False): both})
    search_module._fit_missing_parts(again)
    assert again.fits[("rudder_offset",), False].evidence == pytest.approx(part.evidence, abs=0.5)
    assert (("gyro_bias",), False) in again.fits
