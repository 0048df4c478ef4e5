"""The store of a results folder: one SQLite file, one row per trial, committed as it comes."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import pandas as pd

from dikbench.errors import DikbenchError
from dikbench.metrics import OUTCOME_TEXTS
from dikbench.results.columns import RENAMED_METRICS, TIMED, TIMES, TRIAL
from dikbench.results.other_metrics import add, described_in
from dikbench.results.schema import NUMBERS, ROW, SCHEMA_VERSION, TABLES, check_format, migrate
from dikbench.results.stored_trial import StoredTrial
from dikbench.results.versions import is_outdated, versions_of_rows
from dikbench.scenario.oracle import ORACLES
from dikbench.study.identity import timing_id, timing_id_today, trial_id_today
from dikbench.study.plan import PlannedTrial
from dikbench.study.trial import Trial


class OtherVersion(DikbenchError):
    """A store of a version with other tables or metrics."""


class Store:
    """An open store; one process writes, committing rows as they come, others may read.

    Args:
        path: its file.
        add_metrics: whether a store that lacks metrics gets their columns, empty, instead of being
            refused.

    Attributes:
        other_metrics: descriptions of the metrics of other authors that it has, by name.
    """

    def __init__(self, path: Path, *, add_metrics: bool = False) -> None:
        self.path = path
        with self._guarded():
            self._database = sqlite3.connect(path, isolation_level=None)
            check_format(self._database, path)
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA synchronous = NORMAL")
            if self._database.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]:
                self._check_schema(add_metrics=add_metrics)
            else:  # a new file, or one of a run that was killed before it had tables
                with self._transaction():
                    for statement in TABLES.split(";\n"):
                        self._database.execute(statement)
                    self._database.execute(
                        "INSERT INTO meta VALUES ('schema', ?)", [str(SCHEMA_VERSION)]
                    )
                self._database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        self._file = path.stat()
        self._described: tuple[Mapping[str, Any] | None, str] = None, ""  # of the last row
        self._environments = {row[0] for row in self._rows("SELECT id FROM environments")}
        self.other_metrics = described_in(self._database)

    def __enter__(self) -> Self:
        """Return the store."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the store; committed rows are kept."""
        self._database.close()

    def begin_run(self, manifest: Mapping[str, Any], planned: Sequence[PlannedTrial]) -> int:
        """Record the beginning of a run; its plan says in which order rows are shown.

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
        # A trial that was selected in other words before (a default spelt out) takes today's.
        named = ", ".join(f"{name} = ?" for name in TRIAL)
        self._database.executemany(
            f"UPDATE trials SET {named}, position = ?, superseded = 0 WHERE id = ?",
            [(*p.trial.row.values(), number, p.id) for number, p in enumerate(planned)],
        )
        timed = {
            tuple(t.row[name] for name in TIMED): timing_id(t.formulation, t.solver, t.scenario)
            for t in (p.trial for p in planned)
            if t.formulation.name not in ORACLES
        }
        self._database.executemany(
            "UPDATE OR REPLACE times SET formulation = ?, solver = ?, scenario = ? WHERE id = ?",
            [(*selectors, name) for selectors, name in timed.items()],
        )
        self._supersede({tuple(p.trial.row.values()) for p in planned})

    def _supersede(self, planned: set[tuple[str | int, ...]]) -> None:
        """Hide the rows whose sources are not those of today, and show those whose sources are.

        Args:
            planned: the cells of the plan; rows of theirs outside of it have other sources.
        """
        rows = self._rows(f"SELECT id, {', '.join(TRIAL)} FROM trials WHERE position IS NULL")
        hidden = []
        for name, *cell in rows:
            today = trial_id_today(dict(zip(TRIAL, cell, strict=True)))
            if tuple(cell) in planned or today is not None:
                hidden.append((int(today != name), name))
        self._database.executemany("UPDATE trials SET superseded = ? WHERE id = ?", hidden)
        rows = self._rows(f"SELECT id, {', '.join(TIMED)} FROM times")
        of_times = [
            (int(today != name), *cell)
            for name, *cell in rows
            if (today := timing_id_today(*cell)) is not None
        ]
        where = " AND ".join(f"{name} = ?" for name in TIMED)
        self._database.executemany(f"UPDATE times SET superseded = ? WHERE {where}", of_times)

    def add_other_metrics(self, asked: Mapping[str, Mapping[str, Any]]) -> list[str]:
        """Add metrics of other authors; return those whose values another source had computed."""
        with self._guarded(), self._transaction():
            changed = add(self._database, asked)
        self.other_metrics = described_in(self._database)
        return changed

    def statuses(self) -> dict[str, str]:
        """Return the status of every trial that has a row, by id."""
        return dict(self._rows("SELECT id, status FROM trials"))

    def stored_trials(self) -> list[StoredTrial]:
        """List every trial that is shown."""
        rows = self._rows(
            f"SELECT id, steps, status, {', '.join(TRIAL)} FROM trials WHERE NOT superseded"
        )
        return [
            StoredTrial(name, Trial.of(**dict(zip(TRIAL, cell, strict=True))), steps, status)
            for name, steps, status, *cell in rows
        ]

    def planned(self) -> pd.DataFrame:
        """Return the cells, status, message and steps of the trials of the last plan, by id."""
        return self._frame(
            f"SELECT id, {', '.join(TRIAL)}, status, message, steps FROM trials "
            "WHERE position IS NOT NULL ORDER BY position",
            (),
        )

    def hidden(self) -> int:
        """Count the trials that are kept and not shown, since their sources have changed."""
        return int(self._rows("SELECT COUNT(*) FROM trials WHERE superseded")[0][0])

    def timed(self) -> set[str]:
        """Return the ids of the cells that have times."""
        return {row[0] for row in self._rows("SELECT id FROM times")}

    def outdated(self, now: Mapping[str, Any]) -> set[str]:
        """Return the ids of trials and cells of times that other versions than these made.

        Args:
            now: the description of this process (see `is_outdated`).
        """
        return {
            name
            for table in ("trials", "times")
            for name, solver, made in self._rows(
                f"SELECT {table}.id, solver, description FROM {table} "
                f"LEFT JOIN environments ON environments.id = {table}.environment"
            )
            if is_outdated(solver, None if made is None else json.loads(made), now)
        }

    def environment(self, description: Mapping[str, Any]) -> str:
        """Store the description of a process, each once.

        Returns:
            Its name, which rows refer to.
        """
        if self._described[0] != description:
            text = json.dumps(description, sort_keys=True)
            name = hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
            if name not in self._environments:
                self._insert("environments", ("id", "description"), [(name, text)])
                self._environments.add(name)
            self._described = dict(description), name
        return self._described[1]

    def record_trials(self, rows: Sequence[tuple[Mapping[str, Any], int]], run: int) -> None:
        """Commit rows of trials and their positions, all or none, in place of earlier ones."""
        columns = {**ROW, **dict.fromkeys(self.other_metrics)}
        values = [
            (*(row.get(name, nothing) for name, nothing in columns.items()), run, position)
            for row, position in rows
        ]
        self._insert("trials", (*columns, "run", "position"), values)

    def record_metrics(self, trial: str, metrics: Mapping[str, Any]) -> None:
        """Commit the metrics and the outcome of a trial that has a row, and nothing else of it."""
        self._check_untouched()
        with self._guarded():
            self._database.execute(
                f"UPDATE trials SET {', '.join(f'{name} = ?' for name in metrics)} WHERE id = ?",
                [*metrics.values(), trial],
            )

    def record_times(self, row: Mapping[str, Any], run: int) -> None:
        """Commit the times of a cell."""
        columns = ("id", *TIMED, *TIMES, "environment")
        self._insert("times", (*columns, "run"), [(*map(row.get, columns), run)])

    def trials(self) -> pd.DataFrame:
        """Return every trial with its times, those of the last plan first and in its order."""
        order = ", ".join((*ROW, *self.other_metrics, "run"))
        trials = self._frame(
            f"SELECT {order} FROM trials WHERE NOT superseded "
            f"ORDER BY position IS NULL, position, {', '.join(TRIAL)}",
            (*NUMBERS, *self.other_metrics),
        )
        return trials.merge(self.times(), on=TIMED, how="left")

    def times(self) -> pd.DataFrame:
        """Return the times of every cell whose sources have not changed."""
        numbers = [name for name, (kind, _) in TIMES.items() if kind == "REAL"]
        columns = ", ".join([*TIMED, *TIMES])
        return self._frame(
            f"SELECT {columns} FROM times WHERE NOT superseded ORDER BY {', '.join(TIMED)}", numbers
        )

    def manifest(self) -> dict[str, Any]:
        """Return the description of the last run, with the versions that made the rows.

        Raises:
            DikbenchError: if there was none.
        """
        made = self._rows(
            "SELECT solver, environment, description FROM trials "
            "JOIN environments ON environments.id = environment "
            "WHERE NOT superseded GROUP BY solver, environment ORDER BY MIN(run), environment"
        )
        found = versions_of_rows(
            self.runs()[-1], [(solver, name, json.loads(text)) for solver, name, text in made]
        )
        return {**found, "metrics": self.other_metrics} if self.other_metrics else found

    def runs(self) -> list[dict[str, Any]]:
        """Return the descriptions of all runs, in their order.

        Raises:
            DikbenchError: if there was none.
        """
        rows = self._rows("SELECT manifest FROM runs ORDER BY id")
        if not rows:
            raise DikbenchError(f"store {self.path}: it holds no run")
        return [json.loads(text) for (text,) in rows]

    def note(self, key: str, value: Any) -> None:
        """Add an entry to the description of the last run."""
        noted = [json.dumps({**self.runs()[-1], key: value})]
        last = "(SELECT MAX(id) FROM runs)"
        with self._guarded():
            self._database.execute(f"UPDATE runs SET manifest = ? WHERE id = {last}", noted)

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

    def _insert(
        self, table: str, columns: Sequence[str], rows: Sequence[tuple[str | float | None, ...]]
    ) -> None:
        self._check_untouched()
        marks = ", ".join("?" * len(columns))
        with self._guarded(), self._transaction():
            self._database.executemany(
                f"INSERT OR REPLACE INTO {table} ({', '.join(columns)}) VALUES ({marks})", rows
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

    def _check_schema(self, *, add_metrics: bool) -> None:
        try:
            found = dict(self._database.execute("SELECT key, value FROM meta").fetchall())
            columns = [row[1] for row in self._database.execute("PRAGMA table_info(trials)")]
        except sqlite3.DatabaseError as error:
            raise DikbenchError(f"store {self.path}: not a store of dikbench: {error}") from None
        if found.get("schema") not in [str(known) for known in range(1, SCHEMA_VERSION + 1)]:
            raise OtherVersion(
                f"store {self.path}: schema version {found.get('schema')!r} is not known; this "
                f"dikbench reads versions 1 to {SCHEMA_VERSION}"
            )
        named_today = {RENAMED_METRICS.get(name, name) for name in columns}
        missing = [name for name in (*NUMBERS, *OUTCOME_TEXTS) if name not in named_today]
        if missing and not add_metrics:
            raise OtherVersion(
                f"store {self.path}: written by a dikbench with other metrics (it lacks "
                f"{min(missing)!r}); choose another folder, or add them with `dikbench recompute`"
            )
        if found["schema"] != str(SCHEMA_VERSION):
            with self._guarded(), self._transaction():
                migrate(self._database, found["schema"], columns)
        for name in missing:
            kind = "REAL" if ROW[name] is None else f"TEXT NOT NULL DEFAULT '{ROW[name]}'"
            self._database.execute(f"ALTER TABLE trials ADD COLUMN {name} {kind}")

    def _check_untouched(self) -> None:
        """Check that the file is still there: SQLite would write to a removed one in silence."""
        try:
            now = self.path.stat()
        except OSError:
            raise DikbenchError(f"store {self.path}: it was removed during the run") from None
        if now.st_ino != self._file.st_ino or now.st_size < self._file.st_size:
            raise DikbenchError(f"store {self.path}: it was replaced or cut during the run")
        self._file = now
