"""A small run whose trials are replayed."""

from __future__ import annotations

from pathlib import Path

import pytest
from makers.runs import run_here
from makers.shared import made_once

from dikbench.run.in_workers import RunSettings
from dikbench.study.study import Cells, Study

STUDY = Study(
    description="an arm with meshes and one without, a fast formulation, a step without a path",
    cells=(Cells(("pinv",)),),
    scenarios=(
        "speed-sweep[robot=planar3r,laps=1,speed=1.5]",
        "reach[robot=ur5,duration=0.2]",
    ),
    plants=("ideal",),
    name="viewed",
)


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which `dikbench run` has left `runs/viewed`."""
    return made_once(
        tmp_path_factory,
        "viewer",
        lambda folder: run_here(STUDY, folder / "runs" / "viewed", RunSettings(jobs=1), "a test"),
    )
