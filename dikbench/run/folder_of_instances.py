"""The instances of a study, drawn once and kept in its results folder."""

from __future__ import annotations

from functools import partial

from dikbench.plugins.drawing import Cell
from dikbench.results.folder import ResultsFolder
from dikbench.results.instances import read_attempts, write_attempts
from dikbench.run.progress_display import ProgressDisplay
from dikbench.study.instances import Attempt, accepted, draw_missing, numbers_of
from dikbench.study.study import Study


def instances_in(folder: ResultsFolder, study: Study) -> list[Cell]:
    """Return selector and seed of a study's instances; those that its folder lacks are drawn.

    Raises:
        DikbenchError: if one cannot be drawn, or the folder is damaged, in use or cannot be
            written.
    """
    number = len(numbers_of(study)) * len(study.scenarios)
    with ProgressDisplay(number, "instances") as display:
        return accepted(
            draw_missing(study, read_attempts(folder.path), display.advance, partial(_keep, folder))
        )


def _keep(folder: ResultsFolder, attempts: list[Attempt]) -> None:
    with folder.lock():
        write_attempts(folder.path, attempts)
