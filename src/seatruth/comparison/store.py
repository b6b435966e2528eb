"""The store: one SQLite file with one row a run, which any SQLite tool opens.

Tables: `runs` (one row a search), `estimates` (its parameters), `fits` (what the runs of an instance are measured
against), `fit_parameters` (true values and bounds), `sources` (versions, commit, machine), `about`. A run is written
in one transaction, so whatever ends the program leaves whole runs only. Rows are found by the hash of their run's
definition: a changed definition makes new rows, and old ones stay. Each run and fit carries a checksum of its row, its
parameters and its source: one that does not fit (a changed digit) is left out with a warning and made again.
"""

from __future__ import annotations

import json
import math
import sqlite3
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from datetime import UTC, datetime
from functools import cache, cached_property
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote

import pandas as pd

from seatruth.comparison.worker import RunResult
from seatruth.errors import BadInput, SeatruthError, SeatruthWarning
from seatruth.provenance import provenance
from seatruth.storage.checksum import checksum
from seatruth.storage.lock import lock_file
from seatruth.storage.values import to_text

VERSION = 3
_APPLICATION = 0x5EA7C0DE & 0x7FFFFFFF
"""Marks the file as a store of seatruth (SQLite's application_id)."""
_PARAMETERS = {"runs": "estimates", "fits": "fit_parameters"}
"""Of each table with one row a search, the table with its parameters."""
_NUMBERS = ("code", "reason", "value", "evaluations", "diverged", "search_s", "scoring_s", "open_loop", "held_out")
_SCHEMA = """
CREATE TABLE about (key TEXT PRIMARY KEY, value TEXT);
CREATE TABLE sources (id INTEGER PRIMARY KEY, provenance TEXT UNIQUE);
CREATE TABLE runs (
  key TEXT PRIMARY KEY, instance TEXT, problem TEXT, cost TEXT, solver TEXT, noise TEXT, noise_options TEXT, level REAL,
  seed INTEGER, budget INTEGER, status TEXT, error TEXT, code TEXT, reason TEXT, value REAL, evaluations INTEGER,
  diverged INTEGER, search_s REAL, scoring_s REAL, open_loop REAL, held_out REAL, history TEXT, study_hash TEXT,
  source INTEGER REFERENCES sources(id), finished_utc TEXT, checksum TEXT);
CREATE TABLE estimates (
  key TEXT, parameter TEXT, value REAL, stderr REAL, lower REAL, upper REAL, PRIMARY KEY (key, parameter));
CREATE TABLE fits (
  key TEXT PRIMARY KEY, instance TEXT, problem TEXT, cost TEXT, noise TEXT, noise_options TEXT, level REAL,
  seed INTEGER, status TEXT, error TEXT, value REAL, value_at_truth REAL, n_data INTEGER, dimension INTEGER,
  study_hash TEXT, source INTEGER REFERENCES sources(id), finished_utc TEXT, checksum TEXT);
CREATE TABLE fit_parameters (
  key TEXT, parameter TEXT, unit TEXT, value REAL, truth REAL, crlb REAL, PRIMARY KEY (key, parameter));
"""


class Store:
    """The file of a comparison. Open it in a `with`; only one program writes at a time, any may read.

    Args:
        path: The file.
        write: Whether runs will be added; the file is made if it is missing.

    Raises:
        BadInput: The file is missing, another program's, of another version, damaged, or being written to.

    Warns:
        SeatruthWarning: Stored runs are damaged.
    """

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
        """Releases the file."""
        with suppress(sqlite3.Error):
            self._base.close()
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def known(self, keys: Iterable[str], *, failed: bool = True) -> set[str]:
        """Those of these runs and fits that are done, or have failed if `failed`; damaged ones are not."""
        wanted = set(keys) - self._damaged
        known: set[str] = set()
        for table in _PARAMETERS:
            rows = self._base.execute(f"SELECT key FROM {table}" + ("" if failed else " WHERE status = 'done'"))
            known |= {key for (key,) in rows if key in wanted}
        return known

    def add(self, results: Sequence[RunResult], hashes: Mapping[tuple[str, str], str]) -> None:
        """Writes runs, all or none. `hashes` are the studies' by problem and cost.

        Raises SeatruthError where the disk is full; what was written before stays.
        """
        with self._writing():
            for result in results:
                self._add(result, hashes[result.run.problem, result.run.cost])

    def clear(self, keys: Iterable[str]) -> None:
        """Deletes these runs and fits, all or none. Raises as `add`."""
        with self._writing():
            for key in keys:
                for table, parameters in _PARAMETERS.items():
                    self._delete(table, parameters, key)

    def frame(self, table: str) -> pd.DataFrame:
        """A whole table without its damaged rows."""
        damaged = self._damaged
        try:
            frame = pd.read_sql_query(f"SELECT * FROM {table}", self._base).drop(columns="checksum", errors="ignore")
        except pd.errors.DatabaseError as problem:
            raise self._unreadable(problem) from None
        if "key" in frame and damaged:
            frame = frame[~frame["key"].isin(damaged)].reset_index(drop=True)
        return frame

    def describe(self, name: str, content: Mapping[str, Any]) -> None:
        """Notes the name and the definition of the latest comparison. Raises as `add`."""
        with self._writing():
            for key, value in {"comparison": name, "definition": json.dumps(content, default=str)}.items():
                self._base.execute("INSERT OR REPLACE INTO about VALUES (?, ?)", (key, value))

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """One transaction."""
        try:
            with self._base:
                yield
        except sqlite3.Error as problem:
            raise SeatruthError(
                f"the result of a run cannot be written ({problem})",
                where=str(self.path),
                do="Free some space and run the same command again. All earlier runs are kept.",
            ) from None

    @contextmanager
    def _at_one_moment(self) -> Iterator[None]:
        """Reads within it see the store as it was at the first of them, whatever another program writes meanwhile."""
        if self._base.in_transaction:
            yield
            return
        self._base.execute("BEGIN")
        try:
            yield
        finally:
            self._base.rollback()

    def _add(self, result: RunResult, study_hash: str) -> None:
        run, numbers = result.run, result.numbers
        status = "failed" if result.error else "done"
        common: dict[str, Any] = {name: getattr(run, name) for name in ("key", "instance", "problem", "cost", "seed")}
        common |= {"noise": run.noise.kind, "noise_options": json.dumps(dict(run.noise.options), sort_keys=True)}
        common |= {"level": run.noise.level, "status": status, "error": result.error, "study_hash": study_hash}
        common |= {"source": self._provenance(), "finished_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")}
        table = "runs" if run.solver else "fits"
        self._delete(table, _PARAMETERS[table], run.key)
        if run.solver:
            row = common | {"solver": run.solver, "budget": run.budget, "history": json.dumps(result.history)}
            row |= {name: _cell(numbers.get(name)) for name in _NUMBERS}
            self._insert("runs", row)
            self._parameters("estimates", run.key, result.estimates, ("value", "stderr", "lower", "upper"))
        else:
            names = ("value", "value_at_truth", "n_data", "dimension")
            self._insert("fits", common | {name: _cell(numbers.get(name)) for name in names})
            self._parameters("fit_parameters", run.key, result.estimates, ("unit", "value", "truth", "crlb"))
        # Of the row as SQLite gives it back, which is what is compared later.
        (digits,) = self._checksums(table, run.key).values()
        self._base.execute(f"UPDATE {table} SET checksum = ? WHERE key = ?", (digits, run.key))
        self._damaged.discard(run.key)

    def _parameters(self, table: str, key: str, frame: pd.DataFrame, names: Sequence[str]) -> None:
        for parameter, row in frame.iterrows():
            content = {"key": key, "parameter": str(parameter)} | {name: _cell(row[name]) for name in names}
            self._insert(table, content)

    def _insert(self, table: str, row: Mapping[str, Any]) -> None:
        marks = ", ".join("?" * len(row))
        self._base.execute(f"INSERT OR REPLACE INTO {table} ({', '.join(row)}) VALUES ({marks})", tuple(row.values()))

    def _delete(self, table: str, parameters: str, key: str) -> None:
        for name in (table, parameters):
            self._base.execute(f"DELETE FROM {name} WHERE key = ?", (key,))

    @cached_property
    def _damaged(self) -> set[str]:
        """Keys of runs and fits whose checksum does not fit. The warning comes once, when the store is first read."""
        damaged: set[str] = set()
        try:
            with self._at_one_moment():
                for table in _PARAMETERS:
                    stored = dict(self._base.execute(f"SELECT key, checksum FROM {table}"))
                    damaged |= {key for key, digits in self._checksums(table).items() if digits != stored[key]}
        except sqlite3.DatabaseError as problem:
            raise self._unreadable(problem) from None
        if damaged:
            warnings.warn(
                f"{self.path}: {len(damaged)} stored run{'s are' if len(damaged) > 1 else ' is'} damaged and left out. "
                "The next run of the comparison makes them again.",
                SeatruthWarning,
                stacklevel=2,
            )
        return damaged

    def _unreadable(self, problem: Exception) -> BadInput:
        return BadInput(
            f"the store is damaged ({problem})",
            where=str(self.path),
            do="Run the comparison into a new folder (--out), or restore the file from a copy.",
        )

    def _checksums(self, table: str, key: str | None = None) -> dict[str, str]:
        """Checksums of the rows of a table with their parameters, computed anew; of one key or of all."""
        where, values = ("", ()) if key is None else (" WHERE key = ?", (key,))
        parameters: dict[str, list[Any]] = {}
        for row in self._base.execute(f"SELECT * FROM {_PARAMETERS[table]}{where} ORDER BY key, parameter", values):
            parameters.setdefault(row[0], []).append(row[1:])
        sources = dict(self._base.execute("SELECT id, provenance FROM sources"))
        # The last columns are source, finished_utc and checksum.
        rows = self._base.execute(f"SELECT * FROM {table}{where}", values)
        return {row[0]: _checksum([row[:-1], parameters.get(row[0], []), sources.get(row[-3])], table) for row in rows}

    def _provenance(self) -> int:
        if self._source is None:
            content = provenance()
            content.pop("time_utc")
            text = json.dumps(content, sort_keys=True)
            self._base.execute("INSERT OR IGNORE INTO sources (provenance) VALUES (?)", (text,))
            row = self._base.execute("SELECT id FROM sources WHERE provenance = ?", (text,)).fetchone()
            self._source = int(row[0])
        return self._source

    def _take(self) -> None:
        """Locks the store for this program. The lock ends with the process, however it ends."""
        self._lock = open(self.path.with_name(f".{self.path.name}.lock"), "a")  # noqa: SIM115 - closed by close()
        if not lock_file(self._lock):
            self._lock.close()
            raise BadInput(
                "another comparison is writing to this store",
                where=str(self.path),
                do="Wait for it, or choose another folder with --out. (--ranking shows the ranking so far.)",
            )

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
        if tables and _columns(self._base) != _own_columns():
            raise self._unreadable(ValueError("its tables have other columns"))
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


def _checksum(row: list[Any], table: str) -> str:
    """Checksum of a row; none for a row that holds what no run writes, such as bytes."""
    try:
        return checksum(to_text(row), table)
    except TypeError:
        return "it has none"


def _columns(base: sqlite3.Connection) -> set[tuple[str, str]]:
    """Every column of a database, with its table."""
    return set(
        base.execute(
            "SELECT m.name, c.name FROM sqlite_master m, pragma_table_info(m.name) c "
            "WHERE m.type = 'table' AND m.name NOT LIKE 'sqlite_%'"
        )
    )


@cache
def _own_columns() -> set[tuple[str, str]]:
    with closing(sqlite3.connect(":memory:")) as base:
        base.executescript(_SCHEMA)
        return _columns(base)


def _cell(value: Any) -> Any:
    """A value as SQLite keeps it: NaN is NULL."""
    if value is None or isinstance(value, str):
        return value
    number = value.item() if hasattr(value, "item") else value
    return None if isinstance(number, float) and math.isnan(number) else number


def _quoted(path: Path) -> str:
    return quote(str(path.absolute()))
