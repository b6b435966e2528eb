"""What surrounds the vehicle: current, wind, waves, shallow water and banks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.terms import into_body
from seatruth.models.parameter import Parameter

_FOSSEN = "[L] Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control"


def carried(e: Any, s: Any, north: Any, east: Any, north_dot: Any = 0.0, east_dot: Any = 0.0) -> Any:
    """The surroundings with a current over ground (m/s) more, and its rate of change (m/s2)."""
    u_c, v_c, w_c = into_body(north, east, s)
    du, dv, dw = into_body(north_dot, east_dot, s)
    p, q, r = getattr(s, "p", 0.0), getattr(s, "q", 0.0), getattr(s, "r", 0.0)
    return e._replace(
        u_c=e.u_c + u_c,
        v_c=e.v_c + v_c,
        w_c=e.w_c + w_c,
        du_c=e.du_c + du + r * v_c - q * w_c,
        dv_c=e.dv_c + dv + p * w_c - r * u_c,
        dw_c=e.dw_c + dw + q * u_c - p * v_c,
    )


class Current(Effect):
    """A constant current: the water moves over ground, as components so that its null is a regular point."""

    name = "current"
    title = "constant current"
    family = "environment"
    number = 1
    equation = "nu_c = R(psi)^T (north, east); forces by nu - nu_c, position by nu"
    source = _FOSSEN + "; [S] magnitudes of the catalogue: 0.05 to 0.5 m/s, ships 0.1 to 1.5 m/s"
    acts_on = ("kinematics",)
    confused_with = ("speed_bias", "sway_bias", "heading_bias", "wind", "wave_drift", "compass_deviation")
    told_apart = "fixed to the earth: turn by 180 deg or more; unlike wind it leaves no drift through the water"
    needs_states = ("u", "v", "psi", "r")
    parameters = (
        Parameter("north", 0.2, "m/s", -3.0, 3.0, source="[S] chosen here", description="along x of the earth"),
        Parameter("east", 0.2, "m/s", -3.0, 3.0, source="[S] chosen here", description="along y of the earth"),
    )
    null: ClassVar[Mapping[str, float]] = {"north": 0.0, "east": 0.0}
    magnitudes: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"north": 0.5, "east": 0.5}}
    froude: ClassVar[Mapping[str, float]] = {"north": 0.5, "east": 0.5}

    @staticmethod
    def surroundings(e: Any, s: Any, i: Any, p: Any, q: Any) -> Any:
        return carried(e, s, q.north, q.east)
