"""A small run, and what of it is committed."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from makers import short_study
from makers.runs import run_here
from makers.shared import made_once

from dikbench.run.in_workers import RunSettings
from dikbench.study.study import Cells, Study, TimingSettings

STUDY = Study(
    description="two robots with 7 and 3 joints, a list of values, a pair that is skipped",
    cells=(Cells(("dls[damping=0.01]", "dls[damping=1e-1]")), Cells(("lp-alpha",), ("proxqp",))),
    scenarios=("reach[duration=0.2]", "reach[robot=planar3r,duration=0.2]"),
    plants=("ideal[noise=1e-4,delay=2]",),
    timing=TimingSettings("dls", problems=5, rounds=3),
    name="frames",
)


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of the study."""
    return made_once(
        tmp_path_factory,
        "frames",
        lambda folder: run_here(STUDY, folder, RunSettings(jobs=2), "a test"),
    )


@pytest.fixture(scope="session")
def committed(stored: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What of it is committed: no store, no traces."""
    committed = tmp_path_factory.mktemp("committed")
    for name in ("trials.csv", "trials.parquet", "timing.csv", "manifest.json"):
        shutil.copy(stored / name, committed)
    return committed


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a few short trials, run once and left alone."""
    return made_once(
        tmp_path_factory,
        "undisturbed",
        lambda folder: run_here(short_study.STUDY, folder, RunSettings(jobs=2), "a test"),
    )
