from __future__ import annotations

import json
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.report.write import write_report
from dikbench.results.reading import read_results
from dikbench.run.runner import RunSettings, run_study
from dikbench.study.study import Selection, load_study, select

MakeRows = Callable[..., pd.DataFrame]
WriteResults = Callable[..., Path]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run of two formulations, with its store."""
    out = tmp_path_factory.mktemp("run") / "out"
    selection = Selection(
        formulations=("pinv", "qp"), scenarios=("reach[duration=0.2]",), plants=("ideal",)
    )
    study = select(load_study("smoke"), selection, named=False)
    run_study(study, out, RunSettings(jobs=1), "a test")
    return out


def test_the_store_and_the_committed_files_give_the_same_rows(run: Path, tmp_path: Path) -> None:
    """A folder without its store reads as the folder with it."""
    committed = tmp_path / "committed"
    committed.mkdir()
    for name in ("trials.csv", "timing.csv", "manifest.json"):
        shutil.copy(run / name, committed)
    one, other = read_results(run), read_results(committed)
    pd.testing.assert_frame_equal(one.trials, other.trials)
    assert one.manifest == other.manifest
    assert one.notes == other.notes == ()


def test_a_report_is_remade_from_the_committed_files(run: Path, tmp_path: Path) -> None:
    """Without a store, and without traces, the page has the same sentences and tables."""
    committed = tmp_path / "committed"
    committed.mkdir()
    for name in ("trials.csv", "manifest.json"):
        shutil.copy(run / name, committed)
    write_report(run)
    write_report(committed)
    summary = [
        (folder / "report.md").read_text().partition("## Figures")[0] for folder in (run, committed)
    ]
    assert summary[0] == summary[1]
    assert (committed / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize("there", ["nothing", "an empty store", "a text in place of the store"])
def test_a_folder_without_results_is_one_line(tmp_path: Path, there: str) -> None:
    """It says where it looked and for what."""
    if there != "nothing":
        (tmp_path / "results.sqlite").write_text("" if "empty" in there else "no database" * 99)
    with pytest.raises(DikbenchError, match=r"results|store") as caught:
        write_report(tmp_path)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "report.html").exists()


def test_a_folder_that_is_not_there_is_one_line_and_not_made(tmp_path: Path) -> None:
    """Asking for a report makes no folder."""
    with pytest.raises(DikbenchError, match="no results in"):
        write_report(tmp_path / "missing")
    assert not (tmp_path / "missing").exists()


def test_a_damaged_store_gives_way_to_the_exports(run: Path, tmp_path: Path) -> None:
    """A store that was cut is named, and the rows come from trials.csv."""
    damaged = tmp_path / "damaged"
    shutil.copytree(run, damaged)
    for rest in damaged.glob("results.sqlite-*"):
        rest.unlink()
    whole = (damaged / "results.sqlite").read_bytes()
    (damaged / "results.sqlite").write_bytes(whole[: len(whole) // 3])
    found = read_results(damaged)
    pd.testing.assert_frame_equal(found.trials, read_results(run).trials)
    assert any("trials.csv" in note and "store" in note for note in found.notes)


@pytest.mark.parametrize("cut", [1, 60])
def test_a_truncated_table_gives_the_rows_that_are_whole(
    tmp_path: Path, make_rows: MakeRows, write_results: WriteResults, cut: int
) -> None:
    """The row that was cut is left out and counted, and the trials that are missing are said."""
    folder = write_results(tmp_path / "out", make_rows({"a": {}, "b": {}, "c": {}}))
    text = (folder / "trials.csv").read_text()
    (folder / "trials.csv").write_text(text[:-cut])
    found = read_results(folder)
    assert list(found.trials["formulation"]) == ["a", "b"]
    assert found.notes == ("trials.csv is damaged: 1 of 3 rows are left out.",)
    printed = write_report(folder)
    assert "1 of 3 trials are missing" in printed
    assert "1 missing" in printed


@pytest.mark.parametrize("content", ["", "a,b\n1,2\n", "\x00\x01", "id,formulation\n"])
def test_what_is_no_table_is_one_line(tmp_path: Path, content: str) -> None:
    """Garbage in place of trials.csv is named with the column that it lacks."""
    (tmp_path / "trials.csv").write_text(content)
    with pytest.raises(DikbenchError, match=r"trials\.csv: not a table of trials"):
        write_report(tmp_path)


def test_binary_in_place_of_the_table_is_one_line(tmp_path: Path) -> None:
    """Bytes that are no text are no table."""
    (tmp_path / "trials.csv").write_bytes(bytes(range(256)))
    with pytest.raises(DikbenchError, match=r"trials\.csv: not a table of trials"):
        write_report(tmp_path)


@pytest.mark.parametrize(
    "manifest", [None, "", "{", "[]", '{"study": 1}', '{"study": {}, "trials": []}', "\x00"]
)
def test_a_manifest_that_cannot_be_read_is_said(
    tmp_path: Path, make_rows: MakeRows, write_results: WriteResults, manifest: str | None
) -> None:
    """The report is made of the rows, and says that the machine and the study are not known."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    (folder / "manifest.json").unlink()
    if manifest is not None:
        (folder / "manifest.json").write_text(manifest)
    found = read_results(folder)
    assert found.notes[0].startswith("The machine and the study are not known: manifest.json: ")
    assert found.manifest["study"]["name"] == "out"


def test_a_report_without_a_manifest_is_made(
    tmp_path: Path, make_rows: MakeRows, write_results: WriteResults
) -> None:
    """It carries the tables, and what is not known among its limitations."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    (folder / "manifest.json").unlink()
    assert "The machine and the study are not known" in write_report(folder)
    assert "The machine and the study are not known" in (folder / "report.html").read_text()


def test_rows_of_an_older_dikbench_are_read(
    tmp_path: Path, make_rows: MakeRows, write_results: WriteResults
) -> None:
    """Columns that are not there are named and stay empty; columns that are too many do no harm."""
    rows = make_rows({"pinv": {}}).drop(columns=["sigma_min", "timing_stability"])
    folder = write_results(tmp_path / "out", rows.assign(unheard_of=1))
    found = read_results(folder)
    assert set(METRICS) <= set(found.trials.columns)
    assert "sigma_min" in found.notes[0]
    write_report(folder)


def test_values_that_are_no_numbers_are_empty(
    tmp_path: Path, make_rows: MakeRows, write_results: WriteResults
) -> None:
    """A word in a column of numbers is no number, and does not stop the report."""
    rows = make_rows({"pinv": {}, "dls": {}}).astype({"position_error_rms_m": object})
    rows.loc[0, "position_error_rms_m"] = "<script>"
    folder = write_results(tmp_path / "out", rows)
    assert read_results(folder).trials["position_error_rms_m"].isna().tolist() == [True, False]
    write_report(folder)


def test_rows_that_nobody_could_have_run_are_left_out(
    tmp_path: Path, make_rows: MakeRows, write_results: WriteResults
) -> None:
    """A selector that is none, a seed that is no number; where nothing is left it is one line."""
    rows = make_rows({"a[b=": {}, "pinv": {}, "dls": {}}).astype({"seed": object})
    rows.loc[2, "seed"] = "inf"
    found = read_results(write_results(tmp_path / "out", rows))
    assert list(found.trials["formulation"]) == ["pinv"]
    assert found.notes[0].startswith("2 rows without a seed, steps or a selector")
    with pytest.raises(DikbenchError, match="there is no row"):
        read_results(write_results(tmp_path / "none", rows.drop(index=1)))


def test_rows_of_several_versions_are_said(run: Path, tmp_path: Path) -> None:
    """A store whose rows were made by two versions names both."""
    mixed = tmp_path / "mixed"
    shutil.copytree(run, mixed)
    with sqlite3.connect(mixed / "results.sqlite") as database:
        other = json.dumps({"libraries": {"dikbench": "9.9"}})
        database.execute("INSERT INTO environments VALUES ('other', ?)", [other])
        database.execute("UPDATE trials SET environment = 'other' WHERE formulation = 'pinv'")
    database.close()
    assert any("dikbench 9.9" in note for note in read_results(mixed).notes)
