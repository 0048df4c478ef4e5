"""The tables of a store, and how those of earlier versions are brought to today's."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Final

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS, OUTCOME_NUMBERS, OUTCOME_TEXTS
from dikbench.results.columns import (
    ASKED,
    KEYS,
    REDEFINED,
    RENAMED_METRICS,
    RENAMED_TIMES,
    SEES,
    TIMES,
)

SCHEMA_VERSION: Final = 4
"""Version of the tables below. Stores of versions 1 to 3 are brought to it when they are
opened; other versions are refused."""

RENAMING_VERSIONS: Final = ("1", "2")
"""Versions in which some metrics had other definitions."""

NUMBERS: Final = (*METRICS, *OUTCOME_NUMBERS, *SEES, *ASKED, "wall_time_s", "control_time_s")

ROW: Final[Mapping[str, str | None]] = MappingProxyType(
    {
        name: "" if name in OUTCOME_TEXTS else None
        for name in ("id", *KEYS, "steps", *OUTCOME_TEXTS, *NUMBERS, "environment")
    }
)
"""The columns of a finished trial, and what they hold where nothing is known."""

EMPTY_TEXT: Final = "TEXT NOT NULL DEFAULT ''"

TABLES: Final = f"""
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE runs (id INTEGER PRIMARY KEY, manifest TEXT NOT NULL);
CREATE TABLE environments (id TEXT PRIMARY KEY, description TEXT NOT NULL);
CREATE TABLE trials (
  id TEXT PRIMARY KEY,
  formulation TEXT NOT NULL, solver TEXT NOT NULL, scenario TEXT NOT NULL,
  plant TEXT NOT NULL, reference TEXT NOT NULL, seed INTEGER NOT NULL,
  status TEXT NOT NULL, message TEXT NOT NULL, steps INTEGER NOT NULL,
  {", ".join(f"{name} {EMPTY_TEXT}" for name in OUTCOME_TEXTS)},
  {", ".join(f"{name} REAL" for name in NUMBERS)},
  environment TEXT REFERENCES environments (id),
  run INTEGER NOT NULL REFERENCES runs (id),
  position INTEGER, superseded INTEGER NOT NULL DEFAULT 0
);
CREATE TABLE times (
  id TEXT NOT NULL,
  formulation TEXT NOT NULL, solver TEXT NOT NULL, scenario TEXT NOT NULL,
  {", ".join(f"{name} {kind}" for name, (kind, _) in TIMES.items())},
  environment TEXT REFERENCES environments (id),
  run INTEGER NOT NULL REFERENCES runs (id),
  superseded INTEGER NOT NULL DEFAULT 0,
  PRIMARY KEY (formulation, solver, scenario)
);
"""
"""A trial's `position` is its place in the plan of the last run; without one it is not part of the
plan and shown last. It is `superseded`, kept but not shown, where its formulation or its
scenario had another source than at the last run, so that no average is over rows of two sources;
times are alike."""


def check_format(database: sqlite3.Connection, path: Path) -> None:
    """Check that an open file is a database.

    Raises:
        DikbenchError: if it is not.
    """
    try:
        database.execute("PRAGMA schema_version").fetchone()
    except sqlite3.DatabaseError as error:
        raise DikbenchError(
            f"store {path}: not a store of dikbench ({error}); move it away and run again"
        ) from None


def migrate(database: sqlite3.Connection, version: str, columns: Sequence[str]) -> None:
    """Bring the tables of an earlier version to today's, inside a transaction.

    Metrics and, of version 1, times are renamed; values of metrics that have another definition
    today are deleted, to be recomputed.

    Args:
        database: the open store.
        version: its version.
        columns: those of its table of trials.
    """
    for old, new in RENAMED_METRICS.items():
        if old in columns:
            database.execute(f"ALTER TABLE trials RENAME COLUMN {old} TO {new}")
    if version in RENAMING_VERSIONS:
        for name in REDEFINED:
            if name in columns:
                database.execute(f"UPDATE trials SET {name} = NULL")
    for old, new in RENAMED_TIMES.items() if version == "1" else ():
        database.execute(f"ALTER TABLE times RENAME COLUMN {old} TO {new}")
    known = [row[1] for row in database.execute("PRAGMA table_info(times)")]
    if "superseded" not in known:
        database.execute("ALTER TABLE times ADD COLUMN superseded INTEGER NOT NULL DEFAULT 0")
    database.execute("UPDATE meta SET value = ? WHERE key = 'schema'", [str(SCHEMA_VERSION)])
