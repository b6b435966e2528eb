"""Which ports of a black box an effect inside it needs."""

from __future__ import annotations

from typing import Any, Protocol

from seatruth.effects.carried_black_box import not_carried
from seatruth.effects.targets import ActsOnInputs, targets
from seatruth.effects.vehicle import unseen
from seatruth.models.actuators import Thruster, push
from seatruth.models.base import record
from seatruth.models.black_box import BlackBox
from seatruth.models.ports import EARTH, FORCES

_EQUATIONS = dict(zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), FORCES.items()))
"""By equation of motion: the component of a force that drives it, with its motion and unit."""


class ActsInside(ActsOnInputs, Protocol):
    """What an effect says of where it acts; see `seatruth.effects.Effect`."""

    @property
    def current(self) -> Any:
        """Its hook of currents, or None."""

    @property
    def force(self) -> Any:
        """Its hook of forces, or None."""

    @property
    def thrust_change(self) -> Any:
        """Its hook of what a drive does, or None."""

    @property
    def states(self) -> Any:
        """Its own states."""

    @property
    def acts_on(self) -> tuple[str, ...]:
        """The equations in which it acts."""

    @property
    def needs_states(self) -> tuple[str, ...]:
        """Motions that the model must have."""

    @property
    def needs_vehicle(self) -> tuple[str, ...]:
        """What the model must declare of its vehicle."""


def lacks_port(effect: ActsInside, box: BlackBox) -> str:
    """Why an effect on the equations cannot act through a black box's ports; empty where it can."""
    ports, motions = box.innermost.ports, {channel.name for channel in box.innermost.outputs}
    if effect.thrust_change is not None:
        return "a black box does not show what one drive alone does"
    if effect.current is None and effect.force is None:
        return ""
    if effect.states:
        return "it has states of its own beside a force, which no port carries"
    if effect.current is not None:
        if not ports.current and not_carried(box):
            return f"it moves the water, the black box has no port for a current, and {not_carried(box)}"
        if ports.current and ports.current[0] in EARTH and not motions & {"psi", "theta"}:
            return "its current is in earth axes, and the black box has no output psi"
    if effect.force is not None:
        if not ports.force:
            return "it is a force, and the model is a black box without a port for forces"
        pushed = _through_thrusters(effect, box)
        for equation, (component, (motion, _)) in _EQUATIONS.items():
            acts = equation in effect.acts_on or component in pushed
            if acts and motion in motions and component not in ports.force:
                return f"it acts in {equation}, and the black box has no port for {component}"
    for role in effect.needs_vehicle:
        name = unseen(box, role) if role != "dimensions" else ""
        if name:
            return f"the {role} of the black box needs {name!r}, which is none of its outputs, inputs and parameters"
    return ""


def _through_thrusters(effect: ActsInside, box: BlackBox) -> set[str]:
    """Components of a force through the thrusters on which an effect acts, by their places and directions.

    An effect that turns a thruster says by the motions that it needs where else it pushes.
    """
    if effect.actuator != "thruster":
        return set()
    declared = [one for one in box.innermost.actuators if isinstance(one, Thruster)]
    p = record("Parameters", box.innermost.parameters)(**box.innermost.nominal())
    found = {component for component, (motion, _) in FORCES.items() if motion in effect.needs_states}
    for target in targets(effect, box):
        for one in (declared[place] for place in (target.thruster, target.other) if place >= 0):
            found |= {component for component, value in zip(FORCES, push(one, p)) if value != 0.0}
    return found
