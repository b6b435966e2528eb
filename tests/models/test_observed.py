"""Models with the outputs that a log holds: what they show, how they start, and what they refuse."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cloudpickle
import numpy as np
import pytest

from seatruth.effects import ExtendedModel, load_effects, with_effects
from seatruth.errors import BadInput
from seatruth.manoeuvres import Stepper
from seatruth.models import BlackBox, Channel, Model, Observation, Parameter, load_model, observed
from seatruth.models.base import Environment, record
from seatruth.models.initial_motion import initial_motion
from seatruth.models.torpedo_channels import Lateral
from seatruth.simulate import simulator
from seatruth.trials import Trial

T = np.arange(0.0, 8.0, 0.5)
MOVING = {"u": 1.2, "v": -0.1, "r": 0.05, "psi": 0.7, "x": 3.0, "y": -2.0}
AT = (3.0, 0.5, -2.0)
EVERYTHING = (
    *(Observation(name, at=AT) for name in ("u_w", "v_w", "sog", "cog", "v_n", "v_e", "f_x", "f_y", "x", "y")),
    Observation("ahead", "a_x"),
)


def names(model: Model) -> list[str]:
    return [channel.name for channel in model.outputs]


def trial(outputs: dict[str, float]) -> Trial:
    inputs = {"delta": 0.3 * np.sin(0.5 * T), "n": np.full(T.size, 10.0)}
    return Trial("run", T, inputs, {name: np.full(T.size, value) for name, value in outputs.items()})


def shown(model: Model, state: dict[str, float]) -> dict[str, float]:
    """Outputs at a state, with the rudder amidships."""
    stepper = Stepper(model)
    return stepper.outputs(stepper.first(state), {"delta": 0.0, "n": 10.0})


def test_a_current_acts_on_what_is_measured_through_the_water_and_not_over_ground() -> None:
    model = observed(load_model("mmg"), [Observation(name) for name in ("u_w", "v_w", "sog", "cog")], keep=("u", "v"))
    model = with_effects(model, load_effects(["current"]))
    sim = simulator(model, [trial({"u": 1.2, "psi": 0.0})], ("current_north", "current_east"), model.nominal())
    x0 = sim.initial_states
    y = dict(zip(names(model), sim.outputs(np.array([[0.3, -0.2]]), x0).y[0].T))
    psi = y["psi"]
    assert y["u_w"] == pytest.approx(y["u"] - (0.3 * np.cos(psi) - 0.2 * np.sin(psi)))
    assert y["v_w"] == pytest.approx(y["v"] - (-0.3 * np.sin(psi) - 0.2 * np.cos(psi)))
    assert y["sog"] == pytest.approx(np.hypot(y["u"], y["v"]))
    assert y["cog"] == pytest.approx(psi + np.arctan2(y["v"], y["u"]))


def test_compiled_and_plain_equations_agree_with_their_derivatives() -> None:
    model = with_effects(observed(load_model("mmg"), EVERYTHING), load_effects(["current"]))
    values = {**model.nominal(), "current_north": 0.2, "current_east": 0.1}
    free = ("Y_v", "current_north")
    theta = np.array([values[name] for name in free])
    run = trial({"sog": 1.2, "cog": 0.1, "psi": 0.1})
    compiled, plain = (simulator(model, [run], free, values, backend=kind) for kind in ("compiled", "reference"))
    exact = compiled.jacobian(theta, compiled.initial_states, ("u", "psi"))
    rough = plain.jacobian(theta, plain.initial_states, ("u", "psi"))
    assert exact.y == pytest.approx(rough.y, rel=1e-9, abs=1e-9)
    assert exact.dy == pytest.approx(rough.dy, rel=1e-5, abs=1e-6)


def test_the_accelerometer_shows_the_rates_of_the_equations() -> None:
    """Integrated, the acceleration over ground at the origin gives the velocity."""
    model = observed(load_model("mmg"), [Observation("a_x", "a_x"), Observation("a_y", "a_y")])
    fine = np.arange(0.0, 10.0, 0.02)
    run = Trial("run", fine, {"delta": 0.4 * np.sin(fine), "n": np.full(fine.size, 10.0)}, {"u": np.ones(fine.size)})
    sim = simulator(model, [run], (), model.nominal())
    y = dict(zip(names(model), sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0].T))
    assert y["a_x"][1:-1] + y["r"][1:-1] * y["v"][1:-1] == pytest.approx((y["u"][2:] - y["u"][:-2]) / 0.04, abs=1e-5)
    assert y["a_y"][1:-1] - y["r"][1:-1] * y["u"][1:-1] == pytest.approx((y["v"][2:] - y["v"][:-2]) / 0.04, abs=1e-5)


def test_outputs_that_an_observation_stands_for_leave_unless_kept() -> None:
    ship = load_model("mmg")
    assert names(observed(ship, [Observation("u_w")])) == ["x", "y", "psi", "v", "r", "u_w"]
    assert names(observed(ship, [Observation("u_w")], keep=["u"])) == ["x", "y", "psi", "u", "v", "r", "u_w"]
    assert names(observed(ship, [Observation("sog"), Observation("cog")])) == ["x", "y", "psi", "r", "sog", "cog"]
    assert names(observed(ship, [Observation("x", at=AT)])) == names(ship)
    assert observed(ship, []) is ship


@pytest.mark.parametrize(
    "channels",
    [
        [Observation("u", at=AT), Observation("v", at=AT)],
        [Observation("v_n", at=AT), Observation("v_e", at=AT)],
        [Observation("sog", at=AT), Observation("cog", at=AT)],
        [Observation("u_w", at=AT), Observation("v_w", at=AT)],
    ],
    ids=lambda channels: channels[0].channel,
)
def test_the_initial_state_gives_back_what_was_measured(channels: Sequence[Observation]) -> None:
    model = observed(load_model("mmg"), [*channels, Observation("x", at=AT), Observation("y", at=AT)])
    first = model.first_state(shown(model, MOVING), {"delta": 0.0, "n": 10.0}, model.nominal())
    assert dict(zip((state.name for state in model.states), first)) == pytest.approx(MOVING)


def test_what_was_not_recorded_is_completed_from_what_was() -> None:
    model = observed(load_model("mmg"), [Observation("u_w"), Observation("sog"), Observation("cog")])
    found = model.complete({"sog": 2.0, "cog": 0.3}, {})
    assert found["u_w"] == pytest.approx(2.0)
    assert found["psi"] == 0.3  # no heading was recorded: the course stands for it
    assert found["x"] == 0.0
    extended = with_effects(model, load_effects(["current"]))
    assert extended.complete({"sog": 2.0, "psi": 0.1}, {})["cog"] == pytest.approx(0.1)


def test_the_course_gives_the_heading_where_nothing_else_does() -> None:
    m = initial_motion({}, [("sog", "sog", (0.0, 0.0, 0.0)), ("cog", "cog", (0.0, 0.0, 0.0))], {"sog": 2.0, "cog": 1.0})
    assert (m.psi, m.u, m.v) == pytest.approx((1.0, 2.0, 0.0))
    velocity = {"v_n": 2.0 * math.cos(1.0), "v_e": 2.0 * math.sin(1.0)}
    m = initial_motion({}, [(name, name, (0.0, 0.0, 0.0)) for name in velocity], velocity)
    assert (m.psi, m.u, m.v) == pytest.approx((1.0, 2.0, 0.0))


def test_effects_see_a_channel_of_any_name_under_the_standard_one() -> None:
    model = observed(load_model("mmg"), [Observation("doppler", "u_w")])
    assert model.standard["doppler"] == ("u_w", 1)
    assert isinstance(with_effects(model, load_effects(["current"])), ExtendedModel)


class Upward(Model):
    """A body in axes of its own: it measures its vertical speed upwards."""

    name = "upward"
    states = outputs = (Channel("v_x", "m/s"), Channel("v_y", "m/s"), Channel("pitch", "rad", angle=True))
    parameters = (Parameter("a", 0.1, "1/s"),)
    standard = {"v_x": ("u", 1), "v_y": ("w", -1), "pitch": ("theta", 1)}  # noqa: RUF012

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return -p.a * (s.v_x - e.u_c), -p.a * (s.v_y + e.w_c), 0.0 * s.pitch


def test_signs_of_other_axes() -> None:
    model = observed(Upward(), [Observation("w_w", at=(1.0, 0.0, 0.0)), Observation("f_z"), Observation("v_d")])
    assert names(model) == ["v_x", "pitch", "w_w", "f_z", "v_d"]
    state = {"v_x": 2.0, "v_y": 0.5, "pitch": 0.2}
    stepper = Stepper(model)
    y = stepper.outputs(stepper.first(state), {})
    assert y["w_w"] == pytest.approx(-0.5)
    assert y["v_d"] == pytest.approx(-0.5 * math.cos(0.2) - 2.0 * math.sin(0.2))
    assert y["f_z"] == pytest.approx(0.05 - 9.80665 * math.cos(0.2))
    assert model.first_state(y, {}, model.nominal()) == pytest.approx((2.0, 0.5, 0.2))


def test_inputs_of_a_channel_model() -> None:
    """It takes the speed as an input; the course follows from it."""
    model = observed(Lateral(), [Observation("cog"), Observation("sog")])
    stepper = Stepper(model)
    y = stepper.outputs(stepper.first({"v": 0.3, "psi": 1.0}), {"u": 1.0, "delta": 0.0})
    assert y["cog"] == pytest.approx(1.0 + math.atan2(0.3, 1.0))
    assert y["sog"] == pytest.approx(math.hypot(0.3, 1.0))


def test_models_with_observations_reach_other_processes() -> None:
    model = observed(load_model("mmg"), EVERYTHING)
    again = cloudpickle.loads(cloudpickle.dumps(model))
    assert shown(again, MOVING) == shown(model, MOVING)


def box(run: Any, *, heading: bool = True) -> BlackBox:
    """Without its heading it takes a current in earth axes."""
    outputs = [Channel(name, "m/s") for name in ("u", "v")] + [Channel("psi", "rad", angle=True)] * heading
    parameters, ports = [Parameter("a", 1.0, "1")], None if heading else {"current": ["north", "east"]}
    return BlackBox("box", run, inputs=[], outputs=outputs, states=outputs[:1], parameters=parameters, ports=ports)


def straight(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, Any]:
    assert first is not None
    u = first["u"] + p["a"] * trial.t
    return {"u": u, "v": 0.1 * u, "psi": np.full(u.size, 0.2)}


def test_a_black_box_shows_course_and_speed() -> None:
    model = observed(box(straight), [Observation("sog"), Observation("cog")])
    assert names(model) == ["u", "v", "psi", "sog", "cog"]
    run = Trial("run", T, {}, {"sog": np.full(T.size, 2.0), "cog": np.zeros(T.size)})
    sim = simulator(model, [run], ("a",), model.nominal())
    assert sim.initial_states[0, 0] == pytest.approx(2.0)
    y = dict(zip(names(model), sim.outputs(np.array([[0.5]]), sim.initial_states).y[0].T))
    assert y["sog"] == pytest.approx(math.hypot(1.0, 0.1) * (2.0 + 0.5 * T))
    assert y["cog"] == pytest.approx(np.full(T.size, 0.2 + math.atan(0.1)))
    extended = with_effects(model, load_effects(["heading_bias"]))
    assert extended.complete({"sog": 1.0}, {})["u"] == pytest.approx(1.0)


def test_a_diverged_black_box_shows_nothing() -> None:
    model = observed(
        box(lambda *_: {name: np.full(T.size, np.nan) for name in ("u", "v", "psi")}), [Observation("sog")]
    )
    assert isinstance(model, BlackBox)
    assert np.isnan(model.run(Trial("run", T, {}, {}), {"a": 1.0}, {"u": 1.0})).all()


class Drifting(Model):
    """A point that drifts, without an environment, and whose speed ahead is an input."""

    name = "drifting"
    states = outputs = (Channel("x", "m"),)
    inputs = (Channel("u", "m/s"),)
    parameters = (Parameter("a", 0.1, "1/s"),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (i.u - p.a * s.x,)


@pytest.mark.parametrize(
    ("model", "channel", "measures", "said"),
    [
        (load_model("mmg"), "w_w", None, "the model has no 'w'"),
        (load_model("mmg"), "delta", "sog", "is an input of the model"),
        (box(straight), "u_w", None, "without a port for a current does not show how the water moves"),
        (box(straight, heading=False), "u_w", None, "does not return its heading"),
        (box(straight), "f_x", None, "a black box does not show its accelerations"),
        (box(straight), "u", "sog", "is a state of a black box"),
        (Drifting(), "u_w", None, "its rhs takes no environment e"),
        (Drifting(), "cog", None, "the model has no 'psi'"),
        (Lateral(), "f_x", None, "'u' is an input of the model"),
    ],
)
def test_what_a_model_cannot_show_is_refused(model: Model, channel: str, measures: str | None, said: str) -> None:
    with pytest.raises(BadInput, match=said) as problem:
        observed(model, [Observation(channel, measures)])
    assert problem.value.do


def test_wrong_observations_are_refused() -> None:
    with pytest.raises(BadInput, match=r"no measure 'speed'.*"):
        Observation("log", "speed")
    with pytest.raises(BadInput, match="no measure 'stw'") as problem:
        Observation("log", "stw")
    assert "'u_w'" in problem.value.do
    with pytest.raises(BadInput, match="three finite numbers"):
        Observation("sog", at=(1.0, math.nan, 0.0))
    with pytest.raises(BadInput, match="named twice"):
        observed(load_model("mmg"), [Observation("sog"), Observation("sog")])


@pytest.mark.parametrize(("channel", "measures"), [("u_w", None), ("doppler", "u_w")])
def test_the_effects_of_a_log_act_on_the_speed_through_the_water(channel: str, measures: str | None) -> None:
    plain = observed(load_model("mmg"), [Observation(channel, measures), Observation("v_w")])
    effects = load_effects(["current", "speed_scale", "log_lever_arm", "speed_delay"])
    model = with_effects(plain, effects)
    assert effects[1].places(plain) == (f"sensor:{channel}",)
    values = {**model.nominal(), "current_north": 0.2, "speed_scale_k": 0.1, "log_lever_arm_forward": 2.0}
    state = record("States", model.states)(**{c.name: MOVING.get(c.name, 0.0) for c in model.states})
    p, i = record("P", model.parameters)(**values), record("I", model.inputs)(0.0, 10.0)
    assert model.output is not None
    y = dict(zip(names(model), model.output(state, i, p, Environment())))
    assert y[channel] == pytest.approx(1.1 * (1.2 - 0.2 * math.cos(0.7)))
    assert y["v_w"] == pytest.approx(-0.1 + 0.2 * math.sin(0.7) + 2.0 * 0.05)
    assert model.follows["speed_delay_u_0"] == ("u", 1.0)
    assert {slope.output for slope in model.slopes.values()} == {channel, "v_w"}


def test_the_effects_of_a_log_do_not_act_on_a_speed_of_satellites() -> None:
    model = observed(load_model("mmg"), [Observation("sog"), Observation("cog")])
    assert load_effects(["speed_bias"])[0].missing(model) == "the model has no output 'u_w'"
