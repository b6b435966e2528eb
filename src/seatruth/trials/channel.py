"""A named, typed column of numbers: what a trial records and what a model has as state, input or output."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Channel:
    """One quantity with its unit.

    `unit` is the unit used inside seatruth (SI; rad; rev/s). `angle` marks quantities that wrap at a full turn.
    Standard names, which checks, effects and manoeuvre figures rely on: t; x, y, z (earth position, z down),
    phi, theta, psi (psi clockwise); u, v, w (velocity over ground in body axes, x forward, y starboard, z down);
    p, q, r; delta (rudder, positive turns to starboard unless the model says otherwise), delta_s (stern plane),
    n (propeller, rev/s).
    """

    name: str
    unit: str
    description: str = ""
    angle: bool = False
