"""Forces of effects: which way they push, what they balance, and what models with names of their own get."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from twin import Twin

from seatruth.effects import available, dimensions_of, with_effects
from seatruth.effects.weather import FRONT, SIDE
from seatruth.manoeuvres import Stepper, self_propulsion, thruster_layout
from seatruth.models import Channel, Model, Observation, Parameter, load_model, observed, with_areas
from seatruth.models.geometry import Dimensions
from seatruth.simulate import simulator
from seatruth.trials.trial import Trial


def rates(name: str, state: dict[str, float], inputs: dict[str, float], **values: float) -> dict[str, float]:
    """Rates of a model's states with the effects whose parameters are given."""
    model = load_model(name)
    chosen = [effect for effect in available().values() if any(key.startswith(f"{effect.name}_") for key in values)]
    chosen = [effect for effect in chosen if any(effect.named(q.name) in values for q in effect.parameters)]
    extended = with_effects(model, chosen)
    stepper = Stepper(extended, values)
    named = [channel.name for channel in extended.states]
    return dict(zip(named, stepper.rate(0.0, stepper.first(state), inputs)))


REST = {"delta": 0.0, "n": 0.0}
FIN = {"delta": 0.0, "delta_s": 0.0, "delta_d": 0.0, "n": 0.0}


@pytest.mark.parametrize("heading", [0.0, 1.0, 2.5, 4.0])
def test_wind_and_waves_push_their_way(heading: float) -> None:
    for effect in ("wind", "wave_drift"):
        found = rates("mmg", {"psi": heading}, REST, **{f"{effect}_north": 3.0, f"{effect}_east": 1.0})
        north = found["u"] * math.cos(heading) - found["v"] * math.sin(heading)
        east = found["u"] * math.sin(heading) + found["v"] * math.cos(heading)
        assert 3.0 * north + 1.0 * east > 0


def test_wind_turns_the_bow_away_from_where_it_comes_ahead() -> None:
    """From 45 deg on the starboard bow, the force acts before midship and pushes the bow to port."""
    found = rates("mmg", {}, REST, wind_north=-5.0, wind_east=-5.0)
    assert found["u"] < 0
    assert found["v"] < 0
    assert found["r"] < 0


@pytest.mark.parametrize(
    ("areas", "wind", "rate"),
    [({"frontal_area": 2.0}, (-5.0, 0.0), "u"), ({"lateral_area": 2.0}, (0.0, 5.0), "v")],
)
def test_wind_pushes_on_the_areas_that_are_known(areas: dict[str, float], wind: tuple[float, float], rate: str) -> None:
    """From ahead and from abeam, it goes with one area alone: that which is known, not that which is estimated."""
    ship, size = load_model("mmg"), dimensions_of(load_model("mmg"))
    assert size is not None
    estimated = FRONT * size.breadth * size.draft if rate == "u" else SIDE * size.length * size.draft
    changes = []
    for model in (ship, with_areas(ship, **areas)):
        stepper = Stepper(with_effects(model, [available()["wind"]]), {"wind_north": wind[0], "wind_east": wind[1]})
        order = [state.name for state in ship.states]
        changes.append(stepper.rate(0.0, stepper.first({}), REST)[order.index(rate)])
    assert changes[1] / changes[0] == pytest.approx(2.0 / estimated, rel=1e-6)


def test_priors_of_the_wind_know_the_areas() -> None:
    """Deviations of ln(side force) and ln(surge force) are those of each area, and of the surge coefficient."""
    ship, wind = load_model("mmg"), available()["wind"]
    cases: list[tuple[dict[str, float], float, float]] = [
        ({}, 0.4, math.hypot(0.4, 0.5)),
        ({"lateral_area": 2.0}, 0.15, math.hypot(0.4, 0.5)),
        ({"frontal_area": 0.5}, 0.4, math.hypot(0.15, 0.5)),
        ({"frontal_area": 0.5, "lateral_area": 2.0}, 0.15, math.hypot(0.15, 0.5)),
    ]
    for areas, side, surge in cases:
        for effect in (wind, available()["trial_wind"].of_trials(["a", "b"])):
            priors = effect.priors(with_areas(ship, **areas))
            assert priors["ln_area"].sd == side
            assert math.hypot(priors["ln_area"].sd, priors["ln_x_ratio"].sd) == pytest.approx(surge)
            assert priors["ln_area"].mean == priors["ln_x_ratio"].mean == 0.0
            others = {name: prior for name, prior in priors.items() if name not in ("ln_area", "ln_x_ratio")}
            assert others == {name: effect.priors(ship)[name] for name in others}


def test_more_thrust_balances_more_drag() -> None:
    speed = 1.0
    revolutions = self_propulsion(load_model("mmg"), speed)
    inputs = {"delta": 0.0, "n": revolutions}
    faster = rates("mmg", {"u": speed}, inputs, thrust_gain_k=0.2)["u"]
    slower = rates("mmg", {"u": speed}, inputs, drag_increase_k=0.2)["u"]
    assert faster > 0.001
    assert slower == pytest.approx(-faster)
    assert rates("mmg", {"u": speed}, REST, thrust_gain_k=0.2)["u"] != pytest.approx(0.0)


def test_propeller_walk_goes_with_the_revolutions_squared() -> None:
    """And not with the speed, where misalignment of the thrust does."""

    def pushed(effect: str, n: float, u: float) -> float:
        inputs = {"delta": 0.0, "n": n}
        return rates("mmg", {"u": u}, inputs, **{effect: 0.05})["r"] - rates("mmg", {"u": u}, inputs)["r"]

    for u in (0.0, 1.0):
        assert pushed("propeller_walk_k", 10.0, u) == pytest.approx(4.0 * pushed("propeller_walk_k", 5.0, u))
        assert pushed("propeller_walk_k", -10.0, u) == pytest.approx(-pushed("propeller_walk_k", 10.0, u))
    assert pushed("propeller_walk_k", 10.0, 1.0) == pytest.approx(pushed("propeller_walk_k", 10.0, 0.0))
    assert abs(pushed("thrust_misalignment_angle", 10.0, 1.0)) < abs(pushed("thrust_misalignment_angle", 10.0, 0.0))


class Waterjet(Model):
    """A boat driven by an input of its own name, whose thrust falls with the speed."""

    name = "waterjet"
    title = "a boat with a waterjet"
    source = "[S] made for this test"
    states = (Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"))
    inputs = (Channel("throttle", "1"),)
    outputs = states
    parameters = (Parameter("m", 100.0, "kg", source="[S] test"), Parameter("T", 50.0, "N", source="[S] test"))

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return p.T * i.throttle * (1.0 - 0.1 * s.u)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(4.0, 1.0, 0.3, p.m, 1025.0)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return p.T * i.throttle * (1.0 - 0.1 * s.u) / p.m + e.X, e.Y / p.m, e.N


class TowedBoat(Waterjet):
    """The same boat, pulled by a constant force."""

    name = "towed"

    @staticmethod
    def thrust(s: Any, i: Any, p: Any, e: Any) -> Any:
        return p.T * (1.0 - 0.1 * s.u)


@pytest.mark.parametrize("u", [-2.0, 0.0, 3.0, 6.0])
def test_an_asymmetry_to_the_side_goes_with_the_speed_squared(u: float) -> None:
    """Ahead and astern to the same side, whatever the propeller does."""
    off, on = (
        rates("mmg", {"u": u}, REST, lateral_asymmetry_force=k, lateral_asymmetry_moment=-2 * k) for k in (0.0, 1e-4)
    )
    usual, most = (
        rates("mmg", {"u": 1.0}, REST, lateral_asymmetry_force=k, lateral_asymmetry_moment=-2 * k) for k in (0.0, 1e-4)
    )
    for rate, side in (("v", 1.0), ("r", -1.0)):
        unit = most[rate] - usual[rate]
        assert unit * side > 0
        assert on[rate] - off[rate] == pytest.approx(u * u * unit, rel=1e-9, abs=1e-15)


def test_drag_on_one_side_turns_to_that_side_ahead_and_to_the_other_astern() -> None:
    """By the moment of its share of the drag, half the breadth to starboard."""
    for u in (2.0, 1.0, 0.0, -1.0):
        off, on = (rates("mmg", {"u": u}, REST, side_drag_k=k) for k in (0.0, 0.1))
        slower = rates("mmg", {"u": u}, REST, drag_increase_k=0.1)
        turned = on["r"] - off["r"]
        assert np.sign(turned) == np.sign(u)
        assert on["u"] == pytest.approx(off["u"])
        usual = rates("mmg", {"u": 1.0}, REST, side_drag_k=0.1)["r"] - rates("mmg", {"u": 1.0}, REST)["r"]
        drag = (slower["u"] - off["u"]) / (
            rates("mmg", {"u": 1.0}, REST, drag_increase_k=0.1)["u"] - rates("mmg", {"u": 1.0}, REST)["u"]
        )
        assert turned == pytest.approx(usual * drag, rel=1e-9, abs=1e-15)


def test_forces_of_the_propeller_need_a_driven_thrust_and_no_name() -> None:
    known = available()
    state, full = {"u": 2.0}, {"throttle": 1.0}
    for effect, parameter, thrust in (("propeller_walk", "k", 50.0), ("thrust_misalignment", "angle", 40.0)):
        assert known[effect].missing(Waterjet()) == ""
        stepper = Stepper(with_effects(Waterjet(), [known[effect]]), {f"{effect}_{parameter}": 0.05})
        v, r = stepper.rate(0.0, stepper.first(state), full)[1:]
        assert v == pytest.approx(0.05 * thrust / 100.0)
        assert r == pytest.approx(-0.48 * 4.0 * 0.05 * thrust)
        assert "depends on no input" in known[effect].missing(TowedBoat())
        # Several thrusters have places of their own, and their direction.
        assert "no single propeller" in known[effect].missing(load_model("twin_thruster"))
        assert known["thruster_direction"].missing(load_model("twin_thruster")) == ""


def test_the_propellers_torque_rolls_vehicles_with_several_thrusters() -> None:
    """It goes with the thrust ahead, whatever the inputs are called: K = k B T over the inertia in roll."""
    torque = available()["propeller_torque"]
    for name in ("bluerov2", "bluerov2_heavy", "twin_thruster_roll"):
        model = load_model(name)
        assert torque.missing(model) == "", name
        layout = thruster_layout(model)
        battery = {channel.name: 16.0 for channel in model.inputs if channel.name not in layout.full}
        rolled = []
        for levels in ({"surge": 0.5}, {"surge": -0.5}, {"yaw": 0.0}):
            inputs = {**dict.fromkeys(layout.full, 0.0), **battery, **layout.orders(levels)}
            with_it, without = (rates(name, {}, inputs, propeller_torque_k=k)["p"] for k in (0.05, 0.0))
            rolled.append(with_it - without)
        assert rolled[0] > 0 > rolled[1], name
        assert rolled[2] == 0.0, name
    boat = load_model("twin_thruster_roll")
    inputs = {"n_port": 8.0, "n_starboard": 8.0}
    still, listing = (rates("twin_thruster_roll", {}, inputs, propeller_torque_k=k) for k in (0.0, 0.05))
    p = boat.nominal()
    # Roll alone, nearly: the coupling with sway and yaw changes the inertia by some per cent.
    expected = 0.05 * p["B"] * 2 * p["k_ahead"] * 64.0 / (p["I_x"] - p["K_dp"])
    assert listing["p"] - still["p"] == pytest.approx(expected, rel=0.3)


def test_damping_forces_brake() -> None:
    drifting = {"u": 1.0, "v": 0.2, "r": 0.05}
    bare = rates("mmg", drifting, REST)
    for effect in ("cross_flow_C_d", "tether_area"):
        found = rates("mmg", drifting, REST, **{effect: 0.5})
        assert found["v"] < bare["v"]
    assert rates("mmg", {"u": 1.0}, REST, tether_area=0.1)["u"] < rates("mmg", {"u": 1.0}, REST)["u"]
    # The strips' sum is the integral: without sway, int x |x| x dx = L^4 / 32.
    ship, turning = load_model("mmg"), {"r": 0.1}
    p = ship.nominal()
    mass, m_y = p["rho"] * p["nabla"], 0.5 * p["rho"] * p["L"] ** 2 * p["d"] * p["m_y"]
    inertia = mass * ((p["k_zz"] * p["L"]) ** 2 + p["x_G"] ** 2)
    inertia += 0.5 * p["rho"] * p["L"] ** 4 * p["d"] * p["J_z"]
    share = (mass + m_y) / ((mass + m_y) * inertia - (mass * p["x_G"]) ** 2)
    moment = 0.5 * p["rho"] * p["d"] * p["L"] ** 4 / 32 * 0.1**2
    found = rates("mmg", turning, REST, cross_flow_C_d=1.0)["r"] - rates("mmg", turning, REST)["r"]
    assert found == pytest.approx(-moment * share, rel=0.02)


def test_weight_sinks_and_trims_and_lists() -> None:
    assert rates("torpedo", {}, FIN, net_weight_share=0.01)["w"] > 0
    assert rates("torpedo", {}, FIN, trim_forward=0.01)["q"] < 0
    assert rates("torpedo", {}, FIN, lateral_offset_y_G=0.01)["p"] > 0
    straight = {"u": 1.5}
    assert rates("torpedo", straight, FIN, propeller_torque_k=0.1) == rates("torpedo", straight, FIN)
    stiff = rates("torpedo", {"theta": 0.2}, FIN, trim_below=0.01)["q"] - rates("torpedo", {"theta": 0.2}, FIN)["q"]
    assert stiff < 0


def test_liquid_resists_as_its_mass_when_the_turn_is_steady() -> None:
    """The liquid has gone as far out as its spring holds it: m_s u r pushes the wall outwards."""
    period, u, r = 5.0, 1.0, 0.05
    out = -u * r / (2 * math.pi / period) ** 2
    state = {"u": u, "r": r, "sloshing_shift": out}
    found = rates("mmg", state, REST, sloshing_share=0.1, sloshing_period=period)
    assert found["sloshing_shift"] == pytest.approx(0.0)
    assert found["sloshing_speed"] == pytest.approx(0.0)
    none = rates("mmg", state, REST, sloshing_share=0.0)
    assert found["v"] < none["v"]  # to port in a turn to starboard


def test_the_order_of_effects_on_forces_does_not_matter() -> None:
    model, known = load_model("mmg"), available()
    names = ["tether", "current", "wind", "cross_flow"]
    values = {"tether_area": 0.1, "current_north": 0.3, "wind_east": 4.0, "cross_flow_C_d": 0.4}
    state, inputs = {"u": 1.0, "v": 0.1, "r": 0.02, "psi": 0.5}, {"delta": 0.2, "n": 10.0}
    found = []
    for order in (names, names[::-1]):
        stepper = Stepper(with_effects(model, [known[name] for name in order]), values)
        found.append(stepper.rate(0.0, stepper.first(state), inputs))
    assert found[0] == pytest.approx(found[1])


def test_a_shear_is_a_current_at_one_depth() -> None:
    state = {"u": 1.5, "psi": 0.7, "z": 20.0}
    sheared = rates("torpedo", state, FIN, current_shear_north=0.01, current_shear_east=-0.005)
    carried = rates("torpedo", state, FIN, current_north=0.2, current_east=-0.1)
    assert list(sheared.values()) == pytest.approx(list(carried.values()))


class OwnNames(Model):
    """A boat whose channels have names and axes of their own: yaw rate positive to port, and a tiller."""

    name = "own_names"
    title = "a boat in axes of its own"
    source = "[S] made for this test"
    states = (Channel("yaw_rate", "rad/s"), Channel("course", "rad", angle=True))
    inputs = (Channel("tiller", "rad"),)
    outputs = states
    parameters = (Parameter("K", 0.2, "1/s", source="[S] test"),)
    standard = {"yaw_rate": ("r", -1), "course": ("psi", -1), "tiller": ("delta", 1)}  # noqa: RUF012

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return -p.K * i.tiller - s.yaw_rate, s.yaw_rate


def test_names_and_axes_of_a_users_model() -> None:
    model, known = OwnNames(), available()
    extended = with_effects(model, [known["gyro_bias"], known["rudder_offset"], known["heading_delay"]])
    assert known["gyro_bias"].places(model) == ("sensor:yaw_rate",)
    assert known["rudder_offset"].places(model) == ("actuator:tiller",)
    values = {"gyro_bias_b": 0.01, "rudder_offset_angle": 0.1}
    stepper = Stepper(extended, values)
    state = stepper.first({"yaw_rate": 0.02, "course": 0.3})
    assert stepper.outputs(state, {"tiller": 0.0})["yaw_rate"] == pytest.approx(0.02 - 0.01)
    assert stepper.rate(0.0, state, {"tiller": 0.0})[0] == pytest.approx(-0.2 * 0.1 - 0.02)
    first = extended.first_state({"yaw_rate": 0.0, "course": 0.3}, {"tiller": 0.0}, extended.nominal())
    assert first == pytest.approx((0.0, 0.3, -0.3, 0.0, 0.0))


def test_a_stern_plane_effect_leaves_the_rudder_alone() -> None:
    known = available()
    assert "no plane 'delta_s'" in known["plane_offset"].missing(load_model("mmg"))
    assert known["plane_offset"].places(load_model("torpedo")) == ("actuator:delta_s",)
    assert known["rudder_offset"].places(Twin()) == ("actuator:helm",)
    found = rates("torpedo", {"u": 1.5}, FIN, plane_offset_angle=0.1)
    assert found["q"] != 0
    assert found["r"] == pytest.approx(0.0)


def test_small_ships_have_small_magnitudes() -> None:
    """A 7 m model of a 320 m ship: Froude's rule about 100 m."""
    current, share = available()["current"], available()["drag_increase"]
    assert current.priors(load_model("abkowitz"))["north"].sd == 0.5
    assert current.priors(load_model("mmg"))["north"].sd == pytest.approx(0.5 * math.sqrt(0.07))
    assert current.priors(load_model("torpedo"))["north"].sd == 0.2
    assert share.priors(load_model("mmg"))["k"].sd == 0.15


def test_a_slow_log_does_not_make_quick_followers_diverge() -> None:
    """Samples 5 s apart: the effects' own states need shorter steps, and get them."""
    model, known = load_model("mmg"), available()
    extended = with_effects(model, [known["heading_delay"], known["sloshing"], known["rudder_lag"]])
    assert extended.longest_step == pytest.approx(2.0 * 0.5 * math.sqrt(0.07))
    t = np.arange(0.0, 1000.0, 5.0)
    trial = Trial("slow", t, {"delta": 0.1 * np.sin(0.02 * t), "n": np.full(t.size, 10.0)}, {}, synthetic=True)
    values = {**extended.nominal(), "heading_delay_tau": 0.4}
    sim = simulator(extended, [trial], values=values)
    assert sim.steps == 19 * (t.size - 1)
    start = sim.initial_states.copy()
    start[0, 0] = 1.0
    assert not sim.outputs(np.zeros((1, 0)), start).diverged.any()


@pytest.mark.parametrize("names", [("v_n", "v_e"), ("sog", "cog")])
def test_an_antenna_away_from_the_origin_moves_as_its_positions_do(names: tuple[str, str]) -> None:
    """The velocity that a receiver shows is that of its antenna, as the change of its positions is."""
    model = observed(load_model("mmg"), [Observation(name) for name in names])
    extended = with_effects(model, [available()["position_lever_arm"]])
    t = np.arange(0.0, 60.0, 0.1)
    inputs = {"delta": 0.4 * np.sin(0.2 * t), "n": np.full(t.size, 12.0)}
    first = {"u": 1.2, "v": 0.0, "r": 0.0, "psi": 0.5, "x": 0.0, "y": 0.0, **dict.fromkeys(names, 1.0)}
    run = Trial("run", t, inputs, {name: np.full(t.size, value) for name, value in first.items()})
    arm = {"position_lever_arm_forward": 1.5, "position_lever_arm_starboard": -0.4}

    def shown(values: dict[str, float]) -> dict[str, Any]:
        sim = simulator(extended, [run], free=(), values={**extended.nominal(), **values})
        y = sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0]
        found = {channel.name: y[:, c] for c, channel in enumerate(extended.outputs)}
        if "cog" in found:
            assert np.abs(np.diff(found["cog"])).max() < 0.1  # whole turns are not lost
            found |= {"v_n": found["sog"] * np.cos(found["cog"]), "v_e": found["sog"] * np.sin(found["cog"])}
        return found

    plain, moved = shown({}), shown(arm)
    for position, velocity in (("x", "v_n"), ("y", "v_e")):
        assert np.abs(moved[velocity] - plain[velocity]).max() > 0.02
        assert np.gradient(moved[position], t)[1:-1] == pytest.approx(moved[velocity][1:-1], abs=2e-4)
