"""What an FMU says of itself: its variables, and how it can be simulated. Read by fmpy from modelDescription.xml."""

from __future__ import annotations

import hashlib
import math
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seatruth.errors import BadInput
from seatruth.units import Conversion

FLOATS = frozenset({"Real", "Float64", "Float32"})
WHOLE = frozenset({"Integer", "Enumeration", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"})
LOGICAL = frozenset({"Boolean"})
NUMBERS = FLOATS | WHOLE | LOGICAL
_BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_HEAD = 20_000
"""Bytes of the description in which its version stands: the first element. Chosen here [S]."""
_LONGEST = 64 * 2**20
"""Bytes of a description. Chosen here [S]: a hundred thousand variables take half of that."""
_LARGEST = 4 * 2**30
"""Bytes of an FMU when it is unpacked. Chosen here [S]: many times what libraries and tables of a simulator take."""
_MOST_FILES = 20_000
"""Files in an FMU. Chosen here [S]."""
_SHOWN = 12
"""Names of each kind that a message lists. Chosen here [S]."""


@dataclass(frozen=True)
class Variable:
    """One scalar variable: its name, value reference and type in the FMI, causality, start value, unit and bounds.

    `settable`: a value may be set before the simulation begins, and it begins there.
    """

    name: str
    reference: int
    kind: str
    causality: str
    start: float | None
    unit: str
    low: float
    high: float
    text: str
    settable: bool


@dataclass(frozen=True)
class Description:
    """What seatruth uses of an FMU's description.

    `version` is 2 or 3; `step` s is its default or fixed step, 0 where it states none; `fixed_step`: it takes
    communication steps of that length alone. `units` are those that it defines by SI units, each with the SI unit and
    how numbers become it.
    """

    path: Path
    checksum: str
    version: int
    title: str
    identifier: str
    token: str
    variables: tuple[Variable, ...]
    step: float
    fixed_step: bool
    units: dict[str, tuple[str, Conversion]]

    def of(self, *causalities: str, kinds: frozenset[str] = NUMBERS) -> list[Variable]:
        """Its variables of these causalities and types, in their order."""
        return [one for one in self.variables if one.causality in causalities and one.kind in kinds]

    @property
    def listing(self) -> str:
        """What it has, in one or a few sentences."""
        parts = []
        for title, found in (
            ("inputs", self.of("input")),
            ("outputs", self.of("output")),
            ("parameters", self.of("parameter")),
        ):
            names = [one.name for one in found]
            more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
            parts.append(f"{title}: {', '.join(names[:_SHOWN]) or 'none'}{more}")
        return f"It has {'; '.join(parts)}."


def read_description(path: Path) -> Description:
    """Reads the description of an FMU.

    Raises:
        BadInput: there is no such file, it is no FMU, fmpy is not installed, or the FMU cannot be simulated here.
    """
    where = path.name
    if not path.is_file():
        beside = sorted(entry.name for entry in path.parent.glob("*.fmu")) if path.parent.is_dir() else []
        raise BadInput("there is no such FMU", where=where, do=f"There are: {', '.join(beside)}." if beside else "")
    try:
        import fmpy
    except ImportError as problem:
        what = f"simulating an FMU needs the package fmpy ({problem})"
        raise BadInput(what, where=where, do='Install it: pip install "seatruth[fmu]".') from None
    if not zipfile.is_zipfile(path):
        raise BadInput("it is no FMU: not a ZIP archive", where=where, do="Export it again.")
    _check_version(path, where)
    try:
        found = fmpy.read_model_description(str(path), validate=False)
    except Exception as problem:  # fmpy and lxml raise many kinds; all mean that the description is wrong
        text = " ".join(str(problem).split())[:300]
        what = f"its modelDescription.xml cannot be read ({text or type(problem).__name__})"
        raise BadInput(what, where=where, do="Export it again.") from None
    version = int(str(found.fmiVersion).partition(".")[0])
    simulation = found.coSimulation
    if simulation is None:
        what = "it offers model exchange alone, and co-simulation is needed"
        raise BadInput(what, where=where, do="Export it for co-simulation, with its solver inside.")
    with zipfile.ZipFile(path) as archive:
        _check_library(archive.namelist(), simulation.modelIdentifier, version, where, fmpy)
    step, fixed = _step(found, version)
    with path.open("rb") as stream:
        checksum = hashlib.file_digest(stream, "sha256").hexdigest()
    return Description(
        path=path,
        checksum=checksum,
        version=version,
        title=str(found.modelName or path.stem),
        identifier=str(simulation.modelIdentifier),
        token=str(found.guid or ""),
        variables=tuple(_variable(one, version) for one in found.modelVariables if not one.dimensions),
        step=step,
        fixed_step=fixed,
        units=_units(found.unitDefinitions),
    )


def _check_version(path: Path, where: str) -> None:
    """BadInput for an archive without a description, one of another version of the FMI, or one that grows too large."""
    try:
        with zipfile.ZipFile(path) as archive:
            files = archive.infolist()
            long = archive.getinfo("modelDescription.xml").file_size > _LONGEST
            text = b"" if long else archive.read("modelDescription.xml")
    except Exception as problem:  # zipfile and its decoders raise many kinds
        raise BadInput(
            f"it is no FMU: its modelDescription.xml cannot be read ({problem})", where=where, do="Export it again."
        ) from None
    size = sum(file.file_size for file in files)
    if long or size > _LARGEST or len(files) > _MOST_FILES:
        what = f"it would unpack to {size / 1e9:.3g} GB in {len(files)} files"
        what = f"its modelDescription.xml has more than {_LONGEST / 1e6:.0f} MB" if long else what
        raise BadInput(what, where=where, do="Export it without what the simulation does not need.")
    if b"<!DOCTYPE" in text:  # entities could read other files, or grow without end
        what = "its modelDescription.xml declares a document type, which the FMI does not know"
        raise BadInput(what, where=where, do="Export it again.")
    found = re.search(r"fmiVersion\s*=\s*[\"']([^\"']*)", text[:_HEAD].decode("utf-8", "replace"))
    version = found.group(1) if found else "of no version"
    if not version.startswith(("2.", "3.")):
        what = f"it follows FMI {version}; versions 2 and 3 can be simulated"
        raise BadInput(what, where=where, do="Export it as FMI 2 or 3.")


def _check_library(files: Sequence[str], identifier: str, version: int, where: str, fmpy: Any) -> None:
    """BadInput where the FMU holds no library for this machine."""
    here = fmpy.platform if version == 2 else fmpy.platform_tuple
    if f"binaries/{here}/{identifier}{fmpy.sharedLibraryExtension}" in files:
        return
    have = sorted({parts[1] for parts in (name.split("/") for name in files) if parts[0] == "binaries" and parts[1:]})
    have = [name for name in have if name]
    what = f"it holds no library for this machine ({here}); it has {', '.join(have) or 'none at all'}"
    raise BadInput(what, where=where, do="Export it for this system, or run seatruth where it was made for.")


def _step(found: Any, version: int) -> tuple[float, bool]:
    """(step s or 0, whether no other is possible)."""
    simulation, default = found.coSimulation, found.defaultExperiment
    inside = _number(simulation.fixedInternalStepSize) if version == 3 else None
    usual = _number(default.stepSize) if default is not None else None
    step = next((x for x in (inside, usual) if x is not None and x > 0.0 and math.isfinite(x)), 0.0)
    return step, not simulation.canHandleVariableCommunicationStepSize


def _variable(one: Any, version: int) -> Variable:
    declared = one.declaredType
    kind = str(one.type)

    def stated(name: str) -> Any:
        own = getattr(one, name)
        return own if own is not None else getattr(declared, name, None)

    start = _number(one.start)
    causality, initial = str(one.causality or "local"), one.initial
    if initial is None and causality == "parameter":
        initial = "exact"  # what the standard says where nothing is stated
    low, high = _number(stated("min")), _number(stated("max"))
    return Variable(
        name=str(one.name),
        reference=int(one.valueReference),
        kind="Int64" if kind == "Enumeration" and version == 3 else kind,
        causality=causality,
        start=start,
        unit=str(stated("unit") or ""),
        low=-math.inf if low is None else low,
        high=math.inf if high is None else high,
        text=" ".join(str(one.description or "").split()),
        settable=initial == "exact" and start is not None and one.variability != "constant",
    )


def _number(value: Any) -> float | None:
    """A number from the description's text; "true" is 1. None for what is none."""
    text = str(value).strip().lower() if value is not None else ""
    if text in ("true", "false"):
        return float(text == "true")
    try:
        return float(text)
    except ValueError:
        return None


def _units(definitions: Sequence[Any]) -> dict[str, tuple[str, Conversion]]:
    found = {}
    for unit in definitions:
        base = unit.baseUnit
        if base is None:
            continue
        powers = [(name, int(getattr(base, name) or 0)) for name in _BASE]
        text = "*".join(f"{name}^{power}" if power != 1 else name for name, power in powers if power)
        factor = 1.0 if base.factor is None else float(base.factor)
        offset = float(base.offset or 0.0)
        if factor != 0.0 and math.isfinite(factor) and math.isfinite(offset):  # no numbers come of another
            found[str(unit.name)] = (text or "1", Conversion(factor, offset))
    return found
