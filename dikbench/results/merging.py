"""The rows of several stores of one study in one, where they do not contradict each other."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

from dikbench.errors import DikbenchError
from dikbench.results.columns import TIMED, TIMES, TRIAL
from dikbench.results.schema import ROW
from dikbench.study.trial import Trial

UNEQUAL: Final = ("wall_time_s", "control_time_s", "environment")
"""Columns in which two runs of one trial differ."""

MOST_NAMED: Final = 3
"""So many trials that contradict each other are named."""


def copy_rows(source: Path, target: Path, others: Sequence[str], run: int, names: str) -> int:
    """Add the rows of a store to another one that nobody else has open, all or none.

    Of a trial that both have, the row that is there stays; of times, those of a scenario that has
    some, since those that are compared are of one machine.

    Args:
        source: file of the store that is read.
        target: file of the store to which rows are added.
        others: names of the metrics of other authors, which both have.
        run: the number of the run of the target of which the rows shall be.
        names: where rows are that are there, and those that are added, for errors.

    Returns:
        The number of trials that the source has.

    Raises:
        DikbenchError: if both have a trial with different results, or of different sources.
    """
    columns = (*ROW, *others)
    with _opened(target, source) as database:
        _refuse_contradictions(
            database, [name for name in columns if name not in UNEQUAL], others, names
        )
        copied = ", ".join((*columns, "position", "superseded"))
        timed = ", ".join(("id", *TIMED, *TIMES, "environment", "superseded"))
        database.execute("BEGIN IMMEDIATE")
        database.execute("INSERT OR IGNORE INTO environments SELECT * FROM source.environments")
        database.execute(
            f"INSERT OR IGNORE INTO trials ({copied}, run) SELECT {copied}, {run} "
            "FROM source.trials"
        )
        database.execute(
            f"INSERT INTO times ({timed}, run) SELECT {timed}, {run} FROM source.times "
            "WHERE scenario NOT IN (SELECT scenario FROM times)"
        )
        database.execute("COMMIT")
        number: int = database.execute("SELECT COUNT(*) FROM source.trials").fetchone()[0]
    return number


def positions_taken(store: Path) -> int:
    """Count the trials of the plan that a store has."""
    with _opened(store) as database:
        query = "SELECT COUNT(*) FROM trials WHERE position IS NOT NULL"
        number: int = database.execute(query).fetchone()[0]
    return number


def _refuse_contradictions(
    database: sqlite3.Connection, compared: Sequence[str], others: Sequence[str], names: str
) -> None:
    cell = ", ".join(f"there.{name}" for name in TRIAL)
    differ = " OR ".join(f"there.{name} IS NOT added.{name}" for name in compared)
    found = database.execute(
        f"SELECT {cell}, {', '.join(f'there.{name}, added.{name}' for name in compared)} "
        f"FROM trials AS there JOIN source.trials AS added ON there.id = added.id WHERE {differ}"
    ).fetchall()
    if found:
        told = []
        for row in found[:MOST_NAMED]:
            values = row[len(TRIAL) :]
            pairs = zip(compared, values[::2], values[1::2], strict=True)
            name, one, other = next(pair for pair in pairs if pair[1] != pair[2])
            told.append(f"{_trial(row)}: {name} {one} and {other}")
        more = f" and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
        raise DikbenchError(
            f"{names} contradict each other in {len(found)} "
            f"{'trial' if len(found) == 1 else 'trials'}: {'; '.join(told)}{more}; valid: one of "
            "them, run again with --rerun"
        )
    same = " AND ".join(f"there.{name} = added.{name}" for name in TRIAL)
    found = database.execute(
        f"SELECT {cell} FROM trials AS there JOIN source.trials AS added ON {same} "
        "WHERE there.id != added.id AND NOT there.superseded AND NOT added.superseded"
    ).fetchall()
    if found:
        raise DikbenchError(
            f"{names} ran {_trial(found[0])} with different sources of its formulation, scenario, "
            "solver or plant; valid: one of them, run again"
        )


def _trial(row: Sequence[Any]) -> Trial:
    return Trial.of(**dict(zip(TRIAL, row[: len(TRIAL)], strict=True)))


@contextmanager
def _opened(store: Path, source: Path | None = None) -> Iterator[sqlite3.Connection]:
    try:
        with closing(sqlite3.connect(store, isolation_level=None)) as database:
            if source is not None:
                database.execute("ATTACH DATABASE ? AS source", [str(source)])
            yield database
    except sqlite3.Error as error:
        raise DikbenchError(f"store {source or store}: {error}; nothing was merged") from error
