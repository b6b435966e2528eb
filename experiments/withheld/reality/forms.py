"""Other forms of the hull, the damping and the wake: what a model's structure lacks and no single effect describes.

Each is the difference between the form that the vehicle has and the one that its model has, times a size `k`. Where the
model's own coefficients can imitate part of it, a refit takes that part up, and only the rest can be seen.
Magnitudes [S].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from withheld.reality.hulls import STATIONS, WEIGHTS
from withheld.reality.kvlcc2 import inflow
from withheld.reality.mechanism import Mechanism, fixed
from withheld.reality.motion import Force, Values, View


def cubic_damping(view: View, q: Values, p: Values) -> Force:
    """Damping across and in turning with the third power, where the model has the second; equal at a drift `at` rad."""
    speed = p["speed"]
    v, turning = view.v_r / speed, view.r * p["L"] / speed
    unit = 0.5 * p["rho"] * p["L"] * p["d"] * speed**2
    across = v * v * v / q["at"] - v * np.abs(v)
    around = turning * turning * turning / q["at"] - turning * np.abs(turning)
    return Force(Y=-q["k"] * unit * across, N=-0.1 * q["k"] * unit * p["L"] * around)


def linear_damping(view: View, q: Values, p: Values) -> Force:
    """Damping across and in turning that goes with the speed itself, not with its product with the forward speed."""
    speed = p["speed"]
    v, turning = view.v_r / speed, view.r * p["L"] / speed
    ahead = view.u_r / speed
    unit = 0.5 * p["rho"] * p["L"] * p["d"] * speed**2 * (1 - ahead)
    return Force(Y=-q["k"] * unit * v, N=-0.15 * q["k"] * unit * p["L"] * turning)


def full_bow(view: View, q: Values, p: Values) -> Force:
    """Cross-flow drag summed over sections that resist more at the bow and less at the stern, by the same amount."""
    along = 0.5 * p["L"] * STATIONS[:, None]
    across = view.v_r + p["lever"] * along * view.r
    each = -0.5 * p["rho"] * q["k"] * p["d"] * STATIONS[:, None] * np.abs(across) * across
    each = each * (0.5 * p["L"] * WEIGHTS[:, None])
    return Force(Y=each.sum(axis=0), N=(p["lever"] * along * each).sum(axis=0))


def steep_resistance(view: View, q: Values, p: Values) -> Force:
    """Resistance that grows with the fourth power of the speed, equal to the model's quadratic one at service speed."""
    ahead = view.u_r / p["speed"]
    square = ahead * ahead
    unit = 0.5 * p["rho"] * p["drag_area"] * p["speed"] ** 2
    return Force(X=-q["k"] * unit * np.sign(ahead) * (square * square - square))


def wake_in_turns(view: View, q: Values, p: Values) -> Force:
    """A wake fraction that falls with the drift and the turning at the propeller, beyond the model's own law."""
    speed = np.hypot(view.u_r, view.v_r) + 1e-9
    drift, turning = -view.v_r / speed, view.r * p["L"] / speed
    beta_P = np.arctan2(-view.v_r, view.u_r) - p["x_P"] * turning
    share = np.clip(q["k"] * (drift**2 + 0.5 * drift * turning + 0.25 * turning**2), -0.5, 0.5)
    thrust = inflow(view.u_r, beta_P, view.n, p)[0]
    changed = inflow(view.u_r * (1 + share), beta_P, view.n, p)[0]
    return Force(X=(1 - p["t_P"]) * (changed - thrust))


def _form(
    key: str, place: str, act: Callable[[View, Values, Values], Force], size: float, most: float, **other: float
) -> Mechanism:
    """A form of the size `k`, either way, which is typically `size`; `other` values say how it acts."""
    return Mechanism(
        key=key,
        number=None,
        place=place,
        kind="force",
        act=act,
        draw=fixed(k_=size, **other),
        grows=("k",),
        spans=[{"k": size, **other}],
        units={"k": "1"},
        most=most,
    )


def planar_forms(screw: bool) -> list[Mechanism]:
    """Those of a craft that moves in the horizontal plane; `screw`: its model has a propeller in a wake."""
    found = [
        _form("cubic_damping", "sway,yaw", cubic_damping, 0.3, 6.0, at=0.25),
        _form("linear_damping", "sway,yaw", linear_damping, 0.3, 8.0),
        _form("full_bow", "sway,yaw", full_bow, 0.5, 6.0),
        _form("steep_resistance", "surge", steep_resistance, 0.5, 6.0),
    ]
    return [*found, _form("wake_in_turns", "surge", wake_in_turns, 1.0, 8.0)] if screw else found


def vertical_forms() -> list[Mechanism]:
    """Those of a vehicle in the diving plane, which meets the flow at small angles."""
    return [
        _form("cubic_damping", "heave,pitch", cubic_damping, 3.0, 8.0, at=0.06),
        _form("linear_damping", "heave,pitch", linear_damping, 1.5, 8.0),
        _form("steep_resistance", "surge", steep_resistance, 0.5, 8.0),
    ]
