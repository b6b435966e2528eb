"""The tree of causes: the level at which a gap between a simulator and a vehicle can be explained.

A node of the tree is a path, "environment.force_fixed_to_earth.wind": each part narrows the cause down. Every effect
states its node (`Effect.cause`), usually a leaf; an effect that fits no leaf takes the nearest node above. Where trials
cannot tell several effects apart, their lowest common ancestor is the finest cause that can be named:

    >>> common = lowest_common_ancestor(
    ...     ["environment.force_fixed_to_earth.wind", "environment.force_fixed_to_earth.wave_drift"]
    ... )
    >>> common, title(common)
    ('environment.force_fixed_to_earth', 'a steady force fixed to the earth')

The grouping is chosen here [S]: by where an engineer would look for the cause.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from seatruth.errors import BadInput, nearest

ROOT = ""
"""Path of the node that holds all others."""

_ENVIRONMENT = {
    "environment": "the environment",
    "environment.force_fixed_to_earth": "a steady force fixed to the earth",
    "environment.force_fixed_to_earth.wind": "a steady wind",
    "environment.force_fixed_to_earth.wave_drift": "the mean drift force of waves",
    "environment.force_fixed_to_earth.line": "the pull of a line",
    "environment.moving_water": "water that moves over the ground",
    "environment.moving_water.uniform_current": "a uniform current",
    "environment.moving_water.sheared_current": "a current that changes with depth",
    "environment.moving_water.varying_current": "a current that changes with time",
    "environment.wave_motion": "the oscillating force of waves",
    "environment.confined_water": "confined water",
    "environment.confined_water.shallow_water": "shallow water",
    "environment.confined_water.bank": "a bank",
}
_ACTUATOR = {
    "actuator": "an actuator",
    "actuator.steering": "a rudder or a stern plane",
    "actuator.steering.offset": "a constant error of a rudder or plane angle",
    "actuator.steering.gain": "an error of the effectiveness of a rudder or plane",
    "actuator.steering.dynamics": "the motion of a rudder or plane behind its order",
    "actuator.steering.dynamics.lag": "a lag of a rudder or plane",
    "actuator.steering.dynamics.rate_limit": "a rate limit of a rudder or plane",
    "actuator.steering.dynamics.delay": "a dead time of a rudder or plane",
    "actuator.steering.dynamics.dead_band": "a dead band of a rudder or plane",
    "actuator.steering.dynamics.backlash": "backlash of a rudder or plane",
    "actuator.propulsion": "the propulsion",
    "actuator.propulsion.thrust": "an error of the thrust",
    "actuator.propulsion.supply": "the power of the thrusters",
    "actuator.propulsion.supply.load": "the power of the thrusters under load",
    "actuator.propulsion.supply.charge": "the charge of the battery of the thrusters",
    "actuator.propulsion.inflow": "the inflow of the thrusters",
    "actuator.propulsion.hull": "the jets of the thrusters on the hull",
    "actuator.propulsion.arrangement": "the arrangement or the allocation of the thrusters",
    "actuator.propulsion.dynamics": "the motion of the thrusters behind their order",
    "actuator.propulsion.dynamics.lag": "a lag of the thrusters",
    "actuator.propulsion.dynamics.rate_limit": "a rate limit of the thrusters",
    "actuator.propulsion.dynamics.delay": "a dead time of the thrusters",
    "actuator.propulsion.dynamics.dead_band": "a dead band of the thrusters",
    "actuator.propulsion.side_force": "a side force of the propulsion",
    "actuator.propulsion.torque": "the torque of the propeller",
}
_SENSOR = {
    "sensor": "a sensor",
    "sensor.bias_or_scale": "an offset or a scale error of a sensor",
    "sensor.bias_or_scale.speed": "an offset or a scale error of a speed sensor",
    "sensor.bias_or_scale.angle": "an offset or a deviation of an angle sensor",
    "sensor.bias_or_scale.rate": "an offset or a scale error of a gyro",
    "sensor.bias_or_scale.depth": "an offset or a scale error of a depth sensor",
    "sensor.alignment": "the place or the direction of a sensor",
    "sensor.alignment.speed": "the place or the direction of a speed sensor",
    "sensor.alignment.position": "the place of a position sensor",
    "sensor.alignment.depth": "the place of a depth sensor",
    "sensor.timing": "the timing of a sensor",
    "sensor.timing.position": "a delay of the position",
    "sensor.timing.angle": "a delay of an angle",
    "sensor.timing.rate": "a delay of a rate of turn",
    "sensor.timing.speed": "a delay of the speed",
    "sensor.timing.depth": "a delay of the depth",
    "sensor.noise": "the noise of a sensor",
}
_LOADING = {
    "loading": "the loading",
    "loading.weight": "weight or buoyancy",
    "loading.weight.constant": "the net weight",
    "loading.weight.with_depth": "buoyancy that changes with the depth",
    "loading.weight.with_time": "a weight that grows with time",
    "loading.centre_of_gravity": "the place of the centre of gravity",
    "loading.moving_liquid": "liquid that moves in the hull",
}
_HYDRODYNAMICS = {
    "hydrodynamics": "the hydrodynamics",
    "hydrodynamics.damping_or_lift": "damping or lift of the hull",
    "hydrodynamics.damping_or_lift.drag": "the drag in straight motion",
    "hydrodynamics.damping_or_lift.drag_curve": "how the drag rises with the speed",
    "hydrodynamics.damping_or_lift.cross_flow": "cross-flow drag",
    "hydrodynamics.damping_or_lift.turning": "the drag in turns",
    "hydrodynamics.damping_or_lift.moment": "the moment of the hull at an angle to the flow",
    "hydrodynamics.added_mass_or_inertia": "added mass or inertia",
    "hydrodynamics.asymmetry": "an asymmetry of the hull",
    "hydrodynamics.one_sided": "forces that differ between turns to port and to starboard",
    "hydrodynamics.external_body": "a tether or another body at the vehicle",
}

CAUSES: Mapping[str, str] = MappingProxyType(
    {ROOT: "an unknown cause", **_ENVIRONMENT, **_ACTUATOR, **_SENSOR, **_LOADING, **_HYDRODYNAMICS}
)
"""Every node of the tree: its path to its title in words. A parent stands before its children."""


def is_cause(path: str) -> bool:
    """Whether a path other than the root's is a node of the tree."""
    return path != ROOT and path in CAUSES


def title(path: str) -> str:
    """A node in words, "a steady force fixed to the earth". BadInput where there is no such node."""
    _check(path)
    return CAUSES[path]


def parent(path: str) -> str:
    """The node above; the root of a family such as "sensor". BadInput for the root, which has none."""
    _check(path)
    if path == ROOT:
        raise BadInput("the root of the tree of causes has no parent")
    return path.rpartition(".")[0]


def ancestors(path: str) -> tuple[str, ...]:
    """The node itself and all above it, ending with the root."""
    _check(path)
    result = [path]
    while result[-1] != ROOT:
        result.append(parent(result[-1]))
    return tuple(result)


def children(path: str) -> tuple[str, ...]:
    """The nodes directly below."""
    _check(path)
    return tuple(node for node in CAUSES if node != ROOT and parent(node) == path)


def is_within(path: str, node: str) -> bool:
    """Whether `path` is the node or lies below it."""
    return node in ancestors(path)


def leaves(node: str = ROOT) -> tuple[str, ...]:
    """The nodes at or below `node` that have no children."""
    _check(node)
    return tuple(path for path in CAUSES if is_within(path, node) and not children(path))


def lowest_common_ancestor(paths: Iterable[str]) -> str:
    """The finest node that holds all of these; BadInput where none are given.

    One path is its own ancestor; causes of different families have the root in common.
    """
    lines = [ancestors(path) for path in paths]
    if not lines:
        raise BadInput("no causes are given, so they have no ancestor in common")
    return next(node for node in lines[0] if all(node in line for line in lines))


def _check(path: str) -> None:
    if path not in CAUSES:
        raise BadInput(f"the tree of causes has no node {path!r}", do=nearest(path, [node for node in CAUSES if node]))
