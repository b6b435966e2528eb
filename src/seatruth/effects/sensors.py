"""Between what happened and what was recorded."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from seatruth.effects.base import Effect
from seatruth.models.parameter import Parameter


class SpeedScale(Effect):
    """The speed log reads in another scale."""

    name = "speed_scale"
    title = "speed sensor scale"
    family = "sensor"
    number = 3
    source = "[S] magnitude of the catalogue: 1 to 5 %"
    needs_outputs = ("u",)
    parameters = (Parameter("k", 0.02, "1", -0.3, 0.3, source="[S] chosen here", description="relative error"),)
    null: ClassVar[Mapping[str, float]] = {"k": 0.0}

    @staticmethod
    def outputs_recorded(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(u=y.u + q.k * y.u)


class SpeedBias(Effect):
    """The speed log is off by a constant."""

    name = "speed_bias"
    title = "speed sensor bias"
    family = "sensor"
    number = 4
    source = "[S] magnitude of the catalogue: 0.01 to 0.1 m/s"
    needs_outputs = ("u",)
    parameters = (Parameter("b", 0.05, "m/s", -1.0, 1.0, source="[S] chosen here", description="added to u"),)
    null: ClassVar[Mapping[str, float]] = {"b": 0.0}

    @staticmethod
    def outputs_recorded(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(u=y.u + q.b)


class HeadingBias(Effect):
    """The compass is off by a constant angle."""

    name = "heading_bias"
    title = "heading bias"
    family = "sensor"
    number = 5
    source = "[S] magnitude of the catalogue: 0.5 to 3 deg"
    needs_outputs = ("psi",)
    parameters = (Parameter("b", 0.02, "rad", -0.3, 0.3, source="[S] chosen here", description="added to psi"),)
    null: ClassVar[Mapping[str, float]] = {"b": 0.0}

    @staticmethod
    def outputs_recorded(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(psi=y.psi + q.b)


class GyroBias(Effect):
    """The rate gyro is off by a constant rate."""

    name = "gyro_bias"
    title = "yaw gyro bias"
    family = "sensor"
    number = 7
    source = "[S] magnitude of the catalogue: 0.001 to 0.1 deg/s"
    needs_outputs = ("r",)
    parameters = (Parameter("b", 0.0005, "rad/s", -0.05, 0.05, source="[S] chosen here", description="added to r"),)
    null: ClassVar[Mapping[str, float]] = {"b": 0.0}

    @staticmethod
    def outputs_recorded(y: Any, s: Any, i: Any, q: Any, e: Any) -> Any:
        return y._replace(r=y.r + q.b)
