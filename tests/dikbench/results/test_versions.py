"""What made a row: its sources and its versions, whatever looks at it later."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest
from makers.runs import run_here
from makers.shared import made_once

from dikbench.results.reading import load_results, read_results
from dikbench.run import runner
from dikbench.run.in_workers import RunSettings
from dikbench.study.plan import PlannedTrial
from dikbench.study.study import Cells, Study

STUDY = Study(
    description="a few short trials",
    cells=(Cells(("dls", "pinv")), Cells(("qp",), ("daqp",))),
    scenarios=("reach[duration=0.1]", "reach[duration=0.2]"),
    plants=("ideal",),
    name="versions",
)


@pytest.fixture
def copy(tmp_path_factory: pytest.TempPathFactory, tmp_path: Path) -> Path:
    """A copy of the results of the study, six trials."""
    made = made_once(
        tmp_path_factory,
        "versions",
        lambda folder: run_here(STUDY, folder, RunSettings(jobs=1, traces="none"), "a test"),
    )
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture
def chosen(monkeypatch: pytest.MonkeyPatch) -> list[PlannedTrial]:
    """What a run would run; nothing is run."""
    found: list[PlannedTrial] = []

    def run_nothing(todo: Sequence[PlannedTrial], *others: object) -> Iterator[Any]:
        found.extend(todo)
        return iter(())

    monkeypatch.setattr(runner, "run_trials", run_nothing)
    return found


def execute(folder: Path, *statements: str) -> None:
    """Change the store behind its back."""
    with sqlite3.connect(folder / "results.sqlite") as database:
        for statement in statements:
            database.execute(statement)
    database.close()


def made_with(folder: Path, kind: str, name: str, version: str) -> None:
    """Have every row made by another version of something."""
    with sqlite3.connect(folder / "results.sqlite") as database:
        for key, text in database.execute("SELECT id, description FROM environments").fetchall():
            described = json.loads(text)
            described[kind] = {**described[kind], name: version} if name else version
            database.execute(
                "UPDATE environments SET description = ? WHERE id = ?", [json.dumps(described), key]
            )
    database.close()


def shown(folder: Path) -> list[tuple[str, str]]:
    """The formulation and scenario of every row that is shown."""
    trials = load_results(folder).trials
    return list(zip(trials["formulation"], trials["scenario"], strict=True))


def test_rows_of_another_source_are_hidden_outside_of_the_plan_too(
    copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A law was edited and run on one scenario: its rows on the others are of another source."""
    execute(copy, "UPDATE trials SET id = 'before ' || id WHERE formulation = 'dls'")
    part = msgspec.structs.replace(STUDY, cells=(Cells(("dls",)),), scenarios=STUDY.scenarios[:1])
    run_here(part, copy, RunSettings(jobs=1), "second")
    first, second = STUDY.scenarios
    others = [(name, scenario) for name in ("pinv", "qp") for scenario in (first, second)]
    assert shown(copy) == [("dls", first), *others]
    told = capsys.readouterr().err
    assert "kept and not shown, of other sources than today: 2 of the rows" in told
    with sqlite3.connect(copy / "results.sqlite") as database:
        assert database.execute("SELECT COUNT(*) FROM trials").fetchone() == (7,)
    execute(copy, "UPDATE trials SET id = substr(id, 8) WHERE scenario LIKE '%0.2%'")
    run_here(part, copy, RunSettings(jobs=1), "the edit was undone")
    assert ("dls", second) in shown(copy)


def test_times_of_another_source_are_hidden(copy: Path, chosen: list[PlannedTrial]) -> None:
    """They are of the law before it was edited."""
    for name, time in (("before", 1.0), ("", 2.0)):
        execute(
            copy,
            "INSERT OR REPLACE INTO times (id, formulation, solver, scenario, run, "
            f"formulation_time_median_us) SELECT '{name}', 'dls', 'none', scenario, 1, {time} "
            "FROM trials WHERE formulation = 'dls'",
        )
    run_here(STUDY, copy, RunSettings(jobs=1), "second")
    assert load_results(copy).trials["formulation_time_median_us"].isna().all()
    assert chosen == []


def test_a_newer_solver_does_not_rewrite_the_past(copy: Path, chosen: list[PlannedTrial]) -> None:
    """The same command after another solver was installed: nothing runs, and it says with what."""
    made_with(copy, "solvers", "daqp", "0.0.1")
    run_here(STUDY, copy, RunSettings(jobs=1), "second")
    assert chosen == []
    manifest = json.loads((copy / "manifest.json").read_text())
    assert manifest["solvers"]["daqp"] == "0.0.1"
    assert manifest["command"] == "second"
    trials = load_results(copy).trials
    made = manifest["environments"]
    assert {made[name]["solvers"]["daqp"] for name in trials["environment"]} == {"0.0.1"}


def test_rows_of_two_versions_name_both(copy: Path) -> None:
    """A part was run again with another version of the solver: in the manifest, and in a note."""
    made_with(copy, "solvers", "daqp", "0.0.1")
    run_here(STUDY, copy, RunSettings(jobs=1, rerun=STUDY.scenarios[0]), "second")
    results = read_results(copy, lenient=True)
    first, second = results.manifest["solvers"]["daqp"].split(", ")
    assert first == "0.0.1" != second
    (note,) = (note for note in results.notes if "versions" in note)
    assert f"daqp 0.0.1, {second}" in note
    (copy / "results.sqlite").unlink()
    assert note in read_results(copy, lenient=True).notes


@pytest.mark.parametrize(
    ("kind", "name", "again"),
    [
        ("solvers", "daqp", ["qp", "qp"]),
        ("solvers", "osqp", []),
        ("libraries", "numpy", ["dls", "dls", "pinv", "pinv", "qp", "qp"]),
        ("git_commit", "", ["dls", "dls", "pinv", "pinv", "qp", "qp"]),
        ("governor", "", []),
    ],
)
def test_what_other_versions_made_is_run_again(
    copy: Path, chosen: list[PlannedTrial], kind: str, name: str, again: list[str]
) -> None:
    """Of a solver the rows that used it; of a library or of dikbench all; of a machine none."""
    made_with(copy, kind, name, "0.0.1")
    run_here(STUDY, copy, RunSettings(jobs=1, rerun="outdated"), "second")
    assert [str(p.trial.formulation) for p in chosen] == again


def test_outdated_rows_are_current_once_they_were_run_again(copy: Path) -> None:
    """Those of trials that failed or were skipped as well: the second time nothing is left."""
    made_with(copy, "libraries", "numpy", "0.0.1")
    study = msgspec.structs.replace(
        STUDY, cells=(Cells(("dls",)), Cells(("lp-alpha",), ("proxqp",)))
    )
    for runs in ([2, 2, 2, 2], [2, 2, 2, 2]):
        run_here(study, copy, RunSettings(jobs=1, rerun="outdated"), "again")
        assert list(load_results(copy).trials["run"])[:4] == runs
