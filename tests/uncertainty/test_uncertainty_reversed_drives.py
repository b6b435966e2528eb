"""Which of two thrusters is turned round, or exchanged, is told by turn and speed together."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatruth import Study
from seatruth.models import Thruster
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.simulate import simulator
from seatruth.trials.channel import Channel
from seatruth.trials.finding import Finding
from seatruth.trials.trial import Trial, Trials
from seatruth.uncertainty.reversed_inputs import reversed_inputs


class Cat(Model):
    """A catamaran with a thruster in each hull, whose speed is seen in its track alone."""

    name = "cat"
    title = "A catamaran under two thrusters"
    states = (
        *(Channel("x", "m"), Channel("y", "m"), Channel("psi", "rad", angle=True)),
        *(Channel("u", "m/s"), Channel("r", "rad/s")),
    )
    inputs = (Channel("port", "us"), Channel("starboard", "us"))
    outputs = (*states[:3], states[4])
    parameters = (Parameter("k_T", 1.0, "m/s2", 0.0, 9.0, vary=True, source="test"),)
    actuators = (
        Thruster("port", "port", at=(-1.0, -0.5, 0.0), towards=(1.0, 0.0, 0.0), full=1900.0),
        Thruster("starboard", "starboard", at=(-1.0, 0.5, 0.0), towards=(1.0, 0.0, 0.0), full=1900.0),
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        port, starboard = (i.port - 1500.0) / 400.0, (i.starboard - 1500.0) / 400.0
        return p.k_T * port * abs(port), p.k_T * starboard * abs(starboard)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        port, starboard = Cat.thrusts(s, i, p, e)
        rates = port + starboard - 0.3 * s.u * abs(s.u), port - starboard - s.r
        return s.u * math.cos(s.psi), s.u * math.sin(s.psi), s.r, *rates

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.x, y.y, y.psi, 0.0, y.r


@functools.cache
def study() -> Study:
    """SYNTHETIC: from rest ahead, with turns to both sides, in 1 m/s2 of thrust."""
    t = np.arange(0.0, 120.0, 0.2)
    more = np.select([t < 20.0, t < 40.0, t < 60.0, t < 80.0], [0.0, 40.0, -40.0, 0.0], 15.0)
    orders = {"port": 1680.0 + more, "starboard": 1680.0 - more}
    bare = Trial("run", t, orders, {}, synthetic=True)
    y = simulator(Cat(), [bare], values={"k_T": 1.0}).outputs(np.zeros((1, 0)), np.zeros((1, 5))).y[0]
    rng = np.random.default_rng(5)
    noise = {"x": 0.2, "y": 0.2, "psi": 0.01, "r": 0.003}
    outputs = {c.name: y[:, k] + noise[c.name] * rng.normal(size=len(t)) for k, c in enumerate(Cat.outputs)}
    return Study("cat", Cat(), Trials([replace(bare, outputs=outputs)]), parameters=Cat.parameters)


def found(port: str, starboard: str, thrust: float = 1.0, without: tuple[str, ...] = ()) -> list[Finding]:
    """Findings where each record stands for another: "-port" is that of the port thruster turned round."""
    (trial,) = study().trials

    def recorded(name: str) -> Any:
        return 3000.0 - trial.inputs[name[1:]] if name.startswith("-") else trial.inputs[name]

    outputs = {name: np.full(len(trial), np.nan) if name in without else y for name, y in trial.outputs.items()}
    wrong = replace(trial, inputs={"port": recorded(port), "starboard": recorded(starboard)}, outputs=outputs)
    parameters = (Cat.parameters[0].replace(value=thrust),)
    return reversed_inputs(study().replace(trials=Trials([wrong]), parameters=parameters), threads=1)


@pytest.mark.parametrize("thrust", [0.5, 1.0, 2.0])
def test_what_is_wrong_is_told_and_only_that(thrust: float) -> None:
    assert found("port", "starboard", thrust) == []
    (exchanged,) = found("starboard", "port", thrust)
    assert "'port' and 'starboard' exchanged" in exchanged.message
    assert exchanged.do.startswith("Exchange their columns")
    (turned,) = found("-port", "-starboard", thrust)
    assert "turns and drives the other way" in turned.message
    assert "xchange" not in turned.message + turned.do
    assert "Set sign = -1 and offset = 3000 for port and starboard" in turned.do
    (both,) = found("-starboard", "-port", thrust)
    assert "The model drives the other way" in both.message
    assert "turned round and exchanged" in both.message
    for one in ("port", "starboard"):
        orders = {"port": "port", "starboard": "starboard"} | {one: f"-{one}"}
        (alone,) = found(**orders, thrust=thrust)
        assert f"With the input '{one}' alone turned round" in alone.message
        assert (alone.code, alone.channel) == ("input-reversed", one)


def test_where_no_speed_is_recorded_both_explanations_of_a_turn_are_named() -> None:
    (either,) = found("-port", "-starboard", without=("x", "y"))
    assert "turned round, or with the inputs 'port' and 'starboard' exchanged" in either.message
    assert either.do.startswith("No record tells which")


def test_a_thruster_that_gives_nothing_is_not_one_that_is_turned_round() -> None:
    (trial,) = study().trials
    dead = replace(trial, inputs={**trial.inputs, "port": np.full(len(trial), 1500.0)})
    y = simulator(Cat(), [dead], values={"k_T": 1.0}).outputs(np.zeros((1, 0)), np.zeros((1, 5))).y[0]
    record = replace(trial, outputs={c.name: y[:, k] for k, c in enumerate(Cat.outputs)})
    assert reversed_inputs(study().replace(trials=Trials([record])), threads=1) == []
