"""Whether the equations of a model depend on a state."""

from __future__ import annotations

import numpy as np

from seatruth.effects.commands import NOT_COMPUTED
from seatruth.models.base import Model
from seatruth.models.black_box import BlackBox
from seatruth.models.rates import rates_at

_TRIED = 8
"""States at which it is tried. [S]"""
_APART = 3.0
"""How far apart the state is put, in its unit. [S] Metres of depth, above all."""


def depends_on(model: Model, standard: str) -> bool:
    """Whether the rate of any state depends on the state with a standard name; true where that cannot be told.

    The rates are compared at some motions with the state here and there, all else the same. What cannot be computed,
    and a simulator that cannot be opened, may depend on it.

    Example:
        >>> from seatruth import load_model
        >>> depends_on(load_model("torpedo"), "z"), depends_on(load_model("torpedo"), "u")
        (False, True)
    """
    places = [k for k, channel in enumerate(model.states) if model.standard_of(channel.name)[0] == standard]
    if isinstance(model, BlackBox) or not places:
        return True
    rng = np.random.default_rng(0)
    names, inputs = [state.name for state in model.states], {channel.name: 0.1 for channel in model.inputs}
    for _ in range(_TRIED):
        here = rng.uniform(0.1, 1.0, size=len(model.states))
        there = here.copy()
        there[places] += _APART
        try:
            one, other = (rates_at(model, dict(zip(names, state.tolist())), inputs) for state in (here, there))
        except NOT_COMPUTED:
            return True
        if (one != other).any() or not np.isfinite(one).all():
            return True
    return False
