"""A model with what its structure may lack: forces in its equations of motion.

The missing acceleration in each equation is a sum of

* terms in the motion and the inputs, the same in every trial (a damping or a wake of another form);
* a function of time of each trial's own, straight lines between knots.

Both are accelerations (m/s2, rad/s2) added to the rate of a state, so that any model can carry them. The terms and the
knots are parameters that vanish at zero. The functions of time that are already known enter as inputs `force_STATE`,
since a parameter has one value for all trials, and so do the hats of the knots: between samples an input is a straight
line, and a knot lies between two of them. Hats of the time itself would make derivatives that differ from what is
simulated by a thousandth, and where a run is unstable, tens of metres of a knot cancel to millimetres.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.equations import acceleration_unit, equations, motions, rests, vehicle
from seatruth.diagnosis.discrepancy.terms import Hump, Term, ahead_of, humps_between, terms_of
from seatruth.effects.alike_drives import kinds_of_drives
from seatruth.effects.extended import ExtendedModel
from seatruth.models.base import Environment, Equations, Model
from seatruth.models.motion_records import motion
from seatruth.models.observed import shows_accelerations
from seatruth.models.parameter import Parameter
from seatruth.models.wrapper import ModelWrapper
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial

_CURRENTS = {"u": "u_c", "v": "v_c", "w": "w_c"}
"""Current in the direction of each speed, by the speed's standard name."""


class MissingForces:
    """What a model with missing forces says of them, whether its equations are known or not.

    Attributes:
        equations: words for the equations that have them, by state.
        knots, spacing: how many knots there are, and s between two of them.
        knot_names: the parameters of each equation's function of time, by state.
        terms: the terms of all equations; each has a parameter of its name.
        scales: usual size of each motion and input, which makes the terms dimensionless.
        rests: the inputs at which drives rest, where that is not zero: terms count from there.
    """

    equations: dict[str, str]
    knots: int
    spacing: float
    knot_names: dict[str, tuple[str, ...]]
    terms: tuple[Term, ...]
    scales: dict[str, float]
    rests: dict[str, float]

    def declare(
        self,
        base: Model,
        knots: int,
        duration: float,
        scales: Mapping[str, float],
        *,
        humps: Sequence[Hump] = (),
    ) -> tuple[list[Channel], list[Parameter]]:
        """Sets the attributes; returns the inputs and parameters that `base` gets besides its own.

        `duration` (s) is that of the longest trial.
        """
        self.equations, self.terms = equations(base), tuple(terms_of(base, humps))
        self.rests = rests(base)
        self.knots, self.spacing, self.scales = knots, duration / (knots - 1), dict(scales)
        self.knot_names = {state: tuple(f"knot_{state}_{k}" for k in range(knots)) for state in self.equations}
        units = {state: acceleration_unit(base, state) for state in self.equations}
        parameters = [Parameter(name, 0.0, units[state]) for state, names in self.knot_names.items() for name in names]
        parameters += [Parameter(term.name, 0.0, units[term.state]) for term in self.terms]
        return [Channel(force_input(state), unit) for state, unit in units.items()], parameters


class DiscrepancyModel(MissingForces, ModelWrapper):
    """A model with missing forces.

    Args:
        base: the model, with its effects.
        knots: how many knots span the longest trial.
        duration: s, of the longest trial.
        scales: usual size of each state and input, which makes the terms dimensionless.
        humps: of the resistance, over the speeds of the trials.
    """

    def __init__(
        self,
        base: Model,
        knots: int,
        duration: float,
        scales: Mapping[str, float],
        *,
        humps: Sequence[Hump] = (),
    ) -> None:
        inputs, parameters = self.declare(base, knots, duration, scales, humps=humps)
        inputs += [Channel(hat_input(k), "1") for k in range(knots)]
        super().__init__(base, inputs=inputs, parameters=parameters)
        # Held forces would lag the knots, by which derivatives are taken, by half a sample.
        self.linear = (*base.linear, *(channel.name for channel in inputs))

    def make_rhs(self) -> Equations:
        split_p, split_i, base, lacking = self.split_parameters(), self.split_inputs(), self.base.rhs, self._lacking()

        def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            p, own = split_p(p)
            i, forces = split_i(i)
            rates = list(base(s, i, p, e))
            for row, added in lacking(s, i, p, own, forces, e):
                rates[row] = rates[row] + added
            return tuple(rates)

        return rhs

    def make_output(self) -> Equations | None:
        """Outputs of accelerations feel the missing forces too; no other output does."""
        base = self.base.output
        if base is None or not shows_accelerations(self.base):
            return super().make_output()
        split_p, split_i, lacking = self.split_parameters(), self.split_inputs(), self._lacking()
        standard = [self.base.standard.get(c.name, (c.name, 1)) for c in self.base.states]
        names = tuple(f"{name}_dot" if f"{name}_dot" in Environment._fields else "" for name, _ in standard)
        signs = tuple(float(sign) for _, sign in standard)

        def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
            p, own = split_p(p)
            i, forces = split_i(i)
            more = e
            for row, added in lacking(s, i, p, own, forces, e):
                if names[row]:
                    more = more._replace(**{names[row]: getattr(more, names[row]) + signs[row] * added})
            return tuple(base(s, i, p, more))

        return output

    def _lacking(self) -> Any:
        """The function of (s, i, p, own parameters, forces, e) that gives (row of a state, missing acceleration).

        Its terms are those of what acts: a rudder that is late is late in them as well, and a hull feels the motion
        through the water.
        """
        surroundings = self.base.make_surroundings() if isinstance(self.base, ExtendedModel) else None
        order = [channel.name for channel in self.base.states]
        rows = [order.index(state) for state in self.equations]
        standard = self.base.standard_of
        knots, scales, terms = self.knots, self.scales, self.terms
        resting = self.rests
        term_rows = [order.index(term.state) for term in terms]
        currents = {name: (_CURRENTS[of], sign) for name in order for of, sign in [standard(name)] if of in _CURRENTS}

        def factor(which: tuple[str, str], s: Any, i: Any, e: Any) -> Any:
            what, name = which
            x = getattr(i if what == "input" or not hasattr(s, name) else s, name)
            if name in currents:
                current, sign = currents[name]
                x = x - sign * getattr(e, current)
            x = (x - resting[name] if name in resting else x) / scales[name]
            return math.sqrt(x * x + 1e-12) if what == "absolute" else x

        def lacking(s: Any, i: Any, p: Any, own: Any, forces: Any, e: Any) -> list[tuple[int, Any]]:
            i, e = (i, e) if surroundings is None else surroundings(s, i, p, e)
            found, shapes = [], forces[len(rows) :]
            for place, row in enumerate(rows):
                total = forces[place]
                for k in range(knots):
                    total = total + own[place * knots + k] * shapes[k]
                found.append((row, total))
            for term, row, coefficient in zip(terms, term_rows, own[len(rows) * knots :]):
                product = coefficient
                for which in term.factors:
                    product = product * factor(which, s, i, e)
                if term.hump is not None:
                    beyond = (factor(("state", term.hump.speed), s, i, e) - term.hump.middle) / term.hump.width
                    product = product * math.exp(-beyond * beyond)
                if term.thrusters:
                    drives = [(lever, factor(("input", name), s, i, e)) for name, lever in term.thrusters]
                    product = product * sum(
                        lever * drive * (math.sqrt(drive * drive + 1e-12) if term.squared else 1.0)
                        for lever, drive in drives
                    )
                found.append((row, product))
            return found

        return lacking


def force_input(state: str) -> str:
    """Name of the input that holds the missing acceleration of a state's equation."""
    return f"force_{state}"


def hat_input(knot: int) -> str:
    """Name of the input that holds the linear B-spline of a knot."""
    return f"hat_{knot}"


def hats(t: Array, spacing: float, knots: int) -> Array:
    """Linear B-splines at times t (n,), s: (n, knots)."""
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(t[:, None] / spacing - np.arange(knots))))


def with_forces(trial: Trial, model: MissingForces, forces: Array | None = None) -> Trial:
    """The trial with the missing accelerations among its inputs: `forces` (equations, knots), zero where None.

    A model whose equations are known gets the hats of the knots as well.
    """
    shapes: dict[str, Array] = {}
    if isinstance(model, DiscrepancyModel):
        basis = _basis(trial, model)
        shapes = {hat_input(k): basis[:, k] for k in range(model.knots)}
    none = np.zeros((len(model.equations), model.knots))
    shaped = dataclasses.replace(trial, inputs={**trial.inputs, **shapes})
    return with_moved_forces(shaped, model, none if forces is None else forces)


def with_moved_forces(trial: Trial, model: MissingForces, forces: Array) -> Trial:
    """A trial that has all that `with_forces` gives it, with other missing accelerations: `forces` (equations, knots).

    No other input is made anew, so that a simulator can keep what it knows of these.
    """
    basis = _basis(trial, model)
    forced = {force_input(state): basis @ forces[k] for k, state in enumerate(model.equations)}
    return dataclasses.replace(trial, inputs={**trial.inputs, **forced})


def _basis(trial: Trial, model: MissingForces) -> Array:
    """The hats of a model's knots at a trial's samples, (n, knots)."""
    return hats(np.asarray(trial.t) - float(trial.t[0]), model.spacing, model.knots)


def can_carry(model: Model) -> bool:
    """Whether missing forces can be added to a model: not where nothing moves, nor to a black box without a port."""
    return bool(equations(model))


def scales_of(model: Model, trials: Sequence[Trial]) -> dict[str, float]:
    """Usual size of each state and input: its root mean square in the record; 1 where that does not show it.

    Inputs count from where drives rest. Those of drives of one kind have one size, the largest: their terms add them
    up.
    """
    sizes, resting = {}, rests(model)
    moving = [channel.name for channel in motions(model)]
    for name in dict.fromkeys([*moving, *(channel.name for channel in model.inputs)]):
        parts = [
            np.asarray(source[name]) for trial in trials for source in (trial.outputs, trial.inputs) if name in source
        ]
        if not parts and name in moving:
            parts = [series[1] for trial in trials if (series := motion(model, trial, name)) is not None]
        values = np.concatenate(parts) - resting.get(name, 0.0) if parts else np.zeros(0)
        values = values[np.isfinite(values)]
        size = float(np.sqrt(np.mean(values**2))) if values.size else 0.0
        sizes[name] = size if size > 0.0 else 1.0
    for kind in kinds_of_drives(model):
        sizes |= dict.fromkeys(kind, max(sizes[name] for name in kind))
    return sizes


_REST_OF_SPEEDS = 2.5
"""Percent of the speeds at each end that no hump has to cover: what is left of outliers. [S]"""


def humps_of(model: Model, trials: Sequence[Trial], scales: Mapping[str, float]) -> list[Hump]:
    """Humps of the resistance over the speeds that the record shows; none where it shows none."""
    speed = ahead_of(vehicle(model))
    found = [series[1] for trial in trials if (series := motion(model, trial, speed)) is not None]
    if not found:
        return []
    low, high = np.percentile(np.concatenate(found) / scales[speed], (_REST_OF_SPEEDS, 100.0 - _REST_OF_SPEEDS))
    return humps_between(speed, float(low), float(high))
