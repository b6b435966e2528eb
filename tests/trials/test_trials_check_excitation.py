"""Inputs that hardly move, or jump, judged by what the other trials show of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from known_motion import altered, codes, zigzag

from seatruth.trials import check_trials

GOOD = zigzag(amplitude=0.5, period=80)


def test_a_quiet_run_beside_others_that_steer_is_only_noted() -> None:
    quiet = replace(altered(GOOD, {"delta": lambda a: a * 0.01}), name="straight")
    (alone,) = (one for one in check_trials([quiet]) if one.code == "input-small")
    (beside,) = (one for one in check_trials([quiet, GOOD]) if one.code == "input-small")
    assert (alone.severity, beside.severity) == ("warning", "note")
    assert ("unit" in alone.do, "unit" in beside.do) == (True, False)


def test_a_jump_over_a_small_range_of_one_run_is_none_beside_the_others() -> None:
    """A rudder of 30 deg/s, measured every 0.2 s, crosses 6 of the 10 deg of a run with small angles."""
    small = replace(altered(GOOD, {"delta": lambda a: 0.08 * np.sign(a)}), name="small")
    wide = altered(GOOD, {"delta": lambda a: 0.6 * np.sin(np.linspace(0.0, 20.0, len(a)))})
    assert "input-jumps" in codes(check_trials([small]))
    assert "input-jumps" not in codes(check_trials([small, wide]))


def test_the_noise_of_a_rudder_at_rest_is_no_command() -> None:
    """Rounded to 0.1 deg, it crosses more than a third of its range in every other sample."""
    rng = np.random.default_rng(2)
    for sd in (0.1, 0.2):
        still = np.round(sd * rng.standard_normal(len(GOOD)), 1) * np.pi / 180
        found = codes(check_trials([altered(GOOD, {"delta": lambda a, still=still: still})]))
        assert "input-jumps" not in found
