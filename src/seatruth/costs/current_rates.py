"""Whether a model's equations turn rightly in a current: in water that moves evenly, as they do in water at rest.

Seen from the water, a vehicle does there what it does in still water (Galileo). Over the ground its velocity in its own
axes is then that through the water and the current, whose parts in these axes change as it turns: by r v_c, and by
-r u_c. Equations that use the velocity through the water in their forces, and forget that, are right on a straight
course alone.
"""

from __future__ import annotations

import numpy as np

from seatruth.costs.problem import EstimationProblem
from seatruth.costs.usual_motion import usual_motion
from seatruth.effects.undeclared_actuators import bare
from seatruth.errors import SeatruthError
from seatruth.manoeuvres.stepper import Stepper
from seatruth.models.base import Environment
from seatruth.models.black_box import BlackBox
from seatruth.trials.finding import Finding

_AXES = ("u", "v")
_CURRENT = {"u": 0.2, "v": 0.15}
"""Parts of the speed, ahead and to starboard, that the current which is tried has. Chosen here [S]."""
_FORGOTTEN = 0.5
"""Part of a change by turning that is missing, from which it is forgotten: drag in air, which a current does not move,
is far smaller. Chosen here [S]."""


def current_rates(problem: EstimationProblem) -> list[Finding]:
    """A warning where a model's rates in a current are not those in still water, in axes that turn with the vehicle.

    Args:
        problem: the study; its model is asked near the usual motion and inputs of its trials.
    """
    model = bare(problem.model)
    names = [channel.name for channel in model.states]
    if isinstance(model, BlackBox) or not model.takes_current or not {*_AXES, "r"} <= {*names}:
        return []
    values, state, inputs = usual_motion(problem, model)
    speed, turn = state["u"], state["r"]
    water = {axis: part * speed for axis, part in _CURRENT.items()}
    change = {"u": turn * water["v"], "v": -turn * water["u"]}
    moving = Environment(u_c=water["u"], v_c=water["v"], du_c=change["u"], dv_c=change["v"])
    through = tuple(state[name] - water.get(name, 0.0) for name in names)
    try:
        still = Stepper(model, values).rate(0.0, through, inputs)
        carried = Stepper(model, values, lambda t, s: moving).rate(0.0, tuple(state.values()), inputs)
    except SeatruthError:  # equations that fail here are told of where they are simulated
        return []
    gained = {axis: carried[names.index(axis)] - still[names.index(axis)] for axis in _AXES}
    if all(abs(gained[axis] - change[axis]) <= _FORGOTTEN * abs(change[axis]) for axis in _AXES):
        return []
    return [
        Finding(
            "warning",
            "current-rates",
            f"In a current its rates are not those of still water: at {speed:.3g} m/s, turning by "
            f"{np.degrees(turn):.2g} deg/s, du/dt changes by {gained['u']:.2g} m/s2 where an even current adds r v_c = "
            f"{change['u']:.2g}, and dv/dt by {gained['v']:.2g} where it adds -r u_c = {change['v']:.2g}. Turns in a "
            "current go wrong.",
            f"model {model.name!r}",
            "Use s.u - e.u_c and s.v - e.v_c in all forces and in the terms of m, and add e.du_c to the rate of u and "
            "e.dv_c to that of v (docs/models.md); or leave e out of rhs, and the current is computed for you.",
        )
    ]
