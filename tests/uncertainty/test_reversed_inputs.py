"""An input that is turned round, and thrusters that are exchanged, are found before a fit, whatever they are called."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from astray_boat import Boat, study

from seatruth import BlackBox, Study, diagnose, identify
from seatruth.costs.options import RegressionOptions
from seatruth.models import Rudder, load_model
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.report.text.diagnosis import data_first
from seatruth.simulate import simulator
from seatruth.trials.channel import Channel
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial, Trials
from seatruth.uncertainty.reversed_inputs import reversed_inputs
from seatruth.uncertainty.short_runs import pieces_of

STARTS = {"K": 0.3, "T": 5.0}


def turned_round(trial: Trial, name: str) -> Trial:
    return replace(trial, inputs={**trial.inputs, name: -trial.inputs[name]})


def test_a_rudder_is_found_turned_round_from_the_heading_alone() -> None:
    right = study(values=STARTS)
    assert reversed_inputs(right, threads=1) == []
    wrong = right.replace(trials=Trials([turned_round(trial, "delta") for trial in right.trials]))
    (found,) = reversed_inputs(wrong, threads=1)
    assert (found.severity, found.code, found.channel) == ("warning", "input-reversed", "delta")
    assert "Set sign = -1 for delta" in found.do


class Ship(Boat):
    """The boat with a gyro: its runs start with the recorded yaw rate."""

    name = "ship"
    title = "A ship that answers her rudder in a minute"
    outputs = Boat.states

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.r, y.psi, y.x, y.y


def ship(sign: float) -> Study:
    """SYNTHETIC turns of a ship that answers her rudder in 60 s, whose yaw rate at the start is as recorded."""
    model = Ship()
    values = {"K": 0.05, "T": 60.0, "U": 8.0}
    rng, trials = np.random.default_rng(4), []
    for number, delta in enumerate((0.35, -0.2)):
        t = np.arange(0.0, 600.0, 1.0)
        bare = Trial(f"turn {number}", t, {"delta": np.where(t < 30.0, 0.0, delta)}, {}, synthetic=True)
        y = simulator(model, [bare], values=values).outputs(np.zeros((1, 0)), np.zeros((1, len(model.states)))).y[0]
        outputs = {c.name: y[:, k] + 1e-4 * rng.normal(size=len(t)) for k, c in enumerate(model.outputs)}
        trials.append(replace(bare, inputs={"delta": sign * bare.inputs["delta"]}, outputs=outputs))
    parameters = tuple(p.replace(value=values[p.name], max=100.0, vary=p.name == "K") for p in model.parameters)
    return Study("ship", model, Trials(trials), parameters=parameters)


def test_a_ship_that_goes_on_turning_for_a_minute_is_seen_in_longer_pieces() -> None:
    assert reversed_inputs(ship(1.0), threads=1) == []
    (found,) = reversed_inputs(ship(-1.0), threads=1)
    assert found.channel == "delta"


def test_a_diagnosis_of_a_model_that_turns_the_other_way_says_so_first() -> None:
    found = diagnose(ship(-1.0), ["heading_bias"], validate=False, suggest=False, threads=1)
    assert data_first(found).startswith(
        "The data first: channel 'delta': The model turns the other way than the record."
    )


class Barge(Model):
    """Surge alone, behind a propeller."""

    name = "barge"
    title = "A barge on a straight course"
    states = outputs = (Channel("u", "m/s"),)
    inputs = (Channel("n", "rev/s"),)
    parameters = (Parameter("T", 0.02, "m", 0.0, 1.0, vary=True, source="test"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.T * i.n * abs(i.n) - 0.02 * s.u * abs(s.u),)


def test_a_drive_that_pushes_the_wrong_way_is_found_and_one_that_is_weak_is_not() -> None:
    t = np.arange(0.0, 300.0, 1.0)
    bare = Trial("steps", t, {"n": np.where(t < 150.0, 2.0, 3.0)}, {}, synthetic=True)
    start = np.array([[2.0]])
    u = simulator(Barge(), [bare], values={"T": 0.02}).outputs(np.zeros((1, 0)), start).y[0, :, 0]
    trial = replace(bare, outputs={"u": u + 0.01 * np.random.default_rng(2).normal(size=len(t))})
    for thrust in (0.002, 0.02, 0.1):  # a tenth of it, as it is, five times as much
        parameters = (Barge.parameters[0].replace(value=thrust),)
        assert reversed_inputs(Study("barge", Barge(), Trials([trial]), parameters=parameters), threads=1) == []
    wrong = Study("barge", Barge(), Trials([turned_round(trial, "n")]), parameters=Barge.parameters)
    (found,) = reversed_inputs(wrong, threads=1)
    assert found.channel == "n"
    assert "drives the other way" in found.message


class Runaway(Barge):
    """A drag of the wrong sign."""

    name = "runaway"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.T * i.n * abs(i.n) + 1.6 * s.u,)


@pytest.mark.filterwarnings("error")
def test_a_run_that_diverges_says_nothing_of_the_inputs() -> None:
    """Its squares are beyond what a number holds: 1e200 m/s after some minutes."""
    t = np.arange(0.0, 300.0, 1.0)
    trial = Trial("run", t, {"n": 2.0 + 0.0 * t}, {"u": 2.0 + 0.1 * np.sin(0.1 * t)}, synthetic=True)
    study = Study("runaway", Runaway(), Trials([trial]), parameters=Barge.parameters)
    assert reversed_inputs(study, threads=1) == []


class Differential(Boat):
    """A boat whose two orders are no thrusters that anyone has declared."""

    name = "differential"
    title = "A boat with two orders"
    outputs = Boat.states
    inputs = (Channel("left", "1"), Channel("right", "1"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.K * (i.left - i.right) - s.r) / p.T, s.r, p.U * np.cos(s.psi), p.U * np.sin(s.psi)

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.r, y.psi, y.x, y.y


def test_a_model_that_turns_the_other_way_by_inputs_of_no_known_kind_is_said_to_do_so() -> None:
    (run,) = study().trials
    rate = np.gradient(run.outputs["psi"], run.t)
    orders = {"left": run.inputs["delta"], "right": np.zeros(len(run))}
    trial = replace(run, inputs=orders, outputs={**run.outputs, "r": rate})
    parameters = tuple(p.replace(value={"K": 0.5, "T": 3.0, "U": 1.5}[p.name]) for p in Boat.parameters)
    right = Study("differential", Differential(), Trials([trial]), parameters=parameters)
    assert reversed_inputs(right, threads=1) == []
    up = replace(trial, outputs={**trial.outputs, "r": -rate, "psi": -trial.outputs["psi"]})
    (found,) = reversed_inputs(right.replace(trials=Trials([up])), threads=1)
    assert (found.code, found.channel) == ("input-reversed", "r")
    assert "Check the sign of r" in found.do


def test_a_regression_is_not_simulated() -> None:
    wrong = study(values=STARTS, cost=RegressionOptions())
    assert reversed_inputs(wrong, threads=1) == []


def boat_runs(seed: int = 0) -> Trial:
    """SYNTHETIC: differential steps of the built-in boat, with noise."""
    boat = load_model("twin_thruster")
    t = np.arange(0.0, 90.0, 0.2)
    more = np.where((t // 15) % 2 == 0, 2.0, -2.0)
    bare = Trial("steps", t, {"n_port": 10.0 + more, "n_starboard": 10.0 - more}, {}, synthetic=True)
    y = simulator(boat, [bare], values=boat.nominal()).outputs(np.zeros((1, 0)), np.zeros((1, len(boat.states)))).y[0]
    rng = np.random.default_rng(seed)
    outputs = {c.name: y[:, k] + 0.01 * rng.normal(size=len(t)) for k, c in enumerate(boat.outputs)}
    return replace(bare, outputs=outputs)


def test_two_thrusters_are_found_exchanged() -> None:
    trial = boat_runs()
    parameters = tuple(
        p.replace(vary=p.name == "N_r", value=1.5 * p.value if p.name == "N_r" else p.value)
        for p in load_model("twin_thruster").parameters
    )
    right = Study("boat", load_model("twin_thruster"), Trials([trial]), parameters=parameters)
    assert reversed_inputs(right, threads=1) == []
    port, starboard = trial.inputs["n_port"], trial.inputs["n_starboard"]
    wrong = right.replace(trials=Trials([replace(trial, inputs={"n_port": starboard, "n_starboard": port})]))
    (found,) = reversed_inputs(wrong, threads=1)
    assert "'n_port' and 'n_starboard' exchanged" in found.message
    assert "Exchange their columns" in found.do


def test_the_nozzle_of_a_black_box_is_found_turned_round() -> None:
    def sail(trial: Trial, p: Any, first: Any) -> dict[str, Any]:
        r = [first["r"]]
        for k in range(1, len(trial)):
            step = trial.t[k] - trial.t[k - 1]
            r.append(r[-1] + step * (p["K"] * trial.inputs["nozzle"][k - 1] - r[-1]) / 3.0)
        return {"r": np.array(r)}

    rate = Channel("r", "rad/s")
    boat = study().parameters[0].replace(value=0.3)
    box = BlackBox(
        *("jet", sail),
        inputs=[Channel("nozzle", "rad")],
        outputs=[rate],
        states=[rate],
        parameters=[boat],
        actuators=[Rudder("nozzle", "nozzle")],
    )
    t = np.arange(0.0, 60.0, 0.25)
    nozzle = np.where((t // 12) % 2 == 0, 0.35, -0.35)
    bare = Trial("jet", t, {"nozzle": nozzle}, {})
    r = sail(bare, {"K": 0.5}, {"r": 0.0})["r"] + 0.005 * np.random.default_rng(1).normal(size=len(t))
    trial = replace(bare, outputs={"r": r})
    assert reversed_inputs(Study("jet", box, Trials([trial])), threads=1) == []
    (found,) = reversed_inputs(Study("jet", box, Trials([turned_round(trial, "nozzle")])), threads=1)
    assert found.channel == "nozzle"


def test_an_identification_that_strays_names_it() -> None:
    right = study(values=STARTS)
    parameters = tuple(p.replace(min=0.01) if p.name == "K" else p for p in right.parameters)
    wrong = right.replace(
        trials=Trials([turned_round(trial, "delta") for trial in right.trials]), parameters=parameters
    )
    codes = [finding.code for finding in identify(wrong, threads=1).findings]
    assert "input-reversed" in codes


@pytest.mark.parametrize("name", ["mmg", "torpedo", "bluerov2", "diving_plane", "twin_thruster_roll"])
def test_built_in_models_agree_with_their_own_runs(name: str) -> None:
    model = load_model(name)
    t = np.arange(0.0, 60.0, 0.2)
    inputs = {}
    for k, channel in enumerate(model.inputs):
        wave = np.sign(np.sin(2 * np.pi * t / (14.0 + 3 * k)))
        inputs[channel.name] = {"rad": 0.1 * wave, "1": 0.2 * wave, "V": np.full(len(t), 16.0)}.get(
            channel.unit, 10.0 + wave
        )
    bare = Trial("run", t, inputs, {}, synthetic=True)
    y = simulator(model, [bare], values=model.nominal()).outputs(np.zeros((1, 0)), np.zeros((1, len(model.states)))).y
    finite = replace(bare, outputs={c.name: y[0][:, k] for k, c in enumerate(model.outputs)})
    free = tuple(p.replace(vary=k == 0) for k, p in enumerate(model.parameters))
    assert reversed_inputs(Study("own", model, Trials([finite]), parameters=free), threads=1) == []


def test_a_gap_of_ages_makes_no_more_pieces() -> None:
    """A log with a gap of 1e12 s took gigabytes, one entry for every fifteen seconds of it."""
    t = np.concatenate([np.arange(0.0, 60.0, 0.5), 1.5e12 + np.arange(0.0, 60.0, 0.5)])
    trial = Trial(name="a", t=t, inputs={}, outputs={"r": np.zeros(t.size)})
    assert [len(piece) for piece in pieces_of(trial, 15.0)] == [30] * 8


class Pulses(Model):
    """A boat with two speed controllers in pulses of 1500 us at rest, under names that say nothing."""

    name = "pulses"
    title = "A boat with two speed controllers"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True))
    inputs = (Channel("left", "1"), Channel("right", "1"))
    parameters = (Parameter("K", 1.0, "1", 0.0, 9.0, vary=True, source="test"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        left, right = (i.left - 1500.0) / 400.0, (i.right - 1500.0) / 400.0
        return 2.0 * (left + right) - 0.8 * s.u * abs(s.u), p.K * (left - right) - 0.9 * s.r, s.r


def test_two_speed_controllers_are_found_exchanged_and_both_turned_round() -> None:
    t = np.arange(0.0, 120.0, 0.2)
    more = np.where((t // 15) % 2 == 0, 60.0, -60.0)
    orders = {"left": 1650.0 + more, "right": 1650.0 - more}
    bare = Trial("steps", t, orders, {}, synthetic=True)
    y = simulator(Pulses(), [bare], values={"K": 1.0}).outputs(np.zeros((1, 0)), np.array([[1.0, 0.0, 0.0]])).y[0]
    rng = np.random.default_rng(4)
    outputs = {c.name: y[:, k] + 0.005 * rng.normal(size=len(t)) for k, c in enumerate(Pulses.outputs)}
    right = Study("pulses", Pulses(), Trials([replace(bare, outputs=outputs)]), parameters=Pulses.parameters)
    assert reversed_inputs(right, threads=1) == []

    def found(inputs: dict[str, Any]) -> list[Finding]:
        return reversed_inputs(right.replace(trials=Trials([replace(right.trials[0], inputs=inputs)])), threads=1)

    (exchanged,) = found({"left": orders["right"], "right": orders["left"]})
    assert "'left' and 'right' exchanged" in exchanged.message
    turned = found({name: 3000.0 - values for name, values in orders.items()})
    assert "Set sign = -1 and offset = 3000 for left" in next(one.do for one in turned if "drives" in one.message)
