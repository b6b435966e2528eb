"""What do the readers do with damaged files? Cut, bit-flipped, spliced and foreign files of every format.

    python experiments/reader_fuzz.py [--quick]

Each format's own library writes a small synthetic log. Damaged copies of it are read as a user's file is. A copy either
gives a log or is refused with a message that names the file and says what to do; anything else is counted as a failure,
as are more than 10 s of processor time or more than 1 GB of memory for one file. Damage that a format cannot notice
(a flipped bit in a number without a check sum) gives a log with that number changed.
"""

from __future__ import annotations

import functools
import multiprocessing
import random
import resource
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from common import Options, Results, main
from log_formats import WRITERS, manoeuvre
from outcomes import picture

from seatruth.errors import BadInput
from seatruth.readers import read_log

SEED = 20260115
WAYS = ("cut", "flipped", "spliced", "repeated", "foreign")
SECONDS, MEGABYTES = 10.0, 1000.0


def body(options: Options, results: Results) -> None:
    """Reads the damaged copies of every format."""
    cases = 5 if options.quick else 200
    results.expect(len(WRITERS))
    rows = []
    for name in WRITERS:
        definition = {"format": name, "cases": cases, "seed": SEED}
        row = results.stage(name, definition, functools.partial(in_process, name, cases))
        rows.append({"format": name, **row})
    table = pd.DataFrame(rows).drop(columns="examples")
    results.add_table("readers", table)
    results.add_text("```\n" + table.to_string(index=False) + "\n```")
    ends = {
        "read": table["read"].tolist(),
        "refused in readable words": table["refused"].tolist(),
        "gave way": table["failures"].tolist(),
    }
    results.add_picture("outcomes", picture(table["format"].tolist(), ends, "Damaged copies of synthetic logs"))
    for label, column, unit, most in (
        ("failures", "failures", "files", 0),
        ("longest reading", "longest_s", "s of processor time", SECONDS),
        ("most memory", "most_MB", "MB", MEGABYTES),
    ):
        worst = float(table[column].max())
        results.add_figure(label, worst, unit, goal=f"at most {most:g}", met=worst <= most)
    results.add_figure("files tried", int(table["files"].sum()), "files")
    for row in rows:
        for text in row["examples"]:
            results.fail(f"{row['format']}: {text}")


def in_process(name: str, cases: int) -> dict[str, Any]:
    """The outcome for one format, from a process of its own so that its memory is measured alone."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(attack, (name, cases))


def attack(name: str, cases: int) -> dict[str, Any]:
    """Reads damaged copies of one format: how many gave a log, were refused or failed; worst time and memory."""
    rng = random.Random(f"{SEED} {name}")
    seen: Counter[str] = Counter()
    examples: list[str] = []
    longest = 0.0
    with tempfile.TemporaryDirectory() as folder:
        written = WRITERS[name](Path(folder), manoeuvre(np.arange(0.0, 6.0, 0.1))).path
        strange = [_other(other, folder).read_bytes() for other in ("csv", "parquet", "nmea")]
        read_log(written)
        before = memory()[0]
        for number in range(cases):
            way = WAYS[number % len(WAYS)]
            copy = Path(folder) / "damaged" / written.name
            shutil.rmtree(copy.parent, ignore_errors=True)
            copy.parent.mkdir()
            _damage(written, copy, way, rng, strange)
            began = seconds()
            outcome = _attempt(copy)
            longest = max(longest, seconds() - began)
            seen[outcome.partition(":")[0]] += 1
            if outcome.startswith("failed") and len(examples) < 5:
                examples.append(f"{way} {number}: {outcome}")
    own, children = memory()
    return {
        "files": cases,
        "read": seen["read"],
        "refused": seen["refused"],
        "failures": seen["failed"],
        "longest_s": longest,
        "most_MB": max(own - before, children),
        "examples": examples,
    }


def _attempt(path: Path) -> str:
    try:
        log = read_log(path)
        for table in log.tables.values():
            log.clock(table)
    except BadInput as problem:
        named = str(path) in str(problem)
        return "refused" if named and problem.do else f"failed: a message without place or advice: {problem}"
    except BaseException as problem:  # what must not happen
        return f"failed: {type(problem).__name__}: {problem}"
    return "read" if log.tables else "failed: a log without tables"


def _other(name: str, folder: str) -> Path:
    place = Path(folder) / f"other_{name}"
    place.mkdir()
    return WRITERS[name](place, manoeuvre(np.arange(0.0, 1.0, 0.1))).path


def _damage(source: Path, target: Path, way: str, rng: random.Random, strange: list[bytes]) -> None:
    """A copy whose largest file is damaged."""
    if source.is_dir():
        shutil.copytree(source, target)
        file = max(target.rglob("*"), key=lambda part: part.stat().st_size)
        if rng.random() < 0.2:
            file = target / "metadata.yaml"
    else:
        shutil.copy(source, target)
        file = target
    content = file.read_bytes()
    at, other = rng.randrange(len(content)), rng.randrange(len(content))
    if way == "cut":
        content = content[:at]
    elif way == "flipped":
        changed = bytearray(content)
        for _ in range(rng.choice((1, 3, 30))):
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
        content = bytes(changed)
    elif way == "spliced":
        content = content[: min(at, other)] + content[max(at, other) :]
    elif way == "repeated":
        size = rng.choice((1, 8, 64, 512))
        content = content[:at] + rng.choice((content[other : other + size], bytes(size), b"\xff" * size)) + content[at:]
    else:
        head = content[: rng.choice((0, 4, 16, 600))]
        content = head + rng.choice((*strange, rng.randbytes(2000), b""))
    file.write_bytes(content)


def seconds() -> float:
    """Processor time of this process and of those it waited for, s."""
    parts = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(part.ru_utime + part.ru_stime for part in parts)


def memory() -> tuple[float, float]:
    """Most memory of this process and of any that it waited for, MB."""
    own, children = (
        resource.getrusage(who).ru_maxrss / 1024 for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return own, children


if __name__ == "__main__":
    sys.exit(main("reader_fuzz", str(__doc__).splitlines()[0], body, seeds={"damage": SEED}))
