"""A study of a few short trials, whose results several test modules look at."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Final

import msgspec
import pandas as pd

from dikbench.results.reading import load_results
from dikbench.results.store import Store
from dikbench.study.study import Cells, Study

STUDY: Final = Study(
    description="a few short trials",
    cells=(Cells(("dls", "pinv[after=clip]")), Cells(("qp",), ("daqp[interface=warm]",))),
    scenarios=("reach[duration=0.2]", "speed-sweep[laps=1,speed=2.5]"),
    plants=("ideal",),
    name="short",
)


TIMELESS: Final = ["wall_time_s", "control_time_s", "environment", "run"]


def table(folder: Path) -> pd.DataFrame:
    """Every column of the trials but the times and the worker's environment."""
    return load_results(folder).trials.drop(columns=TIMELESS)


def first_row(store: Store) -> dict[str, Any]:
    """The first trial of a store, as numbers and texts of Python's."""
    return {str(name): value for name, value in store.trials().iloc[0].to_dict().items()}


SCRIPT: Final = """
import sys
from pathlib import Path
sys.path.insert(0, {folder!r})
from study_of_test import STUDY
from dikbench.run.in_workers import RunSettings
from dikbench.run.runner import run_study

if __name__ == "__main__":
    run_study(STUDY, Path({out!r}), RunSettings(jobs={jobs}), "a script")
"""


def script_of(study: Study, folder: Path, jobs: int) -> list[str]:
    """The command that runs a study into `out` in this folder, in a process of its own."""
    (folder / "study_of_test.py").write_text(
        "import msgspec\nfrom dikbench.study.study import Study\n"
        f"STUDY = msgspec.convert({msgspec.to_builtins(study)!r}, Study)\n"
    )
    script = folder / "script.py"
    script.write_text(SCRIPT.format(folder=str(folder), out=str(folder / "out"), jobs=jobs))
    return [sys.executable, str(script)]
