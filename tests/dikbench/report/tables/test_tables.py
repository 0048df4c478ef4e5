"""The three tables: every number recomputed from trials.csv by other means than the report's."""

from __future__ import annotations

import csv
import math
import random
from collections import defaultdict
from pathlib import Path
from statistics import fmean, median

import numpy as np
import pandas as pd
import pytest
from makers.rows import bare_rows

from dikbench.report.tables.build import make_table
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.files import write_table
from dikbench.report.tables.kinds import KINDS, LIMIT_VIOLATION, TIMING, TRACKING_ERROR
from dikbench.report.tables.table import Block, Table, TableCell
from dikbench.results.selected import with_selected

Rows = list[dict[str, str]]

INF = math.inf
WORST = defaultdict(
    lambda: INF,
    direction_error_max_rad=math.pi,
    stuck_share=1.0,
    violating_share=1.0,
    infeasible_share=1.0,
    solver_failed_share=1.0,
    not_verified_share=1.0,
    progress_mean=-INF,
    progress_min=-INF,
    path_done_share=0.0,
)
"""What a failed trial counts for: written out here, not read from the metrics."""

COUNTS = ("failed", "trials", "timed", "unstable")
KEYS = ("family", "plant", "reference", "formulation", "solver")


# --- the arithmetic, without any of the report's


def _read(path: Path) -> Rows:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def _number(text: str) -> float:
    return float(text) if text else math.nan


def _defined(values: list[float]) -> list[float]:
    return [value for value in values if not math.isnan(value)]


def _failed(row: dict[str, str]) -> bool:
    return row["status"] not in ("ok", "skipped")


def _value(row: dict[str, str], column: str, times: bool) -> float:
    return WORST[column] if _failed(row) and not times else _number(row[column])


def _shift(rows: Rows, column: str, times: bool) -> float:
    finite = [x for x in _defined([_value(r, column, times) for r in rows]) if x != INF]
    middle = median(finite) if finite else 0.0
    if middle == 0.0:
        positive = [x for x in finite if x > 0]
        middle = median(positive) if positive else 1.0
    digits = -math.floor(math.log10(middle))
    return round(middle, digits)


def _expected(key: str, rows: Rows, shift: float, times: bool) -> float:
    """One number of a row of a table, from the trials of that row."""
    if key == "trials":
        return len(rows)
    if key == "failed":
        return sum(map(_failed, rows))
    if key == "failure_rate":
        return sum(map(_failed, rows)) / len(rows)
    if times:
        rows = list({row["scenario"]: row for row in reversed(rows)}.values())
    if key == "timed":
        return sum(row["formulation_time_median_us"] != "" for row in rows)
    if key == "unstable":
        timed = [row for row in rows if row["formulation_time_median_us"]]
        return sum(row["timing_stability"] != "stable" for row in timed)
    column = key.removesuffix("_worst")
    values = _defined([_value(row, column, times) for row in rows])
    if key.endswith("_worst"):
        worst = min if column.startswith(("progress", "path_done")) else max
        return worst(values) if values else math.nan
    values = [value for value in values if abs(value) != INF]
    if not values:
        return math.nan
    if math.isnan(shift):
        return fmean(values)
    return math.exp(fmean([math.log(value + shift) for value in values])) - shift


def _check_numbers(trials: Rows, table: Rows, times: bool) -> int:
    """Compare every number of a table that is no bound of an interval; how many there were."""
    trials = [row for row in trials if row["status"] != "skipped"]
    groups: dict[tuple[str, ...], Rows] = defaultdict(list)
    for row in trials:
        how = () if times else (row["plant"], row["reference"])
        for family in ("all", row["scenario"].split("[")[0]):
            groups[(family, *how, row["formulation"], row["solver"])].append(row)
    keys = [key for key in KEYS if key in table[0]]
    assert {tuple(row[key] for key in keys) for row in table} == set(groups)
    assert len(table) == len(groups)
    checked = 0
    shifts: dict[str, float] = {}
    for row in table:
        members = groups[tuple(row[key] for key in keys)]
        for key in row:
            if key in keys or key.endswith(("_lower", "_upper", "_shift")):
                continue
            shift = math.nan
            if f"{key}_shift" in row:
                if key not in shifts:
                    shifts[key] = _shift(trials, key, times)
                shift = _number(row[f"{key}_shift"])
                assert shift == pytest.approx(shifts[key], rel=1e-12), key
            expected = _expected(key, members, shift, times)
            got = _number(row[key])
            assert got == pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True), (key, row)
            checked += 1
    return checked


def _naive_interval(values: dict[str, dict[str, list[float]]], mean: object) -> list[float]:
    """A bootstrap interval by drawing families, scenarios and seeds one after the other."""
    draw = random.Random(5)
    means = []
    for _ in range(2000):
        drawn: list[float] = []
        for family in draw.choices(list(values), k=len(values)):
            for scenario in draw.choices(list(values[family]), k=len(values[family])):
                seeds = values[family][scenario]
                drawn += draw.choices(seeds, k=len(seeds))
        drawn = _defined(drawn)
        if drawn:
            means.append(mean(drawn))  # type: ignore[operator]
    return [float(bound) for bound in np.quantile(means, (0.025, 0.975))]


# --- made-up trials


def _synthetic(path: Path) -> Path:
    """Trials of five laws with failures, skips, undefined metrics and zeros, as a CSV file."""
    numbers = np.random.default_rng(11)
    contenders = [
        ("pinv", "none"),
        ("qp", "daqp"),
        ("qp", "osqp"),
        ("lost", "none"),
        ("oracle", "none"),
    ]
    scenarios = [f"{f}[miss={m}]" for f in ("near-miss", "reach", "step") for m in (1, 2, 3)]
    rows = []
    for contender, (formulation, solver) in enumerate(contenders):
        for scenario in scenarios:
            time = 10.0 * (contender + 1) * numbers.lognormal(0.0, 0.2)
            timed = formulation not in ("lost", "oracle")
            verdict = "drift: 40 %" if solver == "osqp" and scenario < "reach" else "stable"
            for plant in ("ideal", "saturating"):
                for seed in (0, 1):
                    status = "ok"
                    if formulation == "lost":
                        status = "crashed"
                    elif formulation == "qp" and scenario.startswith("step") and seed:
                        status = "diverged" if solver == "osqp" else "skipped"
                    error = (contender + 1) * 1e-3 * numbers.lognormal(0.0, 1.0)
                    no_path = scenario.startswith("step")
                    rows.append(
                        {
                            "formulation": formulation,
                            "solver": solver,
                            "scenario": scenario,
                            "plant": plant,
                            "reference": "time",
                            "seed": seed,
                            "status": status,
                            "steps": 100,
                            "contour_error_rms_m": np.nan if no_path else error / 2,
                            "contour_error_max_m": np.nan if no_path else error,
                            "lag_max_s": np.nan if no_path else 0.1 * contender,
                            "position_error_rms_m": error,
                            "position_error_max_m": 2 * error,
                            "orientation_error_rms_rad": 0.0 if contender == 0 else error,
                            "direction_error_max_rad": min(100 * error, 3.0),
                            "progress_mean": 1 - 10 * error,
                            "progress_min": 1 - 90 * error,
                            "stuck_share": 0.0 if seed else error,
                            "velocity_peak_ratio": 0.5 + error,
                            "violating_share": error if contender else 0.0,
                            "position_violation_max_rad": error if seed else 0.0,
                            "formulation_time_median_us": time if timed else np.nan,
                            "formulation_own_time_median_us": time if timed else np.nan,
                            "solver_core_time_median_us": time / 3 if solver != "none" else 0.0,
                            "formulation_time_p99_us": 2 * time if timed else np.nan,
                            "formulation_time_max_us": 3 * time if timed else np.nan,
                            "timing_stability": verdict if timed else None,
                        }
                    )
    with_selected(pd.DataFrame(rows)).to_csv(path, index=False)
    return path


@pytest.fixture(scope="module")
def synthetic(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with made-up trials.csv and the tables made from it."""
    folder = tmp_path_factory.mktemp("synthetic")
    trials = pd.read_csv(_synthetic(folder / "trials.csv"))
    for kind in KINDS:
        write_table(make_table(kind, trials), folder / "tables")
    return folder


# --- the tests


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_the_numbers_of_a_run_are_those_of_its_trials(results: Path, kind: object) -> None:
    """All of them, of a real run, with csv and math alone."""
    name = kind.name  # type: ignore[attr-defined]
    trials, table = _read(results / "trials.csv"), _read(results / "tables" / f"{name}.csv")
    assert _check_numbers(trials, table, times=kind is TIMING) > 200


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_the_numbers_of_made_up_trials_are_right(synthetic: Path, kind: object) -> None:
    """Those with failures, skips, undefined metrics and a law that never came through too."""
    name = kind.name  # type: ignore[attr-defined]
    trials, table = _read(synthetic / "trials.csv"), _read(synthetic / "tables" / f"{name}.csv")
    assert _check_numbers(trials, table, times=kind is TIMING) > 100


@pytest.mark.parametrize("key", ["position_error_rms_m", "progress_mean", "failure_rate"])
def test_intervals_are_those_of_drawing_step_by_step(synthetic: Path, key: str) -> None:
    """Families, then scenarios, then seeds, drawn here one after the other."""
    trials = _read(synthetic / "trials.csv")
    checked = 0
    for row in _read(synthetic / "tables" / "tracking_error.csv"):
        if (
            row["plant"] != "ideal"
            or row["family"] not in ("all", "step")
            or not row[f"{key}_lower"]
        ):
            continue
        tree: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
        for trial in trials:
            family = trial["scenario"].split("[")[0]
            same = all(trial[name] == row[name] for name in KEYS[1:])
            if not same or trial["status"] == "skipped" or row["family"] not in ("all", family):
                continue
            value = float(_failed(trial)) if key == "failure_rate" else _value(trial, key, False)
            tree[family][trial["scenario"]].append(math.nan if abs(value) == INF else value)
        shift = _number(row.get(f"{key}_shift", ""))

        def mean(drawn: list[float], shift: float = shift) -> float:
            if math.isnan(shift):
                return fmean(drawn)
            return math.exp(fmean([math.log(x + shift) for x in drawn])) - shift

        low, high = _naive_interval(tree, mean)
        got = [_number(row[f"{key}_{bound}"]) for bound in ("lower", "upper")]
        np.testing.assert_allclose(got, [low, high], atol=0.12 * (high - low), rtol=0)
        assert got[0] <= _number(row[key]) <= got[1]
        checked += 1
    assert checked >= (1 if key == "failure_rate" else 6)


def _block(table: Table, family: str = "all", plant: str | None = "ideal") -> Block:
    return next(b for b in table.blocks if b.family == family and b.plant == plant)


def _column(table: Table, block: Block, key: str) -> dict[str, TableCell]:
    """The cells of a column by formulation and solver."""
    place = [column.key for column in table.columns].index(key)
    return {f"{row.formulation} {row.solver}": row.cells[place] for row in block.rows}


def _best(table: Table, key: str, family: str = "all", plant: str | None = "ideal") -> set[str]:
    cells = _column(table, _block(table, family, plant), key)
    return {contender for contender, cell in cells.items() if cell.best}


def test_a_law_that_fails_wins_no_average_over_the_trials_it_survived() -> None:
    """It is not compared where its failures are left out; in the worst it is infinite."""
    trials = bare_rows(
        formulation=["a", "a", "b", "b", "c", "c"],
        scenario=["reach", "step"] * 3,
        status=["ok", "diverged", "ok", "ok", "ok", "ok"],
        position_error_rms_m=[1e-6, 1e-6, 0.1, 0.1, 0.3, 0.3],
        position_error_max_m=[1e-6, 1e-6, 0.1, 0.2, 0.3, 0.4],
        direction_error_max_rad=[0.0, 0.0, 2.0, 2.0, 2.5, 2.5],
    )
    table = make_table(TRACKING_ERROR, trials)
    assert _best(table, "position_error_rms_m") == {"b none"}
    assert _best(table, "position_error_max_m_worst") == {"b none"}
    assert _best(table, "failure_rate") == {"b none", "c none"}
    block = _block(table)
    assert _column(table, block, "position_error_max_m_worst")["a none"].value == INF
    # An angle has a finite worst, which carries the failure: a is compared, and wins.
    angles = _column(table, block, "direction_error_max_rad_worst")
    assert angles["a none"].value == math.pi
    assert _best(table, "direction_error_max_rad_worst") == {"b none"}
    assert _best(table, "direction_error_max_rad") == {"a none"}
    assert _best(table, "position_error_rms_m", family="reach") == {"a none"}


def test_a_failure_where_nothing_is_measured_does_not_disqualify_the_others() -> None:
    """A law that fails a scenario without a path leaves the laws beside it to be compared."""
    trials = bare_rows(
        formulation=["a", "a", "b", "b", "c", "c"],
        scenario=["reach", "step"] * 3,
        status=["ok", "crashed", "ok", "ok", "ok", "ok"],
        contour_error_max_m=[0.1, np.nan, 0.2, np.nan, 0.3, np.nan],
        direction_error_max_rad=[0.1, np.nan, 0.2, np.nan, 0.3, np.nan],
    )
    table = make_table(TRACKING_ERROR, trials)
    for key in (
        "contour_error_max_m_worst",
        "direction_error_max_rad",
        "direction_error_max_rad_worst",
    ):
        assert _best(table, key) == {"b none"}, key


def test_a_law_that_was_skipped_somewhere_is_not_compared_overall() -> None:
    """An average over the easier scenarios is no win either; nor is the oracle's."""
    trials = bare_rows(
        formulation=["a", "a", "b", "b", "oracle", "oracle"],
        scenario=["reach", "step"] * 3,
        status=["ok", "skipped", "ok", "ok", "ok", "ok"],
        position_error_rms_m=[0.01, np.nan, 0.1, 0.2, 0.0, 0.0],
    )
    table = make_table(TRACKING_ERROR, trials)
    assert _best(table, "position_error_rms_m") == set()  # b is alone
    assert _best(table, "position_error_rms_m", family="reach") == {"a none"}


@pytest.mark.parametrize(
    ("errors", "best"),
    [
        ([0.1, 0.1, 0.1], set()),
        ([0.1000, 0.10001, 0.2], {"a none", "b none"}),  # equal in three digits
        ([1e-12, 0.0, 5e-8], set()),  # all as good as nothing
        ([0.101, 0.1, 0.102], {"b none"}),
        ([np.nan, 0.1, 0.2], {"b none"}),
    ],
)
def test_the_best_are_those_that_nobody_beats_to_what_is_shown(
    errors: list[float], best: set[str]
) -> None:
    """Ties are marked together, and nobody where all are equally good."""
    trials = bare_rows(formulation=["a", "b", "c"], position_error_max_m=errors)
    assert _best(make_table(TRACKING_ERROR, trials), "position_error_max_m_worst") == best


def test_more_progress_is_better() -> None:
    """The direction is the metric's; the worst progress is the smallest."""
    trials = bare_rows(
        formulation=["a", "a", "b", "b"], scenario=["reach", "step"] * 2,
        progress_mean=[1.0, 0.5, 0.7, 0.7], progress_min=[1.0, -0.5, 0.7, 0.6],
    )  # fmt: skip
    table = make_table(TRACKING_ERROR, trials)
    assert _best(table, "progress_mean") == {"a none"}
    assert _best(table, "progress_min_worst") == {"b none"}
    assert _column(table, _block(table), "progress_min_worst")["a none"].value == -0.5


def test_plants_and_reference_modes_are_not_pooled(synthetic: Path) -> None:
    """Every block is of one plant and one reference mode; times are of none."""
    trials = pd.read_csv(synthetic / "trials.csv")
    for kind in (TRACKING_ERROR, LIMIT_VIOLATION):
        blocks = make_table(kind, trials).blocks
        families = ("all", "near-miss", "reach", "step")
        expected = [(f, p, "time") for f in families for p in ("ideal", "saturating")]
        assert [(b.family, b.plant, b.reference) for b in blocks] == expected
    assert {(b.plant, b.reference) for b in make_table(TIMING, trials).blocks} == {(None, None)}


def test_times_that_cannot_be_trusted_are_marked(synthetic: Path) -> None:
    """A law of which half of the timed cells are unstable, there, and no other; nor its counts."""
    table = make_table(TIMING, pd.read_csv(synthetic / "trials.csv"))
    for family, unstable in (("all", False), ("near-miss", True), ("step", False)):
        cells = _column(table, _block(table, family, None), "formulation_time_median_us")
        assert cells["qp osqp"].unstable is unstable
        assert not cells["qp daqp"].unstable
        assert not cells["lost none"].unstable
    counts = _column(table, _block(table, "near-miss", None), "failed")
    assert not counts["qp osqp"].unstable


def test_a_law_that_crashed_everywhere_stands_in_the_timing_table(synthetic: Path) -> None:
    """With its failures, and without times."""
    table = make_table(TIMING, pd.read_csv(synthetic / "trials.csv"))
    block = _block(table, plant=None)
    assert _column(table, block, "failure_rate")["lost none"].value == 1.0
    assert math.isnan(_column(table, block, "formulation_time_median_us")["lost none"].value)


def test_columns_that_older_results_lack_are_left_out() -> None:
    """No crash, no empty column."""
    trials = bare_rows(formulation=["a", "b"], position_error_rms_m=[0.1, 0.2])
    keys = [column.key for column in make_table(TRACKING_ERROR, trials).columns]
    assert keys == ["failure_rate", "failed", "trials", "position_error_rms_m"]


@pytest.mark.parametrize("status", [[], ["skipped", "skipped"]])
def test_nothing_to_show_is_a_table_without_blocks(status: list[str]) -> None:
    """No trials, and none but skipped ones; every form of it says so or is empty."""
    number = len(status)
    trials = bare_rows(
        formulation=["a", "b"][:number], status=status, position_error_rms_m=[np.nan] * number
    )
    for kind in KINDS:
        table = make_table(kind, trials)
        assert table.blocks == ()
        assert len(to_csv(table).splitlines()) == 1


def test_one_trial_and_a_law_of_nothing_but_failures() -> None:
    """A single trial has its value and no interval, a failed one its failure and no average."""
    trials = bare_rows(
        formulation=["a", "b"], status=["ok", "timeout"], position_error_rms_m=[0.1, np.nan]
    )
    table = make_table(TRACKING_ERROR, trials)
    cells = _column(table, _block(table), "position_error_rms_m")
    assert cells["a none"].value == pytest.approx(0.1)
    assert not cells["a none"].has_interval
    assert math.isnan(cells["b none"].value)
    assert _column(table, _block(table), "failure_rate")["b none"].value == 1.0
