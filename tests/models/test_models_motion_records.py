"""The motion that a record shows, whatever its channels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.model import humps_of, scales_of
from seatruth.diagnosis.usual_sizes import usual_rate
from seatruth.models import Observation, Order, load_model, observed, with_servos
from seatruth.models.base import Model
from seatruth.models.longitudinal_plane import LongitudinalPlane
from seatruth.models.motion_records import motion, unrecorded_range
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

T = np.linspace(0.0, 96.0, 1921)


def turning() -> dict[str, Array]:
    """A vehicle that speeds up in a turn, drifting, by exact formulas."""
    psi, u, v = 0.08 * T + 2.5, 2.0 + 0.02 * T, np.full(T.shape, -0.3)
    v_n, v_e = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
    step = T[1] - T[0]
    x, y = ((np.cumsum(one) - 0.5 * one) * step for one in (v_n, v_e))
    return {
        "psi": np.mod(psi, 2.0 * np.pi), "u": u, "v": v, "r": np.full(T.shape, 0.08), "x": x, "y": y,
        "v_n": v_n, "v_e": v_e, "sog": np.hypot(v_n, v_e), "cog": np.mod(np.arctan2(v_e, v_n), 2.0 * np.pi),
    }  # fmt: skip


@pytest.mark.parametrize("channels", [("x", "y"), ("v_n", "v_e"), ("sog", "cog")])
def test_speeds_and_rates_follow_from_what_is_recorded(channels: tuple[str, str]) -> None:
    truth = turning()
    own = [Observation(name) for name in channels if name not in ("x", "y")]
    model = observed(load_model("mmg"), own)
    run = Trial("run", T, {}, {name: truth[name] for name in (*channels, "psi")})
    for name in ("u", "v", "r"):
        found = motion(model, run, name)
        assert found is not None
        assert found[1][2:-2] == pytest.approx(np.interp(found[0], T, truth[name])[2:-2], abs=0.03), name
    assert usual_rate(model, [run], "u", 48, 1.0) == pytest.approx(0.02, rel=0.3)
    sizes = scales_of(model, [run])
    assert sizes["u"] == pytest.approx(np.sqrt(np.mean(truth["u"] ** 2)), rel=0.02)
    assert sizes["r"] == pytest.approx(0.08, rel=0.02)
    assert [hump.middle for hump in humps_of(model, [run], sizes)] == [0.75, 1.0, 1.25]


def test_a_recorded_speed_stands_as_it_is_and_gaps_are_left_out() -> None:
    truth = turning()
    u = truth["u"].copy()
    u[100:400] = np.nan
    found = motion(load_model("mmg"), Trial("run", T, {}, {"u": u, "x": 0.0 * T, "y": 0.0 * T}), "u")
    assert found is not None
    assert np.isfinite(found[1]).all()
    assert found[1] == pytest.approx(2.0 + 0.02 * found[0], abs=0.02)


def test_the_course_stands_for_a_heading_that_nobody_recorded() -> None:
    truth = turning()
    run = Trial("run", T, {}, {"x": truth["x"], "y": truth["y"]})
    model = load_model("mmg")
    ahead = motion(model, run, "u")
    assert ahead is not None
    assert ahead[1][2:-2] == pytest.approx(np.interp(ahead[0], T, truth["sog"])[2:-2], abs=0.03)
    assert motion(model, run, "v") is None
    assert motion(model, run, "r") is None
    assert scales_of(model, [run])["v"] == 1.0


def test_a_diving_vehicle_s_speed_follows_from_its_depth_and_pitch() -> None:
    theta = 0.5 * np.sign(np.sin(T / 15.0))
    z = np.cumsum(-0.6 * np.sin(theta)) * (T[1] - T[0])
    found = motion(LongitudinalPlane(), Trial("run", T, {}, {"theta": theta, "z": z}), "u")
    assert found is not None
    assert found[1] == pytest.approx(np.full(found[0].shape, 0.6), rel=0.1)


def test_a_state_that_points_the_other_way_does() -> None:
    class Turned(Model):
        name, title, kind = "turned", "x to starboard", "ship"
        states = outputs = (
            Channel("port", "m/s"),
            Channel("psi", "rad", angle=True),
            Channel("x", "m"),
            Channel("y", "m"),
        )
        inputs = ()
        parameters = ()
        standard: ClassVar[Mapping[str, tuple[str, int]]] = {"port": ("v", -1)}

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return (0.0, 0.0, 0.0, 0.0)

    truth = turning()
    found = motion(Turned(), Trial("run", T, {}, {name: truth[name] for name in ("psi", "x", "y")}), "port")
    assert found is not None
    assert found[1][2:-2] == pytest.approx(np.full(found[0].shape[0] - 4, 0.3), abs=0.02)


def test_what_no_record_shows_moves_as_far_as_others_tell() -> None:
    """A rate of turn by the heading, zero among it; a servo by its orders; a speed down by the depth; else nothing."""
    ship = with_servos(load_model("mmg"), {"delta": Order(lag=1.0)})
    t = np.linspace(0.0, 96.0, 961)
    orders = {"delta": np.where(t > 40.0, 0.3, -0.1), "n": np.full_like(t, 9.0)}
    run = Trial("turn", t, orders, {"psi": 0.05 * t})
    assert unrecorded_range(ship, [run], "r") == pytest.approx(0.05, rel=1e-3)
    assert unrecorded_range(ship, [run], "delta_acting") == pytest.approx(0.4)
    assert math.isnan(unrecorded_range(ship, [run], "v"))
    dive = Trial("dive", t, {}, {"z": 5.0 + np.abs(t - 48.0), "theta": 0.0 * t})
    assert unrecorded_range(load_model("diving_plane"), [dive], "w") == pytest.approx(2.0, rel=0.05)
