"""What made a result: the machine in words that do not identify it, versions, the commit, a hash of the sources."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("seatruth", "numpy", "scipy", "numba", "llvmlite", "pandas", "scikit-learn", "pymoo", "pyswarms", "joblib")


def cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine() -> dict[str, Any]:
    """The machine in words that do not identify it: processor, cores, memory, system, Python."""
    cpu = platform.processor() or platform.machine()
    flags: set[str] = set()
    info = Path("/proc/cpuinfo")
    if info.exists():
        pairs = [line.split(":", 1) for line in info.read_text().splitlines() if ":" in line]
        fields = {k.strip(): v.strip() for k, v in reversed(pairs)}
        family = f" (family {fields.get('cpu family', '?')}, model {fields.get('model', '?')})"
        cpu = fields["model name"] + family if "model name" in fields else cpu
        flags = set(fields.get("flags", "").split())
    return {
        "cpu": cpu,
        "cores": cores(),
        "simd": next((s for s in ("avx512f", "avx2", "avx") if s in flags), "unknown"),
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
        if hasattr(os, "sysconf")
        else None,
        "system": f"{platform.system()} {platform.release().split('-')[0]}",
        "python": platform.python_version(),
    }


def versions(packages: Iterable[str] = PACKAGES) -> dict[str, str | None]:
    """Installed versions; None where a package is not installed."""
    return {name: _version(name) for name in packages}


def commit() -> dict[str, Any]:
    """The commit of the repository and whether the working tree differs from it."""

    def git(*words: str) -> str | None:
        try:
            done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            return None
        return done.stdout.strip()

    status = git("status", "--porcelain")
    return {"commit": git("rev-parse", "HEAD"), "dirty": None if status is None else bool(status)}


def fingerprint(sources: Sequence[str]) -> str:
    """Hash of the Python sources in these files and folders of the repository."""
    parts = hashlib.sha256()
    for source in sources:
        path = ROOT / source
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            parts.update(str(file.relative_to(ROOT)).encode() + b"\0" + file.read_bytes() + b"\0")
    return parts.hexdigest()


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None
