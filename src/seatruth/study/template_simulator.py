"""What a first study file says of a simulator: the inputs that the log holds, and how to name what it does not."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from seatruth.models.base import Model
from seatruth.models.fmu import FMU, load_fmu
from seatruth.models.fmu_description import FLOATS, Variable
from seatruth.models.ports import BODY, EARTH, FORCES
from seatruth.study.infer_columns import infer_columns, split_header
from seatruth.trials import STANDARD_CHANNELS
from seatruth.trials.channel import Channel

_SHOWN = 12
"""Names that a comment lists. Chosen here [S]."""
_STANDARD = ("x", "y", "z", "depth", "phi", "theta", "psi", "u", "v", "w", "p", "q", "r", "delta", "delta_s", "n")
"""Channels whose names an FMU's variables may get."""
_FREE = 4
"""Parameters that a first study frees where nothing tells which. Chosen here [S]."""
_FORCES, _CURRENT = frozenset(FORCES), frozenset((*EARTH, *BODY))


def recordable(model: Model) -> list[Channel]:
    """The inputs that a log may hold: not those of a simulator that look like outside forces or a current."""
    if not isinstance(model, FMU):
        return list(model.inputs)
    return [channel for channel in model.inputs if channel.name not in _FORCES | _CURRENT]


def with_names(model: Model, columns: Iterable[str]) -> tuple[Model, dict[str, str]]:
    """An FMU whose variables have standard names, where their own say what they are, and those names; else the model.

    A variable that says nothing, but ends as a column of the log is called, gets that column's name: "nav.v_lat" that
    of the column "v_lat".
    """
    if not isinstance(model, FMU):
        return model, {}
    variables = model.description.of("input", "output")
    taken = {one.name for one in variables}
    proposed: dict[str, str] = {}
    for causality, wanted in (("input", ("delta", "delta_s", "n")), ("output", _STANDARD[:-3])):
        titles = {_titled(one): one.name for one in variables if one.causality == causality}
        channels = [STANDARD_CHANNELS[name] for name in wanted if name not in taken]
        no_numbers = np.empty(0)
        hits = infer_columns(dict.fromkeys(titles, no_numbers), channels, orders=wanted)
        proposed |= {name: titles[hit.column] for name, hit in hits.items() if titles[hit.column] != name}
    ends = {_end(column) for column in columns} - {""}
    for one in variables:
        end = _end(one.name)
        if one.name not in proposed.values() and "." in one.name and end in ends and end not in {*proposed, *taken}:
            proposed[end] = one.name
    return (load_fmu(model.description.path, names=proposed), proposed) if proposed else (model, {})


def free_parameters(model: FMU) -> list[str]:
    """Numbers of an FMU that a first study frees: its first ones that are not 0, which initial values mostly are."""
    floats = {one.name for one in model.description.of("parameter", kinds=FLOATS)}
    real = [
        parameter.name
        for parameter in model.parameters
        # What is no identifier stands in the description.
        if parameter.value != 0.0 and {parameter.name, parameter.description.partition(":")[0]} & floats
    ]
    return real[:_FREE]


def _titled(variable: Variable) -> str:
    """A variable's name with its unit, as a column of a log has it, for `infer_columns`."""
    return f"{variable.name} [{variable.unit}]" if variable.unit else variable.name


def _end(name: str) -> str:
    """The last part of a dotted name, or a column's name without its unit, as an identifier: "nav.v_lat" -> "v_lat"."""
    words = split_header(name.rpartition(".")[2])[0].replace(" ", "_")
    return words if re.fullmatch(r"[a-z][a-z0-9_]*", words) else ""


def simulator_lines(model: Model, missing: Sequence[Channel], names: Mapping[str, str]) -> list[str]:
    """Lines of the table [model] for an FMU; none for another model.

    `missing` are the inputs that no column holds, `names` those that are proposed for variables.
    """
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
        *_names(names),
        f"# ports = {{ {ports} }}   # inputs that take outside forces (body axes) and a current",
        *_starts(model),
        '# kind = "ship"   # which effects can act: ship, auv, glider, planing',
        "# for effects on thrusters:",
        '# actuators = { port = { input = "VARIABLE", full = 20.0, at = [-1, -0.4, 0.2], towards = [1, 0, 0] } }',
        "# dimensions = { length = 100.0, breadth = 20.0, draft = 6.0, mass = 8e6 }   # for wind, waves, hull",
    ]


def _names(proposed: Mapping[str, str]) -> list[str]:
    """The table of names: what is proposed, or how it is written."""
    if not proposed:
        return [
            '# names = { delta = "VARIABLE", psi = "-VARIABLE" }   # with standard names, effects know what they are'
        ]
    entries = ", ".join(f"{name} = {json.dumps(variable)}" for name, variable in proposed.items())
    return [f'names = {{ {entries} }}   # as they are called; a minus, as "-nav.yaw", turns a sign']


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
