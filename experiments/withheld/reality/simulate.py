"""Trials of a family: made with pilots and noise, or run again under the recorded inputs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from withheld.reality import sensors
from withheld.reality.families import RUDDER_RATE, Family
from withheld.reality.gear import Gear
from withheld.reality.manoeuvres import Manoeuvre, Trial
from withheld.reality.mechanism import Mechanism
from withheld.reality.motion import ROWS, Acting, Array, Run, Scene, Values, run
from withheld.reality.sensors import Noise
from withheld.reality.trim import level

FINE = 5
"""Steps of the integrator in one sample when trials are made; fewer when they are run again for signatures."""
SERVO_RATE = math.radians(15.8)
"""rad/s at model scale, of a steering gear whose actual angle is recorded."""
SERVO_LAG = 0.06
"""Its lag over L / U."""
BETWEEN_TRIALS = 100.0
"""L / U from the start of one trial to that of the next, for what changes by the clock."""


@dataclass(frozen=True)
class Present:
    """A mechanism that acts, with its values."""

    mechanism: Mechanism
    values: Mapping[str, float]


@dataclass
class Lane:
    """One lane: which trial it runs, its coefficients, what acts, and how its first state differs."""

    trial: int
    coefficients: Mapping[str, float]
    acting: Sequence[Present] = ()
    first: tuple[float, ...] = (0.0,) * 6


@dataclass(frozen=True)
class Record:
    """What was recorded of one trial: inputs and outputs at its samples."""

    trial: Trial
    t: Array
    delta: Array
    n: Array
    outputs: dict[str, Array]
    clean: dict[str, Array]
    """Outputs without noise: for the referee only."""
    first: tuple[float, ...]
    """The true first state."""


class Bench:
    """Lanes of one family put together for the integrator."""

    def __init__(self, family: Family, lanes: Sequence[Lane]) -> None:
        self.family, self.lanes = family, lanes
        count = len(lanes)
        self.clock = np.array([lane.trial * BETWEEN_TRIALS * family.time for lane in lanes])
        # What is the same in all lanes is a number: what is worked out from such numbers alone costs next to nothing.
        self.p: Values = {name: float(value) for name, value in family.sizes.items()}
        for name in family.coefficients:
            self.p[name] = np.array([lane.coefficients[name] for lane in lanes])
        self.gear = Gear(count, family.time)
        self.geared = any(present.mechanism.orders for lane in lanes for present in lane.acting)
        groups: dict[str, list[tuple[int, Present]]] = {}
        for row, lane in enumerate(lanes):
            for present in lane.acting:
                groups.setdefault(present.mechanism.key, []).append((row, present))
        self.currents: list[Acting] = []
        self.forces: list[Acting] = []
        self.readings: list[Acting] = []
        for members in groups.values():
            self._add(members)

    def _add(self, members: list[tuple[int, Present]]) -> None:
        mechanism = members[0][1].mechanism
        rows = np.array([row for row, _ in members], dtype=np.intp)
        names = members[0][1].values
        values = {name: np.array([present.values[name] for _, present in members]) for name in names}
        values["clock"] = self.clock[rows]
        acting = Acting(mechanism.act, rows, values)
        if mechanism.kind == "current":
            self.currents.append(acting)
        elif mechanism.kind == "force":
            self.forces.append(acting)
        elif mechanism.kind == "sensor":
            self.readings.append(acting)
        elif mechanism.kind == "coefficients":
            part = {name: value if isinstance(value, float) else value[rows] for name, value in self.p.items()}
            for name, value in mechanism.act(part, values).items():
                if isinstance(self.p[name], float):
                    self.p[name] = np.full(len(self.lanes), self.p[name])
                self.p[name][rows] = value
        else:
            for name in mechanism.grows:
                getattr(self.gear, name)[rows] += values[name]

    def scene(self) -> Scene:
        """What the integrator moves."""
        return Scene(self.family.vehicle, self.p, self.currents, self.forces)

    def first_states(self, trials: Sequence[Trial]) -> Array:
        """(10, lanes): each trial's approach, carried by the current."""
        first = np.zeros((ROWS, len(self.lanes)))
        for row, lane in enumerate(self.lanes):
            trial = trials[lane.trial]
            start = level(self.family, lane.coefficients)
            first[0, row], first[1, row] = trial.speed * start.u, trial.speed * start.w
            first[5, row] = trial.heading + start.angle
            if not self.family.vehicle.earth_current:
                first[4, row] = self.family.depth
        c, d = np.cos(first[5]), np.sin(first[5])
        for one in self.currents:
            north, east = one.act(one.values, 0.0)[:2]
            a, b = c[one.rows], d[one.rows]
            if self.family.vehicle.earth_current:
                first[0, one.rows] += north * a + east * b
                first[1, one.rows] += east * a - north * b
            else:
                first[0, one.rows] += north
        return first

    def read(self, states: Array, t: Array) -> dict[str, Array]:
        """What the sensors read, without noise, of states (time, 6, lanes)."""
        y = {name: states[:, j].copy() for j, name in enumerate(self.family.outputs)}
        if self.family.water_log:
            self._take_current_off(y, t)
        whole = len(t) > 1
        # A velocity log reads what passes its mounting; delay comes after all else.
        for one in sorted(self.readings, key=lambda one: one.act in sensors.HISTORY):
            if not whole and one.act in sensors.HISTORY:
                continue
            part = {name: value[:, one.rows] for name, value in y.items()}
            for name, value in one.act(part, one.values, t).items():
                y[name][:, one.rows] = value
        return y

    def _take_current_off(self, y: dict[str, Array], t: Array) -> None:
        """Makes the velocities (time, lanes) those through the water."""
        c, d = np.cos(y["psi"]), np.sin(y["psi"])
        for one in self.currents:
            north, east = one.act(one.values, t[:, None])[:2]
            a, b = c[:, one.rows], d[:, one.rows]
            y["u"][:, one.rows] -= north * a + east * b
            y["v"][:, one.rows] -= east * a - north * b


class Pilots:
    """One pilot for each lane; they steer by what is read, noise and all, once a sample.

    Angles that they read and orders that they give count from the vehicle's trim.
    """

    def __init__(self, bench: Bench, trials: Sequence[Trial], noise: Mapping[str, Array]) -> None:
        self.bench, self.noise, self.trials = bench, noise, trials
        self.manoeuvres: list[Manoeuvre] = [trials[lane.trial].manoeuvre() for lane in bench.lanes]
        family = bench.family
        self.slew = RUDDER_RATE * 5.94 / family.time * family.dt
        self.spin = family.revolutions / family.time * family.dt
        self.delta: Array | None = None
        levels = [level(family, lane.coefficients) for lane in bench.lanes]
        self.neutral = np.array([one.delta for one in levels])
        self.angle = np.array([one.angle for one in levels])
        self.n = np.array([family.revolutions * trials[lane.trial].speed for lane in bench.lanes])

    def interval(self, k: int, state: Array) -> tuple[Array, Array]:
        """Orders over the next sample interval, slewed."""
        family = self.bench.family
        y = self.bench.read(state[None, :6], np.array([k * family.dt]))
        read = {name: y[name][0] + self.noise[name][k] for name in y}
        read[family.craft.angle] = read[family.craft.angle] - self.angle
        wanted, share = np.empty(len(self.manoeuvres)), np.empty(len(self.manoeuvres))
        for row, manoeuvre in enumerate(self.manoeuvres):
            orders = manoeuvre(k * family.dt, {name: float(value[row]) for name, value in read.items()}, family.craft)
            wanted[row], share[row] = self.neutral[row] + orders.delta, orders.n
        if self.delta is None:
            self.delta = wanted
        end = self.delta + np.clip(wanted - self.delta, -self.slew, self.slew)
        n_end = self.n + np.clip(share * family.revolutions - self.n, -self.spin, self.spin)
        part = np.linspace(0.0, 1.0, FINE + 1)[:, None]
        delta, n = self.delta + part * (end - self.delta), self.n + part * (n_end - self.n)
        self.delta, self.n = end, n_end
        return delta, n


class Replay:
    """Recorded inputs, joined by lines: (samples, lanes) each."""

    def __init__(self, delta: Array, n: Array, substeps: int) -> None:
        self.delta, self.n = delta, n
        self.part = np.linspace(0.0, 1.0, substeps + 1)[:, None]

    def interval(self, k: int, state: Array) -> tuple[Array, Array]:
        """Recorded inputs over the next sample interval."""
        after = min(k + 1, len(self.delta) - 1)
        return (
            self.delta[k] + self.part * (self.delta[after] - self.delta[k]),
            self.n[k] + self.part * (self.n[after] - self.n[k]),
        )


def samples(family: Family, trial: Trial) -> int:
    """Samples of a trial's record."""
    return round(trial.seconds / family.dt) + 1


def make(
    family: Family, trials: Sequence[Trial], coefficients: Mapping[str, float], acting: Sequence[Present],
    noise: Mapping[str, Noise], rng: np.random.Generator, ordered: bool,
) -> list[Record]:  # fmt: skip
    """The recorded trials of one vehicle. `ordered`: the rudder's order was recorded, not its actual angle."""
    bench = Bench(family, [Lane(k, coefficients, acting) for k in range(len(trials))])
    if not ordered:
        bench.gear.lag = np.maximum(bench.gear.lag, SERVO_LAG * family.time)
        bench.gear.slowness = np.maximum(bench.gear.slowness, family.time / (5.94 * SERVO_RATE))
    length = max(samples(family, trial) for trial in trials)
    drawn = {
        name: np.stack([noise[name].draw(rng, length, family.dt) for _ in trials], axis=1) for name in family.outputs
    }
    pilots = Pilots(bench, trials, drawn)
    first = bench.first_states(trials)
    done = run(bench.scene(), first, pilots, bench.gear, length, family.dt, FINE)
    clean = _sampled(bench, done)
    records = []
    for k, trial in enumerate(trials):
        n = samples(family, trial)
        records.append(
            Record(
                trial, done.t[:n], (done.order if ordered else done.actual)[:n, k], done.n[:n, k],
                {name: (clean[name] + drawn[name])[:n, k] for name in family.outputs},
                {name: clean[name][:n, k] for name in family.outputs}, tuple(float(x) for x in first[:6, k]),
            )
        )  # fmt: skip
    return records


def replay(family: Family, records: Sequence[Record], lanes: Sequence[Lane]) -> Array:
    """Noise-free outputs (samples, 6, lanes) of lanes under the recorded inputs, in the family's order of outputs.

    A lane's first state is the recorded trial's true one plus its `first`; samples after the end of its trial repeat
    the last inputs.
    """
    bench = Bench(family, lanes)
    length = max(len(record.t) for record in records)
    delta, n = (
        np.stack([np.pad(getattr(r, name), (0, length - len(r.t)), mode="edge") for r in records], axis=1)
        for name in ("delta", "n")
    )
    which = [lane.trial for lane in lanes]
    first = np.zeros((ROWS, len(lanes)))
    first[:6] = np.array([np.add(records[lane.trial].first, lane.first) for lane in lanes]).T
    substeps = 2 if bench.geared else 1
    done = run(
        bench.scene(), first, Replay(delta[:, which], n[:, which], substeps), bench.gear, length, family.dt, substeps
    )
    found = _sampled(bench, done)
    return np.stack([found[name] for name in family.outputs], axis=1)


def _sampled(bench: Bench, done: Run) -> dict[str, Array]:
    fine = np.arange(len(done.states)) * (done.t[1] / done.substeps)
    return {name: values[:: done.substeps] for name, values in bench.read(done.states, fine).items()}
