"""The Abkowitz ship against the check figures of the Mariner set, which independent code computed."""

from __future__ import annotations

import math
from typing import Any

import pytest
from motion import balance, deg, modes, rates

from seatruth.manoeuvres import Straight, TurningCircle, Zigzag, run_manoeuvre, turning_circle_figures, zigzag_figures
from seatruth.models.abkowitz import AbkowitzShip

U0, L, RATE = 7.7175, 160.93, deg(5.0)


@pytest.mark.parametrize(
    ("rudder", "advance", "transfer", "tactical", "steady"),
    [
        (35, 3.54, 2.61, 6.40, 6.91),
        (-35, 3.71, 2.73, 6.65, 7.15),
        (20, 4.19, 3.07, 7.21, 7.62),
        (-20, 4.48, 3.28, 7.63, 8.02),
        (15, 4.68, 3.44, 7.91, 8.27),
        (-15, 5.09, 3.74, 8.52, 8.84),
        (10, 5.52, 4.08, 9.15, 9.42),
        (-10, 6.25, 4.61, 10.21, 10.42),
    ],
)
def test_turning_circles(rudder: float, advance: float, transfer: float, tactical: float, steady: float) -> None:
    plan = TurningCircle(deg(rudder), deg(900), approach=0)
    trial = run_manoeuvre(AbkowitzShip(), plan, dt=0.5, first_state={"u": U0}, rudder_rate=RATE, limit=4000)
    figures = turning_circle_figures(trial)
    assert not figures.why
    # The check code took the first sample past 90 deg, which lengthens the advance by up to 0.014 L here.
    assert figures.advance / L == pytest.approx(advance - 0.004, abs=0.011)
    assert figures.transfer / L == pytest.approx(transfer, abs=0.0075)
    assert figures.tactical_diameter / L == pytest.approx(tactical, abs=0.0075)
    assert figures.steady_diameter / L == pytest.approx(steady, abs=0.0075)


@pytest.mark.parametrize(("rudder", "ratio"), [(35, 0.78), (20, 0.83), (15, 0.85), (10, 0.89)])
def test_speed_in_the_turn(rudder: float, ratio: float) -> None:
    """The printed ratio is one figure for both sides, so it is compared with their mean."""
    found = []
    for side in (1, -1):
        inputs = {"delta": deg(rudder * side)}
        steady = balance(AbkowitzShip(), {"u": 6.0, "v": -0.5 * side, "r": 0.01 * side}, inputs, ("u", "v", "r"))
        found.append(math.hypot(steady["u"], steady["v"]) / U0)
    assert sum(found) / 2 == pytest.approx(ratio, abs=0.0051)


@pytest.mark.parametrize(
    ("angle", "first", "overshoots"),
    [
        (10, "starboard", (5.0, 4.5)),
        (10, "port", (3.5, 6.2)),
        (20, "starboard", (7.8, 6.4)),
        (20, "port", (6.8, 7.3)),
    ],
)
def test_zigzags(angle: float, first: str, overshoots: tuple[float, float]) -> None:
    plan = Zigzag(deg(angle), deg(angle), first, approach=0)
    trial = run_manoeuvre(AbkowitzShip(), plan, dt=0.2, first_state={"u": U0}, rudder_rate=RATE)
    figures = zigzag_figures(trial)
    found = (math.degrees(figures.first_overshoot), math.degrees(figures.second_overshoot))
    # Printed past the nominal heading, with the switch up to a step late (0.35 deg/s); here past the heading at the
    # switch itself.
    assert found == pytest.approx(overshoots, abs=0.15)


def test_straight_course_modes() -> None:
    found = modes(AbkowitzShip(), {"u": U0}, {}, ("u", "v", "r"))
    assert [mode.real for mode in found] == pytest.approx([-0.0085, -0.0105, -0.129], rel=0.01)


def test_zero_rudder_turns() -> None:
    steady = balance(AbkowitzShip(), {"u": U0}, {}, ("u", "v", "r"))
    assert abs(math.degrees(steady["r"])) == pytest.approx(0.17, abs=0.005)


def test_neutral_rudder() -> None:
    """With r = 0 the rudder and the drift that balance the single screw are solved for."""
    from scipy.optimize import root

    def residual(x: Any) -> Any:
        found = rates(AbkowitzShip(), {"u": U0, "v": x[0]}, {"delta": x[1]})
        return found["v"], found["r"]

    solved = root(residual, (0.0, 0.0), tol=1e-14)
    assert math.degrees(solved.x[1]) == pytest.approx(-1.11, abs=0.005)


def test_positive_rudder_turns_to_starboard() -> None:
    assert rates(AbkowitzShip(), {"u": U0}, {"delta": deg(10)})["r"] > 0
    assert rates(AbkowitzShip(), {"u": U0}, {"delta": deg(-10)})["r"] < 0


def test_it_returns_to_service_speed() -> None:
    trial = run_manoeuvre(
        AbkowitzShip(), Straight(2000.0, rudder=deg(-1.11)), dt=1.0, first_state={"u": 0.9 * U0}, limit=2000
    )
    assert trial.outputs["u"][-1] == pytest.approx(U0, rel=0.005)


def test_force_moves_the_mass() -> None:
    """An outside force accelerates the mass with its added mass; the series does not change it."""
    from seatruth.models.base import Environment

    model, p = AbkowitzShip(), AbkowitzShip().nominal()
    force = 1e5
    plain = rates(model, {"u": U0}, {})
    pushed = rates(model, {"u": U0}, {}, environment=lambda t, s: Environment(X=force))
    mass = 0.5 * p["rho"] * p["L"] ** 3 * (p["m"] - p["X_du"])
    assert (pushed["u"] - plain["u"]) * mass == pytest.approx(force, rel=1e-9)
