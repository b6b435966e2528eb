"""Every installed effect against the conformance suite, and what effects do together and to what is known."""

from __future__ import annotations

import math
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatruth import effects
from seatruth.effects import Effect, ExtendedModel, available, broken, effects_by_name, load_effects, with_effects
from seatruth.errors import BadInput, PluginError
from seatruth.models import load_model
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter, Prior
from seatruth.simulate import simulator
from seatruth.testing.effects import EffectConformance
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


class TestInstalled(EffectConformance):
    """The suite itself, on one effect of each kind; `test_effects_library` has them all on all models."""

    @pytest.fixture(
        params=[
            *("current", "rudder_delay", "quantisation"),
            *(pytest.param(name, marks=pytest.mark.slow) for name in ("added_mass", "pitch_delay", "sloshing")),
        ]
    )
    def effect(self, request: pytest.FixtureRequest) -> Effect:
        return available()[request.param]


class TestWithStates(EffectConformance):
    """An effect with a state of its own: the rudder follows its reading with a lag, none of it at share 0."""

    @pytest.fixture
    def effect(self) -> Effect:
        return Lagging()


class Lagging(Effect):
    """A share of the rudder angle acts late."""

    name = "lagging"
    title = "rudder partly late"
    cause = "actuator.steering.dynamics.lag"
    source = "[S] made for this test"
    acts_on = ("actuator:delta",)
    needs_inputs = ("delta",)
    parameters = (Parameter("share", 0.5, "1", -1.0, 1.0, source="[S] test"),)
    null = {"share": 0.0}  # noqa: RUF012
    states = (Channel("late_delta", "rad"),)

    @staticmethod
    def true_inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=i.delta + q.share * (s.late_delta - i.delta))

    @staticmethod
    def rates(s: Any, i: Any, p: Any, q: Any, e: Any) -> Any:
        return ((i.delta - s.late_delta) / 2.0,)


def test_all_load() -> None:
    assert not broken()
    assert {"current", "rudder_offset", "heading_bias"} <= set(available())


def test_a_current_only_carries_the_vehicle() -> None:
    """Relative to the water the ship moves as in still water; over ground it drifts with the current."""
    model = load_model("mmg")
    current = available()["current"]
    t = np.arange(0.0, 60.0, 0.2)
    inputs = {"delta": np.full(t.size, 0.3), "n": np.full(t.size, 10.0)}
    trial = Trial("turn", t, inputs, {}, synthetic=True)
    still = simulator(model, [trial])
    start = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    names = [channel.name for channel in model.outputs]
    x, y, psi = (names.index(name) for name in ("x", "y", "psi"))
    calm = still.outputs(np.zeros((1, 0)), start).y[0]
    drift = {"current_north": 0.2, "current_east": -0.1}
    carried_model = with_effects(model, [current])
    carried = simulator(carried_model, [trial], values={**carried_model.nominal(), **drift})
    moving = start.copy()
    moving[0, :2] += (0.2, -0.1)  # heading north: the current is added to u and v
    found = carried.outputs(np.zeros((1, 0)), moving).y[0]
    assert found[:, psi] == pytest.approx(calm[:, psi], abs=1e-6)
    assert found[:, x] == pytest.approx(calm[:, x] + 0.2 * t, abs=1e-4)
    assert found[:, y] == pytest.approx(calm[:, y] - 0.1 * t, abs=1e-4)


def test_effects_add_up() -> None:
    model = load_model("mmg")
    both = with_effects(model, effects_by_name(["rudder_offset", "rudder_gain", "heading_bias"], available()))
    assert [p.name for p in both.parameters[len(model.parameters) :]] == [
        "rudder_offset_angle",
        "rudder_gain_k",
        "heading_bias_b",
    ]
    t = np.arange(0.0, 20.0, 0.2)
    read = Trial("read", t, {"delta": 0.2 * np.sin(t), "n": np.full(t.size, 10.0)}, {}, synthetic=True)
    real = Trial("real", t, {"delta": 0.8 * (0.2 * np.sin(t) + 0.05), "n": np.full(t.size, 10.0)}, {}, synthetic=True)
    start = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    values = {**both.nominal(), "rudder_offset_angle": 0.05, "rudder_gain_k": 0.8, "heading_bias_b": math.radians(2.0)}
    found = simulator(both, [read], values=values).outputs(np.zeros((1, 0)), start).y[0]
    expected = simulator(model, [real]).outputs(np.zeros((1, 0)), start).y[0]
    expected[:, [c.name for c in model.outputs].index("psi")] += math.radians(2.0)
    assert found == pytest.approx(expected, abs=1e-10)


def test_no_effects_is_the_model_itself() -> None:
    model = load_model("mmg")
    assert with_effects(model, []) is model


def test_where_effects_cannot_act_is_said() -> None:
    known = available()
    with pytest.raises(BadInput, match="no rudder 'delta'"):
        with_effects(load_model("diving_plane"), [known["rudder_offset"]])
    with pytest.raises(BadInput, match="no state 'psi'"):
        with_effects(load_model("diving_plane"), [known["current"]])
    with pytest.raises(BadInput, match="named twice"):
        with_effects(load_model("mmg"), [known["current"], known["current"]])
    with pytest.raises(BadInput, match="Did you mean 'current'"):
        effects_by_name(["curent"], known)
    with pytest.raises(BadInput, match="On one actuator alone there are: thruster_gain_port, thruster_gain_starboard"):
        load_effects(["thruster_gain_left"], model=load_model("twin_thruster"))
    box = BlackBox("box", lambda *_: {}, inputs=(), outputs=(Channel("u", "m/s"),), parameters=())
    with pytest.raises(BadInput, match="black box"):
        with_effects(box, [known["wind"]])


def test_a_wrong_effect_is_said() -> None:
    class NoNull(Effect):
        name = "no_null"
        parameters = (Parameter("k", 1.0),)

    with pytest.raises(PluginError, match="null"):
        NoNull()

    class NoRates(Effect):
        name = "no_rates"
        states = (Channel("z", "1"),)

    with pytest.raises(PluginError, match="rates"):
        NoRates()

    class NoHook(Effect):
        name = "no_hook"
        cause = "actuator.steering"
        parameters = (Parameter("k", 1.0),)
        null = {"k": 0.0}  # noqa: RUF012

    with pytest.raises(PluginError, match=r"changes nothing.*true_inputs"):
        NoHook()

    class BothNullAndPrior(NoHook):
        parameters = (Parameter("k", 1.0, prior=Prior(1.0, 0.5)),)

    with pytest.raises(PluginError, match="both a null and a prior"):
        BothNullAndPrior()

    class OffItsPrior(NoHook):
        parameters = (Parameter("k", 1.0), Parameter("lever", 0.2, prior=Prior(0.1, 0.5)))

    class Askew(NoHook):
        direction = ("k", "lever")
        true_inputs = staticmethod(lambda i, s, q, e: i)

    with pytest.raises(PluginError, match="two of its magnitudes"):
        Askew()

    with pytest.raises(PluginError, match="'lever' must stand at the mean of its prior"):
        OffItsPrior()


def test_the_form_of_an_effect_is_free_under_priors() -> None:
    """Shape parameters have the priors that they declare, whatever the model; magnitudes those about their null."""
    wind = available()["wind"]
    assert wind.magnitudes == ("north", "east")
    assert set(wind.shape_priors) == {"lever", "ln_area", "yaw_slope", "ln_x_ratio"}
    model = load_model("mmg")
    priors = wind.priors(model)
    assert {name: priors[name] for name in wind.shape_priors} == wind.shape_priors
    assert priors["yaw_slope"].mean == wind.null["yaw_slope"] == wind.typical(model)["yaw_slope"] == 0.18
    assert priors["north"].mean == 0.0
    extended = with_effects(model, [wind])
    assert extended.parameter("wind_yaw_slope").prior == priors["yaw_slope"]
    assert extended.parameter("wind_north").prior is None
    assert all(start["yaw_slope"] == 0.18 for start in wind.starts)


def test_effects_with_a_direction_start_in_several() -> None:
    """At the typical magnitude of the model; declared starts shrink on a small ship as its magnitudes do."""
    model, known = load_model("mmg"), available()
    for name in ("current", "wave_drift", "varying_current"):
        effect = known[name]
        north, east = effect.direction
        starts = effect.starting_points(model)
        towards = sorted(math.degrees(math.atan2(start[east], start[north])) % 360 for start in starts)
        assert towards == pytest.approx([45.0 * k for k in range(8)], abs=1e-9)
        for start in starts:
            assert math.hypot(start[north], start[east]) == pytest.approx(effect.priors(model)[north].sd)
            assert {key: start[key] for key in effect.shape_priors} == {
                key: prior.mean for key, prior in effect.shape_priors.items()
            }
    wind = known["wind"].starting_points(model)
    assert [math.hypot(start["north"], start["east"]) for start in wind] == pytest.approx([3.0 * math.sqrt(0.07)] * 8)
    assert known["rudder_offset"].starting_points(model) == []


def test_an_extended_model_shows_itself() -> None:
    extended = with_effects(load_model("mmg"), [available()["current"]])
    assert isinstance(extended, ExtendedModel)
    assert "constant current" in extended.title
    assert "current_north" in extended._repr_html_()


BROKEN = """
from seatruth.effects import Effect
class Raises(Effect):
    def __init__(self):
        raise ValueError("no such rudder")
class Other:
    pass
"""


@pytest.mark.parametrize(
    ("name", "error", "says"),
    [
        ("Raises", PluginError, "making it raised ValueError: no such rudder. Correct the effect file."),
        ("Other", BadInput, "it is no Effect. Derive the class from seatruth.effects.Effect."),
    ],
)
def test_a_file_that_gives_no_effect_says_why(tmp_path: Path, name: str, error: type[Exception], says: str) -> None:
    (tmp_path / "mine.py").write_text(BROKEN)
    with pytest.raises(error) as caught:
        load_effects([f"mine.py:{name}"], tmp_path)
    assert says in str(caught.value)
    assert f"mine.py:{name}" in str(caught.value)


def test_an_installed_effect_that_cannot_be_loaded_is_listed_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [
        EntryPoint("gone", "no_such_package:Effect", effects.GROUP),
        EntryPoint("text", "string:digits", effects.GROUP),
        EntryPoint("current", "seatruth.effects.environment:Current", effects.GROUP),
    ]
    monkeypatch.setattr(effects, "entry_points", lambda group: points)
    assert list(effects.available()) == ["current"]
    reasons = effects.broken()
    assert "ModuleNotFoundError: No module named 'no_such_package'" in reasons["gone"]
    assert "effect 'text' (string:digits): it is not an Effect. Derive the class" in reasons["text"]
