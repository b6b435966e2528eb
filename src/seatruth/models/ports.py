"""Where a black box takes outside forces and a current: its ports, and what acts through them.

A port is a quantity that the simulator asks for at each of its steps. What acts there is a function of the time and of
the outputs so far, so that a force that depends on the motion (a wind, a damping) closes its loop inside one run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from seatruth.errors import BadInput, nearest
from seatruth.models.measures import Motion, Water, to_body

Outside = Callable[[float, Mapping[str, float]], dict[str, float]]
"""(time s, outputs by name) to the value of each port by its component: {"X": 12.0, "Y": 0.0, "N": 3.0}."""

FORCES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {"X": ("u", "N"), "Y": ("v", "N"), "Z": ("w", "N"), "K": ("p", "N*m"), "M": ("q", "N*m"), "N": ("r", "N*m")}
)
"""Components of a force port: the motion that each drives, and its unit. Body axes: forward, starboard, down."""
EARTH = ("north", "east", "down")
"""Components of a current in earth axes, m/s: where the water moves to."""
BODY = ("u_c", "v_c", "w_c")
"""Components of a current in body axes, m/s."""


@dataclass(frozen=True)
class Ports:
    """Which outside forces and which current a simulator takes.

    Args:
        force: some of X, Y, Z (N) and K, M, N (N m), in body axes: forward, to starboard, down, about the origin.
        current: north, east, down (m/s, where the water moves to), or u_c, v_c, w_c in body axes.

    Raises:
        BadInput: a component does not exist, stands twice, or both kinds of axes are named.

    Example:
        >>> from seatruth.models import Ports
        >>> Ports(force=("X", "Y", "N"), current=("north", "east")).components
        ('X', 'Y', 'N', 'north', 'east')
    """

    force: tuple[str, ...] = ()
    current: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", tuple(self.force))
        object.__setattr__(self, "current", tuple(self.current))
        for kind, given, known in (("force", self.force, tuple(FORCES)), ("current", self.current, EARTH + BODY)):
            for name in given:
                if name not in known:
                    raise BadInput(f"a {kind} has no component {name!r}", where="ports", do=nearest(name, known))
                if given.count(name) > 1:
                    raise BadInput(f"the {kind} names {name!r} twice", where="ports", do="Name it once.")
        if {*self.current} & {*EARTH} and {*self.current} & {*BODY}:
            what = "the current is given in earth axes and in body axes"
            raise BadInput(what, where="ports", do="Take north, east, down, or u_c, v_c, w_c.")

    @property
    def components(self) -> tuple[str, ...]:
        """All components, forces first."""
        return (*self.force, *self.current)

    def __bool__(self) -> bool:
        return bool(self.components)

    @property
    def current_axes(self) -> tuple[str, ...]:
        """The components of the axes in which it takes the current, `EARTH` or `BODY`; none without a current."""
        return next((axes for axes in (EARTH, BODY) if {*self.current} & {*axes}), ())

    def water(self, values: Mapping[str, float], motion: Motion) -> Water:
        """The water's motion in body axes that the values of the current's components are at an attitude."""
        axes = self.current_axes
        vector = Water(*(values.get(name, 0.0) for name in axes))
        return Water(*to_body(*vector, m=motion)) if axes == EARTH else vector

    def nothing(self, t: float, outputs: Mapping[str, float]) -> dict[str, float]:
        """What acts where nothing does: zero in each component."""
        return dict.fromkeys(self.components, 0.0)


def unit_of(component: str) -> str:
    """Unit of a component inside seatruth: "N", "N*m", "m/s".

    Example:
        >>> from seatruth.models.ports import unit_of
        >>> unit_of("N"), unit_of("east")
        ('N*m', 'm/s')
    """
    return FORCES[component][1] if component in FORCES else "m/s"


def as_ports(given: Ports | Mapping[str, Sequence[str]] | None) -> Ports:
    """Ports from `{"force": [...], "current": [...]}`. BadInput for another key or a text in the place of a list."""
    if given is None:
        return Ports()
    if isinstance(given, Ports):
        return given
    for key, value in given.items():
        if key not in ("force", "current"):
            raise BadInput(f"there is no port {key!r}", where="ports", do='Name "force" or "current".')
        if isinstance(value, str):
            raise BadInput(f"{key} is {value!r}", where="ports", do=f'Give a list: {key} = ["{value}"].')
    return Ports(tuple(given.get("force", ())), tuple(given.get("current", ())))
