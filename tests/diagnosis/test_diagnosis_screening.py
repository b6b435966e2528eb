"""Which effects are worth a fit."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth import Study, TrajectoryOptions, load_model, simulator
from seatruth.diagnosis import screening
from seatruth.diagnosis.fit import fit, fit_at
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.initial_guess import moved_to
from seatruth.diagnosis.marginal_likelihood import Likelihood
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.search import search
from seatruth.diagnosis.settings import Settings
from seatruth.diagnosis.size_search import with_shape
from seatruth.diagnosis.sizes import first_sizes, noise_prior, noise_shapes
from seatruth.effects import available, load_effects, with_effects
from seatruth.statistics.state_space_noise import NoiseShape
from seatruth.trials import Trial, Trials

EXCHANGED = "thrusters_exchanged_port_starboard"


@pytest.mark.slow
def test_currents_that_point_anywhere_are_tried_without_a_common_one() -> None:
    """Days whose currents cancel in the mean: no current that is the same in all leads there."""
    model, truth = boat.Boat(), {}
    own = available()["trial_current"].of_trials([f"run_{k}" for k in range(4)])
    for k, (north, east) in enumerate([(0.2, 0.0), (-0.2, 0.02), (0.0, 0.2), (0.02, -0.2)]):
        truth |= {f"trial_current_north_run_{k}": north, f"trial_current_east_run_{k}": east}
    angles = [{"delta": boat.zigzag(40, 0.3, 8.0)} for _ in range(4)]
    runs = boat.trials(model, angles, headings=(0.0, 2.0, 4.0, 5.0), effects=truth, specs=(own,))
    settings = Settings(most_effects=1)
    problem = Problem(boat.study(model, runs), [available()["current"], own], settings, threads=1)
    assert search(problem, small.silent).leader.effects == ("trial_current",)


@pytest.mark.parametrize(("share", "fitted"), [(1.0, True), (0.06, False)])
def test_a_small_share_of_an_exchange_is_no_exchange(share: float, fitted: bool) -> None:
    """Orders of two thrusters are exchanged or not. A few per cent explain what the model's form lacks elsewhere."""
    model = load_model("twin_thruster")
    (effect,) = load_effects([EXCHANGED], model=model)
    t = np.arange(0.0, 30.0, 0.25)
    rng = np.random.default_rng(5)
    names = [channel.name for channel in model.inputs]
    orders = {name: np.repeat(rng.uniform(0.2, 0.8, 6), 20) * 14.0 for name in names[:2]}
    blank = Trial("steps", t, orders, {c.name: np.zeros(len(t)) for c in model.outputs}, synthetic=True)
    truth = {**model.nominal(), effect.named("share"): share}
    first = np.zeros(len(model.states))
    first[[s.name for s in model.states].index("u")] = 0.5
    y = simulator(with_effects(model, [effect]), [blank], values=truth).outputs(np.zeros((1, 0)), first[None]).y[0]
    noise = {c.name: 0.01 for c in model.outputs}
    outputs = {c.name: y[:, k] + rng.normal(0.0, 0.01, len(t)) for k, c in enumerate(model.outputs)}
    trials = Trials([Trial("steps", t, orders, outputs, synthetic=True)])
    study = Study("steps", model, trials, noise=noise, cost=TrajectoryOptions(initial="free"))
    problem = Problem(study, [effect], Settings(most_effects=1), threads=1)
    found = search(problem, small.silent)
    assert (found.best((EXCHANGED,)) is not None) == fitted
    # Beside other effects it is asked for only where it was fitted alone.
    beside, nothing = cast(Any, SimpleNamespace(effects=("gyro_bias",))), cast(Any, None)
    assert fitted or not screening._may_be_whole(found, beside, nothing, [], EXCHANGED)


def test_slow_noise_of_a_sensor_does_not_hide_its_bias(ship_folder: Path) -> None:
    """The model alone has taken the bias of a gyro for slow noise; with the effect, it is judged with what it needs."""
    runs = small.trials(ship_folder, {"gyro_bias_b": 0.002}, specs=["gyro_bias"])
    problem = small.problem(ship_folder, runs, ["gyro_bias", "rudder_offset"])
    known = noise_prior(problem)
    nothing = fit(problem, (), problem.start, first_sizes(problem, known), known, discrepancy=False)
    wanted = fit(problem, ("gyro_bias",), nothing.point, nothing.sizes, known, discrepancy=False)
    rate = problem.outputs.index("r")
    shape = noise_shapes(problem.settings).index(NoiseShape(3.0, 60.0))
    hidden = with_shape(nothing.sizes, rate, shape, float(wanted.sizes.white[rate]))
    at = fit_at(problem, (), nothing.point, hidden, known, discrepancy=False, settled=True)
    found = screening.beside(Search(problem, known, fits={((), False): at}), at, ["gyro_bias", "rudder_offset"])
    assert found["gyro_bias"] == pytest.approx(wanted.evidence, abs=3.0)
    bare = Likelihood(problem, problem.linearize(nothing.point, ("gyro_bias",), discrepancy=False))
    assert bare.evidence(hidden, ("gyro_bias",)) < wanted.evidence - 10.0
    assert found["rudder_offset"] < found["gyro_bias"] - 10.0


def test_an_effect_promises_from_its_start_what_it_is_worth_linearized_there() -> None:
    """A few simulations tell which starts matter."""
    model = boat.Boat()
    names = ("rudder_dead_band", "rudder_backlash", "rudder_rate_limit")
    truth = {"rudder_dead_band_band": 0.05}
    angles = [{"delta": boat.zigzag(120, 0.2, every)} for every in (15.0, 25.0)]
    runs = boat.trials(model, angles, headings=(0.0, 1.0), effects=truth, specs=names[:1])
    problem = Problem(boat.study(model, runs), [available()[name] for name in names], Settings(), threads=1)
    known = noise_prior(problem)
    at = fit(problem, (), problem.start, first_sizes(problem, known), known, discrepancy=False)
    found = Search(problem, known, fits={((), False): at})
    starts = {name: ordered[0] for name, ordered in screening._ordered_starts(found, at, names).items()}
    assert [*starts] == [*names]
    promised = screening._promised(found, at, starts, at.sizes)
    for name, values in starts.items():
        full, _ = screening._score_from(found, at, (name,), name, values, at.sizes)
        assert promised[name][0] - at.evidence > 0.5 * (full - at.evidence) - 1.0
    assert max(promised, key=lambda name: promised[name][0]) == "rudder_dead_band"
    assert promised["rudder_dead_band"][0] > at.evidence + 20.0


def test_differences_are_derivatives() -> None:
    model = boat.Boat()
    runs = boat.trials(model, [{"delta": boat.zigzag(60, 0.2, 15.0)}], headings=(0.5,))
    problem = Problem(boat.study(model, runs), [available()["current"], available()["position_delay"]], Settings())
    point = moved_to(problem, problem.start, "position_delay", np.array([0.3]))
    exact = problem.linearize(point, ("current", "position_delay"), discrepancy=False)
    for name in ("current", "position_delay"):
        columns = problem.columns[name]
        found = screening._slopes(problem, point, columns, exact.errors)
        assert found == pytest.approx(exact.shared[:, columns], rel=1e-3, abs=1e-5)


@pytest.mark.parametrize("blows", [True, False])
def test_winds_that_point_anywhere_are_asked_for_without_a_common_one(blows: bool) -> None:
    """Days whose winds cancel in the mean, and days without wind."""
    model, truth = boat.Hull(), {}
    own = available()["trial_wind"].of_trials([f"run_{k}" for k in range(4)])
    for k, (north, east) in enumerate([(6.0, 0.0), (-6.0, 0.5), (0.0, 6.0), (0.5, -6.0)] if blows else []):
        truth |= {f"trial_wind_north_run_{k}": north, f"trial_wind_east_run_{k}": east}
    angles = [{"delta": boat.zigzag(80, 0.3, 12.0)} for _ in range(4)]
    runs = boat.trials(model, angles, headings=(0.0, 2.0, 4.0, 5.0), effects=truth, specs=(own,))
    problem = Problem(boat.study(model, runs), [available()["wind"], own], Settings(), threads=1)
    known = noise_prior(problem)
    at = fit(problem, (), problem.start, first_sizes(problem, known), known, discrepancy=False)
    found = Search(problem, known, fits={((), False): at})
    assert screening.own_in_each_trial(found, at) == (["trial_wind"] if blows else [])


@pytest.mark.parametrize(("starts", "promised"), [(True, 21.0), (False, 15.0)])
def test_what_has_no_slope_at_its_null_promises_beside_others_what_it_brought_alone(
    monkeypatch: pytest.MonkeyPatch, starts: bool, promised: float
) -> None:
    """Of play of a rudder and a late log the play promised nothing beside the log, and the pair was not fitted."""

    def fitted(evidence: float) -> SimpleNamespace:
        return SimpleNamespace(effects=("speed_delay",), evidence=evidence, discrepancy=True)

    fits = {((), False): fitted(0.0), (("play",), False): fitted(9.0), (("speed_delay",), False): fitted(12.0)}
    effects = {"play": SimpleNamespace(starts=starts)}
    found: Any = SimpleNamespace(fits=fits, problem=SimpleNamespace(effects=effects))
    monkeypatch.setattr(screening, "beside", lambda *_: {"play": 15.0})
    late: Any = fitted(20.0)
    assert screening._alone(found, late, ["play"]) == {"play": promised}
