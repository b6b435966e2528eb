"""A model with what its structure may lack: forces in its equations of motion.

The missing acceleration in each equation is a sum of

* terms in the motion and the inputs, the same in every trial (a damping or a wake of another form);
* a function of time of each trial's own, straight lines between knots.

Both are accelerations (m/s2, rad/s2) added to the rate of a state, so that any model can carry them. The terms and the
knots are parameters that vanish at zero. The functions of time that are already known enter as inputs `force_STATE`,
since a parameter has one value for all trials.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from seatruth.arrays import Array
from seatruth.diagnosis.discrepancy.terms import Term, acceleration_unit, equations, terms_of
from seatruth.models.base import Model, record, takes_surroundings
from seatruth.models.black_box import BlackBox
from seatruth.models.parameter import Parameter
from seatruth.trials.channel import Channel
from seatruth.trials.trial import Trial


class DiscrepancyModel(Model):
    """A model with missing forces.

    Args:
        base: the model, with its effects.
        knots: how many knots span the longest trial.
        duration: s, of the longest trial.
        scales: usual size of each state and input, which makes the terms dimensionless.
    """

    def __init__(self, base: Model, knots: int, duration: float, scales: Mapping[str, float]) -> None:
        self.base, self.scales = base, dict(scales)
        self.knots, self.spacing = knots, duration / (knots - 1)
        self.equations = equations(base)
        # What a model lacks does not depend on where north is: that would be an environment.
        self.terms: tuple[Term, ...] = tuple(
            term for term in terms_of(base) if not any(kind in ("cosine", "sine") for kind, _ in term.factors)
        )
        self.name, self.title, self.kind, self.source = base.name, base.title, base.kind, base.source
        self.states, self.outputs = base.states, base.outputs
        self.hidden, self.follows, self.longest_step = base.hidden, base.follows, base.longest_step
        self.dimensions, self.thrust, self.drag, self.standard = base.dimensions, base.thrust, base.drag, base.standard
        forces = [Channel(force_input(state), acceleration_unit(base, state)) for state in self.equations]
        self.inputs = (*base.inputs, *forces)
        self.knot_names = {state: tuple(f"knot_{state}_{k}" for k in range(knots)) for state in self.equations}
        own = [Parameter(n, 0.0, acceleration_unit(base, s)) for s, names in self.knot_names.items() for n in names]
        own += [Parameter(term.name, 0.0, acceleration_unit(base, term.state)) for term in self.terms]
        self.parameters = (*base.parameters, *own)
        self.rhs, self.output, self.initial_state = _rhs(self), _output(self), _initial_state(self)
        super().__init__()


def force_input(state: str) -> str:
    """Name of the input that holds the missing acceleration of a state's equation."""
    return f"force_{state}"


def hats(t: Array, spacing: float, knots: int) -> Array:
    """Linear B-splines at times t (n,): (n, knots)."""
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(t[:, None] / spacing - np.arange(knots))))


def with_forces(trial: Trial, model: DiscrepancyModel, forces: Array | None = None) -> Trial:
    """The trial with the missing accelerations among its inputs: `forces` (equations, knots), zero where None."""
    basis = hats(np.asarray(trial.t), model.spacing, model.knots)
    extra = {
        force_input(state): np.zeros(len(trial)) if forces is None else basis @ forces[k]
        for k, state in enumerate(model.equations)
    }
    return dataclasses.replace(trial, inputs={**trial.inputs, **extra})


def can_carry(model: Model) -> bool:
    """Whether missing forces can be added to a model: not to a black box, nor where nothing moves."""
    return not isinstance(model, BlackBox) and bool(equations(model))


def _split(model: DiscrepancyModel) -> Callable[[Any], tuple[Any, dict[str, list[Any]], list[Any]]]:
    base, size, knots = record("Parameters", model.base.parameters), len(model.base.parameters), model.knots
    states = list(model.equations)

    def split(p: Any) -> tuple[Any, dict[str, list[Any]], list[Any]]:
        values = tuple(p)
        at = size + knots * len(states)
        own = {state: list(values[size + knots * k : size + knots * (k + 1)]) for k, state in enumerate(states)}
        return base(*values[:size]), own, list(values[at:])

    return split


def _rhs(model: DiscrepancyModel) -> Callable[..., tuple[Any, ...]]:
    split, base, scales, spacing = _split(model), model.base.rhs, model.scales, model.spacing
    kind, count, full = record("Inputs", model.base.inputs), len(model.base.inputs), takes_surroundings(model.base.rhs)
    order, terms, states = [channel.name for channel in model.states], model.terms, list(model.equations)

    def factor(which: tuple[str, str], s: Any, i: Any) -> Any:
        what, name = which
        x = getattr(i if what == "input" or not hasattr(s, name) else s, name) / scales[name]
        return math.sqrt(x * x + 1e-12) if what == "absolute" else x

    def rhs(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        p, own, coefficients = split(p)
        plain = kind(*tuple(i)[:count])
        rates = list(base(s, plain, p, e) if full else base(s, plain, p))
        for state in states:
            total = getattr(i, force_input(state))
            for k, value in enumerate(own[state]):
                total = total + value * max(0.0, 1.0 - abs(e.t / spacing - float(k)))
            rates[order.index(state)] += total
        for term, coefficient in zip(terms, coefficients):
            product = coefficient
            for which in term.factors:
                product = product * factor(which, s, plain)
            rates[order.index(term.state)] += product
        return tuple(rates)

    return rhs


def _output(model: DiscrepancyModel) -> Callable[..., tuple[Any, ...]] | None:
    base = model.base.output
    if base is None:
        return None
    split, full = _split(model), takes_surroundings(base)
    kind, count = record("Inputs", model.base.inputs), len(model.base.inputs)

    def output(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        p, plain = split(p)[0], kind(*tuple(i)[:count])
        return tuple(base(s, plain, p, e) if full else base(s, plain, p))

    return output


def _initial_state(model: DiscrepancyModel) -> Callable[..., tuple[Any, ...]] | None:
    base = model.base.initial_state
    if base is None:
        return None
    split = _split(model)
    kind, count = record("Inputs", model.base.inputs), len(model.base.inputs)

    def initial_state(y: Any, i: Any, p: Any) -> tuple[Any, ...]:
        return tuple(base(y, kind(*tuple(i)[:count]), split(p)[0]))

    return initial_state


def scales_of(model: Model, trials: Sequence[Trial]) -> dict[str, float]:
    """Usual size of each state and input: its root mean square as recorded; 1 where it was not, or is zero."""
    found = {}
    for channel in (*model.states, *model.inputs):
        parts = [
            np.asarray(source[channel.name])
            for trial in trials
            for source in (trial.outputs, trial.inputs)
            if channel.name in source
        ]
        values = np.concatenate(parts) if parts else np.zeros(0)
        values = values[np.isfinite(values)]
        size = float(np.sqrt(np.mean(values**2))) if values.size else 0.0
        found[channel.name] = size if size > 0.0 else 1.0
    return found
