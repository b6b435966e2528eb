"""What a study must have to be diagnosed, which effects can act on it, and what weakens any answer."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import boat_case as boat
import numpy as np
import pytest
import small_case as small

from seatruth import BadInput
from seatruth.diagnosis.preconditions import (
    on_one_course,
    require_trials,
    untried_forms,
    usable_effects,
    usual_speed,
    weaknesses,
)
from seatruth.diagnosis.problem import Problem
from seatruth.diagnosis.settings import Settings
from seatruth.effects import load_effects, with_effects
from seatruth.effects.curves import DragCurve
from seatruth.models import Rudder, load_model
from seatruth.study import Study
from seatruth.testing.effects import EffectConformance
from seatruth.trials.trial import Trial, Trials


def codes(study: Study) -> set[str]:
    problem = Problem(study, load_effects(("gyro_bias",)), Settings(), threads=1)
    return {finding.code for finding in weaknesses(study, problem)}


def test_a_short_trial_is_refused(ship_folder: Path, plain_runs: list[Trial]) -> None:
    runs = [*plain_runs[:1], *small.shortened(plain_runs[1:2], 5)]
    with pytest.raises(BadInput, match="run_1") as said:
        require_trials(small.study(ship_folder, runs))
    assert "Leave it out" in str(said.value)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_value_whose_square_no_number_holds_is_refused(ship_folder: Path, plain_runs: list[Trial]) -> None:
    r = np.asarray(plain_runs[1].outputs["r"]).copy()
    r[3], r[4] = math.inf, 1e160
    wild = dataclasses.replace(plain_runs[1], outputs={**plain_runs[1].outputs, "r": r})
    with pytest.raises(BadInput, match=r"1e\+160") as said:
        require_trials(small.study(ship_folder, [plain_runs[0], wild]))
    assert "trial 'run_1', channel 'r', t = 4 s" in str(said.value)


def test_effects_that_cannot_act_are_left_out_with_the_reason(ship_folder: Path, plain_runs: list[Trial]) -> None:
    usable, reasons = usable_effects(small.study(ship_folder, plain_runs), None)
    assert {*small.EFFECTS} - {"heading_bias"} <= {effect.name for effect in usable}
    assert reasons["heading_bias"].startswith("no rate depends on 'psi'"), "the start of the heading takes it up"
    assert "output 'u" in reasons["speed_bias"]
    assert all(reasons.values())
    assert not {effect.name for effect in usable} & set(reasons)


def test_an_effect_that_the_model_has_is_not_asked_for_twice(ship_folder: Path, plain_runs: list[Trial]) -> None:
    study = small.study(ship_folder, plain_runs)
    model = with_effects(study.model, load_effects(["gyro_bias"]))
    extended = study.replace(model=model, parameters=(*study.parameters, model.parameter("gyro_bias_b")))
    usable, reasons = usable_effects(extended, ["gyro_bias", "rudder_offset"])
    assert [effect.name for effect in usable] == ["rudder_offset"]
    assert "already" in reasons["gyro_bias"]


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        (["current_shear"], "no effect can act on this model"),
        (["curent"], "there is no effect 'curent'"),
        ([], "no effect"),
    ],
)
def test_without_an_effect_there_is_nothing_to_ask(
    ship_folder: Path, plain_runs: list[Trial], effects: list[str], message: str
) -> None:
    with pytest.raises(BadInput, match=message):
        usable_effects(small.study(ship_folder, plain_runs), effects)


def test_a_good_study_has_no_weakness_but_its_course() -> None:
    runs = boat.trials(boat.Boat(), [{"delta": boat.zigzag(40, 0.1, 8.0)}] * 2, headings=(0.0, 2.0))
    assert codes(boat.study(boat.Boat(), runs)) == set()


def test_weaknesses(ship_folder: Path, plain_runs: list[Trial]) -> None:
    study = small.study(ship_folder, plain_runs)
    assert "one-trial" in codes(study.replace(trials=Trials(plain_runs[:1])))
    twice = [*plain_runs, dataclasses.replace(plain_runs[0], name="copy")]
    assert "duplicate" in codes(study.replace(trials=Trials(twice)))
    fixed = tuple(p.replace(vary=False, prior=None) for p in study.parameters)
    assert "no-coefficients" in codes(study.replace(parameters=fixed))
    bare = tuple(p.replace(prior=None) for p in study.parameters)
    assert "prior-assumed" in codes(study.replace(parameters=bare))


class Singular(boat.Boat):
    """A boat whose yaw moment is a power of its rate of turn times its rudder angle: 0 / 0 amidships."""

    name = "singular"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> Any:
        *rest, r_dot = boat.Boat.rhs(s, i, p, e)
        return (*rest, r_dot - 0.001 * abs(s.r * i.delta) ** 0.6)


class Guarded(Singular):
    """The same, written with an `if`."""

    name = "guarded"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> Any:
        *rest, r_dot = boat.Boat.rhs(s, i, p, e)
        return (*rest, r_dot - (0.001 * abs(s.r * i.delta) ** 0.6 if abs(i.delta) > 1e-6 else 0.0))


def test_a_run_without_derivatives_is_told() -> None:
    """A run with its rudder amidships has none; nor has one that diverges, which is told elsewhere."""
    amidships = {"delta": np.concatenate([np.zeros(10), boat.zigzag(30, 0.1, 8.0)])}
    runs = boat.trials(boat.Boat(), [amidships] * 2, headings=(0.0, 2.0))
    assert codes(boat.study(Singular(), runs)) == {"no-derivatives"}
    assert codes(boat.study(Guarded(), runs)) == set()


def course(*angles: float) -> list[Trial]:
    t = np.arange(5.0)
    return [Trial(f"run {k}", t, {}, {"psi": np.full(5, angle)}) for k, angle in enumerate(angles)]


def test_a_pitch_near_vertical_weakens(ship_folder: Path, plain_runs: list[Trial]) -> None:
    """There a rate of pitch of the body turns roll and heading by any amount."""
    for largest, weak in ((1.2, False), (1.5, True)):
        pitch = largest * np.sin(plain_runs[1].t)
        pitch[3] = math.nan
        steep = dataclasses.replace(plain_runs[1], outputs={**plain_runs[1].outputs, "theta": pitch})
        study = small.study(ship_folder, [plain_runs[0], steep])
        assert ("near-vertical" in codes(study)) == weak


def test_one_course() -> None:
    assert on_one_course(course(0.1, -0.1, 0.2))
    assert on_one_course(course(0.1, 2.0 * math.pi - 0.1))
    assert not on_one_course(course(0.0, math.pi))
    assert not on_one_course([Trial("turn", np.arange(5.0), {}, {"psi": np.linspace(0.0, 4.0, 5)})])
    assert not on_one_course([Trial("none", np.arange(5.0), {}, {})])


class Pair(boat.Catamaran):
    """The catamaran with its rudders named."""

    name = "pair"
    actuators = (Rudder("port", "port"), Rudder("starboard", "starboard"))


def test_effects_come_in_the_forms_that_the_model_has() -> None:
    """Each actuator that a model names can be late alone, and each trial can have a current of its own."""
    runs = boat.trials(Pair(), [{"port": np.zeros(20), "starboard": np.zeros(20)}] * 2, headings=(0.0, 1.0))
    asked = ["rudder_lag", "trial_current", "rudder_gain_port"]
    usable, _ = usable_effects(boat.study(Pair(), runs), asked)
    found = {effect.name: effect for effect in usable}
    lags = ["rudder_lag", "rudder_lag_port", "rudder_lag_starboard"]
    assert list(found) == [*lags, "trial_current", "rudder_gain_port"]
    assert found["trial_current"].trials == ("run_0", "run_1")
    alone, reasons = usable_effects(boat.study(Pair(), runs[:1]), ["trial_current", "current"])
    assert [effect.name for effect in alone] == ["current"]
    assert "there is one trial" in reasons["trial_current"]


def test_the_usual_speed_is_recorded_or_that_between_positions() -> None:
    model = load_model("mmg")
    t = np.arange(0.0, 10.0, 0.5)
    way = {"x": -0.6 * t, "y": 0.8 * t}
    gap = way | {"x": np.where(t == 3.0, np.nan, way["x"])}
    astern = Trial("astern", t, {}, {"u": np.full_like(t, -2.0)} | way)
    assert usual_speed(model, [astern]) == 2.0
    assert usual_speed(model, [Trial("tracked", t, {}, gap)]) == pytest.approx(1.0)
    assert usual_speed(model, [Trial("turned", t, {}, {"psi": t})]) == 0.0


def test_what_refers_to_a_usual_speed_takes_that_of_the_trials() -> None:
    t = np.arange(20.0)
    run = Trial("run", t, {"delta": 0.0 * t, "n": 0.0 * t + 9.0}, {"u": np.full_like(t, 1.2)})
    study: Any = SimpleNamespace(name="one run", model=load_model("mmg"), trials=[run])
    (curve,) = usable_effects(study, ["drag_curve"])[0]
    assert isinstance(curve, DragCurve)
    assert curve.speed == 1.2


def test_effects_on_one_of_many_thrusters_are_tried_where_a_study_names_them() -> None:
    model = load_model("bluerov2")
    t = np.arange(0.0, 20.0)
    inputs = {channel.name: np.full(20, 15.0 if channel.name == "voltage" else 0.2) for channel in model.inputs}
    runs = [Trial(f"run {k}", t, inputs, {"psi": np.full(20, float(k))}, synthetic=True) for k in range(2)]
    study = boat.study(model, runs)
    alone = {effect.name for effect in usable_effects(study, None)[0] if len(effect.which) == 1}
    assert alone == {f"thruster_gain_{one.name}" for one in model.actuators}
    asked = ["thruster_lag_up_port", "thrusters_exchanged_up_starboard_up_port", "thruster_dead_band"]
    assert [effect.name for effect in usable_effects(study, asked)[0]] == asked
    assert len(usable_effects(study, ["thrusters_exchanged"])[0]) == 15


def test_other_faults_of_one_of_many_thrusters_are_named_where_its_gain_is() -> None:
    model = load_model("bluerov2_heavy")
    trial, _ = EffectConformance().trial(model)
    outputs = {channel.name: np.ones(len(trial)) for channel in model.outputs}
    study = Study("rov", model, Trials([dataclasses.replace(trial, outputs=outputs, synthetic=True)]))
    tried = {effect.name: effect for effect in usable_effects(study, None)[0]}
    assert untried_forms(study, tried, ["current", "thruster_lag"]) == []
    (finding,) = untried_forms(study, tried, ["thruster_gain_front_port"])
    assert finding.code == "untried-forms"
    names = finding.do.removeprefix("Compare them: --effects ").removesuffix(".").split(",")
    assert {"thruster_gain_front_port", "thruster_lag_front_port", "thruster_dead_band_front_port"} <= set(names)
    again, _ = usable_effects(study, names)
    assert [effect.name for effect in again] == names, "what it says can be asked for"
    assert untried_forms(study, {effect.name: effect for effect in again}, names[:1]) == []


def test_an_offset_that_is_part_of_the_start_is_left_out() -> None:
    """A depth that is 0.7 m off is the start at another depth, unless the hull is pressed together as it sinks."""
    t = np.arange(20.0)
    dive = Trial("dive", t, {"delta_s": 0.0 * t}, {"z": 0.1 * t, "theta": 0.0 * t, "u": 0.0 * t + 1.2})
    study: Any = SimpleNamespace(name="one dive", model=load_model("diving_plane"), trials=[dive])
    usable, reasons = usable_effects(study, ["depth_bias", "depth_scale"])
    assert [effect.name for effect in usable] == ["depth_scale"]
    assert "no rate depends on 'z'" in reasons["depth_bias"]


def test_what_no_trial_can_show_takes_no_part() -> None:
    """Of a river vessel, sway was not recorded and the bow thruster never ran: seven effects that could not act."""
    model = load_model("bluerov2")
    t, idle = np.arange(20.0), model.actuators[0]
    inputs = {channel.name: np.full(20, 15.0 if channel.name == "voltage" else 0.2) for channel in model.inputs}
    outputs = {channel.name: 0.1 * t for channel in model.outputs if channel.name != "v"}

    def tried(**more: np.ndarray) -> tuple[set[str], dict[str, str]]:
        runs = [Trial(f"run {k}", t, {**inputs, **more}, outputs, synthetic=True) for k in range(2)]
        usable, reasons = usable_effects(boat.study(model, runs), ["sway_bias", "heading_bias", "thruster_gain"])
        return {effect.name for effect in usable}, reasons

    usable, reasons = tried(**{idle.input: np.zeros(20)})
    assert (reasons["sway_bias"], "heading_bias" in usable) == ("no trial records 'v'", True)
    assert reasons[f"thruster_gain_{idle.name}"] == f"no trial moves {idle.input!r}"
    # All thrusters together act by those that run, and one that ran at times acts by itself.
    assert "thruster_gain" in usable
    assert f"thruster_gain_{idle.name}" in tried(**{idle.input: np.where(t < 5.0, 0.1, 0.0)})[0]
