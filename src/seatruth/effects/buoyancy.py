"""Weight and buoyancy that change on the way: with the depth, and with time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from seatruth.effects.kinematics import G
from seatruth.effects.loading import Weight, with_weight
from seatruth.models.parameter import Parameter, Prior


class BuoyancyGradient(Weight):
    """Net weight that changes with the depth: denser water below, or a hull or foam that is compressed."""

    name = "buoyancy_gradient"
    title = "buoyancy that changes with depth"
    cause = "loading.weight.with_depth"
    number = 24
    equation = "a weight share m g z at the origin"
    source = "[L] hydrostatics; [S] magnitude: a pycnocline of 0.02 kg/m3 per m, or foam that is squeezed"
    kinds = ("auv", "glider")
    acts_on = ("surge", "heave")
    confused_with = ("net_weight", "flooding", "depth_scale")
    distinguished_by = "nothing at the surface, and the same down and up: one trial at two depths"
    needs_states = ("w", "z")
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter(
            "share",
            2e-5,
            "1/m",
            -0.02,
            0.02,
            source="[S] 0.02 kg/m3 per m",
            description="heavier with depth is positive, denser water below negative",
        ),
    )
    null: Mapping[str, float] = {"share": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return with_weight(e, s, q.share * d.mass * G * s.z)


class Flooding(Weight):
    """Net weight that grows from the start of each trial on: a leak, or air that leaves the hull."""

    name = "flooding"
    title = "weight that grows with time"
    cause = "loading.weight.with_time"
    number = 24
    equation = "a weight share m g t at lever L ahead of the origin"
    source = "[L] statics; [S] magnitude: a leak of half a litre an hour into a hull of 15 kg"
    kinds = ("auv", "glider")
    acts_on = ("surge", "heave", "pitch", "yaw")
    confused_with = ("net_weight", "buoyancy_gradient", "trim")
    distinguished_by = "the same depth and speed ask for more and more lift: a long straight run"
    needs_states = ("w",)
    needs_vehicle = ("dimensions",)
    parameters = (
        Parameter("share", 1e-5, "1/s", 0.0, 0.01, source="[S] half a litre an hour, 15 kg", description="per second"),
        Parameter(
            "lever",
            0.0,
            "1",
            -0.6,
            0.6,
            prior=Prior(0.0, 0.2),
            source="[S] anywhere in the hull",
            description="where the water gathers, ahead of the origin / L",
        ),
    )
    null: Mapping[str, float] = {"share": 0.0}

    @staticmethod
    def force(e: Any, s: Any, i: Any, p: Any, q: Any, d: Any) -> Any:
        return with_weight(e, s, q.share * d.mass * G * e.t, q.lever * d.length)
