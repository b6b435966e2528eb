"""One long synthetic recording of many manoeuvres, with the times at which the helmsman began and ended each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from seatruth.manoeuvres import CoastDown, Manoeuvre, Straight, TurningCircle, Zigzag, add_noise, run_manoeuvre
from seatruth.manoeuvres.plans import Helm, Orders
from seatruth.models import load_model
from seatruth.trials import Trial

NOISE = {
    **dict.fromkeys(("x", "y"), 0.05),
    "psi": math.radians(0.1),
    **dict.fromkeys(("u", "v"), 0.005),
    "r": math.radians(0.03),
}
DRIVE = 11.85


@dataclass(frozen=True)
class Day(Manoeuvre):
    """Manoeuvres one after another; between them a helmsman goes back to the course and the speed for `pause` s."""

    plans: tuple[Manoeuvre, ...]
    course: float = 0.0
    pause: float = 90.0
    times: list[tuple[float, float]] = field(default_factory=list)
    """First order and end of each, s; written while the run is sailed."""

    @property
    def label(self) -> str:
        return "a day"

    def helm(self) -> Helm:
        now = {"plan": 0, "since": 0.0, "turns": 0.0}
        helms: list[Helm] = []

        def helm(t: float, y: Mapping[str, float]) -> Orders | None:
            back = {"delta": _towards(self.course, y), "n": DRIVE}
            if not helms:
                if t - now["since"] < self.pause:
                    return back
                if now["plan"] >= len(self.plans):
                    return None
                helms.append(self.plans[int(now["plan"])].helm())
                now["since"] = t
            orders = helms[0](t - now["since"], y)
            if orders is None:
                self.times.append((now["since"], t))
                helms.clear()
                now.update(plan=now["plan"] + 1, since=t)
                return back
            return {"n": DRIVE, **orders}

        return helm


def _towards(course: float, y: Mapping[str, float]) -> float:
    """A helmsman's rudder: moderate, back to the course by the shorter way."""
    off = math.remainder(course - y["psi"], 2 * math.pi)
    return max(-math.radians(25), min(math.radians(25), 1.5 * off - 6.0 * y["r"]))


def long_log(seed: int = 0, *, noise: float = 1.0) -> tuple[Trial, list[tuple[str, float, float]]]:
    """The recording and its manoeuvres in their order: kind, first order and end, s."""
    deg = math.radians
    plans: list[tuple[str, Manoeuvre]] = [
        ("zigzag", Zigzag(deg(20), deg(20), "starboard", approach=0.0)),
        ("turning circle", TurningCircle(deg(35), deg(500), approach=0.0)),
        ("zigzag", Zigzag(deg(10), deg(10), "port", approach=0.0)),
        ("straight run", Straight(80.0)),
        ("turning circle", TurningCircle(deg(-20), deg(400), approach=0.0)),
        ("stop", CoastDown(160.0, approach=0.0)),
    ]
    day = Day(tuple(plan for _, plan in plans))
    log = run_manoeuvre(
        load_model("mmg"),
        day,
        dt=0.5,
        first_state={"u": 1.18},
        inputs={"n": DRIVE},
        rudder_rate=deg(15.8),
        limit=3000.0,
    )
    rng = np.random.default_rng(seed)
    noisy = add_noise(log, {name: noise * sd for name, sd in NOISE.items()}, rng)
    return noisy, [(kind, start, end) for (kind, _), (start, end) in zip(plans, day.times)]
