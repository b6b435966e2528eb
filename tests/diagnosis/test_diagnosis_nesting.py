"""Sets of effects and their parts on equal terms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis import nesting
from seatruth.diagnosis.hypotheses import Key, Search
from seatruth.diagnosis.nesting import nest
from seatruth.diagnosis.screening import beside
from seatruth.diagnosis.search import search
from seatruth.trials.trial import Trial

BIAS: Key = ("gyro_bias",)


@pytest.fixture(scope="module")
def found(ship_folder: Path, plain_runs: list[Trial]) -> Search:
    """Nothing acts: every effect is worth a little less than the model alone."""
    return search(small.problem(ship_folder, plain_runs), small.silent)


def test_no_set_is_behind_what_it_is_beside_the_model_alone(found: Search) -> None:
    for on in (False, True):
        values = beside(found, found.fits[(), on], list(found.problem.effects))
        assert len(values) == len(found.problem.effects)
        for name, value in values.items():
            own = found.fits.get(((name,), on))
            reached = found.screened[(name,), on] if own is None else own.evidence
            assert reached > value - 0.6


def test_a_fit_that_is_behind_is_made_again_from_its_part(found: Search) -> None:
    good = found.fits[BIAS, False]
    behind = replace(good, evidence=good.evidence - 12.0)
    spoilt = Search(found.problem, found.known, fits={**found.fits, (BIAS, False): behind})
    nest(spoilt)
    assert spoilt.fits[BIAS, False].evidence == pytest.approx(good.evidence, abs=0.6)
    others = [place for place in found.fits if place != (BIAS, False)]
    assert all(spoilt.fits[place].evidence >= found.fits[place].evidence for place in others)


def test_what_was_only_screened_gets_the_better_of_its_values(found: Search) -> None:
    """Its linearized evidence is that of a fit, in a model as linear as this one."""
    fits = {place: fit for place, fit in found.fits.items() if not set(BIAS) & set(place[0])}
    spoilt = Search(found.problem, found.known, fits=fits, screened={(BIAS, False): found.null.evidence - 30.0})
    nest(spoilt)
    assert (BIAS, False) not in spoilt.fits
    assert spoilt.screened[BIAS, False] == pytest.approx(found.fits[BIAS, False].evidence, abs=0.6)


@pytest.mark.parametrize(("risen", "again"), [(0.0, False), (3.0, True)])
def test_a_fit_begun_from_its_part_is_made_again_only_if_that_became_better(
    found: Search, risen: float, again: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = found.fits[(), True]
    behind = replace(alone, effects=BIAS, evidence=alone.evidence - 12.0)
    begun: dict[Key, tuple[Key, bool, float]] = {BIAS: ((), True, alone.evidence - risen)}
    spoilt = Search(found.problem, found.known, fits={**found.fits, (BIAS, True): behind}, begun=begun)
    made = list[tuple[Key, bool]]()
    monkeypatch.setattr(nesting, "fit_once", lambda _, key, on, *__, **___: made.append((key, on)))
    nest(spoilt)
    assert ((BIAS, True) in made) == again
