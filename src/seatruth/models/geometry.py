"""What effects use of a model beyond its channels: the size of the vehicle, its thrust and its drag."""

from __future__ import annotations

from typing import Any, NamedTuple


class Dimensions(NamedTuple):
    """A vehicle's size: `length`, `breadth`, `draft` m (a body's height where it is under water), `mass` kg of the
    vehicle itself, without added mass, and `rho` kg/m3 of the water.
    """

    length: Any
    breadth: Any
    draft: Any
    mass: Any
    rho: Any


class Vehicle(NamedTuple):
    """The dimensions of a vehicle with its thrust and its drag in straight motion (N), from which effects make forces.

    `thrust` is positive forwards; `thrust_0` is the one at the same revolutions with the vehicle at rest; `drag` is
    positive against forward motion. Everything that the model does not declare is zero.
    """

    length: Any = 0.0
    breadth: Any = 0.0
    draft: Any = 0.0
    mass: Any = 0.0
    rho: Any = 0.0
    thrust: Any = 0.0
    thrust_0: Any = 0.0
    drag: Any = 0.0
