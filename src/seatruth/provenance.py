"""Provenance of a result: versions, commit, machine, time."""

from __future__ import annotations

import os
import platform
import subprocess
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

_PACKAGES = ("seatruth", "numpy", "scipy", "llvmlite", "pandas", "scikit-learn", "pymoo", "pyswarms", "cma")


def provenance() -> dict[str, Any]:
    """What a result is stored with, as JSON values.

    Returns:
        versions (by package), commit, python (its version), machine (system, processor, processors), time_utc.

    Example:
        >>> sorted(provenance())
        ['commit', 'machine', 'python', 'time_utc', 'versions']
    """
    return {
        "versions": versions(),
        "commit": commit(),
        "python": platform.python_version(),
        "machine": {
            "system": platform.system(),
            "processor": platform.machine(),
            "processors": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        },
        "time_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
    }


def versions() -> dict[str, str]:
    """Versions of seatruth and of the libraries that can change a number, by package."""
    installed = {}
    for package in _PACKAGES:
        with suppress(PackageNotFoundError):
            installed[package] = version(package)
    return installed


@cache
def commit() -> str:
    """The commit of the checkout that the package runs from, with "+" where files differ from it; "" outside one.

    As it was when this was first asked: a checkout may move on while a long run goes on with the code that it read.
    """
    folder = Path(__file__).resolve().parent
    head = _git(folder, "rev-parse", "HEAD")
    # The package may be installed inside a checkout of something else.
    if not head or not _git(folder, "ls-files", "--error-unmatch", Path(__file__).name):
        return ""
    return head + ("+" if _git(folder, "status", "--porcelain", "--untracked-files=no") else "")


def _git(folder: Path, *arguments: str) -> str:
    try:
        process = subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, timeout=5, check=False
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return process.stdout.strip() if process.returncode == 0 else ""
