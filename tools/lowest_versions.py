"""Prints pip constraints that pin each direct dependency at the lowest version which pyproject.toml promises.

    python tools/lowest_versions.py > lowest.txt
    pip install --constraint lowest.txt '.[dev,dask]'

`pandas>=2.2` becomes `pandas==2.2`, which is 2.2.0. Only what a user of seatruth gets is pinned: tools of tests and
documentation come as they are.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]


def lowest(requirements: list[str]) -> list[str]:
    """A constraint a requirement, in their order.

    Raises:
        ValueError: a requirement has no lower bound, so that nothing is promised of it.
    """
    lines = []
    for text in requirements:
        requirement = Requirement(text)
        bounds = [bound.version for bound in requirement.specifier if bound.operator in (">=", "==", "~=")]
        if len(bounds) != 1:
            raise ValueError(f"pyproject.toml: {text!r} has no lower bound. Write the lowest version that is tested.")
        lines.append(f"{requirement.name}=={bounds[0]}")
    return lines


def main() -> None:
    """Prints the constraints of what `pip install seatruth` installs."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    sys.stdout.write("\n".join(lowest(project["dependencies"])) + "\n")


if __name__ == "__main__":
    main()
