"""The trials of the experiment on Zhao, Xie and Qiao 2018: the vehicle under a guidance that drives it round waypoints.

Tags: [P] printed in the paper, [R] reconstructed, [L] other literature, [S] chosen here, [V] by independent code. The
paper steers between waypoints that alternate left and right, and depths that alternate, in closed loop, so that the
controller itself drives the rudders to their limits [P]; its gains and distances are lost. All trials are synthetic.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatruth.manoeuvres import Manoeuvre, run_manoeuvre
from seatruth.models.torpedo import Torpedo
from seatruth.trials import Trial

Array = NDArray[np.float64]
STEP = 0.05
"""s: integration and logging."""
LIMIT = math.radians(15.0)
"""[S] of the fins."""
SPIN = 500.0
"""[S] Fastest change of revolutions, rpm/s."""
REACHED = 0.14
"""[S] A waypoint is reached within this part of a leg."""


@dataclass(frozen=True)
class Vehicle:
    """What guides one of the two vehicles; all [S] but the heading law [V]."""

    set: str
    rpm: float
    speed: float
    rate: float
    """Fin rate, deg/s."""
    leg: float
    """m between waypoints ahead."""
    offset: float
    """m to either side."""
    step: float
    """m of a step in depth."""
    depth_gain: float
    """rad/m, depth to pitch."""
    pitch_limit: float


T1 = Vehicle("T1", 1525.0, 1.542, 30.0, 25.0, 8.0, 3.0, 0.10, 0.25)
T2 = Vehicle("T2", 1000.0, 5.361, 40.0, 120.0, 40.0, 8.0, 0.03, 0.20)


@dataclass(frozen=True)
class Run(Manoeuvre):
    """A guided run: what it is told to do, by time.

    `rpm` are (until s, revolutions a minute). `weave` steers between waypoints, otherwise north; `rudder` (deg) is held
    instead where given. `depths` alternates the depth every `every` s; `planes` (deg) drives the stern planes from side
    to side, reversed when the pitch passes `reverse` (deg).
    """

    name: str
    vehicle: Vehicle
    seconds: float
    rpm: tuple[tuple[float, float], ...] = ()
    weave: bool = False
    rudder: float | None = None
    depths: bool = False
    every: float = 40.0
    planes: float | None = None
    reverse: float = 12.0
    first: float = 1.0
    """Side of the first waypoint."""
    gains: Mapping[str, float] = field(default_factory=lambda: {"psi": 3.0, "r": 1.5, "theta": 0.6, "q": 0.6})

    @property
    def label(self) -> str:
        return self.name

    def helm(self) -> Any:
        """Heading law delta = 3 e - 1.5 r [V]; depth to pitch to planes [S]."""
        k, vehicle = self.gains, self.vehicle
        now = {"leg": 1.0, "side": self.first, "planes": 1.0, "rpm": self.rpm[0][1] if self.rpm else vehicle.rpm}

        def helm(t: float, y: Mapping[str, float]) -> Mapping[str, float] | None:
            if t > self.seconds - 1e-9:
                return None
            wanted = 0.0
            if self.weave:
                ahead, across = now["leg"] * vehicle.leg - y["x"], now["side"] * vehicle.offset - y["y"]
                if ahead < 0.0 or math.hypot(ahead, across) < REACHED * vehicle.leg:
                    now["leg"] += 1.0
                    now["side"] = -now["side"]
                    ahead, across = now["leg"] * vehicle.leg - y["x"], now["side"] * vehicle.offset - y["y"]
                wanted = math.atan2(across, ahead)
            error = math.remainder(wanted - y["psi"], 2.0 * math.pi)
            rudder = k["psi"] * error - k["r"] * y["r"] if self.rudder is None else math.radians(self.rudder)
            target = vehicle.step * (int(t // self.every) % 2) if self.depths else 0.0
            pitch = _within(vehicle.depth_gain * (y["z"] - target), vehicle.pitch_limit)
            plane = k["theta"] * (y["theta"] - pitch) + k["q"] * y["q"]
            if self.planes is not None:
                if now["planes"] * y["theta"] < -math.radians(self.reverse):
                    now["planes"] = -now["planes"]
                plane = now["planes"] * math.radians(self.planes)
            rpm = next((value for until, value in self.rpm if t < until), self.rpm[-1][1]) if self.rpm else vehicle.rpm
            now["rpm"] += _within(rpm - now["rpm"], SPIN * STEP)
            return {"delta": _within(rudder, LIMIT), "delta_s": _within(plane, LIMIT), "n": now["rpm"] / 60.0}

        return helm


def plans(vehicle: Vehicle = T1) -> dict[str, Run]:
    """The runs by name: those for fitting, and those that are only predicted."""
    top = vehicle.rpm
    steps = ((12.0, 0.4 * top), (24.0, 0.6 * top), (36.0, 0.8 * top), (75.0, top), (110.0, 0.0))
    change = ((25.0, top), (50.0, 0.65 * top), (80.0, 0.85 * top), (120.0, top))
    other = ((30.0, 0.8 * top), (65.0, top), (90.0, 0.6 * top), (120.0, 0.9 * top))
    runs = (
        Run("rpm steps", vehicle, 110.0, rpm=steps),
        Run("weave", vehicle, 120.0, weave=True),
        Run("hard over", vehicle, 60.0, rudder=15.0),
        Run("depth steps", vehicle, 120.0, depths=True),
        Run("planes", vehicle, 120.0, planes=10.0),
        Run("mixed 1", vehicle, 120.0, rpm=change, weave=True, depths=True),
        Run("mixed 2", vehicle, 120.0, rpm=other, weave=True, depths=True, first=-1.0, every=30.0),
    )
    return {run.name: run for run in runs}


CHANNEL_RUNS: Mapping[str, tuple[str, ...]] = {
    "forward": ("rpm steps",),
    "roll": ("weave",),
    "lateral": ("weave", "hard over"),
    "longitudinal": ("planes",),
}
"""The runs that each channel is fitted to: each excites one channel alone [P]."""
FITTED = ("rpm steps", "weave", "hard over", "planes")
"""All of them, which the coupled model is fitted to at once."""
UNFITTED = ("mixed 1", "mixed 2")
"""Speed change and turning together, never fitted [P]."""


@cache
def truth(name: str, vehicle: str = "T1") -> Trial:
    """A planned run of the true vehicle."""
    return sail(plans(T1 if vehicle == "T1" else T2)[name])


def sail(run: Run) -> Trial:
    """The run of the true vehicle, without noise, in seatruth's axes and units."""
    vehicle = run.vehicle
    first = run.rpm[0][1] / vehicle.rpm if run.rpm else 1.0
    return run_manoeuvre(
        Torpedo(vehicle.set),
        run,
        dt=STEP,
        first_state={"u": vehicle.speed * first},
        inputs={"n": vehicle.rpm * first / 60.0},
        rudder_rate=math.radians(vehicle.rate),
        limit=run.seconds,
        name=run.name,
    )


def saturation(trial: Trial) -> dict[str, float]:
    """How hard a run drove the fins, and what it did to speed and depth."""
    full = LIMIT - 1e-3
    return {
        "rudder at its limit, %": 100.0 * float(np.mean(np.abs(trial.inputs["delta"]) > full)),
        "planes at their limit, %": 100.0 * float(np.mean(np.abs(trial.inputs["delta_s"]) > full)),
        "least speed, m/s": float(trial.outputs["u"].min()),
        "least depth, m": float(trial.outputs["z"].min()),
        "largest depth, m": float(trial.outputs["z"].max()),
        "largest sideslip, deg": float(np.degrees(np.abs(np.arctan2(trial.outputs["v"], trial.outputs["u"])).max())),
        "largest roll, deg": float(np.degrees(np.abs(trial.outputs["phi"]).max())),
        "largest pitch, deg": float(np.degrees(np.abs(trial.outputs["theta"]).max())),
    }


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
