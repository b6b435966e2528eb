"""`kill -9` at random moments: the same command then ends as if uninterrupted, and leaves nothing behind."""

from __future__ import annotations

import json
import math
import random
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import psutil

from attack import boat, guard
from attack.fuzz import Tally

ENDS_S = 10.0
"""Time in which the workers of a killed process must have ended, s; they look for their parent twice a second."""
COMMANDS: dict[str, Sequence[str]] = {
    "identify": ("identify", "study.toml", "--threads", "1", "--cross-validate"),
    "diagnose": ("diagnose", "study.toml", "--threads", "1", "--effects", "rudder_offset,rudder_gain,gyro_bias"),
    **{f"compare, {n} workers": ("compare", "comparison.toml", "--workers", str(n)) for n in (1, 2, 4)},
}
_TIMES = {"wall_s", "cpu_s", "time_utc", "seconds", "checksum", "traces_checksum", "sha256", "resumed"}


def run(command: str, cases: int, seed: int, place: Path, seconds: float = math.inf) -> Tally:
    """Kills a command at so many moments, for so long at most, each time in a folder of its own."""
    tally, begun, draw = Tally(f"kill -9: {command}"), time.perf_counter(), random.Random(f"{command} {seed}")
    boat.build(place / "whole")
    started = time.perf_counter()
    _whole(command, place / "whole")
    lasts = time.perf_counter() - started
    truth, left = _numbers(place / "whole"), _files(place / "whole")
    for k in range(cases):
        if time.perf_counter() - begun > seconds:
            break
        folder = place / str(k)
        boat.build(folder)
        moment = draw.uniform(0.0, 1.0) * lasts
        at = time.perf_counter()
        tally.note(f"after {moment:.2f} s of {lasts:.2f} s", _killed(command, folder, moment, truth, left, at))
        shutil.rmtree(folder)
    tally.seconds = time.perf_counter() - begun
    return tally


def _killed(command: str, folder: Path, moment: float, truth: Any, left: list[str], begun: float) -> guard.Verdict:
    process = subprocess.Popen(_line(command), cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(moment)
    try:
        family = psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        family = []
    process.kill()
    process.wait()
    _, alive = psutil.wait_procs(family, timeout=ENDS_S)
    for orphan in alive:
        orphan.kill()
    if alive:
        return guard.Verdict(
            "gave way", f"{len(alive)} workers outlived it by {ENDS_S:g} s", time.perf_counter() - begun
        )
    try:
        _whole(command, folder)
    except RuntimeError as problem:
        return guard.Verdict("gave way", str(problem), time.perf_counter() - begun)
    took = time.perf_counter() - begun
    if _numbers(folder) != truth:
        return guard.Verdict("gave way", "it ended with other numbers", took)
    if _files(folder) != left:
        return guard.Verdict("gave way", f"it left {sorted(set(_files(folder)) ^ set(left))}", took)
    return guard.Verdict("answered", "", took)


def _line(command: str) -> list[str]:
    return [sys.executable, "-P", "-m", "seatruth", *COMMANDS[command], "--quiet"]


def _whole(command: str, folder: Path) -> None:
    done = subprocess.run(_line(command), cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")


def _files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if "__pycache__" not in path.parts)


def _numbers(folder: Path) -> Any:
    """Everything in the results that time and place do not change."""
    found: list[Any] = []
    for path in sorted(folder.rglob("*.sqlite")):
        with closing(sqlite3.connect(path)) as base:
            runs = base.execute("SELECT key, value, evaluations, open_loop, held_out, error FROM runs ORDER BY key")
            found += [*runs, *base.execute("SELECT * FROM estimates ORDER BY key, parameter")]
    for path in sorted(folder.rglob("*.json")):
        found.append(_timeless(json.loads(path.read_text())))
    for path in sorted(folder.rglob("*.parquet")):
        if path.name != "history.parquet":  # it holds seconds
            found.append((path.name, path.read_bytes()))
    return found


def _timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return [(key, _timeless(entry)) for key, entry in value.items() if key not in _TIMES]
    return [_timeless(entry) for entry in value] if isinstance(value, list) else value
