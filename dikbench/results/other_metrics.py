"""Columns of a store for metrics of other authors, and their descriptions."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping
from typing import Any, Final

from dikbench.errors import DikbenchError

PREFIX: Final = "metric "
"""What the keys begin with under which a store keeps the descriptions."""


def described_in(database: sqlite3.Connection) -> dict[str, dict[str, Any]]:
    """Read the descriptions, by the names of the metrics."""
    rows = database.execute("SELECT key, value FROM meta WHERE key LIKE ?", [f"{PREFIX}%"])
    return {key.removeprefix(PREFIX): json.loads(value) for key, value in rows.fetchall()}


def add(database: sqlite3.Connection, asked: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Add columns, inside a transaction; values that another source computed are deleted.

    Args:
        database: the open store.
        asked: the descriptions, by the names of the metrics.

    Returns:
        The metrics whose values were deleted.

    Raises:
        DikbenchError: if one has the name of another column.
    """
    known = described_in(database)
    columns = {row[1] for row in database.execute("PRAGMA table_info(trials)")}
    changed = []
    for name, description in asked.items():
        if name not in known:
            if name in columns:
                raise DikbenchError(
                    f"metric {description['selector']} is called {name!r}, as a column of the "
                    "results; valid: another name"
                )
            database.execute(f"ALTER TABLE trials ADD COLUMN {name} REAL")
        elif known[name]["source"] != description["source"]:
            database.execute(f"UPDATE trials SET {name} = NULL")
            changed.append(name)
        database.execute(
            "INSERT OR REPLACE INTO meta VALUES (?, ?)", [PREFIX + name, json.dumps(description)]
        )
    return changed
