"""What a further trial adds to the noncentrality between rivals, against refits to noise-free trials."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth.diagnosis.experiment_design.candidates import Menu
from seatruth.diagnosis.experiment_design.discrimination import Rivals
from seatruth.diagnosis.fit import Fit, without_discrepancy
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects
from seatruth.trials.trial import Trial, Trials

CHANCES = {"rudder_offset": 0.7, "gyro_bias": 0.2, "heading_bias": 0.1}
PAIR = ("rudder_offset", "gyro_bias")


@pytest.fixture(scope="module")
def found(ship_folder: Path) -> Search:
    """A rudder that stands off by so little that all is nearly linear."""
    runs = small.trials(ship_folder, {"rudder_offset_angle": 0.004}, specs=["rudder_offset"])
    return search(small.problem(ship_folder, runs), small.silent)


def test_a_further_trial_never_takes_information_away(found: Search) -> None:
    rivals, menu = Rivals(found, CHANCES), Menu(found.problem)
    one = rivals.after(menu.trial(["zigzag of delta"]).trial)
    more = rivals.after(menu.trial(["zigzag of delta"] * 2).trial)
    assert one is not None
    assert more is not None
    for pair, value in rivals.before.items():
        assert one[pair] >= value * (1.0 - 1e-6)
        assert more[pair] >= one[pair] * (1.0 - 1e-6)
    assert min(rivals.gains(one).values()) >= 1.0 - 1e-6


def test_it_is_the_misfit_that_refitting_a_rival_leaves(found: Search) -> None:
    """The rival and the coefficients are refitted to noise-free trials of the true cause, with one more trial too.

    Priors of coefficients stand about the true values.
    """
    problem = found.problem
    rivals = Rivals(found, CHANCES)
    option = Menu(problem).trial(["turn by -delta"]).trial
    after = rivals.after(option)
    assert after is not None
    true = rivals.true["rudder_offset"]
    values = problem.named(true)
    runs = []
    for number, trial in enumerate([*problem.trials, option]):
        sim = problem.on_trial(trial, (), values)
        first = true.initial[number][None] if number < len(problem.trials) else sim.initial_states
        y = sim.outputs(np.zeros((1, 0)), first).y[0]
        outputs = {name: y[:, c] for c, name in enumerate(problem.outputs)}
        runs.append(Trial(trial.name, trial.t, {"delta": trial.inputs["delta"]}, outputs, synthetic=True))
    for many, table in ((4, rivals.before), (5, after)):
        study = problem.study.replace(trials=Trials(runs[:many]))
        clean = Problem(study, list(problem.effects.values()), problem.settings, threads=1)
        clean.mean[clean.coefficients] = true.shared[problem.coefficients]
        point = dataclasses.replace(clean.start, shared=clean.mean.copy())
        sizes = rivals.sizes
        for _ in range(6):
            step = Likelihood(clean, clean.linearize(point, PAIR[1:])).solve(sizes, PAIR[1:])
            point = clean.moved(point, step.shared, step.local)
        errors = clean.errors(point) / np.exp(sizes.white)[clean.channel_of]
        active = clean.active(PAIR[1:], discrepancy=True)
        active = active[~np.isin(active, clean.terms)]
        prior = ((point.shared - clean.mean) / clean.sd)[active]
        assert sizes.shape == (0, 0)
        assert table[PAIR] == pytest.approx(float(errors @ errors + prior @ prior), rel=0.05)


def test_rivals_refitted_step_by_step_leave_what_one_step_leaves_where_all_is_linear(found: Search) -> None:
    rivals = Rivals(found, CHANCES)
    option = Menu(found.problem).trial(["turn by -delta"]).trial
    after = rivals.after(option)
    assert after is not None
    for trial, table in ((None, rivals.before), (option, after)):
        nearest = min(value for (s, _), value in table.items() if s == "rudder_offset")
        assert rivals.refitted("rudder_offset", trial) == pytest.approx(nearest, rel=0.05)


def test_where_a_refit_begins_does_not_decide_what_it_leaves(found: Search) -> None:
    """From coefficients far off, one linear step comes elsewhere."""
    problem, key = found.problem, (("gyro_bias",), False)
    at = found.fits[key]
    far = at.point.shared.copy()
    far[problem.coefficients] *= (0.5, 2.5)
    moved = dataclasses.replace(at, point=dataclasses.replace(at.point, shared=far))
    rivals = Rivals(found, CHANCES)
    strayed = Rivals(dataclasses.replace(found, fits={**found.fits, key: moved}), CHANCES)
    assert abs(strayed.before[PAIR] / rivals.before[PAIR] - 1.0) > 0.1
    nearest = rivals.refitted("rudder_offset", None)
    assert strayed.refitted("rudder_offset", None) == pytest.approx(nearest, rel=0.02)


def test_a_motion_that_leaves_what_was_recorded_is_unknown(found: Search) -> None:
    wild = Menu(found.problem).trial(["turn by +delta"]).trial
    wild = dataclasses.replace(wild, inputs={"delta": 10.0 * np.asarray(wild.inputs["delta"])})
    assert Rivals(found, CHANCES).after(wild) is None


def test_a_survivor_of_next_to_no_size_stands_at_its_typical_one(found: Search) -> None:
    key = (("gyro_bias",), False)
    at: Fit = found.fits[key]
    shared = without_discrepancy(found.problem, at.point).shared.copy()
    shared[found.problem.columns["gyro_bias"]] = 0.0
    flat = dataclasses.replace(at, point=dataclasses.replace(at.point, shared=shared))
    weak = dataclasses.replace(found, fits={**found.fits, key: flat})
    rivals = Rivals(weak, CHANCES)
    (column,) = found.problem.columns["gyro_bias"]
    assert rivals.true["gyro_bias"].shared[column] != 0.0
    assert rivals.before[("gyro_bias", "rudder_offset")] > 1.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e155, np.inf])
def test_a_survivor_whose_runs_diverge_by_themselves_is_left_out(found: Search, size: float) -> None:
    """Of a survey vehicle three causes were left, one held near its record by forces alone: no trial was suggested."""
    fits = dict(found.fits)
    for key in ((("gyro_bias",), False), (("gyro_bias",), True)):
        shared = fits[key].point.shared.copy()
        shared[found.problem.columns["gyro_bias"]] = size
        fits[key] = dataclasses.replace(fits[key], point=dataclasses.replace(fits[key].point, shared=shared))
    rivals = Rivals(dataclasses.replace(found, fits=fits), CHANCES)
    assert set(rivals.before) == {("rudder_offset", "heading_bias"), ("heading_bias", "rudder_offset")}
    assert rivals.after(Menu(found.problem).trial(["zigzag of delta"]).trial) is not None


def test_the_mean_goes_by_probability(found: Search) -> None:
    rivals = Rivals(found, CHANCES)
    assert rivals.mean({"rudder_offset": 1.0, "gyro_bias": 0.0, "heading_bias": 0.0}) == pytest.approx(0.7)


@pytest.fixture(scope="module")
def on_one_course() -> Search:
    """Straight runs to the north in a current to the east: its track can be that of a compass that is off."""
    model = boat.Boat()
    runs = boat.trials(
        model,
        [{"delta": np.zeros(80)}] * 3,
        headings=(0.0, 0.02, -0.02),
        effects={"current_east": 0.05},
        specs=["current"],
    )
    bare = [dataclasses.replace(t, outputs={n: t.outputs[n] for n in ("u", "r", "psi", "x", "y")}) for t in runs]
    problem = Problem(boat.study(model, bare), load_effects(["current", "heading_bias"]), Settings(), threads=1)
    return search(problem, small.silent)


def test_a_reciprocal_run_separates_a_current_from_a_heading_bias(on_one_course: Search) -> None:
    rivals = Rivals(on_one_course, {"current": 0.5, "heading_bias": 0.5})
    menu = Menu(on_one_course.problem)
    same = rivals.after(menu.trial(["straight run"]).trial)
    back = rivals.after(menu.trial(["straight run"], "reciprocal course: ").trial)
    assert same is not None
    assert back is not None
    for pair in (("current", "heading_bias"), ("heading_bias", "current")):
        assert back[pair] > 2.0 * same[pair] > 2.0 * rivals.before[pair]


@pytest.mark.parametrize(
    ("kind", "sign", "allowed"), [("auv", 1, (0.0, 32.0)), ("glider", -1, (-32.0, 0.0)), ("ship", 1, (-18.0, 32.0))]
)
def test_no_submerged_vehicle_is_asked_out_of_the_water_or_to_loop(
    kind: str, sign: int, allowed: tuple[float, float]
) -> None:
    """Trials of an AUV were suggested in which it would have pitched by 75 deg, and stood 10 m above the surface."""
    outputs = {"z": sign * np.array([2.0, 12.0]), "theta": np.radians([-20.0, 25.0]), "u": np.array([1.0, 1.5])}
    model = SimpleNamespace(kind=kind, standard_of=lambda name: (name, sign if name == "z" else 1))
    trials, study = [SimpleNamespace(outputs=outputs)], SimpleNamespace(model=model)
    at: Any = SimpleNamespace(problem=SimpleNamespace(outputs=[*outputs], trials=trials, study=study))
    found = Rivals._recorded_ranges(at)
    assert found[0] == pytest.approx(allowed)
    assert np.degrees(found[1]) == pytest.approx([-42.5, 47.5])
    assert found[2] == pytest.approx((0.0, 2.5))
