"""A black box with what its structure may lack: forces through its ports.

The same terms and functions of time as `DiscrepancyModel` has, as accelerations. The port takes a force, so each is
multiplied by the inertia that the simulator shows there: a force from the first sample on, over the acceleration that
it causes.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.equations import equations
from seatruth.diagnosis.discrepancy.model import MissingForces, force_input, hats
from seatruth.diagnosis.discrepancy.terms import Hump, Term
from seatruth.errors import BadInput
from seatruth.models.black_box import BlackBox
from seatruth.models.black_box_wrapper import BlackBoxWrapper
from seatruth.models.ports import FORCES, Outside, Ports
from seatruth.storage.checksum import of_source
from seatruth.trials.trial import Trial

_SEEN = 1e-6
"""Change of a motion, over its usual size, from which a force has shown itself beside rounding. [S]"""
_WANTED = 1e-2
"""The change with which an inertia is measured: large beside a simulator's noise, small enough to be linear. [S]"""
_TRIES = 8
"""Forces that are tried, each `_STRONGER` times the one before: from 1 N to 1e21 N. [S]"""
_STRONGER = 1e3
_BEGINNING = 0.02
"""Part of a trial over which the acceleration is taken, three samples at least. [S]"""


class DiscrepancyBlackBox(MissingForces, BlackBoxWrapper):
    """A black box with missing forces.

    Args:
        base: the black box, with its effects.
        knots: how many knots span the longest trial.
        duration: s, of the longest trial.
        scales: usual size of each motion and input, which makes the terms dimensionless.
        inertia: of each motion: kg, or kg m2.
        humps: of the resistance, over the speeds of the trials.
    """

    def __init__(
        self,
        base: BlackBox,
        knots: int,
        duration: float,
        scales: Mapping[str, float],
        inertia: Mapping[str, float],
        *,
        humps: Sequence[Hump] = (),
    ) -> None:
        self.inertia = dict(inertia)
        inputs, parameters = self.declare(base, knots, duration, scales, humps=humps)
        super().__init__(base, self._around, inputs=inputs, parameters=parameters)

    def _around(
        self,
        trial: Trial,
        parameters: dict[str, float],
        first_state: dict[str, float] | None,
        outside: Outside | None = None,
    ) -> Mapping[str, Array]:
        forces = np.zeros((len(trial), len(self.equations)))
        for column, (state, names) in enumerate(self.knot_names.items()):
            own = np.array([parameters[name] for name in names])
            forces[:, column] = trial.inputs[force_input(state)]
            if own.any():
                forces[:, column] += hats(np.asarray(trial.t), self.spacing, self.knots) @ own
        acting = [(term, parameters[term.name]) for term in self.terms if parameters[term.name] != 0.0]
        plain = {q.name: parameters[q.name] for q in self.base.parameters}
        if forces.any() or acting:
            # Terms are those of the input that acts: a rudder that is late is late in them as well.
            outside = AddedForces(self, self.base.acting_inputs(trial, plain), forces, acting, outside)
        y = self.base.run(trial, plain, first_state, outside)
        return {channel.name: y[:, k] for k, channel in enumerate(self.outputs)}


class AddedForces:
    """Missing forces as a function of (time, outputs), see `Outside`; it holds plain values, to be sent anywhere."""

    def __init__(
        self,
        box: DiscrepancyBlackBox,
        trial: Trial,
        forces: Array,
        acting: Sequence[tuple[Term, float]],
        then: Outside | None,
    ) -> None:
        """`forces` (n, E) are accelerations at the samples, `acting` the terms with their coefficients."""
        self._ports: Ports = box.ports
        component = {motion: name for name, (motion, _) in FORCES.items()}
        self._components = [component[state] for state in box.equations]
        self._inertia = [box.inertia[state] for state in box.equations]
        self._t, self._forces = np.asarray(trial.t), np.asarray(forces)
        names = {name for term, _ in acting for what, name in term.factors if what == "input"}
        names |= {name for term, _ in acting for _, name in term.factors if name not in _shown(box)}
        names |= {name for term, _ in acting for name, _ in term.thrusters}
        self._inputs = {name: np.asarray(trial.inputs[name]) for name in sorted(names)}
        rows = list(box.equations)
        self._terms = [
            (
                rows.index(term.state),
                value,
                [(what == "absolute", name, box.scales[name]) for what, name in term.factors],
                [(lever, name, box.scales[name]) for name, lever in term.thrusters],
                term.squared,
                None if term.hump is None else (*dataclasses.astuple(term.hump), box.scales[term.hump.speed]),
            )
            for term, value in acting
        ]
        self._then = then

    def __call__(self, t: float, outputs: Mapping[str, float]) -> dict[str, float]:
        """The value of each port, by its component."""
        missing = [float(np.interp(t, self._t, self._forces[:, k])) for k in range(len(self._components))]
        for row, product, factors, thrusters, squared, hump in self._terms:
            for absolute, name, scale in factors:
                x = (self._input(name, t) if name in self._inputs else outputs[name]) / scale
                product *= math.sqrt(x * x + 1e-12) if absolute else x
            if thrusters:
                drives = [(lever, self._input(name, t) / scale) for lever, name, scale in thrusters]
                product *= sum(lever * x * (math.sqrt(x * x + 1e-12) if squared else 1.0) for lever, x in drives)
            if hump is not None:
                name, middle, width, scale = hump
                product *= math.exp(-(((outputs[name] / scale - middle) / width) ** 2))
            missing[row] += product
        found = self._ports.nothing(t, outputs) if self._then is None else self._then(t, outputs)
        for component, inertia, value in zip(self._components, self._inertia, missing):
            found[component] += inertia * value
        return found

    def _input(self, name: str, t: float) -> float:
        return float(np.interp(t, self._t, self._inputs[name]))

    def describe(self) -> list[Any]:
        """What decides it beside the trial, as plain values."""
        then = getattr(self._then, "describe", None)
        inputs = {name: values.tolist() for name, values in self._inputs.items()}
        forces = self._forces.tolist() if self._forces.any() else []
        acting = [self._components, self._inertia, forces, inputs, self._terms]
        return [of_source(__file__), self._t.tolist(), *acting, None if then is None else then()]


class Push:
    """A constant force through one port, see `Outside`."""

    def __init__(self, ports: Ports, component: str, force: float) -> None:
        self._ports, self._component, self._force = ports, component, force

    def __call__(self, t: float, outputs: Mapping[str, float]) -> dict[str, float]:
        """The value of each port, by its component."""
        return {**self._ports.nothing(t, outputs), self._component: self._force}

    def describe(self) -> list[Any]:
        """What decides it, as plain values."""
        return [self._component, self._force]


def inertias(
    box: BlackBox, trial: Trial, parameters: Mapping[str, float], first: Mapping[str, float] | None, scales: Any
) -> dict[str, float]:
    """The inertia that each force port shows, by the motion that it drives: kg, or kg m2.

    Raises:
        BadInput: a force moves nothing, however strong it is.
    """
    names = [channel.name for channel in box.outputs]
    free = box.run(trial, parameters, first)
    count = min(len(trial) - 1, max(3, math.ceil(_BEGINNING * len(trial))))
    t = np.asarray(trial.t)[1 : count + 1] - float(trial.t[0])
    found = {}
    for motion in equations(box):
        component = next(name for name, (driven, _) in FORCES.items() if driven == motion)
        column, size = names.index(motion) if motion in names else -1, float(scales[motion])
        if column < 0:
            raise BadInput(
                f"its output {motion!r} is not among those of the study", where=f"model {box.name!r}", do="Add it."
            )

        def moved(force: float, component: str = component, column: int = column) -> Array:
            pushed = box.run(trial, parameters, first, Push(box.ports, component, force))
            return np.asarray((pushed - free)[1 : count + 1, column])

        force, change = 1.0, moved(1.0)
        for _ in range(_TRIES):
            if np.isfinite(change).all() and abs(change[-1]) > _SEEN * size:
                break
            force *= _STRONGER
            change = moved(force)
        else:
            raise BadInput(
                f"a force of {force:.0e} through its port {component} does not change {motion}",
                where=f"model {box.name!r}",
                do="Correct `ports`: the component must drive that motion.",
            )
        force *= _WANTED * size / abs(float(change[-1]))
        found[motion] = force / _initial_slope(t, moved(force))
    return found


def _initial_slope(t: Array, change: Array) -> float:
    """Slope at zero of a change that begins at zero: a straight line through change / t."""
    A = np.stack([np.ones_like(t), t], axis=1)
    return float(np.linalg.lstsq(A, change / t, rcond=None)[0][0])


def _shown(box: BlackBox) -> set[str]:
    return {channel.name for channel in box.innermost.outputs}
