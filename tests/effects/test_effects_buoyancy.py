"""Weight and buoyancy that change with the depth and with time."""

from __future__ import annotations

import math

import pytest

from seatruth.effects import available, dimensions_of, with_effects
from seatruth.effects.kinematics import G
from seatruth.manoeuvres import Stepper
from seatruth.models import load_model

REST = {channel.name: 0.0 for channel in load_model("torpedo").inputs}


def accelerations(effect: str, t: float = 0.0, *, state: dict[str, float], **values: float) -> dict[str, float]:
    """What an effect adds to the rate of each state of the torpedo."""
    model = with_effects(load_model("torpedo"), [available()[effect]])
    rate = [Stepper(model, {f"{effect}_{name}": value for name, value in one.items()}) for one in (values, {})]
    with_it, without = (one.rate(t, one.first(state), REST) for one in rate)
    return {channel.name: a - b for channel, a, b in zip(model.states, with_it, without)}


def test_a_gradient_weighs_as_a_net_weight_of_its_depth() -> None:
    state = {"u": 1.5, "theta": 0.2, "phi": 0.1, "z": 40.0}
    found = accelerations("buoyancy_gradient", state=state, share=1e-4)
    assert found == pytest.approx(accelerations("net_weight", state=state, share=4e-3), abs=1e-12)
    assert found["w"] > 0.0
    surface = accelerations("buoyancy_gradient", state={**state, "z": 0.0}, share=1e-4)
    assert max(map(abs, surface.values())) == pytest.approx(0.0, abs=1e-12)


def test_flooding_weighs_more_and_more_and_sinks_where_the_water_gathers() -> None:
    state = {"u": 1.5, "theta": 0.2, "phi": 0.1}
    level = accelerations("flooding", 100.0, state=state, share=1e-5)
    assert level == pytest.approx(accelerations("net_weight", state=state, share=1e-3), abs=1e-12)
    assert accelerations("flooding", 200.0, state=state, share=1e-5)["w"] == pytest.approx(2.0 * level["w"])
    aft = accelerations("flooding", 100.0, state=state, share=1e-5, lever=-0.3)
    assert aft["q"] > 0.0 > accelerations("flooding", 100.0, state=state, share=1e-5, lever=0.3)["q"]


def test_its_moment_is_that_of_the_centre_of_gravity_moved_by_as_much() -> None:
    size = dimensions_of(load_model("torpedo"))
    assert size is not None
    state = {"u": 1.5, "theta": 0.3, "phi": 0.2}
    share, lever = 1e-3, 0.3
    trim = accelerations("trim", state=state, forward=share * lever * size.length, below=0.0)
    level = accelerations("flooding", 100.0, state=state, share=share / 100.0)
    found = accelerations("flooding", 100.0, state=state, share=share / 100.0, lever=lever)
    for name in ("q", "r"):
        assert found[name] - level[name] == pytest.approx(trim[name], rel=1e-9)


def test_a_leak_lets_no_water_out() -> None:
    share = available()["flooding"].parameters[0]
    assert (share.min, available()["flooding"].null["share"]) == (0.0, 0.0)
    # Half a litre an hour into a vehicle of 15 kg is a newton and a third after 1000 s.
    assert share.value * 15.0 * G * 1000.0 == pytest.approx(1.4, rel=0.1)
    assert math.isclose(share.value * 15.0 * 3600.0, 0.5, rel_tol=0.1)
