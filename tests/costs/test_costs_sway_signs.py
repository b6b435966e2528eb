"""A sway velocity with its sign turned round, and places of sensors that look like one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import seatruth.sample
from seatruth.analysis import check_study
from seatruth.costs.sway_signs import turned_sway
from seatruth.models import Observation, observed
from seatruth.study import Study
from seatruth.trials import Trial

SLIDES = 0.4
"""m astern of which the vehicle's centre line points along its way: v = -SLIDES r."""


def turn(name: str, heading: float, rate: float, *, sign: float = 1.0, arm: float = 0.0) -> Trial:
    """A zigzag at 1.5 m/s in a current: drift angles of 3 deg, positions with 0.1 m of noise, of an antenna ahead."""
    t = np.arange(0.0, 120.0, 0.5)
    psi = heading + 10.0 * rate * (1.0 - np.cos(t / 10.0)) + 0.3 * rate * t
    r = rate * np.sin(t / 10.0) + 0.3 * rate
    u, v = np.full_like(t, 1.5), -SLIDES * r
    velocity = (u + 1j * v) * np.exp(1j * psi) + 0.1 - 0.05j
    way = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(t))])
    rng = np.random.default_rng(int(100 * heading))
    way = way + arm * np.exp(1j * psi) + 0.1 * (rng.normal(size=len(t)) + 1j * rng.normal(size=len(t)))
    outputs = {"x": way.real, "y": way.imag, "psi": psi, "u": u, "v": sign * v, "r": r}
    return Trial(name, t, {"delta": 0.1 * r, "n": np.full_like(t, 10.0)}, outputs, synthetic=True)


def study(*, sign: float = 1.0, arm: float = 0.0, stated: float = 0.0) -> Study:
    sample = seatruth.sample.load("study.toml")
    trials = [turn("a", 0.3, 0.15, sign=sign, arm=arm), turn("b", 2.0, -0.2, sign=sign, arm=arm)]
    at = (stated, 0.0, 0.0)
    model = observed(sample.model, [Observation(name, at=at) for name in ("x", "y")]) if stated else sample.model
    return replace(sample, model=model, trials=trials, noise={})


def test_a_sway_with_its_sign_turned_round_is_told() -> None:
    (found,) = turned_sway(study(sign=-1.0))
    assert (found.severity, found.code, found.channel) == ("warning", "sway-sign", "v")
    assert "set sign = -1 for v" in found.do
    assert "m behind where the study has it" in found.do
    assert "sway-sign" in [one.code for one in check_study(study(sign=-1.0))]


@pytest.mark.parametrize(("arm", "stated"), [(0.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (-1.0, 0.0)])
def test_a_right_one_is_not_wherever_the_antenna_is(arm: float, stated: float) -> None:
    assert turned_sway(study(arm=arm, stated=stated)) == []


def test_an_antenna_ahead_whose_place_is_not_stated_is_what_it_may_be() -> None:
    (found,) = turned_sway(study(arm=1.0))
    assert "0.99 m ahead of where the study has it would look the same" in found.do


def test_a_stated_place_is_taken_into_account() -> None:
    (found,) = turned_sway(study(sign=-1.0, arm=-1.0, stated=-1.0))
    assert found.code == "sway-sign"


def test_without_sway_or_positions_nothing_is_said() -> None:
    whole = study(sign=-1.0)
    for missing in ("v", "x"):
        trials = [replace(one, outputs={k: v for k, v in one.outputs.items() if k != missing}) for one in whole.trials]
        assert turned_sway(replace(whole, trials=trials)) == []
