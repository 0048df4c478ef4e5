"""The controls of the page, of rows in which there is little to choose."""

from __future__ import annotations

import pandas as pd
import pytest

from dikbench.report.interactive.controls import controls

COLUMNS = ("plant", "robot", "solver", "situation", "reference", "variant", "contender")


@pytest.mark.parametrize("unknown", [*COLUMNS, ()])
def test_what_leaves_nothing_to_choose_has_no_control(unknown: str | tuple[()]) -> None:
    """One row of a target at rest, with a column that is empty; as of a run of one step target."""
    row = {
        "plant": "ideal", "robot": "ur5", "solver": "none", "situation": "step",
        "reference": "rest", "variant": "default", "contender": "dls",
    }  # fmt: skip
    if unknown:
        row[unknown] = ""
    found = {each.name: each for each in controls(pd.DataFrame([row]))}
    assert not {"reference", "situation", "robot", "plant"} & set(found)
    assert all(each.value in dict(each.options) for each in found.values())
