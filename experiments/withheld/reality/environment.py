"""Currents, wind, waves: forms of their own, not those of the library that diagnoses."""

from __future__ import annotations

import math

import numpy as np

from withheld.reality.motion import Array, Force, Values, View

GRAVITY, AIR = 9.81, 1.225
WIND = {
    "X": {1: -0.72, 3: -0.09, 5: 0.05},
    "Y": {1: 0.81, 3: 0.06, 5: -0.02},
    "N": {1: 0.03, 2: 0.085, 3: 0.012},
}
"""[S] Fourier coefficients of the wind forces over the angle of attack, Fujiwara's form, of a loaded tanker's size."""
WAVES = 5
"""Components of a sea."""


def steady_current(q: Values, t: float) -> tuple[Array, Array, Array, Array]:
    """Current towards north and east, m/s, and their rates."""
    still = np.zeros_like(q["north"])
    return q["north"], q["east"], still, still


def rising_current(q: Values, t: float) -> tuple[Array, Array, Array, Array]:
    """A current that rises from nothing as the trial goes on, as a quarter of a slow swing; north, east its peak."""
    omega = 2 * math.pi / q["period"]
    now, rate = np.sin(omega * t), omega * np.cos(omega * t)
    return q["north"] * now, q["east"] * now, q["north"] * rate, q["east"] * rate


def wind(view: View, q: Values, p: Values) -> Force:
    """Wind of north, east (m/s, blowing to) on the ship above water: Fourier series of the angle of attack."""
    c, d = np.cos(view.psi), np.sin(view.psi)
    along = q["north"] * c + q["east"] * d - view.u
    across = q["east"] * c - q["north"] * d - view.v
    speed2 = along**2 + across**2
    # The angle that the wind comes from, off the bow, positive from starboard.
    angle = np.arctan2(-across, -along)
    pressure = 0.5 * AIR * speed2
    cx = sum(a * np.cos(k * angle) for k, a in WIND["X"].items())
    cy = sum(a * np.sin(k * angle) for k, a in WIND["Y"].items())
    cn = sum(a * np.sin(k * angle) for k, a in WIND["N"].items()) + p["s_L"] / p["L"] * cy
    # A wind from starboard pushes to port.
    X, Y, N = pressure * p["A_F"] * cx, -pressure * p["A_L"] * cy, -pressure * p["A_L"] * p["L"] * cn
    return Force(X - _still_air(view, p), Y, N)


def _still_air(view: View, p: Values) -> Array:
    """What the air resists when it stands: part of the calm water resistance, so not of the wind's force."""
    ahead = sum(WIND["X"].values())
    return np.asarray(0.5 * AIR * view.u**2 * p["A_F"] * ahead)


_SPREAD = ((np.arange(WAVES) - (WAVES - 1) / 2) / (WAVES - 1))[:, None]
_SHARE = np.exp(-4 * _SPREAD**2) / math.sqrt(float(np.exp(-8 * _SPREAD**2).sum()))
"""Components about the peak: how far in frequency, and their share of the amplitude."""


def _components(view: View, q: Values) -> tuple[Array, Array, Array, Array]:
    """Frequency, wave number, amplitude and phase at the origin of each component, (components, lanes)."""
    omega = 2 * math.pi / q["period"] * (1 + q["spread"] * _SPREAD)
    amplitude = q["height"] / 4 * math.sqrt(2.0) * _SHARE
    chance = np.sin((q["seed"] + 1.0) * 12.9898 + 78.233 * np.arange(WAVES)[:, None]) * 43758.5453
    phase = omega * (q["clock"] + view.t) + 2 * math.pi * (chance - np.floor(chance))
    return omega, omega**2 / GRAVITY, amplitude, phase


def _sinc(x: Array) -> Array:
    """sin(x) / x."""
    safe = np.where(np.abs(x) < 1e-6, 1e-6, x)
    return np.asarray(np.sin(safe) / safe)


def waves(view: View, q: Values, p: Values) -> Force:
    """A swell of significant height `height` m: its pressure on a box, to first order.

    `direction` rad is where the waves run to, `period` s the peak's, `spread` the relative width of the spectrum,
    `seed` numbers the phases.
    """
    _, k, amplitude, phase = _components(view, q)
    phase = phase - k * (view.x * np.cos(q["direction"]) + view.y * np.sin(q["direction"]))
    mu = q["direction"] - view.psi
    c, d = np.cos(mu), np.sin(mu)
    kx, ky = 0.5 * k * p["L"] * c, 0.5 * k * p["B"] * d
    push = p["rho"] * GRAVITY * amplitude * (1 - np.exp(-k * p["d"])) * p["L"] * p["B"] * _sinc(ky)
    swing = push * _sinc(kx) * np.sin(phase)
    safe = np.where(np.abs(kx) < 1e-3, 1e-3, kx)
    lever = 0.5 * p["L"] * (_sinc(safe) - np.cos(safe)) / safe
    return Force(c * swing.sum(axis=0), d * swing.sum(axis=0), d * (push * lever * np.cos(phase)).sum(axis=0))


def wave_drift(view: View, q: Values, p: Values) -> Force:
    """The mean drift of waves of height `height` that run to `direction`: a quadratic law of the angle of attack."""
    mu = q["direction"] - view.psi
    c, d = np.cos(mu), np.sin(mu)
    drift = p["rho"] * GRAVITY * q["height"] ** 2 / 16
    return Force(
        0.4 * drift * p["B"] * c * (0.3 + 0.7 * np.abs(c)),
        0.6 * drift * p["L"] * d * (0.3 + 0.7 * np.abs(d)),
        -0.01 * drift * p["L"] ** 2 * np.sin(2 * mu),
    )


def wave_pull(view: View, q: Values, p: Values) -> Force:
    """The mean pull towards the surface of waves of `height` and `period` above a vehicle at depth y."""
    k = (2 * math.pi / q["period"]) ** 2 / GRAVITY
    pull = p["mass"] * GRAVITY * k**2 * q["height"] ** 2 / 8 * np.exp(-2 * k * np.maximum(view.y, 0.0))
    return Force(Y=-pull)
