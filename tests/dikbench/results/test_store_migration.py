"""Stores of earlier versions are opened with today's names, and nothing else of them changes."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from dikbench.metrics import METRICS
from dikbench.results.columns import KEYS, REDEFINED, RENAMED_METRICS, RENAMED_TIMES, TIMED
from dikbench.results.schema import SCHEMA_VERSION
from dikbench.results.store import Store

ROW = {
    "id": "a",
    **dict.fromkeys(KEYS, "x"),
    "seed": 0,
    "steps": 3,
    **{name: float(k) for k, name in enumerate(METRICS)},
}


@pytest.mark.parametrize("schema", [1, 2, 3])
def test_columns_of_earlier_versions_have_the_names_of_today(tmp_path: Path, schema: int) -> None:
    """Values move with their names; those of measures that mean something else now are emptied."""
    path = tmp_path / "results.sqlite"
    with Store(path) as store:
        store.record_trials([(ROW, 0)], 1)
        times = {"id": "a", **dict.fromkeys(TIMED, "x"), "formulation_time_median_us": 7.0}
        store.record_times(times, 1)
    with sqlite3.connect(path) as database:
        database.execute("ALTER TABLE times DROP COLUMN superseded")
        for old, new in RENAMED_METRICS.items() if schema < 3 else ():
            database.execute(f"ALTER TABLE trials RENAME COLUMN {new} TO {old}")
        if schema == 1:
            for old, new in RENAMED_TIMES.items():
                database.execute(f"ALTER TABLE times RENAME COLUMN {new} TO {old}")
        database.execute("UPDATE meta SET value = ? WHERE key = 'schema'", [str(schema)])
    for _ in range(2):  # once is enough
        with Store(path) as store:
            trial, cell = store.trials().iloc[0], store.times().iloc[0]
        emptied = REDEFINED if schema < 3 else ()
        assert trial[list(emptied)].isna().all()
        kept = [name for name in METRICS if name not in emptied]
        assert trial[kept].to_dict() == {name: ROW[name] for name in kept}
        assert cell["formulation_time_median_us"] == 7.0
    with sqlite3.connect(path) as database:
        found = database.execute("SELECT value FROM meta WHERE key = 'schema'").fetchone()
    assert found == (str(SCHEMA_VERSION),)
