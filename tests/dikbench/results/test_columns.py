"""Columns of older results: what the first release wrote is read under today's names."""

from __future__ import annotations

import re
import shutil
import sqlite3
from pathlib import Path

import msgspec
import pandas as pd
import pytest
from makers.runs import run_here

from dikbench.metrics import METRICS
from dikbench.report.comparison.comparison import compare
from dikbench.report.write import write_report
from dikbench.results.reading import read_results
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import status_of
from dikbench.study.study import Cells, Study

DATA = Path(__file__).parents[2] / "data" / "first_release"
"""The study `quick` as the first release ran it, which had no outcomes."""

FIRST_RELEASE = {
    "law_time_median_us": "formulation_time_median_us",
    "law_own_time_median_us": "formulation_own_time_median_us",
    "law_time_p99_us": "formulation_time_p99_us",
    "law_time_p999_us": "formulation_time_p999_us",
    "law_time_max_us": "formulation_time_max_us",
    "timing_verdict": "timing_stability",
}
"""What the first release called the columns whose names have changed since."""


def aged(stored: Path, folder: Path) -> Path:
    """A copy of results whose store is one of the first release."""
    shutil.copytree(stored, folder)
    with sqlite3.connect(folder / "results.sqlite") as database:
        for old, new in FIRST_RELEASE.items():
            database.execute(f"ALTER TABLE times RENAME COLUMN {new} TO {old}")
        database.execute("UPDATE meta SET value = '1' WHERE key = 'schema'")
    database.close()
    return folder


@pytest.mark.parametrize("lenient", [False, True])
def test_a_store_of_the_first_release_is_read(stored: Path, tmp_path: Path, lenient: bool) -> None:
    """Every row and every time, to the bit, and nothing is said to be missing."""
    found = read_results(aged(stored, tmp_path / "old"), lenient=lenient)
    expected = read_results(stored, lenient=lenient)
    assert expected.trials["formulation_time_median_us"].notna().any()
    pd.testing.assert_frame_equal(found.trials, expected.trials, check_exact=True)
    assert found.notes == ()


def test_a_run_continues_in_a_store_of_the_first_release(stored: Path, tmp_path: Path) -> None:
    """What is there is kept, what is missing is run and timed; exports have today's names."""
    folder = aged(stored, tmp_path / "old")
    before = read_results(stored).trials
    study = msgspec.convert(read_results(stored).manifest["study"], Study)
    cells = (*study.cells, Cells(("pinv",)))
    run_here(msgspec.structs.replace(study, cells=cells), folder, RunSettings(jobs=1), "again")
    after = read_results(folder).trials
    assert status_of(folder) == {"ok": 6, "skipped": 2}
    new = after["formulation"] == "pinv"
    assert new.sum() == 2
    assert after.loc[new, "formulation_time_median_us"].notna().all()
    known = after[~new].reset_index(drop=True)
    kept = ["id", "status", "run", *METRICS]
    pd.testing.assert_frame_equal(known[kept], before[kept], check_exact=True)
    exported = pd.read_csv(folder / "trials.csv").columns
    assert set(FIRST_RELEASE.values()) <= set(exported)
    assert not set(FIRST_RELEASE) & set(exported)


@pytest.mark.parametrize("kind", ["trials.csv", "trials.parquet"])
def test_exports_of_the_first_release_are_read(committed: Path, tmp_path: Path, kind: str) -> None:
    """As they would be with today's names."""
    old = {new: name for name, new in FIRST_RELEASE.items()}
    shutil.copy(committed / "manifest.json", tmp_path)
    if kind == "trials.csv":
        rows = pd.read_parquet(committed / "trials.parquet")
        rows.rename(columns=old).to_csv(tmp_path / kind, index=False)
    else:
        pd.read_parquet(committed / kind).rename(columns=old).to_parquet(tmp_path / kind)
    found = read_results(tmp_path).trials
    pd.testing.assert_frame_equal(found, read_results(committed).trials, check_dtype=False)
    assert not set(FIRST_RELEASE) & set(found)


def test_results_of_the_first_release_are_read() -> None:
    """Whole, with their times; leniently it is said which of today's metrics they lack."""
    for lenient in (False, True):
        found = read_results(DATA, lenient=lenient)
        assert len(found.trials) == 444
        assert found.trials["formulation_time_median_us"].notna().any()
        assert found.trials["timing_stability"].eq("stable").any()
        assert not set(FIRST_RELEASE) & set(found.trials)
        assert found.trials["direction_error_max_rad"].notna().any()
        assert (
            not found.trials.filter(items=["lag_max_s", "path_done_share"]).notna().any(axis=None)
        )
        if lenient:
            (note,) = found.notes
            assert re.search(r"without \d+ of today's metrics \(.*\bslow_down\b", note)
            assert "direction_error_max_rad" not in note
        else:
            assert found.notes == ()


def test_results_of_the_first_release_are_reported_and_compared(tmp_path: Path) -> None:
    """The page names the fastest formulation, and no time differs from itself."""
    folder = tmp_path / "old"
    shutil.copytree(DATA, folder)
    write_report(folder)
    page = (folder / "report.md").read_text()
    assert "No times were taken" not in page
    assert (folder / "tables" / "timing.csv").read_text().count("\n") > 5
    times = compare(folder, DATA).times
    assert len(times) > 5
    assert times["ratio"].eq(1.0).all()
    assert times["p99_ratio"].eq(1.0).all()
