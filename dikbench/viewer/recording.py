"""The record of one trial: its row, its trace, its scenario."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from dikbench.errors import DikbenchError
from dikbench.plugins.building import make_scenario
from dikbench.results.columns import TRIAL
from dikbench.results.exports import TRIALS
from dikbench.results.folder import ResultsFolder
from dikbench.results.reading import read_results
from dikbench.scenario.scenario import Scenario
from dikbench.simulation.trace import Trace
from dikbench.study.identity import trial_id
from dikbench.study.trial import Trial

TRIALS_NAMED: Final = 5
"""Trials that are named where the beginning of an id is not unique."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One trial as it was recorded.

    Attributes:
        id: id of the trial.
        trial: its selectors.
        status: its status.
        trace: its trace.
        scenario: its scenario, built again.
    """

    id: str
    trial: Trial
    status: str
    trace: Trace
    scenario: Scenario

    @property
    def is_current(self) -> bool:
        """Whether formulation and scenario still have the source with which the trial was run."""
        return trial_id(self.trial) == self.id


def find_recording(text: str, results: Path | None = None) -> Recording:
    """Find a trial.

    Args:
        text: its id, the beginning of it, or the file of its trace.
        results: the results folder; default: the one around the trace, or the newest of runs/*.

    Raises:
        DikbenchError: if there is no such trial, more than one, or it has no trace.
    """
    file = Path(text) if text.endswith(".arrow") else None
    if file is not None:
        if not file.is_file():
            raise DikbenchError(f"trace not found: {file}")
        results = results or file.absolute().parents[1]
        text = file.stem
    folder = ResultsFolder(results or newest_results(Path("runs")))
    rows = read_results(folder.path).trials
    found = rows[rows["id"].str.startswith(text)].to_dict("records")
    if len(found) != 1:
        raise DikbenchError(_which(text, found, folder.path))
    row, trace = found[0], file or folder.trace(found[0]["id"])
    if not trace.is_file():
        raise DikbenchError(
            f"trial {row['id']} ({row['status']}) has no trace in {folder.traces}; "
            "`dikbench run --traces all` keeps them"
        )
    trial = Trial.of(**{name: row[name] for name in TRIAL})
    scenario = make_scenario(trial.scenario, trial.seed)
    return Recording(row["id"], trial, row["status"], Trace.load(trace), scenario)


def newest_results(runs: Path) -> Path:
    """Return the folder below `runs` whose results were written last.

    Raises:
        DikbenchError: if there is none.
    """
    written = {
        folder: max(file.stat().st_mtime for file in files)
        for folder in (runs.iterdir() if runs.is_dir() else ())
        if (files := [f for f in (folder / "results.sqlite", folder / TRIALS) if f.is_file()])
    }
    if not written:
        raise DikbenchError(f"no results below {runs.absolute()}: name a folder with --results")
    return max(written, key=written.__getitem__)


def _which(text: str, found: list[Any], folder: Path) -> str:
    if not found:
        return f"no trial of {folder} has an id that begins with {text!r}; {TRIALS} has them all"
    names = ", ".join(row["id"] for row in found[:TRIALS_NAMED])
    more = ", ..." if len(found) > TRIALS_NAMED else ""
    return f"{len(found)} trials of {folder} begin with {text!r}: {names}{more}"
