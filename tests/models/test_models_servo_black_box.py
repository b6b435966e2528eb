"""Servos in front of a black box: what it gets, and the same run as equations behind the same servos."""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import pytest
from fmu_ships import ship_fmu

from seatruth.effects import load_effects, with_effects
from seatruth.errors import BadInput
from seatruth.manoeuvres import TurningCircle, run_manoeuvre
from seatruth.models import (
    BlackBox,
    Channel,
    IsolatedBlackBox,
    Model,
    Observation,
    Order,
    Parameter,
    ServoBlackBox,
    WithServos,
    load_fmu,
    load_model,
    observed,
    with_servos,
)
from seatruth.models.servo_black_box import ActingTrial, behind_servos, followed
from seatruth.simulate import simulator
from seatruth.trials import Trial
from seatruth.workers import by_value

SHIP = load_model("mmg")
T = np.arange(0.0, 40.0, 0.5)
STEPS = np.radians(20.0) * np.where(np.sin(T / 5.0) > 0.0, 1.0, -1.0)
FIRST = {"u": 0.8, "v": 0.0, "r": 0.0, "x": 0.0, "y": 0.0, "psi": 0.3}
RUN = Trial("run", T, {"delta": STEPS, "n": np.full(T.size, 10.4)}, {k: np.full(T.size, v) for k, v in FIRST.items()})
HELM = {"delta": Order(lag=0.8, rate_limit=math.radians(8.0), delay=0.7)}


def echo(trial: Trial, p: Mapping[str, float], first: Any) -> dict[str, Any]:
    return {"angle": trial.inputs["delta"]}


def box(**changes: Any) -> BlackBox:
    fields = {"inputs": [Channel("delta", "rad")], "outputs": [Channel("angle", "rad")], "parameters": []}
    return BlackBox("echo", echo, **{**fields, **changes})


def sailed(trial: Trial, p: Mapping[str, float], first: Mapping[str, float]) -> dict[str, Any]:
    """The equations as somebody's own simulator; its inputs are straight lines between samples."""
    start = np.array([[first[channel.name] for channel in SHIP.states]])
    y = simulator(SHIP, [trial], threads=1).outputs(np.zeros((1, 0)), start).y[0]
    return {channel.name: y[:, k] for k, channel in enumerate(SHIP.outputs)}


def ship_box() -> BlackBox:
    return BlackBox("ship", sailed, inputs=SHIP.inputs, outputs=SHIP.outputs, parameters=[], states=SHIP.states)


def outputs(model: Model, hold: Literal["foh", "zoh"] = "foh", values: Mapping[str, float] | None = None) -> np.ndarray:
    sim = simulator(model, [RUN], values={**model.nominal(), **(values or {})}, hold=hold, threads=1, max_step=0.1)
    return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])


@pytest.mark.parametrize(
    ("effects", "values"),
    [
        ([], {}),
        (["rudder_lag"], {"rudder_lag_tau": 1.5}),
        (["rudder_rate_limit", "rudder_dead_band"], {"rudder_rate_limit_slowness": 5.0, "rudder_dead_band_band": 0.05}),
    ],
)
def test_a_black_box_runs_as_the_equations_do(effects: list[str], values: dict[str, float]) -> None:
    """Effects lengthen the servo that is there; the others act on what it gives."""
    chosen = load_effects(effects)
    ours, theirs = (
        outputs(with_effects(with_servos(model, HELM), chosen), values=values) for model in (SHIP, ship_box())
    )
    plain = outputs(SHIP)
    moved = np.abs(ours - plain).max(axis=0)
    assert (moved > 0.01).all()
    assert (np.abs(ours - theirs).max(axis=0) < 0.004 * moved).all()


@pytest.mark.parametrize("hold", ["foh", "zoh"])
def test_an_fmu_runs_as_the_equations_do(hold: Literal["foh", "zoh"]) -> None:
    fmu = load_fmu(ship_fmu(), inputs=["delta", "n"], kind="ship", hold=hold, step=0.1)
    (lag,) = load_effects(["rudder_lag"])
    names = [channel.name for channel in SHIP.outputs]
    shown = [[channel.name for channel in fmu.outputs].index(name) for name in names]
    plain, late = outputs(SHIP, hold), {"rudder_lag_tau": 1.0}
    held = np.abs(outputs(fmu, hold)[:, shown] - plain).max(axis=0)  # what the FMU's own steps change
    ours, theirs = (outputs(with_effects(with_servos(m, HELM), [lag]), hold, late) for m in (SHIP, fmu))
    moved = np.abs(ours - plain).max(axis=0)
    assert (np.abs(ours - theirs[:, shown]).max(axis=0) < 0.01 * moved + held).all()


def test_parameters_are_those_of_equations() -> None:
    ours, theirs = with_servos(SHIP, HELM), with_servos(ship_box(), HELM)
    assert isinstance(ours, WithServos)
    assert isinstance(theirs, ServoBlackBox)
    assert ours.parameters[-2:] == theirs.parameters[-2:]
    assert [servo.input for servo in theirs.servos] == ["delta"]
    assert theirs.delays == ours.delays
    assert theirs.states == SHIP.states


def test_a_servo_is_exact_where_its_order_has_corners_between_samples() -> None:
    t, order = np.arange(0.0, 10.0, 1.0), np.where(np.arange(10) >= 3, 0.4, 0.0)
    fine = np.arange(0.0, 9.0005, 0.001)
    late = np.interp(fine - 0.35, t, order)
    expected = followed(fine, late, 0.5, 4.0)[::1000]
    assert followed(t, order, 0.5, 4.0, delay=0.35) == pytest.approx(expected, abs=1e-9)
    held = followed(t, order, 0.0, 0.0, delay=0.35, hold="zoh")
    assert held == pytest.approx([0.0, 0.0, 0.0, 0.65 * 0.4, *[0.4] * 6])
    assert followed(t, order, 0.0, 5.0, hold="zoh")[2:7] == pytest.approx([0.0, 0.1, 0.3, 0.4, 0.4])
    assert followed(t, order, 0.0, 0.0, hold="zoh").tolist() == order.tolist()


def test_servos_act_once_however_deep_they_are() -> None:
    order = {"delta": Order(rate_limit=0.1)}
    trial = Trial("run", np.arange(4.0), {"delta": np.array([0.0, 0.3, 0.3, 0.3])}, {})
    base = box(outputs=[Channel("angle", "rad")])
    lag = load_effects(["rudder_lag", "rudder_offset"])
    inner = with_effects(ServoBlackBox(base, order), lag[:1])
    for model in (inner, with_effects(inner, lag[1:]), IsolatedBlackBox(ServoBlackBox(base, order))):
        assert isinstance(model, BlackBox)
        found = model.run(trial, model.nominal(), None)[:, 0]
        assert found == pytest.approx([0.0, 0.1, 0.2, 0.3])
        reached = model.acting_inputs(trial, model.nominal())
        assert reached.inputs["delta"] == pytest.approx([0.0, 0.1, 0.2, 0.3])
        acting = model.run(reached, model.nominal(), None)[:, 0]
        assert acting == pytest.approx([0.0, 0.1, 0.2, 0.3])
    outer = with_effects(inner, lag[1:])
    assert isinstance(outer, BlackBox)
    late = outer.run(trial, {**outer.nominal(), "rudder_lag_tau": 1.0, "rudder_offset_angle": 0.5}, None)[:, 0]
    alone = followed(trial.t, trial.inputs["delta"], 1.0, 10.0)
    assert late == pytest.approx(0.5 + alone)


def test_a_run_of_orders_is_not_kept_for_one_of_what_acts() -> None:
    alone = IsolatedBlackBox(ServoBlackBox(box(), {"delta": Order(lag=1.0)}))
    trial = Trial("run", np.arange(3.0), {"delta": np.array([0.0, 0.3, 0.3])}, {})
    acting = ActingTrial("run", trial.t, trial.inputs, {})
    assert alone.run(trial, alone.nominal(), None)[1, 0] < 0.2
    assert alone.run(acting, alone.nominal(), None)[1, 0] == 0.3
    alone.stop()


def test_it_can_be_sent_and_observed() -> None:
    model = ServoBlackBox(ship_box(), HELM)
    there = pickle.loads(by_value(model))
    first = dict(FIRST)
    assert there.run(RUN, there.nominal(), first).tolist() == model.run(RUN, model.nominal(), first).tolist()
    around = observed(model, [Observation("sog")])
    inside = ServoBlackBox(observed(ship_box(), [Observation("sog")]), HELM)
    assert outputs(around) == pytest.approx(outputs(inside))


@pytest.mark.parametrize(("name", "said"), [("rudder", "no input 'rudder'"), ("delta", "a servo already")])
def test_what_cannot_be_is_refused(name: str, said: str) -> None:
    slowed = with_effects(box(), load_effects(["rudder_lag"]))
    for model in (ServoBlackBox(box(), HELM), slowed):
        assert isinstance(model, BlackBox)
        with pytest.raises(BadInput, match=said):
            ServoBlackBox(model, {name: Order(lag=1.0)})


def test_wrappers_of_equations_refuse_a_black_box() -> None:
    with pytest.raises(BadInput, match="no equations to wrap"):
        WithServos(box(), HELM)
    with pytest.raises(BadInput, match="nobody can steer it"):
        run_manoeuvre(ServoBlackBox(ship_box(), HELM), TurningCircle(0.3, 1.0), dt=0.5)


def test_without_servos_the_trial_is_untouched() -> None:
    assert behind_servos(box(parameters=[Parameter("a", 1.0)]), RUN, {"a": 1.0}) is RUN
