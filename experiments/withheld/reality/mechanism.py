"""What a mechanism is: something that a vehicle's simulator may not know of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

Kind = Literal["current", "coefficients", "gear", "force", "sensor"]
Draw = Callable[[np.random.Generator], dict[str, float]]


@dataclass(frozen=True)
class Mechanism:
    """One mechanism on one family of vehicles.

    `number` is its row in the catalogue of effects, None where no library names it; `place` lists where it acts, with
    commas. `draw` gives values at a typical magnitude; `grows` names those that grow with the magnitude (the others say
    how, not how much). `spans` are sets of values whose signatures together stand for every such mechanism; `most` the
    largest believable factor on the typical magnitude. `orders` says that it shows only where the order was recorded,
    not the actual angle.
    """

    key: str
    number: int | None
    place: str
    kind: Kind
    act: Callable[..., Any]
    draw: Draw
    grows: tuple[str, ...]
    spans: Sequence[Mapping[str, float]]
    units: Mapping[str, str]
    most: float = 5.0
    orders: bool = False

    def scaled(self, values: Mapping[str, float], factor: float) -> dict[str, float]:
        """The values at another magnitude."""
        return {name: value * factor if name in self.grows else value for name, value in values.items()}


def sign(rng: np.random.Generator) -> float:
    """One or minus one."""
    return float(rng.choice((-1.0, 1.0)))


def around(rng: np.random.Generator) -> float:
    """A direction, rad."""
    return float(rng.uniform(-np.pi, np.pi))


def fixed(**values: float) -> Draw:
    """These values, each `sign` times itself where its name ends in "_"; used by mechanisms of one number."""

    def draw(rng: np.random.Generator) -> dict[str, float]:
        return {name.rstrip("_"): value * (sign(rng) if name.endswith("_") else 1.0) for name, value in values.items()}

    return draw
