"""The table of success: every number recomputed from trials.csv, with csv and math alone."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from statistics import median

import pandas as pd
import pytest
from makers import recomputed
from makers.recomputed import Row, contender, number
from makers.rows import make_rows

from dikbench.report.tables.console import to_text
from dikbench.report.tables.success import success_table

SITUATIONS = {
    "near_singularities_percent": "near singularities",
    "at_joint_limits_percent": "at joint limits",
    "beyond_joint_speed_percent": "beyond joint speed",
    "free_space_percent": "free space",
    "steps_percent": "steps",
    "start_outside_percent": "start outside",
    "obstacles_or_torques_percent": "obstacles or torques",
}
UNSEEN = "does not see them"


def _parts(rows: list[Row], key: str) -> list[Row]:
    """The trials of a column of the table."""
    if key == "all_percent":
        return rows
    if key == "kinematic_percent":
        return [row for row in rows if row["situation"] != "obstacles or torques"]
    return [row for row in rows if row["situation"] == SITUATIONS[key]]


def _columns(row: Row) -> list[str]:
    return [key for key in row if key.endswith("_percent")]


def test_rates_are_means_over_families_robots_scenarios_and_seeds(folder: Path) -> None:
    """Every rate, every count, every `does not see them`; nothing is missing, nothing is more."""
    trials = recomputed.read(folder / "trials.csv")
    table = recomputed.read(folder / "tables" / "success.csv")
    checked = 0
    for setting in ("path", "time"):
        rows = recomputed.that_count(trials, setting)
        groups = recomputed.by_contender(rows)
        block = [row for row in table if row["reference"] == setting]
        assert {contender(row) for row in block} == set(groups)
        assert len(block) == len(groups)
        present = {row["situation"] for row in rows}
        for row in block:
            own = groups[contender(row)]
            assert number(row["trials"]) == len(own)
            for key in _columns(row):
                part = _parts(own, key)
                told = all(number(trial["sees_constraints"]) != 0 for trial in part)
                if key == "obstacles_or_torques_percent" and part and not told:
                    assert row[key] == UNSEEN
                    continue
                expected = 100 * recomputed.rate(part) if part else math.nan
                assert number(row[key]) == pytest.approx(expected, nan_ok=True), (key, row)
                checked += 1
        assert present <= {SITUATIONS[key] for key in SITUATIONS if key in block[0]}
    assert checked > 40
    assert {row["plant"] for row in table} == {"ideal"}


def test_intervals_are_those_of_drawing_step_by_step(made_up: Path) -> None:
    """Of the paired difference to the best of those that may be first."""
    trials = recomputed.read(made_up / "trials.csv")
    table = recomputed.read(made_up / "tables" / "success.csv")
    checked = 0
    for setting in ("path", "time"):
        counted = recomputed.that_count(trials, setting)
        may_be = recomputed.may_be_first(trials, setting)
        for key in ("all_percent", "near_singularities_percent", "at_joint_limits_percent"):
            part = _parts(counted, key)
            groups = recomputed.by_contender(part)
            first = max(
                (name for name in groups if name in may_be & recomputed.whole(part)),
                key=lambda name: recomputed.rate(groups[name]),
            )
            for row in table:
                if row["reference"] != setting or contender(row) not in groups:
                    continue
                drawn = recomputed.drawn_differences(part, contender(row), first)
                got = [number(row[f"{key}_{bound}"]) / 100 for bound in ("lower", "upper")]
                for value, share in zip(got, (0.025, 0.975), strict=True):
                    assert recomputed.is_quantile(value, share, drawn), (key, row, value)
                checked += got[0] < got[1]
    assert checked >= 8


def test_stars_are_of_who_may_be_first_and_is_neither_worse_nor_slower(
    made_up: Path, made_up_trials: pd.DataFrame
) -> None:
    """From the intervals in the CSV, and the durations of what was done."""
    trials = recomputed.read(made_up / "trials.csv")
    table = success_table(made_up_trials)
    csv = {(row["reference"], *contender(row)): row
           for row in recomputed.read(made_up / "tables" / "success.csv")}  # fmt: skip
    starred = 0
    for block in table.blocks:
        counted = recomputed.that_count(trials, str(block.reference))
        for place, column in enumerate(table.columns):
            if column.key not in SITUATIONS:
                assert not any(row.cells[place].best for row in block.rows)
                continue
            part = _parts(counted, column.key)
            unseen = {contender(row) for row in part if number(row["sees_constraints"]) == 0}
            may_be = (
                recomputed.may_be_first(trials, str(block.reference)) & recomputed.whole(part)
            ) - unseen
            rows = {name: csv[(block.reference, *name)] for name in may_be}
            upper = {name: number(rows[name][f"{column.key}_upper"]) for name in may_be}
            rates = {name: number(rows[name][column.key]) for name in may_be}
            least = max((rates[name] for name in may_be if upper[name] < 0), default=0.0)
            least = max(least, max(rates.values(), default=0.0) - 10 - 1e-7)
            tied = {n for n in may_be if upper[n] >= 0 and rates[n] > 0 and rates[n] >= least}
            scenarios = {row["scenario"] for row in part}
            said = f"{column.heading} ({len(scenarios)} scenario"
            assert (said in block.note) == (0 < len(scenarios) < 5)
            tied = tied if len(scenarios) >= 5 else set()
            pace = {
                name: median(recomputed.defined(
                    number(row["slow_down"]) for row in part
                    if contender(row) == name and row["outcome"] in recomputed.DONE
                ) or [math.nan])
                for name in tied
            }  # fmt: skip
            fastest = min(recomputed.defined(pace.values()), default=math.nan)
            expected = {name for name in tied if not pace[name] > 1.05 * fastest}
            got = {(row.formulation, row.solver) for row in block.rows if row.cells[place].best}
            assert got == expected, (block.reference, column.key)
            starred += len(got)
    assert starred > 20


def test_the_made_up_study_has_what_the_table_is_about(made_up: Path) -> None:
    """Who is careless, absent, blind or an oracle may not be first; slow ones are, by the clock."""
    trials = recomputed.read(made_up / "trials.csv")
    by_clock = recomputed.may_be_first(trials, "time")
    assert {"good", "twin", "slow[gain=0.5]", "blind"} <= {name for name, _ in by_clock}
    assert not {"careless", "absent", "oracle", "crashy"} & {name for name, _ in by_clock}
    assert ("fair", "daqp") in by_clock


def test_notes_say_what_is_left_out_and_definitions_what_is_in(
    made_up_trials: pd.DataFrame,
) -> None:
    """The far scenario and the odd one, with two seeds each; cases, scenarios, families, robots."""
    table = success_table(made_up_trials)
    said = " ".join(table.notes)
    assert "2 cases that nothing can do and 2 of which no motion is known" in said
    assert "at most 5 % of all trials" in said
    assert "50 % of what the best" in said
    [free] = [column for column in table.columns if column.heading == "free space"]
    words = "5 scenarios of 3 robots, iiwa 2, ur5 2 and panda 1"
    assert free.definition.startswith(f"10 cases ({words}) of 2 families where the path may wait")


@pytest.mark.parametrize("setting", ["path", "time"])
def test_the_sample_of_every_column_stands_beside_the_table(folder: Path, setting: str) -> None:
    """Of each situation: scenarios, robots, scenarios of each, and who has most of the cases."""
    trials = recomputed.read(folder / "trials.csv")
    rows = recomputed.that_count(trials, setting)
    page = (folder / "tables" / "success.md").read_text(encoding="utf-8")
    where = {"path": "the path may wait", "time": "the clock does not wait"}[setting]
    _, heading, block = page.partition(f"\n{where} (")
    assert bool(heading) == bool(rows)
    if not rows:
        return
    note = next(line for line in block.splitlines() if "Samples: " in line).split("Samples: ")[1]
    for situation in {row["situation"] for row in rows}:
        cases = {recomputed.case(r): r["robot"] for r in rows if r["situation"] == situation}
        robots = Counter({scenario: robot for (scenario, _), robot in cases.items()}.values())
        said = note.split(f"{situation}: ")[1].split(". ")[0].removesuffix(".")
        assert said.startswith(f"{sum(robots.values())} scenario")
        for robot, number_of in robots.items():
            assert f"{robot} {number_of}" in said or said.endswith(f"one robot, {robot}")
        robot, most = Counter(cases.values()).most_common(1)[0]
        lead = most > len(cases) / 2 and len(robots) > 1
        assert (f"; {robot} has {most} of the cases" in said) == lead


def test_the_console_shows_every_column_of_seven_situations() -> None:
    """Whole numbers within 120 characters, names of 40 included; who does not see says so."""
    rows = []
    for place, situation in enumerate(SITUATIONS.values()):
        given = {"situation": situation, "sees_constraints": float("nan")}
        if situation == "obstacles or torques":
            given["sees_constraints"] = 0.0
        rows.append(make_rows({f"{'x' * 60}": given, "y": given}, [f"family{place}"]))
    text = to_text(success_table(pd.concat(rows, ignore_index=True)))
    lines = text.splitlines()
    assert max(map(len, lines)) <= 120
    told = lines.index("unseen: does not see them")
    assert lines[told - 1].split()[-3:] == ["100", "100", "7"]
    assert "unseen" in lines[told - 1]
    assert lines[told + 1].startswith("Too few cases for stars: near singularities (1 scenario), ")
    assert "*" not in text


def test_results_without_outcomes_have_an_empty_table() -> None:
    """Which says so, and stars nobody."""
    rows = make_rows({"a": {}, "b": {}}).assign(outcome="", feasible="", situation="", robot="")
    table = success_table(rows)
    assert table.blocks == ()
    assert "Nothing can be said of success" in to_text(table)
