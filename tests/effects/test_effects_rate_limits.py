"""Fits of a rate limit begin where the orders of the trials would show it."""

from __future__ import annotations

import numpy as np
import pytest

from seatruth.arrays import Array
from seatruth.effects import available
from seatruth.effects.rate_limits import RateLimit
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


def test_how_late_it_makes_what_is_recorded_is_told_in_sampling_steps() -> None:
    effect, ship = available()["rudder_rate_limit"], load_model("mmg")
    assert isinstance(effect, RateLimit)
    step = _trial("delta", np.array([0.0, 0.0, 0.3, 0.3, 0.3, 0.3]))
    # By 0.1 rad/s it has done 0.1 of 0.3 rad when the order has done all.
    assert effect.steps_late(ship, [step], 10.0) == pytest.approx(0.2 / 0.3)
    ramp = _trial("delta", np.interp(np.arange(40.0), [0.0, 10.0, 13.0], [0.0, 0.0, 0.3]))
    # Slower by a hundredth it is 1, 2 and 3 hundredths of a step behind.
    assert effect.steps_late(ship, [ramp], 10.0 / 0.99) == pytest.approx(0.02)
    assert effect.steps_late(ship, [ramp], 9.0) == pytest.approx(0.0)
    assert effect.steps_late(ship, [_trial("delta", np.zeros(5))], 10.0) == np.inf
