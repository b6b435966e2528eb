"""What a hull, its propeller and its loading may hold that a model leaves out."""

from __future__ import annotations

import math

import numpy as np

from withheld.reality.kvlcc2 import inflow
from withheld.reality.motion import Force, Values, View

STATIONS, WEIGHTS = np.polynomial.legendre.leggauss(7)
"""Of the integral along a hull: places over half its length, -1 to 1, and their weights."""


def drag(view: View, q: Values, p: Values) -> Force:
    """A share `k` more drag than a clean hull's."""
    return Force(X=-q["k"] * p["drag_area"] * 0.5 * p["rho"] * view.u_r * np.abs(view.u_r))


def cross_flow(view: View, q: Values, p: Values) -> Force:
    """Drag of each section in the flow across it, summed along the hull, fuller amidships than at the ends."""
    a = 0.5 * p["L"] * STATIONS[:, None]
    full = 1 - 0.35 * STATIONS[:, None] ** 4
    across = view.v_r + p["lever"] * a * view.r
    each = -0.5 * p["rho"] * q["C_d"] * p["d"] * full * np.abs(across) * across * (0.5 * p["L"] * WEIGHTS[:, None])
    return Force(Y=each.sum(axis=0), N=(p["lever"] * a * each).sum(axis=0))


def turning_loss(view: View, q: Values, p: Values) -> Force:
    """Surge force by sway times turning, `k` of the added mass in sway, and by sway squared."""
    return Force(X=q["k"] * p["added_across"] * (view.v_r * view.r - 0.3 * view.v_r**2 / p["L"]))


def munk(view: View, q: Values, p: Values) -> Force:
    """A moment as of a wrong Coriolis matrix of the added mass."""
    return Force(N=q["k"] * p["lever"] * p["added_difference"] * view.u_r * view.v_r)


def propeller_walk(view: View, q: Values, p: Values) -> Force:
    """The side force of a propeller, with the square of its revolutions."""
    side = q["k"] * p["rho"] * p["D_P"] ** 4 * view.n * np.abs(view.n)
    return Force(Y=side, N=-0.48 * p["L"] * side)


def thrust_aside(view: View, q: Values, p: Values) -> Force:
    """Thrust that points `angle` rad to starboard."""
    beta_P = np.arctan2(-view.v_r, view.u_r) - p["x_P"] * view.r * p["L"] / np.hypot(view.u_r, view.v_r + 1e-9)
    side = inflow(view.u_r, beta_P, view.n, p)[0] * np.sin(q["angle"])
    return Force(Y=side, N=-0.48 * p["L"] * side)


def bank(view: View, q: Values, p: Values) -> Force:
    """A bank along the track: suction `k` towards it with the speed squared, the bow away from it."""
    side = q["k"] * 0.5 * p["rho"] * p["L"] * p["d"] * view.u_r**2
    return Force(Y=side, N=-0.25 * p["L"] * side)


def sloshing(view: View, q: Values, p: Values) -> Force:
    """Liquid of `share` of the ship's mass that swings across, with period `T` s and 6 % damping; own states 0, 1."""
    omega, zeta = 2 * math.pi / q["T"], 0.06
    s, rate = view.own[0], view.own[1]
    swing = -2 * zeta * omega * rate - omega**2 * s - p["lever"] * view.u * view.r
    back = 2 * zeta * omega * rate + omega**2 * s
    force = q["share"] * p["mass"] * back
    return Force(Y=force, N=0.1 * p["L"] * p["lever"] * force, rates={0: rate, 1: swing})


def tether(view: View, q: Values, p: Values) -> Force:
    """A line towed from the stern: `c` N/(m/s)^2 along the stern's way."""
    u, v = view.u_r, view.v_r - 0.5 * p["lever"] * p["L"] * view.r
    pull = -q["c"] * np.hypot(u, v)
    return Force(X=pull * u, Y=pull * v, N=-0.5 * p["lever"] * p["L"] * pull * v)


def net_weight(view: View, q: Values, p: Values) -> Force:
    """A vehicle `weight` N too heavy."""
    return Force(X=-q["weight"] * np.sin(view.psi), Y=q["weight"] * np.cos(view.psi))


def trim(view: View, q: Values, p: Values) -> Force:
    """A weight that sits `forward` and `below` m of where it should."""
    weight = p["mass"] * 9.81
    return Force(N=-weight * (q["forward"] * np.cos(view.psi) + q["below"] * np.sin(view.psi)))


def asymmetry(view: View, q: Values, p: Values) -> Force:
    """Heave force and pitch moment at no incidence, as of a sail."""
    lift = 0.5 * p["rho"] * p["L"] ** 2 * view.u_r * np.abs(view.u_r)
    return Force(Y=q["Z_0"] * lift, N=q["M_0"] * lift * p["L"])


def added_mass(p: Values, q: Values) -> Values:
    """All added masses a share `k` larger."""
    names = (
        "m_x", "m_y", "J_z", "X_du", "Y_dv", "Y_dr", "N_dv", "N_dr", "Z_dw", "Z_dq", "M_dw", "M_dq",
        "lambda_11", "lambda_22", "lambda_26", "lambda_66",
    )  # fmt: skip
    return {name: p[name] * (1 + q["k"]) for name in names if name in p}


def shallow(p: Values, q: Values) -> Values:
    """Little water under the keel: the sway derivatives grow by a share `k`, yaw's and the resistance by less."""
    grow = {"Y_v": 1.0, "N_v": 1.0, "Y_r": 0.4, "N_r": 0.4, "R_0": 0.3}
    return {name: p[name] * (1 + share * q["k"]) for name, share in grow.items() if name in p}


def thrust(p: Values, q: Values) -> Values:
    """Thrust a share `k` off."""
    for name in ("X_T", "T"):
        if name in p:
            return {name: p[name] * (1 + q["k"])}
    return {"thrust_share": p["thrust_share"] * (1 + q["k"])}


# Mechanisms that no library names.


def one_sided_fouling(view: View, q: Values, p: Values) -> Force:
    """Growth on one flank: it drags, and turns the vehicle, only while the flow comes from that side."""
    v = np.maximum(view.v_r * np.sign(q["k"]), 0.0)
    force = 0.5 * p["rho"] * p["L"] * p["d"] * np.abs(q["k"])
    return Force(X=-force * v * view.u_r, N=0.12 * p["L"] * force * v * view.u_r * np.sign(q["k"]))


def memory(view: View, q: Values, p: Values) -> Force:
    """The flow remembers: sway force and moment by the drift less its running mean over `T` s; own state 2."""
    fresh = view.v_r - view.own[2]
    force = -q["k"] * p["added_across"] * np.hypot(view.u_r, view.v_r) / p["L"] * fresh
    return Force(Y=force, N=0.25 * p["L"] * p["lever"] * force, rates={2: fresh / q["T"]})


def governor(view: View, q: Values, p: Values) -> Force:
    """An engine that loses thrust `T` s after a turn has loaded it, and finds it again; own state 3."""
    load = np.abs(view.r) * p["L"] / np.maximum(np.hypot(view.u_r, view.v_r), 0.2 * p["speed"])
    lost = -q["k"] * 0.5 * p["rho"] * p["drag_area"] * p["speed"] ** 2 * view.own[3]
    return Force(X=lost, rates={3: (load - view.own[3]) / q["T"]})


def stall(view: View, q: Values, p: Values) -> Force:
    """A control surface that stalls to one side: its force falls off beyond 8 deg there."""
    beyond = np.maximum(view.delta * np.sign(q["k"]) - math.radians(8.0), 0.0)
    force = np.abs(q["k"]) * p["steering"] * view.u_r**2 * beyond * np.sign(q["k"])
    return Force(Y=force, N=p["lever"] * -0.5 * p["L"] * force)


def shedding(view: View, q: Values, p: Values) -> Force:
    """Vortices from one bilge after another: a moment that swings at a Strouhal number of 0.2 while the hull drifts."""
    pace = 2 * math.pi * 0.2 * np.hypot(view.u_r, view.v_r) / p["B"] * 0.25
    moment = q["k"] * 0.5 * p["rho"] * p["L"] ** 2 * p["d"] * view.u_r * view.v_r * np.sin(view.own[0])
    return Force(N=moment, rates={0: pace})


def compressible(view: View, q: Values, p: Values) -> Force:
    """A hull that the depth compresses: buoyancy lost by the metre below its start (own state 1 holds the way down)."""
    return Force(Y=q["k"] * view.own[1], rates={1: view.v * np.cos(view.psi) - view.u * np.sin(view.psi)})
