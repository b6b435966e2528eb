"""`kill -9` at random moments: the same command then ends as if uninterrupted, and leaves nothing behind.

The moments are spread over the processor time of the whole run: loading, search, checkpoints, results, report. What
other programs take of the machine does not move them.
"""

from __future__ import annotations

import json
import math
import os
import random
import re
import shutil
import sqlite3
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

import pandas as pd
import psutil

from attack import boat, guard
from attack.fuzz import Tally

ENDS_S = 10.0
"""Time in which the workers of a killed process must have ended, s; they look for their parent twice a second."""
COMMANDS: dict[str, Sequence[str]] = {
    "identify": ("identify", "study.toml", "--threads", "1", "--starts", "2", "--cross-validate", "--profile", "K"),
    "diagnose": ("diagnose", "study.toml", "--threads", "1", "--effects", "rudder_offset,gyro_bias"),
    **{f"compare, {n} workers": ("compare", "comparison.toml", "--workers", str(n)) for n in (1, 2, 4)},
}
STAGES = ("before anything was kept", "among checkpoints", "among results", "after its end")
"""What a kill came upon, by the files that were there."""
_SEARCH = ("evaluations = 60\n", 'evaluations = 2000\n\n[optimizer]\nuse = "differential_swarm"\n')
"""In place of a search of a few milliseconds one that writes its checkpoint some hundred times."""
_RUNS = ("seeds = 2\n", "seeds = 8\n")
"""So many realisations that finished runs are stored several times."""
_NEW_CACHE = 5
"""Every so many cases compile anew, so that kills come among the files of compiled kernels too. Chosen here [S]."""
_LOOK_S = 0.01
"""s between two looks at the processor time, which itself moves in such steps."""
_TIMES = {"wall_s", "cpu_s", "time_utc", "seconds", "checksum", "traces_checksum", "sha256", "resumed", "commit"}
"""What differs between two runs of one program; `commit` tells whether someone edits seatruth meanwhile."""
_SECONDS = re.compile(r"(_s|_utc)$")
_SPENT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\dZ| UTC)|\b[\d.]+(e-?\d+)?( to [\d.]+)? (ms|s|min)\b")
"""Dates and durations in a report."""
_OWN = re.compile(r"against search time|>commit<")
"""Lines of a report that hold more than a date or a duration of their run."""


def run(command: str, cases: int, seed: int, place: Path, seconds: float = math.inf) -> Tally:
    """Kills a command at so many moments, for so long at most, each time in a folder of its own."""
    tally, begun, draw = Tally(f"kill -9: {command}"), time.perf_counter(), random.Random(f"{command} {seed}")
    tally.when = dict.fromkeys(STAGES, 0)
    spans = {}
    # Those that a case is measured by; a single case compiles anew.
    for new in sorted({k % _NEW_CACHE == 0 for k in range(cases)}, reverse=True):
        whole = _built(place / f"whole {new}")
        cache = _cache(place / "cache of the whole") if new else None
        before = _spent_by_children()
        _finish(command, whole, cache)
        spans[new] = _spent_by_children() - before
    truth, left, given = _content(whole), _files(whole), _files(_built(place / "given"))
    order = draw.sample(range(cases), cases)  # a run that is cut short has moments from everywhere too
    for k in order:
        if time.perf_counter() - begun > seconds:
            break
        folder, new = _built(place / str(k)), k % _NEW_CACHE == 0
        cache = _cache(place / f"cache {k}") if new else None
        moment = (k + draw.random()) / cases * spans[new]
        at = time.perf_counter()
        stage, reason = _killed(command, folder, cache, moment, set(left) - set(given), set(given))
        tally.when[stage] += 1
        if not reason:
            reason = _resumed(command, folder, cache, truth, left)
        verdict = guard.Verdict("gave way" if reason else "answered", reason, time.perf_counter() - at)
        tally.note(f"after {moment:.2f} s of {spans[new]:.2f} s, {stage}", verdict)
        shutil.rmtree(folder)
        if cache:
            shutil.rmtree(cache)
    tally.seconds = time.perf_counter() - begun
    return tally


def _killed(
    command: str, folder: Path, cache: Path | None, moment: float, results: set[str], given: set[str]
) -> tuple[str, str]:
    """What the kill came upon, and what was wrong with how the rest of its processes ended, if anything."""
    process = subprocess.Popen(
        _line(command), cwd=folder, env=_environment(cache), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while process.poll() is None and _spent(process.pid) < moment:
        time.sleep(_LOOK_S)
    family = []
    with suppress(psutil.NoSuchProcess):
        family = psutil.Process(process.pid).children(recursive=True)
    over = process.poll() is not None
    process.kill()
    process.wait()
    stage = STAGES[3] if over else _stage(set(_files(folder)) - given, results)
    _, alive = psutil.wait_procs(family, timeout=ENDS_S)
    for orphan in alive:
        orphan.kill()
    return stage, f"{len(alive)} workers outlived it by {ENDS_S:g} s" if alive else ""


def _stage(there: set[str], results: set[str]) -> str:
    """The store of a comparison is both: it is where the finished runs are kept."""
    if any(name in results and ".sqlite" not in name and Path(name).suffix for name in there):
        return STAGES[2]
    return STAGES[1] if any(Path(name).suffix for name in there) else STAGES[0]


def _resumed(command: str, folder: Path, cache: Path | None, truth: Any, left: list[str]) -> str:
    """What is wrong with the same command's answer after the kill; "" if nothing."""
    try:
        _finish(command, folder, cache)
    except RuntimeError as problem:
        return str(problem)
    if _files(folder) != left:
        return f"it left {sorted(set(_files(folder)) ^ set(left))}"
    found = _content(folder)
    differing = [name for name in truth if found[name] != truth[name]]
    return f"it ended with another {', '.join(differing)}" if differing else ""


def _built(folder: Path) -> Path:
    """A folder with the study, which searches for longer than the other attacks' and writes its report."""
    study = boat.build(folder)
    study.write_text(study.read_text().replace(*_SEARCH).replace("report = false", "report = true"))
    comparison = folder / "comparison.toml"
    comparison.write_text(comparison.read_text().replace(*_RUNS))
    return folder


def _cache(folder: Path) -> Path:
    """A cache of compiled kernels that is empty, and the user's alone."""
    folder.mkdir(mode=0o700)
    return folder


def _environment(cache: Path | None) -> dict[str, str]:
    return {**os.environ, **({"SEATRUTH_CACHE": str(cache)} if cache else {})}


def _line(command: str) -> list[str]:
    return [sys.executable, "-P", "-m", "seatruth", *COMMANDS[command], "--quiet"]


def _finish(command: str, folder: Path, cache: Path | None) -> None:
    done = subprocess.run(
        _line(command), cwd=folder, env=_environment(cache), capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")


def _spent(number: int) -> float:
    """Processor time of a process and all that it started, s."""
    total = 0.0
    with suppress(psutil.NoSuchProcess):
        process = psutil.Process(number)
        for member in (process, *process.children(recursive=True)):
            with suppress(psutil.NoSuchProcess):
                total += sum(member.cpu_times()[:4])  # its own and that of its ended children, user and system
    return total


def _spent_by_children() -> float:
    times = os.times()
    return times.children_user + times.children_system


def _files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if "__pycache__" not in path.parts)


def _content(folder: Path) -> dict[str, Any]:
    """Of each file everything that time and place do not change."""
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and "__pycache__" not in path.parts]
    return {str(path.relative_to(folder)): _timeless_content(path) for path in paths}


def _timeless_content(path: Path) -> Any:
    if path.suffix == ".sqlite":
        with closing(sqlite3.connect(path)) as base:
            runs = base.execute("SELECT key, value, evaluations, open_loop, held_out, error FROM runs ORDER BY key")
            return [*runs, *base.execute("SELECT * FROM estimates ORDER BY key, parameter")]
    if path.suffix == ".json":
        return _timeless(json.loads(path.read_text()))
    if path.name == "history.parquet":
        return pd.read_parquet(path).drop(columns="seconds").to_csv()
    if path.suffix == ".csv" and path.parent.name == "tables":
        table = pd.read_csv(path)
        return table[[name for name in table if not _SECONDS.search(str(name))]].to_csv()
    if path.suffix == ".tex":
        return len(path.read_text().splitlines())  # the numbers of the table beside it, among them seconds
    if path.suffix == ".html":
        # The picture of what search time buys is drawn from the times themselves.
        lines = (line for line in path.read_text().splitlines() if not _OWN.search(line))
        return [_SPENT.sub("", line) for line in lines]
    return path.read_bytes()


def _timeless(value: Any) -> Any:
    if isinstance(value, dict):
        return [(key, _timeless(entry)) for key, entry in value.items() if key not in _TIMES]
    return [_timeless(entry) for entry in value] if isinstance(value, list) else value
