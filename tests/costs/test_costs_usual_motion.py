"""The motion at which a model's equations are asked: that of the trials, as far as these record it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatruth import Channel, Model, Parameter, Study
from seatruth.costs.usual_motion import usual_motion
from seatruth.trials import Trial, Trials


class Ship(Model):
    """A ship whose equations do not matter here."""

    name = "ship"
    states = outputs = (
        Channel("psi", "rad", angle=True),
        Channel("u", "m/s"),
        Channel("v", "m/s"),
        Channel("r", "rad/s"),
    )
    inputs = (Channel("delta", "rad"), Channel("n", "rev/s"))
    parameters = (Parameter("a", 1.0, "1", 0.0, 2.0, vary=True), Parameter("b", 3.0, "1"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return s.r, p.a * i.n, -p.b * s.v, i.delta


def asked(**outputs: Any) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    t = np.arange(0.0, 100.0)
    inputs = {"delta": 0.1 + 0.0 * t, "n": np.where(t < 20.0, 0.0, 8.0)}
    run = Trial("run", t, inputs, {name: value + 0.0 * t for name, value in outputs.items()})
    parameters = [Ship.parameters[0].replace(value=1.5), Ship.parameters[1]]
    study = Study("s", Ship(), Trials([run]), parameters=parameters)
    return usual_motion(study, study.model)


def test_it_has_the_speed_and_the_turn_that_the_trials_reach() -> None:
    values, state, inputs = asked(psi=0.0, u=-5.0, v=0.0, r=0.03)
    assert values == {"a": 1.5, "b": 3.0}
    assert state == pytest.approx({"psi": 0.0, "u": 5.0, "v": 0.5, "r": 0.03})
    assert inputs == pytest.approx({"delta": 0.1, "n": 8.0})


def test_a_still_record_is_asked_at_the_usual_speed_and_turn() -> None:
    _, state, _ = asked(psi=0.0, u=0.0, v=0.0, r=0.0)
    assert state == pytest.approx({"psi": 0.0, "u": 2.0, "v": 0.2, "r": 0.02})
