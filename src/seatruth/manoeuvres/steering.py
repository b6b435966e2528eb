"""What steers and drives a vehicle: a rudder and a propeller, or thrusters that push more on one side.

The one place that knows it. Manoeuvres order "delta" (rad) where a rudder steers, "yaw" (a share of the full thrust in
yaw, 1 with the thrusters of one side full ahead and those of the other full astern) where thrusters do, and "n"; here
these become orders of a model's inputs. The other way round, the steering and the drive of a record are read from its
thrusters' inputs, so that figures and recognition find them as those of a ship.

Thrust counts as its layout has it: with the square of an input, alike ahead and astern. For two thrusters the steering
is half of port minus starboard, each as a share of full thrust.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from seatruth.errors import BadInput, nearest
from seatruth.manoeuvres.plans import BY_RUDDER, BY_THRUST
from seatruth.manoeuvres.steering_gear import Gear, mean_angle, steering_gear
from seatruth.manoeuvres.thrusting import ThrusterLayout, thruster_layout
from seatruth.models.actuators import Thruster
from seatruth.models.base import Model
from seatruth.trials.trial import Trial

THRUST_DIFFERENCE = "thrust_difference"
"""The channel that steers a vehicle without a rudder: a share of full thrust in yaw, positive turns to starboard."""
_TWO = ("n_port", "n_starboard")
"""The thrusters of a log of which no model is known, both pushing ahead where positive."""


@dataclass(frozen=True)
class RudderSteering:
    """A rudder steers: its angle is recorded, and ordered. `gear` are the inputs that do where none is called delta."""

    by: Literal["rudder", "thrust"] = "rudder"
    channel: str = BY_RUDDER
    gear: Mapping[str, Gear] = field(default_factory=dict)

    def recorded(self, trial: Trial) -> Trial:
        """The trial with the channels that steer and drive it: as it is, or with delta, the mean of what steers it."""
        known = {**trial.outputs, **trial.inputs}
        angle = None if self.channel in known else mean_angle(self.gear, known)
        return trial if angle is None else replace(trial, inputs={**trial.inputs, self.channel: angle})

    def straight(self, trial: Trial) -> dict[str, float]:
        """The trial's usual inputs, what steers it apart."""
        steers = {self.channel, *self.gear}
        return {name: float(np.median(values)) for name, values in trial.inputs.items() if name not in steers}

    def ordered(self, angle: float) -> dict[str, float]:
        """Orders of all that steers, for a rudder angle, rad."""
        return {name: one.order(angle) for name, one in self.gear.items()}


@dataclass(frozen=True)
class ThrustSteering:
    """Thrusters steer; `unit` is that of their inputs."""

    layout: ThrusterLayout
    unit: str = "rev/s"
    by: Literal["rudder", "thrust"] = "thrust"
    channel: str = THRUST_DIFFERENCE

    def recorded(self, trial: Trial) -> Trial:
        """The trial with two more inputs: `thrust_difference`, and `n`, the order that would give its thrust ahead.

        Raises:
            BadInput: the trial did not record all thrusters.
        """
        if THRUST_DIFFERENCE in trial.inputs:
            return trial
        known = {**trial.outputs, **trial.inputs}
        for name in self.layout.full:
            if name not in known:
                where = f"trial {trial.name!r}"
                raise BadInput(f"it needs the thruster's input {name!r}", where=where, do=nearest(name, known))
        levels = self.layout.levels(known)
        inputs = {**trial.inputs, THRUST_DIFFERENCE: levels["yaw"]}
        ahead = self._ahead()
        if ahead and "n" not in known:
            name = max(ahead, key=lambda one: ahead[one])
            inputs["n"] = np.array([self.layout.order(name, share) for share in levels["surge"].tolist()])
        return replace(trial, inputs=inputs)

    def straight(self, trial: Trial) -> dict[str, float]:
        """The trial's usual inputs, without what its thrusters give in yaw."""
        full, yaw = self.layout.full, self.layout.axes["yaw"]
        level = self.layout.levels(trial.inputs)["yaw"]
        found = {name: float(np.median(values)) for name, values in trial.inputs.items() if name not in full}
        for name in full:
            own = self.layout.share(name, trial.inputs[name]) - yaw.get(name, 0.0) * level
            found[name] = self.layout.order(name, float(np.median(own)))
        return found

    def driven(self, n: float) -> dict[str, float]:
        """Orders of the thrusters that push ahead: `n` of those that push most, negative astern.

        Raises:
            BadInput: this is more than full power.
        """
        orders = {}
        for name, part in self._ahead().items():
            full, rest = self.layout.full[name], self.layout.rests[name]
            if abs(n - rest) > full * (1.0 + 1e-9):
                beyond = f"an order of {n:g} is beyond full power, {rest + full:g}"
                raise BadInput(beyond, where=f"thruster input {name!r}")
            orders[name] = self.layout.order(name, self.layout.share(name, n) * part)
        return orders

    @property
    def most(self) -> float:
        """The largest `n` of `driven`; zero where no thruster pushes ahead."""
        return min((self.layout.order(name, 1.0) for name in self._ahead()), default=0.0)

    @property
    def rest(self) -> float:
        """The `n` of `recorded` under which the thrusters that push ahead rest."""
        return next((self.layout.rests[name] for name in self._ahead()), 0.0)

    def _ahead(self) -> dict[str, float]:
        return dict(self.layout.axes.get("surge", {}))


Steering = RudderSteering | ThrustSteering


def limited_inputs(steering: Steering | None) -> tuple[str, ...]:
    """The inputs that are angles of rudders and planes, which move no faster than a rudder does."""
    gear = steering.gear if isinstance(steering, RudderSteering) else {}
    return ("delta", "delta_s", *(name for name, one in gear.items() if abs(one.radian) == 1.0))


def steering_of(model: Model) -> Steering | None:
    """What steers a model: its rudder (an input `delta`), what else works as one, or its thrusters; None for nothing.

    Rudders, nozzles and pods of other names are those that the model names among its actuators, or those that turn it.

    Example:
        >>> from seatruth.models import load_model
        >>> [steering_of(load_model(name)).by for name in ("mmg", "twin_thruster")]
        ['rudder', 'thrust']
    """
    if BY_RUDDER in {channel.name for channel in model.inputs}:
        return RudderSteering()
    gear = steering_gear(model, "rudder")
    if gear:
        return RudderSteering(gear=gear)
    thrusters = [actuator.input for actuator in model.actuators if isinstance(actuator, Thruster)]
    if not thrusters:
        return None
    layout = thruster_layout(model)
    units = {channel.name: channel.unit for channel in model.inputs}
    return ThrustSteering(layout, units[thrusters[0]]) if "yaw" in layout.axes else None


def steering_in(trial: Trial) -> Steering:
    """What steers a trial of which no model is known, by its channels; a rudder where nothing tells.

    `n_port` and `n_starboard` are two thrusters, both pushing ahead; full thrust is then the most that the trial holds.
    """
    known = {**trial.outputs, **trial.inputs}
    if BY_RUDDER in known or not set(_TWO) <= set(known):
        return RudderSteering()
    most = max((float(np.nanmax(np.abs(known[name]))) for name in _TWO if np.isfinite(known[name]).any()), default=0.0)
    full = dict.fromkeys(_TWO, most or 1.0)
    port, starboard = _TWO
    axes = {"surge": {port: 1.0, starboard: 1.0}, "yaw": {port: 1.0, starboard: -1.0}}
    return ThrustSteering(ThrusterLayout(axes, full, 0.0, {}, dict.fromkeys(_TWO, 0.0)))


def steered(trial: Trial, model: Model | None = None) -> Trial:
    """The trial with the channels that steer and drive it, which the functions of the figures read.

    A trial of a ship with a rudder is returned as it is. Where thrusters steer, it gets the inputs `thrust_difference`
    (share of full thrust in yaw; for two thrusters half of port minus starboard) and `n` (the order of each that would
    give the same thrust ahead).

    Args:
        trial: the run, with an input for each thruster.
        model: its model, which knows the thrusters and their full power. Without one `n_port` and `n_starboard` are
            two thrusters, and full power is the most that the trial holds.

    Raises:
        BadInput: the trial did not record all thrusters of the model.

    Example:
        >>> from seatruth.manoeuvres import TurningCircle, run_manoeuvre, turning_circle_figures
        >>> from seatruth.models import load_model
        >>> boat, ahead = load_model("twin_thruster"), {"n_port": 8.0, "n_starboard": 8.0}
        >>> run = run_manoeuvre(boat, TurningCircle(0.1, by="thrust"), first_state={"u": 1.0}, inputs=ahead)
        >>> round(turning_circle_figures(steered(run, boat)).rudder, 3)
        0.1
    """
    steering = steering_in(trial) if model is None else steering_of(model)
    return trial if steering is None else steering.recorded(trial)


def steering_channel(trial: Trial) -> str:
    """The name of the input that steers a trial, after `steered`."""
    return THRUST_DIFFERENCE if THRUST_DIFFERENCE in trial.inputs and BY_RUDDER not in trial.inputs else BY_RUDDER


class Allocation:
    """Turns a manoeuvre's orders into orders of a model's inputs, through one run.

    Where thrusters steer, what they give in yaw comes on top of what each gave before; all are reduced alike where one
    would have to give more than it can.

    Args:
        model: the model, and `steering` what steers it, from `steering_of`.
        inputs: those with which the run begins.
        label: the name of the manoeuvre, for messages.
    """

    def __init__(self, model: Model, steering: Steering | None, inputs: Mapping[str, float], label: str) -> None:
        self._model, self._label = model.name, label
        self._channels = {channel.name for channel in model.inputs}
        self._thrust = steering if isinstance(steering, ThrustSteering) else None
        self._rudder = steering if isinstance(steering, RudderSteering) and steering.gear else None
        self._yaw = 0.0
        self._base: dict[str, float] = {}
        if self._thrust is not None:
            layout = self._thrust.layout
            self._base = {name: float(layout.share(name, inputs.get(name, 0.0))) for name in layout.full}

    def __call__(self, orders: Mapping[str, float]) -> Mapping[str, float]:
        """The orders by input of the model.

        Raises:
            BadInput: an order that the model has no input for.
        """
        if orders.keys() <= self._channels:
            return orders
        found: dict[str, float] = {}
        allocated = False
        for name, value in orders.items():
            if name in self._channels:
                found[name] = value
            elif self._rudder is not None and name == BY_RUDDER:
                found |= self._rudder.ordered(value)
            elif self._thrust is not None and name == BY_THRUST:
                self._yaw, allocated = value, True
            elif self._thrust is not None and name == "n":
                layout = self._thrust.layout
                driven = self._thrust.driven(value)
                self._base |= {one: float(layout.share(one, order)) for one, order in driven.items()}
                allocated = True
            elif value != 0.0:
                raise BadInput(
                    f"{self._label} orders {name!r}, which is no input of model {self._model!r}", do=self._advice(name)
                )
        return {**found, **self._allocated()} if allocated else found

    def _allocated(self) -> dict[str, float]:
        assert self._thrust is not None
        layout = self._thrust.layout
        yaw = layout.axes["yaw"]
        shares = {name: share + self._yaw * yaw.get(name, 0.0) for name, share in self._base.items()}
        return layout.given(shares, max(1.0, *(abs(share) for share in self._base.values())))

    def _advice(self, name: str) -> str:
        if self._thrust is not None and name == BY_RUDDER:
            return (
                'Its thrusters steer it: give a share of full thrust: --turn 20%, or TurningCircle(0.2, by="thrust").'
            )
        if name == BY_THRUST and (self._rudder is not None or BY_RUDDER in self._channels):
            return 'A rudder steers it: give an angle in rad, by="rudder".'
        return ""
