"""Who leads in each situation, and without each robot or family."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from dikbench.report.tables.leads import leads_table
from dikbench.report.tables.success import success_table
from dikbench.results.selected import with_selected

QUICK = Path(__file__).parents[4] / "results" / "quick" / "trials.parquet"


def test_the_first_of_the_table_of_success_lead_with_all_cases() -> None:
    """Where nothing is left out the highest rate is that of a star, and of nobody below it."""
    trials = with_selected(pd.read_parquet(QUICK))
    found, table = leads_table(trials), success_table(trials)
    whole = found[found["left_out"].eq("")]
    assert len(whole)
    rows: list[dict[Any, Any]] = whole.to_dict("records")
    for row in rows:
        (block,) = (each for each in table.blocks if each.reference == row["setting"])
        (column,) = (k for k, each in enumerate(table.columns) if each.heading == row["situation"])
        stars = {
            f"{each.formulation} with {each.solver}".removesuffix(" with none"): each.cells[column]
            for each in block.rows
            if each.cells[column].best
        }
        leaders = row["leaders"].split("; ")
        assert max(cell.value for cell in stars.values()) == pytest.approx(row["success_percent"])
        for name, cell in stars.items():
            assert (name in leaders) <= (cell.value == pytest.approx(row["success_percent"]))


def test_every_robot_and_family_is_left_out_once() -> None:
    """If others are left."""
    trials = with_selected(pd.read_parquet(QUICK))
    found = leads_table(trials)
    for situation, part in found.groupby("situation"):
        rows = trials[
            trials["situation"].eq(str(situation)) & trials["feasible"].isin(["time", "path"])
        ]
        robots = part.loc[part["left_out"].eq("robot"), "name"]
        assert set(robots) <= set(rows["robot"])
        assert set(robots.value_counts()) <= {1, 2}  # once in each setting
