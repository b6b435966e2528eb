"""The tables of a comparison's store, and how values and checksums stand in them."""

from __future__ import annotations

import math
import sqlite3
from contextlib import closing
from functools import cache
from typing import Any

from seatruth.storage.checksum import checksum
from seatruth.storage.values import to_text

SCHEMA = """
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


def columns(base: sqlite3.Connection) -> set[tuple[str, str]]:
    """Every column of a database, with its table."""
    return set(
        base.execute(
            "SELECT m.name, c.name FROM sqlite_master m, pragma_table_info(m.name) c "
            "WHERE m.type = 'table' AND m.name NOT LIKE 'sqlite_%'"
        )
    )


@cache
def own_columns() -> set[tuple[str, str]]:
    with closing(sqlite3.connect(":memory:")) as base:
        base.executescript(SCHEMA)
        return columns(base)


def cell(value: Any) -> Any:
    """A value as SQLite keeps it: NaN is NULL."""
    if value is None or isinstance(value, str):
        return value
    number = value.item() if hasattr(value, "item") else value
    return None if isinstance(number, float) and math.isnan(number) else number


def row_checksum(row: list[Any], table: str) -> str:
    """Checksum of a row; none for a row that holds what no run writes, such as bytes."""
    try:
        return checksum(to_text(row), table)
    except TypeError:
        return "it has none"
