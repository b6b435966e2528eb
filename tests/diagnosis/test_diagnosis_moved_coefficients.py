"""A coefficient that the refit moves beyond what the study states of it."""

from __future__ import annotations

import boat_case as boat
import numpy as np

from seatruth.diagnosis import diagnose
from seatruth.diagnosis.moved_coefficients import moved_coefficients
from seatruth.diagnosis.parts import Coefficient
from seatruth.study import Study


def study() -> Study:
    """Stated: U 2.0 +- 0.1 m/s, K 0.15 +- 0.02 1/s, T 6 +- 1 s."""
    runs = boat.trials(boat.Boat(), [{"delta": boat.zigzag(40, 0.1, 8.0)}] * 2, headings=(0.0, 2.0))
    return boat.study(boat.Boat(), runs)


def test_what_surely_lies_outside_its_stated_prior_is_told() -> None:
    far = Coefficient("T", "s", 6.0, 1.0, 11.0, 0.5)
    farther = Coefficient("U", "m/s", 2.0, 0.1, 1.2, 0.02)
    unsure = Coefficient("K", "1/s", 0.15, 0.02, 0.25, 0.03)
    found = moved_coefficients(study(), [far, farther, unsure])
    assert [(one.code, one.where) for one in found] == [
        ("coefficient-far", "parameter 'U'"),
        ("coefficient-far", "parameter 'T'"),
    ]
    assert found[0].message == (
        "The refitted U, 1.20 +- 0.02 m/s, is 8.0 prior standard deviations from what the study states of it,"
        " 2.0 +- 0.1 m/s."
    )


def test_a_prior_that_nobody_stated_is_no_belief() -> None:
    bare = study()
    bare = bare.replace(parameters=tuple(p.replace(prior=None) for p in bare.parameters))
    assert moved_coefficients(bare, [Coefficient("T", "s", 6.0, 1.0, 60.0, 0.5)]) == []


def test_a_diagnosis_of_a_boat_with_half_its_speed_says_so() -> None:
    """Its speed is a coefficient: no effect is needed, and none is named."""
    slow = boat.Boat()
    runs = boat.trials(slow, [{"delta": boat.zigzag(40, 0.1, 8.0)}] * 2, headings=(0.0, 2.0), effects={"U": 1.0})
    found = diagnose(boat.study(slow, runs), ["current"], validate=False, suggest=False)
    (far,) = [one for one in found.findings if one.code == "coefficient-far"]
    assert far.where == "parameter 'U'"
    assert np.isclose(next(one.value for one in found.coefficients if one.name == "U"), 1.0, atol=0.05)
