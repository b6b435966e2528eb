"""Writes docs/licences.md: the licence of each package that seatruth, its extras, tests and documentation install.

    python tools/licences.py           says what would change; exit code 1 if anything does
    python tools/licences.py --write   writes the table

It reads the metadata of the packages that are installed here; a package that is not keeps its line in the table. A
licence that is not in `COMPATIBLE` is refused: someone must read it first.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution

import pins
from packaging.utils import canonicalize_name

TABLE = pins.ROOT / "docs" / "licences.md"

COMPATIBLE = {
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "any-OSI",  # apsw: its user chooses any licence that the Open Source Initiative approves
    "CC0-1.0",
    "ISC",
    "LGPL-2.1-or-later",  # a package of its own, imported and not copied
    "LGPL-3.0-only",  # the same; pymavlink, an extra of its own
    "MIT",
    "MIT-0",
    "MIT-CMU",
    "MPL-2.0",  # holds for its own files, which are not copied
    "PSF-2.0",
    "Unlicense",
    "ZPL-2.1",
    "Zlib",
}
"""SPDX names of licences whose packages a program under BSD-3-Clause may require."""

_STATED = {
    "cycler": "BSD-3-Clause",
    "contourpy": "BSD-3-Clause",
    "fmpy": "BSD-2-Clause",
    "graphemeu": "MIT",
    "kiwisolver": "BSD-3-Clause",
    "matplotlib": "PSF-2.0",
    "nest-asyncio2": "BSD-2-Clause",
    "scipy": "BSD-3-Clause",
}
"""Packages whose metadata hold a text instead of a name; read in the package's own licence file."""

_ELSEWHERE = {
    "appnope": "BSD-2-Clause",  # on macOS
    "colorama": "BSD-3-Clause",  # on Windows
}
"""Packages that only other systems need; read in the package's own licence file."""

_NAMES = {
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL-3.0-only",
    "MIT License": "MIT",
    "MIT license": "MIT",
    "BSD": "BSD-3-Clause",
    "BSD License": "BSD-3-Clause",
    "BSD 2-Clause License": "BSD-2-Clause",
    "BSD-3-Clause License": "BSD-3-Clause",
    "3-Clause BSD License": "BSD-3-Clause",
    "Apache 2.0": "Apache-2.0",
    "Apache License, Version 2.0": "Apache-2.0",
    "Apache Software License": "Apache-2.0",
    "Apache License 2.0": "Apache-2.0",
    "ISC License": "ISC",
    "ISC License (ISCL)": "ISC",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Python Software Foundation License": "PSF-2.0",
}

_HEAD = """# Licences of the packages that seatruth needs

seatruth itself is under the BSD 3-Clause licence (file `LICENSE`). It copies no code of others: each package below is
installed beside it, under its own licence. `python tools/licences.py --write` writes this table from the metadata of
the installed packages, and a test refuses a package whose licence it does not know. "LGPL" (`moocore`, which `pymoo`
needs, and `pymavlink`) and "MPL" hold for the files of those packages, not for programs that import them.

"""


class Unknown(Exception):
    """A licence that nobody has read yet."""


def licence(name: str) -> str:
    """The SPDX expression of an installed package.

    Raises:
        Unknown: its metadata name none, or one that is not in `COMPATIBLE`.
    """
    found = distribution(name).metadata.json
    key = canonicalize_name(name)
    stated = str(found.get("license_expression") or "") or _STATED.get(key)
    if not stated:
        texts = [str(found.get("license") or "")]
        texts += [line.split(" :: ")[-1] for line in found.get("classifier") or [] if line.startswith("License ::")]
        stated = next(
            (_NAMES.get(text, text) for text in texts if set(parts(_NAMES.get(text, text))) <= COMPATIBLE), ""
        )
        if not stated:
            raise Unknown(f"{name}: {' / '.join(text[:60] for text in texts)}")
    if unknown := set(parts(stated)) - COMPATIBLE:
        raise Unknown(f"{name}: {', '.join(sorted(unknown))}")
    return stated


def parts(expression: str) -> list[str]:
    """The licences of an SPDX expression."""
    return [part.strip("() ") for part in re.split(r"\s+(?:AND|OR)\s+", expression)]


def closure(requirements: Iterable[str]) -> set[str]:
    """Names of all packages that these requirements install on some system that seatruth promises."""
    texts = list(requirements)
    return {canonicalize_name(need.name) for system in pins.SYSTEMS.values() for need in pins.needed(texts, system)}


def table() -> str:
    """The page, from what is installed and from the page as it stands. The packages are those of constraints.txt.

    Raises:
        Unknown: a licence is not in `COMPATIBLE`, or a package is neither installed nor in the table.
    """
    light = closure(pins.PROJECT["project"]["dependencies"])
    before = _ELSEWHERE | _written()
    rows, unknown = [], []
    for name in sorted((pin.name for pin in pins.pins()), key=str.lower):
        by = "`pip install seatruth`" if canonicalize_name(name) in light else "an extra, tests or documentation"
        try:
            rows.append((name, licence(name), by))
        except PackageNotFoundError:
            if canonicalize_name(name) in before:
                rows.append((name, before[canonicalize_name(name)], by))
            else:
                unknown.append(f"{name}: it is not installed here")
        except Unknown as problem:
            unknown.append(str(problem))
    if unknown:
        raise Unknown("\n".join(unknown))
    lines = ["| package | licence | installed by |", "|---|---|---|"]
    lines += [f"| {name} | {text} | {by} |" for name, text, by in rows]
    return _HEAD + "\n".join(lines) + "\n"


def _written() -> dict[str, str]:
    """Licences by package, as the table has them."""
    page = TABLE.read_text(encoding="utf-8") if TABLE.exists() else ""
    return {canonicalize_name(name): text for name, text in re.findall(r"^\| (\S+) \| ([^|]+) \| ", page, re.MULTILINE)}


def main() -> int:
    """Writes the table with `--write`; otherwise says whether it is up to date."""
    try:
        text = table()
    except Unknown as problem:
        sys.stderr.write(f"Read these licences, then add them to tools/licences.py:\n{problem}\n")
        return 1
    if "--write" in sys.argv:
        TABLE.write_text(text, encoding="utf-8")
    elif not TABLE.exists() or TABLE.read_text(encoding="utf-8") != text:
        sys.stderr.write("docs/licences.md is out of date: python tools/licences.py --write\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
