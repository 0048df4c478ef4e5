"""What tables say beside their numbers: limits just broken or in force, and medians of what."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from makers.rows import make_rows

from dikbench.report.tables.build import make_table
from dikbench.report.tables.console import to_text
from dikbench.report.tables.csv_table import to_csv
from dikbench.report.tables.kinds import LIMIT_VIOLATION, TIMING
from dikbench.report.tables.latex_table import to_latex
from dikbench.report.tables.markdown import to_markdown
from dikbench.report.tables.solver_axis import solver_axis
from dikbench.report.tables.table import Table, shown


def _value(table: Table, key: str) -> float:
    """The first number of a column."""
    place = [column.key for column in table.columns].index(key)
    return table.blocks[0].rows[0].cells[place].value


@given(st.floats(0.99, 1.01), st.sampled_from([1.001, 1.0, 0.9995]))
def test_what_breaks_a_limit_is_not_rounded_to_what_keeps_it(value: float, most: float) -> None:
    """As it is read it is on the side on which it is; else it has three digits."""
    text = shown(value, most)
    assert (float(text) > most) >= (value > most)
    assert math.isclose(float(text), value, rel_tol=5.001e-3)
    assert value > most or text == shown(value)


def test_a_speed_just_beyond_its_limit_is_seen_to_be_in_every_form() -> None:
    """1.0012 breaks the limit, and is counted as stopped; 1.0005 keeps it, and is 1."""
    fast = {"outcome": "limit-broken", "decided_before": "limit-broken"}
    table = make_table(
        LIMIT_VIOLATION,
        make_rows(
            {"a": {**fast, "velocity_peak_ratio": 1.0012}, "b": {"velocity_peak_ratio": 1.0005}}
        ),
    )
    for text, just_beyond in (
        (to_text(table), "1.0012"), (to_markdown(table), "1.0012"), (to_latex(table), "$>$1 "),
    ):  # fmt: skip
        of = {name: line for line in text.splitlines() for name in "ab"
              if line.lstrip("| ").startswith(f"{name} ")}  # fmt: skip
        assert of["a"].count(just_beyond) == 3
        assert "1.00" not in of["b"]
        assert ">" not in of["b"]


@pytest.mark.parametrize(
    ("scenario", "above", "in_force"),
    [("reach", 0.0, False), ("reach[acceleration=false]", 0.0, False), ("reach", 0.5, True),
     ("reach[acceleration=true]", 0.0, True), ("reach[acceleration=10]", 0.0, True)],
)  # fmt: skip
def test_accelerations_stand_where_limits_of_them_are_in_force(
    scenario: str, above: float, in_force: bool
) -> None:
    """Asked for, or seen to be broken; else a sentence says that no run had them."""
    rows = make_rows(
        {"a": {"acceleration_violation_max_rad_s2": [above, 0.0]}}, [scenario, "step"]
    ).assign(torque_usage_max=np.nan, distance_violation_max_m=0.1)
    table = make_table(LIMIT_VIOLATION, rows)
    headings = [table.columns[place].heading for place in table.shown]
    assert ("acceleration above limit worst [rad/s2]" in headings) == in_force
    said = " ".join(table.notes)
    assert ("limits of acceleration" in said) == (not in_force)
    assert "limits of torque: these have no column here" in said
    assert "distances to keep" not in said
    assert ("in force in 1 of 2 scenarios, of which 1 counts in the table" in said) == in_force
    unknown = make_table(LIMIT_VIOLATION, rows.assign(feasible="no"))
    assert ("of which none count in" in " ".join(unknown.notes)) == in_force
    assert "acceleration_above_limit_rad_s2_worst" in to_csv(table)


def test_every_table_says_over_what_its_medians_are() -> None:
    """Of two runs the median is one that occurred, the better one; of solvers' times the mean."""
    timed = {
        "formulation_time_median_us": [10.0, 30.0],
        "timing_stability": "stable",
        "velocity_peak_ratio": [0.2, 0.4],
    }
    rows = make_rows({("a", "s"): timed}, ("reach", "step"))
    for kind, key, value in (
        (LIMIT_VIOLATION, "speed_over_limit_median", 0.2),
        (TIMING, "median_call_median_ms", 0.01),
    ):
        table = make_table(kind, rows)
        assert _value(table, key) == pytest.approx(value)
        assert "of them do not exceed, which occurred" in " ".join(table.notes)
        assert "each counting once" in " ".join(table.notes)
    axis = solver_axis(rows)
    assert _value(axis, "median_ms") == pytest.approx(0.02)
    assert "of an even number the mean of the two in the middle" in " ".join(axis.notes)
