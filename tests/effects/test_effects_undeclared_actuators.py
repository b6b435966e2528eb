"""What steers and drives a model whose author named no actuators."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth import BlackBox, Channel, Model, Parameter
from seatruth.effects import available, load_effects, with_effects
from seatruth.effects.targets import targets
from seatruth.effects.undeclared_actuators import drive_inputs, neutral, resting_inputs, steering_inputs
from seatruth.models import Order, Rudder, Thruster, load_model, with_servos
from seatruth.models.base import KINDS
from seatruth.models.geometry import Dimensions
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial

_STATES = tuple(Channel(name, unit) for name, unit in (("u", "m/s"), ("v", "m/s"), ("r", "rad/s"), ("psi", "rad")))


class Tug(Model):
    """Two drives that turn about the vertical, a bow tunnel that is ordered in newtons, and a recorded wind."""

    name = "tug"
    states = outputs = _STATES
    inputs = (
        Channel("az_port", "rad"),
        Channel("az_starboard", "rad"),
        Channel("n_port", "rev/s"),
        Channel("n_starboard", "rev/s"),
        Channel("tunnel", "N"),
        Channel("wind_angle", "rad"),
        Channel("ballast", "kg"),
    )

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        port, starboard = i.n_port * abs(i.n_port), i.n_starboard * abs(i.n_starboard)
        side = port * math.sin(i.az_port) + starboard * math.sin(i.az_starboard)
        ahead = port * math.cos(i.az_port) + starboard * math.cos(i.az_starboard)
        return ahead - s.u, side + i.tunnel - s.v + math.sin(i.wind_angle), i.tunnel - side - s.r, s.r


class Torpedo(Model):
    """A vehicle with fins of its author's names, one for each turn, and one that does nothing."""

    name = "torpedo_of_a_user"
    kind = "auv"
    states = outputs = tuple(
        Channel(name, unit)
        for name, unit in (("u", "m/s"), ("q", "rad/s"), ("r", "rad/s"), ("theta", "rad"), ("psi", "rad"))
    )
    inputs = (Channel("fin_h", "rad"), Channel("fin_v", "rad"), Channel("dummy", "rad"), Channel("rpm", "rev/s"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return i.rpm - s.u, -s.u * i.fin_h - s.q, s.u * i.fin_v - s.r, s.q, s.r


def test_angles_that_turn_a_model_steer_it_and_what_has_revolutions_or_forces_drives_it() -> None:
    assert steering_inputs(Tug(), "rudder") == ("az_port", "az_starboard")
    assert steering_inputs(Tug(), "plane") == ()
    assert drive_inputs(Tug()) == ("n_port", "n_starboard", "tunnel")


def test_fins_of_a_submerged_vehicle_are_told_apart_by_what_they_turn() -> None:
    assert steering_inputs(Torpedo(), "rudder") == ("fin_v",)
    assert steering_inputs(Torpedo(), "plane") == ("fin_h",)
    assert drive_inputs(Torpedo()) == ("rpm",)


def test_a_black_box_that_shows_one_turn_is_steered_in_it() -> None:
    fields: dict[str, Any] = {"inputs": [Channel("helm", "rad")], "parameters": []}
    box = BlackBox("box", print, outputs=[Channel("psi", "rad", angle=True)], **fields)
    both = BlackBox("box", print, outputs=[Channel("psi", "rad", angle=True), Channel("theta", "rad")], **fields)
    assert steering_inputs(box, "rudder") == ("helm",)
    assert steering_inputs(both, "rudder") == ()  # nobody can say which
    assert not available()["rudder_lag"].missing(box)


@pytest.mark.parametrize(
    ("name", "rudder", "plane", "drives"),
    [
        ("mmg", ("delta",), (), ("n",)),
        ("torpedo", ("delta",), ("delta_s",), ("n",)),
        ("twin_thruster", (), (), ()),
        ("diving_plane", (), ("delta_s",), ()),
    ],
)
def test_usual_names_and_declared_actuators_come_first(
    name: str, rudder: tuple[str, ...], plane: tuple[str, ...], drives: tuple[str, ...]
) -> None:
    model = load_model(name)
    assert steering_inputs(model, "rudder") == rudder
    assert steering_inputs(model, "plane") == plane
    assert drive_inputs(model) == drives


def test_a_starboard_rudder_that_is_declared_is_no_stern_plane() -> None:
    """Of a ferry with the rudders delta_p and delta_s an offset of a stern plane was one of the causes."""
    inputs = (Channel("delta_p", "rad"), Channel("delta_s", "rad"))
    ferry = type(
        "Ferry", (Torpedo,), {"inputs": inputs, "actuators": (Rudder("port", "delta_p"), Rudder("s", "delta_s"))}
    )
    offset, plane = (available()[name] for name in ("rudder_offset", "plane_offset"))
    assert [one.input for one in targets(offset, ferry())] == ["delta_p", "delta_s"]
    assert targets(plane, ferry()) == ()
    assert "plane" in plane.missing(ferry())
    assert [one.input for one in targets(plane, load_model("torpedo"))] == ["delta_s"]


def test_effects_act_on_all_of_them_alike_and_on_each_alone() -> None:
    found = available()
    for name, inputs in (("rudder_offset", ("az_port", "az_starboard")), ("thruster_lag", Tug().inputs[2:5])):
        names = [one if isinstance(one, str) else one.name for one in inputs]
        forms = found[name].variants(Tug())
        assert [form.name for form in forms] == [name, *(f"{name}_{one}" for one in names)]
        assert forms[0].title == f"{found[name].title} ({' and '.join(names)})"
        assert [form.places(Tug()) for form in forms[1:]] == [(f"actuator:{one}",) for one in names]
    assert "names no thruster" in found["thruster_dead_band"].missing(Tug())


@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("size", [None, Dimensions(6.0, 1.8, 0.5, 900.0, 1025.0)])
@pytest.mark.parametrize("drive", [Channel("n", "rev/s"), Channel("push", "N"), Channel("lever", "1"), None])
def test_every_effect_says_whether_it_suits_a_model_that_declares_little(
    kind: str, size: Dimensions | None, drive: Channel | None
) -> None:
    """The thrust follows from the equations where there is one drive; the size may be declared beside it, or not."""

    class Launch(Model):
        name = "launch_of_a_user"
        states = outputs = _STATES
        inputs = (Channel("wheel", "rad"), *([drive] if drive else []))
        parameters = (Parameter("m", 900.0, "kg"), Parameter("X_uu", 30.0, "kg/m"))
        dimensions = staticmethod(lambda p: size) if size else None

        @staticmethod
        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            thrust = 80.0 if drive is None else 40.0 * i[1] * (2.0 - 0.1 * s.u)
            surge = (thrust - p.X_uu * s.u * abs(s.u) + e.X) / p.m
            return surge, (e.Y - 90.0 * s.v) / p.m, 0.1 * s.u * i.wheel - s.r + e.N / 3000.0, s.r

    Launch.kind = kind
    model, usable = Launch(), []
    for effect in available().values():
        for form in effect.candidates(model):
            if not form.missing(model):
                usable.append(form.name)
                with_effects(model, [form])
    driven = drive is not None and kind != "glider"
    assert {"drag_increase", "rudder_offset", "current"} <= set(usable)
    assert ("thrust_gain" in usable) == driven
    assert ("thrust_misalignment" in usable) == (driven and size is not None)


class Raft(Model):
    """Two drives in pulses of their speed controllers, without names and without a declared thrust."""

    name = "raft"
    states = outputs = _STATES
    inputs = (Channel("pwm_port", "1"), Channel("pwm_starboard", "1"))
    parameters = (Parameter("port", 2.0, "1"), Parameter("starboard", 2.0, "1"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        port, starboard = (i.pwm_port - 1500.0) / 400.0, (i.pwm_starboard - 1500.0) / 400.0
        left, right = p.port * port * abs(port), p.starboard * starboard * abs(starboard)
        return left + right - s.u * abs(s.u), -s.v, left - right - s.r, s.r


class Pulsed(Raft):
    """The same with the unit of pulses, and its drives named."""

    name = "pulsed"
    inputs = (Channel("pwm_port", "us"), Channel("pwm_starboard", "us"))
    actuators = tuple(
        Thruster(side, f"pwm_{side}", at=(0.0, y, 0.0), towards=(1.0, 0.0, 0.0), full=1900.0)
        for side, y in (("port", -1.0), ("starboard", 1.0))
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        port, starboard = (i.pwm_port - 1500.0) / 400.0, (i.pwm_starboard - 1500.0) / 400.0
        return p.port * port * abs(port), p.starboard * starboard * abs(starboard)


def test_pulses_with_their_unit_rest_where_those_without_do() -> None:
    """Full power is 400 us from there, not 1900."""
    assert resting_inputs(Pulsed()) == {"pwm_port": 1500.0, "pwm_starboard": 1500.0}
    (dead, *_) = load_effects(["thruster_gain_port"], model=Pulsed())
    (target,) = targets(dead, Pulsed())
    assert (target.full, target.neutral) == (400.0, 1500.0)


def _run(model: Model, values: dict[str, float]) -> Any:
    t = np.linspace(0.0, 6.0, 31)
    orders = {"pwm_port": 1500.0 + 300.0 * np.cos(t), "pwm_starboard": 1500.0 - 250.0 * np.cos(0.7 * t)}
    sim = simulator(model, [Trial("run", t, orders, {}, synthetic=True)], values={**model.nominal(), **values})
    return sim.outputs(np.zeros((1, 0)), np.array([[0.3, 0.1, 0.0, 0.2]])).y[0]


def test_a_drive_without_a_name_gives_another_share_of_what_the_equations_say() -> None:
    gain, weak = load_effects(["drive_gain", "drive_gain_pwm_port"], model=Raft())
    assert neutral(Raft()) == 1500.0
    one, all_ = with_effects(Raft(), [weak]), with_effects(Raft(), [gain])
    assert _run(one, {"drive_gain_pwm_port_k": -0.2}) == pytest.approx(_run(Raft(), {"port": 1.6}), rel=1e-9)
    same = _run(Raft(), {"port": 1.6, "starboard": 1.6})
    assert _run(all_, {"drive_gain_k": -0.2}) == pytest.approx(same, rel=1e-9)
    assert weak.places(Raft()) == ("actuator:pwm_port",)


def test_a_drive_is_changed_only_where_its_rest_is_known_and_nothing_else_says_so() -> None:
    gain = available()["drive_gain"]

    class Odd(Raft):
        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return i.pwm_port + i.pwm_starboard - 300.0 - s.u, -s.v, i.pwm_port - i.pwm_starboard - s.r, s.r

    class Heavy(Raft):
        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return i.pwm_port / s.u, -s.v, i.pwm_starboard - s.r, s.r

    assert neutral(Odd()) is None
    assert neutral(Heavy()) is None
    assert "at which input its drives rest" in gain.missing(Odd())
    assert "tells its thrust" in gain.missing(load_model("mmg"))
    assert "names its thrusters" in gain.missing(load_model("twin_thruster"))
    assert neutral(load_model("mmg")) == 0.0
    assert neutral(load_model("abkowitz")) is None
    fields: dict[str, Any] = {"inputs": [Channel("port", "N"), Channel("starboard", "N")], "parameters": []}
    box = BlackBox("box", print, outputs=[Channel("psi", "rad", angle=True)], **fields)
    assert "does not show what one drive alone does" in gain.only("port").missing(box)


class Sledge(Model):
    """A glider's pitch by a battery on a sledge, in metres, and a nozzle that is ordered from -1 to 1."""

    name = "sledge"
    kind = "glider"
    states = outputs = tuple(Channel(name, unit) for name, unit in (("u", "m/s"), ("q", "rad/s"), ("r", "rad/s")))
    inputs = (Channel("x_b", "m"), Channel("steer", "1"))
    actuators = (Rudder("battery", "x_b", turns="pitch", full=0.02), Rudder("nozzle", "steer"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return 1.0 - s.u, -10.0 * i.x_b - s.q, s.u * i.steer - s.r


def _sledge(model: Model, x_b: Any, values: dict[str, float]) -> Any:
    t = np.linspace(0.0, 8.0, 161)
    trial = Trial("run", t, {"x_b": x_b(t), "steer": 0.4 * np.sin(t)}, {}, synthetic=True)
    sim = simulator(model, [trial], values={**model.nominal(), **values})
    start = [[1.0] + [0.0] * (len(model.states) - 1)]
    return sim.outputs(np.zeros((1, 0)), np.array(start)).y[0]


def test_effects_measure_an_input_that_is_no_angle_by_what_it_holds_hard_over() -> None:
    """35 deg stand for 20 mm, and for full command: a twentieth of that is 1 mm, and 0.05."""
    full = math.radians(35.0)
    names = ["plane_offset", "rudder_offset", "plane_rate_limit"]
    offset, helm, limit = load_effects(names, model=Sledge())
    with_both = with_effects(Sledge(), [offset, helm])
    turned = {"plane_offset_angle": 0.05 * full, "rudder_offset_angle": 0.05 * full}
    moved = _sledge(with_both, lambda t: 0.0 * t, turned)
    assert moved[:, 1] == pytest.approx(_sledge(Sledge(), lambda t: 0.001 + 0.0 * t, {})[:, 1], rel=1e-6)
    plain = _sledge(Sledge(), lambda t: 0.0 * t, {})
    t = np.linspace(0.0, 8.0, 161)
    assert moved[:, 2] - plain[:, 2] == pytest.approx(0.05 * (1.0 - np.exp(-t)), abs=1e-4)
    # A step of 10 mm at 2.5 mm/s is a ramp of 4 s, also behind a servo of 5 mm/s (whose slowness it adds to).
    ramp = _sledge(Sledge(), lambda t: np.minimum(0.0025 * t, 0.01), {})[:, 1]
    ordered = with_servos(Sledge(), {"x_b": Order(rate_limit=0.005)})
    for model, rate in ((Sledge(), 0.0025), (ordered, 0.005)):
        slow = {"plane_rate_limit_slowness": 0.02 / full / rate}
        late = _sledge(with_effects(model, [limit]), lambda t: np.where(t > 0.0, 0.01, 0.0), slow)[:, 1]
        assert late == pytest.approx(ramp, abs=1e-3)
