"""A run in a folder that has results: what is missing is run, and what is there on request."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd
import pytest
from makers.runs import run_here, without_workers
from makers.short_study import STUDY, first_row, script_of, table

from dikbench.errors import DikbenchError
from dikbench.results.reading import load_results
from dikbench.results.store import Store
from dikbench.run import runner
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import status_of, time_study
from dikbench.study.plan import PlannedTrial
from dikbench.study.study import Cells, TimingSettings


def test_the_same_command_runs_only_what_is_missing(undisturbed: Path, tmp_path: Path) -> None:
    """Rows that are there keep their run; a changed study adds and deletes nothing."""
    shutil.copytree(undisturbed, tmp_path, dirs_exist_ok=True)
    run_here(STUDY, tmp_path, RunSettings(jobs=1), "again")
    pd.testing.assert_frame_equal(
        load_results(tmp_path).trials, load_results(undisturbed).trials, check_exact=True
    )


def test_a_changed_study_adds_and_never_deletes(tmp_path: Path) -> None:
    """What another study left stands behind what this one plans."""
    small = msgspec.structs.replace(STUDY, cells=STUDY.cells[:1], scenarios=STUDY.scenarios[:1])
    run_here(small, tmp_path, RunSettings(jobs=1), "first")
    other = msgspec.structs.replace(small, cells=(Cells(("pinv",)),))
    run_here(other, tmp_path, RunSettings(jobs=1), "second")
    formulations = list(load_results(tmp_path).trials["formulation"])
    assert formulations == ["pinv", "dls", "pinv[after=clip]"]
    assert status_of(tmp_path) == {"ok": 1}


def test_a_changed_law_is_run_again_and_its_old_row_is_not_shown(tmp_path: Path) -> None:
    """A formulation is what its source says: another source is another trial.

    Of two processes: this one, and one of its own.
    """
    source = (
        "from dataclasses import dataclass\nimport numpy as np\n\n"
        "@dataclass(frozen=True)\nclass Still:\n    def velocity(self, problem, solve):\n"
        "        return np.full(problem.robot.nv, {})\n"
    )
    formulation = tmp_path / "still_law.py"
    study = msgspec.structs.replace(
        STUDY, cells=(Cells((f"{formulation}:Still",)),), scenarios=("reach[duration=0.1]",)
    )
    speeds: list[list[float]] = []
    for value in (0.0, 1e-3):
        formulation.write_text(source.format(value))
        if speeds:
            subprocess.run(script_of(study, tmp_path, 1), check=True, capture_output=True)
        else:
            run_here(study, tmp_path / "out", RunSettings(jobs=1), "a test")
        speeds.append(load_results(tmp_path / "out").trials["joint_travel_rad"].tolist())
    assert speeds[0] == [0.0]
    assert len(speeds[1]) == 1
    assert speeds[1][0] > 0
    with sqlite3.connect(tmp_path / "out" / "results.sqlite") as database:
        assert database.execute("SELECT COUNT(*) FROM trials").fetchone() == (2,)


@pytest.mark.parametrize(
    ("rerun", "again"),
    [("", 0), ("failed", 1), ("dls", 2), ("reach", 3), ("daqp[interface=warm]", 2), ("all", 6)],
)
def test_rerun_chooses_what_is_run_again(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rerun: str, again: int
) -> None:
    """Failed trials, those of a formulation, scenario or solver, or all."""
    chosen: list[PlannedTrial] = []

    def run_nothing(todo: Sequence[PlannedTrial], *others: object) -> Iterator[Any]:
        chosen.extend(todo)
        return iter(())

    monkeypatch.setattr(runner, "run_trials", run_nothing)
    failed_in(undisturbed, tmp_path)
    run_here(STUDY, tmp_path, RunSettings(jobs=2, rerun=rerun), "second")
    assert len({p.id for p in chosen}) == len(chosen) == again


def failed_in(undisturbed: Path, folder: Path) -> None:
    """Copy the results, with the first trial as one that failed."""
    shutil.copytree(undisturbed, folder, dirs_exist_ok=True)
    with Store(folder / "results.sqlite") as store:
        store.record_trials([({**first_row(store), "status": "timeout"}, 0)], 1)


def test_what_is_run_again_has_a_new_row_in_place_of_the_old(
    undisturbed: Path, tmp_path: Path
) -> None:
    """It is the row of an undisturbed run again, stamped with the second run."""
    failed_in(undisturbed, tmp_path)
    run_here(STUDY, tmp_path, RunSettings(jobs=1, rerun="failed"), "second")
    assert list(load_results(tmp_path).trials["run"]) == [2, 1, 1, 1, 1, 1]
    pd.testing.assert_frame_equal(table(tmp_path), table(undisturbed), check_exact=True)


def test_rerun_of_what_is_not_there_is_one_line(tmp_path: Path) -> None:
    """With the nearest match, before anything runs."""
    with pytest.raises(DikbenchError, match=r"rerun 'dsl'.*dls"):
        run_here(STUDY, tmp_path / "out", RunSettings(jobs=1, rerun="dsl"), "a test")
    assert not (tmp_path / "out").exists()


def test_times_are_kept_and_taken_anew_on_request(tmp_path: Path) -> None:
    """A run takes the times that are missing, `dikbench time` takes all."""
    study = msgspec.structs.replace(
        STUDY, scenarios=STUDY.scenarios[:1], timing=TimingSettings("dls", problems=10, rounds=3)
    )
    run_here(study, tmp_path, RunSettings(jobs=1, traces="none", engine="lockstep"), "first")
    assert list((tmp_path / "traces").iterdir()) == []

    def stamps() -> list[int]:
        with sqlite3.connect(tmp_path / "results.sqlite") as database:
            return [run for (run,) in database.execute("SELECT run FROM times")]

    assert stamps() == [1, 1, 1]
    run_here(study, tmp_path, RunSettings(jobs=1), "second")
    assert stamps() == [1, 1, 1]
    with without_workers():
        time_study(study, tmp_path, "third")
    assert stamps() == [3, 3, 3]
    assert load_results(tmp_path).manifest["engine"] == "lockstep"  # of the trials that are there
    assert len(pd.read_csv(tmp_path / "timing.csv")) == 3
    assert status_of(tmp_path) == {"ok": 3}
    with pytest.raises(DikbenchError, match=r"no section \[timing\]"):
        time_study(STUDY, tmp_path, "fourth")


def rows_in(store: Path) -> int:
    """The number of trials that are committed in a store, which may not be there yet."""
    try:
        with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as database:
            return int(database.execute("SELECT COUNT(*) FROM trials").fetchone()[0])
    except sqlite3.OperationalError:
        return 0


def test_a_killed_run_continues_to_the_same_rows(undisturbed: Path, tmp_path: Path) -> None:
    """Driver and workers are killed twice; the rows are those of a run left alone.

    (`tests/faults/kill.py` does it as often as one likes.)
    """
    for rows, jobs in ((1, 2), (3, 1)):
        process = subprocess.Popen(
            script_of(STUDY, tmp_path, jobs),
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while process.poll() is None and rows_in(tmp_path / "out" / "results.sqlite") < rows:
            time.sleep(0.01)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert rows_in(tmp_path / "out" / "results.sqlite") >= rows
    run_here(STUDY, tmp_path / "out", RunSettings(jobs=2), "continued")
    pd.testing.assert_frame_equal(table(tmp_path / "out"), table(undisturbed), check_exact=True)
    with sqlite3.connect(tmp_path / "out" / "results.sqlite") as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert database.execute("SELECT COUNT(*) FROM trials").fetchone() == (6,)
