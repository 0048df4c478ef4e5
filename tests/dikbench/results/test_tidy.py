"""Results as data frames: the same from a store and from its exports, with units."""

from __future__ import annotations

import re
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import dikbench
from dikbench.errors import DikbenchError
from dikbench.metrics import METRICS
from dikbench.results.folder import ResultsFolder
from dikbench.run.runner import RunSettings, run_study
from dikbench.simulation.trace import Trace
from dikbench.study.study import Cells, Study, TimingSettings

CHECKOUT = Path(__file__).parents[3]

STUDY = Study(
    description="two robots with 7 and 3 joints, a list of values, a pair that is skipped",
    cells=(Cells(("dls[damping=0.01]", "dls[damping=1e-1]")), Cells(("lp-alpha",), ("proxqp",))),
    scenarios=("reach[duration=0.2]", "reach[robot=planar3r,duration=0.2]"),
    plants=("ideal[noise=1e-4,delay=2]",),
    timing=TimingSettings("dls", problems=5, rounds=3),
    name="frames",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the study."""
    folder = tmp_path_factory.mktemp("frames")
    run_study(STUDY, folder, RunSettings(jobs=2), "a test")
    return folder


@pytest.fixture(scope="module")
def committed(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What of it is committed: no store, no traces."""
    committed = tmp_path_factory.mktemp("committed")
    for name in ("trials.csv", "trials.parquet", "timing.csv", "manifest.json"):
        shutil.copy(folder / name, committed)
    return committed


def test_committed_results_read_like_the_store(folder: Path, committed: Path) -> None:
    """Every value is bit-equal, and so are the types, the manifest and the attributes."""
    stored, read = dikbench.load_results(folder), dikbench.load_results(str(committed))
    pd.testing.assert_frame_equal(stored.trials, read.trials, check_exact=True)
    assert stored.manifest == read.manifest
    assert stored.trials.attrs == read.trials.attrs


def test_selectors_are_split_into_columns(committed: Path) -> None:
    """Names and parameters stand beside the selectors; numbers are numbers, the rest is missing."""
    trials = dikbench.load_results(committed).trials
    assert set(trials["formulation_name"]) == {"dls", "lp-alpha"}
    damping = trials.set_index("formulation")["formulation_damping"]
    assert set(damping.loc["dls[damping=1e-1]"]) == {0.1}
    assert damping.loc["lp-alpha"].isna().all()
    assert trials.query("scenario_robot == 'planar3r'")["scenario"].nunique() == 1
    assert set(trials["scenario_family"]) == {"reach"}
    assert set(trials["plant_delay"]) == {2}
    assert set(trials["solver_name"]) == {"none", "proxqp"}


def test_every_column_has_a_unit_and_a_definition(committed: Path) -> None:
    """Units are those of the metric registry, and nothing is left without a definition."""
    trials = dikbench.load_results(committed).trials
    units, definitions = trials.attrs["units"], trials.attrs["definitions"]
    assert list(units) == list(definitions) == list(trials.columns)
    assert all(definitions.values())
    assert all(units[name] == metric.unit for name, metric in METRICS.items())
    assert units["formulation_time_median_us"] == "us"
    assert all(text.isascii() for text in units.values())


def test_steps_are_those_of_the_traces(folder: Path) -> None:
    """A row per trial and step with the trace's numbers; a robot of 3 joints has no fourth."""
    results = dikbench.load_results(folder)
    steps = results.steps()
    ran = results.trials[results.trials["status"] == "ok"].set_index("id")
    assert dict(steps.groupby("id").size()) == dict(ran["steps"])
    for name, rows in steps.groupby("id"):
        trace = Trace.load(ResultsFolder(folder).trace(str(name)))
        np.testing.assert_array_equal(rows["time_s"], trace.dt * np.arange(trace.steps))
        joints = trace.applied.shape[1]
        applied = rows[[f"applied_{number}" for number in range(joints)]]
        np.testing.assert_array_equal(applied, trace.applied)
        assert rows.filter(like="applied_").shape[1] == 7
        assert rows.filter(like="applied_").iloc[:, joints:].isna().all(axis=None)
    assert list(steps.attrs["units"]) == list(steps.columns)
    assert all(steps.attrs["definitions"].values())


def test_steps_of_some_trials(folder: Path) -> None:
    """Rows of the trials, or ids, choose; none is none, and an unknown id is an error."""
    results = dikbench.load_results(folder)
    chosen = results.trials.query("scenario_robot == 'planar3r' and status == 'ok'")
    by_rows, by_ids = results.steps(chosen), results.steps(list(chosen["id"]))
    pd.testing.assert_frame_equal(by_rows, by_ids)
    assert set(by_rows["id"]) == set(chosen["id"])
    with pytest.raises(DikbenchError, match="no traces"):
        results.steps([])
    with pytest.raises(DikbenchError, match="has the id 'beef'"):
        results.steps(["beef"])


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


def test_what_cannot_be_read_is_one_line(folder: Path, committed: Path, tmp_path: Path) -> None:
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
    folder: Path, tmp_path: Path
) -> None:
    """A store without one of today's metrics cannot be opened, its exports can be."""
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    with sqlite3.connect(tmp_path / "results.sqlite") as database:
        database.execute("ALTER TABLE trials DROP COLUMN sigma_min")
    database.close()
    whole = dikbench.load_results(folder).trials
    pd.testing.assert_frame_equal(dikbench.load_results(tmp_path).trials, whole)
    for name in ("trials.csv", "trials.parquet"):
        (tmp_path / name).unlink()
    with pytest.raises(DikbenchError, match="it lacks 'sigma_min'"):
        dikbench.load_results(tmp_path)


def test_the_readme_s_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    """The example runs as it stands, and its last line is the peak speed per law and distance."""
    monkeypatch.chdir(CHECKOUT)
    readme = Path("README.md").read_text(encoding="utf-8")
    match = re.search(r"## In a notebook\n\n```python\n(.*?)```", readme, re.DOTALL)
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
