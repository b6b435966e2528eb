"""Channels that stand still in a motion so steady that they must."""

from __future__ import annotations

import numpy as np
import pytest
from known_motion import codes

from seatruth.trials import Trial, check_trials


@pytest.mark.parametrize(("noise", "stuck"), [(0.0, False), (0.002, True)])
def test_a_sway_that_stands_still_in_a_turn_without_noise_is_no_stuck_sensor(noise: float, stuck: bool) -> None:
    """A simulator's steady turn, rounded as it writes it: the rate of turn stands still as well."""
    t = np.arange(0.0, 120.0, 0.2)
    rng = np.random.default_rng(0)
    r = np.round(0.1 * (1.0 - np.exp(-t / 3.0)) + noise * rng.standard_normal(len(t)), 4)
    v = np.round(-0.05 + 0.4 * np.exp(-t / 3.0), 3)
    psi = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * 0.2)])
    run = Trial("turn", t, {"delta": np.full_like(t, 0.2)}, {"psi": psi, "r": r, "v": v}, synthetic=True)
    assert ("stuck" in codes(check_trials([run]))) == stuck


def test_a_speed_whose_noise_stops_is_stuck_though_no_other_channel_shows_it() -> None:
    """Of an AUV's log in the diving plane a speed that stood still for 30 s was found by nothing."""
    t, rng = np.arange(0.0, 120.0, 0.3), np.random.default_rng(1)
    u, theta = (value + 0.01 * rng.standard_normal(len(t)) for value in (1.5, 0.1))
    stuck, rest = u.copy(), u - 1.5
    stuck[100:200] = u[100]
    rest[100:200] = 0.0  # a log that says that the vehicle rests
    for speed, found in ((u, False), (stuck, True), (rest, False), (np.round(stuck, 1), False)):
        run = Trial("dive", t, {"n": np.ones_like(t)}, {"u": speed, "theta": theta})
        assert ("stuck" in codes(check_trials([run]))) == found
    still = Trial("dive", t, {"n": np.ones_like(t)}, {"u": stuck, "theta": np.where(stuck == u[100], 0.1, theta)})
    assert "stuck" not in codes(check_trials([still])), "where all stand still, the vehicle may"
