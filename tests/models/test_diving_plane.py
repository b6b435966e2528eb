"""The diving plane against the check figures of the NPS AUV II set, which independent code computed."""

from __future__ import annotations

import numpy as np
import pytest
from motion import balance, deg, modes, rates

from seatruth.manoeuvres import PitchZigzag, Straight, run_manoeuvre, zigzag_figures
from seatruth.models.diving_plane import DivingPlane
from seatruth.trials import Trial


def zigzag(u: float = 0.0, *, plane: float = 5.0, pitch: float = 5.0, limit: float = 120.0) -> Trial:
    plan = PitchZigzag(deg(plane), deg(pitch))
    first = {"u": u, "z": 100.0}
    return run_manoeuvre(DivingPlane(), plan, dt=0.5, first_state=first, rudder_rate=deg(2.5), limit=limit)


def crossings(trial: Trial) -> list[float]:
    """Times of the samples before the pitch angle changes its sign."""
    theta = trial.outputs["theta"]
    return [float(trial.t[k]) for k in np.flatnonzero(theta[1:] * theta[:-1] < 0)]


def test_steady_speed() -> None:
    """Drag and thrust in balance; the small trim of Z_0 does not matter to the printed digits."""
    steady = balance(DivingPlane(), {"u": 1.4}, {}, ("u",))
    assert steady["u"] == pytest.approx(1.471, abs=0.0005)


def test_speed_of_the_zigzag_from_rest() -> None:
    assert zigzag().outputs["u"][-1] == pytest.approx(1.353, abs=0.001)


def test_modes() -> None:
    """Heave and pitch at the steady speed, the slow pitch mode of the restoring moment, and surge."""
    found = modes(DivingPlane(), {"u": 1.471}, {}, ("u", "w", "q", "theta"))
    assert found.real == pytest.approx([-0.027, -0.059, -0.516, -0.516], abs=0.0006)
    assert sorted(found.imag) == pytest.approx([-0.170, 0.0, 0.0, 0.170], abs=0.0006)


def test_zigzag_from_rest() -> None:
    trial = zigzag()
    theta, depth = np.degrees(trial.outputs["theta"]), trial.outputs["z"]
    assert theta.min() == pytest.approx(-5.9, abs=0.05)
    assert theta.max() == pytest.approx(5.7, abs=0.05)
    assert np.abs(trial.outputs["w"]).max() == pytest.approx(0.018, abs=0.0005)
    assert np.degrees(np.abs(trial.outputs["q"]).max()) == pytest.approx(1.05, abs=0.005)
    assert depth.min() == pytest.approx(99.9, abs=0.05)
    assert depth.max() == pytest.approx(101.3, abs=0.05)


def test_zigzag_pitch_zero_crossings() -> None:
    found = crossings(zigzag())
    assert found == pytest.approx([64.0, 85.5, 103.5], abs=0.01)
    assert 2 * (found[2] - found[0]) / 2 == pytest.approx(40.0, abs=1.0)


def test_zigzag_period_at_steady_speed() -> None:
    found = crossings(zigzag(1.471, limit=300.0))
    periods = np.array(found[2:]) - np.array(found[:-2])
    assert periods.mean() == pytest.approx(31.0, abs=1.0)


def test_figures_of_the_pitch_zigzag() -> None:
    figures = zigzag_figures(zigzag(limit=300.0))
    assert figures.first == "down"
    assert np.degrees(figures.rudder) == pytest.approx(5.0, abs=0.01)
    # The plane takes 4 s from side to side, at the peak pitch rate of 1.05 deg/s for at most half of it.
    assert all(0.2 < np.degrees(x) < 2.0 for x in figures.overshoots)


def test_positive_plane_pitches_the_nose_down_and_dives() -> None:
    trial = run_manoeuvre(
        DivingPlane(), _plane_step(), dt=0.5, first_state={"u": 1.471}, inputs={"delta_s": deg(5)}, limit=60
    )
    assert trial.outputs["theta"][-1] < -deg(3)
    assert trial.outputs["z"][-1] > 1.0


def _plane_step() -> Straight:
    return Straight(60.0)


def test_kinematics() -> None:
    found = rates(DivingPlane(), {"u": 1.2, "w": 0.3, "theta": 0.2, "q": 0.1}, {})
    assert found["theta"] == 0.1
    assert found["x"] ** 2 + found["z"] ** 2 == pytest.approx(1.2**2 + 0.3**2)
    assert found["z"] == pytest.approx(0.3 * np.cos(0.2) - 1.2 * np.sin(0.2))


def test_buoyancy_rights_the_vehicle_at_rest() -> None:
    found = rates(DivingPlane(), {"theta": 0.1}, {})
    assert found["q"] < 0
    assert rates(DivingPlane(), {"theta": -0.1}, {})["q"] == pytest.approx(-found["q"])
