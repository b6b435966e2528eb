"""Which effects are fitted alone and beside a leading set, whatever a linearization says of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from seatruth.diagnosis import choice
from seatruth.diagnosis.hypotheses import Search
from seatruth.diagnosis.settings import Settings
from seatruth.effects import available


def test_the_first_of_each_family_is_added_to_a_set_whatever_stands_before_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ranked = ["rudder_dead_band", "rudder_lag", "thruster_lag", "rudder_offset", "wind", "current", "gyro_bias"]
    monkeypatch.setattr(choice, "screen", lambda *_: ranked)
    problem = SimpleNamespace(effects=available(), settings=Settings(additions=3))
    values = {(name,): -100.0 * k for k, name in enumerate(ranked)}
    faked = SimpleNamespace(problem=problem, expected=values.__getitem__)
    chosen = choice.additions(faked, SimpleNamespace(effects=()))
    assert chosen == ["rudder_dead_band", "rudder_lag", "thruster_lag", "wind", "current", "gyro_bias"]


def test_what_explains_most_without_forces_is_fitted_with_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a boat in wind it stood behind the drift of waves beside forces, where it has no slope at its null."""
    ranked = ["wave_drift", "rudder_lag", "rudder_offset", "gyro_bias"]
    monkeypatch.setattr(choice, "screen", lambda *_: ranked)
    without = {(): 0.0, ("wave_drift",): 2300.0, ("wind",): 3700.0, ("current",): 300.0, ("rudder_lag",): 50.0}
    fits: Any = {(k, False): SimpleNamespace(effects=k, evidence=v, discrepancy=False) for k, v in without.items()}
    fits[("gyro_bias",), True] = SimpleNamespace(effects=("gyro_bias",), evidence=9000.0, discrepancy=True)
    problem: Any = SimpleNamespace(effects=available(), settings=Settings(singles=1), trials=[])
    known: Any = None
    found = Search(problem, known, fits=fits)
    assert found.explaining(2) == ["wind", "wave_drift"]
    assert choice.singles(found, fits[(), False]) == ["wave_drift", "wind"]
    del fits[(), False]
    assert found.explaining(2) == []


def test_where_nothing_explains_anything_a_set_must_promise_what_its_prior_costs() -> None:
    """A pair of 2000: some nine nats; where a single effect is more probable than none, every set may matter."""
    pair = ("rudder_backlash", "rudder_dead_band")

    def matters(single: float, promised: float) -> bool:
        values = {(): 0.0, ("rudder_backlash",): single}
        fits: Any = {(k, True): SimpleNamespace(effects=k, evidence=v, discrepancy=True) for k, v in values.items()}
        problem: Any = SimpleNamespace(effects=available(), settings=Settings())
        known: Any = None
        return choice.may_matter(Search(problem, known, fits=fits), pair, promised)

    assert not matters(3.8, 5.0)
    assert matters(3.8, 12.0)
    assert matters(30.0, 5.0)


def test_what_broke_its_promise_alone_is_not_believed_beside_a_set() -> None:
    """Linearized, an arm of the receiver had 5.3 nats alone and beside each set; fitted, it was 7.6 behind."""
    values = {(): 0.0, ("rudder_dead_band",): 4.6, ("position_lever_arm",): -7.6}
    fits: Any = {(k, True): SimpleNamespace(effects=k, evidence=v, discrepancy=True) for k, v in values.items()}
    problem: Any = SimpleNamespace(effects=available(), settings=Settings())
    known: Any = None
    found = Search(problem, known, fits=fits, screened={(("position_lever_arm",), True): 5.3})
    leader = fits[("rudder_dead_band",), True]
    assert choice.as_alone(found, leader, "position_lever_arm", 9.3) == pytest.approx(-3.0)
    # What the set adds to it counts, and what was not fitted alone has its promise.
    assert choice.as_alone(found, leader, "position_lever_arm", 30.0) == pytest.approx(17.1)
    assert choice.as_alone(found, leader, "current", 9.3) == 9.3
    assert choice.as_alone(found, leader, "position_lever_arm", -5.0) == -5.0
