"""The channels of the torpedo-like vehicle, one at a time, as Zhao, Xie and Qiao 2018 identify them.

Each is some rows of the equations of `torpedo.py` (the convention and its map to seatruth's axes stand there), with the
other motions taken as recorded or as zero [R]. The channels, their order (roll before lateral) and outputs (speed, yaw
rate for lateral, pitch rate for longitudinal) are the paper's [P]. What its lost vectors leave open [R]: the recorded
speed is an input of all but the forward channel; roll takes the recorded sideways motion too, and the pendulums of roll
and pitch hang on the recorded acceleration of the origin. An output that was not recorded is left out of a trial.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from seatruth.errors import BadInput, nearest
from seatruth.models.torpedo import (
    DIFFERENTIAL,
    PHI,
    PLANE,
    PSI,
    REVOLUTIONS,
    RUDDER,
    THETA,
    OneOfTheSets,
    P,
    Q,
    R,
    U,
    V,
    W,
    drag,
    flow,
    lift,
    pitching,
    rolling,
    side,
    thrust,
    yawing,
)
from seatruth.models.torpedo_parameters import parameters
from seatruth.trials.channel import Channel

_AHEAD = Channel("a_x", "m/s2", "kinematic acceleration at the origin, forward")
_SIDEWAYS = Channel("a_y", "m/s2", "kinematic acceleration at the origin to starboard")
_SIDESLIP = Channel("beta", "rad", "sideslip angle, positive when moving to starboard")
_INCIDENCE = Channel("alpha", "rad", "angle of attack, positive when moving down")
_HULL = ("rho", "L", "D", "m")

FREE: Mapping[str, tuple[str, ...]] = {
    "forward": ("C_x0", "k_1", "k_2", "lambda_11"),
    "roll": ("m_x_beta", "m_x_wx", "m_x_dr", "lambda_44"),
    "lateral": ("C_z_beta", "C_z_wy", "C_z_dr", "lambda_33", "m_y_beta", "m_y_wy", "m_y_dr"),
    "longitudinal": (
        *("C_y_alpha", "C_y_wz", "C_y_de", "lambda_22", "lambda_26"),
        *("m_z_alpha", "m_z_wz", "m_z_de", "lambda_66"),
    ),
}
"""What is identified in each channel: forward as printed [P], 4 + 7 = 11 for roll and lateral [P: 11], the rest [R]."""


class Forward(OneOfTheSets):
    """Speed by revolutions. Its drag, thrust and mass have a common factor that no run of it can tell."""

    name = "torpedo_forward"
    title = "Torpedo-like vehicle, forward channel"
    kind = "auv"
    source = "[R] after Zhao, Xie and Qiao 2018"
    states = (U,)
    inputs = (REVOLUTIONS,)
    outputs = states
    parameters = parameters("T1", (*_HULL, *FREE["forward"]))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return ((thrust(i.n, p) - drag(flow(s.u, 0.0, 0.0, p), s.u, p)) / (p.m + p.lambda_11),)


class Roll(OneOfTheSets):
    """Roll by the fins and the propeller, under the recorded speed, sideways motion, yaw rate and pitch.

    T2 unless requested: fins up and across that are equal, as those of T1, do not roll the body at all.
    """

    name = "torpedo_roll"
    title = "Torpedo-like vehicle, roll channel"
    kind = "auv"
    source = "[R] after Zhao, Xie and Qiao 2018"
    states = (P, PHI)
    inputs = (RUDDER, DIFFERENTIAL, REVOLUTIONS, U, V, R, THETA, _SIDEWAYS)
    outputs = states
    parameters = parameters("T2", (*_HULL, "g", "J_x", "y_G", "k_Q", *FREE["roll"], "m_x_wy", "m_x_dd"))

    def __init__(self, vehicle: str = "T2") -> None:
        super().__init__(vehicle)

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        M = rolling(flow(i.u, 0.0, i.v, p), s.p, -i.r, i.delta, i.delta_d, p) + p.k_Q * i.n * abs(i.n)
        M = M + p.m * p.y_G * (p.g * math.sin(s.phi) - i.a_y)
        return M / (p.J_x + p.lambda_44), s.p + i.r * math.cos(s.phi) * math.tan(i.theta)


class Lateral(OneOfTheSets):
    """Sway and yaw by the rudder, under the recorded speed; roll is taken as zero."""

    name = "torpedo_lateral"
    title = "Torpedo-like vehicle, lateral channel"
    kind = "auv"
    source = "[R] after Zhao, Xie and Qiao 2018"
    states = (V, R, PSI)
    inputs = (RUDDER, U)
    outputs = (R, V, _SIDESLIP, PSI)
    parameters = parameters("T1", (*_HULL, "J_y", *FREE["lateral"], "lambda_35", "lambda_55"))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        w_y, water = -s.r, flow(i.u, 0.0, s.v, p)
        F, M = side(water, w_y, i.delta, p) + p.m * i.u * w_y, yawing(water, w_y, i.delta, p)
        a, b, c = p.m + p.lambda_33, p.lambda_35, p.J_y + p.lambda_55
        determinant = a * c - b * b
        return (c * F - b * M) / determinant, (b * F - a * M) / determinant, s.r

    @staticmethod
    def output(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return s.r, s.v, flow(i.u, 0.0, s.v, p).beta, s.psi

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.v, y.r, y.psi


class Longitudinal(OneOfTheSets):
    """Heave and pitch by the stern plane, under the recorded speed and its change; roll is taken as zero."""

    name = "torpedo_longitudinal"
    title = "Torpedo-like vehicle, longitudinal channel"
    kind = "auv"
    source = "[R] after Zhao, Xie and Qiao 2018"
    states = (W, Q, THETA)
    inputs = (PLANE, U, _AHEAD)
    outputs = (Q, W, _INCIDENCE, THETA)
    parameters = parameters("T1", (*_HULL, "g", "J_z", "x_G", "y_G", "dG", *FREE["longitudinal"]))

    @staticmethod
    def rhs(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        w_z, water = s.q, flow(i.u, -s.w, 0.0, p)
        sin_t, cos_t = math.sin(s.theta), math.cos(s.theta)
        F = lift(water, w_z, i.delta_s, p) - p.dG * cos_t - p.m * (i.u * w_z - p.y_G * w_z * w_z)
        M = pitching(water, w_z, i.delta_s, p) + p.m * p.y_G * (p.g * sin_t + i.a_x)
        M = M - p.m * p.x_G * (p.g * cos_t + i.u * w_z)
        a, b, c = p.m + p.lambda_22, p.m * p.x_G + p.lambda_26, p.J_z + p.lambda_66
        determinant = a * c - b * b
        return (b * M - c * F) / determinant, (a * M - b * F) / determinant, w_z

    @staticmethod
    def output(s: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return s.q, s.w, flow(i.u, -s.w, 0.0, p).alpha, s.theta

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return y.w, y.q, y.theta


CHANNELS: Mapping[str, type[OneOfTheSets]] = {
    "forward": Forward,
    "roll": Roll,
    "lateral": Lateral,
    "longitudinal": Longitudinal,
}
"""In the order in which they are identified: roll before lateral [P]."""


def channel(name: str, vehicle: str = "T1") -> OneOfTheSets:
    """The model of one channel, by name; BadInput names the nearest."""
    if name not in CHANNELS:
        raise BadInput(f"there is no channel {name!r}", do=nearest(name, CHANNELS))
    return CHANNELS[name](vehicle)
