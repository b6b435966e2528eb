"""The parts of an attack, each run in a process of its own: one that a fault ends is known by its name."""

from __future__ import annotations

import dataclasses
import io
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from outcomes import picture

from attack import boat, fuzz, guard, hostile, inputs, kills, models
from attack.fuzz import Tally
from seatruth.errors import SeatruthError
from seatruth.storage.atomic import write_file

FUZZED = ("expressions", "study files", "comparison files", "logs", "results", "checkpoints", "stores")
MODELS, HOSTILE = "models against Python", "hostile files"
KILLED = tuple(f"kill -9: {command}" for command in kills.COMMANDS)
NAMES = (MODELS, *FUZZED, HOSTILE, *KILLED)
QUICK = tuple(name for name in NAMES if "compare" not in name or name.endswith("compare, 2 workers"))
"""Of comparisons with several numbers of workers, the smallest with workers beside one another is killed."""


def cases_of(part: str, quick: bool, asked: int | None) -> int:
    """How many cases a part gets: as asked, else what its kind needs and a machine has time for."""
    if part == HOSTILE:
        return 0  # all that there are
    if asked is not None:
        return asked
    if part == MODELS:
        return 300 if quick else 1000
    if part in KILLED:
        return 1 if quick else 100
    return 60 if quick else 20_000


def in_own_process(part: str, cases: int, seed: int, out: Path, guided: bool, minutes: float = math.inf) -> Tally:
    """Runs a part; a process that ends without an answer is itself what gave way."""
    answer = _answer(part, out)
    answer.unlink(missing_ok=True)
    line = [sys.executable, "-P", "-W", "ignore", str(Path(__file__).parent), "--part", part, "--cases", str(cases)]
    begun = time.perf_counter()
    done = subprocess.run(
        [*line, "--seed", str(seed), "--out", str(out), "--minutes", str(minutes), *(["--guided"] if guided else [])],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    if not answer.exists():
        reason = f"the process ended with {done.returncode}: {done.stderr.strip()[-300:]}"
        return Tally(part, cases, failed=1, gave_way=[reason], seconds=time.perf_counter() - begun)
    return Tally(**json.loads(answer.read_text()))


def run(part: str, cases: int, seed: int, out: Path, guided: bool, seconds: float = math.inf) -> None:
    """Runs a part here, for so long at most, and writes its tally."""
    os.environ.setdefault("SEATRUTH_THREADS", "1")
    place = Path(tempfile.mkdtemp(prefix="attack-"))

    def ended(tally: Tally) -> NoReturn:
        _answer(part, out).write_text(json.dumps(dataclasses.asdict(tally)))
        shutil.rmtree(place, ignore_errors=True)
        os._exit(0)

    if guided:
        warnings.simplefilter("ignore")
        (target,) = inputs.targets(place, [part])
        fuzz.guided(target, cases, seed, out / "gave way", out / "corpus" / part, seconds, ended)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tally = _tally(part, cases, seed, place, out / "gave way", seconds)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    _answer(part, out).write_text(json.dumps(dataclasses.asdict(tally)))


def _answer(part: str, out: Path) -> Path:
    """The file in which a part's process leaves its tally."""
    return out / f"{part.replace(':', '').replace(',', '').replace(' ', '_')}.json"


def _tally(part: str, cases: int, seed: int, place: Path, kept: Path, seconds: float) -> Tally:
    if part == MODELS:
        return _models(cases, seed, seconds)
    if part == HOSTILE:
        return _hostile(place)
    if part in KILLED:
        return kills.run(part.removeprefix("kill -9: "), cases, seed, place, seconds)
    (target,) = inputs.targets(place, [part])
    return fuzz.run(target, cases, seed, kept, seconds)


def _models(cases: int, seed: int, seconds: float) -> Tally:
    os.environ["SEATRUTH_CACHE"] = "off"
    tally, begun = Tally(MODELS), time.perf_counter()
    for number in range(seed * 1_000_000, seed * 1_000_000 + cases):
        if time.perf_counter() - begun > seconds:
            break
        at = time.perf_counter()
        reason, how = "", "answered"
        try:
            found = models.compare(number)
            if found:
                reason, how = f"{found.what}\n{found.source}", "gave way"
        except SeatruthError as problem:  # with its reason, as conditions that are combined with numbers
            reason, how = str(problem)[:200], "refused"
        except Exception as problem:
            reason, how = f"{type(problem).__name__}: {problem}", "gave way"
        took = time.perf_counter() - at
        tally.note(f"model {number}", guard.Verdict(how, reason, took))
    tally.seconds = time.perf_counter() - begun
    return tally


def _hostile(place: Path) -> Tally:
    tally, begun = Tally(HOSTILE), time.perf_counter()
    guard.command(["check", str(boat.build(place / "warm"))], seconds=120.0)  # loads what every command loads
    for number, (name, case) in enumerate(hostile.cases()):
        folder = place / str(number)
        boat.build(folder)
        tally.note(name, guard.command(case(folder)))
        shutil.rmtree(folder, ignore_errors=True)
    tally.seconds = time.perf_counter() - begun
    return tally


def draw(tallies: Sequence[Tally], file: Path) -> None:
    """Of each part, the shares of the inputs that were answered, refused, or gave way, as PNG."""
    ends = {
        "answered, or ended as without the kill": [t.tried - t.refused - t.failed for t in tallies],
        "refused in readable words": [t.refused for t in tallies],
        "gave way": [t.failed for t in tallies],
    }
    figure = picture([t.name for t in tallies], ends, "Synthetic inputs and what came of them")
    shown = io.BytesIO()
    figure.savefig(shown, format="png", dpi=160, metadata={"Software": None})
    write_file(file, shown.getvalue())


def table(tallies: Sequence[Tally]) -> str:
    """What was tried and what came of it, as Markdown."""
    lines = ["| attack | inputs | refused | seconds | slowest, s | gave way |", "|---|---:|---:|---:|---:|---:|"]
    lines += [
        f"| {t.name} | {t.tried} | {t.refused} | {t.seconds:.0f} | {t.slowest:.2f} | {t.failed or 'nothing'} |"
        for t in tallies
    ]
    whole = sum(t.tried for t in tallies), sum(t.refused for t in tallies), sum(t.seconds for t in tallies)
    failed = sum(t.failed for t in tallies)
    lines.append(f"| **together** | **{whole[0]}** | {whole[1]} | {whole[2]:.0f} | | **{failed or 'nothing'}** |")
    killed = [t for t in tallies if t.when]
    if killed:
        lines += ["", f"| kills that came | {' | '.join(kills.STAGES)} |", "|---" + "|---:" * len(kills.STAGES) + "|"]
        lines += [f"| {t.name} | {' | '.join(str(t.when[stage]) for stage in kills.STAGES)} |" for t in killed]
    return "\n".join(lines) + "\n"
