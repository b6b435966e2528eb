"""Angles against their rates: an offset that a rate shows all the time."""

from __future__ import annotations

import numpy as np
import pytest
from known_motion import altered, zigzag

from seatruth.trials import check_trials

GOOD = zigzag(amplitude=0.5, period=80)


@pytest.mark.parametrize("bias", [0.4, -0.25])
def test_the_bias_of_a_rate_is_told_with_its_size(bias: float) -> None:
    found = check_trials([altered(GOOD, {"r": lambda a: a + np.radians(bias)})])
    (said,) = (f for f in found if f.code == "psi-r-offset")
    assert said.channel == "r"
    size = float(said.message.split(" deg/s")[0].split()[-1])
    assert size == pytest.approx(abs(bias), abs=0.02)
    assert said.severity == "note"
    assert ("too much" in said.message) == (bias > 0.0)
