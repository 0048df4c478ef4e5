"""The store of a results folder: one SQLite file, one row per trial, committed as it comes."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.results.columns import KEYS, RENAMED, SEES, TIMED, TIMES, TRIAL
from dikbench.study.plan import PlannedTrial
from dikbench.study.trial import Trial

SCHEMA: Final = 2
"""Version of the tables below. A store of version 1, whose times have other names, is renamed when
it is opened; another one is not read."""

NUMBERS: Final = (*METRICS, *SEES, "wall_time_s", "control_time_s")

TABLES: Final = f"""
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE runs (id INTEGER PRIMARY KEY, manifest TEXT NOT NULL);
CREATE TABLE environments (id TEXT PRIMARY KEY, description TEXT NOT NULL);
CREATE TABLE trials (
  id TEXT PRIMARY KEY,
  formulation TEXT NOT NULL, solver TEXT NOT NULL, scenario TEXT NOT NULL,
  plant TEXT NOT NULL, reference TEXT NOT NULL, seed INTEGER NOT NULL,
  status TEXT NOT NULL, message TEXT NOT NULL, steps INTEGER NOT NULL,
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
  PRIMARY KEY (formulation, solver, scenario)
);
"""
"""A trial's `position` is its place in the plan of the last run; without one it is not part of it
and shown after it. It is `superseded`, kept but not shown, where the plan has a trial with the same
selectors whose formulation or scenario has another source."""


class OtherVersion(DikbenchError):
    """A store that a dikbench with other tables or metrics wrote."""


@dataclass(frozen=True)
class StoredTrial:
    """What identifies a row.

    Attributes:
        id: see `trial_id`.
        trial: the cell.
        steps: number of control steps that it made.
    """

    id: str
    trial: Trial
    steps: int


class Store:
    """An open store; one process writes, committing every row, others may read.

    Args:
        path: its file.
        add_metrics: whether a store that lacks metrics gets their columns, empty, instead of being
            refused.
    """

    def __init__(self, path: Path, *, add_metrics: bool = False) -> None:
        self.path = path
        with self._guarded():
            self._database = sqlite3.connect(path, isolation_level=None)
            self._check_format()
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA synchronous = NORMAL")
            if self._database.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
                self._check_schema(add_metrics=add_metrics)
            else:  # a new file, or one whose run was killed before it had tables
                with self._transaction():
                    for statement in TABLES.split(";\n"):
                        self._database.execute(statement)
                    self._database.execute("INSERT INTO meta VALUES ('schema', ?)", [str(SCHEMA)])
                self._database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        self._file = path.stat()
        self._environments = {row[0] for row in self._rows("SELECT id FROM environments")}

    def __enter__(self) -> Self:
        """Use the store."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close it; what was committed stays."""
        self._database.close()

    def begin_run(self, manifest: Mapping[str, Any], planned: Sequence[PlannedTrial]) -> int:
        """Note that a run begins; its plan says in which order rows are shown.

        Returns:
            The number of the run.
        """
        with self._guarded(), self._transaction():
            cursor = self._database.execute(
                "INSERT INTO runs (manifest) VALUES (?)", [json.dumps(manifest)]
            )
            self._place(planned)
        return int(cursor.lastrowid or 0)

    def _place(self, planned: Sequence[PlannedTrial]) -> None:
        self._database.execute("UPDATE trials SET position = NULL")
        self._database.executemany(
            "UPDATE trials SET position = ?, superseded = 0 WHERE id = ?",
            [(number, trial.id) for number, trial in enumerate(planned)],
        )
        rows = self._database.execute(
            f"SELECT id, {', '.join(TRIAL)} FROM trials WHERE position IS NULL AND NOT superseded"
        )
        known = {tuple(row[1:]): row[0] for row in rows}
        now = (tuple(p.trial.row.values()) for p in planned)
        old = [(known[selectors],) for selectors in now if selectors in known]
        self._database.executemany("UPDATE trials SET superseded = 1 WHERE id = ?", old)

    def statuses(self) -> dict[str, str]:
        """The status of every trial that has a row, by id."""
        return dict(self._rows("SELECT id, status FROM trials"))

    def stored_trials(self) -> list[StoredTrial]:
        """Every trial that is shown."""
        rows = self._rows(f"SELECT id, steps, {', '.join(TRIAL)} FROM trials WHERE NOT superseded")
        return [
            StoredTrial(name, Trial.of(**dict(zip(TRIAL, cell, strict=True))), steps)
            for name, steps, *cell in rows
        ]

    def timed(self) -> set[str]:
        """The ids of the cells that have times."""
        return {row[0] for row in self._rows("SELECT id FROM times")}

    def environment(self, description: Mapping[str, Any]) -> str:
        """Keep the description of a process; the same one is kept once.

        Returns:
            Its name, for rows to refer to.
        """
        text = json.dumps(description, sort_keys=True)
        name = hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
        if name not in self._environments:
            self._insert("environments", {"id": name, "description": text})
            self._environments.add(name)
        return name

    def record_trial(self, row: Mapping[str, Any], run: int, position: int) -> None:
        """Commit the row of a finished trial; an earlier one of the same trial is replaced."""
        columns = ("id", *KEYS, "steps", *NUMBERS, "environment")
        values = {name: row.get(name) for name in columns}
        self._insert("trials", {**values, "run": run, "position": position})

    def record_metrics(self, trial: str, metrics: Mapping[str, float]) -> None:
        """Commit the metrics of a trial that has a row, and nothing else of it."""
        self._check_untouched()
        with self._guarded():
            self._database.execute(
                f"UPDATE trials SET {', '.join(f'{name} = ?' for name in metrics)} WHERE id = ?",
                [*metrics.values(), trial],
            )

    def record_times(self, row: Mapping[str, Any], run: int) -> None:
        """Commit the times of a cell."""
        columns = ("id", *TIMED, *TIMES, "environment")
        self._insert("times", {**{name: row.get(name) for name in columns}, "run": run})

    def trials(self) -> pd.DataFrame:
        """Every trial, those of the last run's plan first and in its order; with their times."""
        order = ", ".join(["id", *KEYS, "steps", *NUMBERS, "environment", "run"])
        trials = self._frame(
            f"SELECT {order} FROM trials WHERE NOT superseded "
            f"ORDER BY position IS NULL, position, {', '.join(TRIAL)}",
            NUMBERS,
        )
        return trials.merge(self.times(), on=TIMED, how="left")

    def times(self) -> pd.DataFrame:
        """The times of every cell."""
        numbers = [name for name, (kind, _) in TIMES.items() if kind == "REAL"]
        columns = ", ".join([*TIMED, *TIMES])
        return self._frame(f"SELECT {columns} FROM times ORDER BY {', '.join(TIMED)}", numbers)

    def manifest(self) -> dict[str, Any]:
        """The description of the last run.

        Raises:
            DikbenchError: if there was none.
        """
        rows = self._rows("SELECT manifest FROM runs ORDER BY id DESC LIMIT 1")
        if not rows:
            raise DikbenchError(f"store {self.path}: it holds no run")
        found: dict[str, Any] = json.loads(rows[0][0])
        return found

    def note(self, key: str, value: Any) -> None:
        """Add an entry to the description of the last run."""
        noted = json.dumps({**self.manifest(), key: value})
        with self._guarded():
            self._database.execute(
                "UPDATE runs SET manifest = ? WHERE id = (SELECT MAX(id) FROM runs)", [noted]
            )

    def environments(self) -> list[dict[str, Any]]:
        """The descriptions of the processes that made the rows of trials that are shown."""
        rows = self._rows(
            "SELECT description FROM environments WHERE id IN "
            "(SELECT environment FROM trials WHERE NOT superseded)"
        )
        return [json.loads(row[0]) for row in rows]

    def close_neatly(self) -> None:
        """Fold the write-ahead log into the file."""
        with self._guarded():
            self._database.execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def _frame(self, query: str, numbers: Sequence[str]) -> pd.DataFrame:
        with self._guarded():
            frame = pd.read_sql_query(query, self._database)
        for name in numbers:
            frame[name] = frame[name].astype(float)  # a column of NULLs has no type
        return frame

    def _rows(self, query: str) -> list[Any]:
        with self._guarded():
            return self._database.execute(query).fetchall()

    def _insert(self, table: str, values: Mapping[str, Any]) -> None:
        self._check_untouched()
        marks = ", ".join("?" * len(values))
        with self._guarded():
            self._database.execute(
                f"INSERT OR REPLACE INTO {table} ({', '.join(values)}) VALUES ({marks})",
                list(values.values()),
            )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._database.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._database.execute("ROLLBACK")
            raise
        self._database.execute("COMMIT")

    @contextmanager
    def _guarded(self) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, pd.errors.DatabaseError) as error:
            reason = " ".join(str(error).split())
            raise DikbenchError(
                f"store {self.path}: {reason}; what was committed before is kept"
            ) from error

    def _check_format(self) -> None:
        try:
            self._database.execute("PRAGMA schema_version").fetchone()
        except sqlite3.DatabaseError as error:
            raise DikbenchError(
                f"store {self.path}: not a store of dikbench ({error}); move it away to start anew"
            ) from None

    def _check_schema(self, *, add_metrics: bool) -> None:
        try:
            found = dict(self._database.execute("SELECT key, value FROM meta").fetchall())
            columns = [row[1] for row in self._database.execute("PRAGMA table_info(trials)")]
        except sqlite3.DatabaseError as error:
            raise DikbenchError(f"store {self.path}: not a store of dikbench: {error}") from None
        if found.get("schema") not in ("1", str(SCHEMA)):
            raise OtherVersion(
                f"store {self.path}: schema version {found.get('schema')!r} is not known; this "
                f"dikbench reads versions 1 and {SCHEMA}"
            )
        missing = [name for name in NUMBERS if name not in columns]
        if missing and not add_metrics:
            raise OtherVersion(
                f"store {self.path}: written by a dikbench with other metrics (it lacks "
                f"{min(missing)!r}); choose another folder, or add them with `dikbench recompute`"
            )
        if found["schema"] == "1":
            self._rename_times()
        for name in missing:
            self._database.execute(f"ALTER TABLE trials ADD COLUMN {name} REAL")

    def _rename_times(self) -> None:
        """Give the columns of times that version 1 wrote today's names."""
        with self._guarded(), self._transaction():
            for old, new in RENAMED.items():
                self._database.execute(f"ALTER TABLE times RENAME COLUMN {old} TO {new}")
            self._database.execute("UPDATE meta SET value = ? WHERE key = 'schema'", [str(SCHEMA)])

    def _check_untouched(self) -> None:
        """A file that is removed or cut under an open database takes rows without a word."""
        try:
            now = self.path.stat()
        except OSError:
            raise DikbenchError(f"store {self.path}: it was removed during the run") from None
        if now.st_ino != self._file.st_ino or now.st_size < self._file.st_size:
            raise DikbenchError(f"store {self.path}: it was replaced or cut during the run")
        self._file = now
