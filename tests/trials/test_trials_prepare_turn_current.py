"""A known current is found in a turn and taken out again, exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.manoeuvres import TurningCircle, run_manoeuvre, steady_current, turning_circle_figures
from seatruth.models.mmg import MMGShip
from seatruth.trials import Trial
from seatruth.trials.prepare import remove_current, turn_current

deg = math.radians


def circle(north: float, east: float, turn: float = 3.0, side: float = 1.0, heading: float = 0.0) -> Trial:
    """A perfect circle of radius 30 m at 1.5 m/s through the water, on water that moves."""
    t = np.arange(0.0, turn * 2 * math.pi * 20.0, 0.1)
    psi = heading + side * t / 20.0
    x = 30.0 * side * (np.sin(psi) - math.sin(heading)) + north * t
    y = -30.0 * side * (np.cos(psi) - math.cos(heading)) + east * t
    u, v = 1.5 + north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    outputs = {"x": x, "y": y, "psi": np.mod(psi, 2 * math.pi), "u": u, "v": v}
    return Trial("circle", t, {"delta": np.full_like(t, side * 0.5)}, outputs)


@settings(max_examples=30, deadline=None)
@given(
    north=st.floats(-1.0, 1.0), east=st.floats(-1.0, 1.0), side=st.sampled_from([1.0, -1.0]), heading=st.floats(-4, 4)
)
def test_a_known_current_is_removed(north: float, east: float, side: float, heading: float) -> None:
    run, still = (circle(n, e, side=side, heading=heading) for n, e in ((north, east), (0.0, 0.0)))
    found = turn_current(run)
    assert (found.north, found.east) == pytest.approx((north, east), abs=2e-3)
    assert max(found.sd_north, found.sd_east) < 2e-3
    assert found.speed == pytest.approx(math.hypot(north, east), abs=3e-3)
    exact = remove_current(run, north=north, east=east)
    for name in ("x", "y", "u", "v"):
        assert exact.outputs[name] == pytest.approx(still.outputs[name], abs=1e-9)
    estimated = remove_current(run)
    assert estimated.outputs["u"] == pytest.approx(still.outputs["u"], abs=5e-3)
    assert estimated.steps[-1].name == "remove_current"
    assert "m/s north" in estimated.steps[-1].effect


def test_a_simulated_turn_in_a_current_has_the_figures_of_still_water() -> None:
    options = {"first_state": {"u": 1.18}, "inputs": {"n": 10.4}, "dt": 0.2}
    plan = TurningCircle(deg(35), deg(900), approach=1.0)
    still = run_manoeuvre(MMGShip(), plan, **options)
    start = {"u": 1.18 + 0.15 * math.cos(1.0), "v": 0.15 * math.sin(1.0)}
    run = run_manoeuvre(
        MMGShip(),
        plan,
        **{**options, "first_state": start},
        environment=steady_current(0.15, 1.0),
    )
    wrong, right, true = (turning_circle_figures(one) for one in (run, remove_current(run), still))
    assert abs(wrong.tactical_diameter / true.tactical_diameter - 1) > 0.1
    for name in ("advance", "tactical_diameter", "steady_diameter"):
        assert getattr(right, name) == pytest.approx(getattr(true, name), rel=0.01), name


def test_too_short_a_turn_and_missing_channels_say_so() -> None:
    with pytest.raises(BadInput, match="more than 540"):
        turn_current(circle(0.1, 0.0, turn=1.2))
    whole = circle(0.1, 0.0)
    with pytest.raises(BadInput, match="'psi'"):
        turn_current(Trial("bare", whole.t, {}, {"x": whole.t, "y": whole.t}))
    with pytest.raises(BadInput, match="only one part"):
        remove_current(whole, north=0.1)
    with pytest.raises(BadInput, match="over ground"):
        remove_current(Trial("sog", whole.t, {}, {**whole.outputs, "sog": whole.t}), north=0.1, east=0.0)
    with pytest.raises(BadInput, match="no position"):
        remove_current(Trial("bare", whole.t, {}, {"r": whole.t}), north=0.1, east=0.0)
