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
