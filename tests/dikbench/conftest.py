"""A small run that several test modules look at."""

from __future__ import annotations

from pathlib import Path

import pytest
from makers.runs import briefly_timed, not_played, run_here
from makers.shared import made_once

from dikbench.report.write import write_report
from dikbench.run.in_workers import RunSettings
from dikbench.study.selection import Selection, select
from dikbench.study.study import load_study


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small run with every kind of law, a skipped pair and a path-indexed run."""
    return made_once(tmp_path_factory, "smoke", _run)


def _run(out: Path) -> None:
    selection = Selection(
        scenarios=("reach[dt=0.05]", "near-miss[miss=0.02,dt=0.03]"),
        references=("time", "path"),
        seeds=(0, 1),
    )
    study = briefly_timed(select(load_study("smoke"), selection, named=True))
    run_here(study, out, RunSettings(jobs=1), "a test")
    with not_played():
        write_report(out)
