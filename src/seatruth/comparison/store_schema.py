"""The tables of a comparison's store."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from functools import cache

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
