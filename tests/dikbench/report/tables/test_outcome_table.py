"""The table of outcomes, recomputed with csv and math alone."""

from __future__ import annotations

import math
from pathlib import Path
from statistics import fmean

import pytest
from makers import recomputed
from makers.recomputed import DONE, Row, contender, number
from makers.rows import make_rows

from dikbench.report.tables.outcomes import outcome_table

OUTCOMES = (
    "did-not-run", "diverged", "collided", "limit-broken", "left-path", "unfinished", "late",
    "not-recovered", "chattering", "success", "recovered",
)  # fmt: skip


def _rate(rows: list[Row], tolerance: float | None = None, *, chatter: bool = True) -> float:
    def done(row: Row) -> bool:
        at = number(row["tolerance_m"]) if tolerance is None else tolerance
        return recomputed.outcome_at(row, at, chatter=chatter) in DONE

    return 100 * recomputed.rate(rows, done)


def test_outcomes_add_up_and_rates_are_those_of_other_tolerances(folder: Path) -> None:
    """Every number of the table but that of forgiven speeds, in both settings."""
    if not (folder / "tables" / "outcomes.csv").is_file():
        pytest.fail("there is no table of outcomes")
    trials = recomputed.read(folder / "trials.csv")
    table = recomputed.read(folder / "tables" / "outcomes.csv")
    checked = 0
    for setting in ("path", "time"):
        groups = recomputed.by_contender(recomputed.that_count(trials, setting))
        block = [row for row in table if row["reference"] == setting]
        assert {contender(row) for row in block} == set(groups)
        for row in block:
            own = groups[contender(row)]
            counts = {name: int(row[name.replace("-", "_")]) for name in OUTCOMES}
            for name, count in counts.items():
                assert count == sum(trial["outcome"] == name for trial in own), (name, row)
            assert sum(counts.values()) == int(row["trials"]) == len(own)
            expected = {
                "success_percent": 100 * recomputed.rate(own),
                "without_chatter_percent": _rate(own, chatter=False),
                "at_2_mm_percent": _rate(own, 0.002),
                "at_20_mm_percent": _rate(own, 0.02),
            }
            facts = recomputed.with_facts(trials)
            coped = recomputed.defined(
                number(trial["coped"])
                for trial in recomputed.those_that_ran(facts)
                if contender(trial) == contender(row) and trial["feasible"] == "no"
                and trial["plant"] == "ideal" and trial["reference"] == setting
            )  # fmt: skip
            expected["coped_percent"] = 100 * fmean(coped) if coped else math.nan
            for key, value in expected.items():
                assert number(row[key]) == pytest.approx(value, nan_ok=True), (key, row)
                checked += 1
    assert checked > 20


@pytest.mark.parametrize(
    ("changed", "forgiven"),
    [
        ({}, True),
        ({"velocity_peak_ratio": 1.051}, False),
        ({"acceleration_violation_max_rad_s2": 1e-3}, False),
        ({"position_violation_max_rad": 1e-3}, False),
        ({"torque_usage_max": 1.01}, False),
        ({"distance_violation_max_m": 1e-4}, False),
        ({"contour_error_6d_max_m": 0.1}, False),
        ({"chatters": 1.0}, False),
        ({"status": "protective-stop"}, False),
        ({"decided_before": "collided", "outcome": "collided"}, False),
    ],
)
def test_only_a_speed_up_to_five_percent_is_forgiven(
    changed: dict[str, object], forgiven: bool
) -> None:
    """Where nothing else is in the way of success."""
    broken = {"outcome": "limit-broken", "decided_before": "limit-broken"}
    rows = make_rows({"a": {**broken, "velocity_peak_ratio": 1.04, **changed}})
    table = outcome_table(rows)
    place = [column.key for column in table.columns].index("at_105_percent_speed_percent")
    assert table.blocks[0].rows[0].cells[place].value == 100.0 * forgiven


def test_outcomes_that_did_not_occur_stand_in_the_csv_alone() -> None:
    """The table shows what there is."""
    table = outcome_table(make_rows({"a": {}, "b": {"outcome": "late"}}))
    shown = [table.columns[place].key for place in table.shown]
    assert shown[:3] == ["trials", "late", "success"]
    assert len(table.columns) == 19
    assert outcome_table(make_rows({"a": {}}).assign(feasible="", outcome="")).blocks == ()
