"""Thrusters and steering inputs under any name: which forces change, where, and what a servo does to orders."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from twin import Twin, twin_trials

from seatruth.effects import Effect, available, load_effects, with_effects
from seatruth.effects.targets import targets
from seatruth.errors import BadInput
from seatruth.manoeuvres import Stepper
from seatruth.models import BlackBox, Channel, Order, Rudder, Thruster, WithServos, load_model
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial

AHEAD = {"left": 1.0, "right": 1.0, "helm": 0.0}


def forms() -> dict[str, Effect]:
    return {form.name: form for e in available().values() for form in (e, *e.variants(Twin()))}


def rates(effect: str, inputs: dict[str, float], state: dict[str, float] | None = None, **values: float) -> Any:
    """u_dot, v_dot, r_dot of the boat with an effect, less those without it."""
    found = []
    for model, given in ((with_effects(Twin(), [forms()[effect]]), values), (Twin(), {})):
        stepper = Stepper(model, {f"{effect}_{name}": value for name, value in given.items()})
        found.append(stepper.rate(0.0, stepper.first(state or {}), inputs)[:3])
    return np.subtract(*found)


P = Twin().nominal()


def test_a_dead_thruster_turns_the_boat() -> None:
    u, v, r = rates("thruster_gain_left", AHEAD, k=-1.0)
    push = 0.25 * P["T_full"]
    assert (u, v) == (pytest.approx(-push / P["m"]), 0.0)
    assert r == pytest.approx(-push * P["half_beam"] / (0.3 * P["m"]))
    assert rates("thruster_gain", AHEAD, k=-1.0)[2] == pytest.approx(0.0)


def test_directions_and_exchange() -> None:
    _, v, r = rates("thruster_direction_right", AHEAD, azimuth=0.1)
    push = 0.25 * P["T_full"]
    assert v == pytest.approx(push * math.sin(0.1) / (1.5 * P["m"]))
    turned = -0.6 * push * math.sin(0.1) - P["half_beam"] * push * (math.cos(0.1) - 1.0)
    assert r == pytest.approx(turned / (0.3 * P["m"]))
    uneven = {**AHEAD, "right": 0.0}
    assert rates("thrusters_exchanged_left_right", uneven, share=1.0) == pytest.approx(
        [0.0, 0.0, -2.0 * push * P["half_beam"] / (0.3 * P["m"])]
    )


def test_a_tilted_propeller_lifts_the_stern() -> None:
    model = load_model("diving_plane_driven")
    tilted = with_effects(model, [available()["thruster_tilt"]])
    given, inputs = {"thruster_tilt_tilt": 0.1}, {"delta_s": 0.0, "T": 100.0}
    rise = [
        Stepper(m, values).rate(0.0, Stepper(m).first({"u": 1.0}), inputs)[1:3]
        for m, values in ((tilted, given), (model, {}))
    ]
    heave, pitch = np.subtract(*rise)
    assert heave < 0.0  # down is positive
    assert pitch < 0.0  # abaft, upwards: the nose goes down


def test_losses_come_where_they_belong() -> None:
    assert rates("thruster_hull_interaction", AHEAD, k=0.3) == pytest.approx([0.0, 0.0, 0.0])
    astern = {"left": -1.0, "right": -1.0, "helm": 0.0}
    assert rates("thruster_hull_interaction", astern, k=0.3)[0] == pytest.approx(0.3 * 0.5 * P["T_full"] / P["m"])
    assert rates("thruster_oblique_loss", AHEAD, {"u": 2.0}, k=0.5)[0] == pytest.approx(0.0)
    push, jet = 0.25 * P["T_full"], 2.0 * 0.25 * P["T_full"] / (1000.0 * math.pi * 0.06**2)
    lost = 2.0 * push * 0.5 * 0.64 / (0.64 + jet) / P["m"]
    assert rates("thruster_oblique_loss", AHEAD, {"v": 0.8}, k=0.5)[0] == pytest.approx(-lost)
    assert rates("voltage_sag", AHEAD, k=0.2)[0] == pytest.approx(-0.2 * 0.5 * 0.5 * P["T_full"] / P["m"])
    assert rates("voltage_sag", {**AHEAD, "right": 0.0}, k=0.2)[0] == pytest.approx(-0.2 * 0.25 * push / P["m"])


def test_a_dead_band_is_a_share_of_full_power() -> None:
    inside, outside = {"left": 0.1, "right": 0.1, "helm": 0.0}, {"left": 1.1, "right": 0.0, "helm": 0.0}
    pushed = 0.25 * P["T_full"] / P["m"]
    assert rates("thruster_dead_band", inside, band=0.06)[0] == pytest.approx(-2 * pushed * 0.01)
    assert rates("thruster_dead_band_left", outside, band=0.05)[0] == pytest.approx(pushed * (1.0 - 1.21))
    assert rates("thruster_dead_band_right", outside, band=0.05) == pytest.approx([0.0, 0.0, 0.0])


def simulated(model: Any, values: dict[str, float], names: tuple[str, ...]) -> np.ndarray:
    runs, _ = twin_trials()
    sim = simulator(model, runs[:1], values={**model.nominal(), **values})
    states = sim.states(np.zeros(0), sim.initial_states)
    order = [channel.name for channel in model.states]
    return states[:, [order.index(name) for name in names]]


def test_a_lag_makes_the_servo_of_the_study_slower() -> None:
    """0.3 s of the study and 0.5 s of the effect are a servo of 0.8 s; so with the slowness of limits."""
    stated = WithServos(Twin(), {"left": Order(lag=0.3, rate_limit=1.0)})
    slowed = with_effects(stated, load_effects(["thruster_lag_left", "thruster_rate_limit_left"], model=Twin()))
    extra = {"thruster_lag_left_tau": 0.5, "thruster_rate_limit_left_slowness": 2.0}
    whole = WithServos(Twin(), {"left": Order(lag=0.8, rate_limit=0.5)})
    seen = ("r", "psi", "left_acting")
    np.testing.assert_allclose(simulated(slowed, extra, seen), simulated(whole, {}, seen), atol=1e-12)
    assert np.abs(simulated(slowed, {}, seen) - simulated(stated, {}, seen)).max() < 1e-12


def test_effects_on_a_rudder_act_on_any_steering_input() -> None:
    known = available()
    assert known["rudder_lag"].places(Twin()) == ("actuator:helm",)
    assert known["rudder_backlash"].missing(Twin()) == ""
    turned = rates("rudder_offset", AHEAD, {"u": 1.0}, angle=0.1)
    assert turned[2] == pytest.approx(P["N_helm"] * 0.1 / (0.3 * P["m"]))


def test_two_rudders_are_late_alike_or_one_alone() -> None:
    class TwoRudders(Twin):
        name = "two_rudders"
        inputs = (*Twin.inputs, Channel("helm_2", "rad"))
        actuators = (*Twin.actuators, Rudder("second", "helm_2"))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            return Twin.rhs(s, i._replace(helm=0.5 * (i.helm + i.helm_2)), p, e)

    model = TwoRudders()
    names = [form.name for form in available()["rudder_delay"].variants(model)]
    assert names == ["rudder_delay", "rudder_delay_nozzle", "rudder_delay_second"]
    both, second = (with_effects(model, load_effects([name], model=model)) for name in (names[0], names[2]))
    filters = [channel.name for channel in available()["rudder_delay"].states]
    assert [state.name for state in both.states[6:]] == [
        f"rudder_delay_{name}_{rudder}" for rudder in ("nozzle", "second") for name in filters
    ]
    assert len(second.states) == 6 + len(filters)
    assert [parameter.name for parameter in both.parameters[-1:]] == ["rudder_delay_tau"]


def test_names_of_single_thrusters_need_the_model() -> None:
    assert load_effects(["voltage_sag", "thruster_gain_right"], model=Twin())[1].which == ("right",)
    with pytest.raises(BadInput, match="thruster_gain_righ"):
        load_effects(["thruster_gain_righ"], model=Twin())
    assert [form.name for form in available()["voltage_sag"].variants(Twin())] == ["voltage_sag"]
    pairs = targets(available()["thrusters_exchanged"], Twin())
    assert [(target.thruster, target.other) for target in pairs] == [(0, 1)]


def test_where_they_cannot_act_is_said() -> None:
    known = available()
    assert "names no thruster" in known["thruster_gain"].missing(load_model("mmg"))
    assert "no two thrusters" in known["thrusters_exchanged"].missing(load_model("mmg"))
    assert "no diameter" in known["thruster_oblique_loss"].missing(load_model("diving_plane_driven"))

    class Silent(Twin):
        thrusts = None

    assert "thrusts" in known["thruster_gain"].missing(Silent())
    assert known["thruster_lag"].missing(Silent()) == ""


def test_a_black_box_can_have_a_slow_thruster() -> None:
    drive, u = Channel("drive_m", "1"), Channel("u", "m/s")
    box = BlackBox("box", lambda trial, p, first: {"u": trial.inputs["drive_m"]}, inputs=(drive,), outputs=(u,),
                   parameters=())  # fmt: skip
    box.actuators = (Thruster("only", "drive_m", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), full=4.0),)
    model = with_effects(box, [available()["thruster_rate_limit"], available()["thruster_dead_band"]])
    t = np.arange(0.0, 5.0, 0.5)
    trial = Trial("t", t, {"drive_m": np.where(t > 0, 2.0, 0.0)}, {}, synthetic=True)
    values = {"thruster_rate_limit_slowness": 4.0, "thruster_dead_band_band": 0.1}
    assert isinstance(model, BlackBox)
    found = model.run(trial, values, None)[:, 0]
    assert found[1:] == pytest.approx(np.maximum(0.0, np.minimum(2.0, np.interp(t[1:], t, found + 0.4)) - 0.4))
    assert found[-1] == pytest.approx(1.6)
    assert found[4] < 1.6


def test_a_diagnosis_tries_few_effects_on_each_of_many_thrusters() -> None:
    """Eight thrusters alike, the gain of each, and pairs exchanged; any other single form has its name."""
    rov = load_model("bluerov2_heavy")
    known = available()
    single = [form.name for e in known.values() for form in e.candidates(rov) if len(form.which) == 1]
    assert len(single) == 8
    assert all(name.startswith("thruster_gain_") for name in single)
    assert [form.name for form in known["thruster_lag"].candidates(rov)] == ["thruster_lag"]
    assert len(known["thrusters_exchanged"].candidates(rov)) == len(known["thrusters_exchanged"].variants(rov)) == 28
    assert load_effects(["thruster_lag_up_rear_port"], model=rov)[0].which == ("up_rear_port",)
    for effect in known.values():
        forms = effect.candidates(Twin())
        assert [form.name for form in forms] == [form.name for form in effect.variants(Twin())]


class OneOrder(Twin):
    """The same boat with one order for both thrusters."""

    name = "one_order"
    actuators = tuple(
        dataclasses.replace(one, input="left") if isinstance(one, Thruster) else one for one in Twin.actuators
    )


def test_what_is_done_to_an_order_of_two_thrusters_is_done_once() -> None:
    """A dead time of each jet under one order would be two, and neither jet has one of its own."""
    effects = available()
    for name in ("thruster_delay", "thruster_lag", "thruster_dead_band", "thruster_rate_limit"):
        assert [target.input for target in targets(effects[name], OneOrder())] == ["left"], name
        assert [form.name for form in effects[name].variants(OneOrder())] == [name]
    assert targets(effects["thrusters_exchanged"], OneOrder()) == ()
    weak = [form.name for form in effects["thruster_gain"].variants(OneOrder())]
    assert weak == ["thruster_gain", "thruster_gain_left", "thruster_gain_right"]
