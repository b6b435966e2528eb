"""Arms of sensors whose place a study states."""

from __future__ import annotations

import pytest

from seatruth.effects import load_effects
from seatruth.models import Observation, load_model, observed


@pytest.mark.parametrize(
    ("at", "forward", "starboard"),
    [
        (None, 0.3325, 0.133),  # a quarter of its length of 1.33 m
        ((-0.7, 0.0, -1.2), 0.21, 0.133),  # a wrong sign is 2.7 deviations of a prior 2.5 times as wide
        ((0.05, 0.0, -1.2), 0.0665, 0.0266),
        ((6.0, 0.0, 0.0), 0.3325, 0.133),
    ],
)
def test_an_arm_that_is_stated_is_known_to_a_part_of_itself(
    at: tuple[float, float, float] | None, forward: float, starboard: float
) -> None:
    (effect,) = load_effects(["position_lever_arm"])
    model = load_model("torpedo")
    placed = model if at is None else observed(model, [Observation("x", at=at), Observation("y", at=at)])
    priors = effect.priors(placed)
    assert priors["forward"].sd == pytest.approx(forward)
    assert priors["starboard"].sd == pytest.approx(starboard)
    assert priors["forward"].mean == 0.0


def test_the_place_of_one_sensor_tells_nothing_of_another() -> None:
    position, log, depth = load_effects(["position_lever_arm", "log_lever_arm", "depth_lever_arm"])
    model = observed(
        load_model("torpedo"), [Observation("u", at=(0.2, 0.0, 0.1)), Observation("z", at=(0.0, 0.0, 0.3))]
    )
    bare = load_model("torpedo")
    assert position.priors(model) == position.priors(bare)
    assert log.priors(model)["forward"].sd == pytest.approx(0.0665)
    assert depth.priors(model)["forward"].sd == pytest.approx(0.0665), "none ahead: as well as it is measured"


@pytest.mark.parametrize(("name", "forward"), [("bluerov2", 0.25 * 0.457), ("glider", 0.5), ("mmg", 0.2 * 7.0)])
def test_no_typical_arm_is_longer_than_a_quarter_of_the_vehicle(name: str, forward: float) -> None:
    """Half a metre was typical of a frame of 0.46 m, on which an antenna 3 cm off so was next to nothing."""
    (effect,) = load_effects(["position_lever_arm"])
    assert effect.priors(load_model(name))["forward"].sd == pytest.approx(forward, rel=0.02)
