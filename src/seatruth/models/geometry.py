"""What effects use of a model beyond its channels: the size of the vehicle, its thrust and its drag."""

from __future__ import annotations

from typing import Any, NamedTuple

from seatruth.models.actuators import Thrust


class Dimensions(NamedTuple):
    """A vehicle's size: `length`, `breadth`, `draft` m (a body's height where it is under water), `mass` kg of the
    vehicle itself, without added mass, and `rho` kg/m3 of the water.

    `frontal_area` and `lateral_area` m2 are those above water, where they are known; None lets effects estimate them.
    """

    length: Any
    breadth: Any
    draft: Any
    mass: Any
    rho: Any
    frontal_area: Any = None
    lateral_area: Any = None


class Vehicle(NamedTuple):
    """The dimensions of a vehicle with its thrust and its drag in straight motion (N), from which effects make forces.

    `thrust` is positive forwards; `thrust_0` is the one at the same revolutions with the vehicle at rest; `drag` is
    positive against forward motion. Everything that the model does not declare is zero.

    An effect on thrusters acts on one at a time: `thruster`, beside the `other` of a pair. `load` is the mean size of
    all thrusters' drive, between 0 and 1.
    """

    length: Any = 0.0
    breadth: Any = 0.0
    draft: Any = 0.0
    mass: Any = 0.0
    rho: Any = 0.0
    frontal_area: Any = None
    lateral_area: Any = None
    thrust: Any = 0.0
    thrust_0: Any = 0.0
    drag: Any = 0.0
    thruster: Thrust = Thrust()
    other: Thrust = Thrust()
    load: Any = 0.0
