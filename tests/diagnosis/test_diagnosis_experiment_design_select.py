"""Which trial is suggested."""

from __future__ import annotations

from pathlib import Path

import pytest
import small_case as small

from seatruth.diagnosis.clusters import Cluster
from seatruth.diagnosis.experiment_design.candidates import MAX_PHASES
from seatruth.diagnosis.experiment_design.discrimination import Rivals
from seatruth.diagnosis.experiment_design.select import next_trial, survivors
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.parts import NextTrial
from seatruth.diagnosis.search import search
from seatruth.effects import available
from seatruth.trials.trial import Trial

CHANCES = {"rudder_offset": 0.7, "gyro_bias": 0.2, "heading_bias": 0.1}


@pytest.fixture(scope="module")
def found(ship_folder: Path) -> Search:
    """Short trials of a rudder that stands off: not much is known yet."""
    runs = small.trials(ship_folder, {"rudder_offset_angle": small.OFFSET}, specs=["rudder_offset"])
    return search(small.problem(ship_folder, small.shortened(runs[:2], 30)), small.silent)


@pytest.fixture(scope="module")
def suggested(found: Search) -> NextTrial:
    return next_trial(found, CHANCES, small.silent)


def test_the_suggestion_is_the_best_of_the_menu(suggested: NextTrial) -> None:
    assert suggested.manoeuvre
    assert suggested.menu[0].manoeuvre == suggested.manoeuvre
    assert suggested.survivors == tuple(CHANCES)
    assert suggested.noncentrality_then >= suggested.noncentrality_now
    assert suggested.gain == suggested.menu[0].gain > 1.0
    assert len(suggested.manoeuvre.split(", then ")) <= MAX_PHASES
    assert set(suggested.inputs) == {"delta"}
    assert len(suggested.t) == len(suggested.inputs["delta"])


def test_causes_that_all_act_are_no_rivals() -> None:
    """Of an ROV with a dead band and a weak thruster, both named, a trial was to tell the one from the other."""

    def named(*names: str) -> Cluster:
        return Cluster(names, "root", 0.95, names)

    sets = {("thrust_gain", "thruster_dead_band"): 0.9, ("thruster_dead_band",): 0.02, ("drag_increase",): 0.01}
    dead, weak = named("thruster_dead_band"), named("thrust_gain")
    assert survivors([dead, weak], sets, available()) == ["drag_increase"]
    assert survivors([weak], sets, available()) == ["thrust_gain", "thruster_dead_band", "drag_increase"]
    either = named("thrust_gain", "battery_discharge")
    assert survivors([dead, either], sets, available()) == ["thrust_gain", "battery_discharge", "drag_increase"]


def test_it_is_the_same_again(found: Search, suggested: NextTrial) -> None:
    assert next_trial(found, CHANCES, small.silent) == suggested


def test_what_a_refit_does_not_bear_out_is_not_suggested(
    found: Search, suggested: NextTrial, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A linear step promises much of the first trial; with rivals refitted it tells next to nothing."""
    first, second = (entry.manoeuvre for entry in suggested.menu[:2])

    def one_bears_out(self: Rivals, s: str, trial: Trial | None) -> float:
        return 200.0 if trial is not None and trial.name == second else 2.0

    monkeypatch.setattr(Rivals, "refitted", one_bears_out)
    borne_out = next_trial(found, CHANCES, small.silent)
    assert borne_out.manoeuvre == second
    # Both as refitted: a linear distance now may be larger than a refitted one then.
    linear = next(entry.noncentrality for entry in suggested.menu if entry.manoeuvre == second)
    assert linear > 200.0
    assert (borne_out.noncentrality_now, borne_out.noncentrality_then) == (2.0, 200.0)
    monkeypatch.setattr(Rivals, "refitted", lambda self, s, trial: 2.0)
    none = next_trial(found, CHANCES, small.silent)
    assert (none.manoeuvre, none.gain, none.menu[0].manoeuvre) == ("", 1.0, first)


def test_one_survivor_needs_no_further_trial(found: Search) -> None:
    for chances in ({"rudder_offset": 1.0}, {}):
        found_trial = next_trial(found, chances, small.silent)
        assert found_trial.manoeuvre == ""
        assert found_trial.survivors == tuple(chances)
        assert not found_trial.menu


TWIN = """
from seatruth.effects.actuators import RudderOffset


class Twin(RudderOffset):
    name = "twin"
    title = "another name of the same cause"
"""


def test_none_is_suggested_where_nothing_helps(ship_folder: Path, offset_runs: list[Trial]) -> None:
    """Two effects of the same equations stay the same in every trial."""
    (ship_folder / "twin.py").write_text(TWIN)
    problem = small.problem(ship_folder, offset_runs[:2], ["rudder_offset", "twin.py:Twin"])
    twins = search(problem, small.silent)
    suggestion = next_trial(twins, {"rudder_offset": 0.5, "twin": 0.5}, small.silent)
    assert suggestion.manoeuvre == ""
    assert suggestion.text
    assert suggestion.noncentrality_then == suggestion.noncentrality_now
    assert suggestion.gain == 1.0
    assert suggestion.t == ()
