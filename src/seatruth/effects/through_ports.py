"""Effects that act inside a black box: forces and currents through its ports, as functions of the motion so far."""

from __future__ import annotations

import inspect
import math
import uuid
from bisect import bisect_right
from collections import namedtuple
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import seatruth.effects.vehicle as vehicle_module
from seatruth.arrays import Array
from seatruth.effects.base import Effect
from seatruth.effects.channel_aliases import View
from seatruth.effects.targets import Target, aliases_of
from seatruth.effects.vehicle import DeclaredVehicle
from seatruth.models.actuators import ShownThrusts
from seatruth.models.base import Environment, record
from seatruth.models.black_box import BlackBox
from seatruth.models.geometry import Dimensions
from seatruth.models.measures import Motion, to_earth
from seatruth.models.ports import EARTH, Outside, Ports
from seatruth.storage.checksum import checksum, of_source

Acting = tuple[Effect, Target | None, Any]
"""An effect, the actuator on which it acts, and its parameters."""


class OutsideEffects:
    """What effects do through the ports of a simulator: a function of (time, outputs), see `Outside`.

    It is sent to other processes, so it holds plain values; what cannot be sent is made when it is first called.
    """

    def __init__(
        self,
        box: BlackBox,
        acting: Sequence[Acting],
        parameters: Mapping[str, float],
        t: Array,
        inputs: Array,
        number: float,
        then: Outside | None,
    ) -> None:
        """`t` (n,) s and `inputs` (n, I) are those of the trial, as they act; `then` acts beside the effects."""
        innermost = box.innermost
        self.ports: Ports = innermost.ports
        self._outputs = [channel.name for channel in innermost.outputs]
        standard = [(*innermost.standard_of(name), name) for name in self._outputs]
        self._attitude = [(angle, name, sign) for angle, sign, name in standard if angle in ("phi", "theta", "psi")]
        self._parameters = {q.name: float(parameters[q.name]) for q in innermost.parameters}
        self._t, self._inputs, self._number, self._then = t.tolist(), inputs.tolist(), number, then
        wanted = any(target is not None and target.thruster >= 0 for _, target, _ in acting)
        size = innermost.dimensions
        values = () if size is None else size(record("P", innermost.parameters)(**self._parameters))
        self._size = dict(zip(Dimensions._fields, values))
        self._vehicle = replace(DeclaredVehicle.of(innermost, with_thrusters=wanted), dimensions=None)
        self._acting = []
        for effect, target, q in acting:
            aliases = aliases_of(effect, innermost, target)
            units = {} if target is None else {target.input: target.full}
            seen, driven = View(aliases, innermost.outputs), View(aliases, innermost.inputs, (), units)
            places = (-1, -1) if target is None else (target.thruster, target.other)
            self._acting.append((effect, q._asdict(), _plain(seen), _plain(driven), places))
        self._made: Any = None

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_made": None}

    def __call__(self, t: float, outputs: Mapping[str, float]) -> dict[str, float]:
        """The value of each port, by its component."""
        if self._made is None:
            self._made = self._make()
        p, vehicle, motion, inputs, acting = self._made
        y, i = [outputs[name] for name in self._outputs], self._inputs_at(t)
        e = Environment(t=t, trial=self._number)
        if all(map(math.isfinite, y)):
            for effect, q, see, drive, _ in acting:
                if effect.current is not None:
                    e = effect.current(e, see(y), drive(i), p, q)
            d, thrusters = vehicle(motion(*y), inputs(*i), p, e)
            d = d._replace(**self._size)
            for effect, q, see, drive, (one, other) in acting:
                if effect.force is not None:
                    here = d if one < 0 else d._replace(thruster=thrusters[one])
                    here = here if other < 0 else here._replace(other=thrusters[other])
                    e = effect.force(e, see(y), drive(i), p, q, here)
        attitude = Motion(**{angle: sign * outputs[name] for angle, name, sign in self._attitude})
        found = at_ports(self.ports, e, attitude)
        if self._then is not None:
            more = self._then(t, outputs)
            found = {name: value + more[name] for name, value in found.items()}
        return found

    def describe(self) -> list[Any]:
        """What decides it beside the trial, as plain values."""
        then = getattr(self._then, "describe", None)
        effects = [[_source(type(effect)), effect.name, *plain] for effect, *plain in self._acting]
        vehicle = self._vehicle
        roles = (vehicle.thrust, vehicle.drag, vehicle.thrusts)
        return [
            [of_source(__file__), of_source(vehicle_module.__file__)],
            effects,
            self._parameters,
            self._size,
            [asdict(one) for one in vehicle.thrusters],
            [None if role is None else _source_of_function(role) for role in roles],
            self._number,
            None if then is None else then(),
        ]

    def _make(self) -> Any:
        p = _record("Parameters", tuple(self._parameters))(**self._parameters)
        acting = [
            (effect, _record("Effect", tuple(q))(**q), _See(*seen), _See(*driven), places)
            for effect, q, seen, driven, places in self._acting
        ]
        vehicle = self._vehicle
        return p, vehicle.function(), record("States", vehicle.motions), record("Inputs", vehicle.inputs), acting

    def _inputs_at(self, t: float) -> Sequence[float]:
        """Inputs (I,) at a time, linear between samples."""
        k = min(max(bisect_right(self._t, t) - 1, 0), len(self._t) - 2)
        if k < 0:
            return list(self._inputs[0])
        share = min(max((t - self._t[k]) / (self._t[k + 1] - self._t[k]), 0.0), 1.0)
        return [a + share * (b - a) for a, b in zip(self._inputs[k], self._inputs[k + 1])]


class _See:
    """The function that shows values to an effect under its own names, as `View.of` does."""

    def __init__(self, fields: Sequence[str], scales: Sequence[float]) -> None:
        self._kind, self._scales = _record("Seen", tuple(fields)), tuple(scales)

    def __call__(self, values: Sequence[float]) -> Any:
        return self._kind(*(x / scale for x, scale in zip(values, self._scales)))


def _plain(view: View) -> tuple[list[str], list[float]]:
    return list(view.kind._fields), list(view.scales)


@lru_cache(maxsize=256)
def _record(title: str, fields: tuple[str, ...]) -> Any:
    return namedtuple(title, fields)


_SOURCES: dict[Any, str] = {}


def _source(kind: type[Any]) -> str:
    """What a changed effect does not share: checksums of the files of its class and of those that it inherits from.

    A class without a file (typed into a session) shares its runs with no other class, nor with a later session.
    """
    return _sources(kind, kind.__mro__[:-1])


def _source_of_function(function: Any) -> str:
    """The same of a function that a model declares, by its own file."""
    if isinstance(function, ShownThrusts):
        return f"{_source(ShownThrusts)} {function.outputs}"
    return _sources(function, (function,))


def _sources(what: Any, parts: Sequence[Any]) -> str:
    if what not in _SOURCES:
        try:
            files = sorted({inspect.getfile(one) for one in parts})
            content = " ".join(checksum(Path(file).read_bytes()) for file in files)
        except (OSError, TypeError):
            content = uuid.uuid4().hex
        _SOURCES[what] = f"{what.__module__}.{getattr(what, '__qualname__', '')} {content}"
    return _SOURCES[what]


def at_ports(ports: Ports, e: Environment, motion: Motion) -> dict[str, float]:
    """The forces and the current of an environment as the ports take them; of the motion, the attitude counts.

    Example:
        >>> from seatruth.models import Environment, Ports
        >>> from seatruth.models.measures import Motion
        >>> found = at_ports(Ports(current=("north", "east")), Environment(u_c=0.5), Motion(psi=3.141592653589793))
        >>> round(found["north"], 6), round(found["east"], 6)
        (-0.5, 0.0)
    """
    found = {name: float(getattr(e, name)) for name in ports.force}
    body = (float(e.u_c), float(e.v_c), float(e.w_c))
    water = dict(zip(ports.current_axes, to_earth(body, motion) if ports.current_axes == EARTH else body))
    return found | {name: water[name] for name in ports.current}
