"""The store of a results folder: what is committed stays, what is harmed is said."""

from __future__ import annotations

import os
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from makers.plugins import law_with
from makers.runs import run_here
from makers.short_study import STUDY, first_row

from dikbench.errors import DikbenchError
from dikbench.plugins import building
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import INSTANCES
from dikbench.results.reading import load_results
from dikbench.results.store import Store
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import status_of
from dikbench.run.trial_row import TracePolicy, run_trial
from dikbench.study import instances, plan
from dikbench.study.identity import timing_id, trial_id
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.trial import Trial

TRIAL = Trial.of("dls", "reach", "none", "ideal", "time", 0)


def changed(**texts: str) -> Trial:
    """The trial with other selectors."""
    return Trial.of(**{**TRIAL.row, **texts})  # type: ignore[arg-type]


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
