"""Which mechanisms act on which family, at which typical magnitudes (catalogue of effects, [S] within its ranges).

Keys are this benchmark's own words; `names.py` beside the package says what the library calls them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from withheld.reality import environment as env
from withheld.reality import hulls, sensors, thrusters
from withheld.reality.mechanism import Draw, Kind, Mechanism, around, fixed, sign

_QUARTERS = (0.0, math.pi / 2, math.pi, -math.pi / 2)
"""rad: directions that stand for all."""


def gear(values: object) -> None:
    """Mechanisms of the steering gear act through its settings, not through a function."""


def _one(
    key: str,
    number: int | None,
    place: str,
    kind: Kind,
    act: Callable[..., object],
    name: str,
    value: float,
    unit: str,
    *,
    most: float = 5.0,
    orders: bool = False,
    signed: bool = True,
    **other: float,
) -> Mechanism:
    """A mechanism of one magnitude, `name`, typically `value`, of either sign where it is `signed`.

    `other` values say how it acts.
    """
    return Mechanism(
        key=key,
        number=number,
        place=place,
        kind=kind,
        act=act,
        draw=fixed(**{name + ("_" if signed else ""): value}, **other),
        grows=(name,),
        spans=[{name: value, **other}],
        units={name: unit},
        most=most,
        orders=orders,
    )


def _flow(size: float, first: str = "north", second: str = "east") -> Draw:
    """A vector of this size in any direction."""

    def draw(rng: np.random.Generator) -> dict[str, float]:
        way = around(rng)
        return {first: size * math.cos(way), second: size * math.sin(way)}

    return draw


def _with(draw: Draw, **ranges: tuple[float, float]) -> Draw:
    def more(rng: np.random.Generator) -> dict[str, float]:
        return {**draw(rng), **{name: float(rng.uniform(*ends)) for name, ends in ranges.items()}}

    return more


def _ways(speed: float, **other: float) -> list[dict[str, float]]:
    return [{"north": a * speed, "east": b * speed, **other} for a, b in ((1, 0), (0, 1), (-1, 0), (0, -1))]


def shared(speed: float, time: float) -> list[Mechanism]:
    """Those of both kinds of vehicle: the gear's, the forward log's, drag's. `time` s is the vehicle's own (L / U)."""
    deg = math.radians
    steer = "actuator:delta"
    return [
        _one("speed_scale", 3, "sensor:u", "sensor", sensors.speed_scale, "k", 0.03, "1", most=8),
        _one("speed_bias", 4, "sensor:u", "sensor", sensors.speed_bias, "b", 0.02 * speed, "m/s", most=8),
        _one("rudder_offset", 12, steer, "gear", gear, "offset", deg(1.0), "rad"),
        _one("rudder_gain", 13, steer, "gear", gear, "gain", 0.12, "1", most=3.5),
        _one("lag", 14, steer, "gear", gear, "lag", 0.15 * time, "s", most=6, orders=True, signed=False),
        _one("rate_limit", 14, steer, "gear", gear, "slowness", 1 / deg(2.5) * time / 5.94, "s/rad", most=5,
             orders=True, signed=False),
        _one("dead_band", 15, steer, "gear", gear, "band", deg(0.7), "rad", most=5, orders=True, signed=False),
        _one("rate_delay", 10, "sensor:turning", "sensor", sensors.late_rate, "tau", 0.06 * time, "s", most=6,
             signed=False),
        _one("speed_delay", 10, "sensor:u,sensor:across", "sensor", sensors.late_speed, "tau", 0.06 * time, "s",
             most=8, signed=False),
        _one("dead_time", 15, steer, "gear", gear, "dead", 0.1 * time, "s", most=6, orders=True, signed=False),
        _one("play", 15, steer, "gear", gear, "play", deg(0.7), "rad", most=5, orders=True, signed=False),
        _one("drag", 19, "surge", "force", hulls.drag, "k", 0.15, "1", most=6, signed=False),
    ]  # fmt: skip


def planar(speed: float, time: float, displacement: float, period: float) -> list[Mechanism]:
    """Mechanisms of a surface ship; `period` s is that of the waves' peak."""
    deg = math.radians
    flow = 0.08 * speed
    air = 3.0 * speed
    sea = {"period": period, "seed": 1.0, "spread": 0.06}
    return [
        *shared(speed, time),
        Mechanism("current", 1, "kinematics", "current", env.steady_current,
                  draw=_flow(flow), grows=("north", "east"), spans=_ways(flow)[:2],
                  units={"north": "m/s", "east": "m/s"}),
        Mechanism("rising_current", 2, "kinematics", "current", env.rising_current,
                  draw=_with(_flow(flow), period=(150 * time, 400 * time)), grows=("north", "east"),
                  spans=[{**way, "period": 300 * time} for way in _ways(flow)[:2]],
                  units={"north": "m/s", "east": "m/s", "period": "s"}),
        _one("heading_bias", 5, "sensor:psi", "sensor", sensors.heading_bias, "b", deg(1.0), "rad", most=6),
        Mechanism("compass_deviation", 6, "sensor:psi", "sensor", sensors.compass_deviation,
                  draw=_flow(deg(1.5), "A", "B"), grows=("A", "B"),
                  spans=[{"A": deg(1), "B": 0.0}, {"A": 0.0, "B": deg(1)}], units={"A": "rad", "B": "rad"}),
        _one("gyro_bias", 7, "sensor:r", "sensor", sensors.gyro_bias, "b", deg(0.1) * 6 / time, "rad/s", most=8),
        Mechanism("lever_arm", 8, "sensor:u,sensor:v", "sensor", sensors.lever_arm,
                  draw=lambda rng: {"forward": sign(rng) * speed * time * 0.08, "across": 0.0},
                  grows=("forward", "across"),
                  spans=[{"forward": 0.1 * speed * time, "across": 0.0},
                         {"forward": 0.0, "across": 0.05 * speed * time}],
                  units={"forward": "m", "across": "m"}),
        _one("sway_bias", 4, "sensor:v", "sensor", sensors.sway_bias, "b", 0.02 * speed, "m/s", most=8),
        _one("turned_log", 8, "sensor:u,sensor:v", "sensor", sensors.turned_log, "angle", deg(1.0), "rad", most=6),
        _one("position_delay", 10, "sensor:x,sensor:y", "sensor", sensors.late_position, "tau", 0.06 * time, "s",
             most=6, signed=False),
        _one("heading_delay", 10, "sensor:psi", "sensor", sensors.late_heading, "tau", 0.06 * time, "s", most=6,
             signed=False),
        Mechanism("antenna", 8, "sensor:x,sensor:y", "sensor", sensors.antenna,
                  draw=lambda rng: {"forward": sign(rng) * speed * time * 0.05, "across": 0.0},
                  grows=("forward", "across"),
                  spans=[{"forward": 0.05 * speed * time, "across": 0.0},
                         {"forward": 0.0, "across": 0.05 * speed * time}],
                  units={"forward": "m", "across": "m"}),
        Mechanism("wind", 20, "surge,sway,yaw", "force", env.wind,
                  draw=_flow(air), grows=("north", "east"), spans=_ways(air), units={"north": "m/s", "east": "m/s"},
                  most=4.0),
        Mechanism("cross_flow", 21, "sway,yaw", "force", hulls.cross_flow,
                  draw=fixed(C_d=0.5), grows=("C_d",), spans=[{"C_d": 0.5}], units={"C_d": "1"}, most=3.0),
        _one("turning_loss", 22, "surge", "force", hulls.turning_loss, "k", 0.3, "1", most=4, signed=False),
        _one("added_mass", 25, "surge,sway,yaw", "coefficients", hulls.added_mass, "k", 0.25, "1", most=3,
             signed=False),
        Mechanism("sloshing", 26, "sway,yaw", "force", hulls.sloshing,
                  draw=lambda rng: {"share": 0.05, "T": 1.2 * time}, grows=("share",),
                  spans=[{"share": 0.05, "T": T * time} for T in (0.7, 1.2)], units={"share": "1", "T": "s"},
                  most=4.0),
        _one("munk", 27, "yaw", "force", hulls.munk, "k", 0.15, "1", most=4),
        # In the form of the AUV's, to the side: Y = Z_0 rho/2 L^2 u |u|. [S] Twice the Mariner's Y_0 and N_0.
        Mechanism("asymmetry", 28, "sway,yaw", "force", hulls.asymmetry,
                  draw=lambda rng: {"Z_0": sign(rng) * 8e-5, "M_0": sign(rng) * 6e-5}, grows=("Z_0", "M_0"),
                  spans=[{"Z_0": 8e-5, "M_0": 0.0}, {"Z_0": 0.0, "M_0": 6e-5}], units={"Z_0": "1", "M_0": "1"}),
        Mechanism("waves", 29, "surge,sway,yaw", "force", env.waves,
                  draw=lambda rng: {**sea, "height": 0.006 * speed * time, "direction": around(rng),
                                    "seed": float(rng.integers(1000))},
                  grows=("height",),
                  spans=[{**sea, "height": 0.006 * speed * time, "direction": a} for a in _QUARTERS],
                  units={"height": "m", "direction": "rad", "period": "s"}, most=10.0),
        Mechanism("wave_drift", 29, "surge,sway,yaw", "force", env.wave_drift,
                  draw=lambda rng: {"height": 0.012 * speed * time, "direction": around(rng)}, grows=("height",),
                  spans=[{"height": 0.012 * speed * time, "direction": a} for a in _QUARTERS],
                  units={"height": "m", "direction": "rad"}, most=4.0),
        _one("bank", 30, "sway,yaw", "force", hulls.bank, "k", 0.003, "1", most=8),
        _one("shallow_water", 30, "sway,yaw", "coefficients", hulls.shallow, "k", 0.35, "1", most=4, signed=False),
        _one("tether", 31, "surge,sway,yaw", "force", hulls.tether, "c", 0.05 * displacement / (speed * time),
             "N s2/m2", most=6, signed=False),
        *outside(time),
    ]  # fmt: skip


def screw() -> list[Mechanism]:
    """Those of a ship whose model knows its propeller."""
    return [
        _one("propeller_walk", 16, "sway,yaw", "force", hulls.propeller_walk, "k", 0.01, "1", most=5),
        _one("thrust_aside", 16, "sway,yaw", "force", hulls.thrust_aside, "angle", 0.012, "rad", most=6),
        _one("thrust", 18, "surge", "coefficients", hulls.thrust, "k", -0.1, "1", most=2.5, signed=False),
    ]


def outside(time: float) -> list[Mechanism]:
    """Mechanisms that no library of effects names."""
    return [
        _one("one_sided_fouling", None, "yaw", "force", hulls.one_sided_fouling, "k", 0.15, "1", most=12),
        _one("memory", None, "sway", "force", hulls.memory, "k", 0.4, "1", most=8, signed=False, T=2.5 * time),
        _one("governor", None, "surge", "force", hulls.governor, "k", 0.5, "1", most=8, signed=False, T=4 * time),
        _one("stall", None, "actuator:delta", "force", hulls.stall, "k", 0.3, "1", most=3.0),
        _one("shedding", None, "yaw", "force", hulls.shedding, "k", 0.15, "1", most=8, signed=False),
    ]


_WITHOUT_RUDDER = ("stall",)
_AFLOAT = ("wind", "waves", "wave_drift", "bank", "shallow_water", "sloshing")
"""What acts on a surface ship only."""


def thrusted(speed: float, time: float, displacement: float, period: float, *, afloat: bool) -> list[Mechanism]:
    """Mechanisms of a craft that steers with fixed thrusters, on the surface (`afloat`) or under it."""
    found = [
        one
        for one in planar(speed, time, displacement, period)
        if one.kind != "gear" and one.key not in _WITHOUT_RUDDER and (afloat or one.key not in _AFLOAT)
    ]
    # Of two thrusters one side is one of them, which the library names; of four it is no effect of the library.
    number, place = (18, "actuator:n_starboard") if afloat else (None, "surge,yaw")
    return [
        *found,
        _one("thrust", 18, "surge", "coefficients", hulls.thrust, "k", -0.1, "1", most=2.5, signed=False),
        _one("weak_thrusters", number, place, "force", thrusters.weak_thrusters, "k", 0.05, "1", most=8),
    ]


@dataclass(frozen=True)
class Typical:
    """Magnitudes that go with an underwater vehicle's size and weight [S]."""

    arm: float
    """m: how far off the origin sensors stand."""
    turning: float
    """rad/s: bias of its gyro."""
    weight: float
    """Share of its weight that it is too heavy."""
    trim: tuple[float, float]
    """m forward and below: where its weight sits wrong."""
    lift: tuple[float, float]
    """Heave and pitch at no incidence, over L^2 and L^3."""
    waves: tuple[float, float]
    """Height (m) and period (s) of the waves above."""
    towed: float
    """N s2/m2: drag of a tether."""
    squeeze: float
    """N/m: buoyancy lost with depth."""


LARGE = Typical(
    arm=0.5,
    turning=math.radians(0.05),
    weight=2e-4,
    trim=(3e-4, 1e-3),
    lift=(5e-4, 3e-4),
    waves=(1.0, 10.8),
    towed=8.0,
    squeeze=3.0,
)
"""Some 5 m and 5 t at a few knots."""
SMALL = Typical(
    arm=0.3,
    turning=math.radians(0.1),
    weight=2e-3,
    trim=(1e-3, 3e-3),
    lift=(1e-4, 3e-5),
    waves=(2.0, 9.0),
    towed=1.0,
    squeeze=0.5,
)
"""Some 3 m and 230 kg at eight knots."""


def vertical(speed: float, time: float, mass: float, typical: Typical) -> list[Mechanism]:
    """Mechanisms of a vehicle in the diving plane; their second velocity is heave, their turning is pitch."""
    flow = 0.08 * speed
    arm, (forward, below), (heave, pitch), (height, period) = typical.arm, typical.trim, typical.lift, typical.waves
    return [
        *shared(speed, time),
        Mechanism("current", 1, "kinematics", "current", env.steady_current,
                  draw=lambda rng: {"north": flow * sign(rng), "east": 0.0}, grows=("north",),
                  spans=[{"north": flow, "east": 0.0}], units={"north": "m/s"}),
        Mechanism("lever_arm", 8, "sensor:u,sensor:w", "sensor", sensors.lever_arm_vertical,
                  draw=lambda rng: {"forward": sign(rng) * 0.1 * speed * time, "below": 0.0},
                  grows=("forward", "below"),
                  spans=[{"forward": arm, "below": 0.0}, {"forward": 0.0, "below": 0.6 * arm}],
                  units={"forward": "m", "below": "m"}, most=8.0),
        _one("turned_log", 8, "sensor:u,sensor:w", "sensor", sensors.turned_log, "angle", math.radians(1.0), "rad",
             most=8),
        _one("depth_scale", 9, "sensor:z", "sensor", sensors.depth, "k", 0.02, "1", most=8, b=0.0),
        _one("depth_lag", 9, "sensor:z", "sensor", sensors.late_depth, "tau", 0.15 * time, "s", most=8, signed=False),
        _one("pitch_delay", 10, "sensor:theta", "sensor", sensors.late_pitch, "tau", 0.06 * time, "s", most=8,
             signed=False),
        _one("heave_bias", 4, "sensor:w", "sensor", sensors.heave_bias, "b", 0.02 * speed, "m/s", most=8),
        _one("pitch_bias", 5, "sensor:theta", "sensor", sensors.pitch_bias, "b", math.radians(1.0), "rad", most=8),
        _one("pitch_gyro_bias", 7, "sensor:q", "sensor", sensors.pitch_gyro_bias, "b", typical.turning, "rad/s",
             most=8),
        _one("pressure_port", 8, "sensor:z", "sensor", sensors.pressure_port, "forward", arm, "m", most=8),
        _one("thrust", 18, "surge", "coefficients", hulls.thrust, "k", -0.12, "1", most=2.5, signed=False),
        Mechanism("cross_flow", 21, "heave,pitch", "force", hulls.cross_flow,
                  draw=fixed(C_d=0.6), grows=("C_d",), spans=[{"C_d": 0.6}], units={"C_d": "1"}, most=3.0),
        _one("turning_loss", 22, "surge", "force", hulls.turning_loss, "k", 0.5, "1", most=4, signed=False),
        _one("net_weight", 24, "surge,heave", "force", hulls.net_weight, "weight", typical.weight * mass * 9.81, "N",
             most=20),
        Mechanism("trim", 24, "pitch", "force", hulls.trim,
                  draw=lambda rng: {"forward": sign(rng) * forward, "below": sign(rng) * below},
                  grows=("forward", "below"),
                  spans=[{"forward": forward, "below": 0.0}, {"forward": 0.0, "below": below}],
                  units={"forward": "m", "below": "m"}, most=10.0),
        _one("added_mass", 25, "surge,heave,pitch", "coefficients", hulls.added_mass, "k", 0.25, "1", most=3,
             signed=False),
        _one("munk", 27, "pitch", "force", hulls.munk, "k", 0.15, "1", most=4),
        Mechanism("asymmetry", 28, "heave,pitch", "force", hulls.asymmetry,
                  draw=lambda rng: {"Z_0": sign(rng) * heave, "M_0": sign(rng) * pitch}, grows=("Z_0", "M_0"),
                  spans=[{"Z_0": heave, "M_0": 0.0}, {"Z_0": 0.0, "M_0": pitch}], units={"Z_0": "1", "M_0": "1"}),
        _one("wave_drift", 29, "heave", "force", env.wave_pull, "height", height, "m", most=4, signed=False,
             period=period),
        _one("tether", 31, "surge,heave,pitch", "force", hulls.tether, "c", typical.towed, "N s2/m2", most=6,
             signed=False),
        *outside(time)[:4],
        _one("compressible", None, "heave", "force", hulls.compressible, "k", typical.squeeze, "N/m", most=10,
             signed=False),
    ]  # fmt: skip
