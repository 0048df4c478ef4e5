"""The store of a results folder: what is committed stays, what is missing is run, nothing twice."""

from __future__ import annotations

import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd
import pytest
from makers.plugins import law_with
from makers.runs import run_here, without_workers
from makers.shared import made_once

from dikbench.errors import DikbenchError
from dikbench.plugins import building
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import INSTANCES
from dikbench.results.reading import load_results
from dikbench.results.store import Store
from dikbench.run import runner
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import status_of, time_study
from dikbench.run.trial_row import TracePolicy, run_trial
from dikbench.study import instances, plan
from dikbench.study.identity import timing_id, trial_id
from dikbench.study.plan import PlannedTrial, expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import Cells, Study, TimingSettings
from dikbench.study.trial import Trial

STUDY = Study(
    description="a few short trials",
    cells=(Cells(("dls", "pinv[after=clip]")), Cells(("qp",), ("daqp[interface=warm]",))),
    scenarios=("reach[duration=0.2]", "speed-sweep[laps=1,speed=2.5]"),
    plants=("ideal",),
    name="short",
)
TIMELESS = ["wall_time_s", "control_time_s", "environment", "run"]
TRIAL = Trial.of("dls", "reach", "none", "ideal", "time", 0)


def table(folder: Path) -> pd.DataFrame:
    """Every column of the trials but the times and the worker's environment."""
    return load_results(folder).trials.drop(columns=TIMELESS)


def changed(**texts: str) -> Trial:
    """The trial with other selectors."""
    return Trial.of(**{**TRIAL.row, **texts})  # type: ignore[arg-type]


def first_row(store: Store) -> dict[str, Any]:
    """The first trial of a store, as numbers and texts of Python's."""
    return {str(name): value for name, value in store.trials().iloc[0].to_dict().items()}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the study, run once and left alone."""
    return made_once(
        tmp_path_factory,
        "undisturbed",
        lambda folder: run_here(STUDY, folder, RunSettings(jobs=2), "a test"),
    )


SCRIPT = """
import sys
from pathlib import Path
sys.path.insert(0, {folder!r})
from study_of_test import STUDY
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study

if __name__ == "__main__":
    run_study(STUDY, Path({out!r}), RunSettings(jobs={jobs}), "a script")
"""


def script_of(study: Study, folder: Path, jobs: int) -> list[str]:
    """The command that runs a study into `out` in this folder, in a process of its own."""
    (folder / "study_of_test.py").write_text(
        "import msgspec\nfrom dikbench.study.study import Study\n"
        f"STUDY = msgspec.convert({msgspec.to_builtins(study)!r}, Study)\n"
    )
    script = folder / "script.py"
    script.write_text(SCRIPT.format(folder=str(folder), out=str(folder / "out"), jobs=jobs))
    return [sys.executable, str(script)]


def test_every_export_holds_every_trial(undisturbed: Path) -> None:
    """CSV, Parquet and the store say the same."""
    results = load_results(undisturbed)
    stored = results.trials
    assert len(stored) == results.manifest["trials"] == 6
    assert list(stored["id"]) == [p.id for p in expand(STUDY)]
    csv = pd.read_csv(undisturbed / "trials.csv")
    parquet = pd.read_parquet(undisturbed / "trials.parquet")
    for name in ("position_error_rms_m", "steps", "velocity_peak_ratio"):
        assert list(csv[name]) == list(parquet[name]) == list(stored[name])
    assert stored["environment"].notna().all()


def test_the_same_trial_has_the_same_id_however_it_is_spelt() -> None:
    """Defaults that are spelt out, the order of parameters, the form of a number."""
    spelt_out = changed(formulation="dls[damping=0.05]")
    same = {
        trial_id(TRIAL),
        trial_id(spelt_out),
        trial_id(changed(formulation="dls[damping=5e-2]")),
        trial_id(changed(scenario="reach[robot=panda]")),
        trial_id(changed(scenario="reach[dt=0.01,distance=0.1]")),
    }
    assert len(same) == 1
    other = [
        trial_id(changed(formulation="dls[damping=0.06]")),
        trial_id(changed(formulation="pinv")),
        trial_id(changed(scenario="reach[distance=0.11]")),
        trial_id(changed(plant="saturating")),
        trial_id(changed(reference="path")),
        trial_id(replace(TRIAL, seed=1)),
        trial_id(changed(formulation="qp", solver="daqp")),
        trial_id(changed(formulation="qp", solver="daqp[interface=warm]")),
        trial_id(changed(formulation="qp", solver="daqp[preset=high]")),
    ]
    assert len({*same, *other}) == 1 + len(other)
    assert len({timing_id(t.formulation, t.solver, t.scenario) for t in (TRIAL, spelt_out)}) == 1


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


def test_rows_that_are_committed_together_are_kept_all_or_none(
    undisturbed: Path, tmp_path: Path
) -> None:
    """The second of two rows is none that the table takes: the first is not kept either."""
    shutil.copy(undisturbed / "results.sqlite", tmp_path)
    with Store(tmp_path / "results.sqlite") as store:
        before, row = store.statuses(), first_row(store)
        new = [{**row, "id": name} for name in ("first", "second")]
        with pytest.raises(DikbenchError, match="NOT NULL"):
            store.record_trials([(new[0], 0), ({**new[1], "steps": None}, 1)], 1)
        assert store.statuses() == before
        store.record_trials([(new[0], 0), (new[1], 1)], 1)
        assert store.statuses() == {**before, "first": row["status"], "second": row["status"]}


def test_each_description_of_a_process_is_stored_once(tmp_path: Path) -> None:
    """Whatever the order in which they come, also an empty one."""
    with Store(tmp_path / "results.sqlite") as store:
        names = [store.environment({"a": n} if n else {}) for n in (0, 1, 1, 0, 2, 1)]
        assert names == [names[0], names[1], names[1], names[0], names[4], names[1]]
        assert len(set(names)) == 3
        assert "" not in names


def test_rerun_of_what_is_not_there_is_one_line(tmp_path: Path) -> None:
    """With the nearest match, before anything runs."""
    with pytest.raises(DikbenchError, match=r"rerun 'dsl'.*dls"):
        run_here(STUDY, tmp_path / "out", RunSettings(jobs=1, rerun="dsl"), "a test")
    assert not (tmp_path / "out").exists()


def test_status_counts_done_failed_and_missing(undisturbed: Path, tmp_path: Path) -> None:
    """By status, and what the last study still lacks."""
    assert status_of(undisturbed) == {"ok": 6}
    shutil.copytree(undisturbed, tmp_path, dirs_exist_ok=True)
    with sqlite3.connect(tmp_path / "results.sqlite") as database:
        database.execute("DELETE FROM trials WHERE formulation = 'dls'")
        database.execute("UPDATE trials SET status = 'crashed' WHERE formulation = 'qp'")
        database.execute("UPDATE trials SET id = 'other' || id WHERE formulation LIKE 'pinv%'")
    assert status_of(tmp_path) == {"missing": 4, "crashed": 2}


def test_status_draws_and_builds_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Instances that the folder does not know, or that were drawn of another source, neither."""
    selection = Selection(formulations=("pinv",), scenarios=("reach[duration=0.1]",), instances=2)
    study = select(STUDY, selection, named=False)
    run_here(study, tmp_path, RunSettings(jobs=1, traces="none"), "a test")
    (tmp_path / INSTANCES).unlink()
    for where, name in ((instances, "draw"), (building, "make_scenario"), (plan, "make_scenarios")):
        monkeypatch.setattr(where, name, None)
    before = {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()}
    assert status_of(tmp_path) == {"ok": 2}
    now = {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()}
    assert {f: t for f, t in now.items() if not f.name.endswith(("-shm", "-wal"))} == before


def test_two_runs_in_one_folder_exclude_each_other(tmp_path: Path) -> None:
    """The second says so in one line and touches nothing."""
    folder = ResultsFolder(tmp_path)
    with folder.lock(), pytest.raises(DikbenchError, match="another run is at work in it"):
        run_here(STUDY, tmp_path, RunSettings(jobs=1), "second")
    assert not folder.database.exists()


@pytest.mark.parametrize(
    ("policy", "kept"), [("all", (True, True)), ("failures", (False, True)), ("none", (False,) * 2)]
)
def test_traces_are_kept_by_policy(
    tmp_path: Path, policy: TracePolicy, kept: tuple[bool, bool]
) -> None:
    """All of them, those of trials that did not end as `ok`, or none."""
    failing = law_with(tmp_path, "gain: float = 1.0")
    for formulation, expected in zip(("dls", failing), kept, strict=True):
        trial = changed(formulation=formulation, scenario="reach[duration=0.1]")
        row = run_trial(trial, tmp_path / "trace", policy)
        assert (row["status"] == "ok") == (formulation == "dls")
        assert (tmp_path / "trace").exists() == expected
        (tmp_path / "trace").unlink(missing_ok=True)


def test_a_store_of_another_schema_is_refused(undisturbed: Path, tmp_path: Path) -> None:
    """And so is a file that is none, and one with other metrics."""
    target = tmp_path / "results.sqlite"

    def refused(reason: str) -> None:
        before = target.read_bytes()
        with pytest.raises(DikbenchError, match=reason):
            load_results(tmp_path)
        assert target.read_bytes() == before

    target.write_bytes(b"something else, longer than a header" * 100)
    refused(r"not a database|not a store")
    target.write_bytes((undisturbed / "results.sqlite").read_bytes())
    with sqlite3.connect(target) as database:
        database.execute("UPDATE meta SET value = '99' WHERE key = 'schema'")
    refused("schema version '99' is not known; this dikbench reads versions 1 to 4")
    with sqlite3.connect(target) as database:
        database.execute("UPDATE meta SET value = '1' WHERE key = 'schema'")
        database.execute("ALTER TABLE trials DROP COLUMN sigma_min")
    refused("it lacks 'sigma_min'")


@pytest.mark.parametrize("harm", ["removed", "cut", "replaced"])
def test_a_store_that_is_harmed_under_the_run_is_noticed(
    undisturbed: Path, tmp_path: Path, harm: str
) -> None:
    """SQLite itself would go on writing into a file that nobody can find any more."""
    target = tmp_path / "results.sqlite"
    target.write_bytes((undisturbed / "results.sqlite").read_bytes())
    with Store(target) as store:
        row = first_row(store)
        if harm == "removed":
            target.unlink()
        elif harm == "cut":
            os.truncate(target, 100)
        else:
            copy = tmp_path / "copy"
            copy.write_bytes(target.read_bytes())
            copy.replace(target)
        with pytest.raises(DikbenchError, match=r"was removed|was replaced or cut"):
            store.record_trials([(row, 0)], 1)


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is read-only for root")
def test_a_read_only_folder_is_one_line(tmp_path: Path) -> None:
    """Before anything runs."""
    tmp_path.chmod(0o500)
    with pytest.raises(DikbenchError, match="cannot be written: permission denied"):
        run_here(STUDY, tmp_path, RunSettings(jobs=1), "a test")


def test_times_are_kept_and_taken_anew_on_request(tmp_path: Path) -> None:
    """A run takes the times that are missing, `dikbench time` takes all."""
    study = msgspec.structs.replace(
        STUDY, scenarios=STUDY.scenarios[:1], timing=TimingSettings("dls", problems=10, rounds=3)
    )
    run_here(study, tmp_path, RunSettings(jobs=1, traces="none"), "first")
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
