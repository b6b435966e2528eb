"""The integrator and what it moves: lanes of one vehicle beside one another, each a trial or a variant of one.

Kutta's 3/8 rule at a step several times finer than the recorded one, vectorised over lanes. All arrays are NumPy's,
SI units, rad. A state has 10 rows: three body velocities, two positions, one angle, and four of the mechanisms' own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from withheld.reality.gear import Gear

Array = NDArray[np.float64]
Values = dict[str, Any]
ROWS = 10
"""Rows of a state."""


@dataclass
class View:
    """What forces are computed from, each (lanes,): ground velocities, relative velocities, position, actuators."""

    t: float
    u: Array
    v: Array
    r: Array
    x: Array
    y: Array
    psi: Array
    own: Array
    """(4, lanes): the mechanisms' own states."""
    u_c: Array
    v_c: Array
    du_c: Array
    dv_c: Array
    delta: Array
    n: Array

    def part(self, rows: NDArray[np.intp]) -> View:
        """The view of some lanes."""
        return _Part(self, rows)

    @property
    def u_r(self) -> Array:
        """Forward velocity through the water."""
        return self.u - self.u_c

    @property
    def v_r(self) -> Array:
        """Second velocity through the water."""
        return self.v - self.v_c


class _Part(View):
    """Some lanes of a view; what a force does not ask for is not copied."""

    def __init__(self, whole: View, rows: NDArray[np.intp]) -> None:
        self.t, self._whole, self._rows = whole.t, whole, rows

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._whole, name)[..., self._rows]
        setattr(self, name, value)
        return value


@dataclass(frozen=True)
class Force:
    """What a force mechanism gives back: two forces (N), a moment (N m), and rates of own states by row."""

    X: Array | float = 0.0
    Y: Array | float = 0.0
    N: Array | float = 0.0
    rates: Mapping[int, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Acting:
    """A mechanism at work in some lanes, with its values there: each (len(rows),)."""

    act: Callable[..., Any]
    rows: NDArray[np.intp]
    values: Values


class Vehicle(Protocol):
    """Equations of one vehicle."""

    earth_current: bool
    """Whether the second position is horizontal, so that a current turns with the angle into both velocities."""

    def rates(self, view: View, p: Values, X: Array, Y: Array, N: Array) -> tuple[Array, ...]:
        """d/dt of the six rows that a vehicle has of its own."""
        ...


class Helm(Protocol):
    """Who gives the orders."""

    def interval(self, k: int, state: Array) -> tuple[Array, Array]:
        """Orders from sample k to k + 1: actuator and revolutions, each (substeps + 1, lanes)."""
        ...


@dataclass(frozen=True)
class Run:
    """A run on the fine grid. `states` (steps + 1, 6, lanes); the others at samples, (samples, lanes)."""

    t: Array
    states: Array
    substeps: int
    order: Array
    actual: Array
    n: Array

    @property
    def sampled(self) -> Array:
        """(samples, 6, lanes)."""
        return self.states[:: self.substeps]


@dataclass
class Scene:
    """A vehicle, its coefficients by lane, and what acts on it."""

    vehicle: Vehicle
    p: Values
    currents: Sequence[Acting] = ()
    forces: Sequence[Acting] = ()

    def __post_init__(self) -> None:
        """What each force is told of its lanes."""
        self._own = [{k: v if isinstance(v, float) else v[one.rows] for k, v in self.p.items()} for one in self.forces]

    def rates(self, t: float, s: Array, delta: Array, n: Array) -> Array:
        """d/dt of the states (10, lanes)."""
        lanes = s.shape[1]
        c, d = np.cos(s[5]), np.sin(s[5])
        if self.currents:
            north, east = np.zeros(lanes), np.zeros(lanes)
            north_rate, east_rate = np.zeros(lanes), np.zeros(lanes)
            for one in self.currents:
                found = one.act(one.values, t)
                for total, part in zip((north, east, north_rate, east_rate), found, strict=True):
                    total[one.rows] += part
            u_c, v_c, turn = self._turned(north, east, c, d, s[2])
            gu, gv, _ = self._turned(north_rate, east_rate, c, d, s[2])
            du_c, dv_c = turn * s[2] * v_c + gu, -turn * s[2] * u_c + gv
        else:
            u_c = v_c = du_c = dv_c = np.zeros(lanes)
        view = View(t, s[0], s[1], s[2], s[3], s[4], s[5], s[6:], u_c, v_c, du_c, dv_c, delta, n)
        X, Y, N = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
        rates = np.zeros_like(s)
        for one, p in zip(self.forces, self._own, strict=True):
            got: Force = one.act(view.part(one.rows), one.values, p)
            X[one.rows] += got.X
            Y[one.rows] += got.Y
            N[one.rows] += got.N
            for row, rate in got.rates.items():
                rates[6 + row, one.rows] += rate
        rates[:6] = self.vehicle.rates(view, self.p, X, Y, N)
        return rates

    def _turned(self, a: Array, b: Array, c: Array, d: Array, r: Array) -> tuple[Array, Array, float]:
        if self.vehicle.earth_current:
            return a * c + b * d, b * c - a * d, 1.0
        # In the vertical plane the angle is nose up and the second position is depth.
        return a * c - b * d, a * d + b * c, -1.0


def run(scene: Scene, first: Array, helm: Helm, gear: Gear, samples: int, dt: float, substeps: int) -> Run:
    """Runs all lanes from `first` (10, lanes) over `samples` samples `dt` apart."""
    h = dt / substeps
    lanes = first.shape[1]
    states = np.empty((1 + (samples - 1) * substeps, 6, lanes))
    order, actual, turns = (np.empty((samples, lanes)) for _ in range(3))
    s = first.copy()
    states[0] = s[:6]
    acting: Array | None = None
    for k in range(samples):
        orders, n = helm.interval(k, s)
        if acting is None:
            acting = gear.start(orders[0])
        order[k], actual[k], turns[k] = orders[0], gear.actual, n[0]
        if k == samples - 1:
            break
        for j in range(substeps):
            after = gear.advance(orders[j + 1], h)
            s = _step(scene, (k * substeps + j) * h, h, s, (acting, after), (n[j], n[j + 1]))
            acting = after
            states[k * substeps + j + 1] = s[:6]
    return Run(np.arange(samples, dtype=np.float64) * dt, states, substeps, order, actual, turns)


def _step(scene: Scene, t: float, h: float, s: Array, delta: tuple[Array, Array], n: tuple[Array, Array]) -> Array:
    """Kutta's 3/8 rule; actuators run straight through the step."""

    def at(c: float, z: Array) -> Array:
        return scene.rates(t + c * h, z, delta[0] + c * (delta[1] - delta[0]), n[0] + c * (n[1] - n[0]))

    a = at(0.0, s)
    b = at(1 / 3, s + h / 3 * a)
    c = at(2 / 3, s + h * (b - a / 3))
    d = at(1.0, s + h * (a - b + c))
    return s + h / 8 * (a + 3 * b + 3 * c + d)
