"""Builds a ship as an FMU, of version 2 or 3 of the FMI, from ship.c: a simulator that nobody can look into.

    python experiments/fmu_ship/build.py ship.fmu --fmi 3

It needs a C compiler: the one that the environment variable CC names, else cc, gcc or clang, else the one that comes
with `pip install ziglang`.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Literal, NamedTuple
from xml.sax.saxutils import quoteattr

from seatruth import load_model

FOLDER = Path(__file__).parent
TROUBLE = ("trouble", "trouble_above")
STEP = 0.25
"""s: the longest step inside, LONGEST_STEP of ship.c."""
TIME = 9999
"""Value reference of the time, which version 3 of the FMI asks for: beyond those of all other variables."""


class Variable(NamedTuple):
    """One variable of the FMU; its value reference is its place among all."""

    name: str
    symbol: str
    """Its name in ship.c."""
    causality: Literal["parameter", "input", "output", "local"]
    start: float
    unit: str
    low: float = -math.inf
    high: float = math.inf
    whole: bool = False


def variables(values: Mapping[str, float] | None = None, prefix: str = "") -> tuple[Variable, ...]:
    """All variables: the parameters of the MMG model, its inputs, ports for outside forces and a current, its outputs,
    and the thrust, which is no output.

    `values` replaces starts of parameters; `prefix` goes before the names of the parameters ("hull.").
    """
    ship, given = load_model("mmg"), dict(values or {})
    found = [
        Variable(f"{prefix}{q.name}", f"p_{q.name}", "parameter", given.get(q.name, q.value), q.unit, q.min, q.max)
        for q in ship.parameters
    ]
    found += [Variable("trouble", "p_trouble", "parameter", 0.0, "1", whole=True)]
    found += [Variable("trouble_above", "p_trouble_above", "parameter", math.inf, "1")]
    inputs = {"delta": "deg", "n": "rpm", "X": "kN", "Y": "kN", "N": "kN.m", "north": "m/s", "east": "m/s"}
    found += [Variable(name, f"i_{name}", "input", 0.0, unit) for name, unit in inputs.items()]
    found += [Variable(c.name, f"o_{c.name}", "output", 0.0, c.unit) for c in ship.outputs]
    found += [Variable("thrust", "l_thrust", "local", 0.0, "kN")]
    return tuple(found)


def header(ship: Sequence[Variable], token: str) -> str:
    """variables.h: the place of each variable, and their starts."""
    first = next(k for k, one in enumerate(ship) if one.causality == "output")
    starts = ", ".join("1e300" if math.isinf(one.start) else repr(one.start) for one in ship)
    return "\n".join(
        [
            *(f"#define {one.symbol} {k}" for k, one in enumerate(ship)),
            f"#define COUNT {len(ship)}",
            f"#define FIRST_OUTPUT {first}",
            f'#define TOKEN "{token}"',
            f"static const double STARTS[COUNT] = {{{starts}}};",
            "",
        ]
    )


def _attributes(one: Variable) -> str:
    bounds = {"min": one.low, "max": one.high}
    found = {"unit": one.unit}
    if one.causality != "local":  # it is calculated
        found["start"] = "1e300" if math.isinf(one.start) else repr(one.start)
    found |= {key: repr(value) for key, value in bounds.items() if math.isfinite(value)}
    if one.whole:
        found = {"start": str(int(one.start))}
    return " ".join(f"{key}={quoteattr(value)}" for key, value in found.items())


_KINDS = {2: ("Real", "Integer"), 3: ("Float64", "Int32")}
"""Types of numbers, and of whole numbers, by version of the FMI."""
_VARIABILITY = {"parameter": "tunable", **dict.fromkeys(("input", "output", "local"), "continuous")}
_INITIAL = {
    "parameter": ' initial="exact"',
    "input": "",
    "output": ' initial="exact"',
    "local": ' initial="calculated"',
}
_BASE = {
    **{"m": 'm="1"', "m/s": 'm="1" s="-1"', "rad": 'rad="1"', "rad/s": 'rad="1" s="-1"', "kg/m^3": 'kg="1" m="-3"'},
    **{"deg": 'rad="1" factor="0.017453292519943295"', "rpm": 'rad="1" s="-1" factor="0.10471975511965977"'},
    **{"kN": 'kg="1" m="1" s="-2" factor="1000"', "kN.m": 'kg="1" m="2" s="-2" factor="1000"'},
}


def _units(ship: Sequence[Variable]) -> str:
    names = sorted({one.unit for one in ship})
    return "".join(
        f"<Unit name={quoteattr(name)}>{f'<BaseUnit {_BASE[name]}/>' if name in _BASE else ''}</Unit>" for name in names
    )


def _head(token: str, fmi: int) -> str:
    key, version = ("guid", "2.0") if fmi == 2 else ("instantiationToken", "3.0")
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="{version}" modelName="Ship, MMG standard method" {key}="{token}" '
        'generationTool="experiments/fmu_ship/build.py">\n'
        '<CoSimulation modelIdentifier="ship" canHandleVariableCommunicationStepSize="true"/>\n'
    )


def description(ship: Sequence[Variable], token: str, fmi: int) -> str:
    """modelDescription.xml."""
    lines = [f"<UnitDefinitions>{_units(ship)}</UnitDefinitions>", f'<DefaultExperiment stepSize="{STEP}"/>']
    lines.append("<ModelVariables>")
    if fmi == 3:
        lines.append(f'<Float64 name="time" valueReference="{TIME}" causality="independent"/>')
    for reference, one in enumerate(ship):
        said = (
            f'name={quoteattr(one.name)} valueReference="{reference}" causality="{one.causality}" '
            f'variability="{_VARIABILITY[one.causality]}"{_INITIAL[one.causality]}'
        )
        kind = _KINDS[fmi][one.whole]
        if fmi == 2:
            lines.append(f"<ScalarVariable {said}><{kind} {_attributes(one)}/></ScalarVariable>")
        else:
            lines.append(f"<{kind} {said} {_attributes(one)}/>")
    outputs = [k for k, one in enumerate(ship) if one.causality == "output"]
    if fmi == 2:
        unknowns = "".join(f'<Unknown index="{k + 1}"/>' for k in outputs)
        structure = f"<Outputs>{unknowns}</Outputs>"
    else:
        structure = "".join(f'<Output valueReference="{k}"/>' for k in outputs)
    lines.append(f"</ModelVariables><ModelStructure>{structure}</ModelStructure>")
    return _head(token, fmi) + "\n".join(lines) + "\n</fmiModelDescription>\n"


def compiler() -> list[str]:
    """The command of a C compiler. RuntimeError where there is none."""
    own = os.environ.get("CC")
    for name in ([own] if own else []) + ["cc", "gcc", "clang"]:
        if shutil.which(name):
            return [name]
    if find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "cc"]
    raise RuntimeError("no C compiler: install one, or `pip install ziglang`")


def place(fmi: int) -> str:
    """Where a shared library for this machine lies in an FMU."""
    system, machine = platform.system(), platform.machine().lower()
    end = {"Windows": "dll", "Darwin": "dylib"}.get(system, "so")
    if fmi == 2:
        return f"binaries/{ {'Windows': 'win64', 'Darwin': 'darwin64'}.get(system, 'linux64') }/ship.{end}"
    processor = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    name = {"Windows": "windows", "Darwin": "darwin"}.get(system, "linux")
    return f"binaries/{processor}-{name}/ship.{end}"


def build(
    target: Path,
    fmi: Literal[2, 3] = 2,
    values: Mapping[str, float] | None = None,
    *,
    prefix: str = "",
    edit: Mapping[str, str] | None = None,
) -> Path:
    """Writes the FMU and returns its path.

    `values` replaces starts of parameters, `prefix` goes before their names. `edit` replaces texts of its description.
    """
    import fmpy

    ship = variables(values, prefix)
    token = hashlib.sha256(repr((ship, fmi)).encode()).hexdigest()[:32]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "variables.h").write_text(header(ship, token))
        library = Path(folder) / Path(place(fmi)).name
        headers = Path(str(fmpy.__file__)).parent / "c-code"
        options = ["-O2", "-shared", "-w", f"-DFMI_VERSION={fmi}", f"-I{folder}", f"-I{headers}"]
        options += [] if platform.system() == "Windows" else ["-fPIC"]
        command = [*compiler(), *options, str(FOLDER / "ship.c"), "-o", str(library), "-lm"]
        subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
        text = description(ship, token, fmi)
        for old, new in (edit or {}).items():
            if old not in text:
                raise ValueError(f"the description holds no {old!r}")
            text = text.replace(old, new)
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in (("modelDescription.xml", text.encode()), (place(fmi), library.read_bytes())):
                # One date for all, so that the same ship is the same file.
                archive.writestr(zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0)), content)
    return target


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("target", type=Path, help="the FMU to write")
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="version of the FMI")
    arguments = parser.parse_args()
    print(build(arguments.target, arguments.fmi))


if __name__ == "__main__":
    main()
