"""Effects with values for each trial: each acts on its own trial alone, and a study makes them for its trials."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth import BadInput, Budget, identify, load_study
from seatruth.effects import Effect, available, with_effects
from seatruth.effects.each_trial import EachTrial
from seatruth.effects.environment import Current
from seatruth.effects.sensors import HeadingBias, SpeedBias
from seatruth.errors import PluginError
from seatruth.models import BlackBox, Channel, Parameter, load_model
from seatruth.sample import copy_to
from seatruth.simulate import evaluate_rhs, evaluate_rhs_jacobian, simulator
from seatruth.study import Study
from seatruth.trials.trial import Trial, Trials

TIME = np.arange(0.0, 20.0, 0.5)
STATE = np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.5])


def run(name: str) -> Trial:
    inputs = {"delta": np.full(TIME.size, 0.2), "n": np.full(TIME.size, 10.0)}
    return Trial(name, TIME, inputs, {"x": np.zeros(TIME.size)}, synthetic=True)


def outputs(effect: Effect, values: dict[str, float], trials: list[str], backend: Any = "compiled") -> list[np.ndarray]:
    model = with_effects(load_model("mmg"), [effect])
    runs = [run(name) for name in trials]
    sim = simulator(model, runs, values={**model.nominal(), **values}, backend=backend)
    y = sim.outputs(np.zeros((1, 0)), np.tile(STATE, (len(runs), 1))).y[0]
    return [y[rows] for rows in sim.rows]


def test_each_trial_has_its_own_current() -> None:
    own = available()["trial_current"].of_trials(["out", "way back"])
    assert own.magnitudes == ("north_out", "east_out", "north_way_back", "east_way_back")
    values = {"trial_current_north_out": 0.3, "trial_current_east_way_back": -0.2}
    found = outputs(own, values, ["out", "way back", "another day"])
    still = {"current_north": 0.0, "current_east": 0.0}
    for y, same in zip(found, ({"current_north": 0.3}, {"current_east": -0.2}, {})):
        (expected,) = outputs(Current(), {**still, **same}, ["any"])
        np.testing.assert_allclose(y, expected, atol=1e-12)
    for compiled, plain in zip(found, outputs(own, values, ["out", "way back", "another day"], "reference")):
        np.testing.assert_allclose(compiled, plain, atol=1e-9)


def test_what_is_believed_of_a_magnitude_is_alike_between_trials() -> None:
    own = available()["trial_wind"].of_trials(["a", "b", "c"])
    assert isinstance(own, EachTrial)
    values = dict(zip((q.name for q in own.parameters), own.correlation))
    row = dict(zip(values, values["north_b"]))
    alike = {name: value for name, value in row.items() if value}
    assert alike == {"north_a": EachTrial.alike, "north_b": 1.0, "north_c": EachTrial.alike}
    (form, *_) = own.shape_priors
    assert values[form].sum() == 1.0


def test_equation_error_knows_the_trial_of_a_row() -> None:
    model = with_effects(load_model("mmg"), [available()["trial_current"].of_trials(["out", "back"])])
    values = {**model.nominal(), "trial_current_north_back": 0.3}
    states, inputs = np.tile(STATE, (3, 1)), np.tile([0.1, 10.0], (3, 1))
    number = np.array([model.number_of(name) for name in ("out", "back", "other")])
    rates = evaluate_rhs(model, np.zeros(0), (), values, states, inputs, trial=number)
    assert (rates[0] == rates[2]).all()
    assert abs(rates[1] - rates[0]).max() > 1e-4
    plain = evaluate_rhs(model, np.zeros(0), (), values, states, inputs, trial=number, backend="reference")
    np.testing.assert_allclose(rates, plain, atol=1e-12)
    slopes = evaluate_rhs_jacobian(
        model, np.array([0.3]), ("trial_current_north_back",), values, states, inputs, trial=number
    )
    assert (slopes[[0, 2]] == 0.0).all()
    assert abs(slopes[1]).max() > 1e-3


def test_the_form_is_common_and_the_sizes_are_typical() -> None:
    model, wind = load_model("mmg"), available()["wind"]
    own = available()["trial_wind"].of_trials(["a", "b"])
    assert own.shape_priors == wind.shape_priors
    assert own.priors(model)["east_b"] == wind.priors(model)["east"]
    assert len(own.starting_points(model)) == len(wind.starting_points(model))
    assert all(start["north_a"] == start["north_b"] for start in own.starts)


def test_names_that_are_no_identifiers_stay_apart() -> None:
    own = available()["trial_current"].of_trials(["10/10", "10 10"])
    assert own.magnitudes == ("north_10_10", "east_10_10", "north_10_10_2", "east_10_10_2")


def test_one_trial_needs_no_current_of_its_own() -> None:
    assert "`current` says the same" in available()["trial_current"].of_trials(["one"]).missing(load_model("mmg"))


class BiasOfTrial(EachTrial):
    """A speed log that is set anew each day."""

    like = SpeedBias
    name = "bias_of_trial"
    title = "offset of the log in each trial"
    cause = SpeedBias.cause


def test_a_black_box_can_have_one() -> None:
    u = Channel("u", "m/s")
    box = BlackBox("box", lambda trial, p, first: {"u": np.ones(len(trial))}, inputs=(), outputs=(u,), parameters=())
    model = with_effects(box, [BiasOfTrial(["a", "b"])])
    assert isinstance(model, BlackBox)
    trial = Trial("b", TIME, {}, {}, synthetic=True)
    values = {**model.nominal(), "bias_of_trial_b_a": 5.0, "bias_of_trial_b_b": 0.25}
    np.testing.assert_allclose(model.run(trial, values, None)[:, 0], 1.25)


def test_an_effect_with_states_cannot_differ() -> None:
    class Late(EachTrial):
        like = type(available()["rudder_lag"])
        name = "late"
        cause = "actuator.steering.dynamics.lag"

    with pytest.raises(PluginError, match="cannot differ from trial to trial"):
        Late()


def test_two_effects_must_name_the_same_trials() -> None:
    class HeadingOfTrial(EachTrial):
        like = HeadingBias
        name = "heading_of_trial"
        cause = HeadingBias.cause

    with pytest.raises(BadInput, match="different trials"):
        with_effects(load_model("mmg"), [BiasOfTrial(["a", "b"]), HeadingOfTrial(["a", "c"])])


def test_a_study_without_those_trials_is_refused() -> None:
    model = with_effects(load_model("mmg"), [available()["trial_current"]])
    with pytest.raises(BadInput, match="none for 'run'"):
        Study(name="s", model=model, trials=Trials([run("run")]), parameters=model.parameters)


@pytest.fixture
def own_currents(tmp_path: Path) -> Study:
    """The study of the sample, on whose trials one current acted, with a current of its own in each trial."""
    copy_to(tmp_path)
    text = (tmp_path / "study.toml").read_text().replace('"current', '"trial_current')
    (tmp_path / "own.toml").write_text(text)
    return load_study(tmp_path / "own.toml")


def test_a_study_file_makes_it_for_its_trials(own_currents: Study) -> None:
    assert own_currents.model.trials == tuple(trial.name for trial in own_currents.trials)
    assert "trial_current_east_speed_steps" in {parameter.name for parameter in own_currents.free}


@pytest.mark.slow
def test_identification_finds_the_current_of_each_trial(own_currents: Study) -> None:
    found = identify(own_currents.replace(budget=Budget(evaluations=400))).parameters
    for way, true in (("north", 0.08 * math.cos(math.radians(70.0))), ("east", 0.08 * math.sin(math.radians(70.0)))):
        own = found.loc[[f"trial_current_{way}_{trial.name}" for trial in own_currents.trials]]
        assert (np.abs(own["value"] - true) < 4.0 * own["stderr"]).all()
        assert (own["stderr"] < 0.05).all()


def test_parameters_carry_the_trial() -> None:
    own = available()["trial_current"].of_trials(["out", "back"])
    assert isinstance(own.parameters[0], Parameter)
    assert "trial out" in own.parameters[0].description


@pytest.mark.parametrize(("name", "like"), [("trial_heading_bias", "heading_bias"), ("trial_gyro_bias", "gyro_bias")])
def test_a_sensor_that_is_set_anew_has_an_offset_of_its_own_in_each_trial(name: str, like: str) -> None:
    own, common = available()[name].of_trials(["out", "back"]), available()[like]
    assert own.cause == common.cause
    (out, back, other) = outputs(own, {f"{name}_b_out": 0.2}, ["out", "back", "other"])
    (shown,) = outputs(common, {f"{like}_b": 0.2}, ["any"])
    (none,) = outputs(common, {f"{like}_b": 0.0}, ["any"])
    np.testing.assert_allclose(out, shown, atol=1e-12)
    np.testing.assert_allclose(np.array([back, other]), np.array([none, none]), atol=1e-12)
    assert own.start == common.start
