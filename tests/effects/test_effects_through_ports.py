"""Forces and currents through the ports of a simulator: what they do there is what they do in the equations."""

from __future__ import annotations

import math
import pickle
import sys
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from fmu_ships import PORTS, ship_fmu, zigzag

from seatruth import load_model, simulator
from seatruth.effects import available, load_effects, with_effects
from seatruth.effects.black_box import ExtendedBlackBox
from seatruth.effects.kinematics import to_body_axes
from seatruth.effects.through_ports import OutsideEffects, at_ports
from seatruth.effects.vehicle import dimensions_of
from seatruth.errors import BadInput
from seatruth.models import FMU, BlackBox, Environment, Model, Observation, Ports, Thruster, load_fmu
from seatruth.models.measures import Motion
from seatruth.models.observed import observed
from seatruth.trials import Channel, Trial
from seatruth.workers import by_value

INSIDE = ["wind", "current", "cross_flow", "turning_loss", "munk", "wave_drift", "tether", "bank"]


def ship(**options: Any) -> FMU:
    equations = load_model("mmg")
    return load_fmu(ship_fmu(), **{"ports": PORTS, "kind": "ship", "dimensions": dimensions_of(equations), **options})


def run(model: Model, trial: Trial, values: dict[str, float]) -> np.ndarray:
    sim = simulator(model, [trial], values={**model.nominal(), **values}, threads=1)
    return np.asarray(sim.outputs(np.zeros((1, 0)), sim.initial_states).y[0])


def test_effects_act_inside_as_they_do_in_equations() -> None:
    equations, box, trial = load_model("mmg"), ship(), zigzag()
    plain = run(equations, trial, {})
    held = np.abs(run(box, trial, {}) - plain).max(axis=0)  # what holding the inputs over a step changes
    for name in INSIDE:
        (effect,) = load_effects([name])
        values = {effect.named(key): value for key, value in effect.typical(equations).items()}
        ours, theirs = (run(with_effects(model, [effect]), trial, values) for model in (equations, box))
        moved = np.abs(ours - plain).max(axis=0)
        assert (np.abs(ours - theirs).max(axis=0) < 0.03 * moved + 2.0 * held + 1e-9).all(), name
        assert moved.max() > 1e-3


def test_a_current_carries_a_simulator_without_a_port_for_one() -> None:
    """As it carries the equations: the vehicle starts with its speed over ground, and drifts."""
    equations, box, trial = load_model("mmg"), ship(ports={}, inputs=["delta", "n"]), zigzag()
    (effect,) = load_effects(["current"])
    values = {effect.named(key): value for key, value in effect.typical(equations).items()}
    plain = run(equations, trial, {})
    held = np.abs(run(box, trial, {}) - plain).max(axis=0)
    ours, theirs = (run(with_effects(model, [effect]), trial, values) for model in (equations, box))
    moved = np.abs(ours - plain).max(axis=0)
    assert (np.abs(ours - theirs).max(axis=0) < 0.03 * moved + 2.0 * held + 1e-9).all()
    assert moved.max() > 1.0
    (form,) = effect.variants(box)
    assert form.cause == "environment"  # no wind can be tried: leeway would look the same


def test_a_run_that_diverges_in_a_current_is_not_a_number() -> None:
    def away(trial: Trial, p: dict[str, float], first: dict[str, float] | None) -> dict[str, np.ndarray]:
        return {name: np.full(len(trial), np.inf) for name in ("u", "r", "psi")}

    outputs = [Channel("u", "m/s"), Channel("r", "rad/s"), Channel("psi", "rad", angle=True)]
    box = BlackBox("away", away, inputs=[], outputs=outputs, parameters=[])
    model = with_effects(box, load_effects(["current"]))
    trial = Trial("run", [0.0, 1.0], {}, {"u": [1.0, 1.0], "r": [0.0, 0.0], "psi": [0.0, 0.0]})
    assert isinstance(model, BlackBox)
    assert np.isnan(model.run(trial, {**model.nominal(), "current_north": 0.2}, None)).all()


def test_a_current_is_not_added_to_a_speed_over_ground() -> None:
    fields: dict[str, Any] = {"inputs": [], "parameters": []}
    names = {"u": "m/s", "r": "rad/s", "psi": "rad", "sog": "m/s"}
    box = BlackBox("box", print, outputs=[Channel(name, unit) for name, unit in names.items()], **fields)
    assert "it shows 'sog'" in available()["current"].missing(box)


def test_parameters_of_a_simulator_are_changed_too() -> None:
    equations, box, trial = load_model("mmg"), ship(), zigzag()
    (effect,) = load_effects(["added_mass"])
    values = {effect.named(key): value for key, value in effect.typical(equations).items()}
    ours, theirs = (run(with_effects(model, [effect]), trial, values) for model in (equations, box))
    assert np.abs(ours - theirs).max() < 0.02
    assert np.abs(ours - run(equations, trial, {})).max() > 0.05


def test_two_effects_and_an_order_of_a_slow_rudder() -> None:
    equations, box, trial = load_model("mmg"), ship(), zigzag()
    effects = load_effects(["current", "rudder_offset", "speed_bias"])
    values = {"current_north": 0.1, "current_east": -0.2, "rudder_offset_angle": 0.05, "speed_bias_bias": 0.02}
    names = {q.name for effect in effects for q in effect.null_parameters()}
    values = {name: value for name, value in values.items() if name in names}
    ours, theirs = (run(with_effects(model, effects), trial, values) for model in (equations, box))
    assert np.abs(ours - theirs).max(axis=0) == pytest.approx(0.0, abs=0.03)


@pytest.mark.parametrize(
    ("options", "effect", "message"),
    [
        ({"ports": {}}, "wind", "without a port for forces"),
        ({"ports": {}, "inputs": ["delta", "n"], "outputs": ["u", "v"]}, "current", "no state 'psi'"),
        ({"ports": {"force": ["X", "N"]}, "inputs": ["delta", "n"]}, "wind", "no port for Y"),
        (
            {"ports": {"current": ["north", "east"]}, "inputs": ["delta", "n"], "outputs": ["u", "v", "r"]},
            "current",
            "psi",
        ),
        ({"dimensions": None}, "wind", "dimensions"),
        ({}, "sloshing", "states of its own"),
        ({}, "drag_increase", "drag"),
    ],
)
def test_what_cannot_act_says_why(options: dict[str, Any], effect: str, message: str) -> None:
    found = available()[effect]
    model = ship(**{"inputs": ["delta", "n"], **options})
    assert message in found.missing(model)
    with pytest.raises(BadInput, match="cannot act"):
        with_effects(model, [found])


def test_a_current_in_earth_axes() -> None:
    ports = Ports(current=("north", "east", "down"))
    body = Environment(u_c=0.3, v_c=-0.2, w_c=0.1)
    attitude = Motion(phi=0.2, theta=-0.3, psi=2.0)
    found = at_ports(ports, body, attitude)
    assert sum(value**2 for value in found.values()) == pytest.approx(0.3**2 + 0.2**2 + 0.1**2)

    class Angles:
        phi, theta, psi = 0.2, -0.3, 2.0

    x, y, z = to_body_axes(found["north"], found["east"], Angles())
    down = found["down"]
    phi, theta = 0.2, -0.3
    whole = (
        x - down * math.sin(theta),
        y + down * math.cos(theta) * math.sin(phi),
        z + down * math.cos(theta) * math.cos(phi),
    )
    assert whole == pytest.approx((0.3, -0.2, 0.1))
    assert at_ports(Ports(current=("u_c",)), body, attitude) == {"u_c": 0.3}
    for given in (ports, Ports(current=("u_c", "v_c", "w_c"))):
        assert tuple(given.water(at_ports(given, body, attitude), attitude)) == pytest.approx((0.3, -0.2, 0.1))


def test_a_heading_of_another_name_and_sign_turns_the_current_as_well() -> None:
    class Reversed(BlackBox):
        standard: Mapping[str, tuple[str, int]] = MappingProxyType({"heading": ("psi", -1)})

    (effect,) = load_effects(["current"])
    q = namedtuple("Effect", ["north", "east"])(0.3, 0.0)
    outputs = [Channel("u", "m/s"), Channel("v", "m/s"), Channel("heading", "rad", angle=True)]
    ports = {"current": ["north", "east"]}
    box = Reversed("reversed", print, inputs=[], outputs=outputs, parameters=[], ports=ports)
    law = OutsideEffects(box, [(effect, None, q)], {}, np.arange(3.0), np.zeros((3, 0)), -1.0, None)
    found = law(1.0, {"u": 1.0, "v": 0.0, "heading": 0.8})
    assert (found["north"], found["east"]) == pytest.approx((0.3, 0.0))


def test_what_acts_can_be_sent_and_described() -> None:
    box = ship()
    (effect,) = load_effects(["wind"])
    extended = with_effects(box, [effect])
    assert isinstance(extended, ExtendedBlackBox)
    values = effect.typical(box)
    q = namedtuple("Effect", list(values))(**values)
    trial = zigzag(samples=5)
    law = OutsideEffects(box, [(effect, None, q)], box.nominal(), trial.t, np.zeros((5, 2)), -1.0, None)
    still = {"x": 0.0, "y": 0.0, "psi": 0.3, "u": 0.8, "v": 0.0, "r": 0.0}
    there = pickle.loads(by_value(law))
    assert there(1.0, still) == law(1.0, still)
    assert there.describe() == law.describe()
    assert law(1.0, still)["Y"] != 0.0
    assert law(1.0, {**still, "u": math.nan}) == dict.fromkeys(PORTS["force"] + PORTS["current"], 0.0)


def test_an_effect_that_changed_is_described_otherwise(tmp_path: Path) -> None:
    """A kept run of another effect of the same name would be taken for its own."""

    def described(kind: type[Any]) -> str:
        effect = load_effects(["wind"])[0]
        effect.__class__ = kind
        values = effect.typical(ship())
        law = OutsideEffects(
            *(ship(), [(effect, None, namedtuple("Effect", list(values))(**values))], ship().nominal()),
            *(np.arange(5.0), np.zeros((5, 2)), -1.0, None),
        )
        return str(law.describe()[1])

    parent = type(load_effects(["wind"])[0])
    typed = []
    for _ in range(2):
        space: dict[str, Any] = {"Wind": parent, "__name__": "typed"}
        exec("class Own(Wind): pass", space)
        typed.append(space["Own"])
    assert described(typed[0]) == described(typed[0]) != described(typed[1])
    file = tmp_path / "own_wind.py"
    seen = []
    for text in ("", "", "# another"):
        file.write_text(f"from seatruth.effects.weather import Wind\nclass Own(Wind): pass\n{text}\n")
        seen.append(described(loaded(file).Own))
    assert seen[0] == seen[1] != seen[2]


def loaded(file: Path) -> Any:
    """The module of a file, loaded anew."""
    spec = spec_from_file_location(file.stem, file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[file.stem] = module  # where a class looks for its file
    spec.loader.exec_module(module)
    return module


def test_ports_behind_what_instruments_measure() -> None:
    equations, trial = load_model("mmg"), zigzag(sog=np.full(60, 0.8))
    (effect,) = load_effects(["wind"])
    seen = [with_effects(observed(model, [Observation("sog")]), [effect]) for model in (equations, ship())]
    values = {effect.named(key): value for key, value in effect.typical(equations).items()}
    ours, theirs = (run(model, trial, values)[:, -1] for model in seen)
    assert np.abs(ours - theirs).max() < 0.001
    assert np.abs(ours - run(observed(equations, [Observation("sog")]), trial, {})[:, -1]).max() > 0.005


def propeller(**more: Any) -> Thruster:
    return Thruster("propeller", "n", at=(-1.0, 0.0, 0.2), towards=(1.0, 0.0, 0.0), full=20.0, **more)


def test_a_loss_of_thrust_acts_on_the_force_that_an_fmu_shows() -> None:
    """As on the thrust of the same equations; the FMU gives it in kN."""
    shown = {"names": {"T": "thrust"}, "actuators": [propeller(force="T")]}
    box, trial = ship(**shown), zigzag()
    extended = with_effects(box, load_effects(["thruster_gain"], model=box))
    assert isinstance(extended, ExtendedBlackBox)
    ours = run(extended, trial, {"thruster_gain_k": -0.2})
    same = with_effects(load_model("mmg"), load_effects(["thrust_gain"]))
    (lost,) = (q.name for q in same.parameters if q.name.startswith("thrust_gain"))
    theirs, plain = run(same, trial, {lost: -0.2}), run(same, trial, {})
    columns = [[c.name for c in box.outputs].index(c.name) for c in same.outputs]
    moved = np.abs(theirs - plain).max(axis=0)
    held = np.abs(run(box, trial, {})[:, columns] - plain).max(axis=0)
    assert moved[3] > 0.01
    assert (np.abs(ours[:, columns] - theirs).max(axis=0) < 0.03 * moved + 2.0 * held + 1e-9).all()
    acting = extended._acting({"thruster_gain_k": -0.2})
    laws = [
        OutsideEffects(one, acting, one.nominal(), trial.t, np.zeros((60, 2)), -1.0, None).describe()
        for one in (box, ship(**shown), ship(names={"F": "thrust"}, actuators=[propeller(force="F")]))
    ]
    assert laws[0] == laws[1] != laws[2]


@pytest.mark.parametrize(
    ("actuators", "message"),
    [
        ([propeller(force="nowhere")], "'nowhere', which is no output"),
        ([propeller(force="u")], "in 'm/s', not in N"),
        (
            [propeller(force="T"), replace(propeller(), name="other")],
            "'propeller' shows its force and 'other' does not",
        ),
    ],
)
def test_a_force_that_no_output_is_says_so(actuators: list[Thruster], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        ship(names={"T": "thrust"}, actuators=actuators)


def test_what_a_log_shows_in_a_current_that_a_simulator_takes() -> None:
    """The current comes through the port, and the speed through the water is that over ground without it."""
    log = [Observation("u_w"), Observation("v_w", at=(2.0, 0.0, 0.0))]
    equations, box = (observed(model, log, keep=["u", "v"]) for model in (load_model("mmg"), ship()))
    trial = zigzag(u_w=np.full(60, 0.8), v_w=np.zeros(60))
    values = {"current_north": 0.1, "current_east": -0.2}
    ours, theirs = (run(with_effects(model, load_effects(["current"])), trial, values) for model in (equations, box))
    places = [[channel.name for channel in model.outputs].index for model in (equations, box)]
    for name in ("u_w", "v_w"):
        shown, wanted = theirs[:, places[1](name)], ours[:, places[0](name)]
        assert np.abs(shown - wanted).max() < 0.02
    over_ground = theirs[:, places[1]("u")] - theirs[:, places[1]("u_w")]
    psi = theirs[:, places[1]("psi")]
    assert over_ground == pytest.approx(0.1 * np.cos(psi) - 0.2 * np.sin(psi), abs=1e-9)
    assert np.ptp(over_ground) > 0.05
    still = run(box, trial, {})
    assert still[:, places[1]("u_w")] == pytest.approx(still[:, places[1]("u")])
