"""The glider against the check figures of its numerical sets, by independent code, and against the laws of motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest
from motion import balance, deg, modes, rates

from seatruth.effects import available as effects
from seatruth.effects import with_effects
from seatruth.errors import BadInput
from seatruth.manoeuvres import GlideSpiral, Sawtooth, Trim, run_manoeuvre, steady_current
from seatruth.manoeuvres.gliding import PUMP
from seatruth.models import Model
from seatruth.models.base import Environment
from seatruth.models.glider import Glider
from seatruth.models.glider_parameters import GLIDERS
from seatruth.testing.models import ModelConformance
from seatruth.trials import Trial

MOVING = ("u", "v", "w", "p", "q", "r", "phi", "theta")
DIVE, CLIMB = Trim(0.5, 0.402), Trim(-0.5, 0.403)


class TestGlider(ModelConformance):
    ranges: ClassVar[Mapping[str, tuple[float, float]]] = {"m_b": (-0.5, 0.5), "x_p": (0.37, 0.46)}

    @pytest.fixture(params=Glider.sets)
    def model(self, request: Any) -> Model:
        return Glider(request.param)


def steady(trim: Trim, rudder: float = 0.0, model: Model | None = None) -> dict[str, float]:
    """A steady glide: its state and speed V, incidence alpha, sideslip beta, sink rate, turning radius."""
    sign = math.copysign(1.0, trim.m_b)
    guess = {"u": 0.5, "w": 0.01 * sign, "theta": -0.5 * sign, "r": 0.1 * rudder, "phi": 0.1 * rudder}
    inputs = {"m_b": trim.m_b, "x_p": trim.x_p, "delta": rudder}
    model = model or Glider()
    state = balance(model, guess, inputs, MOVING)
    rate = rates(model, state, inputs)
    V = math.sqrt(sum(state[name] ** 2 for name in ("u", "v", "w")))
    found = {"V": V, "alpha": math.atan2(state["w"], state["u"]), "beta": math.asin(state["v"] / V), "sink": rate["z"]}
    turning = math.hypot(rate["x"], rate["y"]) / abs(rate["psi"]) if abs(rate["psi"]) > 1e-9 else math.inf
    return {**state, **found, "radius": turning, "psi_dot": rate["psi"]}


def sawtooth(environment: Any = None, halves: int = 4, **first: float) -> Trial:
    state = {"u": 0.57, "w": 0.017, "theta": deg(-29.0), "z": 8.0} | first
    plan = Sawtooth(DIVE, CLIMB, halves=halves)
    inputs = {"m_b": DIVE.m_b, "x_p": DIVE.x_p}
    return run_manoeuvre(Glider(), plan, dt=0.25, first_state=state, inputs=inputs, limit=4000, environment=environment)


SAWTOOTH = sawtooth()


@pytest.mark.parametrize(
    ("trim", "V", "theta", "alpha", "within"),
    [(DIVE, 0.579, -29.3, 1.67, 0.005), (CLIMB, 0.583, 29.7, None, None)],
)
def test_adopted_equilibria(trim: Trim, V: float, theta: float, alpha: float | None, within: float | None) -> None:
    found = steady(trim)
    assert found["V"] == pytest.approx(V, abs=0.0005)
    assert math.degrees(found["theta"]) == pytest.approx(theta, abs=0.05)
    if alpha is not None:
        assert math.degrees(found["alpha"]) == pytest.approx(alpha, abs=within)


def test_published_set_at_equilibrium() -> None:
    found = steady(Trim(0.3, 0.42), model=Glider("SEA_WING"))
    assert found["V"] == pytest.approx(0.46, abs=0.005)
    assert math.degrees(found["theta"]) == pytest.approx(-30.8, abs=0.05)
    assert math.degrees(found["alpha"]) == pytest.approx(1.6, abs=0.05)


@pytest.mark.parametrize(
    ("rudder", "radius", "sink", "roll"), [(10, 24.1, 0.30, 2.4), (20, 12.0, 0.32, 4.7), (30, 8.0, 0.36, 7.0)]
)
@pytest.mark.parametrize("side", [1, -1])
def test_spirals(rudder: float, radius: float, sink: float, roll: float, side: int) -> None:
    found = steady(DIVE, deg(side * rudder))
    # printed to one digit, the first rounded up from 24.05
    assert found["radius"] == pytest.approx(radius, abs=0.06)
    assert found["sink"] == pytest.approx(sink, abs=0.005)
    assert math.degrees(found["phi"]) * side == pytest.approx(roll, abs=0.06)
    assert found["psi_dot"] * side > 0


def test_all_modes_are_stable() -> None:
    state = {name: steady(DIVE)[name] for name in MOVING}
    found = modes(Glider(), state, {"m_b": DIVE.m_b, "x_p": DIVE.x_p}, MOVING)
    assert found[0].real == pytest.approx(-0.09, abs=0.005)


def turns(trial: Trial) -> list[int]:
    """Samples at which the depth turns."""
    change = np.diff(trial.outputs["z"])
    return (np.flatnonzero(change[1:] * change[:-1] < 0) + 1).tolist()


def test_sawtooth_inflections_half_cycle_and_advance() -> None:
    at = turns(SAWTOOTH)
    depth = SAWTOOTH.outputs["z"][at]
    assert depth[0::2] == pytest.approx([195.4] * len(depth[0::2]), abs=0.05)
    assert depth[1::2] == pytest.approx([2.6] * len(depth[1::2]), abs=0.05)
    # a climb and a dive: 668 and 676 s
    whole = SAWTOOTH.t[at[2]] - SAWTOOTH.t[at[0]]
    assert whole / 2 == pytest.approx(670.0, abs=5.0)
    advance = SAWTOOTH.outputs["x"][at[2]] - SAWTOOTH.outputs["x"][at[0]]
    assert advance / 2 == pytest.approx(326.0, abs=0.5)


def test_pitch_is_within_5_per_cent_of_its_new_value_after_a_minute() -> None:
    ordered = float(SAWTOOTH.t[np.flatnonzero(SAWTOOTH.outputs["z"] > 190.0)[0]])
    later = (SAWTOOTH.t > ordered) & (SAWTOOTH.t < ordered + 150.0)
    away = np.abs(np.degrees(SAWTOOTH.outputs["theta"][later]) / 29.66 - 1.0) > 0.05
    settled = float(SAWTOOTH.t[later][np.flatnonzero(away)[-1]]) - ordered
    assert settled == pytest.approx(60.0, abs=5.0)


class Launch(GlideSpiral):
    """From neutral, as fast as the pump can."""

    def helm(self) -> Any:
        return lambda t, y: {"m_b": min(self.trim.m_b, PUMP * t), "x_p": self.trim.x_p, "delta": 0.0}


@pytest.mark.parametrize(("x_p", "stalls"), [(0.385, True), (0.402, False)])
def test_from_rest_a_dive_stalls_below_390_mm(x_p: float, stalls: bool) -> None:
    """Too level, it falls on its belly and slides backwards: its incidence ends beyond a right angle."""
    plan = Launch(Trim(0.5, x_p), (0.0,))
    trial = run_manoeuvre(Glider(), plan, dt=0.25, inputs={"x_p": x_p}, limit=400.0)
    alpha = math.degrees(math.atan2(trial.outputs["w"][-1], trial.outputs["u"][-1]))
    assert (alpha > 90.0) is stalls
    # under way, coming down from a climb, it still glides there
    assert 0.0 < math.degrees(steady(Trim(0.5, x_p))["alpha"]) < 6.0


def test_pitch_is_very_sensitive_to_the_sliding_mass() -> None:
    ahead, behind = (steady(Trim(0.5, 0.402 + step)) for step in (0.005, -0.005))
    assert math.degrees(behind["theta"] - ahead["theta"]) == pytest.approx(10.0, abs=2.5)


def test_closed_form_of_the_steady_glide() -> None:
    """Along the path weight balances drag, across it lift: tan(glide angle) = -D/L, and the speed follows."""
    p, found = Glider().nominal(), steady(DIVE)
    drag = p["K_D0"] + p["K_D"] * found["alpha"] ** 2
    lift = p["K_L0"] + p["K_alpha"] * found["alpha"]
    glide = found["theta"] - found["alpha"]
    assert math.tan(glide) == pytest.approx(-drag / lift, rel=1e-9)
    heavy = (p["m_h"] + p["m_p"] + DIVE.m_b - p["m_disp"]) * p["g"]
    assert found["V"] ** 2 == pytest.approx(heavy * abs(math.sin(glide)) / drag, rel=1e-9)


def test_a_current_only_carries_the_glider() -> None:
    """Over ground the sawtooth drifts, in the water it is the same; effect and simulator agree on that."""
    current = steady_current(0.3, deg(60.0))
    north, east = 0.3 * math.cos(deg(60.0)), 0.3 * math.sin(deg(60.0))
    theta = deg(-29.0)
    start = {"u": 0.57 + north * math.cos(theta), "v": east, "w": 0.017 + north * math.sin(theta)}
    moved, still = sawtooth(current, halves=1, **start), sawtooth(halves=1)
    size = min(len(moved), len(still))
    drift = moved.t[:size] * north
    assert moved.outputs["z"][:size] == pytest.approx(still.outputs["z"][:size], abs=1e-6)
    assert moved.outputs["x"][:size] - drift == pytest.approx(still.outputs["x"][:size], abs=1e-6)
    model = with_effects(Glider(), [effects()["current"]])
    state, inputs = dict.fromkeys(MOVING, 0.1), {"m_b": 0.3, "x_p": 0.4, "delta": 0.2}
    by_effect = rates(model, state, inputs, {"current_north": north, "current_east": east})
    assert by_effect == pytest.approx(rates(Glider(), state, inputs, environment=current), rel=1e-12)


def test_without_weight_and_friction_kinetic_energy_stays() -> None:
    """The inertia matrix, found by unit forces, and the velocity terms of the momentum equations fit together."""
    model, rng = Glider(), np.random.default_rng(4)
    free = {q.name: 0.0 for q in model.parameters if q.name.startswith(("K_", "Y_delta"))} | {"g": 0.0}
    names, inputs = ("u", "v", "w", "p", "q", "r"), {"m_b": 0.3, "x_p": 0.4}
    forces = ("X", "Y", "Z", "K", "M", "N")

    def pushed(force: str) -> list[float]:
        found = rates(model, {}, inputs, free, lambda t, s: Environment(**{force: 1.0}))
        return [found[name] for name in names]

    inertia = np.linalg.inv(np.array([pushed(force) for force in forces]))
    assert inertia == pytest.approx(inertia.T, abs=1e-9)
    assert np.linalg.eigvalsh(inertia).min() > 0
    for _ in range(20):
        speed = rng.uniform(-0.5, 0.5, 6)
        rate = rates(model, dict(zip(names, speed.tolist())), inputs, free)
        power = speed @ inertia @ np.array([rate[name] for name in names])
        assert power == pytest.approx(0.0, abs=1e-12 * float(np.linalg.norm(inertia)))


def test_positive_rudder_turns_to_starboard_and_glide_spiral_orders_it() -> None:
    plan = GlideSpiral(DIVE, (deg(10), deg(-10)), hold=100.0, approach=20.0)
    first = {"u": 0.579, "w": 0.017, "theta": deg(-29.3)}
    trial = run_manoeuvre(Glider(), plan, dt=0.25, first_state=first, inputs={"m_b": 0.5, "x_p": 0.402})
    turning = np.gradient(trial.outputs["psi"], trial.t)
    at = {t: float(np.interp(t, trial.t, turning)) for t in (15.0, 110.0, 210.0)}
    assert abs(at[15.0]) < 1e-9
    assert at[110.0] == pytest.approx(0.02073, rel=0.02)
    assert at[210.0] == pytest.approx(-0.02073, rel=0.02)
    assert trial.duration == pytest.approx(220.0)


def test_sawtooth_steers_to_headings() -> None:
    plan = Sawtooth(DIVE, CLIMB, deep=40.0, halves=2, headings=(deg(30.0), deg(-60.0)))
    first = {"u": 0.579, "w": 0.017, "theta": deg(-29.3), "z": 8.0}
    trial = run_manoeuvre(Glider(), plan, dt=0.25, first_state=first, inputs={"m_b": 0.5, "x_p": 0.402})
    psi = np.degrees(trial.outputs["psi"])
    at = np.flatnonzero(trial.outputs["z"] > 40.0)[0]
    assert psi[at] == pytest.approx(30.0, abs=5.0)
    assert psi[-1] == pytest.approx(-60.0, abs=5.0)
    assert np.abs(np.diff(trial.inputs["m_b"])).max() <= 0.02 * 0.25 + 1e-12
    assert np.abs(np.diff(trial.inputs["x_p"])).max() <= 0.002 * 0.25 + 1e-12


def test_wrong_plans_and_sets_are_refused() -> None:
    with pytest.raises(BadInput, match="no height"):
        Sawtooth(DIVE, CLIMB, deep=5.0, shallow=8.0)
    with pytest.raises(BadInput, match="glides"):
        Sawtooth(DIVE, CLIMB, halves=0)
    with pytest.raises(BadInput, match="rudder angles"):
        GlideSpiral(DIVE, ())
    with pytest.raises(BadInput, match="PETREL_II"):
        Glider("PETREL")


@pytest.mark.parametrize("glider", Glider.sets)
def test_parameters_are_within_their_bounds_and_say_their_source(glider: str) -> None:
    for parameter in GLIDERS[glider]:
        assert parameter.min <= parameter.value <= parameter.max, parameter.name
        assert parameter.source[:3] in ("[P]", "[R]", "[L]", "[S]"), parameter.name
