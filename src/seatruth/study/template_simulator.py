"""What a first study file says of a simulator: the inputs that the log holds, and how to name what it does not."""

from __future__ import annotations

import json
from collections.abc import Sequence

from seatruth.models.base import Model
from seatruth.models.fmu import FMU
from seatruth.models.ports import BODY, EARTH, FORCES
from seatruth.trials.channel import Channel

_SHOWN = 12
"""Names that a comment lists. Chosen here [S]."""
_FORCES, _CURRENT = frozenset(FORCES), frozenset((*EARTH, *BODY))


def recordable(model: Model) -> list[Channel]:
    """The inputs that a log may hold: not those of a simulator that look like outside forces or a current."""
    if not isinstance(model, FMU):
        return list(model.inputs)
    return [channel for channel in model.inputs if channel.name not in _FORCES | _CURRENT]


def simulator_lines(model: Model, missing: Sequence[Channel]) -> list[str]:
    """Lines of the table [model] for an FMU; none for another model. `missing` are the inputs that no column holds."""
    if not isinstance(model, FMU):
        return []
    absent = {channel.name for channel in missing}
    given = [channel.name for channel in model.inputs if channel.name not in absent]
    lines = []
    if absent and given:
        lines.append(f"inputs = {json.dumps(given)}   # those that the log holds; others keep their start values")
        lines.append(f"# not in the log: {_listed(sorted(absent))}")
    forces = [name for name in FORCES if name in absent]
    current = [name for name in (*EARTH, *BODY) if name in absent]
    entries = [f"{key} = {json.dumps(names)}" for key, names in (("force", forces), ("current", current)) if names]
    ports = ", ".join(entries) or 'force = { X = "VARIABLE", Y = "-VARIABLE" }, current = { north = "VARIABLE" }'
    channels = [variable.name for variable in model.description.of("input", "output")]
    return [
        *lines,
        f"# The simulator has: {_listed(channels)}.",
        '# names = { delta = "VARIABLE", psi = "-VARIABLE" }   # with standard names, effects know what they are',
        f"# ports = {{ {ports} }}   # inputs that take outside forces (body axes) and a current",
        *_starts(model),
        '# kind = "ship"   # which effects can act: ship, auv, glider, planing',
        "# for effects on thrusters:",
        '# actuators = { port = { input = "VARIABLE", full = 20.0, at = [-1, -0.4, 0.2], towards = [1, 0, 0] } }',
        "# dimensions = { length = 100.0, breadth = 20.0, draft = 6.0, mass = 8e6 }   # for wind, waves, hull",
    ]


def _starts(model: FMU) -> list[str]:
    """How the outputs get their initial values, where they cannot be set themselves."""
    states = {channel.name for channel in model.states}
    fixed = [channel.name for channel in model.outputs if channel.name not in states]
    if not fixed:
        return []
    return [
        f"# These outputs start where the simulator wants: {_listed(fixed)}. If variables set them:",
        f'# initial = {{ {fixed[0]} = "VARIABLE" }}',
    ]


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(" ".join(name.split()) for name in names[:_SHOWN]) + more
