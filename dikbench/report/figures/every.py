"""The figures of a report, each made from the results folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from dikbench.report.drawing.figure import Figure
from dikbench.report.drawing.style import style
from dikbench.report.figures.formulation_sweeps import draw_formulation_sweeps
from dikbench.report.figures.joint_margins import draw_joint_margins
from dikbench.report.figures.outcome_bars import draw_outcome_bars
from dikbench.report.figures.phase_diagram import draw_phase_diagrams
from dikbench.report.figures.scenario_sweeps import draw_sweeps
from dikbench.report.figures.success_profile import draw_success_profiles
from dikbench.report.figures.success_scatter import (
    draw_success_against_slow_down,
    draw_success_against_time,
)
from dikbench.report.figures.time_series import draw_time_series
from dikbench.report.figures.time_split import draw_time_split
from dikbench.report.selection.rows import one_solver_each, that_ran
from dikbench.results.folder import ResultsFolder


def draw_figures(
    folder: ResultsFolder, trials: pd.DataFrame, manifest: Mapping[str, Any]
) -> list[Figure]:
    """Draw every figure for which the results have data.

    Args:
        folder: the results folder; figures go to `figures/`.
        trials: the rows of trials.csv.
        manifest: the manifest.
    """
    target = folder.path / "figures"
    target.mkdir(exist_ok=True)
    ran = that_ran(trials)
    if ran.empty:
        return []
    formulations = one_solver_each(ran)
    example = manifest["study"].get("example") or str(ran["scenario"].iloc[0])
    with style():
        return [
            *draw_outcome_bars(trials, target),
            *draw_success_profiles(trials, target),
            *draw_success_against_slow_down(trials, target),
            *draw_success_against_time(trials, target),
            *draw_phase_diagrams(formulations, target),
            *draw_sweeps(formulations, target),
            *draw_time_series(folder, formulations, example, target),
            *draw_joint_margins(folder, formulations, example, target),
            *draw_formulation_sweeps(formulations, target),
            *draw_time_split(ran, target),
        ]
