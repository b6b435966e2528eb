"""Thrusters that stand elsewhere in a model's equations than it says of them."""

from __future__ import annotations

import math

from seatruth.effects.commands import NOT_COMPUTED
from seatruth.effects.undeclared_actuators import resting_inputs
from seatruth.errors import BadInput
from seatruth.models.actuators import Thruster, push
from seatruth.models.base import Environment, Model, record
from seatruth.models.black_box import BlackBox
from seatruth.models.rates import rates_at

_TURNS = {"r": ("to starboard", "to port"), "q": ("nose up", "nose down")}
"""The rates of turn that are compared, by standard name, and what a positive and a negative one is."""
_ALIKE = 0.5
"""Part of the larger of two opposite turns that the smaller is at least, where one is the mirror of the other. [S] What
a hull or a rudder in the wash adds is less."""


def check_thruster_places(model: Model) -> None:
    """Raises BadInput where a thruster turns a model the other way than its declared place and direction say.

    Effects on it act where it is declared: a thruster to port that is declared to starboard, or forces that `thrusts`
    gives in another order, and the weak thruster is named on the wrong side. Asked is the model at rest, with one
    thruster at full power: how it turns is compared with how the declared forces turn it.

    Example:
        >>> from seatruth import load_model
        >>> check_thruster_places(load_model("twin_thruster"))
    """
    if isinstance(model, BlackBox) or model.thrusts is None:
        return
    for thruster in (one for one in model.actuators if isinstance(one, Thruster)):
        for rate, (found, declared) in _turns(model, thruster).items():
            small, large = sorted((abs(found), abs(declared)))
            if not (found * declared < 0.0 and small > _ALIKE * large):
                continue
            positive, negative = _TURNS[rate]
            one, other = (positive, negative) if found > 0.0 else (negative, positive)
            raise BadInput(
                f"the thruster {thruster.name!r} turns the model {one} by its equations, and {other} by its place, its "
                "direction and `thrusts`",
                where=f"model {model.name!r}",
                do="Correct its `at` (forward, starboard, down) or `towards`, the order of the forces that `thrusts` "
                "returns, or the sign in rhs.",
            )


def _turns(model: Model, thruster: Thruster) -> dict[str, tuple[float, float]]:
    """What full power of a thruster's input adds to each rate of turn at rest: by the equations, and as declared.

    Empty where nothing is computed there, or where an input turns the thruster.
    """
    if thruster.turned_by is not None or model.thrusts is None:
        return {}
    resting = resting_inputs(model) or {}
    s = record("States", model.states)(*(0.0 for _ in model.states))
    i = record("Inputs", model.inputs)(*(resting.get(channel.name, 0.0) for channel in model.inputs))
    p = record("Parameters", model.parameters)(**model.nominal())
    running = i._replace(**{thruster.input: thruster.full})
    thrusters = [one for one in model.actuators if isinstance(one, Thruster)]
    try:
        still = rates_at(model, inputs=i._asdict())
        found = rates_at(model, inputs=running._asdict()) - still
        before, after = (tuple(model.thrusts(s, inputs, p, Environment())) for inputs in (i, running))
        parts = [0.0] * 6
        for one, idle, force in zip(thrusters, before, after, strict=True):
            parts = [part + float(force - idle) * share for part, share in zip(parts, push(one, p))]
        X, Y, Z, K, M, N = parts
        as_declared = rates_at(model, inputs=i._asdict(), e=Environment(X=X, Y=Y, Z=Z, K=K, M=M, N=N)) - still
    except NOT_COMPUTED:
        return {}
    names = [model.standard_of(channel.name)[0] for channel in model.states]
    turns = {name: (float(found[k]), float(as_declared[k])) for k, name in enumerate(names) if name in _TURNS}
    return {name: pair for name, pair in turns.items() if all(math.isfinite(value) for value in pair)}
