"""Between an order or a reading and what the actuator really does."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.models.parameter import Parameter


class RudderOffset(Effect):
    """The rudder stands off its reading by a constant angle."""

    name = "rudder_offset"
    title = "rudder zero offset"
    family = "actuator"
    number = 12
    source = "[S] magnitude of the catalogue: 0.2 to 2 deg"
    needs_inputs = ("delta",)
    parameters = (Parameter("angle", 0.02, "rad", -0.2, 0.2, source="[S] chosen here", description="added to delta"),)
    null: ClassVar[Mapping[str, float]] = {"angle": 0.0}

    @staticmethod
    def inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=i.delta + q.angle)


class RudderGain(Effect):
    """The rudder works as if turned by another share of its reading; one with an error of the rudder's coefficient."""

    name = "rudder_gain"
    title = "rudder effectiveness"
    family = "actuator"
    number = 13
    source = "[S] magnitude of the catalogue: 0.8 to 1.2"
    needs_inputs = ("delta",)
    parameters = (Parameter("k", 0.9, "1", 0.3, 1.7, source="[S] chosen here", description="factor on delta"),)
    null: ClassVar[Mapping[str, float]] = {"k": 1.0}

    @staticmethod
    def inputs(i: Any, s: Any, q: Any, e: Any) -> Any:
        return i._replace(delta=q.k * i.delta)
