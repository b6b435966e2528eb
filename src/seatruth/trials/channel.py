"""A named, typed column of numbers: what a trial records and what a model has as state, input or output."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Hold = Literal["foh", "zoh"]
"""An input between its samples: joined by straight lines (first-order hold), or constant (zero-order hold)."""


@dataclass(frozen=True)
class Channel:
    """One quantity with its unit.

    Args:
        name: identifier.
        unit: unit inside seatruth (SI; rad; rev/s).
        description: what it is, in a few words.
        angle: True for a quantity that wraps at a full turn.

    Example:
        >>> from seatruth import Channel
        >>> Channel("psi", "rad", "heading", angle=True).unit
        'rad'

    Standard names, which checks, effects and manoeuvre figures rely on: t; x, y, z (earth position, z down);
    phi, theta, psi (theta nose up, psi clockwise); u, v, w (velocity over ground in body axes, x forward, y starboard,
    z down);
    u_w, v_w, w_w (the same through the water); sog, cog (speed and course over ground); v_n, v_e, v_d (velocity over
    ground in earth axes); f_x, f_y, f_z (specific force, which an accelerometer shows); p, q, r; delta (rudder,
    positive turns to starboard unless the model says otherwise), delta_s (stern plane, positive pitches the nose down
    unless the model's description of it says that it pitches the nose up), n (propeller, rev/s).
    """

    name: str
    unit: str
    description: str = ""
    angle: bool = False
