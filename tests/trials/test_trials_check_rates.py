"""Angles against their rates: an offset that a rate shows all the time."""

from __future__ import annotations

import numpy as np
import pytest
from known_motion import altered, zigzag

from seatruth.trials import check_trials

GOOD = zigzag(amplitude=0.5, period=80)


def test_a_rate_that_wanders_has_no_offset() -> None:
    """By 0.05 deg/s, which it forgets in a minute: of these eight runs of 15 min three would have an offset."""
    run, told = zigzag(amplitude=0.5, period=80, seconds=900.0), 0
    keep = np.exp(-np.diff(run.t) / 60.0)
    for seed in range(8):
        kicks = np.random.default_rng(seed).normal(size=len(run))
        wander = kicks.copy()
        for k, kept in enumerate(keep):
            wander[k + 1] = kept * wander[k] + np.sqrt(1.0 - kept**2) * kicks[k + 1]
        found = check_trials([altered(run, {"r": lambda a, w=wander: a + np.radians(0.05) * w})])
        told += any(f.code == "psi-r-offset" for f in found)
    assert told == 0


@pytest.mark.parametrize("bias", [0.4, -0.25])
def test_the_bias_of_a_rate_is_told_with_its_size(bias: float) -> None:
    found = check_trials([altered(GOOD, {"r": lambda a: a + np.radians(bias)})])
    (said,) = (f for f in found if f.code == "psi-r-offset")
    assert said.channel == "r"
    size = float(said.message.split(" deg/s")[0].split()[-1])
    assert size == pytest.approx(abs(bias), abs=0.02)
    assert said.severity == "note"
    assert ("too much" in said.message) == (bias > 0.0)


def test_a_bias_that_hides_the_turns_is_named_and_not_another_channel() -> None:
    """An `offset` in degrees where radians are meant: the two had "little in common", which says nothing of why."""
    found = check_trials([altered(GOOD, {"r": lambda a: a + 0.3})])
    (said,) = (f for f in found if f.code.startswith("psi-r-"))
    assert (said.code, said.severity) == ("psi-r-offset", "warning")
    assert "17 deg/s too much" in said.message
    assert "add -0.3 (rad/s) to the `offset`" in said.do
