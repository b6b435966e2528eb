"""What an effect may ask of a model beyond its channels: how large the vehicle is, what pushes and what brakes it."""

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


class Body(NamedTuple):
    """What a force of an effect is made from: the dimensions, and N of thrust and of drag in straight motion.

    `thrust` is positive forwards; `thrust_0` is the one at the same revolutions with the vehicle at rest; `drag` is
    positive against forward motion. What the model does not declare is zero.
    """

    length: Any = 0.0
    breadth: Any = 0.0
    draft: Any = 0.0
    mass: Any = 0.0
    rho: Any = 0.0
    thrust: Any = 0.0
    thrust_0: Any = 0.0
    drag: Any = 0.0
