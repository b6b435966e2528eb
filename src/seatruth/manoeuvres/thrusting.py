"""Manoeuvres of vehicles with several thrusters: steps along one axis, spirals by differential thrust, station keeping.

Thrust is ordered as a share of full thrust. A thruster's order goes with the root of its share, as thrust goes with
the square of the order, beyond the dead band that the layout knows; a thruster with another law gives nearly what was
meant, and the record holds what was ordered.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from seatruth.effects.undeclared_actuators import resting_inputs
from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres.plans import Helm, Manoeuvre, Orders
from seatruth.manoeuvres.stepper import Stepper
from seatruth.models.actuators import Thruster, at_full_power, push
from seatruth.models.base import Model, record

AXES: Mapping[str, str] = {"surge": "u", "sway": "v", "heave": "w", "roll": "p", "pitch": "q", "yaw": "r"}
"""The axes along and about which thrusters push, and the state that a model needs for each."""
LEAST_REACHED = 0.5
"""Part of a unit force or moment that the thrusters must give of it alone, with as little of the others as they can:
those of an axis below it cannot act along it. Chosen here [S]."""

MOST_TRIM: Mapping[str, float] = {"north": 10.0, "east": 10.0, "z": 10.0, "psi": math.pi}
"""m and rad: how far beside its place a vehicle may be sent, so that the current brings it there. Chosen here [S]."""
UPRIGHT = 4.0
"""How many times quicker than its place a vehicle's roll and pitch come back: they turn its thrust. Chosen here [S]."""


@dataclass(frozen=True)
class ThrusterLayout:
    """What the thrusters of a model can do.

    `axes` gives for each axis on which they can act the share of its thrust that each input orders, the largest one 1;
    `full` what each input adds at full power to the one in `rests`, at which the thruster rests; `dead_band` the part
    of it that gives no thrust; `accelerations` (m/s2, rad/s2) what full thrust along an axis gives at rest.
    """

    axes: Mapping[str, Mapping[str, float]]
    full: Mapping[str, float]
    dead_band: float
    accelerations: Mapping[str, float]
    rests: Mapping[str, float]

    def orders(self, levels: Mapping[str, float]) -> dict[str, float]:
        """Orders for thrust along several axes at once, each a share of full thrust.

        All are reduced alike where a thruster would have to give more than it can.
        """
        shares = dict.fromkeys(self.full, 0.0)
        for axis, level in levels.items():
            for name, share in self.axes[axis].items():
                shares[name] += level * share
        return self.given(shares)

    def given(self, shares: Mapping[str, float], limit: float = 1.0) -> dict[str, float]:
        """Orders for a share of full thrust of each thruster, all reduced alike where one would give over `limit`."""
        most = max(1.0, *(abs(share) / limit for share in shares.values()))
        return {name: self.order(name, share / most) for name, share in shares.items()}

    def share(self, name: str, order: Any) -> Any:
        """The share of its full thrust that one thruster gives under an order (n,), as `order` has it."""
        over = order - self.rests[name]
        size = np.maximum(0.0, np.abs(over) / self.full[name] - self.dead_band) / (1.0 - self.dead_band)
        return np.sign(over) * size * size

    def levels(self, orders: Mapping[str, Any]) -> dict[str, Any]:
        """The thrust along each axis (n,) under the orders of all thrusters (n,), as a share of full thrust."""
        shares = np.array([self.share(name, orders[name]) for name in self.full])
        columns = np.array([[parts.get(name, 0.0) for parts in self.axes.values()] for name in self.full])
        return dict(zip(self.axes, np.linalg.pinv(columns) @ shares, strict=True))

    def order(self, name: str, share: float) -> float:
        """The order for a share of the full thrust of one thruster; that at which it rests for none."""
        rest = self.rests[name]
        if share == 0.0:
            return rest
        size = self.dead_band + (1.0 - self.dead_band) * math.sqrt(abs(share))
        return rest + self.full[name] * math.copysign(size, share)


def thruster_layout(
    model: Model, inputs: Mapping[str, float] = MappingProxyType({}), dead_band: float = 0.0
) -> ThrusterLayout:
    """The layout of a model's thrusters, from their places and directions at its nominal parameters.

    Args:
        model: the model, which names its thrusters.
        inputs: those that the thrusters do not order, {"voltage": 16.0}; only accelerations depend on them.
        dead_band: part of the full input that gives no thrust, which orders step over.

    Raises:
        BadInput: the model names no thruster, or the dead band is no part of one.

    Example:
        >>> from seatruth.models import load_model
        >>> layout = thruster_layout(load_model("twin_thruster"))
        >>> {name: round(share, 6) for name, share in layout.axes["yaw"].items()}
        {'n_port': 1.0, 'n_starboard': -1.0}
    """
    thrusters = [actuator for actuator in model.actuators if isinstance(actuator, Thruster)]
    if not thrusters:
        raise BadInput("it names no thruster", where=f"model {model.name!r}", do="List them in its `actuators`.")
    if not 0.0 <= dead_band < 1.0:
        raise BadInput(f"a dead band of {dead_band:g} is no part of full power", do="Give it between 0 and 1.")
    p = record("Parameters", model.parameters)(**model.nominal())
    resting = resting_inputs(model) or {}
    full = {one.input: at_full_power(one.full, resting.get(one.input, 0.0)) for one in thrusters}
    orders = list(full)
    states = {channel.name for channel in model.states}
    rows = [k for k, state in enumerate(AXES.values()) if state in states]
    pushes = np.zeros((6, len(orders)))
    for one in thrusters:
        pushes[:, orders.index(one.input)] += push(one, p)
    # Only what the model can feel counts: a thruster of a boat in the plane heaves nothing.
    pushes = pushes[rows]
    inverse = np.linalg.pinv(pushes, rcond=1e-9)
    axes = {}
    for k, row in enumerate(rows):
        shares = inverse[:, k]
        if float(pushes[k] @ shares) >= LEAST_REACHED:
            # Rounded, so that a vehicle alike on both sides is ordered alike, and keeps its course to the last digit.
            shares = np.round(shares / np.abs(shares).max(), 12)
            axes[list(AXES)[row]] = {
                name: float(share) for name, share in zip(orders, shares, strict=True) if abs(share) > 1e-9
            }
    still = ThrusterLayout(axes, full, dead_band, {}, {name: resting.get(name, 0.0) for name in full})
    return replace(still, accelerations={axis: _acceleration(model, still, axis, inputs) for axis in axes})


def _acceleration(model: Model, layout: ThrusterLayout, axis: str, inputs: Mapping[str, float]) -> float:
    """Of the model at rest under full thrust along an axis, less that without thrust."""
    stepper, rest = Stepper(model), {**{channel.name: 0.0 for channel in model.inputs}, **inputs, **layout.orders({})}
    place = [channel.name for channel in model.states].index(AXES[axis])
    still = stepper.first({})
    driven = stepper.rate(0.0, still, {**rest, **layout.orders({axis: 1.0})})[place]
    return driven - stepper.rate(0.0, still, rest)[place]


@dataclass(frozen=True)
class AxisSteps(Manoeuvre):
    """Thrust along one axis in `levels` (shares of full thrust), each held for `hold` s, on top of `ahead` in surge.

    A staircase in yaw with some thrust ahead is the spiral by differential thrust.
    """

    layout: ThrusterLayout
    axis: str
    levels: tuple[float, ...]
    hold: float
    ahead: float = 0.0

    def __post_init__(self) -> None:
        for axis in (self.axis, *(("surge",) if self.ahead else ())):
            if axis not in self.layout.axes:
                raise BadInput(f"the thrusters cannot act in {axis!r}", do=nearest(axis, self.layout.axes))
        if not self.hold > 0.0 or not self.levels:
            raise BadInput("steps need levels and a time to hold them", where="manoeuvre")

    @property
    def label(self) -> str:
        ahead = f", {self.ahead:g} ahead" if self.ahead else ""
        return f"{self.axis} steps {_slashed(self.levels)}{ahead}"

    def helm(self) -> Helm:
        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            step = math.floor(t / self.hold + 1e-9)
            if step >= len(self.levels):
                return None
            levels = {"surge": self.ahead} if self.ahead else {}
            levels[self.axis] = levels.get(self.axis, 0.0) + self.levels[step]
            return self.layout.orders(levels)

        return helm


@dataclass(frozen=True)
class ThrusterSteps(Manoeuvre):
    """One thruster after another, each alone at `levels` (shares of its full thrust), each level for `hold` s."""

    layout: ThrusterLayout
    levels: tuple[float, ...]
    hold: float

    def __post_init__(self) -> None:
        if not self.hold > 0.0 or not self.levels:
            raise BadInput("steps need levels and a time to hold them", where="manoeuvre")

    @property
    def label(self) -> str:
        return f"single thrusters {_slashed(self.levels)}"

    def helm(self) -> Helm:
        inputs = list(self.layout.full)

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            step = math.floor(t / self.hold + 1e-9)
            if step >= len(inputs) * len(self.levels):
                return None
            name, level = inputs[step // len(self.levels)], self.levels[step % len(self.levels)]
            return {**self.layout.orders({}), name: self.layout.order(name, level)}

        return helm


@dataclass(frozen=True)
class StationKeeping(Manoeuvre):
    """Keeps a place, and a heading where the thrusters can push sideways, for `duration` s.

    Each axis comes back as a critically damped oscillator of `period` s would, as far as its thrust reaches; what stays
    off under a current is worked out within some `trim` s. A vehicle without thrust sideways heads for the place where
    it is more than `reach` m off, keeps its heading where it is nearer, and lies down-current of it, without that trim.
    Roll and pitch are kept level, and quicker, where the thrusters can.

    Args:
        layout: what the thrusters can do, from `thruster_layout`, with the inputs that hold in the run.
        duration: s.
        at: the place, m: x, y and, where the thrusters can heave, the depth z.
        heading: rad; the first one where None.
        period, trim, reach: as above.

    Raises:
        BadInput: the thrusters cannot act in surge and yaw, or a number is not positive.

    Example:
        >>> from seatruth.manoeuvres import run_manoeuvre, steady_current
        >>> from seatruth.models import load_model
        >>> rov, inputs = load_model("bluerov2"), {"voltage": 15.0}
        >>> plan = StationKeeping(thruster_layout(rov, inputs, dead_band=0.07), 100.0)
        >>> run = run_manoeuvre(rov, plan, inputs=inputs, environment=steady_current(0.2, 0.0))
        >>> bool(abs(run.outputs["x"][-1]) < 0.1)
        True
    """

    layout: ThrusterLayout
    duration: float
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading: float | None = None
    period: float = 10.0
    trim: float = 20.0
    reach: float = 0.5

    def __post_init__(self) -> None:
        for axis in ("surge", "yaw"):
            if not self.layout.accelerations.get(axis, 0.0) > 0.0:
                do = "Name the model's other inputs to thruster_layout."
                raise BadInput(f"the thrusters do not push in {axis!r} and keep no station", where="manoeuvre", do=do)
        if not min(self.duration, self.period, self.trim, self.reach) > 0.0:
            raise BadInput("duration, period, trim and reach must be positive", where="manoeuvre")

    @property
    def label(self) -> str:
        return f"station keeping {self.duration:g} s"

    def helm(self) -> Helm:
        rotates, dives = "sway" in self.layout.axes, "heave" in self.layout.axes
        omega = 2.0 * math.pi / self.period
        held = dict.fromkeys(("north", "east", "z", "psi"), 0.0)
        now: dict[str, float] = {}

        def level(axis: str, error: float, speed: float, quicker: float = 1.0) -> float:
            rate = quicker * omega
            return _within((rate * rate * error - 2.0 * rate * speed) / self.layout.accelerations[axis], 1.0)

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            if t > self.duration - 1e-9:
                return None
            if not now:
                now.update(t=t, heading=y["psi"] if self.heading is None else self.heading)
            north, east = self.at[0] - y["x"], self.at[1] - y["y"]
            if not rotates and math.hypot(north, east) > self.reach:
                now["heading"] = math.atan2(east, north)
            off = {"north": north, "east": east, "psi": _wrapped(now["heading"] - y["psi"])}
            if dives:
                off["z"] = self.at[2] - y["z"]
            for name, error in off.items():
                if rotates:
                    held[name] = _within(held[name] + error * (t - now["t"]) / self.trim, MOST_TRIM[name])
                off[name] = error + held[name]
            now["t"] = t
            cos_p, sin_p = math.cos(y["psi"]), math.sin(y["psi"])
            levels = {
                "surge": level("surge", off["north"] * cos_p + off["east"] * sin_p, y["u"]),
                "yaw": level("yaw", off["psi"], y["r"]),
            }
            for axis, angle, rate in (("roll", "phi", "p"), ("pitch", "theta", "q")):
                if axis in self.layout.axes:
                    levels[axis] = level(axis, -y[angle], y[rate], UPRIGHT)
            if rotates:
                levels["sway"] = level("sway", off["east"] * cos_p - off["north"] * sin_p, y["v"])
            if dives:
                levels["heave"] = level("heave", off["z"], y["w"])
            return self.layout.orders(levels)

        return helm


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def _wrapped(angle: float) -> float:
    """The same angle within half a turn of zero."""
    return math.atan2(math.sin(angle), math.cos(angle))


def _slashed(levels: tuple[float, ...]) -> str:
    return "/".join(f"{level:g}" for level in levels)
