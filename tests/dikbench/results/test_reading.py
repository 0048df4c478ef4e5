"""One reader of results: strict, and lenient as the report reads them."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest
from makers.rows import make_rows, write_results
from makers.runs import without_figures

import dikbench
from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.report.write import write_report
from dikbench.results.reading import read_results


@pytest.fixture
def undrawn() -> Iterator[None]:
    """A report has no figures meanwhile, and nothing is played."""
    with without_figures():
        yield


def test_committed_results_read_like_the_store(stored: Path, committed: Path) -> None:
    """Every value is bit-equal, and so are the types, the manifest and the attributes."""
    for lenient in (False, True):
        one, other = (read_results(path, lenient=lenient) for path in (stored, committed))
        pd.testing.assert_frame_equal(one.trials, other.trials, check_exact=True)
        assert one.manifest == other.manifest
        assert one.trials.attrs == other.trials.attrs
        assert one.notes == other.notes == ()


def test_every_column_has_a_unit_and_a_definition(committed: Path) -> None:
    """Units are those of the metric registry, and nothing is left without a definition."""
    trials = dikbench.load_results(committed).trials
    units, definitions = trials.attrs["units"], trials.attrs["definitions"]
    assert list(units) == list(definitions) == list(trials.columns)
    assert all(definitions.values())
    assert all(units[name] == metric.unit for name, metric in METRICS.items())
    assert units["formulation_time_median_us"] == "us"
    assert all(text.isascii() for text in units.values())


def test_results_read_the_same_from_parquet(committed: Path, tmp_path: Path) -> None:
    """Which takes a fifth of the room: the committed run of the full study has no CSV."""
    shutil.copytree(committed, tmp_path, dirs_exist_ok=True)
    (tmp_path / "trials.csv").unlink()
    pd.testing.assert_frame_equal(
        dikbench.load_results(tmp_path).trials,
        dikbench.load_results(committed).trials,
        check_dtype=False,
    )
    (tmp_path / "trials.parquet").write_bytes(b"PAR1")
    with pytest.raises(DikbenchError, match=r"trials\.parquet: not a table of trials"):
        dikbench.load_results(tmp_path)


def test_what_cannot_be_read_is_one_line(stored: Path, committed: Path, tmp_path: Path) -> None:
    """No traces, no results, another table, a manifest that is not JSON."""
    with pytest.raises(DikbenchError, match="no traces of these trials are stored"):
        dikbench.load_results(committed).steps()
    with pytest.raises(DikbenchError, match="no results in"):
        dikbench.load_results(tmp_path)
    shutil.copytree(committed, tmp_path, dirs_exist_ok=True)
    (tmp_path / "manifest.json").write_text("{")
    with pytest.raises(DikbenchError, match=r"manifest\.json cannot be read"):
        dikbench.load_results(tmp_path)
    (tmp_path / "trials.csv").write_text("formulation,scenario\ndls,reach\n")
    with pytest.raises(DikbenchError, match="it has no column 'solver'"):
        dikbench.load_results(tmp_path)
    (tmp_path / "trials.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DikbenchError, match=r"trials\.csv: not a table of trials"):
        dikbench.load_results(tmp_path)


def test_texts_stay_texts(committed: Path, tmp_path: Path) -> None:
    """A message or a law may be called what pandas takes for a missing value or for a number."""
    shutil.copytree(committed, tmp_path, dirs_exist_ok=True)
    table = pd.read_csv(tmp_path / "trials.csv", dtype=str, keep_default_na=False)
    table.loc[0, ["formulation", "message", "id"]] = ["null", "NA", "1e5"]
    table.to_csv(tmp_path / "trials.csv", index=False)
    row = dikbench.load_results(tmp_path).trials.iloc[0]
    assert (row["formulation"], row["message"], row["id"]) == ("null", "NA", "1e5")
    assert row["solver"] == "none"


def test_a_store_of_another_version_is_read_through_its_exports(
    stored: Path, tmp_path: Path
) -> None:
    """A store without one of today's metrics cannot be opened, its exports can be."""
    shutil.copytree(stored, tmp_path, dirs_exist_ok=True)
    with sqlite3.connect(tmp_path / "results.sqlite") as database:
        database.execute("ALTER TABLE trials DROP COLUMN sigma_min")
    database.close()
    whole = dikbench.load_results(stored).trials
    pd.testing.assert_frame_equal(dikbench.load_results(tmp_path).trials, whole)
    for name in ("trials.csv", "trials.parquet"):
        (tmp_path / name).unlink()
    with pytest.raises(DikbenchError, match="it lacks 'sigma_min'"):
        dikbench.load_results(tmp_path)


def test_the_documented_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    """The example runs as it stands, and its last line is the peak speed per law and distance."""
    monkeypatch.chdir(Path(__file__).parents[3])
    page = Path("docs/guides/python.md").read_text(encoding="utf-8")
    match = re.search(r"## In a notebook\n\n```python\n(.*?)```", page, re.DOTALL)
    assert match is not None
    *lines, last = match[1].splitlines()
    names: dict[str, object] = {}
    exec("\n".join(lines), names)
    table = eval(last, names)
    assert list(table.columns) == [0, 0.005, 0.02, 0.05, 0.2]
    assert table.loc["pinv", 0.005] > 10 > table.loc["qp", 0.005]


def test_loading_is_lazy() -> None:
    """The name is public, and pandas is not imported before it is used."""
    code = (
        "import sys, dikbench; assert 'load_results' in dikbench.__all__\n"
        "assert 'pandas' not in sys.modules\n"
        "dikbench.load_results\n"
        "assert 'pandas' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


@pytest.mark.usefixtures("undrawn")
def test_a_report_is_remade_from_the_committed_files(stored: Path, tmp_path: Path) -> None:
    """Without a store, and without traces, the page has the same sentences and tables."""
    whole, bare = tmp_path / "whole", tmp_path / "bare"
    shutil.copytree(stored, whole)
    bare.mkdir()
    for name in ("trials.csv", "manifest.json"):
        shutil.copy(stored / name, bare)
    summary = []
    for folder in (whole, bare):
        write_report(folder)
        summary.append((folder / "report.md").read_text().partition("## Figures")[0])
    assert summary[0] == summary[1]
    assert (bare / "report.html").stat().st_size > 10_000


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


def test_a_damaged_store_gives_way_to_the_exports(stored: Path, tmp_path: Path) -> None:
    """A store that was cut is named, and the rows come from trials.csv."""
    damaged = tmp_path / "damaged"
    shutil.copytree(stored, damaged)
    for rest in damaged.glob("results.sqlite-*"):
        rest.unlink()
    whole = (damaged / "results.sqlite").read_bytes()
    (damaged / "results.sqlite").write_bytes(whole[: len(whole) // 3])
    found = read_results(damaged, lenient=True)
    pd.testing.assert_frame_equal(found.trials, read_results(stored, lenient=True).trials)
    assert any("trials.csv" in note and "store" in note for note in found.notes)


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("cut", [1, 60])
def test_a_truncated_table_gives_the_rows_that_are_whole(tmp_path: Path, cut: int) -> None:
    """The row that was cut is left out and counted, and the trials that are missing are said."""
    folder = write_results(tmp_path / "out", make_rows({"a": {}, "b": {}, "c": {}}))
    text = (folder / "trials.csv").read_text()
    (folder / "trials.csv").write_text(text[:-cut])
    found = read_results(folder, lenient=True)
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
def test_a_manifest_that_cannot_be_read_is_said(tmp_path: Path, manifest: str | None) -> None:
    """The report is made of the rows, and says that the machine and the study are not known."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    (folder / "manifest.json").unlink()
    if manifest is not None:
        (folder / "manifest.json").write_text(manifest)
    found = read_results(folder, lenient=True)
    assert found.notes[0].startswith("The machine and the study are not known: manifest.json: ")
    assert found.manifest["study"]["name"] == "out"


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        ("cut", r"trials\.csv is damaged: 1 of 2 rows are left out\. `dikbench report` reads"),
        ("no manifest", r"manifest\.json cannot be read"),
        ("no selector", r"selector 'a\[b=' is not of the form"),
    ],
)
def test_a_damaged_folder_is_an_error_to_all_but_the_report(
    tmp_path: Path, harm: str, message: str
) -> None:
    """Nothing is compared or replayed in part: one line says what is wrong and who reads on."""
    rows = make_rows({"pinv": {}, "dls": {}})
    if harm == "no selector":
        rows.loc[0, "formulation"] = "a[b="
    folder = write_results(tmp_path / "out", rows)
    if harm == "cut":
        (folder / "trials.csv").write_text((folder / "trials.csv").read_text()[:-1])
    elif harm == "no manifest":
        (folder / "manifest.json").unlink()
    with pytest.raises(DikbenchError, match=message) as caught:
        read_results(folder)
    assert "\n" not in str(caught.value)
    assert len(read_results(folder, lenient=True).trials) == (2 if harm == "no manifest" else 1)


@pytest.mark.usefixtures("undrawn")
def test_a_report_without_a_manifest_is_made(tmp_path: Path) -> None:
    """It carries the tables, and what is not known among its limitations."""
    folder = write_results(tmp_path / "out", make_rows({"pinv": {}}))
    (folder / "manifest.json").unlink()
    assert "The machine and the study are not known" in write_report(folder)
    assert "The machine and the study are not known" in (folder / "report.html").read_text()


def test_rows_of_an_older_dikbench_are_read(tmp_path: Path) -> None:
    """Columns that are not there are named and stay empty; columns that are too many do no harm."""
    rows = make_rows({"pinv": {}}).drop(columns=["sigma_min", "timing_stability"])
    folder = write_results(tmp_path / "out", rows.assign(unheard_of=1))
    found = read_results(folder, lenient=True)
    assert set(METRICS) <= set(found.trials.columns)
    assert "sigma_min" in found.notes[0]
    write_report(folder)


def test_values_that_are_no_numbers_are_empty(tmp_path: Path) -> None:
    """A word in a column of numbers is no number, and does not stop the report."""
    rows = make_rows({"pinv": {}, "dls": {}}).astype({"position_error_rms_m": object})
    rows.loc[0, "position_error_rms_m"] = "<script>"
    folder = write_results(tmp_path / "out", rows)
    errors = read_results(folder, lenient=True).trials["position_error_rms_m"]
    assert errors.isna().tolist() == [True, False]
    write_report(folder)


def test_rows_that_nobody_could_have_run_are_left_out(tmp_path: Path) -> None:
    """A selector that is none, a seed that is no number; where nothing is left it is one line."""
    rows = make_rows({"a": {}, "pinv": {}, "dls": {}}).astype({"seed": object})
    rows.loc[0, "formulation"] = "a[b="
    rows.loc[2, "seed"] = "inf"
    found = read_results(write_results(tmp_path / "out", rows), lenient=True)
    assert list(found.trials["formulation"]) == ["pinv"]
    assert found.notes[0].startswith("2 rows without a seed, steps or a selector")
    with pytest.raises(DikbenchError, match="there is no row"):
        read_results(write_results(tmp_path / "none", rows.drop(index=1)), lenient=True)


def test_rows_of_several_versions_are_said(stored: Path, tmp_path: Path) -> None:
    """A store whose rows were made by two versions names both."""
    mixed = tmp_path / "mixed"
    shutil.copytree(stored, mixed)
    with sqlite3.connect(mixed / "results.sqlite") as database:
        other = json.dumps({"libraries": {"dikbench": "9.9"}})
        database.execute("INSERT INTO environments VALUES ('other', ?)", [other])
        database.execute("UPDATE trials SET environment = 'other' WHERE formulation = 'lp-alpha'")
    database.close()
    assert any("dikbench 9.9" in note for note in read_results(mixed, lenient=True).notes)
