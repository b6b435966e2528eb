"""The tree of causes: its shape, what effects have in common in it, and where every installed effect stands."""

from __future__ import annotations

from typing import Any

import pytest

from seatruth.effects import Effect, available
from seatruth.effects.causes import (
    CAUSES,
    ROOT,
    ancestors,
    children,
    is_cause,
    is_within,
    leaves,
    lowest_common_ancestor,
    parent,
    title,
)
from seatruth.errors import BadInput, PluginError
from seatruth.models.parameter import Parameter


def test_every_parent_is_a_node_and_stands_first() -> None:
    nodes = list(CAUSES)
    assert nodes[0] == ROOT
    for node in nodes[1:]:
        assert nodes.index(parent(node)) < nodes.index(node), node


def test_titles_are_words_and_each_is_used_once() -> None:
    titles = [title(node) for node in CAUSES]
    assert len(set(titles)) == len(titles)
    for text in titles:
        assert text == text.strip()
        assert "_" not in text
    assert title("environment.force_fixed_to_earth") == "a steady force fixed to the earth"


def test_children_leaves_and_ancestors() -> None:
    assert children(ROOT) == ("environment", "actuator", "sensor", "loading", "hydrodynamics")
    steady = "environment.force_fixed_to_earth"
    assert leaves(steady) == tuple(f"{steady}.{name}" for name in ("wind", "wave_drift", "line"))
    assert leaves(f"{steady}.wind") == (f"{steady}.wind",)
    assert ancestors(f"{steady}.wind") == (f"{steady}.wind", steady, "environment", ROOT)
    assert set(leaves()) < set(CAUSES)
    assert is_within(f"{steady}.wind", steady)
    assert is_within(steady, steady)
    assert not is_within(steady, f"{steady}.wind")
    assert not is_within("sensor.timing", steady)


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        (["wind"], "environment.force_fixed_to_earth.wind"),
        (["wind", "wave_drift"], "environment.force_fixed_to_earth"),
        (["wind", "trial_wind"], "environment.force_fixed_to_earth.wind"),
        (["current", "trial_current"], "environment.moving_water.uniform_current"),
        (["wind", "current"], "environment"),
        (["current", "varying_current"], "environment.moving_water"),
        (["rudder_lag", "rudder_delay", "rudder_backlash"], "actuator.steering.dynamics"),
        (["rudder_lag", "rudder_offset"], "actuator.steering"),
        (["rudder_offset", "propeller_walk"], "actuator"),
        (["speed_bias", "speed_scale"], "sensor.bias_or_scale.speed"),
        (["heading_bias", "position_delay"], "sensor"),
        (["tether", "drag_increase"], "hydrodynamics"),
        (["heading_bias", "current"], ROOT),
    ],
)
def test_what_effects_have_in_common(effects: list[str], expected: str) -> None:
    known = available()
    assert lowest_common_ancestor(known[name].cause for name in effects) == expected
    assert lowest_common_ancestor(known[name].cause for name in reversed(effects)) == expected


def test_a_node_and_one_below_it_have_the_node_in_common() -> None:
    assert lowest_common_ancestor(["sensor.timing", "sensor.timing.depth"]) == "sensor.timing"


def test_every_installed_effect_has_a_place() -> None:
    for name, effect in available().items():
        assert is_cause(effect.cause), name
        assert not children(effect.cause), f"{name} could stand at a leaf below {effect.cause}"
        assert effect.family == effect.cause.split(".")[0]


def test_wrong_nodes_are_refused() -> None:
    with pytest.raises(BadInput, match=r"Did you mean 'sensor\.timing'"):
        title("sensor.timming")
    with pytest.raises(BadInput, match="no causes"):
        lowest_common_ancestor([])
    with pytest.raises(BadInput, match="no parent"):
        parent(ROOT)
    assert not is_cause(ROOT)


@pytest.mark.parametrize(
    ("cause", "message"),
    [("", "states no cause.*State one of environment"), ("sensor.timming", r"Did you mean 'sensor\.timing'")],
)
def test_an_effect_must_state_its_place(cause: str, message: str) -> None:
    fields: dict[str, Any] = {
        "name": "late",
        "cause": cause,
        "parameters": (Parameter("k", 1.0),),
        "null": {"k": 0.0},
        "measured_outputs": staticmethod(lambda y, s, i, q, e: y),
    }
    with pytest.raises(PluginError, match=message):
        type("Late", (Effect,), fields)()
    type("Late", (Effect,), {**fields, "cause": "sensor"})()
