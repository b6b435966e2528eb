"""A current on a black box that has no port for one: it runs in still water, and the water carries it along.

In water that moves evenly a vehicle does what it does in water at rest, seen from the water (Galileo). So a simulator
that nobody can open takes a current too: it starts with its speed through the water, and what it shows over the ground
gets the motion of the water. It may start from its states or from the recorded outputs: both are told in the water.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from seatruth.arrays import Array
from seatruth.models.base import Environment, record
from seatruth.models.black_box import BlackBox
from seatruth.models.measures import Motion, to_earth
from seatruth.trials.trial import Trial

_BODY, _OVER_GROUND, _PLACES = ("u", "v", "w"), ("v_n", "v_e", "v_d"), ("x", "y", "z")
_ANGLES = ("phi", "theta", "psi")
_UNTOLD = ("sog", "cog")
"""Outputs from which the motion of the water cannot be taken, or to which it cannot be added, one by one."""
Current = Callable[[Environment, object], Environment]
"""From an environment and what the black box shows to the environment with the current."""


def not_carried(box: BlackBox) -> str:
    """Why water cannot carry a black box; empty where it can."""
    shown = {box.standard_of(channel.name)[0] for channel in (*box.outputs, *box.innermost.outputs)}
    untold = [name for name in _UNTOLD if name in shown]
    return f"it shows {untold[0]!r}, to which no current can be added" if untold else ""


class CarriedByWater:
    """Runs of a black box in water that moves as `currents` say.

    Args:
        box: the black box, without a port for a current.
        currents: what moves the water, each from an environment and the outputs by name.
        number: `Environment.trial` of the trial.
    """

    def __init__(self, box: BlackBox, currents: Sequence[Current], number: float) -> None:
        self._box, self._currents, self._number = box, tuple(currents), number
        self._shown = record("Outputs", box.outputs)
        self._names = {box.standard_of(channel.name)[0]: channel.name for channel in box.outputs}

    def start(self, trial: Trial, first: Mapping[str, float] | None) -> tuple[Trial, dict[str, float] | None]:
        """The trial and the first state as the vehicle has them in the water: without what the current adds."""
        known = {name: float(values[0]) for name, values in trial.outputs.items() if len(values)}
        row = {channel.name: {**known, **(first or {})}.get(channel.name, 0.0) for channel in self._box.outputs}
        body, earth = self._water(float(trial.t[0]), row)
        added = dict(zip((*_BODY, *_OVER_GROUND), (*body, *earth)))
        outputs = dict(trial.outputs)
        for standard, speed in added.items():
            name = self._names.get(standard, standard)
            sign = self._box.standard_of(name)[1]
            if name in outputs:
                outputs[name] = np.asarray(outputs[name]) - sign * speed
            if first is not None and name in first:
                first = {**first, name: first[name] - sign * speed}
        return replace(trial, outputs=outputs), None if first is None else dict(first)

    def over_ground(self, trial: Trial, outputs: Array) -> Array:
        """Outputs (n, D) over the ground, from those in the water; NaN where one of these is not finite."""
        if not np.isfinite(outputs).all():
            return np.full_like(outputs, np.nan)
        names = [channel.name for channel in self._box.outputs]
        rows = [dict(zip(names, row)) for row in outputs.tolist()]
        water = [self._water(time, row) for time, row in zip(np.asarray(trial.t).tolist(), rows)]
        body, earth = (np.array([one[k] for one in water]) for k in (0, 1))
        steps = np.diff(np.asarray(trial.t))[:, None] * (earth[1:] + earth[:-1]) / 2.0
        ways = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
        found = outputs.copy()
        for standards, added in ((_BODY, body), (_OVER_GROUND, earth), (_PLACES, ways)):
            for axis, standard in enumerate(standards):
                if standard in self._names:
                    name = self._names[standard]
                    found[:, names.index(name)] += self._box.standard_of(name)[1] * added[:, axis]
        return found

    def _water(self, time: float, row: Mapping[str, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The motion of the water in body axes and in earth axes."""
        e = Environment(t=time, trial=self._number)
        s = self._shown(**row)
        for current in self._currents:
            e = current(e, s)
        body = (float(e.u_c), float(e.v_c), float(e.w_c))
        angles = {}
        for standard in _ANGLES:
            name = self._names.get(standard, "")
            angles[standard] = self._box.standard_of(name)[1] * row[name] if name else 0.0
        return body, to_earth(body, Motion(**angles))
