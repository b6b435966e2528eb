"""The store: one SQLite file with one row a run, which any SQLite tool opens.

Tables: `runs` (one row a search), `estimates` (its parameters), `fits` (what the runs of an instance are measured
against), `fit_parameters` (true values and bounds), `sources` (versions, commit, machine), `about`. A run is written
in one transaction, so whatever ends the program leaves whole runs only. Rows are found by the hash of their run's
definition: a changed definition makes new rows, and old ones stay.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any

import pandas as pd

from seatruth.comparison.worker import Done
from seatruth.errors import BadInput, SeatruthError
from seatruth.provenance import provenance

try:
    import fcntl
except ImportError:  # not on Windows: two comparisons on one store are then not noticed
    fcntl = None  # type: ignore[assignment]

VERSION = 1
_APPLICATION = 0x5EA7C0DE & 0x7FFFFFFF
"""Marks the file as a store of seatruth (SQLite's application_id)."""
_RUN = ("instance", "problem", "cost", "solver", "noise", "noise_options", "level", "seed", "budget")
_FOUND = ("code", "reason", "value", "evaluations", "diverged", "search_s", "scoring_s", "open_loop", "held_out")
_SCHEMA = """
CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE sources (id INTEGER PRIMARY KEY, provenance TEXT UNIQUE);
CREATE TABLE runs (
  key TEXT PRIMARY KEY, instance TEXT, problem TEXT, cost TEXT, solver TEXT, noise TEXT, noise_options TEXT, level REAL,
  seed INTEGER, budget INTEGER, status TEXT, error TEXT, code TEXT, reason TEXT, value REAL, evaluations INTEGER,
  diverged INTEGER, search_s REAL, scoring_s REAL, open_loop REAL, held_out REAL, history TEXT, study_hash TEXT,
  source INTEGER REFERENCES sources(id), finished_utc TEXT);
CREATE TABLE estimates (
  key TEXT, parameter TEXT, value REAL, stderr REAL, lower REAL, upper REAL, PRIMARY KEY (key, parameter));
CREATE TABLE fits (
  key TEXT PRIMARY KEY, instance TEXT, problem TEXT, cost TEXT, noise TEXT, noise_options TEXT, level REAL,
  seed INTEGER, status TEXT, error TEXT, value REAL, value_at_truth REAL, n_data INTEGER, dimension INTEGER,
  study_hash TEXT, source INTEGER REFERENCES sources(id), finished_utc TEXT);
CREATE TABLE fit_parameters (
  key TEXT, parameter TEXT, unit TEXT, value REAL, truth REAL, crlb REAL, PRIMARY KEY (key, parameter));
"""


class Store:
    """The file of a comparison. Open it in a `with`; only one program writes at a time, any may read."""

    def __init__(self, path: Path, *, write: bool = True) -> None:
        self.path = path
        self._lock: Any = None
        self._source: int | None = None
        if not write and not path.exists():
            raise BadInput("there is no such store", where=str(path), do="Run the comparison first.")
        if path.is_dir():
            raise BadInput("the store is a folder", where=str(path), do="Name a file, as comparison.sqlite.")
        try:
            if write:
                path.parent.mkdir(parents=True, exist_ok=True)
                self._take()
            self._base = sqlite3.connect(
                path if write else f"file:{_quoted(path)}?mode=ro", uri=not write, timeout=30.0
            )
        except (OSError, sqlite3.Error) as problem:
            raise BadInput(
                f"the store cannot be opened ({problem})", where=str(path), do="Choose another file."
            ) from None
        try:
            self._open(write)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Lets go of the file."""
        with suppress(sqlite3.Error):
            self._base.close()
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def known(self, keys: Iterable[str], *, failed: bool = True) -> set[str]:
        """Those of these runs and fits that are done (or failed, unless these are to be run again)."""
        wanted = set(keys)
        found: set[str] = set()
        for table in ("runs", "fits"):
            rows = self._base.execute(f"SELECT key FROM {table}" + ("" if failed else " WHERE status = 'done'"))
            found |= {key for (key,) in rows if key in wanted}
        return found

    def add(self, done: Sequence[Done], hashes: Mapping[tuple[str, str], str]) -> None:
        """Writes runs, all or none. Raises SeatruthError where the disk is full; what was written before stays."""
        try:
            with self._base:
                for one in done:
                    self._add(one, hashes[one.run.problem, one.run.cost])
        except sqlite3.Error as problem:
            raise SeatruthError(
                f"the result of a run cannot be written ({problem})",
                where=str(self.path),
                do="Free some space; the same command then goes on. Nothing that was written before is lost.",
            ) from None

    def clear(self, keys: Iterable[str]) -> None:
        """Forgets these runs and fits."""
        with self._base:
            for key in keys:
                for table in ("runs", "estimates", "fits", "fit_parameters"):
                    self._base.execute(f"DELETE FROM {table} WHERE key = ?", (key,))

    def frame(self, table: str) -> pd.DataFrame:
        """A whole table."""
        return pd.read_sql_query(f"SELECT * FROM {table}", self._base)

    def describe(self, name: str, content: Mapping[str, Any]) -> None:
        """Notes what the latest comparison was."""
        with self._base:
            for key, value in {"comparison": name, "definition": json.dumps(content, default=str)}.items():
                self._base.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, value))

    def _add(self, done: Done, study_hash: str) -> None:
        run, numbers = done.run, done.numbers
        status = "failed" if done.error else "done"
        common: dict[str, Any] = {name: getattr(run, name) for name in ("key", "instance", "problem", "cost", "seed")}
        common |= {"noise": run.noise.kind, "noise_options": json.dumps(dict(run.noise.options), sort_keys=True)}
        common |= {"level": run.noise.level, "status": status, "error": done.error, "study_hash": study_hash}
        common |= {"source": self._provenance(), "finished_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")}
        if run.solver:
            row = common | {"solver": run.solver, "budget": run.budget, "history": json.dumps(done.history)}
            row |= {name: _cell(numbers.get(name)) for name in _FOUND}
            self._insert("runs", row)
            self._parameters("estimates", run.key, done.estimates, ("value", "stderr", "lower", "upper"))
            return
        names = ("value", "value_at_truth", "n_data", "dimension")
        self._insert("fits", common | {name: _cell(numbers.get(name)) for name in names})
        self._parameters("fit_parameters", run.key, done.estimates, ("unit", "value", "truth", "crlb"))

    def _parameters(self, table: str, key: str, frame: pd.DataFrame, names: Sequence[str]) -> None:
        for parameter, row in frame.iterrows():
            content = {"key": key, "parameter": str(parameter)} | {name: _cell(row[name]) for name in names}
            self._insert(table, content)

    def _insert(self, table: str, row: Mapping[str, Any]) -> None:
        marks = ", ".join("?" * len(row))
        self._base.execute(f"INSERT OR REPLACE INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values()))

    def _provenance(self) -> int:
        if self._source is None:
            content = provenance()
            content.pop("time_utc")
            text = json.dumps(content, sort_keys=True)
            self._base.execute("INSERT OR IGNORE INTO sources (provenance) VALUES (?)", (text,))
            found = self._base.execute("SELECT id FROM sources WHERE provenance = ?", (text,)).fetchone()
            self._source = int(found[0])
        return self._source

    def _take(self) -> None:
        """Locks the store for this program. The lock goes with the process, however it ends."""
        if fcntl is None:
            return
        self._lock = open(self.path.with_name(f".{self.path.name}.lock"), "a")  # noqa: SIM115 - closed by close()
        try:
            fcntl.flock(self._lock.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._lock.close()
            raise BadInput(
                "another comparison is writing to this store",
                where=str(self.path),
                do="Wait for it, or choose another folder with --out. (--ranking shows how it stands.)",
            ) from None
        except OSError:
            return  # a file system without locks: go on as on systems that have none

    def _open(self, write: bool) -> None:
        try:
            tables = {name for (name,) in self._base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            mark = int(self._base.execute("PRAGMA application_id").fetchone()[0])
            version = int(self._base.execute("PRAGMA user_version").fetchone()[0])
        except sqlite3.DatabaseError as problem:
            raise BadInput(
                f"it is no store of seatruth ({problem}); it is left as it was",
                where=str(self.path),
                do="Choose another file.",
            ) from None
        if tables and mark != _APPLICATION:
            raise BadInput(
                "it is the database of another program; it is left as it was",
                where=str(self.path),
                do="Choose another.",
            )
        if tables and version != VERSION:
            raise BadInput(
                f"this store was made by another version of seatruth (format {version}; this one has {VERSION}); it "
                "is left as it was",
                where=str(self.path),
                do="Use that version, or start a new store with --out.",
            )
        if not write:
            return
        try:
            self._base.execute("PRAGMA journal_mode = WAL")
            self._base.execute("PRAGMA synchronous = NORMAL")
            if not tables:
                self._base.executescript(
                    f"BEGIN; {_SCHEMA} PRAGMA application_id = {_APPLICATION}; PRAGMA user_version = {VERSION}; COMMIT;"
                )
        except sqlite3.Error as problem:
            raise SeatruthError(
                f"the store cannot be written ({problem})", where=str(self.path), do="Free some space."
            ) from None


def _cell(value: Any) -> Any:
    """A value as SQLite keeps it: NaN is NULL."""
    if value is None or isinstance(value, str):
        return value
    number = value.item() if hasattr(value, "item") else value
    return None if isinstance(number, float) and math.isnan(number) else number


def _quoted(path: Path) -> str:
    from urllib.parse import quote

    return quote(str(path.absolute()))
