"""The exact versions of constraints.txt, and whether they are what is installed here."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
EXTRAS = ("dev", "docs", "dask", "benchmark")
"""What `make` installs besides what seatruth itself needs."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SYSTEMS = {
    f"{platform} {python}": {
        "os_name": "nt" if platform == "Windows" else "posix",
        "sys_platform": {"Linux": "linux", "Darwin": "darwin", "Windows": "win32"}[platform],
        "platform_system": platform,
        "python_version": python,
        "python_full_version": f"{python}.0",
    }
    for platform in ("Linux", "Darwin", "Windows")
    for python in (text.rpartition(" ")[2] for text in PROJECT["project"]["classifiers"])
    if python.startswith("3.")
}
"""Variables of markers on each system and Python that seatruth promises."""


def pins() -> list[Requirement]:
    """The lines of constraints.txt: one exact version each, with a marker where only some systems need it."""
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
    wanted = [*PROJECT["project"]["dependencies"], *PROJECT["build-system"]["requires"], "editables"]
    for extra in EXTRAS:
        wanted += PROJECT["project"]["optional-dependencies"][extra]
    return wanted


def needed(requirements: Iterable[str], system: Mapping[str, str]) -> list[Requirement]:
    """These requirements and all that theirs require in turn on a system, as far as they are installed here.

    Args:
        requirements: as pip takes them.
        system: variables of markers; those that are left out are this system's.
    """
    wanted, reached, seen = [Requirement(text) for text in requirements], [], set[tuple[str, str]]()
    while wanted:
        requirement = wanted.pop()
        reached.append(requirement)
        for extra in ["", *requirement.extras]:
            entry = (canonicalize_name(requirement.name), extra)
            if entry not in seen:
                seen.add(entry)
                around = {**system, "extra": extra}
                wanted += [need for need in _needs(entry[0]) if need.marker is None or need.marker.evaluate(around)]
    return reached


@cache
def _needs(name: str) -> list[Requirement]:
    try:
        return [Requirement(text) for text in requires(name) or []]
    except PackageNotFoundError:
        return []


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
