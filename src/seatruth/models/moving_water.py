"""Water that moves under a model whose equations do not know it: by a change of frame.

In water that moves evenly a vehicle does what it does in water at rest, seen from the water (Galileo). So a current
needs no word of the model's author: the equations get the motion through the water, and the water carries the result
over the ground. That holds for equations without an environment, and for those without a sway state, which cannot give
the drift across the heading. A current that changes with time carries the vehicle with it, as it does a body that
floats freely.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from seatruth.models.measures import Motion, to_earth

if TYPE_CHECKING:
    from seatruth.models.base import Equations, Model

_BODY = ("u", "v", "w")
_EARTH = ("x", "y", "z")
_ANGLES = ("phi", "theta", "psi")


def carried_by_water(model: Model, *, knows_water: bool) -> bool:
    """Whether a current acts on a model by a change of frame: it moves ahead, and does not know how water moves it."""
    names = {model.standard_of(state.name)[0] for state in model.states}
    return "u" in names and (not knows_water or ("psi" in names and "v" not in names))


def in_moving_water(model: Model, rhs: Equations) -> Equations:
    """The function of (s, i, p, e) of a model in water that moves; `rhs` is that of the model, which gets none."""
    places = {model.standard_of(state.name)[0]: k for k, state in enumerate(model.states)}
    names = [state.name for state in model.states]
    signs = {name: model.standard_of(names[k])[1] for name, k in places.items()}
    body = tuple(
        (axis, places[name], names[places[name]], signs[name]) for axis, name in enumerate(_BODY) if name in places
    )
    earth = tuple((axis, places[name], signs[name]) for axis, name in enumerate(_EARTH) if name in places)
    angles = tuple((places[name], signs[name]) if name in places else (-1, 1) for name in _ANGLES)

    def equations(s: Any, i: Any, p: Any, e: Any) -> tuple[Any, ...]:
        water, quickens = (e.u_c, e.v_c, e.w_c), (e.du_c, e.dv_c, e.dw_c)
        through = s._replace(**{name: s[place] - sign * water[axis] for axis, place, name, sign in body})
        still = e._replace(u_c=0.0, v_c=0.0, w_c=0.0, du_c=0.0, dv_c=0.0, dw_c=0.0)
        rates = list(rhs(through, i, p, still))
        for axis, place, _, sign in body:
            rates[place] = rates[place] + sign * quickens[axis]
        phi, theta, psi = (0.0 if place < 0 else sign * s[place] for place, sign in angles)
        over_ground = to_earth(water, Motion(phi=phi, theta=theta, psi=psi))
        for axis, place, sign in earth:
            rates[place] = rates[place] + sign * over_ground[axis]
        return tuple(rates)

    return equations
