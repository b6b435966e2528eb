"""Drives that are alike, and where they rest, of models that name nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatruth.diagnosis.discrepancy.equations import rests
from seatruth.diagnosis.discrepancy.model import DiscrepancyModel, scales_of
from seatruth.diagnosis.discrepancy.terms import terms_of
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.models import load_model
from seatruth.models.base import Environment, Model, record
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


class Raft(Model):
    """Two propellers in pulses of their speed controllers, and a bow tunnel; nothing is named or declared."""

    name = "raft"
    states = outputs = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"))
    inputs = (Channel("pwm_left", "1"), Channel("pwm_right", "1"), Channel("pwm_bow", "1"))
    shares = (1.0, 1.0)

    @classmethod
    def rhs(cls, s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        left, right, bow = ((x - 1500.0) / 400.0 for x in i)
        left, right = cls.shares[0] * left * abs(left), cls.shares[1] * right * abs(right)
        return left + right - s.u, 0.3 * bow - s.v, 0.5 * (left - right) + bow - s.r


class Uneven(Raft):
    """One propeller has the larger diameter."""

    shares = (1.0, 1.1)


class Azimuths(Raft):
    """Its drives turn about the vertical."""

    inputs = (*Raft.inputs, Channel("left_angle", "rad"), Channel("right_angle", "rad"))

    @classmethod
    def rhs(cls, s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        surge, sway, yaw = Raft.rhs(s, i[:3], p)
        return surge, sway, yaw + i.left_angle + i.right_angle


def test_drives_without_a_name_are_alike_that_do_the_same_but_for_the_side() -> None:
    (kind,) = kinds_of_drives(Raft())
    assert list(kind) == ["pwm_left", "pwm_right"]
    assert kind["pwm_left"]["surge"] == kind["pwm_right"]["surge"] > 0.0
    assert kind["pwm_left"]["yaw"] == -kind["pwm_right"]["yaw"] > 0.0
    assert kinds_of_drives(Uneven()) == []
    assert kinds_of_drives(Azimuths()) == []
    assert kinds_of_drives(load_model("mmg")) == []


def test_terms_count_from_the_input_at_which_drives_rest() -> None:
    assert rests(Raft()) == dict.fromkeys(("pwm_left", "pwm_right", "pwm_bow"), 1500.0)
    assert rests(load_model("mmg")) == {}
    texts = {(term.label, term.text) for term in terms_of(Raft())}
    assert ("yaw", "((pwm_left - 1500) - (pwm_right - 1500))") in texts
    assert ("sway", "(pwm_bow - 1500)") in texts
    assert not any(label == "sway" and "left" in text for label, text in texts)
    pulses = {"pwm_left": np.array([1500.0, 1700.0]), "pwm_right": np.full(2, 1400.0), "pwm_bow": np.full(2, 1500.0)}
    scales = scales_of(Raft(), [Trial("run", np.arange(2.0), pulses, {})])
    assert scales["pwm_left"] == scales["pwm_right"] == pytest.approx(200.0 / np.sqrt(2.0))
    assert scales["pwm_bow"] == 1.0


def test_a_term_of_a_drive_at_rest_adds_nothing() -> None:
    model = DiscrepancyModel(Raft(), 3, 10.0, dict.fromkeys("uvr", 1.0) | dict.fromkeys(rests(Raft()), 100.0))
    (term,) = (one for one in model.terms if (one.label, one.text) == ("sway", "(pwm_bow - 1500)"))
    rest = {channel.name: 0.0 for channel in model.inputs} | rests(Raft())

    def sway(pwm: float, coefficient: float) -> float:
        p = record("Parameters", model.parameters)(**{**model.nominal(), term.name: coefficient})
        i = record("Inputs", model.inputs)(**{**rest, "pwm_bow": pwm})
        rates = model.make_rhs()(record("States", model.states)(0.0, 0.0, 0.0), i, p, Environment())
        return float(rates[1])

    assert sway(1500.0, 0.2) == 0.0
    assert sway(1550.0, 0.2) - sway(1550.0, 0.0) == pytest.approx(0.2 * 0.5)
