"""Froude's law: there and back is the same, and the figures of a turn grow with the scale."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.manoeuvres import TurningCircle, run_manoeuvre, turning_circle_figures
from seatruth.models.mmg import MMGShip
from seatruth.trials import Trial
from seatruth.trials.prepare import full_scale

RUN = run_manoeuvre(
    MMGShip(),
    TurningCircle(math.radians(35), math.radians(400)),
    dt=0.2,
    first_state={"u": 1.18},
    inputs={"n": 10.4},
)


@settings(max_examples=20, deadline=None)
@given(scale=st.floats(0.01, 200.0))
def test_there_and_back_is_the_same(scale: float) -> None:
    back = full_scale(full_scale(RUN, scale=scale), scale=1.0 / scale)
    assert back.t == pytest.approx(RUN.t)
    for name in (*RUN.inputs, *RUN.outputs):
        assert back.channel(name) == pytest.approx(RUN.channel(name), rel=1e-9, abs=1e-12), name


def test_lengths_grow_by_the_scale_times_by_its_root_and_angles_stay() -> None:
    ship = full_scale(RUN, scale=45.7)
    one, other = turning_circle_figures(RUN), turning_circle_figures(ship)
    for name in ("advance", "transfer", "tactical_diameter", "steady_diameter"):
        assert getattr(other, name) == pytest.approx(45.7 * getattr(one, name)), name
    assert other.time_90 == pytest.approx(math.sqrt(45.7) * one.time_90)
    assert other.rate == pytest.approx(one.rate / math.sqrt(45.7))
    assert other.drift_angle == pytest.approx(one.drift_angle)
    assert other.speed_ratio == pytest.approx(one.speed_ratio, rel=0.03)  # an approach of 10 s is a shorter one at sea
    # The velocities are those of the positions.
    assert np.gradient(ship.outputs["psi"], ship.t)[200] == pytest.approx(ship.outputs["r"][200], rel=0.02)
    assert ship.steps[-1].options["scale"] == 45.7
    assert ship.conditions["froude_scale"] == 45.7


def test_channels_that_nobody_knows_need_their_power() -> None:
    run = Trial("run", RUN.t, {"thrust": RUN.t + 1.0}, {"u": RUN.outputs["u"]})
    with pytest.raises(BadInput, match="powers"):
        full_scale(run, scale=10.0)
    assert full_scale(run, scale=10.0, powers={"thrust": 3.0}).inputs["thrust"][0] == pytest.approx(1000.0)
    with pytest.raises(BadInput, match="greater than 0"):
        full_scale(RUN, scale=-1.0)
