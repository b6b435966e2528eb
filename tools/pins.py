"""The exact versions of constraints.txt, and whether they are what is installed here."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
EXTRAS = ("dev", "docs", "dask", "benchmark")
"""What `make` installs besides what seatruth itself needs."""


def pins() -> list[Requirement]:
    """The lines of constraints.txt: one exact version each."""
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    return [Requirement(line) for line in lines if line and not line.startswith("#")]


def exact(pin: Requirement) -> str:
    """The version of a pin.

    Raises:
        ValueError: it allows more than one.
    """
    (bound,) = pin.specifier
    if bound.operator != "==" or "*" in bound.version:
        raise ValueError(f"constraints.txt: {str(pin)!r} names no exact version.")
    return bound.version


def direct() -> list[str]:
    """The requirements that pyproject.toml names, with those of the build and of the extras in `EXTRAS`."""
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wanted = [*pyproject["project"]["dependencies"], *pyproject["build-system"]["requires"], "editables"]
    for extra in EXTRAS:
        wanted += pyproject["project"]["optional-dependencies"][extra]
    return wanted


def other_versions(pinned: Mapping[str, str]) -> list[str]:
    """The direct dependencies that are installed here in another version than that pinned, as "name version".

    A package that is not installed is none of them: an extra may have been left out.
    """
    found = {}
    for requirement in direct():
        name = canonicalize_name(Requirement(requirement).name)
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return [f"{name} {here}" for name, here in sorted(found.items()) if name in pinned and pinned[name] != here]
