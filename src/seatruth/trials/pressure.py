"""The depth that a pressure shows, as a depth cell records it: in dbar, bar or kPa above that of the air."""

from __future__ import annotations

from seatruth.errors import BadInput
from seatruth.trials.channel import Channel
from seatruth.units import Conversion, to_si

SEA_WATER = 1025.0
"""kg/m3, sea water. Water that is pressed together by 1000 m of it is 0.5 % heavier. ([L] UNESCO 1983, Algorithms for
computation of fundamental properties of seawater)"""
GRAVITY = 9.80665
"""m/s2: standard gravity, [L] 3rd General Conference on Weights and Measures, 1901; on earth 0.3 % off at most."""
_NONE = frozenset(("", "1", "m", "cm", "ft"))
"""Usual units of other things; the table of all units takes half a second to load."""
AIR = 101325.0 / (SEA_WATER * GRAVITY)
"""m of sea water that weigh as much as the standard atmosphere."""


def conversion(unit: str, channel: Channel) -> Conversion:
    """How numbers in `unit` become a channel's; a pressure is a depth for a channel that is one.

    Raises BadInput for an unknown unit and for one of another dimension.

    Example:
        >>> from seatruth.trials import STANDARD_CHANNELS
        >>> round(conversion("dbar", STANDARD_CHANNELS["depth"]).factor, 4)
        0.9948
    """
    if is_depth(channel) and is_pressure(unit):
        return Conversion(to_si(unit, "Pa").factor / (SEA_WATER * GRAVITY), 0.0)
    return to_si(unit, channel.unit)


def is_depth(channel: Channel) -> bool:
    """Whether a channel is a depth in m: by its name, or by what it is said to be."""
    said = channel.description.lower().replace(",", " ").split()
    return channel.unit == "m" and (channel.name in ("z", "depth") or "depth" in said)


def is_pressure(unit: str) -> bool:
    """Whether a unit is one of pressures.

    Example:
        >>> is_pressure("dbar"), is_pressure("m")
        (True, False)
    """
    if unit.strip() in _NONE:
        return False
    try:
        to_si(unit, "Pa")
    except BadInput:
        return False
    return True
