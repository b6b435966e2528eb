"""What is shipped and installed: the wheel is whole, and every package that comes along has an exact version."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]


def test_the_wheel_holds_every_file_of_both_packages(tmp_path: Path) -> None:
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "wheel"]
    command = [*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", str(tmp_path), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    packed = set(zipfile.ZipFile(wheel).namelist())
    for package in (ROOT / "src" / "seatruth", ROOT / "optimizers" / "seatruth_optimizers"):
        wanted = {
            path.relative_to(package.parent).as_posix()
            for path in package.rglob("*")
            if path.is_file()
            and path.suffix in (".py", ".typed", ".csv", ".toml", ".json", ".md", ".html", ".css", ".js")
        }
        assert wanted <= packed, wanted - packed
    assert not [name for name in packed if name.startswith(("tests/", "experiments/"))]


def test_every_package_that_is_installed_has_an_exact_version() -> None:
    pinned = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            name, version = re.fullmatch(r"([\w.-]+)==([\w.]+)", line).groups()  # type: ignore[union-attr]
            pinned[canonicalize_name(name)] = version
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = [*project["project"]["dependencies"], *project["project"]["optional-dependencies"]["dev"]]
    wanted += [*project["build-system"]["requires"], "editables"]
    missing, seen = set(), set()
    while wanted:
        requirement = Requirement(wanted.pop())
        name = canonicalize_name(requirement.name)
        if name not in pinned:
            missing.add(str(requirement))
        elif requirement.specifier and not requirement.specifier.contains(pinned[name]):
            missing.add(f"{requirement}, not {pinned[name]}")
        for extra in requirement.extras or {""}:
            if (name, extra) in seen:
                continue
            seen.add((name, extra))
            try:
                needs = requires(name) or []
            except PackageNotFoundError:
                continue
            wanted += [
                need
                for need in needs
                if (marker := Requirement(need).marker) is None or marker.evaluate({"extra": extra})
            ]
    assert not missing, f"add to constraints.txt: {missing}"
