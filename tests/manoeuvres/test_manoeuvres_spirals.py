"""Spirals whose loop is known: a yaw rate that jumps at known rudder angles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatruth.errors import BadInput
from seatruth.manoeuvres import spiral_figures
from seatruth.trials import Trial

DOWN = [15.0, 10.0, 6.0, 3.0, 0.0, -3.0, -6.0, -10.0, -15.0]


def staircase(angles: list[float], unstable: float, hold: float = 100.0, settle: float = 8.0) -> Trial:
    """A ship whose rate goes on to its side until the rudder is `unstable` deg over to the other."""
    t = np.arange(0.0, hold * len(angles), 0.5)
    step = np.minimum((t // hold).astype(int), len(angles) - 1)
    rate, side, rates = 0.0, 1.0, []
    for k in range(t.size):
        angle = angles[step[k]]
        if angle * side < -unstable - 1e-9:
            side = -side
        if unstable == 0.0:
            side = math.copysign(1.0, angle) if angle else 0.0
        aim = 0.002 * angle + (0.01 * side if unstable else 0.0)
        rate += 0.5 / settle * (aim - rate)
        rates.append(rate)
    psi = np.cumsum(rates) * 0.5
    delta = np.radians([angles[k] for k in step])
    return Trial("spiral", t, {"delta": delta}, {"psi": np.mod(psi, 2 * math.pi), "r": np.array(rates)})


def test_a_stable_ship_has_no_loop() -> None:
    found = spiral_figures(staircase(DOWN + DOWN[-2::-1], 0.0))
    assert not found.why
    assert found.loop_width == pytest.approx(0.0, abs=1e-4)
    assert found.loop_height == pytest.approx(0.0, abs=1e-6)


def test_the_loop_of_an_unstable_ship() -> None:
    found = spiral_figures(staircase(DOWN + DOWN[-2::-1], 3.0))
    assert found.loop_height == pytest.approx(0.02, rel=1e-3)
    # The rate jumps between 3 and 6 deg on both sides.
    assert 6.0 <= math.degrees(found.loop_width) <= 12.0
    assert math.degrees(found.step) == pytest.approx(3.0, abs=0.1)


def test_one_way_or_rates_that_are_not_steady_give_no_loop() -> None:
    one = spiral_figures(staircase(DOWN, 3.0))
    assert "one way" in one.why["loop_width"]
    assert math.isnan(one.loop_width)
    slow = spiral_figures(staircase(DOWN + DOWN[-2::-1], 3.0, settle=80.0))
    assert "not steady" in slow.why["loop_height"]


def test_without_the_rate_the_heading_gives_it() -> None:
    whole = staircase(DOWN + DOWN[-2::-1], 3.0)
    bare = Trial("bare", whole.t, whole.inputs, {"psi": whole.outputs["psi"]})
    assert spiral_figures(bare).loop_height == pytest.approx(spiral_figures(whole).loop_height, rel=0.02)


def test_what_is_no_spiral_says_why() -> None:
    whole = staircase(DOWN, 3.0)
    with pytest.raises(BadInput, match="three angles"):
        spiral_figures(Trial("held", whole.t, {"delta": np.full(len(whole), 0.1)}, whole.outputs))
    with pytest.raises(BadInput, match="'delta'"):
        spiral_figures(Trial("none", whole.t, {"n": whole.t}, whole.outputs))
