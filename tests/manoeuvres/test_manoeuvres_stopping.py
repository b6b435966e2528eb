"""Stops whose figures are known: a ship that slows down evenly on a line or a bend."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from seatruth.errors import BadInput
from seatruth.manoeuvres import CrashStop, run_manoeuvre, stopping_figures
from seatruth.models.mmg import MMGShip
from seatruth.trials import Trial


def braked(speed: float = 2.0, deceleration: float = 0.05, heading: float = 0.7, until: float = 80.0) -> Trial:
    """A ship on a straight line that loses speed evenly from t = 10 s on; `speed` is negative astern."""
    t = np.arange(0.0, until, 0.1)
    late = np.maximum(t - 10.0, 0.0)
    sense = math.copysign(1.0, speed)
    u = speed - sense * deceleration * late
    way = speed * t - sense * 0.5 * deceleration * late**2
    outputs = {"x": way * math.cos(heading), "y": way * math.sin(heading), "psi": np.full_like(t, heading), "u": u}
    return Trial("stop", t, {"n": np.where(t <= 10.0, sense * 10.0, -sense * 5.0)}, outputs)


@settings(max_examples=25, deadline=None)
@given(speed=st.floats(0.5, 3.0), heading=st.floats(-7.0, 7.0), astern=st.booleans())
def test_figures_of_an_even_stop(speed: float, heading: float, astern: bool) -> None:
    found = stopping_figures(braked(-speed if astern else speed, heading=heading))
    assert not found.why
    assert found.execute == pytest.approx(10.0, abs=0.11)
    assert found.approach_speed == pytest.approx(-speed if astern else speed)
    exact = 0.5 * speed**2 / 0.05
    assert found.track_reach == pytest.approx(exact, abs=0.3)
    assert found.head_reach == pytest.approx(exact, abs=0.3)
    assert found.lateral_deviation == pytest.approx(0.0, abs=1e-6)
    assert found.stopping_time == pytest.approx(speed / 0.05, abs=0.2)


def test_a_record_that_ends_before_says_so_and_gives_no_number() -> None:
    found = stopping_figures(braked(until=30.0))
    assert math.isnan(found.track_reach)
    assert "50 %" in found.why["track_reach"]


def test_without_u_the_positions_tell_when_it_stops() -> None:
    whole = braked()
    bare = Trial("bare", whole.t, whole.inputs, {name: whole.outputs[name] for name in ("x", "y", "psi")})
    assert stopping_figures(bare).track_reach == pytest.approx(stopping_figures(whole).track_reach, rel=1e-3)


def test_a_crash_stop_ends_when_the_speed_changes_its_sign_ahead_and_astern() -> None:
    ship = MMGShip()
    for speed, order in ((1.2, -8.0), (-0.8, 8.0)):
        plan = CrashStop(order, approach=2.0)
        run = run_manoeuvre(ship, plan, dt=0.2, first_state={"u": speed}, inputs={"n": -order}, limit=600.0)
        assert run.duration < 600.0
        assert run.outputs["u"][-1] * speed <= 0 < run.outputs["u"][-2] * speed
        assert stopping_figures(run).head_reach > 0


def test_what_is_no_stop_says_why() -> None:
    whole = braked()
    constant = Trial("constant", whole.t, {"n": np.full(len(whole), 3.0)}, whole.outputs)
    with pytest.raises(BadInput, match="not changed"):
        stopping_figures(constant)
    with pytest.raises(BadInput, match="'n'"):
        stopping_figures(Trial("none", whole.t, {"delta": whole.t}, whole.outputs))
    with pytest.raises(BadInput, match="'psi'"):
        stopping_figures(Trial("none", whole.t, whole.inputs, {"x": whole.t, "y": whole.t}))
