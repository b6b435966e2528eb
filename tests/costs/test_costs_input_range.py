"""Inputs far beyond full power are told, and engines that run hard or are off are not."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from seatruth import Study, load_model
from seatruth.analysis import check_study
from seatruth.costs.input_range import input_range
from seatruth.models import Thruster
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial, Trials


class Jet(Model):
    """One drive in pulses that rests at 1500 us."""

    name = "jet"
    states = outputs = (Channel("u", "m/s"),)
    inputs = (Channel("pulse", "us"),)
    parameters = (Parameter("T", 1.0, "m/s2", 0.0, 9.0, vary=True, source="test"),)
    actuators = (Thruster("jet", "pulse", at=(0.0, 0.0, 0.0), towards=(1.0, 0.0, 0.0), full=1900.0),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (p.T * (i.pulse - 1500.0) / 400.0 - s.u,)


def study(pulse: Any) -> Study:
    t = np.arange(0.0, 60.0, 0.5)
    trial = Trial("run", t, {"pulse": np.broadcast_to(pulse, t.shape).astype(float)}, {"u": 0.0 * t}, synthetic=True)
    return Study("jet", Jet(), Trials([trial]), parameters=Jet.parameters)


@pytest.mark.parametrize("pulse", [1.7, 1.7e6, 0.5, 150.0])
def test_a_pulse_in_another_unit_is_beyond_full_power(pulse: float) -> None:
    (found,) = [one for one in check_study(study(pulse)) if one.code == "input-range"]
    assert (found.severity, found.channel) == ("warning", "pulse")
    assert f"{pulse:.4g} us, and full power of the thruster 'jet' is 1900 us; it rests at 1500 us" in found.message


def test_full_power_astern_and_an_output_that_is_off_are_none() -> None:
    off = np.where(np.arange(120) < 80, 0.0, 1700.0)
    assert not input_range(study(off))
    for pulse in (1500.0, 1950.0, 1050.0, 2000.0):
        assert not input_range(study(pulse))


def test_revolutions_a_minute_are_told_and_usual_ones_are_not() -> None:
    boat, t = load_model("twin_thruster"), np.arange(0.0, 60.0, 0.5)
    full = next(one.full for one in boat.actuators if isinstance(one, Thruster))
    for factor, count in ((1.1, 0), (60.0, 2)):
        inputs = {channel.name: np.full(len(t), factor * full) for channel in boat.inputs}
        trial = Trial("run", t, inputs, {"psi": 0.0 * t}, synthetic=True)
        assert len(input_range(Study("boat", boat, Trials([trial]), parameters=boat.parameters))) == count


class TwoJets(Jet):
    """Two drives under one order."""

    name = "two_jets"
    actuators = (Jet.actuators[0], dataclasses.replace(Jet.actuators[0], name="other"))


def test_an_input_of_two_thrusters_is_told_once() -> None:
    one = study(1.7)
    found = input_range(Study("jets", TwoJets(), one.trials, parameters=Jet.parameters))
    assert [finding.channel for finding in found] == ["pulse"]
