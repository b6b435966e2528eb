"""What every experiment shares: its options, its results folder, its resumable stages.

An experiment is `experiments/NAME.py`. It calls `main(NAME, about, body)`; `body(options, results)` does the work in
stages and adds figures, tables and pictures. The helper writes, under `results/NAME/` (`results/NAME-quick/` with
`--quick`), the tables (CSV), the pictures (PNG and SVG), `summary.md` and one `result.json` with the figures by name
with their units, the seeds, the versions, the commit and the machine. Finished stages are kept in `stages/`, so an
interrupted run goes on where it stopped. Nothing written names a folder of the machine it ran on.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from provenance import ROOT, commit, cores, fingerprint, machine, versions

from seatruth.errors import BadInput, SeatruthError
from seatruth.storage.atomic import write_file

COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9", "#F0E442", "#000000")
"""Colours that colour-blind readers tell apart (Okabe and Ito 2008)."""


@dataclass(frozen=True)
class Options:
    """What the command line asked for."""

    quick: bool
    out: Path
    data: Path
    workers: int
    fresh: bool
    switches: frozenset[str] = frozenset()

    def asked(self, switch: str) -> bool:
        """Whether a switch of the experiment's own was given."""
        return switch in self.switches

    def trials(self, *needed: str) -> Path:
        """The folder of the real trials; a clear message where it, or a file needed in it, is missing."""
        for name in ("", *needed):
            if not (self.data / name).exists():
                raise BadInput(
                    f"the real trials are not there ({name or 'no such folder'})",
                    where="--data",
                    do="Give their folder with --data FOLDER; they are not part of this repository.",
                )
        return self.data


def arguments(
    name: str, about: str, argv: Sequence[str] | None = None, switches: Mapping[str, str] | None = None
) -> Options:
    """Reads the options that all experiments take, and the experiment's own switches with what they mean."""
    parser = argparse.ArgumentParser(prog=f"experiments/{name}.py", description=about)
    parser.add_argument("--quick", action="store_true", help="a small version that shows that everything works")
    parser.add_argument("--out", type=Path, help=f"where to write (default: results/{name} or results/{name}-quick)")
    parser.add_argument("--data", type=Path, help="folder of the real trials (default: ../shared/data)")
    parser.add_argument("--workers", type=int, default=cores(), help="threads or processes (default: all cores)")
    parser.add_argument("--fresh", action="store_true", help="do not reuse stages that an earlier run finished")
    for switch, meaning in (switches or {}).items():
        plain_text = meaning.replace("%", "%%")  # argparse formats a help text, a description it does not
        parser.add_argument(f"--{switch}", action="store_true", help=plain_text)
    given = parser.parse_args(argv)
    if given.workers < 1:
        raise BadInput(f"{given.workers} workers cannot work", where="--workers", do="Give 1 or more.")
    return Options(
        quick=given.quick,
        out=given.out or ROOT / "results" / (f"{name}-quick" if given.quick else name),
        data=given.data or ROOT.parent / "shared" / "data",
        workers=given.workers,
        fresh=given.fresh,
        switches=frozenset(switch for switch in switches or {} if getattr(given, switch.replace("-", "_"))),
    )


def main(
    name: str,
    about: str,
    body: Callable[[Options, Results], None],
    *,
    seeds: Mapping[str, int] | None = None,
    switches: Mapping[str, str] | None = None,
) -> int:
    """Runs an experiment from the command line; returns the exit code (0; 1 failed; 2 bad input; 130 stopped)."""
    try:
        options = arguments(name, about, switches=switches)
        results = Results(name, options, seeds=seeds)
        body(options, results)
        results.finish()
        if results.failures:
            return 1
    except SeatruthError as problem:
        print(problem.message, file=sys.stderr)
        return int(problem.exit_code)
    except KeyboardInterrupt:
        print("Stopped. Finished stages are kept: the same command goes on from here.", file=sys.stderr)
        return 130
    return 0


class Results:
    """One experiment's results folder.

    `seeds` by name go into result.json. `sources` are the files and folders (relative to the repository) whose content
    a stage's outcome depends on: when one changes, finished stages are done again. The default is all of seatruth, its
    optimizers and the experiments.
    """

    def __init__(
        self,
        name: str,
        options: Options,
        *,
        seeds: Mapping[str, int] | None = None,
        sources: Sequence[str] = ("src", "optimizers", "experiments"),
    ) -> None:
        self.name, self.options = name, options
        self.folder = options.out
        self._seeds = dict(seeds or {})
        self._code = fingerprint(sources)
        self._figures: dict[str, dict[str, Any]] = {}
        self._tables: dict[str, str] = {}
        self._pictures: dict[str, list[str]] = {}
        self._texts: list[str] = []
        self._stages: dict[str, dict[str, Any]] = {}
        self.failures: list[str] = []
        self._expected = 0
        self._started = datetime.now(UTC)
        self._load = os.getloadavg() if hasattr(os, "getloadavg") else None
        try:
            (self.folder / "stages").mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise BadInput(
                f"the results folder cannot be made ({problem.strerror})", where=str(self.folder), do="Change --out."
            ) from problem

    def expect(self, stages: int) -> None:
        """How many stages there will be, for the progress lines."""
        self._expected = stages

    def stage(
        self, name: str, definition: Mapping[str, Any], work: Callable[[], Any], *, sources: Sequence[str] | None = None
    ) -> Any:
        """The outcome of `work()`, from an earlier run if it finished with the same definition and code.

        `definition` holds everything the outcome depends on besides the code (settings, seeds, data hashes). The
        outcome must be JSON: numbers, text, lists, mappings; arrays come back as lists. `sources` narrows which files
        count as its code.
        """
        code = self._code if sources is None else fingerprint(sources)
        key = digest({"definition": plain(definition), "code": code, "python": platform.python_version()})
        file = self.folder / "stages" / f"{_safe(name)}.json"
        position = f"[{len(self._stages) + 1}/{max(self._expected, len(self._stages) + 1)}]" if self._expected else "-"
        kept = None if self.options.fresh else _read_stage(file, key)
        if kept is not None:
            say(f"{position} {name}: kept from an earlier run ({kept['seconds']:.1f} s)")
            self._stages[name] = {"seconds": kept["seconds"], "resumed": True}
            return kept["outcome"]
        say(f"{position} {name} ...")
        begin = time.perf_counter()
        self._stages[name] = {"seconds": None, "resumed": False}  # stays so if the work fails
        outcome = plain(work())
        seconds = time.perf_counter() - begin
        write_file(file, json.dumps({"key": key, "stage": name, "seconds": seconds, "outcome": outcome}, indent=1))
        self._stages[name] = {"seconds": seconds, "resumed": False}
        say(f"{position} {name}: {seconds:.1f} s")
        return outcome

    def add_figure(
        self, name: str, value: float | None, unit: str, note: str = "", *, goal: str = "", met: bool | None = None
    ) -> None:
        """One number of the result. `goal` states what it was to be, `met` whether it is; None = not measured."""
        number = None if value is None else plain(value)
        if number is None and not note:
            raise ValueError(f"figure {name!r} has no value and no note that says why")
        entry: dict[str, Any] = {"value": number, "unit": unit, "note": note}
        if goal:
            entry |= {"goal": goal, "met": met}
        self._figures[name] = entry

    def add_table(self, name: str, table: pd.DataFrame) -> None:
        """A table as CSV, numbers in full precision; the index is written if it has a name."""
        file = f"{_safe(name)}.csv"
        keep_index = any(level is not None for level in table.index.names)
        write_file(self.folder / file, table.to_csv(index=keep_index, lineterminator="\n"))
        self._tables[name] = file

    def add_picture(self, name: str, figure: Any) -> None:
        """A matplotlib figure as PNG and SVG; it is closed."""
        import matplotlib as mpl
        import matplotlib.pyplot as plt

        files = []
        with mpl.rc_context({"svg.hashsalt": self.name}):
            for kind in ("png", "svg"):
                file = f"{_safe(name)}.{kind}"
                buffer = io.BytesIO()
                figure.savefig(buffer, format=kind, dpi=160, bbox_inches="tight", metadata=_NO_DATE[kind])
                write_file(self.folder / file, buffer.getvalue())
                files.append(file)
        plt.close(figure)
        self._pictures[name] = files

    def add_text(self, markdown: str) -> None:
        """A piece of Markdown that opens summary.md, in the order of the calls."""
        self._texts.append(markdown.strip())

    def fail(self, what: str) -> None:
        """Something that should have been measured was not: it is on record, and the experiment exits with 1."""
        self.failures.append(what)

    def finish(self) -> dict[str, Any]:
        """Writes summary.md and result.json, and prints the figures."""
        now = datetime.now(UTC)
        record = {
            "experiment": self.name,
            "quick": self.options.quick,
            "figures": self._figures,
            "tables": self._tables,
            "pictures": self._pictures,
            "failures": self.failures,
            "seeds": self._seeds,
            "versions": versions(),
            **commit(),
            "machine": machine() | {"load_at_start": None if self._load is None else round(self._load[0], 2)},
            "workers": self.options.workers,
            "stages": self._stages,
            "started": self._started.isoformat(timespec="seconds"),
            "finished": now.isoformat(timespec="seconds"),
            "wall_s": round((now - self._started).total_seconds(), 1),
        }
        write_file(self.folder / "summary.md", self._summary(record))
        write_file(self.folder / "result.json", json.dumps(record, indent=1) + "\n")
        for name, figure in self._figures.items():
            say(f"  {name}: {_shown(figure)}")
        say(f"Written: result.json, summary.md and {len(self._tables) + 2 * len(self._pictures)} more files.")
        return record

    def _summary(self, record: Mapping[str, Any]) -> str:
        box = record["machine"]
        lines = [
            f"# {self.name}{' (quick version)' if self.options.quick else ''}",
            f"{box['cpu']}, {box['cores']} cores, Python {box['python']}, commit {record['commit'] or 'unknown'}"
            f"{' with changes' if record['dirty'] else ''}, {record['finished']}.",
            *self._texts,
            "| figure | value | goal | met | note |\n|---|---|---|---|---|\n"
            + "\n".join(
                f"| {name} | {_number(f['value'])} {f['unit']} | {f.get('goal', '')} | "
                f"{_verdict(f, 'yes', 'no', '')} | {f['note']} |"
                for name, f in self._figures.items()
            ),
            *(f"![{name}]({files[0]})" for name, files in self._pictures.items()),
            *(f"Table: [{name}]({file})" for name, file in self._tables.items()),
        ]
        return "\n\n".join(lines) + "\n"


def digest(content: Any) -> str:
    """Hash of anything that is JSON."""
    return hashlib.sha256(json.dumps(plain(content), sort_keys=True).encode()).hexdigest()


def plain(content: Any) -> Any:
    """Content as plain JSON: arrays become lists, tuples lists, numbers that are not finite None."""
    if isinstance(content, Mapping):
        return {str(k): plain(v) for k, v in content.items()}
    if isinstance(content, np.ndarray):
        return plain(content.tolist())
    if isinstance(content, list | tuple | set | frozenset):
        return [plain(v) for v in (sorted(content) if isinstance(content, set | frozenset) else content)]
    if isinstance(content, np.generic):
        return plain(content.item())
    if isinstance(content, float):
        return content if math.isfinite(content) else None
    if content is None or isinstance(content, str | int | bool):
        return content
    raise TypeError(f"{type(content).__name__} cannot be written as JSON")


def say(line: str) -> None:
    """One line of progress, at once."""
    print(line, flush=True)


_NO_DATE: dict[str, dict[str, str | None]] = {"png": {"Software": None}, "svg": {"Date": None}}


def _read_stage(file: Path, key: str) -> dict[str, Any] | None:
    try:
        kept = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return kept if isinstance(kept, dict) and kept.get("key") == key and "outcome" in kept else None


def _safe(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "_" for c in name)


def _number(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.4g}"


def _shown(figure: Mapping[str, Any]) -> str:
    text = f"{_number(figure['value'])} {figure['unit']}"
    if figure.get("goal"):
        text += f"   (goal {figure['goal']}: {_verdict(figure, 'met', 'NOT met', 'not judged')})"
    return text


def _verdict(figure: Mapping[str, Any], met: str, missed: str, unknown: str) -> str:
    return unknown if figure.get("met") is None else met if figure["met"] else missed
