"""Hydrodynamic forces that a model may lack or have wrong."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import relative_velocity
from seatruth.models.parameter import Parameter

ADDED_MASS = (
    *("m_x", "m_y", "J_z", "X_du", "Y_dv", "Z_dw", "K_dp", "M_dq", "N_dr", "Y_dr", "N_dv", "Z_dq", "M_dw"),
    *(f"lambda_{ij}" for ij in (11, 22, 33, 26, 35, 44, 55, 66)),
    *(f"A_{ij}" for ij in (11, 22, 33, 26, 35, 44, 55, 66)),
)
"""Names of added masses in the models."""
STATIONS = (
    (-0.4662348, 0.0856622),
    (-0.3306047, 0.1803808),
    (-0.1193096, 0.2339570),
    (0.1193096, 0.2339570),
    (0.3306047, 0.1803808),
    (0.4662348, 0.0856622),
)
"""Places along the hull over its length, and their weights: Gauss and Legendre's for an integral."""


class DragIncrease(Effect):
    """More drag in straight motion: fouling, appendages, an underestimate."""

    name = "drag_increase"
    title = "drag increase"
    cause = "hydrodynamics.damping_or_lift.drag"
    number = 19
    equation = "X = -k times the drag in straight motion"
    source = "[S] magnitude of the catalogue: 0.05 to 0.4"
    acts_on = ("surge",)
    equivalent = ("R_0", "X_uu", "C_x0", "K_D0")
    confused_with = ("thrust_gain", "added_mass", "speed_scale", "turning_loss")
    distinguished_by = "faster coast-down: revolutions to zero at speed"
    needs_states = ("u",)
    needs_vehicle = ("drag",)
    parameters = (Parameter("k", 0.15, "1", -0.8, 3.0, source="[S] catalogue", description="relative increase"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return e._replace(X=e.X - q.k * d.drag)


class CrossFlow(Effect):
    """Cross-flow drag, strip by strip, of a hull whose model is too linear."""

    name = "cross_flow"
    title = "cross-flow drag"
    cause = "hydrodynamics.damping_or_lift.cross_flow"
    number = 21
    equation = "Y = -rho/2 C_d d int |v + x r| (v + x r) dx, N with the lever x"
    source = "[L] Faltinsen 1990, strip-wise cross-flow; [S] magnitude of the catalogue: 0.6 to 1.2"
    acts_on = ("sway", "yaw")
    equivalent = ("C_d",)
    confused_with = ("turning_loss", "rudder_gain", "shallow_water", "log_lever_arm")
    distinguished_by = "gain falls with the size of the manoeuvre: an amplitude series"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (Parameter("C_d", 0.5, "1", -3.0, 3.0, source="[S] catalogue", description="beyond the model's own"),)
    null: Mapping[str, float] = {"C_d": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        v = s.v - e.v_c
        strip = 0.5 * d.rho * d.draft * d.length * q.C_d
        Y, N = 0.0, 0.0
        for place, weight in STATIONS:
            x = place * d.length
            across = v + x * s.r
            force = weight * abs(across) * across
            Y, N = Y + force, N + x * force
        return e._replace(Y=e.Y - strip * Y, N=e.N - strip * N)


class CrossFlowVertical(Effect):
    """The same in heave and pitch."""

    name = "cross_flow_vertical"
    title = "cross-flow drag in the diving plane"
    cause = "hydrodynamics.damping_or_lift.cross_flow"
    number = 21
    equation = "Z = -rho/2 C_d B int |w - x q| (w - x q) dx, M with the lever -x"
    source = CrossFlow.source
    acts_on = ("heave", "pitch")
    confused_with = ("plane_gain", "munk_vertical", "log_lever_arm_vertical")
    distinguished_by = "gain falls with the size of the manoeuvre: an amplitude series"
    needs_states = ("u", "w", "q")
    needs_vehicle = ("dimensions",)
    parameters = CrossFlow.parameters
    null: Mapping[str, float] = {"C_d": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        w = s.w - e.w_c
        strip = 0.5 * d.rho * d.breadth * d.length * q.C_d
        Z, M = 0.0, 0.0
        for place, weight in STATIONS:
            x = place * d.length
            across = w - x * s.q
            force = weight * abs(across) * across
            Z, M = Z + force, M - x * force
        return e._replace(Z=e.Z - strip * Z, M=e.M - strip * M)


class TurningLoss(Effect):
    """Surge force in turns that the model lacks."""

    name = "turning_loss"
    title = "speed loss in turns"
    cause = "hydrodynamics.damping_or_lift.turning"
    number = 22
    equation = "X = vr m v r + vv rho/2 L d v^2"
    source = "[L] Norrbin 1971, X_vr = 0.3 to 1 of the sway added mass; [S] magnitudes of the catalogue"
    acts_on = ("surge",)
    equivalent = ("X_vr", "X_rv", "X_vv")
    confused_with = ("drag_increase", "thrust_gain", "cross_flow")
    distinguished_by = "nothing on straight legs, even in the side of the turn"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("vr", 0.3, "1", -5.0, 5.0, source="[S] catalogue", description="share of the mass"),
        Parameter("vv", 0.1, "1", -3.0, 3.0, source="[S] chosen here", description="by drift squared"),
    )
    null: Mapping[str, float] = {"vr": 0.0, "vv": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        v = s.v - e.v_c
        X = q.vr * d.mass * v * s.r + q.vv * 0.5 * d.rho * d.length * d.draft * v * v
        return e._replace(X=e.X + X)


class TurningLossVertical(Effect):
    """Surge force that the model lacks while pitching and heaving."""

    name = "turning_loss_vertical"
    title = "speed loss in pitching turns"
    cause = "hydrodynamics.damping_or_lift.turning"
    number = 22
    equation = "X = wq m w q + ww rho/2 L B w^2"
    source = TurningLoss.source
    acts_on = ("surge",)
    equivalent = ("X_wq", "X_ww", "C_x_alpha", "K_D")
    confused_with = ("drag_increase", "thrust_gain", "cross_flow_vertical")
    distinguished_by = "nothing on straight legs, even in the direction of the turn"
    needs_states = ("u", "w", "q")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("wq", 0.3, "1", -5.0, 5.0, source="[S] catalogue", description="share of the mass"),
        Parameter("ww", 0.1, "1", -3.0, 3.0, source="[S] chosen here", description="by heave squared"),
    )
    null: Mapping[str, float] = {"wq": 0.0, "ww": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        w = s.w - e.w_c
        X = q.wq * d.mass * w * s.q + q.ww * 0.5 * d.rho * d.length * d.breadth * w * w
        return e._replace(X=e.X + X)


class AddedMass(Effect):
    """All added masses are off by the same share."""

    name = "added_mass"
    title = "added-mass error"
    cause = "hydrodynamics.added_mass_or_inertia"
    number = 25
    equation = "M_A (1 + k)"
    source = "[S] magnitude of the catalogue: 10 to 30 %"
    acts_on = ("surge", "sway", "heave", "roll", "pitch", "yaw")
    confused_with = ("rudder_lag", "rudder_delay", "plane_lag", "plane_delay", "drag_increase")
    distinguished_by = "transients only: phase while accelerating, no change in steady turns; a measured rudder angle"
    needs_parameters = ADDED_MASS
    parameters = (Parameter("k", 0.2, "1", -0.8, 2.0, source="[S] catalogue", description="relative error"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def true_parameters(p: Any, q: Any) -> Any:
        return p._replace(**{k: getattr(p, k) * (1.0 + q.k) for k in ADDED_MASS if k in p._fields})


class Munk(Effect):
    """The coupling of surge and sway in yaw is off: positive k stabilises the course."""

    name = "munk"
    title = "Munk moment error"
    cause = "hydrodynamics.damping_or_lift.moment"
    number = 27
    equation = "N = k m u v, the displaced mass standing for X_du - Y_dv"
    source = "[L] Kirchhoff's equations; [S] magnitude of the catalogue: 0.3"
    acts_on = ("yaw",)
    equivalent = ("N_v", "N_uv", "m_y_beta", "K_MY")
    confused_with = ("log_lever_arm", "shallow_water")
    distinguished_by = "never from N_v: one parameter"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (Parameter("k", 0.1, "1", -1.0, 1.0, source="[S] a third of 0.3", description="share of the mass"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return e._replace(N=e.N + q.k * d.mass * (s.u - e.u_c) * (s.v - e.v_c))


class MunkVertical(Effect):
    """The coupling of surge and heave in pitch is off."""

    name = "munk_vertical"
    title = "Munk moment error in pitch"
    cause = "hydrodynamics.damping_or_lift.moment"
    number = 27
    equation = "M = k m u w, the displaced mass standing for Z_dw - X_du"
    source = Munk.source
    acts_on = ("pitch",)
    equivalent = ("M_w", "m_z_alpha", "K_M")
    confused_with = ("log_lever_arm_vertical", "cross_flow_vertical")
    distinguished_by = "never from M_w: one parameter"
    needs_states = ("u", "w", "q")
    needs_vehicle = ("dimensions",)
    parameters = Munk.parameters
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return e._replace(M=e.M + q.k * d.mass * (s.u - e.u_c) * (s.w - e.w_c))


def _unit_force(s: Any, e: Any, d: Any) -> Any:
    """rho/2 L^2 u^2 (N), u through the water."""
    u = s.u - e.u_c
    return 0.5 * d.rho * d.length * d.length * u * u


class Asymmetry(Effect):
    """Lift and moment at zero incidence, of a sail or fins."""

    name = "asymmetry"
    title = "up-down asymmetry"
    cause = "hydrodynamics.asymmetry"
    number = 28
    equation = "Z = force rho/2 L^2 u^2, M = moment rho/2 L^3 u^2"
    source = "[S] magnitude of the catalogue: 1e-4 to 1e-3"
    kinds = ("auv", "glider")
    acts_on = ("heave", "pitch")
    equivalent = ("Z_0", "C_y0", "m_z0", "K_L0", "K_M0")
    confused_with = ("plane_offset", "net_weight", "trim")
    distinguished_by = "goes with u^2, unlike a weight; of a plane's offset only by another arm than the plane's"
    needs_states = ("u", "w", "q")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("force", 5e-4, "1", -0.02, 0.02, source="[S] catalogue", description="downwards"),
        Parameter("moment", 2e-4, "1", -0.02, 0.02, source="[S] chosen here", description="nose up"),
    )
    null: Mapping[str, float] = {"force": 0.0, "moment": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        unit = _unit_force(s, e, d)
        return e._replace(Z=e.Z + unit * q.force, M=e.M + unit * d.length * q.moment)


class LateralAsymmetry(Effect):
    """Side force and moment at no drift: a list, a bent skeg, weed on one side, a load to one side of a planing craft.

    They are Y_0 and N_0 of `abkowitz`. Two effects that push to one side, such as an offset of the rudder and thrust
    that points aside, have between them the form of any such cause.
    """

    name = "lateral_asymmetry"
    title = "port-starboard asymmetry"
    cause = "hydrodynamics.asymmetry"
    number = 28
    equation = "Y = force rho/2 L^2 u^2, N = moment rho/2 L^3 u^2"
    source = (
        "[L] Chislett and Strom-Tejsen (1965), the Mariner: -4e-5 and 3e-5; [S] doubled here, since a list and a bent "
        "fin do more than the turn of a single screw"
    )
    acts_on = ("sway", "yaw")
    equivalent = ("Y_0", "N_0")
    confused_with = ("rudder_offset", "thrust_misalignment", "propeller_walk", "thruster_direction", "bank")
    distinguished_by = (
        "goes with u^2 whatever the propeller does; of a rudder's offset only by another arm than the rudder's"
    )
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("force", 1e-4, "1", -0.02, 0.02, source="[S] chosen here", description="to starboard"),
        Parameter("moment", 5e-5, "1", -0.02, 0.02, source="[S] chosen here", description="bow to starboard"),
    )
    null: Mapping[str, float] = {"force": 0.0, "moment": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        unit = _unit_force(s, e, d)
        return e._replace(Y=e.Y + unit * q.force, N=e.N + unit * d.length * q.moment)


class SideDrag(Effect):
    """More drag on one side than on the other: a payload, weed, one hull of a catamaran that is fouled.

    The drag itself is what a coefficient or `drag_increase` stands for; this is what it turns. It turns a vehicle that
    goes astern to the other side, as `lateral_asymmetry` does not.
    """

    name = "side_drag"
    title = "drag on one side"
    cause = "hydrodynamics.asymmetry"
    number = 28
    equation = "N = k D B / 2, D the drag in straight motion, B the breadth"
    source = "[S] chosen here: a tenth of the drag, half the breadth to one side"
    acts_on = ("yaw",)
    equivalent = ("N_0",)
    confused_with = ("lateral_asymmetry", "rudder_offset", "thrust_misalignment", "thruster_gain", "propeller_walk")
    distinguished_by = "goes with the speed whatever the propellers do; astern, of an asymmetry, by its sign"
    needs_states = ("u", "r")
    needs_vehicle = ("dimensions", "drag")
    parameters = (Parameter("k", 0.1, "1", -5.0, 5.0, source="[S] chosen here", description="to starboard"),)
    null: Mapping[str, float] = {"k": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return e._replace(N=e.N + q.k * d.drag * 0.5 * d.breadth)


class Tether(Effect):
    """A cable or tow at the stern drags against the motion there."""

    name = "tether"
    title = "tether"
    cause = "hydrodynamics.external_body"
    number = 31
    equation = "F = -rho/2 area V |V| at the stern, area = C_d d_t L_t"
    source = "[S] magnitude of the catalogue: 5 to 50 N on a small vehicle"
    acts_on = ("surge", "sway", "heave", "pitch", "yaw")
    equivalent = ("l_t", "C_t")
    confused_with = ("drag_increase", "rudder_gain")
    distinguished_by = "drag with damping of the rate of turn: straight runs beside turns"
    needs_states = ("u",)
    needs_vehicle = ("dimensions",)
    parameters = (Parameter("area", 0.015, "m2", 0.0, 50.0, source="[S] 20 N at 1.6 m/s", description="drag area"),)
    null: Mapping[str, float] = {"area": 0.0}
    typical_by_kind: ClassVar[Mapping[str, Mapping[str, float]]] = {"ship": {"area": 3.0}}
    froude: ClassVar[Mapping[str, float]] = {"area": 2.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        x = -0.5 * d.length
        n = relative_velocity(s, e)
        v, w = n.v + x * n.r, n.w - x * n.q
        pull = -0.5 * d.rho * q.area * math.sqrt(n.u * n.u + v * v + w * w + 1e-12)
        Y, Z = pull * v, pull * w
        return e._replace(X=e.X + pull * n.u, Y=e.Y + Y, Z=e.Z + Z, M=e.M - x * Z, N=e.N + x * Y)
