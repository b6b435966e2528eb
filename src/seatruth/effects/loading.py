"""Weight, centre of gravity and liquid in the hull."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from seatruth.effects.base import Effect
from seatruth.effects.kinematics import G
from seatruth.models.base import Model
from seatruth.models.parameter import Parameter, Prior
from seatruth.trials.channel import Channel

DAMPING = 0.1
"""Share of critical damping of sloshing liquid [S]."""


def with_weight(e: Any, s: Any, weight: Any, ahead: Any = 0.0) -> Any:
    """The environment with a weight (N) more that lies `ahead` (m) of the origin on the axis of the hull.

    A model without pitch or roll is level.
    """
    phi, theta = getattr(s, "phi", 0.0), getattr(s, "theta", 0.0)
    level = weight * math.cos(theta)
    down, aside = level * math.cos(phi), level * math.sin(phi)
    return e._replace(
        X=e.X - weight * math.sin(theta),
        Y=e.Y + aside,
        Z=e.Z + down,
        M=e.M - ahead * down,
        N=e.N + ahead * aside,
    )


class Weight(Effect):
    """A weight too much or too little: it pushes ahead as well where the hull can pitch."""

    def places(self, model: Model) -> tuple[str, ...]:
        standard = {model.standard_of(channel.name)[0] for channel in (*model.states, *model.outputs)}
        found = super().places(model)
        return found if "theta" in standard else tuple(place for place in found if place != "surge")


class LateralOffset(Effect):
    """The centre of gravity lies to starboard of the plane of symmetry."""

    name = "lateral_offset"
    title = "centre of gravity off the centreline"
    cause = "loading.centre_of_gravity"
    number = 23
    equation = "K = m g y_G cos(theta) cos(phi), N = m g y_G sin(theta)"
    source = "[L] statics; [S] magnitude of the catalogue: 1 to 5 mm, 1 to 3 deg of list"
    acts_on = ("roll", "yaw")
    confused_with = ("propeller_torque",)
    distinguished_by = "a list at rest too: a static test"
    needs_states = ("phi", "p", "theta")
    needs_vehicle = ("dimensions",)
    parameters = (Parameter("y_G", 0.002, "m", -0.5, 0.5, source="[S] catalogue", description="to starboard"),)
    null: Mapping[str, float] = {"y_G": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        moment = d.mass * G * q.y_G
        K = moment * math.cos(s.theta) * math.cos(s.phi)
        return e._replace(K=e.K + K, N=e.N + moment * math.sin(s.theta))


class NetWeight(Weight):
    """Weight and buoyancy differ more than the model says."""

    name = "net_weight"
    title = "net weight"
    cause = "loading.weight.constant"
    number = 24
    equation = "a weight share m g at the origin"
    source = "[L] statics; [S] magnitude of the catalogue: 0.1 to 2 % of the weight"
    kinds = ("auv", "glider")
    acts_on = ("surge", "heave")
    equivalent = ("dG", "m_disp", "nabla")
    confused_with = ("plane_offset", "trim", "asymmetry", "depth_scale", "buoyancy_gradient", "flooding")
    distinguished_by = "the plane angle that it needs falls with 1/u^2: two speeds; seen at rest"
    needs_states = ("w",)
    needs_vehicle = ("dimensions",)
    parameters = (Parameter("share", 0.005, "1", -0.2, 0.2, source="[S] catalogue", description="heavy is positive"),)
    null: Mapping[str, float] = {"share": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return with_weight(e, s, q.share * d.mass * G)


class Trim(Effect):
    """The centre of gravity lies ahead of, or below, where the model has it."""

    name = "trim"
    title = "trim by the centre of gravity"
    cause = "loading.centre_of_gravity"
    number = 24
    equation = "M = -m g (forward cos(theta) + below sin(theta))"
    source = "[L] statics; [S] magnitude of the catalogue: 1 to 10 mm"
    kinds = ("auv", "glider")
    acts_on = ("roll", "pitch", "yaw")
    equivalent = ("x_G", "z_B", "x_B", "B", "x_h", "z_h")
    confused_with = ("plane_offset", "net_weight", "asymmetry")
    distinguished_by = "the plane angle that it needs falls with 1/u^2: two speeds; seen at rest"
    needs_states = ("u", "w", "q", "theta")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("forward", 0.003, "m", -0.5, 0.5, source="[S] catalogue", description="nose-heavy is positive"),
        Parameter("below", 0.003, "m", -0.5, 0.5, source="[S] catalogue", description="stiffer is positive"),
    )
    null: Mapping[str, float] = {"forward": 0.0, "below": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        weight, phi = d.mass * G, getattr(s, "phi", 0.0)
        c = math.cos(s.theta)
        M = -q.forward * c * math.cos(phi) - q.below * math.sin(s.theta)
        K, N = -q.below * c * math.sin(phi), q.forward * c * math.sin(phi)
        return e._replace(K=e.K + weight * K, M=e.M + weight * M, N=e.N + weight * N)


class Sloshing(Effect):
    """Liquid beyond the model's mass that moves sideways in the hull on a spring (free flooding, a slack tank)."""

    name = "sloshing"
    title = "sloshing liquid"
    cause = "loading.moving_liquid"
    number = 26
    equation = "s'' + 2 zeta w s' + w^2 s = -a_y, Y = share m (2 zeta w s' + w^2 s), w = 2 pi / period"
    source = "[L] equivalent pendulum of sloshing; [S] magnitudes of the catalogue: 1 to 10 %, 0.5 to 10 s"
    acts_on = ("sway",)
    confused_with = ("added_mass", "wave_forces", "rudder_lag")
    distinguished_by = "a resonance at a frequency of its own, whatever the course"
    needs_states = ("u", "v", "r")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("share", 0.05, "1", 0.0, 1.0, source="[S] catalogue", description="liquid over the vehicle's mass"),
        Parameter(
            "period",
            4.0,
            "s",
            2.5,
            40.0,
            prior=Prior(4.0, 3.0),
            source="[S] catalogue",
            description="of the first mode",
        ),
    )
    null: Mapping[str, float] = {"share": 0.0}
    starts = tuple({"share": 0.05, "period": period} for period in (3.0, 4.5, 6.0, 12.0))
    # The liquid's velocity, not the relative one, is a state: its rate then needs no acceleration of the vehicle.
    # s: Runge-Kutta of order 4 diverges on a swing of 2.5 s, the shortest one, from steps of 1.1 s on.
    longest_step = 1.0
    states = (
        Channel("shift", "m", "liquid to starboard of its place"),
        Channel("speed", "m/s", "its velocity to starboard over ground"),
    )

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        w = 2.0 * math.pi / q.period
        wall = 2.0 * DAMPING * w * (s.speed - s.v) + w * w * s.shift
        return e._replace(Y=e.Y + q.share * d.mass * wall)

    @staticmethod
    def rates(s: Any, i: Any, p: Any, q: Any, e: Any) -> tuple[Any, ...]:
        w = 2.0 * math.pi / q.period
        return s.speed - s.v, -2.0 * DAMPING * w * (s.speed - s.v) - w * w * s.shift - s.u * s.r

    @staticmethod
    def initial_state(y: Any, i: Any, p: Any, q: Any) -> tuple[Any, ...]:
        return 0.0, getattr(y, "v", 0.0)
