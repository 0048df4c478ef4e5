"""Tracking error, limit violation, timing and solvers, recomputed with csv and math alone."""

from __future__ import annotations

import math
from collections import defaultdict
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd
import pytest
from makers import recomputed
from makers.made_up import SCENARIOS
from makers.recomputed import BROKEN, Row, contender, family, number
from makers.rows import bare_rows, make_rows

from dikbench.report.tables.build import make_table
from dikbench.report.tables.console import to_text
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.kinds import KINDS, LIMIT_VIOLATION, TIMING, TRACKING_ERROR, TableKind
from dikbench.report.tables.latex_table import to_latex
from dikbench.report.tables.markdown import to_markdown
from dikbench.report.tables.solver_axis import solver_axis
from dikbench.report.tables.table import Block, Table, TableCell

INF = math.inf
DEG = 180 / math.pi

QUANTITIES = {
    "off_the_path": ("contour_error_6d_max_m", 1e3, INF),
    "off_the_target": ("tracking_error_6d_max_m", 1e3, INF),
    "position_error": ("position_error_max_m", 1e3, INF),
    "position_error_rms": ("position_error_rms_m", 1e3, INF),
    "orientation_error": ("orientation_error_max_rad", DEG, INF),
    "orientation_error_rms": ("orientation_error_rms_rad", DEG, INF),
    "contour_error_of_the_position": ("contour_error_max_m", 1e3, INF),
    "direction_error": ("direction_error_max_rad", DEG, math.pi),
    "course": ("course_rad", DEG, math.pi / 2),
    "lag_s": ("lag_max_s", 1.0, INF),
    "slow_down": ("slow_down", 1.0, INF),
    "stuck": ("stuck_share", 100.0, 1.0),
    "speed_over_limit": ("velocity_peak_ratio", 1.0, INF),
    "position_outside": ("position_violation_max_rad", DEG, INF),
    "distance_missing": ("distance_violation_max_m", 1e3, INF),
    "torque_over_limit": ("torque_usage_max", 1.0, INF),
    "acceleration_above_limit_rad_s2": ("acceleration_violation_max_rad_s2", 1.0, INF),
    "speed_above_limit_rad_s": ("velocity_violation_max_rad_s", 1.0, INF),
    "steps_that_violate": ("violating_share", 100.0, 1.0),
    "steps_with_too_much_torque": ("torque_violating_share", 100.0, 1.0),
    "steps_that_chatter": ("chatter_share", 100.0, 1.0),
    "infeasible_steps": ("infeasible_share", 100.0, 1.0),
    "steps_without_an_answer": ("solver_failed_share", 100.0, 1.0),
    "steps_not_verified": ("not_verified_share", 100.0, 1.0),
    "from_the_optimum_rad_s": ("optimum_distance_max_rad_s", 1.0, INF),
    "median_call": ("formulation_time_median_us", 1e-3, INF),
    "p99_call": ("formulation_time_p99_us", 1e-3, INF),
    "longest_call": ("formulation_time_max_us", 1e-3, INF),
    "99.9_%_of_the_calls": ("formulation_time_p999_us", 1e-3, INF),
    "of_it_solver": ("solver_core_time_median_us", 1e-3, INF),
    "of_it_formulation": ("formulation_own_time_median_us", 1e-3, INF),
    "of_it_wrapper": ("solver_wrapper_time_median_us", 1e-3, INF),
    "kinematics_in_addition": ("kinematics_time_median_us", 1e-3, INF),
    "missed_at_1_kHz": ("missed_1000_hz_share", 100.0, 1.0),
    "missed_at_100_Hz": ("missed_100_hz_share", 100.0, 1.0),
    "missed_at_200_Hz": ("missed_200_hz_share", 100.0, 1.0),
    "missed_at_500_Hz": ("missed_500_hz_share", 100.0, 1.0),
}
"""Column of trials.csv, factor to the unit, and what a trial that broke off counts for."""

MORE_IS_BETTER = {
    "path_done": ("path_done_share", 100.0, 0.0),
    "progress": ("progress_mean", 100.0, -INF),
}
UNITS = ("_mm", "_deg", "_percent", "_ms")
KEYS = ("family", "plant", "reference", "formulation", "solver")


def _split(key: str) -> tuple[str, str]:
    """Take a heading of the CSV apart: the quantity, and the statistic."""
    for unit in UNITS:
        key = key.removesuffix(unit)
    quantity, _, statistic = key.rpartition("_")
    return quantity, statistic


def _expected(key: str, rows: list[Row], times: bool) -> float:
    """One number of a row of a table, from the trials of that row."""
    if times:
        rows = list({row["scenario"]: row for row in reversed(rows)}.values())[::-1]
    timed = [row for row in rows if row["formulation_time_median_us"] != ""]
    if key == "runs":
        return len(rows)
    if key == "stopped_percent":
        judged = [row["outcome"] in BROKEN for row in rows if row["outcome"]]
        return 100 * sum(judged) / len(judged) if judged else math.nan
    if key == "scenarios":
        return len(timed)
    if key == "unstable":
        return float(sum(row["timing_stability"] != "stable" for row in timed))
    quantity, statistic = _split(key)
    more = quantity in MORE_IS_BETTER
    column, factor, worst = {**QUANTITIES, **MORE_IS_BETTER}[quantity]
    failed = [row["status"] not in ("ok", "skipped") and not times for row in rows]
    values = [
        worst if broke else number(row[column]) for row, broke in zip(rows, failed, strict=True)
    ]
    ordered = sorted(recomputed.defined(values), reverse=more)
    if not ordered:
        return math.nan
    share = {"median": 0.5, "p95": 0.95, "worst": 1.0}[statistic]
    if more:  # the smallest value that at most so many are below, counted from the bad end
        ordered = ordered[::-1]
        place = max(math.ceil((1 - share) * len(ordered) - 1e-9), 1)
    else:
        place = max(math.ceil(share * len(ordered) - 1e-9), 1)
    return float(factor * ordered[place - 1])


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_the_numbers_are_those_of_the_trials(folder: Path, kind: TableKind) -> None:
    """All of them, of every family, plant and reference mode; in mm, deg, ms and percent."""
    times = kind is TIMING
    trials = recomputed.those_that_ran(recomputed.read(folder / "trials.csv"))
    table = recomputed.read(folder / "tables" / f"{kind.name}.csv")
    groups: dict[tuple[str, ...], list[Row]] = defaultdict(list)
    for row in trials:
        how = () if times else (row["plant"], row["reference"])
        for name in ("all", family(row)):
            groups[(name, *how, *contender(row))].append(row)
    keys = [key for key in KEYS if key in table[0]]
    assert {tuple(row[key] for key in keys) for row in table} == set(groups)
    assert len(table) == len(groups)
    checked = 0
    for row in table:
        members = groups[tuple(row[key] for key in keys)]
        for key in row:
            if key not in keys:
                expected = _expected(key, members, times)
                same = pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True)
                assert number(row[key]) == same, (key, row)
                checked += 1
    assert checked > 300


def test_units_stand_in_headings_and_in_the_keys_of_csv() -> None:
    """A column of lengths is in mm, of angles in deg, of shares in percent, of times in ms."""
    rows = make_rows({"a": {"formulation_time_median_us": 1.0, "timing_stability": "stable"}})
    for kind in KINDS:
        for column in make_table(kind, rows).columns:
            for unit, suffix in (("mm", "_mm"), ("deg", "_deg"), ("%", "_percent"), ("ms", "_ms")):
                assert (f"[{unit}]" in column.heading) == column.key.endswith(suffix), column


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_at_most_eight_columns_are_shown(kind: TableKind) -> None:
    """Besides that of the number of runs; the CSV has more."""
    table = make_table(kind, make_rows({"a": {}}))
    assert len(table.shown) <= 9
    assert len(table.columns) > len(table.shown)


def test_there_is_no_star_in_the_tables_of_all_runs(made_up_trials: pd.DataFrame) -> None:
    """They describe; who broke off is in them all the same."""
    for kind in KINDS:
        blocks = make_table(kind, made_up_trials).blocks
        assert not any(cell.best for block in blocks for row in block.rows for cell in row.cells)
        overall = [row.formulation for row in blocks[0].rows]
        assert {"crashy", "absent", "oracle"} <= {*overall}


def test_the_solver_axis_is_that_of_the_trials(folder: Path) -> None:
    """Runs, success where the path may wait, shares of all steps, the worst, times."""
    trials = recomputed.read(folder / "trials.csv")
    ran = [row for row in recomputed.those_that_ran(trials) if row["solver"] != "none"]
    table = recomputed.read(folder / "tables" / "solvers.csv")
    groups = recomputed.by_contender(ran)
    counted = recomputed.by_contender(recomputed.that_count(trials, "path"))
    assert {contender(row) for row in table} == set(groups)
    assert len(table) == len(groups) >= 2
    for row in table:
        own = groups[contender(row)]
        steps = [number(trial["steps"]) for trial in own]

        def share(column: str, own: list[Row] = own, steps: list[float] = steps) -> float:
            values = [number(trial[column] or "0") for trial in own]
            return 100 * sum(v * n for v, n in zip(values, steps, strict=True)) / sum(steps)

        def largest(column: str, own: list[Row] = own) -> float:
            return max(recomputed.defined(number(t[column]) for t in own), default=math.nan)

        def middle(column: str, own: list[Row] = own) -> float:
            first = {trial["scenario"]: trial for trial in reversed(own)}.values()
            values = recomputed.defined(number(trial[column]) for trial in first)
            return median(values) / 1e3 if values else math.nan

        judged = counted.get(contender(row), [])
        expected = {
            "runs": len(own),
            "judged": len(judged),
            "success_percent": 100 * recomputed.rate(judged) if judged else math.nan,
            "without_answer_percent": share("solver_failed_share"),
            "not_verified_percent": share("not_verified_share"),
            "residual_worst": largest("primal_residual_max_rad_s"),
            "optimum_worst": largest("optimum_distance_max_rad_s"),
            "median_ms": middle("formulation_time_median_us"),
            "p99_ms": middle("formulation_time_p99_us"),
        }
        for key, value in expected.items():
            assert number(row[key]) == pytest.approx(value, rel=1e-9, nan_ok=True), (key, row)


def _block(table: Table, family: str = "all", plant: str | None = "ideal") -> Block:
    return next(b for b in table.blocks if b.family == family and b.plant == plant)


def _column(table: Table, block: Block, key: str) -> dict[str, TableCell]:
    """The cells of a column by formulation and solver."""
    place = [column.key for column in table.columns].index(key)
    return {f"{row.formulation} {row.solver}": row.cells[place] for row in block.rows}


def test_a_run_that_broke_off_is_the_worst_there_is() -> None:
    """Infinite where a metric has no worst value, 180 degrees for a direction, 0 % done."""
    trials = bare_rows(
        formulation=["a", "a"],
        scenario=["reach", "step"],
        status=["ok", "diverged"],
        outcome=["success", "diverged"],
        contour_error_6d_max_m=[1e-3, 1e-6],
        direction_error_max_rad=[0.0, 0.0],
        path_done_share=[1.0, 1.0],
    )
    table = make_table(TRACKING_ERROR, trials)
    block = _block(table)
    assert _column(table, block, "off_the_path_median_mm")["a none"].value == 1.0
    assert _column(table, block, "off_the_path_worst_mm")["a none"].value == INF
    assert _column(table, block, "direction_error_worst_deg")["a none"].value == pytest.approx(180)
    assert _column(table, block, "path_done_worst_percent")["a none"].value == 0.0


def test_plants_and_reference_modes_are_not_pooled(made_up_trials: pd.DataFrame) -> None:
    """Every block is of one plant and one reference mode; times are of none."""
    for kind in (TRACKING_ERROR, LIMIT_VIOLATION):
        overall = make_table(kind, made_up_trials).overall
        expected = {(p, r) for p in ("ideal", "saturating") for r in ("time", "path")}
        assert {(b.plant, b.reference) for b in overall} == expected
        assert len(overall) == 4
    timing = make_table(TIMING, made_up_trials)
    assert {(b.plant, b.reference) for b in timing.blocks} == {(None, None)}


def test_times_that_cannot_be_trusted_are_marked(made_up_trials: pd.DataFrame) -> None:
    """Of who has unstable times in half of the timed scenarios, and of nobody else; no counts."""
    table = make_table(TIMING, made_up_trials)
    cells = _column(table, _block(table, plant=None), "median_call_median_ms")
    assert {name for name, cell in cells.items() if cell.unstable} == {"blind none"}
    counts = _column(table, _block(table, plant=None), "unstable")
    assert not counts["blind none"].unstable
    assert counts["blind none"].value == len(SCENARIOS)
    assert math.isnan(cells["crashy none"].value)


def test_columns_that_older_results_lack_are_left_out() -> None:
    """No crash, no empty column."""
    trials = bare_rows(formulation=["a", "b"], position_error_rms_m=[0.1, 0.2])
    keys = [column.key for column in make_table(TRACKING_ERROR, trials).columns]
    start = "position_error_rms"
    assert keys == ["runs", *(f"{start}_{what}_mm" for what in ("median", "p95", "worst"))]
    assert all(column.shown for column in make_table(TRACKING_ERROR, trials).columns)


@pytest.mark.parametrize("status", [[], ["skipped", "skipped"]])
def test_nothing_to_show_is_a_table_without_blocks(status: list[str]) -> None:
    """No trials, and none but skipped ones; every form of it says so or is empty."""
    number_of = len(status)
    trials = bare_rows(
        formulation=["a", "b"][:number_of], status=status, position_error_rms_m=[np.nan] * number_of
    )
    for kind in KINDS:
        table = make_table(kind, trials)
        assert table.blocks == ()
        assert len(to_csv(table).splitlines()) == 1


def test_without_a_timing_pass_the_table_says_so_and_how_to_make_it() -> None:
    """Trials that ran without times are no empty rows; the command is named, in every form."""
    table = make_table(TIMING, make_rows({"a": {}, "b": {}}))
    assert table.blocks == ()
    for text in (to_text(table), to_markdown(table), to_latex(table)):
        assert text.count("No timing pass was made: ") == 1
        assert "dikbench time" in text.replace("{-}", "-")
    assert "tabular" not in to_latex(table)


def test_solvers_without_success_or_times_have_empty_cells() -> None:
    """A formulation without a solver is no row; one that only crashed is one."""
    rows = make_rows({"a": {}, ("b", "s"): {"status": "crashed", "outcome": "did-not-run"}})
    rows.loc[rows["formulation"].eq("b"), ["steps", "primal_residual_max_rad_s"]] = [0, np.nan]
    [row] = solver_axis(rows).blocks[0].rows
    assert (row.formulation, row.solver) == ("b", "s")
    assert [cell.value for cell in row.cells][:2] == [1.0, 0.0]
    assert math.isnan(row.cells[2].value)
    table = solver_axis(rows)
    assert not any("call" in table.columns[place].heading for place in table.shown)
    assert any("No timing pass was made" in note for note in table.notes)
    assert solver_axis(make_rows({"a": {}})).blocks == ()
