"""Weight and buoyancy that change with the depth and with time."""

from __future__ import annotations

import math
from typing import Any

import pytest

from seatruth.effects import available, dimensions_of, with_effects
from seatruth.effects.kinematics import G
from seatruth.manoeuvres import Stepper
from seatruth.models import Dimensions, Model, Parameter, load_model
from seatruth.trials.channel import Channel

REST = {channel.name: 0.0 for channel in load_model("torpedo").inputs}


class Hovering(Model):
    """A vehicle of 400 kg that stays level; nothing brakes it."""

    name, title, kind = "hovering", "a level vehicle", "auv"
    states = outputs = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("w", "m/s"), Channel("z", "m"))
    inputs = (Channel("c", "1"),)
    parameters = (Parameter("m", 400.0, "kg", 100.0, 900.0, vary=True),)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(1.6, 1.0, 0.9, p.m, 1025.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return e.X / p.m, e.Y / p.m, e.Z / p.m, s.w


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


@pytest.mark.parametrize("name", ["net_weight", "buoyancy_gradient", "flooding"])
def test_a_vehicle_that_only_heaves_can_be_too_heavy(name: str) -> None:
    """An ROV in surge, sway, heave and yaw has no pitch, and a wrong weight was in no list."""
    effect, model = available()[name], Hovering()
    assert effect.missing(model) == ""
    stepper = Stepper(with_effects(model, [effect]), {f"{name}_share": 1e-3})
    rate = dict(zip("uvwz", stepper.rate(10.0, (0.3, 0.1, 0.0, 5.0), {"c": 0.0})))
    depth_or_time = {"net_weight": 1.0, "buoyancy_gradient": 5.0, "flooding": 10.0}[name]
    assert rate["w"] == pytest.approx(1e-3 * G * depth_or_time)
    assert (rate["u"], rate["v"]) == (0.0, 0.0)


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
