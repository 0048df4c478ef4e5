"""A run from the plan to the report."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path

import pandas as pd
from makers.runs import UNEQUAL, without_figures, without_workers

from dikbench.metrics import METRICS
from dikbench.report.write import write_report
from dikbench.results.folder import ResultsFolder
from dikbench.run.in_workers import RunSettings, run_trials
from dikbench.run.runner import run_study
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import load_study


def test_every_planned_trial_has_its_row(results: Path) -> None:
    """The table has one row per trial of the plan, no more, and the columns of the issue."""
    trials = pd.read_csv(results / "trials.csv")
    keys = ["formulation", "solver", "scenario", "plant", "reference", "seed"]
    assert not trials.duplicated(keys).any()
    oracles = 2 * 2  # scenarios and seeds: one plant, one reference mode
    assert len(trials) == 9 * 2 * 2 * 2 * 2 + oracles
    assert {*keys, "status", *METRICS, "formulation_time_median_us", "formulation_time_p99_us"} <= {
        *trials.columns
    }


def test_cells_that_cannot_work_are_rows_that_say_why(results: Path) -> None:
    """An LP through proxqp, and a path-indexed run without a path, are skipped with a reason."""
    trials = pd.read_csv(results / "trials.csv")
    skipped = trials[trials["status"] == "skipped"]
    oracle = skipped["formulation"] == "oracle"
    assert skipped[oracle]["message"].str.contains("no joint motion").all()
    no_path = skipped[(skipped["solver"] != "proxqp") & ~oracle]
    assert no_path["scenario"].str.startswith("reach").all()
    assert (no_path["reference"] == "path").all()
    assert skipped["message"].str.len().gt(10).all()
    assert set(trials["status"]) == {"ok", "skipped"}


def test_times_are_of_the_law_and_not_of_a_trial(results: Path) -> None:
    """Times belong to law, solver and scenario; solving is part of the law's time."""
    trials = pd.read_csv(results / "trials.csv")
    formulation = trials["formulation"] != "oracle"
    ran = trials[formulation & (trials["status"] == "ok") & (trials["seed"] == 0)]
    per_cell = ran.groupby(["formulation", "solver", "scenario"])["formulation_time_median_us"]
    assert per_cell.nunique().eq(1).all()
    inside = ran["solver_core_time_median_us"] + ran["solver_wrapper_time_median_us"]
    assert (inside <= ran["formulation_time_median_us"] * 1.5).all()
    assert (inside[ran["solver"] == "none"] == 0).all()
    assert (inside[ran["solver"] != "none"] > 0).all()
    assert (ran["formulation_time_median_us"] <= ran["formulation_time_p99_us"]).all()
    assert (ran["formulation_time_p99_us"] <= ran["formulation_time_p999_us"]).all()
    assert (ran["formulation_time_p999_us"] <= ran["formulation_time_max_us"]).all()
    assert (ran["missed_100_hz_share"] <= ran["missed_1000_hz_share"]).all()
    assert ran["timing_stability"].notna().all()


def test_tables_figures_and_manifest_are_written(results: Path) -> None:
    """The files that the guide to a first run promises are there and hold something."""
    for name in ("success", "tracking_error", "limit_violation", "timing", "solvers"):
        assert len(pd.read_csv(results / "tables" / f"{name}.csv")) > 3
        assert (results / "tables" / f"{name}.md").read_text().startswith("# ")
        assert "\\toprule" in (results / "tables" / f"{name}.tex").read_text()
    figures = {path.name for path in (results / "figures").glob("*.svg")}
    assert {
        "error_and_speed_against_time.svg",
        "outcomes_clock.svg",
        "success_over_tolerance.svg",
        "time_per_formulation_and_solver.svg",
    } <= figures
    manifest = json.loads((results / "manifest.json").read_text())
    assert manifest["study"]["name"] == "smoke"
    assert {"daqp", "osqp", "clarabel"} <= set(manifest["solvers"])
    report = (results / "report.md").read_text()
    for name in figures:
        assert name in report
    assert "proxqp cannot take a linear program" in (results / "report.html").read_text()


def test_seeds_differ_and_a_path_indexed_run_waits(results: Path) -> None:
    """Another seed is another run, and a scaling law tracks better when the reference waits."""
    trials = pd.read_csv(results / "trials.csv")
    lp = trials[
        (trials["formulation"] == "lp-alpha")
        & (trials["solver"] == "daqp")
        & (trials["plant"] == "ideal")
        & trials["scenario"].str.startswith("near-miss")
    ].set_index(["reference", "seed"])
    progress = lp["progress_min"]
    assert progress["time", 0] != progress["time", 1]
    errors = lp["position_error_max_m"]
    assert errors["path", 0] < 0.2 * errors["time", 0]
    assert lp["slow_down"]["path", 0] > 1.2


def test_a_run_is_the_same_with_one_worker_and_with_two(tmp_path: Path) -> None:
    """Every column but the times is bit-equal whatever the number of workers.

    The one worker is this process.
    """
    selection = Selection(
        formulations=("oracle", "dls", "qp", "lp-alpha-cvxpy"),
        scenarios=("near-miss[miss=0.02,dt=0.05]",),
        plants=("ideal",),
    )
    planned = expand(select(load_study("smoke"), selection, named=True))
    tables = []
    folders = [ResultsFolder(tmp_path / str(jobs)) for jobs in (1, 2)]
    for jobs, folder in enumerate(folders, start=1):
        folder.traces.mkdir(parents=True)
        with without_workers() if jobs == 1 else nullcontext():
            found = run_trials(planned, folder, RunSettings(jobs))
            rows = {p.id: row for some in found for p, row in some}
        tables.append(pd.DataFrame([rows[p.id] for p in planned]).drop(columns=UNEQUAL))
    pd.testing.assert_frame_equal(tables[0], tables[1], check_exact=True)
    one, two = folders
    names = sorted(path.name for path in one.traces.iterdir())
    assert names == sorted(path.name for path in two.traces.iterdir())
    assert len(names) == sum(not p.skip for p in planned)
    for name in names:
        assert (one.traces / name).read_bytes() == (two.traces / name).read_bytes()


def test_a_report_of_nothing_but_skipped_cells_is_made(tmp_path: Path) -> None:
    """A run in which no cell could work still ends with tables and a report that says why."""
    selection = Selection(
        formulations=("lp-alpha",), solvers=("proxqp",), scenarios=("reach",), plants=("ideal",)
    )
    run_study(
        select(load_study("smoke"), selection, named=False),
        tmp_path / "out",
        RunSettings(1),
        "a test",
    )
    with without_figures():
        write_report(tmp_path / "out")
    assert "1 cell skipped" in (tmp_path / "out" / "report.md").read_text()
