"""Fits of a rate limit begin where the orders of the trials would show it."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.effects import available
from seatruth.effects.targets import targets
from seatruth.models import load_model
from seatruth.trials.trial import Trial


def _trial(name: str, values: Array) -> Trial:
    return Trial(name, np.arange(float(len(values))), {name: values}, {}, synthetic=True)


def test_begins_a_little_slower_than_the_orders() -> None:
    """A rudder ordered to turn at 0.1 rad/s, with rests between."""
    effect, ship = available()["rudder_rate_limit"], load_model("mmg")
    order = np.interp(np.arange(40.0), [0.0, 10.0, 13.0, 25.0, 31.0], [0.0, 0.0, 0.3, 0.3, -0.3])
    own = effect.starting_points(ship)
    found = effect.starting_points(ship, [_trial("delta", order)])
    assert found[0]["slowness"] == pytest.approx(1.05 / 0.1)
    assert found[-len(own) :] == own
    assert effect.starting_points(ship, [_trial("delta", 0.0 * order)]) == own


def test_a_thruster_begins_at_the_time_from_rest_to_full_power() -> None:
    boat = load_model("twin_thruster")
    effect = next(
        form for form in available()["thruster_rate_limit"].variants(boat) if form.which and not form.missing(boat)
    )
    (target,) = targets(effect, boat)
    order = target.full * np.interp(np.arange(20.0), [0.0, 4.0], [0.0, 1.0])
    assert effect.starting_points(boat, [_trial(target.input, order)])[0]["slowness"] == pytest.approx(1.05 * 4.0)
