"""Which ports of a black box an effect inside it needs."""

from __future__ import annotations

from typing import Any, Protocol

from seatruth.models.black_box import BlackBox
from seatruth.models.ports import EARTH, FORCES

_EQUATIONS = dict(zip(("surge", "sway", "heave", "roll", "pitch", "yaw"), FORCES.items()))
"""By equation of motion: the component of a force that drives it, with its motion and unit."""


class ActsInside(Protocol):
    """What an effect says of where it acts; see `seatruth.effects.Effect`."""

    @property
    def current(self) -> Any:
        """Its hook of currents, or None."""

    @property
    def force(self) -> Any:
        """Its hook of forces, or None."""

    @property
    def states(self) -> Any:
        """Its own states."""

    @property
    def acts_on(self) -> tuple[str, ...]:
        """The equations in which it acts."""


def lacks_port(effect: ActsInside, box: BlackBox) -> str:
    """Why an effect on the equations cannot act through a black box's ports; empty where it can."""
    ports, motions = box.innermost.ports, {channel.name for channel in box.innermost.outputs}
    if effect.current is None and effect.force is None:
        return ""
    if effect.states:
        return "it has states of its own beside a force, which no port carries"
    if effect.current is not None:
        if not ports.current:
            return "it moves the water, and the model is a black box without a port for a current"
        if ports.current[0] in EARTH and not motions & {"psi", "theta"}:
            return "its current is in earth axes, and the black box has no output psi"
    if effect.force is not None:
        if not ports.force:
            return "it is a force, and the model is a black box without a port for forces"
        for equation, (component, (motion, _)) in _EQUATIONS.items():
            if equation in effect.acts_on and motion in motions and component not in ports.force:
                return f"it acts in {equation}, and the black box has no port for {component}"
    return ""
