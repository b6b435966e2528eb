"""The menu from which the next trial is put together: manoeuvres made of what the recorded trials did.

Each input's range, the usual values and the length come from the trials themselves, so that it fits any model.
Thrusters that a model names are driven along its axes (yaw by differential thrust, heave) and one after another. A
manoeuvre lasts as long as the longest trial; up to three can follow one another in one trial. Many trials are on
record when a further one is asked for: one of the same length holds too little beside them to change much, and what
single manoeuvres cannot tell apart, their sequence often does (a bias from a scale by another speed, say). No input
moves faster than it did on record: by steps that no gear follows, a lag would be told from a delay at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.problem import Problem
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.effects.undeclared_actuators import resting_inputs, steering_inputs
from seatruth.manoeuvres import thruster_layout
from seatruth.models import Model, Thruster
from seatruth.models.actuators import at_full_power
from seatruth.trials.trial import Trial, Trials

MAX_PHASES = 3
"""Manoeuvres in one trial. [S] A crew can sail three in a row without a break."""
THEN = ", then "
COURSES = {"": 0.0, "beam course: ": math.pi / 2, "reciprocal course: ": math.pi}
"""Words before a trial, and by how much its first heading is turned."""
SLOW_START = "slow start: "
"""Words before a trial that begins at a part of the usual speed; for models that have no drive among their inputs."""
_AHEAD = ("u", "u_w", "sog")
"""What shows the speed."""
_SLOW = 0.6
"""Part of the usual drive in slow manoeuvres, and of the usual speed in a slow start."""
_TOGETHER = 0.9
"""Correlation of two inputs from which they are actuators of one kind that move together. [S]"""
_ANGLE = "rad"
"""Unit of what steers: it is never a drive, however long it was held."""
_TRIM = 0.25
"""Part of the largest angle up to which a median is a trim; beyond it, most of the time was spent in turns. [S]"""
YAW = "yaw thrust"
_FEW = 3
"""Axes of thrusters up to which each has every manoeuvre; on more, turns one way, zigzags and staircases do. [S]"""
_STILL = 1e-6
"""Reach of an input that did not move in the trials, or less: `Menu.full` is never zero."""
_SLOWEST = 0.25
"""Part of a zigzag's leg that an input takes to its full reach at most, however slowly it moved on record. [S]"""
_SHORTER = 0.8
"""Steps in which the leg of a zigzag is shortened. [S]"""
_STAIRS = (0.25, 0.5, 0.75, 0.0, -0.25, -0.5, -0.75, 0.0)
"""Parts of the largest angle in a staircase."""


@dataclass(frozen=True)
class Phase:
    """One manoeuvre: its name, what is done, and the inputs (n,) that are not held at their usual values."""

    name: str
    text: str
    inputs: dict[str, Array]


@dataclass(frozen=True)
class Manoeuvre:
    """One entry of the menu: a trial of one or more manoeuvres, in words and as inputs over time."""

    name: str
    text: str
    trial: Trial


class Menu:
    """What can be asked of a vehicle, from its trials."""

    def __init__(self, problem: Problem) -> None:
        self.pattern = max(problem.trials, key=lambda trial: trial.duration)
        self.step = float(np.median(np.diff(self.pattern.t)))
        self.leg = _leg(self.pattern.duration / 8.0, problem)
        """Time of a zigzag's leg and of a stair, s."""
        self.inputs = [channel.name for channel in problem.study.model.inputs]
        units = self.units = {channel.name: channel.unit for channel in problem.study.model.inputs}
        self.turns = "psi" in problem.outputs
        self.standard = problem.study.model.standard
        values = {name: np.concatenate([np.asarray(t.inputs[name]) for t in problem.trials]) for name in self.inputs}
        resting, steers = resting_inputs(problem.study.model) or {}, steering_inputs(problem.study.model, "rudder")
        self.rest = {name: resting.get(name, 0.0) for name in self.inputs}
        """The value of each input at which what it moves rests."""
        about = {name: value - self.rest[name] for name, value in values.items()}
        angles = {name for name in self.inputs if units[name] == _ANGLE or name in steers}
        self.usual = {name: self.rest[name] + _usual(v, name in angles) for name, v in about.items()}
        self.full = {name: max(float(np.abs(v - self.usual[name]).max()), 1e-9) for name, v in values.items()}
        self.recorded = {name: (float(value.min()), float(value.max())) for name, value in values.items()}
        """Least and largest value of each input on record."""
        self.rates = {name: self._fastest(name, problem.trials) for name in self.inputs}
        """Fastest change of each input on record, in its unit per s; infinite where it never moved."""
        self.drives = [
            n
            for n in self.inputs
            if (n not in angles and abs(self.usual[n] - self.rest[n]) > 2.0 * float(np.std(values[n])))
            or n in ("n", "rpm")
        ]
        self.thrusters = _thrusters(problem.study.model)
        """Inputs of the thrusters of a model that has several, each with its size at full power."""
        moved = [name for name in _moved(problem.study.model, units) if name not in self.thrusters]
        self.steering = _of_one_kind([name for name in moved if name not in self.drives], units, values)
        self.driving = _of_one_kind([name for name in moved if name in self.drives], units, values)
        axes = thruster_layout(problem.study.model).axes if self.thrusters else _unnamed_axes(problem.study.model)
        # A thruster that holds a depth works all the time as well, and does not drive: slowed, the vehicle would rise.
        ahead = axes.get("surge", self.thrusters)
        thrusting = tuple(name for name in self.thrusters if name in self.drives and name in ahead)
        self.driving += [thrusting] if thrusting else []
        alike = tuple(name for name in axes.get("yaw", {}) if name not in self.thrusters)
        if alike:  # drives without a name that turn it by their difference, and drive it by their sum
            self.steering = [left for group in self.steering if (left := _without(group, alike))]
            self.driving = [left for group in self.driving if (left := _without(group, alike))]
            self.driving += [alike] if set(alike) <= set(self.drives) else []
        self.axes = {
            f"{axis} thrust": reach
            for axis, shares in axes.items()
            if (reach := self._along(shares, values)) and not (thrusting and axis == "surge")
        }
        """Thrust along each axis: how far each input goes. The manoeuvres of a drive hold surge."""
        self.t = np.arange(0.0, self.pattern.duration - 0.5 * self.step, self.step)
        self.phases = {phase.name: phase for phase in self._phases()}

    @property
    def seconds(self) -> float:
        """Length of one manoeuvre."""
        return self.pattern.duration

    def starts(self) -> list[str]:
        """Words for the first headings and speeds that can be chosen."""
        slow = [SLOW_START] if not self.drives and {*_AHEAD, "v_n"} & self._measured() else []
        return [*(list(COURSES) if self.turns else [""]), *slow]

    def _measured(self) -> set[str]:
        """Standard names of what the longest trial recorded."""
        return {self.standard.get(name, (name, 1))[0] for name in self.pattern.outputs}

    def trial(self, names: Sequence[str], start: str = "") -> Manoeuvre:
        """These manoeuvres one after another, in one trial that begins as the longest one did."""
        many = len(names) * len(self.t) + 1
        t = self.step * np.arange(many, dtype=np.float64)
        inputs = {}
        for name in self.inputs:
            parts = [self.phases[n].inputs.get(name, np.full(self.t.shape, self.usual[name])) for n in names]
            order = np.concatenate([*parts, parts[-1][-1:]])
            inputs[name] = _no_faster(order, self.usual[name], self.step * self.rates[name])
        title = start + THEN.join(names)
        texts = [self.phases[n].text for n in names]
        if start == SLOW_START:
            texts[0] = f"from {100 * _SLOW:.0f} % of the usual speed, {texts[0]}"
        length = f"{len(names) * self.seconds:.3g} s in all"
        text = f"{'; then '.join(texts)}; {length}"
        return Manoeuvre(title, text, Trial(title, t, inputs, self._outputs(many, start), synthetic=True))

    def named(self, words: str) -> Manoeuvre:
        """The entry of this name; KeyError if there is none."""
        start = next((word for word in (*COURSES, SLOW_START) if word and words.startswith(word)), "")
        return self.trial(words.removeprefix(start).split(THEN), start)

    def _outputs(self, many: int, start: str) -> dict[str, Array]:
        """Outputs that stand for the first state, at the samples at which the recorded trials were compared."""
        first, step = {}, {}
        for name, series in self.pattern.outputs.items():
            finite = np.flatnonzero(np.isfinite(np.asarray(series)))
            first[name] = float(np.asarray(series)[finite[0]]) if finite.size else 0.0
            step[name] = max(1, round(float(np.median(np.diff(finite)))) if finite.size > 1 else 1)
        self._start_straight(first, start)
        outputs = {}
        for name, value in first.items():
            outputs[name] = np.full(many, np.nan)
            outputs[name][:: step[name]] = value
        return outputs

    def _start_straight(self, first: dict[str, float], start: str) -> None:
        """Turns first values of outputs to the first heading and speed of a trial that begins straight ahead."""
        measured = {self.standard.get(name, (name, 1))[0]: name for name in first}
        if "psi" in first:
            first["psi"] += COURSES.get(start, 0.0)
        for name in _AHEAD:
            if name in measured and start == SLOW_START:
                first[measured[name]] *= _SLOW
        for name in ("v", "r", "p", "q", "phi", measured.get("v_w", "")):
            if name in first:
                first[name] = 0.0
        if "cog" in measured:
            first[measured["cog"]] = first.get("psi", first[measured["cog"]] + COURSES.get(start, 0.0))
        if "psi" in first and {"v_n", "v_e"} <= measured.keys():
            north, east = measured["v_n"], measured["v_e"]
            speed = math.hypot(first[north], first[east]) * (_SLOW if start == SLOW_START else 1.0)
            first[north], first[east] = speed * math.cos(first["psi"]), speed * math.sin(first["psi"])

    def _phases(self) -> list[Phase]:
        found = [phase for group in self.steering for phase in self._steered(_words(group), self._reach(group))]
        for axis, reach in self.axes.items():
            phases = self._steered(axis, reach)
            found += phases if len(self.axes) <= _FEW else [phases[0], phases[2], phases[5]]
        found += [self._one_by_one()] if self.thrusters else []
        for group in self.driving:
            found += self._driven(group)
            slow = {name: np.full(self.t.shape, self._slowed(name)) for name in group}
            turning = {axis: reach for axis, reach in self.axes.items() if axis == YAW}
            for words, reach in ({_words(others): self._reach(others) for others in self.steering} | turning).items():
                for phase in self._steered(words, reach)[:3]:
                    text = f"{_words(group)} at {100 * _SLOW:.0f} % of the usual, {phase.text}"
                    lower = {n: slow[n] - self.usual[n] for n in slow if n in phase.inputs}
                    steered = {n: self._possible(n, x + lower.get(n, 0.0)) for n, x in phase.inputs.items()}
                    found.append(Phase(f"slow {phase.name}", text, {**slow, **steered}))
        return [*found, Phase("straight run", "inputs held", {})]

    def _fastest(self, name: str, trials: Trials) -> float:
        changes = [np.abs(np.diff(np.asarray(one.inputs[name])) / np.diff(np.asarray(one.t))) for one in trials]
        rate = max((float(change.max(initial=0.0)) for change in changes), default=0.0)
        return max(rate, self.full[name] / (_SLOWEST * self.leg)) if self.full[name] > _STILL else math.inf

    def _reach(self, group: Sequence[str]) -> dict[str, float]:
        """How far actuators that move together go from their usual values."""
        return {name: self.full[name] for name in group}

    def _along(self, shares: Mapping[str, float], values: Mapping[str, Array]) -> dict[str, float]:
        """How far each input goes for thrust along an axis: as far as the trials went along it, and as it did itself.

        Empty where one of them never moved. A boat that stops takes its drives from 600 to 0 rpm, both at once: that
        is no reason to let one run at 1200 rpm beside one that stands.
        """
        most = min(self.full[name] / abs(share) for name, share in shares.items())
        went = sum(share * (values[name] - self.usual[name]) for name, share in shares.items())
        most = min(most, float(np.abs(went).max()) / sum(share**2 for share in shares.values()))
        return {name: most * share for name, share in shares.items()} if most > _STILL else {}

    def _one_by_one(self) -> Phase:
        """Each thruster in turn: one that drives at a part of its usual order, another one at its full reach."""
        place = np.minimum((self.t / self.seconds * len(self.thrusters)).astype(int), len(self.thrusters) - 1)
        orders = {}
        for k, name in enumerate(self.thrusters):
            usual = self.usual[name]
            other = self._slowed(name) if name in self.drives else usual + self.full[name]
            orders[name] = self._possible(name, np.where(place == k, other, usual))
        each = self.seconds / len(self.thrusters)
        return Phase("one thruster after another", f"each thruster alone, for {each:.3g} s", orders)

    def _slowed(self, name: str) -> float:
        """A drive at a part of its usual order."""
        return self.rest[name] + _SLOW * (self.usual[name] - self.rest[name])

    def _possible(self, name: str, order: Array | float) -> Array:
        """An order within full power, where it is known, and of a drive between rest and the most on record."""
        power, rest = self.thrusters.get(name, math.inf), self.rest[name]
        low, high = self.recorded[name] if name in self.drives else (-math.inf, math.inf)
        return np.asarray(np.clip(order, max(min(low, rest), rest - power), min(max(high, rest), rest + power)))

    def _steered(self, name: str, reach: Mapping[str, float]) -> list[Phase]:
        """Manoeuvres of actuators that move together, so far each: rudders, or thrust along an axis."""
        t, half = self.t, self.leg
        ends = ", ".join(
            f"{n} {float(self._possible(n, self.usual[n] + x)):.3g} {self.units[n]}".removesuffix(" 1")
            for n, x in reach.items()
        )
        verb, full = ("step of", f"as far as it went ({ends})") if name in self.axes else ("turn by", "hard over")
        stairs = np.array(_STAIRS)[np.minimum((t / half).astype(int), len(_STAIRS) - 1)]

        def moved(part: Array | float) -> dict[str, Array]:
            usual = {n: np.full(t.shape, self.usual[n]) for n in reach}
            return {n: self._possible(n, usual[n] + size * part) for n, size in reach.items()}

        return [
            Phase(f"{verb} +{name}", f"{name} {full} and held", moved(1.0)),
            Phase(f"{verb} -{name}", f"{name} {full} to the other side and held", moved(-1.0)),
            Phase(f"zigzag of {name}", f"{name} {full}, alternating every {half:.3g} s", moved(_square(t, half))),
            Phase(
                f"small zigzag of {name}",
                f"{name} at a quarter, alternating every {half / 2.5:.3g} s",
                moved(0.25 * _square(t, half / 2.5)),
            ),
            Phase(
                f"wide zigzag of {name}",
                f"{name} at a half, alternating every {2 * half:.3g} s",
                moved(0.5 * _square(t, 2 * half)),
            ),
            Phase(
                f"staircase of {name}",
                f"{name} in steps of {half:.3g} s: a quarter, a half, three quarters, none, the same to the other side",
                moved(stairs),
            ),
        ]

    def _driven(self, group: Sequence[str]) -> list[Phase]:
        t, end, name = self.t, self.seconds, _words(group)
        ramp = np.where((t < end / 3) | (t >= 2 * end / 3), 1.0, _SLOW)
        stop = np.where(t < end / 4, 1.0, 0.0)
        rests = {self.rest[n] for n in group}
        rest = "zero" if rests == {0.0} else f"{rests.pop():g}" if len(rests) == 1 else "rest"

        def driven(part: Array) -> dict[str, Array]:
            return {n: self.rest[n] + (self.usual[n] - self.rest[n]) * part for n in group}

        return [
            Phase(
                f"steps of {name}",
                f"{name} to {100 * _SLOW:.0f} % of the usual and back, straight",
                driven(ramp),
            ),
            Phase(
                f"coast-down ({name} to {rest})",
                f"{name} to {rest} after a quarter of {end:.3g} s",
                driven(stop),
            ),
        ]


def _leg(longest: float, problem: Problem) -> float:
    """The longest time, s, in which no trial turned by more than half a circle: beyond, legs would be circles."""
    model, leg = problem.study.model, longest
    name = next((c.name for c in model.outputs if model.standard_of(c.name)[0] == "psi"), "")
    for trial in problem.trials:
        psi = np.asarray(trial.outputs.get(name, np.zeros(0)))
        valid = np.isfinite(psi)
        if valid.sum() < 2:
            continue
        t, heading = np.asarray(trial.t)[valid], np.unwrap(psi[valid])
        while np.abs(np.interp(t + leg, t, heading) - heading).max() > math.pi:
            leg *= _SHORTER
    return leg


def _usual(values: Array, steers: bool) -> float:
    """The value from which manoeuvres start: the median, for an angle its trim.

    The median of a zigzag or of turns is the angle of the turns. Manoeuvres about it would leave what was recorded.
    """
    usual = float(np.median(values))
    turning = steers and abs(usual) > _TRIM * float(np.abs(values).max())
    return 0.0 if turning else usual


def _thrusters(model: Model) -> dict[str, float]:
    resting = resting_inputs(model) or {}
    thrusters = [one for one in model.actuators if isinstance(one, Thruster)]
    found = {one.input: at_full_power(one.full, resting.get(one.input, 0.0)) for one in thrusters}
    return found if len(found) > 1 else {}


def _unnamed_axes(model: Model) -> dict[str, dict[str, float]]:
    """Thrust in yaw by the difference of drives without a name that are alike, as `ThrusterLayout.axes`."""
    for kind in kinds_of_drives(model):
        most = max(abs(levers["yaw"]) for levers in kind.values())
        if most > 0.0:
            return {"yaw": {name: levers["yaw"] / most for name, levers in kind.items()}}
    return {}


def _without(group: tuple[str, ...], names: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in group if name not in names)


def _moved(model: Model, units: Mapping[str, str]) -> list[str]:
    """Inputs that a manoeuvre can order: where a model names its actuators, a voltage or a measured motion is none."""
    named = {actuator.input for actuator in model.actuators}
    return [name for name, unit in units.items() if not named or name in named or unit == _ANGLE]


def _of_one_kind(names: Sequence[str], units: Mapping[str, str], values: Mapping[str, Array]) -> list[tuple[str, ...]]:
    """Actuators in groups that moved together in the recorded trials: of one unit, and correlated."""
    groups: list[list[str]] = []
    for name in names:
        for group in groups:
            a, b = values[group[0]], values[name]
            moving = float(np.std(a)) > 0.0 and float(np.std(b)) > 0.0
            if units[name] == units[group[0]] and moving and float(np.corrcoef(a, b)[0, 1]) > _TOGETHER:
                group.append(name)
                break
        else:
            groups.append([name])
    return [tuple(group) for group in groups]


def _no_faster(order: Array, usual: float, most: float) -> Array:
    """An order that begins at its usual value and changes by at most so much from one sample to the next."""
    found, at = np.empty_like(order), usual
    for k, wanted in enumerate(order.tolist()):
        at += min(max(wanted - at, -most), most)
        found[k] = at
    return found


def _words(group: Sequence[str]) -> str:
    return " and ".join(group)


def _square(t: Array, half: float) -> Array:
    """+1 and -1 in turn, each for so long."""
    return np.where(np.floor(t / half + 1e-9) % 2 == 0, 1.0, -1.0)
