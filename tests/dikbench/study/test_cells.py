"""Cells with scenarios and plants of their own."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from makers.rows import make_rows
from msgspec.structs import replace

from dikbench.errors import DikbenchError
from dikbench.report.sentences.limitations import in_plan
from dikbench.run.timing import to_time
from dikbench.study.plan import expand
from dikbench.study.selection import Selection, select
from dikbench.study.study import Study, TimingSettings, load_study

TEXT = """
description = "Two laws by themselves, one also with noise and with acceleration limits"
scenarios = ["reach"]
plants = ["ideal"]

[[cells]]
formulations = ["dls", "pinv"]

[[cells]]
formulations = ["dls"]
plants = ["ideal[noise=1e-4]", "saturating"]

[[cells]]
formulations = ["dls"]
scenarios = ["reach[acceleration=true]", "step[distance=0.1|0.2]"]
"""

WANTED = {
    ("dls", "reach", "ideal"),
    ("pinv", "reach", "ideal"),
    ("dls", "reach", "ideal[noise=1e-4]"),
    ("dls", "reach", "saturating"),
    ("dls", "reach[acceleration=true]", "ideal"),
    ("dls", "step[distance=0.1]", "ideal"),
    ("dls", "step[distance=0.2]", "ideal"),
}


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """Read the study from a file."""
    file = tmp_path / "cells.toml"
    file.write_text(TEXT)
    return load_study(str(file))


def _planned(study: Study) -> set[tuple[str, str, str]]:
    trials = [p.trial for p in expand(study)]
    assert len(trials) == len({*map(str, trials)})
    return {(str(t.formulation), str(t.scenario), str(t.plant)) for t in trials}


def test_what_a_cell_names_stands_in_place_of_the_studys(study: Study) -> None:
    """The other axis stays that of the study, and no product crosses two cells."""
    assert _planned(study) == WANTED


def test_what_is_selected_replaces_that_of_the_cells(study: Study) -> None:
    """`--plant` and `--scenario` are of all cells; a formulation keeps every cell of it."""

    def selected(selection: Selection) -> set[tuple[str, str, str]]:
        return _planned(select(study, selection, named=True))

    assert selected(Selection(formulations=("dls",))) == {
        cell for cell in WANTED if cell[0] == "dls"
    }
    assert selected(Selection(plants=("ideal[delay=2]",))) == {
        (law, scenario, "ideal[delay=2]") for law, scenario, plant in WANTED if plant == "ideal"
    }
    assert selected(Selection(scenarios=("step",))) == {
        (law, "step", plant) for law, scenario, plant in WANTED if scenario == "reach"
    }


def test_a_law_is_timed_where_its_cells_run_it(study: Study) -> None:
    """Once, whatever the plants; on the chosen scenarios, and not where it hung."""
    timed, planned = replace(study, timing=TimingSettings("dls")), expand(study)
    of = {str(s): [str(law) for law, _ in laws] for s, laws in to_time(timed, planned, {}).items()}
    assert of == {
        "reach": ["dls", "pinv"],
        "reach[acceleration=true]": ["dls"],
        "step[distance=0.1]": ["dls"],
        "step[distance=0.2]": ["dls"],
    }
    chosen = replace(study, timing=TimingSettings("dls", scenarios=("reach", "step[distance=0.2]")))
    assert set(map(str, to_time(chosen, planned, {}))) == {"reach", "step[distance=0.2]"}
    hung = {p.id: "timeout" for p in planned if str(p.trial.scenario) == "step[distance=0.2]"}
    (laws,) = to_time(timed, planned, hung).values()
    assert [str(law) for law, _ in laws] == ["pinv"]


def test_rows_of_every_cell_are_in_the_plan(study: Study) -> None:
    """And what would be a product of two cells is not."""
    cells = [*sorted(WANTED), ("pinv", "reach", "saturating"), ("dls", "step", "ideal")]
    rows = [make_rows({law: {}}, (scenario,), plant=plant) for law, scenario, plant in cells]
    table = pd.concat(rows, ignore_index=True)
    named = {
        "cells": [
            {axis: list(getattr(cell, axis)) for axis in ("formulations", "scenarios", "plants")}
            for cell in study.cells
        ],
        "scenarios": list(study.scenarios),
        "plants": list(study.plants),
    }
    assert list(in_plan(table, named)) == [True] * len(WANTED) + [False] * 2


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ('plants = ["reach"]', r"cells\[0\]\.plants: unknown plant 'reach'"),
        ('scenarios = ["dls"]', r"cells\[0\]\.scenarios: unknown scenario 'dls'"),
        ("plants = 3", r"cells\[0\]\.plants is a whole number; valid: a list of plants"),
    ],
)
def test_what_a_cell_cannot_have_is_one_line(given: str, told: str, tmp_path: Path) -> None:
    """The error says where it stands."""
    file = tmp_path / "bad.toml"
    file.write_text(TEXT.replace('["dls", "pinv"]', f'["dls", "pinv"]\n{given}'))
    with pytest.raises(DikbenchError, match=told):
        load_study(str(file))


def test_a_split_holds_for_scenarios_of_cells_too(study: Study) -> None:
    """Their seeds are the study's, whatever cell has them."""
    with pytest.raises(DikbenchError, match="seed 0 is not in the train split"):
        expand(replace(study, split="train"))
