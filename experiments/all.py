"""Runs all experiments, and says how long each will take.

    python experiments/all.py [--quick] [--list] [--only NAME ...] [--fresh] [--data FOLDER] [--workers N] [--jobs N]
        [--untested]

An experiment is `experiments/NAME.py` or `experiments/NAME/__main__.py` with a main guard. Each runs in a process of
its own with the same options; one that fails does not stop the others, but the exit code is then 1 and the last lines
name it. Stages that an earlier run finished are kept, so the same command goes on after an interrupt. Times are those
of the last run here (its stages, kept ones included), or, before a first run, those of `durations.json`. Experiments
that call `options.trials(` need the real trials and are left out, with a word, where there are none.

`--quick` runs one experiment on each core, the longest first, each on one thread; what one of them says is printed when
it ends. In full they run one after the other, because several measure time. `--jobs` says otherwise. `--untested`
leaves out those whose small version slow tests run and judge: the checks of a change need not run them twice.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from common import say
from provenance import ROOT, cores

from seatruth.storage.atomic import write_file

HERE = Path(__file__).resolve().parent
MOST_JOBS = 4
"""Experiments side by side, unless more are asked for: each loads the numerical libraries. Chosen here [S]."""
_LOOK_S = 0.05
"""s between two looks at what runs. Chosen here [S]: looks cost nothing."""
_END_S = 2.0
"""s in which an interrupted experiment may end before it gets another interrupt. Chosen here [S]."""
DURATIONS = HERE / "durations.json"
TESTED = (
    "chen2011", "engine_speed", "liu_planing", "standard_comparison", "sun2019", "tuning", "xu2012", "zhao2018",
)  # fmt: skip
"""Their small version is run whole by slow tests (tests/experiments), which judge its figures besides."""
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


@dataclass
class _Running:
    """An experiment at work; `shown` keeps what it says, None where that goes to the terminal at once."""

    experiment: Experiment
    process: subprocess.Popen[bytes]
    since: float
    shown: IO[bytes] | None


def run(
    experiments: Sequence[Experiment], options: Sequence[str], quick: bool, results: Path, jobs: int = 1
) -> list[str]:
    """Runs them, so many at a time, the longest first where there are several; what failed, in words."""
    took = {one.name: expected(one.name, quick, results)[0] for one in experiments}
    waiting = list(experiments)
    if jobs > 1:
        waiting.sort(key=lambda one: -(took[one.name] or 0.0))
    failed, began, count, running = [], time.monotonic(), len(waiting), list[_Running]()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                one = waiting.pop(0)
                k = count - len(waiting)
                say(f"\n== [{k}/{count}] {one.name} (about {duration(took[one.name])})")
                running.append(_started(one, options, apart=jobs > 1))
            ended = [one for one in running if one.process.poll() is not None]
            for done in ended:
                running.remove(done)
                name, code = done.experiment.name, done.process.returncode
                _show(done)
                if code == 130:
                    raise KeyboardInterrupt
                if code:
                    failed.append(f"{name}: exit code {code}")
                how = f"failed with exit code {code}" if code else "done"
                now = time.monotonic()
                say(f"-- {name}: {how} in {duration(now - done.since)} ({duration(now - began)} so far)")
            if not ended:
                time.sleep(_LOOK_S)
    finally:
        _stop(running)
    return failed


def _started(one: Experiment, options: Sequence[str], apart: bool) -> _Running:
    shown = tempfile.TemporaryFile() if apart else None  # noqa: SIM115 - `_show` closes it
    # Beside others each has one core: threads of the linear algebra would take it from them.
    setting = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"} if apart else None
    command = [sys.executable, str(one.script), *options]
    process = subprocess.Popen(
        command, cwd=ROOT, env=setting, stdout=shown, stderr=subprocess.STDOUT if apart else None
    )
    return _Running(one, process, time.monotonic(), shown)


def _show(done: _Running) -> None:
    """Prints what an experiment has said."""
    if done.shown is not None:
        done.shown.seek(0)
        said = done.shown.read().decode("utf-8", "replace").rstrip()
        done.shown.close()
        say(f"\n-- {done.experiment.name} says:\n{said}")


def _stop(running: Sequence[_Running]) -> None:
    """Waits for what is still at work to end after an interrupt, which a keyboard sends to all; else sends one."""
    until = time.monotonic() + _END_S
    while time.monotonic() < until and any(one.process.poll() is None for one in running):
        time.sleep(_LOOK_S)
    for one in running:
        if one.process.poll() is None:
            one.process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
        one.process.wait()
        _show(one)


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
    parser.add_argument("--untested", action="store_true", help="leave out those whose small version slow tests run")
    parser.add_argument("--fresh", action="store_true", help="do not reuse stages that an earlier run finished")
    parser.add_argument("--data", type=Path, help="folder of the real trials (default: ../shared/data)")
    parser.add_argument("--workers", type=int, help="threads or processes of each (default: all cores, or its share)")
    parser.add_argument("--jobs", type=int, help="experiments side by side (default: 1; with --quick one on each core)")
    parser.add_argument("--record", action="store_true", help="keep what the last runs took in durations.json, and end")
    given = parser.parse_args(argv)
    jobs = given.jobs or (min(cores(), MOST_JOBS) if given.quick else 1)
    results = ROOT / "results"
    found = [one for one in find() if not (given.untested and one.name in TESTED)]
    experiments, left_out = chosen(found, given.only, given.data or ROOT.parent / "shared" / "data")
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
    beside = f" ({jobs} side by side)" if jobs > 1 else ""
    say(
        f"{len(known)} experiments{beside}, about {duration(total / jobs)} from nothing{more}; "
        "stages finished earlier are kept."
    )
    if given.list:
        return 0
    options = ["--quick"] * given.quick + ["--fresh"] * given.fresh
    options += ["--data", str(given.data.resolve())] if given.data else []
    workers = given.workers or (max(1, cores() // jobs) if jobs > 1 else None)
    options += ["--workers", str(workers)] if workers else []
    try:
        failed = run(experiments, options, given.quick, results, jobs)
    except KeyboardInterrupt:
        say("Stopped. Finished stages are kept: the same command goes on from here.")
        return 130
    if failed:
        say("\nNot all went well:\n" + "\n".join(f"  {line}" for line in failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
