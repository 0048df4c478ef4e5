"""A folder of made-up trials with the tables that are made of them."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from makers.made_up import made_up_study
from makers.shared import made_once

from dikbench.report.tables.build import make_table
from dikbench.report.tables.files import write_table
from dikbench.report.tables.kinds import KINDS
from dikbench.report.tables.outcomes import outcome_table
from dikbench.report.tables.solver_axis import solver_axis
from dikbench.report.tables.success import success_table
from dikbench.results.selected import with_selected


@pytest.fixture(scope="session")
def made_up_trials() -> pd.DataFrame:
    """The rows as a report reads them."""
    return with_selected(made_up_study())


@pytest.fixture(scope="session")
def made_up(tmp_path_factory: pytest.TempPathFactory, made_up_trials: pd.DataFrame) -> Path:
    """The folder: trials.csv and tables/."""

    def write(folder: Path) -> None:
        made_up_study().to_csv(folder / "trials.csv", index=False)
        every = [table(made_up_trials) for table in (success_table, outcome_table, solver_axis)]
        for table in (*every, *(make_table(kind, made_up_trials) for kind in KINDS)):
            write_table(table, folder / "tables")

    return made_once(tmp_path_factory, "made_up", write)


@pytest.fixture(params=["a real run", "made-up trials"])
def folder(request: pytest.FixtureRequest) -> Path:
    """Each of two folders: that of a small run, and that of made-up trials."""
    name = "results" if request.param == "a real run" else "made_up"
    found: Path = request.getfixturevalue(name)
    return found
