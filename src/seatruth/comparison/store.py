"""The store: one SQLite file with one row a run, which any SQLite tool opens.

Tables: `runs` (one row a search), `estimates` (its parameters), `fits` (what the runs of an instance are measured
against), `fit_parameters` (true values and bounds), `sources` (versions, commit, machine), `about`. A run is written
in one transaction, so whatever ends the program leaves whole runs only. Rows are found by the hash of their run's
definition: a changed definition makes new rows, and old ones stay. Each run and fit carries a checksum of its row, its
parameters and its source: one that does not fit (a changed digit) is left out with a warning and made again.
"""

from __future__ import annotations

import json
import sqlite3
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote

import pandas as pd

from seatruth.comparison.store_schema import SCHEMA, cell, columns, own_columns, row_checksum
from seatruth.comparison.worker import RunResult
from seatruth.errors import BadInput, SeatruthError, SeatruthWarning
from seatruth.provenance import provenance
from seatruth.storage.lock import lock_file

VERSION = 3
_APPLICATION = 0x5EA7C0DE & 0x7FFFFFFF
"""Marks the file as a store of seatruth (SQLite's application_id)."""
_PARAMETERS = {"runs": "estimates", "fits": "fit_parameters"}
"""Of each table with one row a search, the table with its parameters."""
_NUMBERS = ("code", "reason", "value", "evaluations", "diverged", "search_s", "scoring_s", "open_loop", "held_out")


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

    def take_from(self, other: Store) -> int:
        """Copies the runs and fits of another store that are missing here or failed here, all or none; their number.

        Runs that are done here stay, damaged ones there are left out. Raises as `add`.
        """
        copied = 0
        with self._writing(), other._at_one_moment():
            sources: dict[int, int] = {}
            for number, text in other._base.execute("SELECT id, provenance FROM sources"):
                sources[number] = self._source_id(text)
            for table, parameters in _PARAMETERS.items():
                rows = other._base.execute(f"SELECT * FROM {table}")
                names = [column[0] for column in rows.description]
                theirs = [dict(zip(names, row)) for row in rows]
                keys = [row["key"] for row in theirs]
                done, held = self.known(keys, failed=False), self.known(keys)
                for row in theirs:
                    key = row["key"]
                    worse = key in done or (key in held and row["status"] != "done")
                    if worse or key in other._damaged:
                        continue
                    self._delete(table, parameters, key)
                    self._insert(table, row | {"source": sources[row["source"]]})
                    found = other._base.execute(f"SELECT * FROM {parameters} WHERE key = ?", (key,))
                    for parameter in found:
                        self._insert(parameters, dict(zip([column[0] for column in found.description], parameter)))
                    self._seal(table, key)
                    copied += 1
        return copied

    def frame(self, table: str) -> pd.DataFrame:
        """A whole table without its damaged rows."""
        damaged = self._damaged
        try:
            frame = pd.read_sql_query(f"SELECT * FROM {table}", self._base).drop(columns="checksum", errors="ignore")
        except (pd.errors.DatabaseError, UnicodeError) as problem:
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
            row |= {name: cell(numbers.get(name)) for name in _NUMBERS}
            self._insert("runs", row)
            self._parameters("estimates", run.key, result.estimates, ("value", "stderr", "lower", "upper"))
        else:
            names = ("value", "value_at_truth", "n_data", "dimension")
            self._insert("fits", common | {name: cell(numbers.get(name)) for name in names})
            self._parameters("fit_parameters", run.key, result.estimates, ("unit", "value", "truth", "crlb"))
        self._seal(table, run.key)

    def _seal(self, table: str, key: str) -> None:
        """Gives a row its checksum: of the row as SQLite gives it back, which is what is compared later."""
        (digits,) = self._checksums(table, key).values()
        self._base.execute(f"UPDATE {table} SET checksum = ? WHERE key = ?", (digits, key))
        self._damaged.discard(key)

    def _parameters(self, table: str, key: str, frame: pd.DataFrame, names: Sequence[str]) -> None:
        for parameter, row in frame.iterrows():
            content = {"key": key, "parameter": str(parameter)} | {name: cell(row[name]) for name in names}
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
        except (sqlite3.DatabaseError, UnicodeError) as problem:  # the latter of a column's name
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
        contents = {row[0]: [row[:-1], parameters.get(row[0], []), sources.get(row[-3])] for row in rows}
        return {key: row_checksum(content, table) for key, content in contents.items()}

    def _provenance(self) -> int:
        if self._source is None:
            content = provenance()
            content.pop("time_utc")
            self._source = self._source_id(json.dumps(content, sort_keys=True))
        return self._source

    def _source_id(self, text: str) -> int:
        self._base.execute("INSERT OR IGNORE INTO sources (provenance) VALUES (?)", (text,))
        return int(self._base.execute("SELECT id FROM sources WHERE provenance = ?", (text,)).fetchone()[0])

    def _take(self) -> None:
        """Locks the store for this program. The lock ends with the process, however it ends."""
        self._lock = open(self.path.with_name(f".{self.path.name}.lock"), "a", encoding="utf-8")  # noqa: SIM115 - closed by close()
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
        except (sqlite3.DatabaseError, UnicodeError) as problem:
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
        try:
            other = bool(tables) and columns(self._base) != own_columns()
        except (sqlite3.DatabaseError, UnicodeError) as problem:
            raise self._unreadable(problem) from None
        if other:
            raise self._unreadable(ValueError("its tables have other columns"))
        if not write:
            return
        try:
            self._base.execute("PRAGMA journal_mode = WAL")
            self._base.execute("PRAGMA synchronous = NORMAL")
            if not tables:
                self._base.executescript(
                    f"BEGIN; {SCHEMA} PRAGMA application_id = {_APPLICATION}; PRAGMA user_version = {VERSION}; COMMIT;"
                )
        except sqlite3.Error as problem:
            raise SeatruthError(
                f"the store cannot be written ({problem})", where=str(self.path), do="Free some space."
            ) from None


def _quoted(path: Path) -> str:
    return quote(str(path.absolute()))
