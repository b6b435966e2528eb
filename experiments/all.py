"""Runs all experiments, one after the other, and says how long each will take.

    python experiments/all.py [--quick] [--list] [--only NAME ...] [--fresh] [--data FOLDER] [--workers N]

An experiment is `experiments/NAME.py` or `experiments/NAME/__main__.py` with a main guard. Each runs in a process of
its own with the same options; one that fails does not stop the others, but the exit code is then 1 and the last lines
name it. Stages that an earlier run finished are kept, so the same command goes on after an interrupt. Times are those
of the last run here (its stages, kept ones included), or, before a first run, those of `durations.json`. Experiments
that call `options.trials(` need the real trials and are left out, with a word, where there are none.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from common import say
from provenance import ROOT

from seatruth.storage.atomic import write_file

HERE = Path(__file__).resolve().parent
DURATIONS = HERE / "durations.json"
GUARD, NEEDS_TRIALS = '__name__ == "__main__"', "options.trials("


@dataclass(frozen=True)
class Experiment:
    """One experiment: what is run, and the Python files that are its own."""

    name: str
    script: Path
    needs_trials: bool


def find(folder: Path = HERE) -> list[Experiment]:
    """Every experiment in the folder, by name."""
    found = []
    for script in sorted([*folder.glob("*.py"), *folder.glob("*/__main__.py")]):
        text = script.read_text(encoding="utf-8")
        if GUARD not in text or script.name == Path(__file__).name:
            continue
        package = script.name == "__main__.py"
        own = [file.read_text(encoding="utf-8") for file in script.parent.glob("*.py")] if package else [text]
        name = script.parent.name if package else script.stem
        found.append(Experiment(name, script, any(NEEDS_TRIALS in part for part in own)))
    return found


def expected(name: str, quick: bool, results: Path, durations: Path = DURATIONS) -> tuple[float | None, str]:
    """Seconds that a run from nothing takes, and where that is known from; None where it is not known."""
    kept = measured(name, quick, results)
    if kept is not None:
        return kept, "last run here"
    try:
        table = json.loads(durations.read_text(encoding="utf-8"))
        return float(table["quick" if quick else "full"][name]), str(table["machine"])
    except (OSError, ValueError, KeyError, TypeError):
        return None, "never run"


def measured(name: str, quick: bool, results: Path) -> float | None:
    """Seconds of the last finished run and of the stages that it kept from earlier ones; None where there is none."""
    try:
        record = json.loads((results / (f"{name}-quick" if quick else name) / "result.json").read_text("utf-8"))
        stages = [(stage["seconds"], stage["resumed"]) for stage in record["stages"].values()]
        return float(record["wall_s"] + sum(seconds for seconds, resumed in stages if resumed))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def duration(seconds: float | None) -> str:
    """Seconds as a person says them."""
    if seconds is None:
        return "?"
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.1f} min"


def chosen(experiments: Sequence[Experiment], only: Sequence[str], data: Path) -> tuple[list[Experiment], list[str]]:
    """The experiments to run, and the names of those that lack the real trials. SystemExit for a typo."""
    names = [one.name for one in experiments]
    for name in only:
        if name not in names:
            raise SystemExit(f"There is no experiment {name!r}. Known: {', '.join(names)}")
    wanted = [one for one in experiments if not only or one.name in only]
    there = data.is_dir()
    return (
        [one for one in wanted if there or not one.needs_trials],
        [one.name for one in wanted if one.needs_trials and not there],
    )


def run(experiments: Sequence[Experiment], options: Sequence[str], quick: bool, results: Path) -> list[str]:
    """Runs them; what failed, in words."""
    failed, began = [], time.monotonic()
    for k, one in enumerate(experiments, 1):
        seconds, _ = expected(one.name, quick, results)
        say(f"\n== [{k}/{len(experiments)}] {one.name} (about {duration(seconds)})")
        since = time.monotonic()
        code = subprocess.run([sys.executable, str(one.script), *options], cwd=ROOT, check=False).returncode
        if code == 130:
            raise KeyboardInterrupt
        if code:
            failed.append(f"{one.name}: exit code {code}")
        ended = f"failed with exit code {code}" if code else "done"
        now = time.monotonic()
        say(f"-- {one.name}: {ended} in {duration(now - since)} ({duration(now - began)} so far)")
    return failed


def record(experiments: Sequence[Experiment], results: Path, durations: Path = DURATIONS) -> None:
    """Writes what the runs here took into durations.json, for those who run them for the first time."""
    try:
        table = json.loads(durations.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        table = {"machine": "4 cores", "quick": {}, "full": {}}
    for one in experiments:
        for kind, quick in (("quick", True), ("full", False)):
            seconds = measured(one.name, quick, results)
            if seconds is not None:
                table[kind][one.name] = round(seconds)
    write_file(durations, json.dumps(table, indent=1, sort_keys=True) + "\n")


def main(argv: Sequence[str] | None = None) -> int:
    """The command line; returns the exit code (0 done, 1 something failed, 130 stopped)."""
    parser = argparse.ArgumentParser(prog="experiments/all.py", description=str(__doc__).splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="the small version of each")
    parser.add_argument("--list", action="store_true", help="only say which there are and how long they take")
    parser.add_argument("--only", nargs="+", metavar="NAME", default=[], help="these alone")
    parser.add_argument("--fresh", action="store_true", help="do not reuse stages that an earlier run finished")
    parser.add_argument("--data", type=Path, help="folder of the real trials (default: ../shared/data)")
    parser.add_argument("--workers", type=int, help="threads or processes of each (default: all cores)")
    parser.add_argument("--record", action="store_true", help="keep what the last runs took in durations.json, and end")
    given = parser.parse_args(argv)
    results = ROOT / "results"
    experiments, left_out = chosen(find(), given.only, given.data or ROOT.parent / "shared" / "data")
    if given.record:
        record(experiments, results)
        return 0
    known = [(one, *expected(one.name, given.quick, results)) for one in experiments]
    for one, seconds, source in known:
        say(f"{one.name:24} {duration(seconds):>9}  ({source})")
    for name in left_out:
        say(f"{name:24}  left out, it needs the real trials (--data FOLDER)")
    total = sum(seconds or 0.0 for _, seconds, _ in known)
    unknown = sum(seconds is None for _, seconds, _ in known)
    more = f", and {unknown} of unknown length" if unknown else ""
    say(f"{len(known)} experiments, about {duration(total)} from nothing{more}; stages finished earlier are kept.")
    if given.list:
        return 0
    options = ["--quick"] * given.quick + ["--fresh"] * given.fresh
    options += ["--data", str(given.data.resolve())] if given.data else []
    options += ["--workers", str(given.workers)] if given.workers else []
    try:
        failed = run(experiments, options, given.quick, results)
    except KeyboardInterrupt:
        say("Stopped. Finished stages are kept: the same command goes on from here.")
        return 130
    if failed:
        say("\nNot all went well:\n" + "\n".join(f"  {line}" for line in failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
