"""A simulator as an FMU (Functional Mock-up Unit): a black box whose declaration is read from its description.

Standard: Functional Mock-up Interface, versions 2.0 and 3.0, Modelica Association (fmi-standard.org). Co-simulation:
the FMU brings its solver.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import seatruth.models.fmu_simulation as fmu_simulation
from seatruth.errors import BadInput, nearest
from seatruth.models.actuators import Rudder, Thruster
from seatruth.models.black_box import BlackBox
from seatruth.models.fmu_description import FLOATS, NUMBERS, Description, Variable, read_description
from seatruth.models.fmu_simulation import FMURun, Link, Plan, unpacked
from seatruth.models.geometry import Dimensions
from seatruth.models.isolated import TIME_LIMIT, IsolatedBlackBox
from seatruth.models.parameter import Parameter
from seatruth.models.ports import Ports, as_ports, unit_of
from seatruth.storage.checksum import of_source
from seatruth.trials.channel import Channel
from seatruth.trials.standard_channels import STANDARD_CHANNELS
from seatruth.units import Conversion, inside_unit, to_si

PortNames = Sequence[str] | Mapping[str, str]
"""Components of a port, or each with the FMU's variable: ["X", "Y"] or {"X": "F_surge", "Y": "-F_port"}."""


class FMU(IsolatedBlackBox):
    """An FMU as a model; made by `load_fmu`.

    `description` is what it says of itself.
    """

    def __init__(self, base: BlackBox, description: Description, *, time_limit: float, identity: str) -> None:
        self.description = description
        super().__init__(base, time_limit=time_limit, identity=identity)


def load_fmu(
    path: str | Path,
    *,
    names: Mapping[str, str] | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    initial: Mapping[str, str] | None = None,
    ports: Mapping[str, PortNames] | None = None,
    step: float | None = None,
    hold: Literal["foh", "zoh"] = "foh",
    kind: str = "",
    dimensions: Dimensions | None = None,
    actuators: Sequence[Rudder | Thruster] = (),
    time_limit: float = TIME_LIMIT,
) -> FMU:
    """Makes a model of an FMU for co-simulation, version 2 or 3 of the FMI. It needs the extra `seatruth[fmu]`.

    Inputs, outputs and parameters come with start values, units and bounds from the FMU's description. A name that is
    no identifier becomes one ("hull.Y_v" becomes `hull_Y_v`). Channels are in SI units here, whatever the FMU's are;
    parameters keep the FMU's units. An FMU is foreign machine code, which runs in processes of its own.

    Args:
        path: the file.
        names: own names for the FMU's variables: {"delta": "rudder.angle", "psi": "-yaw"}; a minus turns the sign. With
            the standard names of channels, effects and checks know what they are.
        inputs: the inputs that trials give, by their names here; default: all. The others stay at their start values.
        outputs: the outputs that take part; default: all.
        initial: the variable that sets the initial value of an output: {"u": "u_start"}. Outputs that can be set
            themselves need none.
        ports: inputs that take outside forces and a current, {"force": ["X", "Y", "N"], "current": {"north": "V_n",
            "east": "V_e"}}; see `Ports` for the components and their axes.
        step: s, longest communication step; default: the FMU's own step where it is shorter than a sample, else one a
            sample.
        hold: inputs between samples: "foh" (straight lines) or "zoh" (constant).
        kind: "ship", "auv", "glider" or "planing": which effects can act on it.
        dimensions: the vehicle's size, which effects of wind, waves and hull need.
        actuators: what drives and steers it, by the names of its inputs here: effects on rudders and thrusters find
            these by them. An output or a local variable that is the `force` of a thruster lets effects act on that.
        time_limit: s that one run of one trial may take.

    Returns:
        The model.

    Raises:
        BadInput: the file is no FMU that can be simulated here, or something named is not in it; the message says what
            the FMU has.

    Example:
        >>> from seatruth import BadInput, load_fmu
        >>> try:
        ...     load_fmu("nowhere.fmu", names={"delta": "rudder.angle"}, ports={"force": ["X", "Y", "N"]}, kind="ship")
        ... except BadInput as problem:
        ...     print(problem.what)
        there is no such FMU
    """
    description = read_description(Path(path))
    where = description.path.name
    given = _Names(description, names or {}, where)
    chosen_ports, port_links = _ports(description, ports or {}, where)
    taken = {link.reference for link in port_links}
    in_channels, in_links = _inputs(description, given, inputs, taken, where)
    out_channels, out_links, settable = _outputs(description, given, outputs, where)
    states, initial_links = _states(description, given, out_channels, out_links, settable, initial or {}, where)
    taken |= {link.reference for link in initial_links}
    parameters, parameter_links = _parameters(description, given, taken, where)
    if step is not None and not (step > 0.0 and math.isfinite(step)):
        raise BadInput(f"a step of {step!r} s is not possible", where=where, do="Give a number > 0.")
    plan = Plan(
        folder=unpacked(description.path, description.checksum),
        version=description.version,
        identifier=description.identifier,
        token=description.token,
        inputs=in_links,
        outputs=out_links,
        parameters=parameter_links,
        initial=initial_links,
        ports=port_links,
        angles=tuple(channel.name for channel in out_channels if channel.angle),
        step=description.step if step is None else step,
        fixed_step=description.fixed_step,
        hold=hold,
    )
    base = BlackBox(
        _identifier(description.path.stem),
        FMURun(plan),
        inputs=in_channels,
        outputs=out_channels,
        parameters=parameters,
        states=states,
        kind=kind,
        title=description.title,
        source=f"FMU {where}, FMI {description.version}",
        ports=chosen_ports,
        dimensions=dimensions,
        actuators=actuators,
    )
    base.hold = hold
    decided = {key: value for key, value in asdict(plan).items() if key != "folder"}
    identity = f"{description.checksum} {of_source(fmu_simulation.__file__)} {decided}"
    return FMU(base, description, time_limit=time_limit, identity=identity)


@dataclass
class _Names:
    """Names of the FMU's variables here."""

    description: Description
    stated: Mapping[str, str]
    where: str
    by_reference: dict[str, tuple[str, int]] = field(default_factory=dict)
    """Own name and sign by the FMU's name, as stated."""

    def __post_init__(self) -> None:
        for own, text in self.stated.items():
            if not own.isidentifier() or own.startswith("_"):
                raise BadInput(f"{own!r} is no usable name", where=f"{self.where}, names", do="Use an identifier.")
            variable, sign = named(self.description, text, f"{self.where}, names")
            if variable.name in self.by_reference:
                raise BadInput(f"{variable.name!r} gets two names", where=f"{self.where}, names", do="Give it one.")
            self.by_reference[variable.name] = own, sign

    def of(self, variable: Variable) -> tuple[str, int]:
        """Own name of a variable, and its sign."""
        return self.by_reference.get(variable.name, (_identifier(variable.name), 1))

    def unique(self, variables: Sequence[Variable], what: str) -> list[tuple[str, int, Variable]]:
        """Own names, signs and variables. BadInput where two variables have one name."""
        found: dict[str, tuple[str, int, Variable]] = {}
        for variable in variables:
            name, sign = self.of(variable)
            if name in found:
                raise BadInput(
                    f"its {what} {found[name][2].name!r} and {variable.name!r} would both be called {name!r}",
                    where=self.where,
                    do="Give one of them a name of its own, in `names`.",
                )
            found[name] = name, sign, variable
        return list(found.values())


def named(description: Description, text: str, where: str) -> tuple[Variable, int]:
    """The variable that a text names, and -1 where a minus stands before it. BadInput says what the FMU has."""
    sign, name = (-1, text[1:].strip()) if text.startswith("-") else (1, text)
    for variable in description.variables:
        if variable.name == name:
            if variable.kind not in NUMBERS:
                what = f"{name!r} is of type {variable.kind}, and numbers are needed"
                raise BadInput(what, where=where, do="Leave it out: it keeps its start value.")
            return variable, sign
    close = nearest(name, [variable.name for variable in description.variables])
    raise BadInput(f"it has no variable {name!r}", where=where, do=f"{close} {description.listing}".strip())


def _selected(
    all_: Sequence[tuple[str, int, Variable]], wanted: Sequence[str] | None, what: str, do: str, where: str
) -> list[tuple[str, int, Variable]]:
    if wanted is None:
        return list(all_)
    known = {name: (name, sign, variable) for name, sign, variable in all_}
    for name in wanted:
        if name not in known:
            raise BadInput(f"it has no {what} {name!r}", where=where, do=f"{nearest(name, known)} {do}".strip())
    return [known[name] for name in wanted]


def _inputs(
    description: Description, names: _Names, wanted: Sequence[str] | None, taken: set[int], where: str
) -> tuple[list[Channel], tuple[Link, ...]]:
    free = [one for one in description.of("input") if one.reference not in taken]
    chosen = _selected(names.unique(free, "inputs"), wanted, "input", description.listing, where)
    made = [_channel(description, name, sign, variable, where) for name, sign, variable in chosen]
    return [channel for channel, _ in made], tuple(link for _, link in made)


def _outputs(
    description: Description, names: _Names, wanted: Sequence[str] | None, where: str
) -> tuple[list[Channel], tuple[Link, ...], dict[str, bool]]:
    # What `names` calls by a name of its own takes part though it is only local.
    own = [one for one in description.of("local", kinds=FLOATS) if one.name in names.by_reference]
    found = names.unique([*description.of("output", kinds=FLOATS), *own], "outputs")
    chosen = _selected(found, wanted, "output", description.listing, where)
    if not chosen:
        raise BadInput(
            "it has no outputs that are numbers", where=where, do=f"Export it with outputs. {description.listing}"
        )
    made = [_channel(description, name, sign, variable, where) for name, sign, variable in chosen]
    settable = {name: variable.settable for name, _, variable in chosen}
    return [channel for channel, _ in made], tuple(link for _, link in made), settable


def _states(
    description: Description,
    names: _Names,
    channels: Sequence[Channel],
    links: Sequence[Link],
    settable: Mapping[str, bool],
    stated: Mapping[str, str],
    where: str,
) -> tuple[list[Channel], tuple[Link, ...]]:
    """Outputs whose initial value can be set, and by what."""
    known = [channel.name for channel in channels]
    for name in stated:
        if name not in known:
            raise BadInput(f"{name!r} is no output of it", where=f"{where}, initial", do=nearest(name, known))
    states, found = [], []
    for channel, link in zip(channels, links):
        if channel.name in stated:
            variable, sign = named(description, stated[channel.name], f"{where}, initial")
            factor, offset = _conversion(description, variable, channel.unit, where)
            found.append(Link(channel.name, variable.reference, variable.kind, sign * factor, offset))
            states.append(channel)
        elif settable[channel.name]:
            found.append(link)
            states.append(channel)
    return states, tuple(found)


def _parameters(
    description: Description, names: _Names, taken: set[int], where: str
) -> tuple[list[Parameter], tuple[Link, ...]]:
    offered = [one for one in description.of("parameter") if one.start is not None and one.reference not in taken]
    parameters, links = [], []
    for name, sign, one in names.unique(offered, "parameters"):
        assert one.start is not None
        if sign < 0:
            raise BadInput(f"parameter {name!r} is turned round", where=f"{where}, names", do="Name it without the -.")
        low, high = (0.0, 1.0) if one.kind == "Boolean" else (one.low, one.high)
        text = one.text if one.name == name else f"{one.name}: {one.text}" if one.text else one.name
        try:
            parameter = Parameter(name, one.start, one.unit or "1", low, high, source=f"FMU {where}", description=text)
        except BadInput as problem:
            raise BadInput(f"its parameter {one.name!r}: {problem.what}", where=where, do="Correct the FMU.") from None
        parameters.append(parameter)
        links.append(Link(name, one.reference, one.kind))
    return parameters, tuple(links)


def _ports(description: Description, stated: Mapping[str, PortNames], where: str) -> tuple[Ports, tuple[Link, ...]]:
    plain: dict[str, Any] = {key: value if isinstance(value, str) else list(value) for key, value in stated.items()}
    chosen = as_ports(plain)
    links = []
    for key, entry in stated.items():
        for component in entry:
            text = entry[component] if isinstance(entry, Mapping) else component
            variable, sign = named(description, text, f"{where}, ports, {key}")
            if variable.causality != "input" or variable.kind not in FLOATS:
                what = f"{variable.name!r} is no input that takes numbers, so nothing can act through it"
                raise BadInput(what, where=f"{where}, ports, {key}", do=description.listing)
            factor, offset = _conversion(description, variable, unit_of(component), where)
            links.append(Link(component, variable.reference, variable.kind, sign * factor, offset))
    return chosen, tuple(sorted(links, key=lambda link: chosen.components.index(link.name)))


def _channel(description: Description, name: str, sign: int, variable: Variable, where: str) -> tuple[Channel, Link]:
    """A variable as a channel in SI units, and how its numbers become that."""
    known = STANDARD_CHANNELS.get(name)
    unit = known.unit if known is not None else _si_unit(description, variable, where)
    factor, offset = _conversion(description, variable, unit, where)
    text = variable.text or (known.description if known is not None else "")
    channel = Channel(name, unit, text, known is not None and known.angle)
    return channel, Link(name, variable.reference, variable.kind, sign * factor, offset)


def _si_unit(description: Description, variable: Variable, where: str) -> str:
    if not variable.unit:
        return "1"
    try:
        return inside_unit(variable.unit)
    except BadInput as problem:
        if variable.unit in description.units:
            return inside_unit(description.units[variable.unit][0])
        raise _unknown(variable, problem, where) from None


def _conversion(description: Description, variable: Variable, unit: str, where: str) -> Conversion:
    """From the FMU's unit to one inside seatruth; an FMU that states none is in that unit already."""
    if not variable.unit:
        return Conversion(1.0, 0.0)
    try:
        return to_si(variable.unit, unit)
    except BadInput as problem:
        if variable.unit not in description.units:
            raise _unknown(variable, problem, where) from None
        base, first = description.units[variable.unit]
        then = to_si(base, unit)
        return Conversion(first.factor * then.factor, first.offset * then.factor + then.offset)


def _unknown(variable: Variable, problem: BadInput, where: str) -> BadInput:
    return BadInput(
        f"its variable {variable.name!r}: {problem.what}",
        where=where,
        do="Correct its unit in the FMU, or leave it out: name those that take part in `inputs` or `outputs`.",
    )


def _identifier(name: str) -> str:
    """An identifier for a name: "hull.Y_v[1]" becomes hull_Y_v_1."""
    text = re.sub(r"\W+", "_", name).strip("_")
    return text if text.isidentifier() else f"v_{text}"
