"""What a black box declares of its vehicle acts through its ports as it does in equations, or is refused."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest
from diver import Diver

from seatruth import load_model, simulator
from seatruth.effects import available, with_effects
from seatruth.effects.base import Effect
from seatruth.effects.black_box import ExtendedBlackBox
from seatruth.effects.through_ports import OutsideEffects
from seatruth.effects.vehicle import role_of, straight_drag
from seatruth.errors import BadInput
from seatruth.models import BlackBox, Channel, Environment, Model, Parameter, Thruster
from seatruth.models.base import record
from seatruth.models.geometry import Dimensions
from seatruth.models.twin_thruster import FULL, TwinThruster
from seatruth.trials import Trial
from seatruth.workers import by_value

BOAT = load_model("twin_thruster")
T = np.arange(4.0)
TRIAL = Trial("run", T, {"n_port": np.full(4, 9.0), "n_starboard": np.full(4, -6.0)}, {})
MOTION = {"x": 3.0, "y": -2.0, "psi": 0.4, "u": 1.1, "v": -0.2, "r": 0.15}


class TwinBox(BlackBox):
    """The boat with two thrusters behind ports, with all that the equations declare; it notes what acts on it."""

    actuators = TwinThruster.actuators
    thrusts, thrust, drag = (
        staticmethod(role) for role in (TwinThruster.thrusts, TwinThruster.thrust, TwinThruster.drag)
    )
    dimensions = staticmethod(TwinThruster.dimensions)

    def __init__(self, force: tuple[str, ...] = ("X", "Y", "N"), outputs: tuple[str, ...] = tuple(MOTION)) -> None:
        self.felt: dict[str, float] = {}
        shown = [channel for channel in BOAT.outputs if channel.name in outputs]
        super().__init__(
            "twin",
            self.still,
            inputs=BOAT.inputs,
            outputs=shown,
            parameters=BOAT.parameters,
            kind="ship",
            ports={"force": force, "current": ["u_c", "v_c"]},
        )

    def still(self, trial: Trial, p: dict[str, float], first: Any, outside: Any) -> Mapping[str, Any]:
        self.felt = outside(1.0, MOTION)
        return {channel.name: np.full(len(trial), MOTION[channel.name]) for channel in self.outputs}


def accelerations(effect: Effect | None, values: Mapping[str, float]) -> np.ndarray:
    """Of the equations at `MOTION`, by an effect."""
    model = BOAT if effect is None else with_effects(BOAT, [effect])
    s = record("S", model.states)(**{c.name: MOTION[c.name] for c in model.states})
    i = record("I", model.inputs)(9.0, -6.0)
    p = record("P", model.parameters)(**{**model.nominal(), **values})
    return np.array(model.rhs(s, i, p, Environment(t=1.0)))


@pytest.mark.parametrize(
    "effect",
    [
        available()["thruster_gain"],
        available()["thruster_gain"].only("starboard"),
        available()["thruster_oblique_loss"],
        available()["thruster_hull_interaction"],
        available()["thruster_direction"].only("port"),
        available()["thrusters_exchanged"].only("port", "starboard"),
        available()["voltage_sag"],
        available()["battery_discharge"],
        available()["drag_increase"],
        available()["thrust_gain"],
        available()["wind"],
    ],
    ids=lambda effect: str(effect.name),
)
def test_an_effect_pushes_a_black_box_as_it_pushes_the_equations(effect: Effect) -> None:
    box = TwinBox()
    assert not effect.missing(box)
    values = {effect.named(key): value for key, value in effect.typical(BOAT).items()}
    model = with_effects(box, [effect])
    assert isinstance(model, ExtendedBlackBox)
    model.run(TRIAL, {**model.nominal(), **values}, None)
    s = record("S", BOAT.states)(**{c.name: MOTION[c.name] for c in BOAT.states})
    i, p = record("I", BOAT.inputs)(9.0, -6.0), record("P", BOAT.parameters)(**BOAT.nominal())
    ours = np.array(BOAT.rhs(s, i, p, Environment(t=1.0, **box.felt)))
    assert ours == pytest.approx(accelerations(effect, values), rel=1e-12, abs=1e-15)
    assert np.abs(ours - accelerations(None, {})).max() > 1e-6


@pytest.mark.parametrize(
    ("box", "effect", "message"),
    [
        (TwinBox(force=("X",)), "thruster_gain", "acts in yaw, and the black box has no port for N"),
        (TwinBox(force=("X", "N")), "thruster_direction", "acts in sway, and the black box has no port for Y"),
        (TwinBox(outputs=("psi", "r", "v")), "drag_increase", "drag of the black box needs 'u'"),
    ],
)
def test_what_a_black_box_cannot_give_is_refused(box: TwinBox, effect: str, message: str) -> None:
    found = available()[effect]
    assert message in found.missing(box)
    with pytest.raises(BadInput, match="cannot act"):
        with_effects(box, [found])


def test_what_cannot_be_computed_does_not_hinder_other_effects() -> None:
    box = TwinBox(outputs=("psi", "r", "v"))
    effect = available()["thruster_gain"]
    model = with_effects(box, [effect])
    assert isinstance(model, ExtendedBlackBox)
    model.run(TRIAL, {**model.nominal(), "thruster_gain_k": -0.3}, None)
    assert box.felt["X"] != 0.0
    assert box.felt["N"] != 0.0


def test_thrusters_can_be_sent_and_described() -> None:
    box = TwinBox()
    model = with_effects(box, [available()["thruster_gain"].only("port")])
    assert isinstance(model, ExtendedBlackBox)
    acting = model._acting({**model.nominal(), "thruster_gain_port_k": -0.5})
    law = OutsideEffects(box, acting, box.nominal(), T, np.array([[9.0, -6.0]] * 4), -1.0, None)
    there = pickle.loads(by_value(law))
    assert there(1.0, MOTION) == law(1.0, MOTION)
    assert there.describe() == law.describe()
    assert law(1.0, MOTION)["X"] == pytest.approx(-0.5 * box.nominal()["k_ahead"] * 81.0)


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [("thruster_dead_band", "band", 0.05), ("thruster_lag", "tau", 0.5), ("thruster_rate_limit", "slowness", 8.0)],
)
def test_named_thrusters_have_effects_on_their_orders(name: str, parameter: str, value: float) -> None:
    """A black box that names its thrusters and has no port: all alike, and one alone."""
    t = np.arange(0.0, 20.0, 0.1)
    inputs = {"n_port": 6.0 + 5.0 * np.sin(t), "n_starboard": 6.0 - 5.0 * np.sin(0.7 * t)}
    trial = Trial("run", t, inputs, {channel.name: np.zeros(t.size) for channel in BOAT.outputs})

    def sail(trial: Trial, p: Mapping[str, float], first: Mapping[str, float]) -> dict[str, Any]:
        start = np.array([[first[channel.name] for channel in BOAT.states]])
        y = simulator(BOAT, [trial], threads=1).outputs(np.zeros((1, 0)), start).y[0]
        return {channel.name: y[:, k] for k, channel in enumerate(BOAT.outputs)}

    thrusters = [
        Thruster(name, f"n_{name}", at=(-0.9, y, 0.2), towards=(1.0, 0.0, 0.0), full=FULL)
        for name, y in (("port", -0.395), ("starboard", 0.395))
    ]
    fields: dict[str, Any] = {"inputs": BOAT.inputs, "outputs": BOAT.outputs, "parameters": [], "states": BOAT.states}
    box = BlackBox("boat", sail, **fields, actuators=thrusters)
    assert "does not declare its thrusts" in available()["thruster_gain"].missing(
        BlackBox("boat", sail, **fields, actuators=thrusters, ports={"force": ["X", "Y", "N"]})
    )
    assert "names no thruster" in available()["thruster_dead_band"].missing(BlackBox("boat", sail, **fields))
    # A lag needs no place and no full power: any input that drives the boat may have one.
    assert not available()["thruster_lag"].missing(BlackBox("boat", sail, **fields))

    def run(model: Model, values: Mapping[str, float]) -> np.ndarray:
        sim = simulator(model, [trial], values={**model.nominal(), **values}, threads=1)
        return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])

    plain = run(BOAT, {})
    for effect in available()[name].variants(BOAT):
        values = {effect.named(parameter): value}
        ours, theirs = (run(with_effects(model, [effect]), values) for model in (BOAT, box))
        moved = np.abs(ours - plain).max(axis=0)
        assert (np.abs(ours - theirs).max(axis=0) < 0.006 * moved).all(), effect.name
        assert (moved > 1e-4).all()


def _drag_at(model: Model, drag: Any, speed: float, name: str = "u", **current: float) -> float:
    still = record("States", model.states)(*(0.0 for _ in model.states))
    undriven = record("Inputs", model.inputs)(*(0.0 for _ in model.inputs))
    p = record("Parameters", model.parameters)(**model.nominal())
    return float(drag(still._replace(**{name: speed}), undriven, p, Environment(**current)))


@pytest.mark.parametrize("name", ["bluerov2", "diving_plane_driven", "torpedo", "torpedo_324", "twin_thruster"])
def test_the_drag_that_follows_from_the_equations_is_the_declared_one(name: str) -> None:
    model = load_model(name)
    drag = straight_drag(model)
    for speed in (-1.0, 0.3, 2.0):
        declared = _drag_at(model, model.drag, speed)
        assert _drag_at(model, drag, speed) == pytest.approx(declared, rel=1e-9)
        # It is that of the motion through the water.
        assert _drag_at(model, drag, speed + 0.4, u_c=0.4) == pytest.approx(declared, rel=1e-9)


def test_more_drag_acts_on_a_model_that_declares_none() -> None:
    """A glider without `drag` took a fouled hull for a depth sensor 20 % off."""
    diver = Diver()
    assert diver.drag is None
    assert available()["drag_increase"].missing(diver) == ""
    t = np.arange(0.0, 40.0, 0.2)
    inputs = {"upper": np.full(t.size, 10.0), "lower": np.full(t.size, 10.0), "lift": np.zeros(t.size)}
    trial = Trial("run", t, inputs, {channel.name: np.zeros(t.size) for channel in diver.outputs})
    model = with_effects(diver, [available()["drag_increase"]])

    def speed(k: float) -> float:
        sim = simulator(model, [trial], values={**model.nominal(), "drag_increase_k": k}, threads=1)
        return float(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0][-1, 0])

    for k in (0.0, 0.3):
        # 20 N = (1 + k) X_u u (0.5 + u)
        assert speed(k) == pytest.approx(np.sqrt(0.0625 + 20.0 / (15.0 * (1.0 + k))) - 0.25, rel=1e-3)


def test_a_glider_lacks_no_declaration_of_a_propeller() -> None:
    glider, ship = load_model("glider"), load_model("abkowitz")
    assert glider.thrust is None
    assert available()["thrust_gain"].missing(glider) == "a glider has no propeller"
    assert available()["thrust_gain"].missing(ship) == "the model does not declare its thrust"


class _TwinScrew(Model):
    """A boat of two screws, whose forces its model gives."""

    name = "twin_screw"
    states = outputs = (Channel("u", "m/s"), Channel("r", "rad/s"))
    inputs = (Channel("n_ps", "rev/s"), Channel("n_sb", "rev/s"))
    parameters = (Parameter("m", 500.0, "kg"), Parameter("k", 2.0, "N s2"))
    actuators = (
        Thruster("port", "n_ps", at=(-2.0, -0.5, 0.0), towards=(1.0, 0.0, 0.0), full=20.0, diameter=0.3),
        Thruster("starboard", "n_sb", at=(-2.0, 0.5, 0.0), towards=(1.0, 0.0, 0.0), full=20.0, diameter=0.3),
    )

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> Any:
        return p.k * i.n_ps * abs(i.n_ps), p.k * i.n_sb * abs(i.n_sb)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> Any:
        port, starboard = _TwinScrew.thrusts(s, i, p, e)
        return (port + starboard - 50.0 * s.u + e.X) / p.m, 0.5 * (port - starboard) / p.m - s.r + e.N / p.m


def test_a_model_that_gives_its_thrusters_forces_is_not_asked_for_a_thrust() -> None:
    """The report said of a ship of two screws that its thrust was not declared, which it was, one by one."""
    ship, effects = _TwinScrew(), available()
    assert (
        effects["thrust_gain"].missing(ship)
        == "it is one propeller's, and the model's thrusters have effects of their own"
    )
    assert not effects["thruster_gain"].missing(ship)


class _Sled(Model):
    """Speed along an axis of its own."""

    name, kind = "sled", "auv"
    states = outputs = (Channel("back", "m/s"),)
    inputs = (Channel("n", "rev/s"),)
    parameters = (Parameter("m", 50.0, "kg"), Parameter("X_uu", 3.0, "kg/m"))
    standard: ClassVar[Mapping[str, tuple[str, int]]] = {"back": ("u", -1)}

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        u = -s.back - e.u_c
        return (-(i.n - p.X_uu * u * abs(u) + e.X) / p.m,)


def test_a_speed_astern_has_a_drag_against_it() -> None:
    sled = _Sled()
    drag = straight_drag(sled)
    assert _drag_at(sled, drag, -2.0, "back") == pytest.approx(12.0)
    assert _drag_at(sled, drag, 1.6, "back", u_c=0.4) == pytest.approx(-12.0)


class _Pushed(_Sled):
    name = "pushed"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        back = s.back + e.u_c
        return ((-70.0 - p.X_uu * back * abs(back) - e.X) / p.m,)


def test_a_thrust_that_no_input_changes_is_no_drag() -> None:
    """A boat whose engine is not recorded had no drag, and a fouled hull was not among what was tried."""
    sled = _Pushed()
    drag = straight_drag(sled)
    assert _drag_at(sled, drag, -2.0, "back") == pytest.approx(12.0)
    assert _drag_at(sled, drag, -2.4, "back", u_c=0.4) == pytest.approx(12.0)
    assert available()["drag_increase"].missing(sled) == ""


class _Deaf(Model):
    name, kind = "deaf", "auv"
    states = outputs = _Sled.states
    inputs, parameters, standard = _Sled.inputs, _Sled.parameters, _Sled.standard

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return (-p.X_uu * s.back / p.m,)


class _Divides(_Sled):
    name = "divides"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (-(1.0 / i.n - p.X_uu * s.back + e.X) / p.m,)


class _Grows(_Sled):
    name = "grows"

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return ((p.X_uu * s.back - e.X) / p.m,)


@pytest.mark.parametrize("kind", [_Deaf, _Divides, _Grows])
def test_no_drag_follows_where_no_force_acts_or_nothing_slows(kind: type[Model]) -> None:
    model = kind()
    assert straight_drag(model) is None
    assert available()["drag_increase"].missing(model) != ""
    assert straight_drag(TwinBox()) is None


class OneScrew(Model):
    """A ship that names its propeller, and so gives the force of a list of one thruster."""

    name = "one_screw"
    kind = "ship"
    states = outputs = (
        Channel("u", "m/s"), Channel("v", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad")
    )  # fmt: skip
    inputs = (Channel("delta", "rad"), Channel("n", "rev/s"))
    parameters = (Parameter("m", 5000.0, "kg"), Parameter("L", 12.0, "m"))
    actuators: tuple[Thruster, ...] = (Thruster("screw", "n", at=(-5.0, 0.0, 1.0), towards=(1.0, 0.0, 0.0), full=20.0),)

    @staticmethod
    def dimensions(p: Any) -> Dimensions:
        return Dimensions(p.L, 3.0, 1.0, p.m, 1025.0)

    @staticmethod
    def thrusts(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        return (i.n * (40.0 * i.n - 20.0 * (s.u - e.u_c)),)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        (T,) = OneScrew.thrusts(s, i, p, e)
        u, v = s.u - e.u_c, s.v - e.v_c
        return (
            (T - 300.0 * u * abs(u) + e.X) / p.m + e.du_c,
            (e.Y - 2000.0 * v) / p.m + e.dv_c,
            (e.N - 4000.0 * s.r - 800.0 * i.delta) / p.m,
            s.r,
        )


def test_the_only_screw_of_a_ship_has_the_side_force_of_a_propeller() -> None:
    """A ship whose screw was named as a thruster lost it; errors of the thrust are those of the named thruster."""
    model = OneScrew()
    thrust = role_of(model, "thrust")
    s = record("States", model.states)(2.0, 0.0, 0.0, 0.0)
    i, p = record("Inputs", model.inputs)(0.0, 10.0), record("Parameters", model.parameters)(5000.0, 12.0)
    assert thrust(s, i, p, Environment()) == 10.0 * (400.0 - 40.0)
    missing = {name: available()[name].missing(model) for name in ("propeller_walk", "thruster_gain")}
    assert missing == {"propeller_walk": "", "thruster_gain": ""}
    for name, instead in (("thrust_gain", "thruster_gain"), ("thrust_misalignment", "thruster_direction")):
        assert f"{instead!r} says the same" in available()[name].missing(model)
    walking = with_effects(model, [available()["propeller_walk"]])
    s, i = record("S", walking.states)(2.0, 0.0, 0.0, 0.0), record("I", walking.inputs)(0.0, 10.0)
    rates = [
        walking.rhs(
            s, i, record("P", walking.parameters)(**{**walking.nominal(), "propeller_walk_k": k}), Environment()
        )
        for k in (0.0, 0.1)
    ]
    assert rates[1][1] - rates[0][1] == pytest.approx(0.1 * 40.0 * 10.0**2 / 5000.0)


@pytest.mark.parametrize(
    "thruster",
    [
        Thruster("bow", "n", at=(5.0, 0.0, 1.0), towards=(1.0, 0.0, 0.0), full=20.0),
        Thruster("tunnel", "n", at=(-5.0, 0.0, 1.0), towards=(0.0, 1.0, 0.0), full=20.0),
        Thruster("port", "n", at=(-5.0, -1.0, 1.0), towards=(1.0, 0.0, 0.0), full=20.0),
        Thruster("pod", "n", at=(-5.0, 0.0, 1.0), towards=(1.0, 0.0, 0.0), full=20.0, turned_by="delta"),
    ],
)
def test_a_thruster_that_is_no_propeller_has_none(thruster: Thruster) -> None:
    class Other(OneScrew):
        actuators = (thruster,)

    assert available()["propeller_walk"].missing(Other())
