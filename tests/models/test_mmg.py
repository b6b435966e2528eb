"""The MMG ship against the check figures of its KVLCC2 set, which independent code computed."""

from __future__ import annotations

import math

import pytest
from motion import deg, modes, rates

from seatruth.errors import BadInput
from seatruth.manoeuvres import (
    CoastDown,
    Straight,
    TurningCircle,
    Zigzag,
    run_manoeuvre,
    self_propulsion,
    turning_circle_figures,
    zigzag_figures,
)
from seatruth.models.mmg import MMGShip
from seatruth.trials import Trial

U0, L, RATE = 1.179, 7.0, deg(15.8)
N0 = 11.8516


def sail(manoeuvre: TurningCircle | Zigzag, dt: float = 0.05) -> Trial:
    return run_manoeuvre(
        MMGShip(), manoeuvre, dt=dt, first_state={"u": U0}, inputs={"n": N0}, rudder_rate=RATE, limit=600
    )


def test_self_propulsion() -> None:
    n = self_propulsion(MMGShip(), U0)
    assert n == pytest.approx(11.85, abs=0.005)
    assert rates(MMGShip(), {"u": U0}, {"n": n})["u"] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("rudder", "advance", "transfer", "tactical", "steady", "ratio"),
    [
        (35, 3.08, 1.33, 3.12, 2.32, 0.38),
        (-35, 3.09, 1.33, 3.11, 2.26, 0.38),
        (20, 3.87, 1.90, 4.36, 3.73, 0.53),
        (-20, 3.74, 1.77, 4.05, 3.39, 0.52),
    ],
)
def test_turning_circles(
    rudder: float, advance: float, transfer: float, tactical: float, steady: float, ratio: float
) -> None:
    figures = turning_circle_figures(sail(TurningCircle(deg(rudder), deg(1080), approach=2)))
    assert not figures.why
    assert figures.rudder == pytest.approx(deg(rudder))
    assert figures.execute == pytest.approx(2.0, abs=1e-9)
    # Printed to two digits; the recording step of the check code adds up to 0.005 L.
    for found, printed in (
        (figures.advance, advance),
        (figures.transfer, transfer),
        (figures.tactical_diameter, tactical),
        (figures.steady_diameter, steady),
    ):
        assert found / L == pytest.approx(printed, abs=0.0075)
    assert figures.speed_ratio == pytest.approx(ratio, abs=0.005)


@pytest.mark.parametrize("rudder", [35, -35])
def test_drift_angle_in_the_turn(rudder: float) -> None:
    figures = turning_circle_figures(sail(TurningCircle(deg(rudder), deg(1080))))
    assert figures.drift_angle == pytest.approx(math.copysign(deg(19), rudder), abs=deg(0.5))


@pytest.mark.parametrize(
    ("angle", "first", "overshoots"),
    [
        (10, "starboard", (5.0, 13.6)),
        (10, "port", (7.0, 8.8)),
        (20, "starboard", (10.5, 15.7)),
        (20, "port", (13.7, 11.7)),
    ],
)
def test_zigzags(angle: float, first: str, overshoots: tuple[float, float]) -> None:
    figures = zigzag_figures(sail(Zigzag(deg(angle), deg(angle), first, approach=2)))
    assert figures.first == first
    found = (math.degrees(figures.first_overshoot), math.degrees(figures.second_overshoot))
    # Printed past the nominal heading, which the ship passes by up to r dt before the rudder is ordered over.
    assert found == pytest.approx(overshoots, abs=0.08)


def test_straight_course_is_slightly_unstable() -> None:
    largest, *others = modes(MMGShip(), {"u": U0}, {"n": N0}, ("u", "v", "r"))
    assert largest.real == pytest.approx(4.2e-4, abs=0.05e-4)
    assert all(mode.real < 0 for mode in others)


def test_positive_rudder_turns_to_starboard_and_pushes_the_stern_to_port() -> None:
    found = rates(MMGShip(), {"u": U0}, {"n": N0, "delta": deg(5)})
    assert found["r"] > 0
    assert found["v"] < 0


def test_rudder_works_in_the_slipstream_of_a_ship_at_rest_and_not_without() -> None:
    assert rates(MMGShip(), {}, {"n": N0, "delta": deg(20)})["r"] > 1e-4
    assert rates(MMGShip(), {}, {"delta": deg(20)})["r"] == 0.0


def test_starts_from_rest_and_reaches_service_speed() -> None:
    trial = run_manoeuvre(MMGShip(), Straight(400.0), dt=0.2, inputs={"n": N0})
    # A bare start without current stays on its course because the model is symmetric at zero rudder.
    assert trial.outputs["u"][-1] == pytest.approx(U0, abs=0.002)
    assert abs(trial.outputs["y"]).max() < 1e-9


def test_coast_down_loses_speed_ever_more_slowly() -> None:
    plan = CoastDown(200.0, approach=1.0)
    trial = run_manoeuvre(MMGShip(), plan, dt=0.2, first_state={"u": U0}, inputs={"n": N0}, limit=201)
    u = trial.outputs["u"][trial.t >= 1.2]
    assert (u > 0).all()
    assert (u[1:] < u[:-1]).all()
    # Quadratic resistance: 1/u grows linearly.
    inverse = 1 / u
    assert inverse[-1] - inverse[len(u) // 2] == pytest.approx(inverse[len(u) // 2] - inverse[0], rel=0.02)


def test_propeller_astern_stops_the_ship_and_drives_it_astern() -> None:
    plan = Straight(600.0)
    trial = run_manoeuvre(MMGShip(), plan, dt=0.2, first_state={"u": U0}, inputs={"n": -N0})
    assert trial.outputs["u"][-1] == pytest.approx(-U0, rel=0.02)


def test_rudder_reverses_its_effect_astern() -> None:
    assert rates(MMGShip(), {"u": -0.8}, {"delta": deg(10)})["r"] < 0


def test_surge_balance_astern_mirrors_ahead_without_rudder() -> None:
    ahead = rates(MMGShip(), {"u": 0.7}, {"n": 5.0})["u"]
    astern = rates(MMGShip(), {"u": -0.7}, {"n": -5.0})["u"]
    assert astern == pytest.approx(-ahead, rel=1e-12)


def test_thrust_is_the_published_polynomial() -> None:
    p = MMGShip().nominal()
    u, n = 0.9, 10.0
    J = u * (1 - p["w_P0"]) / (n * p["D_P"])
    K_T = p["k_0"] + p["k_1"] * J + p["k_2"] * J * J
    thrust = (1 - p["t_P"]) * p["rho"] * n**2 * p["D_P"] ** 4 * K_T
    resistance = 0.5 * p["rho"] * p["L"] * p["d"] * u * u * p["R_0"]
    mass = p["rho"] * p["nabla"] + 0.5 * p["rho"] * p["L"] ** 2 * p["d"] * p["m_x"]
    assert rates(MMGShip(), {"u": u}, {"n": n})["u"] == pytest.approx((thrust - resistance) / mass, rel=1e-9)


def test_water_density_cancels() -> None:
    state, inputs = {"u": 1.0, "v": -0.2, "r": 0.05}, {"n": N0, "delta": 0.2}
    salt, fresh = (rates(MMGShip(), state, inputs, {"rho": rho}) for rho in (1025.0, 1000.0))
    assert fresh == pytest.approx(salt, rel=1e-10)


def test_froude_scaling() -> None:
    """A ship ten times as long moves alike, times scaled by the root of ten: the parameters are non-dimensional."""
    k, nominal = 10.0, MMGShip().nominal()
    powers = {"L": 1, "B": 1, "d": 1, "nabla": 3, "x_G": 1, "D_P": 1, "H_R": 1, "A_R": 2}
    large = {name: value * k ** powers.get(name, 0) for name, value in nominal.items()}
    root = math.sqrt(k)
    small = rates(MMGShip(), {"u": 1.0, "v": -0.2, "r": 0.05}, {"n": N0, "delta": 0.2})
    scaled = rates(MMGShip(), {"u": root, "v": -0.2 * root, "r": 0.05 / root}, {"n": N0 / root, "delta": 0.2}, large)
    assert scaled["u"] == pytest.approx(small["u"], rel=1e-9)
    assert scaled["v"] == pytest.approx(small["v"], rel=1e-9)
    assert scaled["r"] * k == pytest.approx(small["r"], rel=1e-9)


def test_esso_osaka_turns_like_a_tanker() -> None:
    """Our estimate of this set is not a measurement; it must turn in the range of full tankers with their rudder."""
    model = MMGShip("ESSO_OSAKA")
    speed = 0.4
    n = self_propulsion(model, speed)
    assert 5 < n < 20
    plan = TurningCircle(deg(35), deg(720), approach=2)
    trial = run_manoeuvre(
        model, plan, dt=0.1, first_state={"u": speed}, inputs={"n": n}, rudder_rate=deg(20), limit=900
    )
    figures = turning_circle_figures(trial)
    assert 2.0 < figures.advance / 3.0 < 4.5
    assert 2.0 < figures.tactical_diameter / 3.0 < 4.5


def test_unknown_ship_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(BadInput, match="KVLCC2"):
        MMGShip("KVLCC1")


@pytest.mark.parametrize("ship", MMGShip.sets)
def test_parameters_are_within_their_bounds_and_say_their_source(ship: str) -> None:
    for parameter in MMGShip(ship).parameters:
        assert parameter.min <= parameter.value <= parameter.max, parameter.name
        assert parameter.source[:3] in ("[P]", "[R]", "[L]", "[S]"), parameter.name
