"""Pods, nozzles and wheels under names of their own are read, ordered and recognised as a rudder is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatruth import Channel, Model
from seatruth.manoeuvres import TurningCircle, Zigzag, run_manoeuvre, steered, zigzag_figures
from seatruth.manoeuvres.recognise import recognise
from seatruth.manoeuvres.steering import RudderSteering, steering_of
from seatruth.manoeuvres.steering_gear import Gear, steering_gear, with_planes
from seatruth.models import Rudder, load_model
from seatruth.trials import Trial

DEG = math.radians(1.0)


class Tug(Model):
    """Two pods aft: pushed to starboard, the stern turns the bow to port."""

    name = "tug"
    states = outputs = (
        Channel("u", "m/s"),
        Channel("r", "rad/s"),
        Channel("psi", "rad", angle=True),
        Channel("x", "m"),
        Channel("y", "m"),
    )
    inputs = (Channel("az_port", "rad"), Channel("az_stbd", "rad"), Channel("n_p", "rev/s"), Channel("n_s", "rev/s"))
    actuators = (Rudder("port", "az_port"), Rudder("stbd", "az_stbd"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        port, stbd = (n * (n - 2.0 * s.u) for n in (i.n_p, i.n_s))  # turned by the water where it is slow
        ahead = port * math.cos(i.az_port) + stbd * math.cos(i.az_stbd)
        side = port * math.sin(i.az_port) + stbd * math.sin(i.az_stbd)
        return (
            0.01 * ahead - 0.3 * s.u,
            -0.006 * side - 0.5 * s.r,
            s.r,
            s.u * math.cos(s.psi),
            s.u * math.sin(s.psi),
        )


class Unnamed(Tug):
    actuators = ()


@pytest.mark.parametrize("model", [Tug(), Unnamed()])
def test_manoeuvres_of_pods_are_sailed_and_recognised(model: Model) -> None:
    """Ordered as with a rudder, both pods turn to the other side."""
    drive = {"n_p": 8.0, "n_s": 8.0}
    start = {"u": 2.4}
    turn = run_manoeuvre(
        model, TurningCircle(20 * DEG, 400 * DEG, approach=10.0), dt=0.5, first_state=start, inputs=drive
    )
    assert turn.inputs["az_port"][-1] == pytest.approx(-20 * DEG)
    assert float(np.abs(np.diff(turn.inputs["az_stbd"])).max()) <= 2.5 * DEG + 1e-9  # at the rate of a rudder
    assert turn.outputs["psi"][-1] > math.radians(390.0)
    assert [one.label for one in recognise(turn, model=model)] == ["turning circle 20 starboard"]
    zigzag = run_manoeuvre(
        model, Zigzag(10 * DEG, 10 * DEG, executes=5, approach=10.0), dt=0.5, first_state=start, inputs=drive
    )
    assert [one.label.split("/")[0] for one in recognise(zigzag, model=model)] == ["zigzag 10"]
    assert zigzag_figures(steered(zigzag, model)).rudder == pytest.approx(10 * DEG, rel=0.01)
    assert "az_port" not in RudderSteering(gear=steering_gear(model, "rudder")).straight(zigzag)


def test_a_rudder_of_the_usual_name_stays_what_it_is() -> None:
    steering = steering_of(load_model("mmg"))
    assert isinstance(steering, RudderSteering)
    assert not steering.gear
    assert steering_of(load_model("twin_thruster")).by == "thrust"
    assert steering_gear(load_model("torpedo"), "plane") == {"delta_s": Gear(0.0, 1.0)}


def test_a_turn_under_pods_that_point_across_is_no_turning_circle() -> None:
    drive = {"n_p": 3.0, "n_s": 3.0}
    about = run_manoeuvre(Tug(), TurningCircle(90 * DEG, 400 * DEG), dt=0.5, first_state={"u": 0.0}, inputs=drive)
    assert about.outputs["psi"][-1] > math.radians(390.0)
    assert not [one for one in recognise(about, model=Tug()) if one.kind == "turning circle"]


def test_a_command_counts_as_a_share_of_the_largest_rudder() -> None:
    class Jet(Model):
        name = "jet"
        states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))
        inputs = (Channel("steer", "1"), Channel("throttle", "1"))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return i.throttle - s.u, i.throttle * i.steer - s.r

    gear = steering_gear(Jet(), "rudder")["steer"]
    assert math.degrees(gear.angle(1.0)) == pytest.approx(35.0)
    assert gear.order(gear.angle(0.4)) == pytest.approx(0.4)


def test_planes_of_other_names_become_one() -> None:
    class Fins(Model):
        name = "fins"
        states = outputs = (Channel("u", "m/s"), Channel("q", "rad/s"))
        inputs = (Channel("bow", "rad"), Channel("stern", "rad"))
        actuators = (Rudder("bow", "bow", turns="pitch"), Rudder("stern", "stern", turns="pitch"))

        @staticmethod
        def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
            return -s.u, s.u * (i.bow - i.stern) - s.q

    t = np.arange(3.0)
    log = Trial("dive", t, {"bow": -0.2 + 0.0 * t, "stern": 0.1 + 0.0 * t}, {})
    assert with_planes(Fins(), log).inputs["delta_s"] == pytest.approx(0.15)
    assert with_planes(None, log) is log
