"""Shards of a study, and their merge: the rows of one process, or one line that says why not."""

from __future__ import annotations

import shutil
import sqlite3
from collections import Counter
from pathlib import Path
from typing import Any

import msgspec
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from makers.commands import in_process
from makers.runs import run_here
from makers.short_study import STUDY, table

from dikbench.errors import DikbenchError
from dikbench.report.comparison.comparison import compare
from dikbench.results.folder import ResultsFolder
from dikbench.results.reading import load_results
from dikbench.results.store import Store
from dikbench.run.blocks import LEAST_ROWS, Engine, family_and_robot
from dikbench.run.in_workers import RunSettings
from dikbench.run.merge import merge_results
from dikbench.run.runner import status_of
from dikbench.run.shards import WHOLE_SCENARIOS, Shard, parse_shard, trials_of_shard
from dikbench.selector import parse_selector
from dikbench.study.plan import PlannedTrial
from dikbench.study.study import Cells, Study
from dikbench.study.trial import Trial

PARTS = 4

WIDE: Study = msgspec.structs.replace(
    STUDY,
    cells=(Cells(("oracle", "dls", "pinv[after=clip]")), Cells(("qp", "lp-alpha"), ("proxqp",))),
    scenarios=(*STUDY.scenarios, "reach[robot=planar3r,duration=0.2]"),
    seeds=(0, 1),
)
"""With a pair that is skipped, and so small that no shard has whole scenarios."""


def _shards(study: Study, folder: Path, engine: Engine = "alone", **how: Any) -> list[Path]:
    folders = [folder / f"shard{number}" for number in range(1, PARTS + 1)]
    for number, each in enumerate(folders, start=1):
        settings = RunSettings(1, engine=engine, shard=Shard(number, PARTS), **how)
        run_here(study, each, settings, "a shard")
    return folders


@pytest.fixture(scope="module", params=["alone", "lockstep"])
def runs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a study that one process ran, and its four shards."""
    folder = tmp_path_factory.mktemp(request.param)
    run_here(WIDE, folder / "whole", RunSettings(1, engine=request.param), "one process")
    _shards(WIDE, folder, request.param)
    return folder


def _copy(runs: Path, tmp_path: Path) -> list[Path]:
    for number in range(1, PARTS + 1):
        shutil.copytree(runs / f"shard{number}", tmp_path / f"shard{number}")
    return sorted(tmp_path.glob("shard*"))


def test_a_merge_of_four_shards_is_one_process(runs: Path, tmp_path: Path) -> None:
    """Bit for bit in every physical column and trace, in the same order, each row once."""
    shards = [runs / f"shard{number}" for number in range(1, PARTS + 1)]
    merged = merge_results(shards, tmp_path / "merged", "a merge")
    one = table(runs / "whole")
    pd.testing.assert_frame_equal(table(tmp_path / "merged"), one, check_exact=True)
    assert merged.done == merged.planned == len(one) == sum(len(table(each)) for each in shards)
    assert str(merged) == f"{len(one)} of {len(one)} trials"
    names = sorted(path.name for path in (runs / "whole" / "traces").iterdir())
    assert names
    assert names == sorted(path.name for path in (tmp_path / "merged" / "traces").iterdir())
    for name in names:
        traces = [folder / "traces" / name for folder in (runs / "whole", tmp_path / "merged")]
        assert traces[0].read_bytes() == traces[1].read_bytes()


def test_a_merged_folder_is_like_any_other(runs: Path, tmp_path: Path) -> None:
    """Status, comparison and the command of the study work on it; nothing is run again."""
    out = tmp_path / "merged"
    merge_results(sorted(runs.glob("shard*")), out, "a merge")
    assert status_of(out) == status_of(runs / "whole")
    assert not compare(runs / "whole", out, []).regressed
    before = load_results(out).trials
    run_here(WIDE, out, RunSettings(1), "again")
    pd.testing.assert_frame_equal(load_results(out).trials, before, check_exact=True)
    assert {path.name for path in out.iterdir()} >= {"trials.csv", "trials.parquet"}
    assert not [path for path in out.iterdir() if "partial" in path.name]


def test_a_shard_knows_what_it_lacks(runs: Path, tmp_path: Path) -> None:
    """Its own trials are all there, and the others are named; the study goes on in its folder."""
    shard = _copy(runs, tmp_path)[0]
    counts = status_of(shard)
    assert "missing" not in counts
    assert counts["missing, of other shards"] == len(table(runs / "whole")) - len(table(shard))
    run_here(WIDE, shard, RunSettings(1), "the rest")
    pd.testing.assert_frame_equal(table(shard), table(runs / "whole"), check_exact=True)
    assert status_of(shard) == status_of(runs / "whole")


def test_what_is_missing_is_named_and_can_follow(runs: Path, tmp_path: Path) -> None:
    """A shard that is not given, one that was stopped; a later merge adds to the folder."""
    shards = _copy(runs, tmp_path)
    with sqlite3.connect(shards[1] / "results.sqlite") as database:
        database.execute("DELETE FROM trials WHERE id = (SELECT MIN(id) FROM trials)")
    own = len(table(shards[1]))
    first = merge_results(shards[:3], tmp_path / "out", "a merge")
    assert f"{shards[1]} lacks 1 of {own + 1} of shard 2/4; not given: shard 4/4" in str(first)
    assert status_of(tmp_path / "out")["missing"] == first.planned - first.done
    again = merge_results([shards[0], shards[3]], tmp_path / "out", "a merge")
    assert again.done == again.planned - 1
    run_here(WIDE, tmp_path / "out", RunSettings(1), "the rest")
    pd.testing.assert_frame_equal(table(tmp_path / "out"), table(runs / "whole"), check_exact=True)


def _changed(folder: Path, statement: str) -> None:
    with sqlite3.connect(folder / "results.sqlite") as database:
        database.execute(statement)


JSON = "UPDATE runs SET manifest = json_set(manifest, {})".format

REFUSED = {
    "study": (JSON("'$.study.name', 'other'"), "they are of the studies 'short' and 'other'"),
    "axis": (JSON("'$.study.references', json('[\"path\"]')"), "'short' differ in references"),
    "engine": (JSON("'$.engine', 'lockstep'"), "engine=alone and engine=lockstep"),
    "source": (
        JSON("'$.sources.\"formulation dls\"', 'x'"),
        "the sources differ of formulation dls",
    ),
    "plan": (JSON("'$.trials', 99"), "and 99 trials"),
    "version": (
        "UPDATE environments SET description = json_set(description, '$.libraries.numpy', '1.0')",
        "and 1.0; valid: one version",
    ),
    "solver": (
        "UPDATE environments SET description = json_set(description, '$.solvers.proxqp', '0.1')",
        "proxqp",
    ),
    "metric": (
        'INSERT INTO meta VALUES (\'metric mine\', \'{"selector": "m.py:M", "source": "x"}\')',
        "they differ in the metrics mine",
    ),
    "schema": ("UPDATE meta SET value = '77' WHERE key = 'schema'", "schema version '77'"),
    "empty": ("DELETE FROM runs", "it holds no run"),
}


@pytest.mark.parametrize("runs", ["alone"], indirect=True)
@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_belong_together_is_refused(runs: Path, tmp_path: Path, name: str) -> None:
    """In one line that says what differs; the output folder is not made."""
    shards = _copy(runs, tmp_path)
    statement, said = REFUSED[name]
    _changed(shards[2], statement)
    done = in_process("merge", *map(str, shards), "--out", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert said in done.stderr
    assert str(shards[2]) in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("runs", ["alone"], indirect=True)
def test_rows_that_contradict_each_other_are_named(runs: Path, tmp_path: Path) -> None:
    """Trial, column and both values; what was merged before is as it was."""
    shards, out = _copy(runs, tmp_path), tmp_path / "out"
    merge_results(shards, out, "a merge")
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    ran = load_results(shards[3]).trials.query("status == 'ok'")
    name, value = ran["id"].iloc[0], ran["position_error_rms_m"].iloc[0]
    _changed(shards[3], f"UPDATE trials SET position_error_rms_m = 7.5 WHERE id = '{name}'")
    for target, folders in ((out, shards), (tmp_path / "new", [*shards, runs / "whole"])):
        with pytest.raises(DikbenchError) as caught:
            merge_results(folders, target, "a merge")
        trial = Trial.of(**{key: ran[key].iloc[0] for key in Trial.of("a", "b").row})
        assert "contradict each other in 1 trial: " in str(caught.value)
        assert f"{trial}: position_error_rms_m" in str(caught.value)
        assert str(value) in str(caught.value)
        assert "7.5" in str(caught.value)
    assert before == {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert not ResultsFolder(tmp_path / "new").database.exists()


@pytest.mark.parametrize("runs", ["alone"], indirect=True)
def test_one_trial_of_two_sources_is_refused(runs: Path, tmp_path: Path) -> None:
    """The same cell with another id: also where nobody wrote down the sources."""
    shards = [_copy(runs, tmp_path)[0], tmp_path / "twin"]
    shutil.copytree(shards[0], shards[1])
    for each in shards:
        _changed(each, "UPDATE runs SET manifest = json_remove(manifest, '$.sources')")
    _changed(shards[1], "UPDATE trials SET id = 'x' || id")
    with pytest.raises(DikbenchError, match=r"ran .* with different sources"):
        merge_results(shards, tmp_path / "out", "a merge")


@pytest.mark.parametrize("runs", ["alone"], indirect=True)
def test_wrong_folders_are_refused(runs: Path, tmp_path: Path) -> None:
    """One line each."""
    one, two = str(runs / "shard1"), str(runs / "shard2")
    (tmp_path / "afile").touch()
    shutil.copytree(one, tmp_path / "other")
    _changed(tmp_path / "other", JSON("'$.study.name', 'other'"))
    (tmp_path / "committed").mkdir()
    shutil.copy(runs / "shard2" / "trials.csv", tmp_path / "committed")
    out = ("--out", str(tmp_path / "out"))
    for arguments, said in (
        ((one, *out), "two results folders or more"),
        ((one, two), "--out"),
        ((one, one, *out), "given twice"),
        ((one, f"{two}/../shard1", *out), "given twice"),
        ((one, str(tmp_path / "nowhere"), *out), "results.sqlite is missing"),
        ((one, str(tmp_path / "committed"), *out), "results.sqlite is missing"),
        ((one, two, "--out", two), "another folder"),
        ((one, two, "--out", str(tmp_path / "other")), "the studies 'other' and 'short'"),
        ((one, two, "--out", str(tmp_path / "afile" / "x")), "cannot be written"),
    ):
        done = in_process("merge", *arguments)
        assert done.exit_code == 2, done.output
        assert said in done.output
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["5/4", "0/4", "1/0", "a/4", "1", "", "1/4/2", "-1/4", "1/4 "])
def test_a_wrong_shard_is_one_line(text: str, tmp_path: Path) -> None:
    """Which ones there are, where that can be said."""
    with pytest.raises(DikbenchError, match="valid: ") as caught:
        parse_shard(text)
    assert "\n" not in str(caught.value)
    done = in_process("run", "--shard", text, "--out", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert not (tmp_path / "out").exists()


def _plan(scenarios: dict[str, int], formulations: int) -> list[PlannedTrial]:
    """A plan of so many seeds of each scenario with so many formulations."""
    trials = [
        Trial(parse_selector(f"law{k}"), parse_selector(name), parse_selector("none"),
              parse_selector("ideal"), "time", seed)
        for k in range(formulations)
        for name, seeds in scenarios.items()
        for seed in range(seeds)
    ]  # fmt: skip
    return [PlannedTrial(str(number), trial) for number, trial in enumerate(trials)]


plans = st.builds(
    _plan,
    st.dictionaries(
        st.sampled_from([f"{f}[robot={r}]" for f in "abc" for r in ("x", "y")]), st.integers(1, 40)
    ),
    st.integers(1, 12),
)


@settings(max_examples=60)
@given(plan=plans, of=st.integers(1, 9), engine=st.sampled_from(["alone", "lockstep"]))
def test_shards_are_a_division_of_the_plan(
    plan: list[PlannedTrial], of: int, engine: Engine
) -> None:
    """Each trial in one shard, in the plan's order; as many in each; blocks stay large."""
    shards = [trials_of_shard(plan, Shard(number, of), engine) for number in range(1, of + 1)]
    assert sorted(p.id for each in shards for p in each) == sorted(p.id for p in plan)
    for each in shards:
        assert [int(p.id) for p in each] == sorted(int(p.id) for p in each)
    sizes = [len(each) for each in shards]
    kinds = Counter(family_and_robot(p.trial.scenario) for p in plan)
    if engine == "alone":
        # Each kind is unequal by a scenario of at least WHOLE_SCENARIOS, or by one trial.
        assert max(sizes) - min(sizes) <= 1 + max(kinds.values(), default=0) / WHOLE_SCENARIOS
    else:
        for each in shards:
            for kind, number in Counter(family_and_robot(p.trial.scenario) for p in each).items():
                assert number >= min(kinds[kind], LEAST_ROWS * (1 - 1 / WHOLE_SCENARIOS))


def test_many_scenarios_stay_whole() -> None:
    """What one shard builds no other one builds."""
    plan = _plan({"a[robot=x]": 64, "b[robot=x]": 33}, 5)
    held = [
        {(p.trial.scenario, p.trial.seed) for p in trials_of_shard(plan, Shard(k, 4), "alone")}
        for k in range(1, 5)
    ]
    assert sum(map(len, held)) == len(set.union(*held)) == 97


def test_the_store_of_a_merge_is_as_it_should_be(runs: Path, tmp_path: Path) -> None:
    """Each row once, one run, whose description names the folders."""
    out = tmp_path / "merged"
    merge_results(sorted(runs.glob("shard*")), out, "a merge")
    with Store(out / "results.sqlite") as store:
        [run] = store.runs()
    assert [part["shards"] for part in run["merged"]] == [["1/4"], ["2/4"], ["3/4"], ["4/4"]]
    with sqlite3.connect(out / "results.sqlite") as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert database.execute("PRAGMA foreign_key_check").fetchall() == []
